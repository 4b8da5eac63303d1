// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/fiber_options.h>

namespace fcl_fibers {

/// What bounds an object of a manager.
enum class Bounds {
  /// Pose and shape; `getAABB()` is never read. This is the fastest, and enough for a program that
  /// does not enlarge boxes.
  kShapes,
  /// Pose and shape, and the margin that a program has added to FCL's own box of the shape, as it
  /// does for a contact distance. A box that contains the shape and is larger on some sides than on
  /// others counts as well. `computeAABB()` is not needed, and what it computes for turned objects
  /// adds nothing: only the size of a box of another pose counts. docs/contract.md has the rule.
  kShapesAndMargins,
  /// `getAABB()` alone, for capsules too, as in FCL's managers. This is for boxes that a program
  /// makes smaller. They are up to date only if it calls `computeAABB()`.
  kObjects,
};

/// Options of a fiber manager, whose constructor throws std::invalid_argument if one is out of its
/// range. Neither `collide` nor `distance` reports what they leave out. Neighbours are segments of
/// one registerFiber() call.
struct FiberManagerOptions : FiberOptions {
  Bounds bounds = Bounds::kShapesAndMargins;  ///< what bounds an object
};

}  // namespace fcl_fibers
