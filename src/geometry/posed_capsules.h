// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/tree_export.h>

#include "geometry/frame.h"
#include "geometry/segment_block.h"

namespace fcl_fibers::geometry {

/// Capsules in the world as poses, lengths and radii, and the boxes around them, in rows. A sphere
/// is a capsule of length 0. The axis of a capsule is the third column of its rotation.
struct PosedCapsules {
  static constexpr int kCapacity = SegmentBlock::kCapacity;

  /// Puts the unit sphere in a place that is not used.
  FCL_FIBERS_TREE_EXPORT void clear(int i);

  alignas(64) double rotation[3][3][kCapacity];  ///< by column, then by axis
  alignas(64) double position[3][kCapacity];
  alignas(64) double length[kCapacity];
  alignas(64) double radius[kCapacity];
  alignas(64) double low[3][kCapacity];   ///< of the box; unused if boxes do not count
  alignas(64) double high[3][kCapacity];  ///< of the box
};

/// Writes the segments of the first `count` capsules, and of those up to the next multiple of
/// eight, in `frame`. Returns a bit for each capsule whose pose, size and coordinates are proper.
/// If boxes count, its box must also add nothing: it has the size that FCL gives it, turned or not,
/// or the least size in its pose. Segments without a bit are unspecified.
/// @param rotation_tolerance  how far a rotation may be from an orthonormal one, in sum
/// @param epsilon             machine epsilon of the scalar of poses and boxes
FCL_FIBERS_TREE_EXPORT BlockMask segmentsOf(const PosedCapsules& capsules, int count,
                                            const Frame& frame, double rotation_tolerance,
                                            double epsilon, bool count_boxes, SegmentBlock& out);

}  // namespace fcl_fibers::geometry
