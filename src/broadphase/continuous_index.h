// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdlib>
#include <mutex>
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

  enum class Part { kStart, kEnd, kWhole };
  /// The segments at the start or at the end, or boxes around their whole motion.
  class Source final : public index::SegmentSource {
   public:
    /// @param moving  borrowed
    Source(const MovingSegments& moving, Part part) : moving_(moving), part_(part) {}

    bool read(const tree::SegmentId* ids, int count, int ahead, const geometry::Frame& frame,
              index::SegmentBlock& out, index::BlockMask& present) const override;
    bool staysFiniteIn(const geometry::Frame&) const override { return true; }
    bool isFasterInOrder() const override { return false; }
    [[noreturn]] void refuse(tree::SegmentId, const geometry::Frame&) const override {
      std::abort();  // read() reads all
    }

   private:
    const MovingSegments& moving_;
    const Part part_;
  };

  explicit ContinuousIndex(const index::IndexOptions& options)
      : start_(options), end_(options), whole_(options) {}

  /// @param moving  in the world, by id
  void build(MovingSegments moving, const tree::Fibers& fibers);
  /// Takes the segments anew, as they move now. Returns false if a build pays.
  bool refit(MovingSegments moving);
  /// Does the same for some.
  bool refitSome(const std::vector<tree::SegmentId>& ids, const MovingSegments& moved);
  void clear();

  const MovingSegments& moving() const { return moving_; }
  Source whole() const { return {moving_, Part::kWhole}; }
  const geometry::Frame& frame() const { return start_.frame(); }
  /// A segment of the world in frame().
  geometry::MovingSegment inFrame(const geometry::MovingSegment& moving) const;
  const index::IndexOptions& options() const { return start_.options(); }

  /// See SegmentIndex.
  void forRanges(std::size_t count, std::size_t grain,
                 parallel::FunctionRef<std::size_t, std::size_t> visit) const {
    start_.forRanges(count, grain, visit);
  }

  // A search for a PairSink finds the pairs whose boxes overlap at some time in the step, or whose
  // capsules touch if the options say so. One for a NearestSink finds those whose boxes come nearer
  // than its limit at some time; nodes are boxes around the whole motion, and so is its source.

  tree::Visit search(index::PairSink& sink) const;
  tree::Visit search(index::NearestSink& sink) const;

  /// Finds the pairs with one segment, see SegmentIndex::search().
  /// @param moving  in the world
  ///@{
  tree::Visit search(const geometry::MovingSegment& moving, tree::Group group,
                     tree::SegmentId second, index::PairSink& sink) const;
  tree::Visit search(const geometry::MovingSegment& moving, tree::Group group,
                     tree::SegmentId second, index::NearestSink& sink) const;
  ///@}

  tree::Visit search(const ContinuousIndex& other, index::PairSink& sink) const;
  tree::Visit search(const ContinuousIndex& other, index::NearestSink& sink) const;

  std::size_t memoryUsage() const;

 private:
  class NearSink;

  index::Step step() const { return {start_, end_}; }
  const index::SegmentIndex& wholeIndex() const;

  MovingSegments moving_;
  index::SegmentIndex start_, end_;
  mutable index::SegmentIndex whole_;
  mutable bool has_whole_ = false;
  mutable std::mutex whole_mutex_;
};

}  // namespace fcl_fibers::broadphase
