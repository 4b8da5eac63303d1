// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Geometry>

namespace fcl_fibers::test {

/// Of objects that differ in kind. A ball is a capsule of length zero.
enum class ThingKind { kCapsule, kMesh, kBox, kHalfspace };

/// What stays of an object while it moves.
struct ThingShape {
  ThingKind kind = ThingKind::kCapsule;
  std::vector<std::array<std::size_t, 3>> triangles;  ///< of a mesh
  Eigen::Vector3d half = Eigen::Vector3d::Zero();     ///< sides of a box
};

/// An object at one time, in the world.
struct Instant {
  /// The ends of a capsule's axis, the points of a mesh, the center of a box, or a point on the
  /// plane of a half-space.
  std::vector<Eigen::Vector3d> points;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< of a box; z is a half-space's normal
  double radius = 0;
  double margin = 0;           ///< that the program has added to the object's box
  Eigen::AlignedBox3d around;  ///< around the points, or the box
};

/// An object during a step, in which points, radius and margin change linearly.
struct Body {
  const ThingShape* shape;
  const Instant *start, *end;  ///< one and the same if it rests
  bool is_solid;               ///< whether the inside of a mesh counts
};

/// What is certain of a pair in a step.
struct StepVerdict {
  enum { kTouching, kApart, kOpen } state = kOpen;
  double first = 0;  ///< they do not touch before this time
  double touch = 1;  ///< they touch at this time or before it, if they touch
};

/// Whether one of the two is a capsule, which is all that is judged.
bool isJudged(const Body& a, const Body& b);

/// Judges whether and when two objects are no farther apart than radii and margins. The step is
/// bisected. In each part the gap is at least what the speed of the points leaves of the gaps at
/// both ends. Objects other than capsules and meshes are judged at the start and the end alone.
/// @param tolerance  by which they have to be nearer or farther apart than that to be certain
/// @pre isJudged(a, b)
StepVerdict judgeStep(const Body& a, const Body& b, double margin, double tolerance);

/// The distance of two objects at the end of the step, without margins. It is 0 if they overlap.
/// @pre isJudged(a, b)
double distanceAtEnd(const Body& a, const Body& b);

}  // namespace fcl_fibers::test
