// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/fiber_options.h>

namespace fcl_fibers {

/// What an object of a manager counts by in the broad phase: its shape, its box or both.
enum class Bounds {
  /// Its pose and shape. The manager never reads `getAABB()`. This is the fastest, and enough for a
  /// program that does not enlarge boxes.
  kShapes,
  /// Its pose and shape, and the margin that the program has added to FCL's own box of the shape,
  /// as a program does that asks for a contact distance. A box that contains the shape but is
  /// larger on some sides than on others counts as well. `computeAABB()` is not needed. FCL's
  /// larger boxes of turned objects add nothing: of a box from an earlier pose only the size
  /// counts. docs/contract.md has the whole rule.
  kShapesAndMargins,
  /// Its `getAABB()` alone, even for capsules, as in FCL's managers. This is for a program that
  /// makes boxes smaller. It has to call `computeAABB()` to keep them up to date.
  kObjects,
};

/// Options of a fiber manager. The manager's constructor throws std::invalid_argument if one of
/// them is out of its range. `collide` and `distance` both leave out neighbours along a fiber,
/// which are segments of one registerFiber() call, and pairs of one group.
///
///     FiberManagerOptions options;
///     options.ignored_neighbors = 1;  // adjacent segments always touch
///     LayeredAABBTreeCollisionManagerd manager(options);
struct FiberManagerOptions : FiberOptions {
  Bounds bounds = Bounds::kShapesAndMargins;  ///< what an object counts by
};

}  // namespace fcl_fibers
