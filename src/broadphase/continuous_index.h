// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "geometry/moving_segment.h"
#include "index/segment_index.h"
#include "index/step.h"

namespace fcl_fibers::broadphase {

/// Moving segments and their indexes: one fitted to the start of the step and one to its end.
/// Distances need a third one, around the whole motion. The first search for them makes it.
///
/// Searches are const and may run at the same time. After a call has thrown, the index must be
/// built again.
class ContinuousIndex {
 public:
  using MovingSegments = std::vector<geometry::MovingSegment>;

  explicit ContinuousIndex(const index::IndexOptions& options)
      : start_(options), end_(options), whole_(options) {}

  /// @param moving  in the world, by id
  /// @param frame   the frame to use if it can hold the segments
  void build(MovingSegments moving, const tree::Fibers& fibers,
             std::optional<geometry::Frame> frame = {});
  /// Takes the segments anew, as they move now. Returns false if a build pays.
  bool refit(MovingSegments moving);
  /// Does the same for some.
  bool refitSome(const std::vector<tree::SegmentId>& ids, const MovingSegments& moved);
  void clear();

  const MovingSegments& moving() const { return moving_; }
  const geometry::Frame& frame() const { return start_.frame(); }
  const index::IndexOptions& options() const { return start_.options(); }

  /// See SegmentIndex.
  void forRanges(std::size_t count, std::size_t grain,
                 parallel::FunctionRef<std::size_t, std::size_t> visit) const {
    start_.forRanges(count, grain, visit);
  }

  /// Finds the pairs whose boxes overlap at some time in the step, or whose capsules touch if the
  /// options say so, within this index or with another one.
  ///@{
  tree::Visit search(index::PairSink& sink) const;
  tree::Visit search(const ContinuousIndex& other, index::PairSink& sink) const;
  ///@}

  /// Finds the pairs whose boxes come nearer than a limit at some time in the step. Nodes are boxes
  /// around the whole motion. visit(a, b, limit) may lower the limit, which is in the world's unit.
  ///@{
  using VisitNear = std::function<tree::Visit(tree::SegmentId, tree::SegmentId, double&)>;
  tree::Visit searchNear(double limit, const VisitNear& visit) const;
  tree::Visit searchNear(const ContinuousIndex& other, double limit, const VisitNear& visit) const;
  ///@}

 private:
  class Source;
  class NearSink;

  index::Step step() const { return {start_, end_}; }
  const index::SegmentIndex& whole() const;

  MovingSegments moving_;
  index::SegmentIndex start_, end_;
  mutable index::SegmentIndex whole_;
  mutable bool has_whole_ = false;
  mutable std::mutex whole_mutex_;
};

}  // namespace fcl_fibers::broadphase
