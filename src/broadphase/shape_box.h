// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_manager_options.h>

#include "broadphase/fcl_layout.h"
#include "geometry/vec3.h"
#include "simd/always_inline.h"

namespace fcl_fibers::broadphase {

// The floor of object_reader.h: the boxes of shapes, and the margins that programs add to the boxes
// of objects.

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Two corners of a box. Open sides are at infinity.
struct Corners {
  geometry::Vec3d low, high;

  geometry::Vec3d half() const { return 0.5 * high - 0.5 * low; }
  geometry::Vec3d middle() const { return 0.5 * low + 0.5 * high; }
};

inline bool isBounded(const Corners& box) {
  return std::isfinite(maxNorm(box.low)) && std::isfinite(maxNorm(box.high));
}

inline Corners around(const geometry::Vec3d& middle, const geometry::Vec3d& half) {
  return {middle - half, middle + half};
}

/// FCL's planes reach to max(), or to infinity if they are rotated.
template <typename S>
double openLow(S side) {
  return side < -std::numeric_limits<S>::max() / 4 ? -kInfinity : static_cast<double>(side);
}
template <typename S>
Corners openCorners(const fcl::AABB<S>& box) {
  const auto &low = box.min_, &high = box.max_;
  return {{openLow(low[0]), openLow(low[1]), openLow(low[2])},
          {-openLow(-high[0]), -openLow(-high[1]), -openLow(-high[2])}};
}

template <typename S>
bool isProper(const fcl::AABB<S>& box) {
  return (box.min_.array() <= box.max_.array()).all();
}

/// The boxes of a shape, in the world's unit, computed from its present sizes or vertices.
struct ShapeBox {
  Corners local;        ///< FCL's box, in the axes of the shape
  Corners posed;        ///< in the world's axes, relative to the position
  double ball_squared;  ///< squared radius of FCL's ball around `local`
  double reach;         ///< the largest coordinate that a box was computed from
  bool is_least;        ///< whether `posed` is the least; if not, only `aabb_local` is known

  /// The boxes of a shape that is symmetric about its position, given by half their sizes.
  FCL_FIBERS_ALWAYS_INLINE static ShapeBox symmetric(const geometry::Vec3d& local_half,
                                                     const geometry::Vec3d& posed_half) {
    const geometry::Vec3d none{0, 0, 0};
    return {around(none, local_half), around(none, posed_half), squaredNorm(local_half),
            maxNorm(posed_half), true};
  }
};

inline bool isBounded(const ShapeBox& shape) { return shape.is_least || isBounded(shape.posed); }

/// FCL's two bounds of a mesh or an octree in its own axes: a box, and a ball around its middle.
struct LocalBounds {
  Corners box{{0, 0, 0}, {0, 0, 0}};
  geometry::Vec3d center{0, 0, 0};
  double radius = 0;  ///< 0 means that there is no ball
};

/// What a program has added to an object's box: on all sides the same, or more on some than on
/// others. If it is uneven, another object has to meet the box as well as the shape.
struct Widening {
  double margin = 0;  ///< the most on any side
  bool is_uneven = false;
  /// If it is uneven: what counts on all sides, wherever the box is.
  double everywhere = 0;

  /// What counts on all sides.
  double onAllSides() const { return is_uneven ? everywhere : margin; }
};

/// Guesses what a program has added to an object's box. docs/contract.md, "Boxes that a program
/// widens", states the rule and why it misses nothing.
/// @param shape  of the object, which is bounded
template <typename S>
Widening wideningOf(const fcl::CollisionObject<S>& object, const ShapeBox& shape);

constexpr const char* kBadRadius =
    "its radius is negative, NaN or infinite; give it a finite radius of 0 or more";
constexpr const char* kBadLength =
    "its length is negative, NaN or infinite; give it a finite length of 0 or more";

inline bool isSize(double x) { return x >= 0 && std::isfinite(x); }

/// Why the size of a capsule, sphere, cylinder or cone is refused; nullptr if it is not.
inline const char* sizeProblem(double radius, double length) {
  return !isSize(radius) ? kBadRadius : !isSize(length) ? kBadLength : nullptr;
}

struct ReadObject;

/// Reads the size, the boxes and the kind of an object's shape in the pose that has been read,
/// unless it is a capsule or sphere.
/// @param mesh  the bounds of a mesh that was read, or null for those that FCL has
/// @return nullptr, or why the shape is refused and the remedy
template <typename S>
const char* readShape(const fcl::CollisionObject<S>& object, Bounds bounds, const LocalBounds* mesh,
                      ReadObject& out);

}  // namespace fcl_fibers::broadphase
