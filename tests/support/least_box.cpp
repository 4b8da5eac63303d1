// SPDX-License-Identifier: BSD-3-Clause
#include "support/least_box.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/geometry/shape/triangle_p.h>

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

/// Points of the shape, in its own axes, among which is the farthest in the direction `to`.
template <typename S>
std::vector<Point> farthest(const fcl::CollisionGeometry<S>& shape, const Point& to) {
  const auto toPoint = [](const fcl::Vector3<S>& v) { return Point(v.template cast<Real>()); };
  switch (shape.getNodeType()) {
    case fcl::GEOM_BOX: {
      const Point half = toPoint(static_cast<const fcl::Box<S>&>(shape).side) / 2;
      return cornersOf({-half, half});
    }
    case fcl::GEOM_SPHERE:
      return {Real(static_cast<const fcl::Sphere<S>&>(shape).radius) * to / to.norm()};
    case fcl::GEOM_CAPSULE: {
      const auto& capsule = static_cast<const fcl::Capsule<S>&>(shape);
      const Point around = Real(capsule.radius) * to / to.norm();
      return {around + Point(0, 0, Real(capsule.lz) / 2),
              around - Point(0, 0, Real(capsule.lz) / 2)};
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
    box.min[axis] = position[axis] + low;
    box.max[axis] = position[axis] + high;
  }
  return box;
}

template ExactBox leastBox(const fcl::CollisionObject<float>&);
template ExactBox leastBox(const fcl::CollisionObject<double>&);

}  // namespace fcl_fibers::test
