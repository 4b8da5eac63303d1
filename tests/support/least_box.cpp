// SPDX-License-Identifier: BSD-3-Clause
#include "support/least_box.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/geometry/shape/triangle_p.h>

#include "support/mesh_models.h"
#include "support/polytope_oracle.h"

namespace fcl_fibers::test {
namespace {

std::vector<Point> cornersOf(const ExactBox& box) {
  std::vector<Point> corners;
  for (const Real x : {box.min[0], box.max[0]}) {
    for (const Real y : {box.min[1], box.max[1]}) {
      for (const Real z : {box.min[2], box.max[2]}) corners.emplace_back(x, y, z);
    }
  }
  return corners;
}

/// The point of a disc of this radius at this height that is farthest to `to`.
Point farthestOfDisc(Real radius, Real height, const Point& to) {
  const Real across = std::hypot(to[0], to[1]);
  if (across == 0) return {0, 0, height};
  return {radius * to[0] / across, radius * to[1] / across, height};
}

/// How thick a capsule or sphere is. Balls stay balls if a rotation has drifted.
template <typename S>
Real thicknessOf(const fcl::CollisionGeometry<S>& shape) {
  switch (shape.getNodeType()) {
    case fcl::GEOM_SPHERE:
      return Real(static_cast<const fcl::Sphere<S>&>(shape).radius);
    case fcl::GEOM_CAPSULE:
      return Real(static_cast<const fcl::Capsule<S>&>(shape).radius);
    default:
      return 0;
  }
}

/// Points of the shape less its thickness, in its own axes, among which is the farthest in the
/// direction `to`.
template <typename S>
std::vector<Point> farthest(const fcl::CollisionGeometry<S>& shape, const Point& to) {
  const auto toPoint = [](const fcl::Vector3<S>& v) { return Point(v.template cast<Real>()); };
  switch (shape.getNodeType()) {
    case fcl::GEOM_BOX: {
      const Point half = toPoint(static_cast<const fcl::Box<S>&>(shape).side) / 2;
      return cornersOf({-half, half});
    }
    case fcl::GEOM_SPHERE:
      return {Point::Zero()};
    case fcl::GEOM_CAPSULE: {
      const Point end(0, 0, Real(static_cast<const fcl::Capsule<S>&>(shape).lz) / 2);
      return {end, -end};
    }
    case fcl::GEOM_CYLINDER: {
      const auto& cylinder = static_cast<const fcl::Cylinder<S>&>(shape);
      return {farthestOfDisc(cylinder.radius, Real(cylinder.lz) / 2, to),
              farthestOfDisc(cylinder.radius, -Real(cylinder.lz) / 2, to)};
    }
    case fcl::GEOM_CONE: {
      const auto& cone = static_cast<const fcl::Cone<S>&>(shape);
      return {Point(0, 0, Real(cone.lz) / 2), farthestOfDisc(cone.radius, -Real(cone.lz) / 2, to)};
    }
    case fcl::GEOM_ELLIPSOID: {
      const Point radii = toPoint(static_cast<const fcl::Ellipsoid<S>&>(shape).radii);
      const Point stretched = radii.cwiseProduct(to);
      const Real length = stretched.norm();
      if (length == 0) return {Point::Zero()};
      return {radii.cwiseProduct(stretched) / length};
    }
    case fcl::GEOM_CONVEX: {
      std::vector<Point> points;
      for (const auto& v : static_cast<const fcl::Convex<S>&>(shape).getVertices()) {
        points.push_back(toPoint(v));
      }
      return points;
    }
    case fcl::GEOM_TRIANGLE: {
      const auto& triangle = static_cast<const fcl::TriangleP<S>&>(shape);
      return {toPoint(triangle.a), toPoint(triangle.b), toPoint(triangle.c)};
    }
    default:
      return cornersOf({toPoint(shape.aabb_local.min_), toPoint(shape.aabb_local.max_)});
  }
}

}  // namespace

template <typename S>
ExactBox leastBox(const fcl::CollisionObject<S>& object) {
  const fcl::CollisionGeometry<S>& shape = *object.collisionGeometry();
  const fcl::NODE_TYPE type = shape.getNodeType();
  if (type == fcl::GEOM_PLANE || type == fcl::GEOM_HALFSPACE) {
    return {object.getAABB().min_.template cast<Real>(),
            object.getAABB().max_.template cast<Real>()};
  }
  const Eigen::Matrix<Real, 3, 3> turn = object.getRotation().template cast<Real>();
  const Point position = object.getTranslation().template cast<Real>();
  ExactBox box;
  for (int axis = 0; axis < 3; ++axis) {
    Real low = std::numeric_limits<Real>::max(), high = -low;
    for (const Real sign : {Real(-1), Real(1)}) {
      for (const Point& p : farthest(shape, Point(sign * turn.row(axis).transpose()))) {
        low = std::min(low, turn.row(axis).dot(p));
        high = std::max(high, turn.row(axis).dot(p));
      }
    }
    // Of a pose that FCL takes for a translation, the local box alone counts.
    if (shape.getObjectType() != fcl::OT_GEOM && !object.getRotation().isIdentity()) {
      const Real middle = turn.row(axis).dot(shape.aabb_center.template cast<Real>());
      const Real ball = Real(shape.aabb_radius) * turn.row(axis).norm();
      low = std::max(low, middle - ball);
      high = std::min(high, middle + ball);
    }
    box.min[axis] = position[axis] + low - thicknessOf(shape);
    box.max[axis] = position[axis] + high + thicknessOf(shape);
  }
  return box;
}

namespace {

template <typename S>
std::vector<ExactTriangle> trianglesOf(const fcl::CollisionGeometry<S>& shape,
                                       const Eigen::Matrix<Real, 3, 3>& turn,
                                       const Point& position) {
  const auto corner = [&](const fcl::Vector3<S>& p) {
    return Point(turn * p.template cast<Real>() + position);
  };
  std::vector<ExactTriangle> triangles;
  if (shape.getNodeType() == fcl::GEOM_TRIANGLE) {
    const auto& triangle = static_cast<const fcl::TriangleP<S>&>(shape);
    triangles.push_back({corner(triangle.a), corner(triangle.b), corner(triangle.c)});
  }
  if (shape.getObjectType() != fcl::OT_BVH) return triangles;
  const auto model = arraysOf(const_cast<fcl::CollisionGeometry<S>&>(shape));
  for (int t = 0; t < model.triangle_count; ++t) {
    const fcl::Triangle& i = model.triangles[t];
    triangles.push_back(
        {corner(model.points[i[0]]), corner(model.points[i[1]]), corner(model.points[i[2]])});
  }
  return triangles;
}

template <typename S, class Plane>
std::function<Real(const Point&)> heightAbove(const Plane& plane,
                                              const Eigen::Matrix<Real, 3, 3>& turn,
                                              const Point& position) {
  // Normals are not turned like points if the rotation has drifted.
  const Point normal = turn.inverse().transpose() * plane.n.template cast<Real>();
  const Real offset = Real(plane.d) + normal.dot(position);
  return [=](const Point& p) { return Real((normal.dot(p) - offset) / normal.norm()); };
}

}  // namespace

template <typename S>
std::function<Real(const Point&, const Point&)> distanceFrom(
    const fcl::CollisionObject<S>& object) {
  const fcl::CollisionGeometry<S>& shape = *object.collisionGeometry();
  const Eigen::Matrix<Real, 3, 3> turn = object.getRotation().template cast<Real>();
  const Point position = object.getTranslation().template cast<Real>();
  if (shape.getNodeType() == fcl::GEOM_HALFSPACE) {
    const auto above = heightAbove<S>(static_cast<const fcl::Halfspace<S>&>(shape), turn, position);
    return [=](const Point& a, const Point& b) {
      return std::max(Real(0), std::min(above(a), above(b)));
    };
  }
  if (shape.getNodeType() == fcl::GEOM_PLANE) {
    const auto above = heightAbove<S>(static_cast<const fcl::Plane<S>&>(shape), turn, position);
    return [=](const Point& a, const Point& b) {
      return std::max({Real(0), std::min(above(a), above(b)), -std::max(above(a), above(b))});
    };
  }
  if (shape.getNodeType() == fcl::GEOM_CONVEX) {
    std::vector<Point> vertices;
    for (const Point& p : farthest(shape, Point::UnitX())) {
      vertices.push_back(turn * p + position);
    }
    return [=](const Point& a, const Point& b) {
      std::vector<std::array<Real, 3>> differences;
      for (const Point& end : {a, b}) {
        for (const Point& p : vertices) {
          differences.push_back({end.x() - p.x(), end.y() - p.y(), end.z() - p.z()});
        }
      }
      const Quotient<Real> squared = squaredDistanceToHull(differences);
      return Real(std::sqrt(squared.above / squared.below));
    };
  }
  const std::vector<ExactTriangle> triangles = trianglesOf(shape, turn, position);
  if (!triangles.empty()) {
    return [=](const Point& a, const Point& b) {
      Real least = std::numeric_limits<Real>::infinity();
      for (const ExactTriangle& t : triangles) {
        // Most are farther away than the nearest corner so far.
        const Point middle = (a + b) / 2;
        const Real reach = (b - a).norm() / 2 + std::max((t.b - t.a).norm(), (t.c - t.a).norm());
        if ((t.a - middle).norm() - reach > least) continue;
        least = std::min(least, segmentTriangleDistance(a, b, t));
      }
      return least;
    };
  }
  ExactBox local;
  for (int axis = 0; axis < 3; ++axis) {
    local.min[axis] = std::numeric_limits<Real>::max();
    local.max[axis] = -local.min[axis];
    for (const Real sign : {Real(-1), Real(1)}) {
      for (const Point& p : farthest(shape, Point(sign * Point::Unit(axis)))) {
        local.min[axis] = std::min(local.min[axis], p[axis]);
        local.max[axis] = std::max(local.max[axis], p[axis]);
      }
    }
  }
  // A rotation that has drifted makes a parallelepiped of a box.
  std::vector<Point> corners = cornersOf(local);
  for (Point& p : corners) p = turn * p + position;
  std::vector<ExactTriangle> faces;
  for (const auto& [a, b, c, d] : std::initializer_list<std::array<std::size_t, 4>>{
           {0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}}) {
    faces.push_back({corners[a], corners[b], corners[c]});
    faces.push_back({corners[a], corners[c], corners[d]});
  }
  const Eigen::Matrix<Real, 3, 3> back = turn.inverse();
  return [=](const Point& a, const Point& b) {
    const Point inside = back * (a - position);
    if ((inside.array() >= local.min.array()).all() && (inside.array() <= local.max.array()).all())
      return Real(0);
    Real least = std::numeric_limits<Real>::infinity();
    for (const ExactTriangle& t : faces) least = std::min(least, segmentTriangleDistance(a, b, t));
    return least;
  };
}

template <typename S>
std::vector<ExactTriangle> trianglesOf(const fcl::CollisionObject<S>& object) {
  if (object.getObjectType() != fcl::OT_BVH) return {};
  return trianglesOf(*object.collisionGeometry(), object.getRotation().template cast<Real>(),
                     object.getTranslation().template cast<Real>());
}

template std::vector<ExactTriangle> trianglesOf(const fcl::CollisionObject<float>&);
template std::vector<ExactTriangle> trianglesOf(const fcl::CollisionObject<double>&);
template std::function<Real(const Point&, const Point&)> distanceFrom(
    const fcl::CollisionObject<float>&);
template std::function<Real(const Point&, const Point&)> distanceFrom(
    const fcl::CollisionObject<double>&);
template ExactBox leastBox(const fcl::CollisionObject<float>&);
template ExactBox leastBox(const fcl::CollisionObject<double>&);

}  // namespace fcl_fibers::test
