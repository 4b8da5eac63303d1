// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "geometry/moving_segment.h"
#include "index/segment_index.h"
#include "index/step.h"

namespace fcl_fibers::broadphase {

using tree::SegmentId;

/// Segments by id, as they were in an index that may have been built again since.
class RememberedSegments {
 public:
  RememberedSegments() = default;
  explicit RememberedSegments(const index::SegmentIndex& index);

  const geometry::Frame& frame() const { return frame_; }
  /// Null if the id has none.
  const geometry::Segment* find(SegmentId id) const;
  /// Gives each segment the id newId(id), or forgets it if that is negative. The order is kept.
  template <class NewId>
  void renumber(NewId&& newId) {
    auto kept = segments_.begin();
    for (const Entry& entry : segments_) {
      const SegmentId id = newId(entry.id);
      if (id >= 0) *kept++ = {id, entry.segment};
    }
    segments_.erase(kept, segments_.end());
  }

 private:
  struct Entry {
    SegmentId id;
    geometry::Segment segment;
  };

  geometry::Frame frame_;
  std::vector<Entry> segments_;  ///< ids ascend
};

/// An index and, once its segments have moved, a second one with the same topology and frame that
/// is fitted to the start of the step. Without the second one all segments rest. A segment that was
/// read for the first time during the step starts where it was then.
///
/// A build may need several attempts, with calls of beginStep() and renumber() between them. What
/// the indexes held before the first attempt is remembered until settle().
class MovingIndex {
 public:
  using Segment = geometry::Segment;
  using MovingSegment = geometry::MovingSegment;

  /// @param moves  whether searches for pairs look at the step
  MovingIndex(const index::IndexOptions& options, bool moves) : end_(options), moves_(moves) {}

  const index::SegmentIndex* operator->() const { return &end_; }
  const index::SegmentIndex& operator*() const { return end_; }
  /// The index at the start of the step, which may be that at its end.
  const index::SegmentIndex& start() const { return start_ ? *start_ : end_; }
  MovingSegment segment(SegmentId id) const {
    return {start_ ? start_->segment(id) : end_.segment(id), end_.segment(id)};
  }

  /// Copies the segments at the end, which rest then.
  void copy(const MovingIndex& other);
  void clear();

  /// Makes the second index if all segments rest so far.
  void makeStart();
  /// Begins a step where the present one ends. If `all` is set, it takes the end away; it needs no
  /// memory then if makeStart() was called.
  /// @param all  whether refit() or a build comes next, so that the end need not be kept
  void beginStep(bool all);

  /// Calls build(index), which reads all segments and builds the index, and fits the start. Takes
  /// the segments of `others`, if that is not null.
  /// @return what build() returns
  template <class Build>
  bool build(const index::SegmentSource& source, MovingIndex* others, Build&& build) {
    remember();
    if (others != nullptr) others->leave();
    start_ = nullptr;
    moved_all_ = is_read_ = true;
    if (!build(end_)) return false;
    fitStart(source, others);
    return true;
  }
  /// Keeps what the indexes hold; a build has to come next.
  void remember();
  /// Needs no memory.
  /// @pre remember() was called
  template <class NewId>
  void renumber(NewId&& newId) {
    if (!before_) return;
    before_->start.renumber(newId);
    before_->end.renumber(newId);
  }
  /// Forgets what was before the build.
  void settle() { before_.reset(); }

  /// See SegmentIndex.
  ///@{
  bool refit(const index::SegmentSource& source);
  bool tryRefit(const index::SegmentSource& source, const geometry::Frame& frame);
  bool refitSome(const std::vector<SegmentId>& ids, const std::vector<Segment>& moved);
  ///@}

  // See SegmentIndex::search(). Searches for pairs look at the step, those for the nearest at its
  // end.

  tree::Visit search(index::PairSink& sink) const;
  tree::Visit search(index::NearestSink& sink) const { return end_.search(sink); }
  tree::Visit search(const MovingSegment& segment, double error, tree::Group group,
                     SegmentId second, index::PairSink& sink) const;
  tree::Visit search(const MovingSegment& segment, double error, tree::Group group,
                     SegmentId second, index::NearestSink& sink) const {
    return end_.search(segment.end, error, group, second, sink);
  }
  tree::Visit search(const MovingIndex& other, const index::SegmentSource* source,
                     index::PairSink& sink) const;
  tree::Visit search(const MovingIndex& other, const index::SegmentSource* source,
                     index::NearestSink& sink) const {
    return end_.search(other.end_, source, sink);
  }

  /// See Step::searchImpacts().
  tree::Visit search(const index::MovingMesh& mesh, double margin, index::PairSink& sink) const {
    return empty() ? tree::Visit::kContinue : step().searchImpacts(mesh, margin, sink);
  }

  std::size_t memoryUsage() const;

 private:
  struct Before {
    RememberedSegments start, end;
  };

  index::Step step() const { return {start(), end_}; }
  bool empty() const { return end_.begin() == end_.end(); }
  std::unique_ptr<index::SegmentIndex> copyOfEnd() const;
  void moveAll();
  void leave();
  void fitStart(const index::SegmentSource& source, const MovingIndex* others);
  void followFrame(const index::SegmentSource& source);

  index::SegmentIndex end_;
  std::unique_ptr<index::SegmentIndex> start_;
  const bool moves_;
  bool is_read_ = true;           ///< whether the segments are not those of a copied index
  bool moved_all_ = true;         ///< whether any segment may have moved since the start
  std::vector<SegmentId> moved_;  ///< those that have, unless all may have
  std::optional<Before> before_;
};

}  // namespace fcl_fibers::broadphase
