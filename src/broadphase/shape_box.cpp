// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/shape_box.h"

#include <algorithm>
#include <array>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/triangle_p.h>

#include "broadphase/program_margin.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Frame;
using geometry::Segment;
using geometry::Vec3d;

constexpr const char* kBadSides =
    "a side is negative, NaN or infinite; give it finite sides of 0 or more";
constexpr const char* kBadRadii =
    "a radius is negative, NaN or infinite; give it finite radii of 0 or more";
constexpr const char* kBadVertices =
    "it has no vertices, or one that is NaN or infinite; give it finite vertices";
constexpr const char* kNoBox =
    "its box is empty or NaN; give it a non-empty shape and call computeLocalAABB()";

/// The columns of a rotation, which may have drifted. It is used as it is.
struct Axes {
  Vec3d x, y, z;

  template <typename S>
  explicit Axes(const fcl::Transform3<S>& pose)
      : x(toVec3(pose.matrix().col(0))),
        y(toVec3(pose.matrix().col(1))),
        z(toVec3(pose.matrix().col(2))) {}

  Vec3d turn(const Vec3d& p) const { return p.x * x + p.y * y + p.z * z; }
};

bool areSizes(const Vec3d& v) { return isSize(v.x) && isSize(v.y) && isSize(v.z); }

/// Half the box of a disc of radius 1 in the plane of the x and y axes. Squares of tiny entries
/// lose less than the rounding of the largest coordinate.
Vec3d discHalf(const Axes& axes) {
  const Vec3d &x = axes.x, &y = axes.y;
  return {std::sqrt(x.x * x.x + y.x * y.x), std::sqrt(x.y * x.y + y.y * y.y),
          std::sqrt(x.z * x.z + y.z * y.z)};
}

FCL_FIBERS_ALWAYS_INLINE ShapeBox boxOfSides(const Axes& axes, const Vec3d& sides) {
  const Vec3d half = 0.5 * sides;
  return ShapeBox::symmetric(half,
                             half.x * abs(axes.x) + half.y * abs(axes.y) + half.z * abs(axes.z));
}

FCL_FIBERS_ALWAYS_INLINE ShapeBox boxOfCylinder(const Axes& axes, double radius, double length) {
  const Vec3d end = (length / 2) * abs(axes.z);
  return ShapeBox::symmetric({radius, radius, length / 2}, end + radius * discHalf(axes));
}

/// The apex is above, the disc below.
ShapeBox boxOfCone(const Axes& axes, double radius, double length) {
  const Vec3d apex = (length / 2) * axes.z, disc = radius * discHalf(axes);
  const Vec3d local{radius, radius, length / 2}, foot = -1.0 * apex;
  const Corners posed = {min(apex, foot - disc), max(apex, foot + disc)};
  return {around({0, 0, 0}, local), posed, squaredNorm(local),
          maxNorm(max(abs(posed.low), abs(posed.high))), true};
}

ShapeBox boxOfEllipsoid(const Axes& axes, const Vec3d& radii) {
  // Squares of the radii themselves could overflow or vanish.
  const double largest = maxNorm(radii), unit = largest > 0 ? largest : 1;
  const Vec3d p = (radii.x / unit) * axes.x, q = (radii.y / unit) * axes.y,
              r = (radii.z / unit) * axes.z;
  const Vec3d half{std::sqrt(p.x * p.x + q.x * q.x + r.x * r.x),
                   std::sqrt(p.y * p.y + q.y * q.y + r.y * r.y),
                   std::sqrt(p.z * p.z + q.z * q.z + r.z * r.z)};
  return ShapeBox::symmetric(radii, largest * half);
}

/// @return whether there are vertices, all of them finite
template <class Vertices>
bool boxOfVertices(const Axes& axes, const Vertices& vertices, ShapeBox& box) {
  const Vec3d most{kInfinity, kInfinity, kInfinity}, least = -1.0 * most;
  box = {{most, least}, {most, least}, 0, 0, true};
  double is_finite = 0;
  for (const auto& vertex : vertices) {
    const Vec3d p = toVec3(vertex), q = axes.turn(p);
    box.local = {min(box.local.low, p), max(box.local.high, p)};
    box.posed = {min(box.posed.low, q), max(box.posed.high, q)};
    box.reach = std::max({box.reach, maxNorm(p), maxNorm(q)});
    is_finite += 0 * p.x + 0 * p.y + 0 * p.z;  // NaN from here on if one is not
  }
  box.ball_squared = squaredNorm(box.local.half());
  return is_finite == 0 && box.local.low.x <= box.local.high.x;
}

