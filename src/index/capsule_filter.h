// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <vector>

#include "geometry/frame.h"
#include "geometry/impact_pairs.h"
#include "geometry/moving_segment.h"
#include "index/pair_filter.h"
#include "index/pair_query.h"
#include "tree/moving_tree.h"
#include "tree/segment_range.h"

namespace fcl_fibers::index {

/// Segments at the start and at the end of a step. If they rest, both are the same.
struct MovingRange {
  tree::SegmentRange start, end;

  geometry::MovingSegment operator[](tree::SegmentId id) const { return {start[id], end[id]}; }
  geometry::MovingCapsule capsule(tree::SegmentId id) const {
    return {start.capsule(id), end.capsule(id)};
  }
  FCL_FIBERS_ALWAYS_INLINE void prefetch(tree::SegmentId id) const {
    start.prefetch(id);
    end.prefetch(id);
  }
  /// Bounds endPointError() of every segment at any time.
  double mostError() const { return std::max(start.mostError(), end.mostError()); }
};

/// The first of the times that several threads find; 1 if there is none.
class FirstTime {
 public:
  double get() const { return first_.load(std::memory_order_relaxed); }
  /// The last time that counts in a search, rounded up.
  const std::atomic<float>& until() const { return until_; }
  void add(double time);

 private:
  std::atomic<double> first_{1};
  std::atomic<float> until_{1};
};

/// The last time of a step that counts.
inline const std::atomic<float>& lastTime(const Question& question) {
  return question.first != nullptr ? question.first->until() : tree::kWholeStep;
}

/// Keeps the pairs whose capsules touch, and in a step finds when. It decides many pairs at a time
/// in float; touch() and findImpact() decide those near the boundary.
class CapsuleFilter final : public PairFilter {
 public:
  /// @param b         in a's frame, or in another frame from which `b_to_a` leads to a's
  /// @param margin    in a's frame
  /// @param unit      see CapsulePairs
  /// @param error     bound on the error of b's end points, if it is larger than their coordinates
  ///                  imply; unused if `b_to_a` is given, which has its own bound
  /// @param moves     whether the whole step counts, not only its end
  CapsuleFilter(const MovingRange& a, const MovingRange& b, const geometry::FrameChange* b_to_a,
                double margin, double unit, double error = 0, bool moves = false,
                const Question& question = {});

  std::size_t keep(tree::Pair* pairs, std::size_t count,
                   std::vector<geometry::Impact>& impacts) const override;

 private:
  template <class Range>
  auto together(const Range& a, const Range& b, const tree::Pair& pair) const;
  template <class Block, class Range, class F>
  void forEachLeft(const Range& a, const Range& b, const tree::Pair* pairs, std::size_t count,
                   F&& visit) const;
  std::size_t keepTouching(tree::Pair* pairs, std::size_t count) const;
  std::size_t keepImpacts(tree::Pair* pairs, std::size_t count,
                          std::vector<geometry::Impact>& impacts) const;

  MovingRange a_, b_;
  const geometry::FrameChange* b_to_a_;
  double margin_, unit_, error_;
  bool moves_;
  Question question_;
  /// Bounds the error of the end points of every pair; -1 if one bound for all would be too wide.
  double error_of_all_ = -1;
};

}  // namespace fcl_fibers::index
