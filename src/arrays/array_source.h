// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "fibers/fiber_table.h"
#include "geometry/frame.h"
#include "index/segment_source.h"
#include "parallel/executor.h"

namespace fcl_fibers::arrays {

/// Reads capsules from arrays; a capsule's id is the index of its first point.
/// @pre the arrays have passed checkArrays()
template <typename S>
class ArraySource final : public index::SegmentSource {
 public:
  /// @param largest  the largest magnitude of a coordinate or radius
  ArraySource(const FiberArrays<S>& fibers, double largest) : fibers_(fibers), largest_(largest) {}

  bool read(const index::SegmentId* ids, int count, int ahead, const geometry::Frame& frame,
            index::SegmentBlock& out, index::BlockMask& present) const override;
  double readEnds(index::SegmentId begin, index::SegmentId end, const geometry::Frame& frame,
                  geometry::CapsuleEnd* out, bool& are_tapered) const override;
  bool staysFiniteIn(const geometry::Frame& frame) const override;
  bool isFasterInOrder() const override { return false; }
  [[noreturn]] void refuse(index::SegmentId id, const geometry::Frame& frame) const override;

 private:
  void readRadii(const index::SegmentId* ids, int count, double scale,
                 index::SegmentBlock& out) const;

  const FiberArrays<S>& fibers_;
  const double largest_;
};

/// Throws std::invalid_argument if arrays are null or do not fit each other, or if a number in them
/// is out of range.
/// @param executor  null for one thread
/// @return the largest magnitude of a coordinate or radius
template <typename S>
double checkArrays(const char* call, const FiberArrays<S>& fibers,
                   parallel::Executor* executor = nullptr);

/// A frame for the capsules `ids`. Throws std::invalid_argument if there is none.
template <typename S>
geometry::Frame frameFor(const char* call, const ArraySource<S>& source,
                         const tree::SegmentIds& ids);

/// Adds the fibers of the arrays to an empty table.
template <typename S>
void addFibers(const FiberArrays<S>& fibers, fibers::FiberTable& table,
               parallel::Executor* executor);

}  // namespace fcl_fibers::arrays
