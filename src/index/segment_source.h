// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/tree_export.h>

#include "geometry/capsule_test.h"
#include "geometry/frame.h"
#include "geometry/segment.h"
#include "geometry/segment_block.h"
#include "tree/topology.h"

namespace fcl_fibers::index {

using geometry::BlockMask;
using geometry::SegmentBlock;
using tree::SegmentId;

/// The objects or arrays from which an index reads its segments in blocks. Several threads may read
/// at the same time.
class SegmentSource {
 public:
  /// Reads the segments ids[0], ..., ids[count - 1] in `frame` into the first places of `out`. The
  /// place of a segment that was removed gets numbers, too, because one operation takes several.
  /// @param ahead    how many ids after those will be read soon, and so may be prefetched
  /// @param present  bit i is set if ids[i] is still a segment, and cleared if it was removed
  /// @return whether all could be read
  /// @pre the ids are segments that the index was built from; 0 < count <= SegmentBlock::kCapacity
  virtual bool read(const SegmentId* ids, int count, int ahead, const geometry::Frame& frame,
                    SegmentBlock& out, BlockMask& present) const = 0;

  /// Reads the ends of segments that share them, as KeptSegments have them, for the ids in
  /// [begin, end), and returns a bound of their coordinates. Ids that are no segments get numbers,
  /// too. It returns a negative number, and reads nothing, if the source cannot do so.
  /// @param are_tapered  is set if a segment is tapered, and otherwise left as it is
  virtual double readEnds(SegmentId /*begin*/, SegmentId /*end*/, const geometry::Frame& /*frame*/,
                          geometry::CapsuleEnd* /*out*/, bool& /*are_tapered*/) const {
    return -1;
  }

  /// Reads one segment as it is now. Returns false if it was removed or cannot be read.
  virtual bool readNow(SegmentId id, const geometry::Frame& frame,
                       geometry::Segment& segment) const {
    SegmentBlock block;
    BlockMask present = 0;
    if (!read(&id, 1, 0, frame, block, present) || present == 0) return false;
    segment = block[0];
    return true;
  }

  /// Whether coordinates stay finite in a frame, as far as can be told without reading them all.
  virtual bool staysFiniteIn(const geometry::Frame& frame) const = 0;

  /// Whether reading is much faster in the order of ids than in the order of the tree, because each
  /// segment is read from a large object.
  virtual bool isFasterInOrder() const = 0;

  /// Throws std::invalid_argument with the reason why a segment cannot be read.
  [[noreturn]] virtual void refuse(SegmentId id, const geometry::Frame& frame) const = 0;

 protected:
  ~SegmentSource() = default;
};

/// Reads one segment in `frame`. Returns false if it was removed, and throws by refuse() if it
/// cannot be read.
bool readOne(const SegmentSource& source, SegmentId id, const geometry::Frame& frame,
             geometry::Segment& segment);

/// Refuses the segment with the least id of those that cannot be read.
/// @pre one of them could not be read
[[noreturn]] void refuseLeast(const SegmentSource& source, tree::SegmentIds ids,
                              const geometry::Frame& frame);

/// Chooses a frame from a sample of segments. It passes over those that were removed, cannot be
/// read or are unbounded. If coordinates far outside would overflow in the unit of the others, the
/// unit is made smaller.
FCL_FIBERS_TREE_EXPORT geometry::Frame frameFor(const SegmentSource& source,
                                                const tree::SegmentIds& ids);

}  // namespace fcl_fibers::index
