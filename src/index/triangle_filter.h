// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "index/pair_filter.h"
#include "index/posed_triangles.h"
#include "tree/segment_range.h"

namespace fcl_fibers::index {

/// Keeps the pairs of a segment and a triangle that touch. It decides many pairs at a time in
/// float; touch() decides those near the boundary.
class TriangleFilter final : public PairFilter {
 public:
  /// @param triangles  borrowed
  /// @param margin     in the frame of the segments
  /// @param error      bounds the error of a segment's end points, if it is larger than their
  ///                   coordinates imply
  /// @param once       whether one triangle of each segment is enough; others may be left out
  /// @param unit       see PairBlock
  TriangleFilter(tree::SegmentRange segments, const PosedTriangles& triangles, double margin,
                 double error, bool once, double unit);

  std::size_t keep(tree::Pair* pairs, std::size_t count,
                   std::vector<geometry::Impact>& impacts) const override;

 private:
  double error(const geometry::Segment& segment) const;
  bool touches(const tree::Pair& pair) const;

  tree::SegmentRange segments_;
  const PosedTriangles& triangles_;
  double margin_, error_, unit_;
  bool once_;
  /// Bounds the error of the points of every pair; -1 if one bound for all would be too wide.
  double error_of_all_ = -1;
};

}  // namespace fcl_fibers::index
