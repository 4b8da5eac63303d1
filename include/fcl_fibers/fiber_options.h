// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

/// Collision detection among fibers of capsules.
namespace fcl_fibers {

/// Where a segment stands: its fiber, and its number along that fiber, both counted from 0. Fibers
/// count in the order in which they were given; an object that is no part of a fiber is a fiber of
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
/// segments of one group are never reported. So a fiber of a group never meets itself, even if it
/// is the only one of its group. The number 0 is no group. A part of the tree whose segments are
/// all of one group is not searched against itself. Each tree or manager has numbers of its own.
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
  /// spheres. FCL's managers report the same when they are given tight boxes.
  kVolumes,
  /// Every pair of capsules no further apart than the sum of their radii and the margin. A sphere
  /// is a capsule of length zero; every other shape counts by its box.
  kCapsules,
};

/// What FiberTree and the fiber managers are told once, at construction, which throws
/// std::invalid_argument where an option is out of the range said here.
struct FiberOptions {
  Topology topology = Topology::kBundle;  ///< shape of the tree: speed alone
  Report report = Report::kVolumes;       ///< which pairs a query reports

  /// Pairs of one fiber whose segment numbers differ by this much or less are not reported. 0
  /// reports all; 1 leaves out adjacent segments, which always overlap. Not negative.
  int ignored_neighbors = 0;

  /// Likewise pairs of one fiber between which this much of it lies or less, measured along it when
  /// it was built or registered: for fibers of unequal segments. In the scene's unit of length; 0
  /// leaves that to ignored_neighbors alone. Finite, not negative.
  double ignored_arc_length = 0;

  /// Pairs this close count as touching, in the scene's unit of length. Finite, not negative.
  double margin = 0;

  /// Threads that build, update, self-collision and collision with another tree or fiber manager
  /// share their work among, the caller's included; callbacks and visitors run on the caller's
  /// alone. At least 1. Pairs and their order are the same for any number.
  int threads = 1;
};

}  // namespace fcl_fibers
