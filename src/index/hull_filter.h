// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <vector>

#include "geometry/frame.h"
#include "geometry/impact_pairs.h"
#include "index/pair_query.h"
#include "index/segment_marks.h"
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
  /// @param elements  of the search, for an error if it computes too many pairs: see requireFew()
  explicit FirstTime(std::size_t elements) : elements_(elements) {}

  double get() const { return first_.load(std::memory_order_relaxed); }
  /// The last time that counts in a search, rounded up.
  const std::atomic<float>& until() const { return until_; }
  void add(double time);
  /// Counts pairs whose approach has been computed, as it has to be of all that touch at the start.
  /// Throws std::length_error once they are too many for the elements.
  void addComputed(std::size_t count);

 private:
  const std::size_t elements_;
  std::atomic<std::size_t> computed_{0};
  std::atomic<double> first_{1};
  std::atomic<float> until_{1};
};

/// The last time of a step that counts.
inline const std::atomic<float>& lastTime(const Question& question) {
  return question.first != nullptr ? question.first->until() : tree::kWholeStep;
}

/// Hulls of two corners, for a HullFilter.
/// @tparam Range  SegmentRange or, in a step, MovingRange
template <class Range>
struct SegmentHulls {
  Range segments;
  /// Maps to the frame of the first segments of the pairs; null if the hulls are in that frame.
  const geometry::FrameChange* to_first = nullptr;
  /// Bounds the error of end points, if it is larger than their coordinates imply. It is unused if
  /// the frames differ, because the change has its own bound.
  double error = 0;
};

/// Hulls of three corners, for a HullFilter.
/// @tparam Mesh  PosedTriangles or, in a step, PosedMesh
template <class Mesh>
struct TriangleHulls {
  const Mesh& mesh;
  /// Whether one triangle of each segment is enough; others may be left out.
  bool once = false;
  const SegmentMarks* left_out = nullptr;  ///< segments whose pairs do not count; null for none
};

/// Keeps the pairs of a segment and a hull that touch, and in a step finds when. It decides many
/// pairs at a time in float; touch() and findImpact() decide those near the boundary, and all of
/// triangles in a step.
/// @tparam Range  of the segments: SegmentRange or, in a step, MovingRange
/// @tparam Hulls  SegmentHulls or TriangleHulls
template <class Range, class Hulls>
class HullFilter final : public PairFilter {
 public:
  /// @param margin  in the frame of the segments
  /// @param unit    what lengths there are multiplied by to be compared in float
  HullFilter(const Range& segments, const Hulls& hulls, double margin, double unit,
             const Question& question = {});

  std::size_t keep(tree::Pair* pairs, std::size_t count,
                   std::vector<geometry::Impact>& impacts) const override;

 private:
  template <class Visit>
  void forEachLeft(const tree::Pair* pairs, std::size_t count, Visit&& visit) const;

  Range segments_;
  Hulls hulls_;
  double margin_, unit_;
  Question question_;
  /// Bounds the error of all points of every pair; -1 if one bound for all would be too wide.
  double error_of_all_;
};

}  // namespace fcl_fibers::index
