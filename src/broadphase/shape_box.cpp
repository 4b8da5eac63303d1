// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/shape_box.h"

#include <algorithm>
#include <array>
#include <type_traits>

#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/triangle_p.h>

#include "broadphase/object_reader.h"
#include "geometry/point_boxes.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::AffineMap;
using geometry::Obstacle;
using geometry::Vec3d;

constexpr const char* kBadRadii =
    "a radius is negative, NaN or infinite; give it finite radii of 0 or more";
constexpr const char* kBadVertices =
    "it has no vertices, or one that is NaN or infinite; give it finite vertices";
constexpr const char* kNoLocalBox =
    "its box is empty or NaN; give it a non-empty shape and call computeLocalAABB()";

// The columns of a pose's rotation may have drifted. They are used as they are.

/// The apex is above, the disc below.
ShapeBox boxOfCone(const AffineMap& pose, double radius, double length) {
  const Vec3d apex = (length / 2) * pose.column[2], disc = radius * discHalf(pose);
  const Vec3d local{radius, radius, length / 2}, foot = -1.0 * apex;
  const Corners posed = {min(apex, foot - disc), max(apex, foot + disc)};
  return {around({0, 0, 0}, local), posed, squaredNorm(local),
          maxNorm(max(abs(posed.low), abs(posed.high))), true};
}

ShapeBox boxOfEllipsoid(const AffineMap& pose, const Vec3d& radii) {
  // Squares of the radii themselves could overflow or vanish.
  const double largest = maxNorm(radii), unit = largest > 0 ? largest : 1;
  const Vec3d p = (radii.x / unit) * pose.column[0], q = (radii.y / unit) * pose.column[1],
              r = (radii.z / unit) * pose.column[2];
  const Vec3d half{std::sqrt(p.x * p.x + q.x * q.x + r.x * r.x),
                   std::sqrt(p.y * p.y + q.y * q.y + r.y * r.y),
                   std::sqrt(p.z * p.z + q.z * q.z + r.z * r.z)};
  return ShapeBox::symmetric(radii, largest * half);
}

/// @param points  Eigen's vectors, which follow each other in memory
template <class Points>
geometry::PointsOfProgram pointsOf(const Points& points) {
  static_assert(sizeof(points[0]) == 3 * sizeof(points[0][0]));
  geometry::PointsOfProgram found;
  const auto* first = points.empty() ? nullptr : points[0].data();
  if constexpr (std::is_same_v<decltype(first), const double*>) {
    found.doubles = first;
  } else {
    found.floats = first;
  }
  found.count = points.size();
  return found;
}

/// @return whether there are vertices, all of them finite
bool boxOfVertices(const AffineMap& pose, const geometry::PointsOfProgram& vertices,
                   ShapeBox& box) {
  const geometry::PointBoxes found = vertices.doubles != nullptr
                                         ? geometry::boxesOf(vertices.doubles, vertices.count, pose)
                                         : geometry::boxesOf(vertices.floats, vertices.count, pose);
  box = {{found.low, found.high}, {found.posed_low, found.posed_high}, 0, 0, true};
  for (const Corners& corners : {box.local, box.posed}) {
    box.reach = std::max({box.reach, maxNorm(corners.low), maxNorm(corners.high)});
  }
  box.ball_squared = squaredNorm(box.local.half());
  return found.is_proper;
}

/// Returns entry * side, but an open side adds nothing along an axis where its entry is at most
/// `none`.
double product(double entry, double side, double none) {
  return std::fabs(entry) <= none && std::isinf(side) ? 0 : entry * side;
}

/// Adds the part of the box around a posed box that one of its columns makes, and the largest
/// coordinate of it that is finite.
FCL_FIBERS_ALWAYS_INLINE void addColumn(const Vec3d& column, double low, double high, double none,
                                        Corners& posed, double& reach) {
  Vec3d p = low * column, q = high * column;
  if (std::isfinite(low) && std::isfinite(high)) {
    reach = std::max({reach, maxNorm(p), maxNorm(q)});
  } else {
    p = {product(column.x, low, none), product(column.y, low, none), product(column.z, low, none)};
    q = {product(column.x, high, none), product(column.y, high, none),
         product(column.z, high, none)};
    for (const double x : {p.x, p.y, p.z, q.x, q.y, q.z}) {
      reach = std::isfinite(x) ? std::max(reach, std::fabs(x)) : reach;
    }
  }
  posed = {posed.low + min(p, q), posed.high + max(p, q)};
}