/// Returns entry * side, but an open side adds nothing along an axis where its entry is at most
/// `none`.
double product(double entry, double side, double none) {
  return std::fabs(entry) <= none && std::isinf(side) ? 0 : entry * side;
}

template <typename S>
LocalBounds localBounds(const fcl::CollisionGeometry<S>& shape) {
  return {openCorners(shape.aabb_local), toVec3(shape.aabb_center),
          static_cast<double>(shape.aabb_radius)};
}

/// The intersection of the boxes around the two bounds of a posed shape.
template <typename S>
ShapeBox boxOfBounds(const LocalBounds& bounds, const fcl::Transform3<S>& pose) {
  ShapeBox box{bounds.box, {}, 0, 0, false};
  const double local[2][3] = {{box.local.low.x, box.local.low.y, box.local.low.z},
                              {box.local.high.x, box.local.high.y, box.local.high.z}};
  const double middle[3] = {bounds.center.x, bounds.center.y, bounds.center.z};
  const double radius = bounds.radius;
  constexpr double kEps{std::numeric_limits<S>::epsilon()}, kLeast{std::numeric_limits<S>::min()};
  // FCL treats such poses as translations, and counts the local box alone.
  const bool is_turned = !pose.linear().isIdentity();
  const double none = is_turned ? 4 * kEps : double{Eigen::NumTraits<S>::dummy_precision()};
  // Radius 0 means that there is no ball. FCL's squares of smaller radii vanish or are inaccurate.
  const bool has_ball = is_turned && radius * radius * kEps > kLeast;
  double low[3], high[3];
  for (int row = 0; row < 3; ++row) {
    double from = 0, to = 0, center = 0, squared = 0;
    for (int column = 0; column < 3; ++column) {
      const auto entry = static_cast<double>(pose.matrix()(row, column));
      const double p = product(entry, local[0][column], none);
      const double q = product(entry, local[1][column], none);
      from += std::min(p, q);
      to += std::max(p, q);
      center += entry * middle[column];
      squared += entry * entry;
      for (const double x : {p, q}) {
        box.reach = std::isfinite(x) ? std::max(box.reach, std::fabs(x)) : box.reach;
      }
    }
    // A rotation that has drifted stretches the ball.
    const double ball = has_ball && std::isfinite(center)
                            ? radius * std::sqrt(squared) * (1 + 8 * kEps)
                            : kInfinity;
    low[row] = std::max(from, center - ball);
    high[row] = std::min(to, center + ball);
  }
  box.posed = {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
  // A larger one is not FCL's.
  box.ball_squared = std::min(radius * radius, squaredNorm(box.local.half()));
  return box;
}

constexpr double kMost = std::numeric_limits<double>::max();

/// A box far out may overflow. But its low side must not become +infinity, its high side must not
/// become -infinity, and neither may become NaN.
double finiteLow(double x) { return x <= kMost ? x : std::isnan(x) ? -kInfinity : kMost; }
double finiteHigh(double x) { return -finiteLow(-x); }

FCL_FIBERS_ALWAYS_INLINE Corners finiteCorners(const Vec3d& low, const Vec3d& high) {
  if (std::isfinite(low.x + low.y + low.z + high.x + high.y + high.z)) return {low, high};
  return {{finiteLow(low.x), finiteLow(low.y), finiteLow(low.z)},
          {finiteHigh(high.x), finiteHigh(high.y), finiteHigh(high.z)}};
}

double finiteNorm(const Vec3d& v) {
  double largest = 0;
  for (const double x : {v.x, v.y, v.z}) {
    if (std::isfinite(x)) largest = std::max(largest, std::fabs(x));
  }
  return largest;
}

bool contains(const Corners& outer, const Corners& inner, double rounding) {
  const auto reaches = [rounding](const Vec3d& low, const Vec3d& high) {
    return low.x <= high.x + rounding && low.y <= high.y + rounding && low.z <= high.z + rounding;
  };
  return reaches(outer.low, inner.low) && reaches(inner.high, outer.high);
}

/// How far the box of an unbounded shape may be from `corners`. FCL treats small rotations as the
/// identity.
template <typename S>
double roundingOf(const fcl::AABB<S>& box, const Corners& corners) {
  const Corners open = openCorners(box);
  return 4 * double{std::numeric_limits<S>::epsilon()} *
             std::max(finiteNorm(open.low), finiteNorm(open.high)) +
         4 * double{Eigen::NumTraits<S>::dummy_precision()} * finiteNorm(corners.half());
}

bool isBounded(const ShapeBox& shape) { return shape.is_least || isBounded(shape.posed); }

/// What the program has added to the box of a bounded shape.
template <typename S>
FCL_FIBERS_ALWAYS_INLINE Widening wideningThatCounts(const fcl::CollisionObject<S>& object,
                                                     const ShapeBox& shape, Bounds bounds) {
  if (bounds != Bounds::kShapesAndMargins || !isBounded(shape)) return {};
  const BoxSize size(ObjectMembers<S>::box(object));
  if (isStockSize(size, shape, ObjectMembers<S>::pose(object))) return {};
  return wideningOf(object, size, shape);
}

/// The box of a posed shape, larger by a length in the world's unit.
template <typename S>
FCL_FIBERS_ALWAYS_INLINE Corners posedCorners(const ShapeBox& shape, const fcl::Transform3<S>& pose,
                                              double larger, const Frame& frame) {
  const double outward = outwardRounding(shape) + larger;
  const Vec3d by{outward, outward, outward};
  const Vec3d position = frame.fromWorld(toVec3(pose.matrix().col(3)));
  return finiteCorners(position + frame.scale * (shape.posed.low - by),
                       position + frame.scale * (shape.posed.high + by));
}

/// The box of a shape, and what the program has added to it.
template <typename S>
FCL_FIBERS_ALWAYS_INLINE Segment boxThatCounts(const fcl::CollisionObject<S>& object,
                                               const ShapeBox& shape, Widening added,
                                               const Frame& frame, Bounds bounds) {
  const fcl::AABB<S>& box = ObjectMembers<S>::box(object);
  const double margin = added.is_uneven ? added.everywhere : added.margin;
  Corners corners = posedCorners(shape, ObjectMembers<S>::pose(object), margin, frame);
  if (bounds == Bounds::kShapesAndMargins && !isBounded(shape) && isProper(box)) {
    added.is_uneven =
        contains(ownCorners(box, frame), corners, frame.scale * roundingOf(box, shape.posed));
  }
  if (added.is_uneven) {
    const Corners own = ownCorners(box, frame);
    corners = {min(own.low, corners.low), max(own.high, corners.high)};
  }
  return Segment::box(corners.low, corners.high);
}

/// Calls take() with the boxes of a shape.
/// @return nullptr, or why the object is refused and the remedy
template <typename S, class Take>
FCL_FIBERS_ALWAYS_INLINE const char* readShape(const fcl::CollisionGeometry<S>& geometry,
                                               const fcl::Transform3<S>& pose, fcl::NODE_TYPE type,
                                               Take&& take) {
  const Axes axes(pose);
  const auto read = [&](const ShapeBox& shape) {
    take(shape);
    return nullptr;
  };
  const auto readRound = [&](const auto& round, auto&& boxOf) -> const char* {
    const auto radius = static_cast<double>(round.radius), length = static_cast<double>(round.lz);
    if (const char* problem = sizeProblem(radius, length)) return problem;
    return read(boxOf(axes, radius, length));
  };
  const auto readVertices = [&](const auto& vertices) -> const char* {
    ShapeBox shape;
    return boxOfVertices(axes, vertices, shape) ? read(shape) : kBadVertices;
  };
  switch (type) {
    case fcl::GEOM_BOX: {
      const Vec3d sides = toVec3(static_cast<const fcl::Box<S>&>(geometry).side);
      return areSizes(sides) ? read(boxOfSides(axes, sides)) : kBadSides;
    }
    case fcl::GEOM_CYLINDER:
      // gcc -O1 cannot inline a call by pointer.
      return readRound(static_cast<const fcl::Cylinder<S>&>(geometry),
                       [](const auto&... sizes) { return boxOfCylinder(sizes...); });
    case fcl::GEOM_CONE:
      return readRound(static_cast<const fcl::Cone<S>&>(geometry), boxOfCone);
    case fcl::GEOM_ELLIPSOID: {
      const Vec3d radii = toVec3(static_cast<const fcl::Ellipsoid<S>&>(geometry).radii);
      return areSizes(radii) ? read(boxOfEllipsoid(axes, radii)) : kBadRadii;
    }
    case fcl::GEOM_CONVEX:
      return readVertices(static_cast<const fcl::Convex<S>&>(geometry).getVertices());
    case fcl::GEOM_TRIANGLE: {
      const auto& triangle = static_cast<const fcl::TriangleP<S>&>(geometry);
      return readVertices(std::array{triangle.a, triangle.b, triangle.c});
    }
    default:
      if (!isProper(geometry.aabb_local)) return kNoBox;
      return read(boxOfBounds(localBounds(geometry), pose));
  }
}

template <typename S, class Take>
FCL_FIBERS_ALWAYS_INLINE const char* readShape(const fcl::CollisionObject<S>& object,
                                               fcl::NODE_TYPE type, Take&& take) {
  return readShape(*ObjectMembers<S>::shape(object), ObjectMembers<S>::pose(object), type, take);
}

}  // namespace

