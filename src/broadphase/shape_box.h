// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_manager_options.h>

#include "broadphase/object_members.h"
#include "geometry/frame.h"
#include "geometry/segment.h"
#include "geometry/vec3.h"
#include "simd/always_inline.h"

namespace fcl_fibers::broadphase {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr const char* kBadRadius =
    "its radius is negative, NaN or infinite; give it a finite radius of 0 or more";
constexpr const char* kBadLength =
    "its length is negative, NaN or infinite; give it a finite length of 0 or more";

inline bool isSize(double x) { return x >= 0 && std::isfinite(x); }

/// Why the size of a capsule, cylinder or cone is refused; nullptr if it is not.
inline const char* sizeProblem(double radius, double length) {
  return !isSize(radius) ? kBadRadius : !isSize(length) ? kBadLength : nullptr;
}

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
double openHigh(S side) {
  return side > std::numeric_limits<S>::max() / 4 ? kInfinity : static_cast<double>(side);
}
template <typename S>
Corners openCorners(const fcl::AABB<S>& box) {
  return {{openLow(box.min_[0]), openLow(box.min_[1]), openLow(box.min_[2])},
          {openHigh(box.max_[0]), openHigh(box.max_[1]), openHigh(box.max_[2])}};
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

/// How far the shape may be outside of `posed`, by rounding. The smallest normal number covers the
/// loss if subnormals are flushed to zero.
inline double outwardRounding(const ShapeBox& shape) {
  return 16 * std::numeric_limits<double>::epsilon() * shape.reach +
         4 * std::numeric_limits<double>::min();
}

/// FCL's two bounds of a mesh or an octree in its own axes: a box, and a ball around its middle.
struct LocalBounds {
  Corners box{{0, 0, 0}, {0, 0, 0}};
  geometry::Vec3d center{0, 0, 0};
  double radius = 0;  ///< 0 means that there is no ball
};

/// A box of the world in `frame`. Sides that overflow stay outside of the box.
Corners inFrame(const Corners& box, const geometry::Frame& frame);

/// The object's getAABB() in `frame`.
template <typename S>
Corners ownCorners(const fcl::AABB<S>& box, const geometry::Frame& frame);

/// Reads an object as a box: any object under Bounds::kObjects, otherwise all except capsules and
/// spheres.
/// @param type  the type of its shape
/// @return nullptr, or why the object is refused and the remedy
template <typename S>
const char* readBox(const fcl::CollisionObject<S>& object, fcl::NODE_TYPE type,
                    const geometry::Frame& frame, Bounds bounds, geometry::Segment& segment);

/// Reads a mesh as a box, by the bounds of its points instead of FCL's, and the margin that the
/// program has added, in the world's unit. `bounds` is not Bounds::kObjects.
/// @return whether the mesh and its margin are all that counts: false if the object's box counts as
///         well, and then `box` is around both
template <typename S>
bool readMeshBox(const fcl::CollisionObject<S>& object, const LocalBounds& mesh,
                 const geometry::Frame& frame, Bounds bounds, geometry::Segment& box,
                 double& margin);

/// Reads the boxes of any object except capsules and spheres, and the margin that the program has
/// added to the object's box, in the world's unit. `bounds` is not Bounds::kObjects.
/// @return whether only what is within `margin` of `box.local` counts: false if the shape is
/// refused
///         or has no bounds, or if the object's box counts and less is known of the shape
template <typename S>
bool readLocalBox(const fcl::CollisionObject<S>& object, fcl::NODE_TYPE type, Bounds bounds,
                  ShapeBox& box, double& margin);

/// Reads two boxes of any shape except capsules and spheres: in its own axes, and around the posed
/// shape in the world.
/// @return nullptr, or why the shape is refused and the remedy
template <typename S>
const char* readShapeBox(const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& pose,
                         Corners& local, Corners& posed);

}  // namespace fcl_fibers::broadphase
