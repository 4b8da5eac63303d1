// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>

#include "index/kept_segments.h"
#include "index/segment_index.h"
#include "scenes/step.h"

namespace fcl_fibers::benchmarks {

/// Reads for each segment the box around both of its positions in a step, which is all that a tree
/// without motion can know of it. A segment's id is the index of its first point.
class SweptBoxes final : public index::SegmentSource {
 public:
  explicit SweptBoxes(const scenes::Step& step) : step_(&step) {}

  geometry::Segment box(index::SegmentId id, const geometry::Frame& frame) const;

  bool read(const index::SegmentId* ids, int count, int ahead, const geometry::Frame& frame,
            index::SegmentBlock& out, index::BlockMask& present) const override;
  bool staysFiniteIn(const geometry::Frame& frame) const override;
  bool isFasterInOrder() const override { return false; }
  [[noreturn]] void refuse(index::SegmentId id, const geometry::Frame& frame) const override;

 private:
  const scenes::Step* step_;
};

/// Finds impacts as trees without motion have to: by a box around both positions of each segment.
/// What overlaps is tested by the library's own test, neighbours left out.
class SweptTree {
 public:
  SweptTree() : start_(/*share_ends=*/true), end_(/*share_ends=*/true) {}
  virtual ~SweptTree() = default;

  /// Reads capsules and boxes.
  /// @pre the fibers are those of the first call
  void update(const scenes::Step& step);

  /// Hands impacts to sink.take(), and returns how many pairs of boxes overlap.
  std::size_t searchImpacts(index::PairSink& sink) const;
  /// Hands all pairs of boxes that overlap to the sink.
  virtual void searchCandidates(index::PairSink& sink) const = 0;

 protected:
  virtual void fit(const scenes::Step& step) = 0;
  const tree::Fibers& fibers() const { return fibers_; }

 private:
  tree::Fibers fibers_;
  index::KeptSegments start_, end_;
  double error_ = 0;  ///< bounds endPointError() of all segments
};

/// Our static tree, on one thread.
std::unique_ptr<SweptTree> ourSweptTree();
#ifdef FCL_FIBERS_WITH_EMBREE
/// @param morton  see makeEmbreeBoxes()
std::unique_ptr<SweptTree> embreeSweptTree(bool morton);
#endif

}  // namespace fcl_fibers::benchmarks
