// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include <fcl_fibers/fiber_options.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/tree_export.h>

namespace fcl_fibers {

/// A capsule: all points within `radius` of the line from `from` to `to`, in any frame and unit of
/// length. The two ends may be one point.
struct CapsuleShape {
  std::array<double, 3> from;  ///< x, y, z of the first end of the axis
  std::array<double, 3> to;    ///< x, y, z of the second end
  double radius;               ///< finite, not negative
};

/// Where two capsules a and b touch, or would touch first, by two closest points of their axes.
/// World frame, lengths in the scene's unit.
///
/// If many points are closest, as for parallel axes, these are one such pair. `distance` is right
/// to 32 eps of (distance of the axes + their lengths + radii), at any angle. The points are
/// rounded like coordinates of their size.
struct Contact {
  FiberSegment a;  ///< the first capsule; 0, 0 if it belongs to no fiber
  FiberSegment b;  ///< the second capsule, likewise

  /// Arc parameter of a's axis point: 0 at the capsule's first end, 1 at its second; 0 if both ends
  /// are one point. The axis of an `fcl::Capsule` goes from -z to +z.
  double s = 0;
  double t = 0;  ///< arc parameter of b's axis point, likewise

  /// Distance between the surfaces. It is negative if the capsules overlap: moving one of them that
  /// far along `normal` separates them.
  double distance = 0;

  std::array<double, 3> point_a{};  ///< a's axis point, moved to the surface along `normal`
  std::array<double, 3> point_b{};  ///< b's axis point, moved to the surface against `normal`

  /// Unit vector from a to b. If the axes intersect, up to 16 eps of the coordinates, it is
  /// perpendicular to both. If they are also parallel or have no length, it is one such direction,
  /// which depends on the axes alone.
  std::array<double, 3> normal{};
};

/// The contact of two capsules, whether they touch or not. The closed form is that of Ericson,
/// Real-Time Collision Detection, 2005, section 5.1.9, without its determinant, which is noise if
/// the axes are nearly parallel.
///
/// Throws std::invalid_argument if a number is NaN or beyond 2^1000, or a radius is negative.
FCL_FIBERS_TREE_EXPORT Contact capsuleContact(const CapsuleShape& a, const CapsuleShape& b);

/// The contact of a pair that FiberTree reported, with fiber and segment numbers. `fibers` are the
/// arrays of its last build or update.
///
/// Throws std::invalid_argument as above, if no capsule starts at a point of the pair, if an array
/// is null, or if point_begin does not run from 0 to the number of points.
///@{
FCL_FIBERS_TREE_EXPORT Contact capsuleContact(const FiberArrays<float>& fibers, SegmentPair pair);
FCL_FIBERS_TREE_EXPORT Contact capsuleContact(const FiberArrays<double>& fibers, SegmentPair pair);
///@}

/// The same for a pair of two trees, a capsule of `a` and one of `b`.
///@{
FCL_FIBERS_TREE_EXPORT Contact capsuleContact(const FiberArrays<float>& a,
                                              const FiberArrays<float>& b, SegmentPair pair);
FCL_FIBERS_TREE_EXPORT Contact capsuleContact(const FiberArrays<double>& a,
                                              const FiberArrays<double>& b, SegmentPair pair);
///@}

}  // namespace fcl_fibers
