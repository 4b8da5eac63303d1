// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <fcl_fibers/fiber_tree.h>

#include "fibers/fiber_table.h"
#include "geometry/frame.h"
#include "index/segment_source.h"

namespace fcl_fibers::arrays {

/// Reads capsules from arrays; a capsule's id is the index of its first point.
/// @pre the arrays have passed checkArrays()
template <typename S>
class ArraySource final : public index::SegmentSource {
 public:
  explicit ArraySource(const FiberArrays<S>& fibers) : fibers_(fibers) {}

  index::SegmentId read(index::SegmentId begin, index::SegmentId end, const geometry::Frame& frame,
                        geometry::Segment* out, std::uint64_t& present) const override;
  [[noreturn]] void refuse(index::SegmentId id, const geometry::Frame& frame) const override;

 private:
  const FiberArrays<S>& fibers_;
};

/// Throws std::invalid_argument if arrays are null or do not fit each other, or if a number in them
/// is out of range.
/// @return a frame for the fibers
template <typename S>
geometry::Frame checkArrays(const char* call, const FiberArrays<S>& fibers);

/// Adds the fibers of the arrays to an empty table.
template <typename S>
void addFibers(const FiberArrays<S>& fibers, fibers::FiberTable& table);

}  // namespace fcl_fibers::arrays