/// The intersection of the boxes around the two bounds of a posed shape.
template <typename S>
FCL_FIBERS_ALWAYS_INLINE void findBoxOfBounds(const LocalBounds& bounds,
                                              const fcl::Transform3<S>& pose, ShapeBox& box) {
  constexpr double kEps{std::numeric_limits<S>::epsilon()}, kLeast{std::numeric_limits<S>::min()};
  // FCL treats such poses as translations, and counts the local box alone.
  const bool is_turned = isTurned(pose);
  const double none = is_turned ? 4 * kEps : double{Eigen::NumTraits<S>::dummy_precision()};
  const auto& m = pose.matrix();
  const Vec3d x = toVec3(m.col(0)), y = toVec3(m.col(1)), z = toVec3(m.col(2));
  const Vec3d low = bounds.box.low, high = bounds.box.high, middle = bounds.center;
  Corners posed{{0, 0, 0}, {0, 0, 0}};
  double reach = 0;
  addColumn(x, low.x, high.x, none, posed, reach);
  addColumn(y, low.y, high.y, none, posed, reach);
  addColumn(z, low.z, high.z, none, posed, reach);
  // Radius 0 means that there is no ball. FCL's squares of smaller radii vanish or are inaccurate.
  const double radius = bounds.radius;
  if (is_turned && radius * radius * kEps > kLeast) {
    const Vec3d center = middle.x * x + middle.y * y + middle.z * z;
    // A rotation that has drifted stretches the ball.
    const double stretched = radius * (1 + 8 * kEps);
    const Vec3d squares{x.x * x.x + y.x * y.x + z.x * z.x, x.y * x.y + y.y * y.y + z.y * z.y,
                        x.z * x.z + y.z * y.z + z.z * z.z};
    const Vec3d ball =
        stretched * Vec3d{std::sqrt(squares.x), std::sqrt(squares.y), std::sqrt(squares.z)};
    // Where the middle is open, the ball is too.
    const Vec3d from = center - ball, to = center + ball;
    const auto larger = [](double a, double b) { return std::isfinite(b) && b > a ? b : a; };
    const auto smaller = [](double a, double b) { return std::isfinite(b) && b < a ? b : a; };
    posed.low = {larger(posed.low.x, from.x), larger(posed.low.y, from.y),
                 larger(posed.low.z, from.z)};
    posed.high = {smaller(posed.high.x, to.x), smaller(posed.high.y, to.y),
                  smaller(posed.high.z, to.z)};
  }
  // Number by number: what has been written so cannot be copied at once without a stall.
  box.local = {low, high};
  box.posed = posed;
  box.reach = reach;
  box.is_least = false;
  // A larger one is not FCL's.
  box.ball_squared = std::min(radius * radius, squaredNorm(Corners{low, high}.half()));
}

/// Whether neither box of a plane or half-space reaches beyond the one that FCL gives it. If one
/// does, the program has widened it, or it is of an earlier pose.
template <typename S, class Shape>
bool hasStockBoxes(const fcl::CollisionObject<S>& object, const Shape& shape) {
  Shape fresh(shape);
  fresh.computeLocalAABB();
  const auto isWithin = [](const fcl::AABB<S>& inner, const fcl::AABB<S>& outer) {
    return (inner.min_.array() >= outer.min_.array()).all() &&
           (inner.max_.array() <= outer.max_.array()).all();
  };
  if (!isWithin(shape.aabb_local, fresh.aabb_local)) return false;
  const fcl::Transform3<S>& pose = ObjectMembers<S>::pose(object);
  // FCL's box of a turned plane is open on all sides.
  return !pose.linear().isIdentity() ||
         isWithin(ObjectMembers<S>::box(object),
                  fcl::translate(fresh.aabb_local, fcl::Vector3<S>(pose.translation())));
}

