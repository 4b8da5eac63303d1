// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/fiber_options.h>

namespace fcl_fibers {

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
/// option is out of its range. Neither `collide` nor `distance` reports what the options leave out;
/// neighbours are those of one registerFiber() call.
struct FiberManagerOptions : FiberOptions {
  Bounds bounds = Bounds::kShapesAndMargins;  ///< what bounds an object
};

}  // namespace fcl_fibers
