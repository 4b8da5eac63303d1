// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "geometry/frame.h"
#include "geometry/segment.h"
#include "tree/topology.h"

namespace fcl_fibers::index {

using tree::SegmentId;

/// What an index reads its segments from, in blocks: FCL's objects or arrays. Several threads may
/// read at the same time.
class SegmentSource {
 public:
  /// The most segments in a block: one for each bit of `present`.
  static constexpr SegmentId kBlock = 64;

  /// Reads the segments begin, ..., end - 1 into out[0], ..., out[end - begin - 1], in `frame`.
  /// @param present  bit i is set if begin + i is a segment, and cleared if the id is empty
  /// @return end, or the least id that cannot be read; segments after it are not read
  /// @pre begin < end <= begin + kBlock
  virtual SegmentId read(SegmentId begin, SegmentId end, const geometry::Frame& frame,
                         geometry::Segment* out, std::uint64_t& present) const = 0;

  /// Throws std::invalid_argument with the reason why a segment cannot be read.
  /// @pre read() has returned this id
  [[noreturn]] virtual void refuse(SegmentId id, const geometry::Frame& frame) const = 0;

 protected:
  ~SegmentSource() = default;
};

/// Reads one segment in `frame`. Returns false if the id is empty, and throws by refuse() if it
/// cannot be read.
bool readOne(const SegmentSource& source, SegmentId id, const geometry::Frame& frame,
             geometry::Segment& segment);

/// Chooses a frame from a sample of the segments begin, ..., end - 1. It passes over empty ids,
/// unreadable and unbounded segments.
geometry::Frame frameFor(const SegmentSource& source, SegmentId begin, SegmentId end);

}  // namespace fcl_fibers::index
