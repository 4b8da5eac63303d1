// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include <fcl_fibers/export.h>
#include <fcl_fibers/fiber_options.h>
#include <fcl_fibers/fiber_tree.h>

namespace fcl_fibers {

/// All points within `radius` of the line from `from` to `to`, which may be one point. Any one
/// frame and unit of length.
struct CapsuleShape {
  std::array<double, 3> from;  ///< x, y, z of the first end of the axis
  std::array<double, 3> to;    ///< of the second one
  double radius;               ///< not negative
};

/// Where two capsules a and b touch, or would touch first: two points of their axes that are
/// closest, and what follows from them. World frame, lengths in the scene's unit.
///
/// Where many points are closest, as of parallel axes, it is one such pair. `distance` is right to
/// 32 eps of (distance of the axes + their lengths + radii), at any angle; the points are rounded
/// as coordinates of their size are.
struct Contact {
  FiberSegment a;  ///< the first capsule; 0, 0 where it is of no fiber
  FiberSegment b;  ///< the second one, likewise

  /// Arc parameter of a's axis point: 0 at the capsule's first end, 1 at its second; 0 where both
  /// ends are one point. An `fcl::Capsule` goes from its -z end to its +z end.
  double s = 0;
  double t = 0;  ///< of b's axis point, likewise

  /// From surface to surface; negative if the capsules overlap: moving one of them that far along
  /// `normal` parts them.
  double distance = 0;

  std::array<double, 3> point_a{};  ///< a's axis point, moved to the surface along `normal`
  std::array<double, 3> point_b{};  ///< b's axis point, moved to the surface against `normal`

  /// Of length one, from a to b. Where the axes meet, up to 16 eps of the coordinates, it is
  /// perpendicular to both; where they also are parallel or without length, one such direction,
  /// which depends on the axes alone.
  std::array<double, 3> normal{};
};

/// The contact of two capsules, whether they touch or not. In closed form, after Ericson, Real-Time
/// Collision Detection, 2005, section 5.1.9, but without its determinant, which is noise where axes
/// are nearly parallel.
///
/// Throws std::invalid_argument if a number is not finite or beyond 2^1000, or a radius is
/// negative.
FCL_FIBERS_EXPORT Contact capsuleContact(const CapsuleShape& a, const CapsuleShape& b);

/// The contact of a pair that FiberTree reported, of the arrays that it was built from or updated
/// with; with fiber and segment numbers.
///
/// Throws std::invalid_argument as above, if no capsule starts at a point of the pair, and if
/// arrays are null or point_begin does not run from 0 to the number of points.
///@{
FCL_FIBERS_EXPORT Contact capsuleContact(const FiberArrays<float>& fibers, SegmentPair pair);
FCL_FIBERS_EXPORT Contact capsuleContact(const FiberArrays<double>& fibers, SegmentPair pair);
///@}

/// The same for a pair of a capsule of `a` and one of `b`.
///@{
FCL_FIBERS_EXPORT Contact capsuleContact(const FiberArrays<float>& a, const FiberArrays<float>& b,
                                         SegmentPair pair);
FCL_FIBERS_EXPORT Contact capsuleContact(const FiberArrays<double>& a, const FiberArrays<double>& b,
                                         SegmentPair pair);
///@}

}  // namespace fcl_fibers
