// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "broadphase/moving_index.h"

namespace fcl_fibers::broadphase {

/// A manager's objects in two indexes with one frame. The main index has the objects that were
/// registered when it was built; the young index has those registered since. Ids ascend in the
/// order of registration, so young ids follow the others. The young index is small and is rebuilt
/// when it grows, so that many single registrations share the price of one build of the main index.
class Generations {
 public:
  using Segment = geometry::Segment;
  using MovingSegment = geometry::MovingSegment;

  /// @param moves  see MovingIndex
  Generations(const index::IndexOptions& options, bool moves)
      : main_(options, moves), young_(singleThreaded(options), moves) {}

  const index::IndexOptions& options() const { return main_->options(); }
  const geometry::Frame& frame() const { return main_->frame(); }
  /// Young ids are youngBegin(), ..., end() - 1.
  ///@{
  SegmentId youngBegin() const { return main_->end(); }
  SegmentId end() const { return end_; }
  ///@}
  bool isYoung(SegmentId id) const { return id >= main_->end(); }
  /// See SegmentIndex.
  ///@{
  bool keepsSegments() const { return main_->keepsSegments(); }
  bool hasBoxes() const {
    return keepsSegments() && (main_->hasBoxes() || (hasYoung() && young_->hasBoxes()));
  }
  Segment segment(SegmentId id) const { return (isYoung(id) ? *young_ : *main_).segment(id); }
  bool isBox(SegmentId id) const { return (isYoung(id) ? *young_ : *main_).isBox(id); }
  double margin() const { return main_->margin(); }
  ///@}
  bool isSwampedBy(const Generations& other) const { return main_->isSwampedBy(*other.main_); }
  /// A segment during the step.
  MovingSegment moving(SegmentId id) const { return (isYoung(id) ? young_ : main_).segment(id); }

  /// How many of `size` objects may be young before all are built into one index. If objects are
  /// registered one by one, each costs a build of the young index, and the one that exceeds this
  /// number costs a build of the main index. The sum is least at sqrt(2 size).
  static std::size_t mostYoung(std::size_t size) {
    return std::min(size / 8, static_cast<std::size_t>(std::sqrt(2.0 * static_cast<double>(size))));
  }

  /// Copies the objects, which rest.
  void copy(const Generations& other);
  void clear();

  /// See MovingIndex.
  ///@{
  void beginStep(bool all) {
    // This may run out of memory. The next call begins the same step then.
    main_.makeStart();
    young_.makeStart();
    main_.beginStep(all);
    young_.beginStep(all);
  }
  void remember() {
    main_.remember();
    young_.remember();
  }
  template <class NewId>
  void renumber(NewId&& newId) {
    main_.renumber(newId);
    young_.renumber(newId);
  }
  void settle() {
    main_.settle();
    young_.settle();
  }
  ///@}

  /// Builds all objects into the main index, in a new frame.
  void build(const index::SegmentSource& source, SegmentId end, const tree::Fibers& fibers);
  /// @param fibers  the fibers of young objects
  /// @return false if the frame cannot hold a young object; all have to be built then
  bool buildYoung(const index::SegmentSource& source, SegmentId end, const tree::Fibers& fibers);

  /// See SegmentIndex. Whether all should be built again depends on the main index alone, unless
  /// its frame cannot hold a young object. The young index does not count, because it is small and
  /// is built whenever it grows.
  ///@{
  bool refit(const index::SegmentSource& source);
  bool refitSome(const std::vector<SegmentId>& ids, const std::vector<Segment>& moved);
  bool isFitted(const index::SegmentSource& source) const {
    return main_->isFitted(source) && (!hasYoung() || young_->isFitted(source));
  }
  ///@}

  // See SegmentIndex::search(). Pairs of one group across the two indexes are not excluded.

  template <class Sink>
  tree::Visit search(Sink& sink) const {
    if (main_.search(sink) == tree::Visit::kStop) return tree::Visit::kStop;
    if (!hasYoung()) return tree::Visit::kContinue;
    return main_.search(young_, nullptr, sink) == tree::Visit::kStop ? tree::Visit::kStop
                                                                     : young_.search(sink);
  }

  template <class Sink>
  tree::Visit search(const MovingSegment& segment, double error, tree::Group group,
                     SegmentId second, Sink& sink) const {
    return forEach(
        [&](const MovingIndex& part) { return part.search(segment, error, group, second, sink); });
  }

  template <class Sink>
  tree::Visit search(const Generations& other, const index::SegmentSource& source,
                     Sink& sink) const {
    return forEach([&](const MovingIndex& part) {
      return other.forEach(
          [&](const MovingIndex& other_part) { return part.search(other_part, &source, sink); });
    });
  }

  /// @param margin  of the search, in the world's unit; searches for the nearest have none
  ///@{
  tree::Visit searchMesh(const index::PosedMesh& mesh, double margin, index::PairSink& sink) const {
    return forEach([&](const MovingIndex& part) {
      return part->leaves().empty() ? tree::Visit::kContinue : part->searchMesh(mesh, margin, sink);
    });
  }
  tree::Visit searchMesh(const index::PosedMesh& mesh, double /*margin*/,
                         index::NearestSink& sink) const {
    return forEach([&](const MovingIndex& part) {
      return part->leaves().empty() ? tree::Visit::kContinue : part->searchMesh(mesh, sink);
    });
  }
  /// During the whole step.
  tree::Visit searchMesh(const index::MovingMesh& mesh, double margin,
                         index::PairSink& sink) const {
    return forEach([&](const MovingIndex& part) { return part.search(mesh, margin, sink); });
  }
  ///@}

  /// See SegmentIndex::visitNear().
  /// @param moves  whether the whole step counts, not only its end
  template <class Near, class F>
  tree::Visit visitNear(bool moves, const Near& near, F&& visit) const {
    return forEach([&](const MovingIndex& part) {
      return part->visitNear(moves ? part.start() : *part, near, visit);
    });
  }

  /// The threads of a query; null for one.
  parallel::Executor* executor() const { return main_->executor(); }

  std::size_t memoryUsage() const { return main_.memoryUsage() + young_.memoryUsage(); }

 private:
  static index::IndexOptions singleThreaded(index::IndexOptions options) {
    options.threads = 1;
    return options;
  }
  bool hasYoung() const { return end_ > main_->end(); }

  template <class F>
  tree::Visit forEach(F&& visit) const {
    if (visit(main_) == tree::Visit::kStop) return tree::Visit::kStop;
    return hasYoung() ? visit(young_) : tree::Visit::kContinue;
  }

  MovingIndex main_, young_;
  SegmentId end_ = 0;  ///< youngBegin() unless the young index is complete
};

}  // namespace fcl_fibers::broadphase
