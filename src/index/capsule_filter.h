// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "geometry/frame.h"
#include "geometry/segment.h"
#include "index/kept_segments.h"
#include "index/pair_filter.h"
#include "tree/search.h"

namespace fcl_fibers::index {

/// Keeps the pairs whose capsules touch. It decides many pairs at a time in float; touch() decides
/// those near the boundary.
class CapsuleFilter final : public PairFilter {
 public:
  /// @param b       in a's frame, or in another frame from which `b_to_a` leads to a's
  /// @param margin  in a's frame
  /// @param unit    see CapsulePairs
  /// @param error   bound on the error of b's end points, if it is larger than their coordinates
  ///                imply; unused if `b_to_a` is given, which has its own bound
  CapsuleFilter(SegmentRange a, SegmentRange b, const geometry::FrameChange* b_to_a, double margin,
                double unit, double error = 0);

  std::size_t keep(tree::Pair* pairs, std::size_t count,
                   std::vector<geometry::Impact>& impacts) const override;

 private:
  geometry::Segment second(const tree::Pair& pair) const;
  double error(const tree::Pair& pair, const geometry::Segment& q) const;

  SegmentRange a_, b_;
  const geometry::FrameChange* b_to_a_;
  double margin_, unit_, error_;
  /// Bounds the error of the end points of every pair; -1 if one bound for all would be too wide.
  double error_of_all_ = -1;
};

}  // namespace fcl_fibers::index
