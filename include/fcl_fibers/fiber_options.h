// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

/// Collision detection among fibers of capsules.
namespace fcl_fibers {

/// The place of a segment: its fiber, and its number along that fiber, both counted from 0. Fibers
/// count in the order in which they were given. An object that belongs to no fiber is a fiber of
/// one segment.
struct FiberSegment {
  std::size_t fiber = 0;    ///< among all fibers
  std::size_t segment = 0;  ///< along that fiber
};

/// Whether the last segment of a fiber leads to its first one, so that the two are neighbours.
enum class FiberEnds {
  kOpen,    ///< two ends
  kClosed,  ///< a ring
};

/// Fibers whose segments are not paired with one another, such as the cables of one harness: all
/// have the same number. This also excludes pairs within one fiber. A part of the tree whose
/// segments are all of one group is not searched against itself, which saves time. Each tree has
/// numbers of its own.
struct FiberGroup {
  std::int32_t number = 0;  ///< any but 0, which is no group
};

/// The shape of the tree over the segments. It decides speed, never the answer.
enum class Topology {
  /// A node is a set of fibers over a range along them, with up to eight children. This is fast
  /// whatever the order in which fibers were registered.
  kBundle,
  /// The tree of Sobottka, Varnik and Weber, Collision Detection in Densely Packed Fiber Assemblies
  /// with Application to Hair Modeling, 2005, section 3.2: a balanced binary tree over the fibers
  /// in the order of registration, alternately root to tip and tip to root.
  kSuperThread,
};

/// Which pairs a query reports.
enum class Report {
  /// Every pair whose leaf volumes overlap: tight boxes of the shapes, or spheres around the
  /// segments. FCL's broad phase reports the same when it is given tight boxes.
  kVolumes,
  /// Every pair of capsules whose axes are no further apart than the sum of their radii and the
  /// margin. A sphere is a capsule of length zero. Every other shape counts by its box.
  kCapsules,
};

/// Options of whatever searches fibers. Its constructor throws std::invalid_argument if one is out
/// of the range given here.
struct FiberOptions {
  Topology topology = Topology::kBundle;  ///< shape of the tree
  Report report = Report::kVolumes;       ///< which pairs a query reports

  /// Pairs of one fiber whose segment numbers differ by at most this are not reported. 0 reports
  /// all; 1 leaves out adjacent segments, which always overlap. Not negative.
  int ignored_neighbors = 0;

  /// Pairs of one fiber with at most this much of it between them are not reported either. It is
  /// measured along the fiber when that is registered or the tree is built, in the scene's unit of
  /// length, and suits fibers of unequal segments. 0 leaves out none. Finite, not negative.
  double ignored_arc_length = 0;

  /// Pairs this close count as touching, in the scene's unit of length. Finite, not negative.
  double margin = 0;

  /// Threads, including the caller's, that share the work of build, update, self-collision and
  /// collision with another tree of fibers. Callbacks and visitors run on the caller's thread
  /// alone. At least 1. Pairs and their order are the same for any number.
  int threads = 1;
};

}  // namespace fcl_fibers