/// A plane or half-space. Its normal may have any length.
template <typename S, class Shape>
void readPlane(const fcl::CollisionObject<S>& object, const Shape& shape, Obstacle::Kind kind,
               Bounds bounds, ReadObject& out) {
  if (bounds == Bounds::kShapesAndMargins && !hasStockBoxes(object, shape)) return;
  const Vec3d &x = out.pose.column[0], &y = out.pose.column[1], &z = out.pose.column[2];
  const Vec3d given = toVec3(shape.n), x_row = cross(y, z);
  const double size = maxNorm(given);
  if (!(size > 0)) return;
  // The normal of the image of a plane, also if the rotation has drifted.
  const Vec3d normal =
      (given.x / size) * x_row + (given.y / size) * cross(z, x) + (given.z / size) * cross(x, y);
  const double length = norm(normal);
  out.shape = kind;
  out.vector[0] = (1 / length) * normal;
  out.offset = static_cast<double>(shape.d) / size * (dot(x, x_row) / length);
}

}  // namespace

template <typename S>
const char* readShape(const fcl::CollisionObject<S>& object, Bounds bounds, const LocalBounds* mesh,
                      ReadObject& out) {
  const fcl::CollisionGeometry<S>& geometry = *ObjectMembers<S>::shape(object);
  out.shape = Obstacle::Kind::kBox;
  const auto readRoundSize = [&](S radius, S length) {
    out.size = {static_cast<double>(radius), static_cast<double>(length), 0};
    return sizeProblem(out.size.x, out.size.y);
  };
  switch (geometry.getNodeType()) {
    case fcl::GEOM_BOX:
    case fcl::GEOM_CYLINDER:
      return readBar(object, out.pose, out.size, out.box);
    case fcl::GEOM_CONE: {
      const auto& cone = static_cast<const fcl::Cone<S>&>(geometry);
      const char* problem = readRoundSize(cone.radius, cone.lz);
      out.box = boxOfCone(out.pose, out.size.x, out.size.y);
      return problem;
    }
    case fcl::GEOM_ELLIPSOID:
      out.size = toVec3(static_cast<const fcl::Ellipsoid<S>&>(geometry).radii);
      out.box = boxOfEllipsoid(out.pose, out.size);
      return areSizes(out.size) ? nullptr : kBadRadii;
    case fcl::GEOM_CONVEX: {
      const auto& convex = static_cast<const fcl::Convex<S>&>(geometry);
      out.shape = Obstacle::Kind::kPolytope;
      out.vertices = pointsOf(convex.getVertices());
      return boxOfVertices(out.pose, out.vertices, out.box) ? nullptr : kBadVertices;
    }
    case fcl::GEOM_TRIANGLE: {
      const auto& triangle = static_cast<const fcl::TriangleP<S>&>(geometry);
      const std::array corners{triangle.a, triangle.b, triangle.c};
      out.shape = Obstacle::Kind::kTriangle;
      for (std::size_t i = 0; i < 3; ++i) out.vector[i] = toVec3(corners[i]);
      return boxOfVertices(out.pose, pointsOf(corners), out.box) ? nullptr : kBadVertices;
    }
    case fcl::GEOM_PLANE:
      out.shape = Obstacle::Kind::kNone;
      readPlane(object, static_cast<const fcl::Plane<S>&>(geometry), Obstacle::Kind::kPlane, bounds,
                out);
      break;
    case fcl::GEOM_HALFSPACE:
      out.shape = Obstacle::Kind::kNone;
      readPlane(object, static_cast<const fcl::Halfspace<S>&>(geometry), Obstacle::Kind::kHalfspace,
                bounds, out);
      break;
    default:
      break;
  }
  if (!isProper(geometry.aabb_local)) return kNoLocalBox;
  const fcl::Transform3<S>& pose = ObjectMembers<S>::pose(object);
  if (mesh != nullptr) {
    findBoxOfBounds(*mesh, pose, out.box);
  } else {
    const LocalBounds of_fcl = {openCorners(geometry.aabb_local), toVec3(geometry.aabb_center),
                                static_cast<double>(geometry.aabb_radius)};
    findBoxOfBounds(of_fcl, pose, out.box);
  }
  return nullptr;
}

#define FCL_FIBERS_INSTANTIATE(S)                                                            \
  template const char* readShape(const fcl::CollisionObject<S>&, Bounds, const LocalBounds*, \
                                 ReadObject&);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::broadphase
