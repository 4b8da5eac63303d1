// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/tree_export.h>

#include "geometry/frame.h"
#include "geometry/segment_block.h"

namespace fcl_fibers::geometry {

/// What the scalar of a program's poses and boxes can tell.
struct ScalarLimits {
  double epsilon;
  double tiny;     ///< four times the least number above 0
  double far;      ///< a box that reaches farther counts as open
  double no_turn;  ///< up to here FCL takes an entry of a rotation for 0
};

/// Capsules and boxes in the world as poses and sizes, and the boxes of their objects, in rows. A
/// sphere is a capsule of length 0. The axis of a capsule is the third column of its rotation.
struct PosedShapes {
  static constexpr int kCapacity = SegmentBlock::kCapacity;

  /// Puts the unit sphere in a place that is not used.
  FCL_FIBERS_TREE_EXPORT void clear(int i);

  alignas(64) double rotation[3][3][kCapacity];  ///< by column, then by axis
  alignas(64) double position[3][kCapacity];
  /// Sides of a box. Of a capsule the third is the length, and the others are any numbers, which
  /// may be missing where there are no boxes.
  alignas(64) double size[3][kCapacity];
  alignas(64) double radius[kCapacity];   ///< of a capsule; of a box that which its segment gets
  alignas(64) double low[3][kCapacity];   ///< of the object; unused if its box does not count
  alignas(64) double high[3][kCapacity];  ///< of the object
};

/// Writes the segments of the first `count` shapes, and of those up to the next multiple of eight,
/// in `frame`. Returns a bit for each whose pose, size and coordinates are proper. If the boxes of
/// objects count, its box must also add nothing: it has the size that FCL gives it, turned or not,
/// or that of the least box of a capsule. Segments without a bit are unspecified.
/// @param boxes               a bit for each that is a box; the others are capsules
/// @param rotation_tolerance  how far a rotation may be from an orthonormal one, in sum
FCL_FIBERS_TREE_EXPORT BlockMask segmentsOf(const PosedShapes& shapes, BlockMask boxes, int count,
                                            const Frame& frame, double rotation_tolerance,
                                            const ScalarLimits& limits, bool count_boxes,
                                            SegmentBlock& out);

}  // namespace fcl_fibers::geometry
