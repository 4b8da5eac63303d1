// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "geometry/moving_segment.h"
#include "index/posed_mesh.h"
#include "index/segment_index.h"
#include "live/live_list.h"

namespace fcl_fibers::broadphase {

using tree::SegmentId;

/// Segments in two indexes with one frame: a manager's objects by their ids, or the boxes of those
/// beside its tree by their places. The main index has what was there when it was built; the young
/// index has what has come since, whose ids follow. It is small and is rebuilt when it grows, so
/// that many single registrations share the price of one build of the main index.
class Generations {
 public:
  using Segment = geometry::Segment;
  using MovingSegment = geometry::MovingSegment;

  /// @param moves  whether searches for pairs look at the step
  /// @param lives  whether use() will be called, so that a search may have to fit the volumes
  Generations(const index::IndexOptions& options, bool moves, bool lives = false)
      : main_(options), young_(singleThreaded(options)), moves_(moves), lives_(lives) {}

  const index::IndexOptions& options() const { return main_.options(); }
  const geometry::Frame& frame() const { return main_.frame(); }
  /// Young ids are youngBegin(), ..., end() - 1.
  ///@{
  SegmentId youngBegin() const { return main_.end(); }
  SegmentId end() const { return end_; }
  ///@}
  bool isYoung(SegmentId id) const { return id >= main_.end(); }
  /// The number of segments in both indexes.
  std::size_t size() const {
    return main_.leaves().size() + (hasYoung() ? young_.leaves().size() : 0);
  }
  /// See SegmentIndex.
  ///@{
  bool keepsSegments() const { return main_.keepsSegments(); }
  bool hasBoxes() const {
    return keepsSegments() && (main_.hasBoxes() || (hasYoung() && young_.hasBoxes()));
  }
  bool hasCapsules() const {
    return !keepsSegments() || main_.hasCapsules() || (hasYoung() && young_.hasCapsules());
  }
  Segment segment(SegmentId id) const { return (isYoung(id) ? young_ : main_).segment(id); }
  bool isBox(SegmentId id) const { return (isYoung(id) ? young_ : main_).isBox(id); }
  double margin() const { return main_.margin(); }
  ///@}
  bool isSwampedBy(const Generations& other) const { return main_.isSwampedBy(other.main_); }
  /// A segment during the step.
  MovingSegment moving(SegmentId id) const { return (isYoung(id) ? young_ : main_).moving(id); }

  /// How many of `size` segments may be young before all are built into one index. If they come one
  /// by one, each costs a build of the young index, and the one that exceeds this number costs a
  /// build of the main index. The sum is least at sqrt(2 size).
  static std::size_t mostYoung(std::size_t size) {
    return std::min(size / 8, static_cast<std::size_t>(std::sqrt(2.0 * static_cast<double>(size))));
  }
  /// Whether all are to be built into one index before a search, because many are young. So many
  /// ids may have come, too, that those that have gone again take more time than the others.
  /// @param young    the number of ids from youngBegin() on
  /// @param removed  how many of these belong to objects that have gone
  /// @param size     the number of all objects
  static bool areTooMany(std::size_t young, std::size_t removed, std::size_t size) {
    return young - removed > mostYoung(size) || young > size / 8;
  }

  /// Copies the segments, which rest.
  void copy(const Generations& other) {
    live_ = nullptr;
    main_.copy(other.main_);
    young_.copy(other.young_);
    end_ = other.end_;
  }
  void clear() {
    live_ = nullptr;
    main_.clear();
    young_.clear();
    end_ = 0;
  }

  /// See SegmentIndex.
  ///@{
  void beginStep() {
    main_.beginStep();
    young_.beginStep();
  }
  void endStep() {
    main_.endStep();
    young_.endStep();
  }
  /// @pre the source gives the segments in frame()
  void fitStart(const index::SegmentSource& source) {
    main_.fitStart(source);
    if (hasYoung()) young_.fitStart(source);
  }
  ///@}
  /// Keeps where the segments were at the start of the step, because their ids are about to change.
  /// All have to be built next.
  void keepStarts() {
    main_.takeStarts(young_);
    end_ = youngBegin();
  }
  /// See KeptSegments.
  /// @pre keepStarts() was called
  template <class NewId>
  void renumberStarts(NewId&& newId) {
    main_.renumberStarts(newId);
  }

  /// Builds all into the main index.
  void build(const index::SegmentSource& source, const geometry::Frame& frame, SegmentId end,
             const tree::Fibers& fibers) {
    live_ = nullptr;
    keepStarts();
    main_.build(source, frame, 0, end, fibers);
    end_ = end;
  }
  /// @param fibers  those of young segments
  /// @return false if the frame cannot hold a young segment; all have to be built then
  bool buildYoung(const index::SegmentSource& source, SegmentId end, const tree::Fibers& fibers) {
    forgetYoung();
    // The index starts at the first segment, which saves room for empty ids before it.
    const SegmentId begin = fibers.ids.empty() ? end : fibers.ids.front();
    if (!young_.tryBuild(source, frame(), begin, end, fibers)) return false;
    end_ = end;
    return true;
  }

  /// Gives up the young index, because it has to be built anew.
  void forgetYoung() { end_ = youngBegin(); }