Corners inFrame(const Corners& box, const Frame& frame) {
  return finiteCorners(frame.fromWorld(box.low), frame.fromWorld(box.high));
}

template <typename S>
Corners ownCorners(const fcl::AABB<S>& box, const Frame& frame) {
  return inFrame(openCorners(box), frame);
}

template <typename S>
const char* readBox(const fcl::CollisionObject<S>& object, fcl::NODE_TYPE type, const Frame& frame,
                    Bounds bounds, Segment& segment) {
  if (bounds == Bounds::kObjects) {
    const fcl::AABB<S>& box = ObjectMembers<S>::box(object);
    if (!isProper(box))
      return "its box is empty or NaN; give it a non-empty shape and call computeAABB()";
    const Corners own = ownCorners(box, frame);
    segment = Segment::box(own.low, own.high);
    return nullptr;
  }
  return readShape(object, type, [&](const ShapeBox& shape) {
    segment =
        boxThatCounts(object, shape, wideningThatCounts(object, shape, bounds), frame, bounds);
  });
}

template <typename S>
bool readMeshBox(const fcl::CollisionObject<S>& object, const LocalBounds& mesh, const Frame& frame,
                 Bounds bounds, Segment& box, double& margin) {
  const ShapeBox shape = boxOfBounds(mesh, ObjectMembers<S>::pose(object));
  const Widening added = wideningThatCounts(object, shape, bounds);
  box = boxThatCounts(object, shape, added, frame, bounds);
  margin = added.margin;
  return isBounded(shape) && !added.is_uneven;
}

