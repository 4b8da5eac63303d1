// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

/// Collision detection among fibers of capsules.
namespace fcl_fibers {

/// Where a segment stands: its fiber, and its number along that fiber, both counted from 0. A
/// manager counts in the order of registration. An object that is no part of a fiber is a fiber of
/// one segment.
struct FiberSegment {
  std::size_t fiber = 0;    ///< among all fibers
  std::size_t segment = 0;  ///< along that fiber
};

/// Whether the last segment of a fiber leads to its first one, so that the two are neighbours as
/// any others that follow each other.
enum class FiberEnds {
  kOpen,    ///< two ends
  kClosed,  ///< a ring
};

/// Fibers that never meet, such as the cables of one harness: all have the same number. Pairs of
/// segments of one group are reported neither by collide nor by distance. So a fiber of a group
/// never meets itself, even if it is the only one of its group. The number 0 is no group. A part of
/// the tree whose segments are all of one group is not searched against itself. Each manager has
/// numbers of its own.
struct FiberGroup {
  std::int32_t number = 0;  ///< of the group; 0 is none
};

/// Shape of the tree over the segments; decides speed, never the answer.
enum class Topology {
  /// A node is a set of fibers over a range along them; eight children a node. Fast whatever the
  /// order in which fibers were registered.
  kBundle,
  /// The tree of Sobottka, Varnik and Weber, section 3.2: fibers in registration order, threaded
  /// alternately root to tip and tip to root, balanced and binary.
  kSuperThread,
};

/// Which pairs a query reports.
enum class Report {
  /// Every pair whose own leaf volumes overlap: the capsules' tight boxes, or the segments'
  /// spheres. What FCL's managers report when they are given tight boxes.
  kVolumes,
  /// Every pair of capsules no further apart than the sum of their radii and the margin. An
  /// `fcl::Sphere` is a capsule of length zero; every other shape counts by its box.
  kCapsules,
};

/// What bounds an object of a manager.
enum class Bounds {
  /// Pose and shape: `getAABB()` is never read. The fastest, and enough for a program that does not
  /// widen boxes.
  kShapes,
  /// Pose and shape, and what a program has added to FCL's own box of the shape, as it does for a
  /// contact distance: a margin of that object. A box that contains the shape and is larger on some
  /// sides than on others counts in place of the shape. `computeAABB()` is not needed: a box of
  /// another pose counts by its size alone. docs/contract.md has the rule.
  kShapesAndMargins,
  /// `getAABB()` alone, of capsules too, as in FCL's managers: for boxes that a program makes
  /// smaller, and up to date only if it calls `computeAABB()`.
  kObjects,
};

/// What a fiber manager is told once, at construction, which throws std::invalid_argument where an
/// option is out of the range said here.
struct FiberManagerOptions {
  Topology topology = Topology::kBundle;  ///< shape of the tree: speed alone
  Report report = Report::kVolumes;       ///< which pairs a query reports

  /// What bounds an object; FiberTree has no objects and passes over it.
  Bounds bounds = Bounds::kShapesAndMargins;

  /// Pairs of one registerFiber() fiber whose segment numbers differ by this much or less are not
  /// reported, neither by collide nor by distance. 0 reports all; 1 leaves out adjacent segments,
  /// which always overlap. Not negative.
  int ignored_neighbors = 0;

  /// Likewise pairs of one fiber between which this much of it lies or less, measured along it when
  /// it was registered: for fibers of unequal segments. In the scene's unit of length; 0 leaves
  /// that to ignored_neighbors alone. Finite, not negative.
  double ignored_arc_length = 0;

  /// Pairs this close count as touching, in the scene's unit of length. Finite, not negative.
  double margin = 0;

  /// Threads that build, update, self-collision and collision with another fiber manager share
  /// their work among, the caller's included; callbacks run on the caller's alone. At least 1.
  /// Pairs and their order are the same for any number.
  int threads = 1;
};

}  // namespace fcl_fibers