  /// See SegmentIndex. Whether all should be built again depends on the main index alone, unless
  /// its frame cannot hold a young segment. The young index does not count, because it is small and
  /// is built whenever it grows.
  ///@{
  template <class... Frame>
  bool refit(const index::SegmentSource& source, const Frame&... given) {
    live_ = nullptr;
    const bool is_good = (lives_ && main_.reread(source)) || main_.refit(source, given...);
    return is_good && (!hasYoung() || young_.tryRefit(source, frame()));
  }
  bool refitSome(const std::vector<SegmentId>& ids, const std::vector<Segment>& moved) {
    bool is_good = true;
    for (index::SegmentIndex* part : {&main_, &young_}) {
      std::vector<SegmentId> part_ids;
      std::vector<Segment> part_moved;
      for (std::size_t i = 0; i < ids.size(); ++i) {
        if (isYoung(ids[i]) != (part == &young_)) continue;
        part_ids.push_back(ids[i]);
        part_moved.push_back(moved[i]);
      }
      if (part_ids.empty()) continue;
      if (part == &main_) live_ = nullptr;
      is_good &= part->refitSome(part_ids, part_moved) || part == &young_;
    }
    return is_good;
  }
  bool isFitted(const index::SegmentSource& source) const {
    return main_.isFitted(source) && (!hasYoung() || young_.isFitted(source));
  }
  ///@}

  /// The main index.
  ///@{
  index::SegmentIndex& main() { return main_; }
  const index::SegmentIndex& main() const { return main_; }
  ///@}
  /// Lets searches take the pairs within the main index from a list, until a segment of it changes.
  /// @param live  the pairs that touch as the segments are now; borrowed
  void use(const live::LiveList& live) { live_ = &live; }
  void forgetList() { live_ = nullptr; }

  /// Who gets the pairs of a search: one of the two. A NearestSink gets those at the end of the
  /// step.
  struct Sink {
    Sink(index::PairSink& sink) : pairs(&sink) {}
    Sink(index::NearestSink& sink) : nearest(&sink) {}
    index::PairSink* pairs = nullptr;
    index::NearestSink* nearest = nullptr;
  };

  // See SegmentIndex::search(). Pairs of one group across the two indexes are not excluded.

  tree::Visit search(const Sink& sink) const {
    const bool is_known = live_ != nullptr && sink.pairs != nullptr;
    const tree::Visit visit = is_known ? live_->handOn(*sink.pairs) : ask(main_, sink);
    if (visit == tree::Visit::kStop) return visit;
    if (!hasYoung()) return tree::Visit::kContinue;
    return ask(main_, sink, young_, kKept) == tree::Visit::kStop ? tree::Visit::kStop
                                                                 : ask(young_, sink);
  }

  tree::Visit search(const MovingSegment& segment, double error, tree::Group group,
                     SegmentId second, const Sink& sink) const {
    return forEach([&](const index::SegmentIndex& part) {
      return ask(part, sink, segment, error, group, second);
    });
  }

  tree::Visit search(const Generations& other, const index::SegmentSource& source,
                     const Sink& sink) const {
    return forEach([&](const index::SegmentIndex& part) {
      return other.forEach([&](const index::SegmentIndex& other_part) {
        return ask(part, sink, other_part, &source);
      });
    });
  }

  /// @param mesh    has a step if the whole step counts
  /// @param margin  of the search, in the world's unit; searches for the nearest have none
  tree::Visit searchMesh(const index::PosedMesh& mesh, double margin, const Sink& sink) const {
    return forEach([&](const index::SegmentIndex& part) {
      return part.leaves().empty() ? tree::Visit::kContinue : ask(part, sink, mesh, margin);
    });
  }

  /// See SegmentIndex::visitNear().
  /// @param moves  whether the whole step counts, not only its end
  template <class Near, class F>
  tree::Visit visitNear(bool moves, const Near& near, F&& visit) const {
    return forEach(
        [&](const index::SegmentIndex& part) { return part.visitNear(moves, near, visit); });
  }

  /// The threads of a query; null for one.
  parallel::Executor* executor() const { return main_.executor(); }

  std::size_t memoryUsage() const { return main_.memoryUsage() + young_.memoryUsage(); }

 private:
  static index::IndexOptions singleThreaded(index::IndexOptions options) {
    options.threads = 1;
    return options;
  }
  bool hasYoung() const { return end_ > main_.end(); }

  template <class... Partner>
  tree::Visit ask(const index::SegmentIndex& part, const Sink& sink,
                  const Partner&... partner) const {
    if (sink.nearest != nullptr) return part.search(partner..., *sink.nearest);
    index::Question question;
    question.of_step = moves_;
    question.once = true;
    return part.search(partner..., *sink.pairs, question);
  }

  template <class F>
  tree::Visit forEach(F&& visit) const {
    if (visit(main_) == tree::Visit::kStop) return tree::Visit::kStop;
    return hasYoung() ? visit(young_) : tree::Visit::kContinue;
  }

  static constexpr const index::SegmentSource* kKept = nullptr;  ///< the index has its segments
  index::SegmentIndex main_, young_;
  const bool moves_, lives_;
  const live::LiveList* live_ = nullptr;  ///< null if the pairs within the main index are unknown
  SegmentId end_ = 0;                     ///< youngBegin() unless the young index is complete
};

}  // namespace fcl_fibers::broadphase