template <typename S>
bool readLocalBox(const fcl::CollisionObject<S>& object, fcl::NODE_TYPE type, Bounds bounds,
                  ShapeBox& box, double& margin) {
  bool is_all = false;
  readShape(object, type, [&](const ShapeBox& shape) {
    const Widening added = wideningThatCounts(object, shape, bounds);
    // Where only FCL's box of the shape is known, the program may know more.
    is_all = isBounded(shape) && (!added.is_uneven || shape.is_least);
    box = shape;
    margin = added.margin;
  });
  return is_all;
}

template <typename S>
const char* readShapeBox(const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& pose,
                         Corners& local, Corners& posed) {
  return readShape(shape, pose, shape.getNodeType(), [&](const ShapeBox& box) {
    local = box.local;
    posed = posedCorners(box, pose, /*larger=*/0, Frame{});
  });
}

#define FCL_FIBERS_INSTANTIATE(S)                                                                \
  template Corners ownCorners(const fcl::AABB<S>&, const Frame&);                                \
  template const char* readBox(const fcl::CollisionObject<S>&, fcl::NODE_TYPE, const Frame&,     \
                               Bounds, Segment&);                                                \
  template bool readMeshBox(const fcl::CollisionObject<S>&, const LocalBounds&, const Frame&,    \
                            Bounds, Segment&, double&);                                          \
  template bool readLocalBox(const fcl::CollisionObject<S>&, fcl::NODE_TYPE, Bounds, ShapeBox&,  \
                             double&);                                                           \
  template const char* readShapeBox(const fcl::CollisionGeometry<S>&, const fcl::Transform3<S>&, \
                                    Corners&, Corners&);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::broadphase
