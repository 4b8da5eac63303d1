// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <type_traits>
#include <vector>

#include "geometry/moving_box.h"
#include "geometry/obstacle_impact.h"
#include "geometry/touch.h"
#include "index/hull_filter.h"
#include "index/nearest_filter.h"
#include "index/segment_index.h"
#include "index/tree_search.h"

namespace fcl_fibers::index {
namespace {

using geometry::FrameChange;
using geometry::MovingSegment;
using geometry::Obstacle;
using geometry::Segment;
using tree::Group;
using tree::Visit;

/// The volume of a tree around a segment.
template <class Tree>
typename Tree::Volume around(const MovingSegment& segment, double padding) {
  using Volume = typename Tree::Volume;
  if constexpr (std::is_same_v<Volume, geometry::MovingBox>) {
    return {geometry::volumeAround<geometry::Box>(segment.start, padding),
            geometry::volumeAround<geometry::Box>(segment.end, padding)};
  } else {
    return geometry::volumeAround<Volume>(segment.end, padding);
  }
}

}  // namespace

double SegmentIndex::reachOf(const End& end) {
  if (end.reach >= 0) return end.reach;
  return std::visit([](const auto& tree) { return tree::reachOf(tree); }, end.tree);
}

/// The segments and a bound of their errors.
SegmentRange SegmentIndex::rangeOf(const End& end) {
  SegmentRange range = end.segments.range();
  range.setMostError(geometry::endPointError(reachOf(end)));
  return range;
}

KeptSegments SegmentIndex::readSegments(const SegmentSource& source) const {
  KeptSegments segments(options_.share_ends);
  segments.reset(begin_, end_, leaves());
  for (const SegmentId id : leaves()) {
    Segment segment{};
    readOne(source, id, frame(), segment);
    segments.set(id, segment);  // every one, because reset() may leave them unwritten
  }
  return segments;
}

/// A tree of this index and one of another.
template <class ATree>
tree::TreePair<ATree> SegmentIndex::pairOf(const ATree& own, const ATree& its,
                                           const SegmentIndex& other, double beyond) const {
  // Each tree is padded by half its own margin. The sum must be this index's margin.
  const double growth = (options_.margin - other.options_.margin) / 2 + beyond;
  return {own, its, FrameChange(other.frame(), frame(), growth * frame().scale),
          FrameChange(frame(), other.frame(), growth * other.frame().scale)};
}

/// Calls visit(trees) with both trees, if they have one type.
template <class F>
Visit SegmentIndex::visitTrees(const SegmentIndex& other, const Question& question, bool moves,
                               F&& visit) const {
  return visitTree(question, moves, [&](const auto& tree) {
    return other.visitTree(question, moves, [&](const auto& other_tree) {
      if constexpr (std::is_same_v<decltype(tree), decltype(other_tree)>) {
        return visit(pairOf(tree, other_tree, other, question.beyond));
      } else {
        return Visit::kContinue;  // one of the two has never been built
      }
    });
  });
}

/// Calls visit(filter) with what decides which pairs of this index and others count.
/// @param rangeOfB  returns the others; volumes do not need them
template <class RangeOfB, class F>
Visit SegmentIndex::withFilter(const Question& question, bool moves, RangeOfB&& rangeOfB,
                               const FrameChange* b_to_a, double error, F&& visit) const {
  if (question.of_volumes || !(moves || options_.capsules)) return visit(question.wanted);
  if (question.first != nullptr && !moves) return Visit::kContinue;
  const double margin = this->margin() + question.beyond * frame().scale;
  const MovingRange b = rangeOfB();
  if (moves) {
    const SegmentHulls<MovingRange> hulls{b, b_to_a, error};
    const HullFilter filter(movingRange(question), hulls, margin, unit_, question);
    return visit(&filter);
  }
  const SegmentHulls<SegmentRange> hulls{b.end, b_to_a, error};
  const HullFilter filter(keptRange(question), hulls, margin, unit_, question);
  return visit(&filter);
}

std::size_t SegmentIndex::keepTouching(tree::Pair* pairs, std::size_t count) const {
  std::vector<geometry::Impact> none;
  withTouchTest(nullptr, [&](const auto& filter) { count = filter.keep(pairs, count, none); });
  return count;
}

Visit SegmentIndex::search(PairSink& sink, const Question& question) const {
  const bool moves = question.of_step && this->moves();
  return withFilter(
      question, moves, [&] { return movingRange(question); }, nullptr, 0,
      [&](const PairFilter* filter) {
        const auto search = [&](const auto& tree) { return find(TreeSearch(tree), filter, sink); };
        return question.beyond > 0 ? std::visit(search, now_.tree)
                                   : visitTree(question, moves, search);
      });
}

Visit SegmentIndex::search(const MovingSegment& segment, double error, Group group,
                           SegmentId second, PairSink& sink, const Question& question) const {
  const bool moves = question.of_step && (this->moves() || !rests(segment));
  const geometry::CapsuleEnd start[] = {firstEndOf(segment.start), secondEndOf(segment.start)};
  const geometry::CapsuleEnd end[] = {firstEndOf(segment.end), secondEndOf(segment.end)};
  const auto rangeOfOne = [&] {
    MovingRange one{{start, 2, second}, {end, 2, second}};
    one.start.setMostError(endPointError(segment.start));
    one.end.setMostError(endPointError(segment.end));
    one.end.setHasBoxes(segment.end.isBox());
    one.start.setMayTaper(segment.start.isTapered());
    one.end.setMayTaper(segment.end.isTapered());
    return one;
  };
  return withFilter(question, moves, rangeOfOne, nullptr, error, [&](const PairFilter* filter) {
    return searchAround(segment, error, group, second, filter, sink, question, moves);
  });
}

Visit SegmentIndex::searchAround(const MovingSegment& segment, double error, Group group,
                                 SegmentId second, const PairFilter* filter, PairSink& sink,
                                 const Question& question, bool moves) const {
  SerialBuffer buffer(filter, sink);
  return visitTree(question, moves, [&](const auto& tree) {
    const double larger = padding() + error + question.beyond * frame().scale;
    const auto volume = around<std::decay_t<decltype(tree)>>(segment, larger);
    return visitOverlaps(tree, volume, second, group, buffer) == Visit::kStop ? Visit::kStop
                                                                              : buffer.full();
  });
}

namespace {

/// Keeps the segments that touch an obstacle, and in a step finds when.
class ObstacleFilter final : public PairFilter {
 public:
  ObstacleFilter(const MovingRange& segments, const Obstacle& obstacle, double margin,
                 const Question& question)
      : segments_(segments), obstacle_(obstacle), margin_(margin), question_(question) {}

  std::size_t keep(tree::Pair* pairs, std::size_t count,
                   std::vector<geometry::Impact>& impacts) const override {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (touches(segments_[pairs[i].a], impacts)) pairs[kept++] = pairs[i];
    }
    return kept;
  }

 private:
  bool touches(const MovingSegment& s, std::vector<geometry::Impact>& impacts) const {
    const double error = endPointError(s);
    if (!question_.of_step) return touch(s.end, obstacle_, margin_, error);
    FirstTime* const first = question_.first;
    geometry::Impact impact;
    if (!findImpact(s, obstacle_, margin_, error, first != nullptr, impact)) return false;
    first != nullptr ? first->add(impact.time) : impacts.push_back(impact);
    return first == nullptr;
  }

  const MovingRange segments_;
  const Obstacle& obstacle_;
  const double margin_;
  const Question& question_;
};

}  // namespace

Visit SegmentIndex::share(const PairRun& found, PairSink& sink) const {
  // A visitor may take long for each pair, so the runs are short.
  constexpr std::size_t kShort = 64;
  const std::size_t most = executor() != nullptr ? kShort : found.count;
  std::vector<PairRun> runs;
  for (std::size_t begin = 0; begin < found.count; begin += most) {
    const geometry::Impact* const impacts =
        found.impacts != nullptr ? found.impacts + begin : nullptr;
    runs.push_back({found.pairs + begin, impacts, std::min(most, found.count - begin)});
  }
  return handOn(runs, executor(), sink);
}

namespace {

/// Keeps what a search on one thread finds, for all threads to take.
class SharingSink final : public PairSink {
 public:
  SharingSink(const SegmentIndex& index, PairSink& sink) : index_(index), sink_(sink) {}

  std::size_t sift(tree::Pair* pairs, geometry::Impact* impacts, std::size_t count) const override {
    return sink_.sift(pairs, impacts, count);
  }
  Visit take(const PairRun& run) override {
    constexpr std::size_t kMost = std::size_t{1} << 14;
    pairs_.insert(pairs_.end(), run.pairs, run.pairs + run.count);
    if (run.impacts != nullptr) {
      impacts_.insert(impacts_.end(), run.impacts, run.impacts + run.count);
    }
    return pairs_.size() < kMost ? Visit::kContinue : share();
  }
  /// Must be called at the end of a search, too.
  Visit share() {
    const geometry::Impact* const impacts = impacts_.empty() ? nullptr : impacts_.data();
    const Visit visit = index_.share({pairs_.data(), impacts, pairs_.size()}, sink_);
    pairs_.clear();
    impacts_.clear();
    return visit;
  }

 private:
  const SegmentIndex& index_;
  PairSink& sink_;
  std::vector<tree::Pair> pairs_;
  std::vector<geometry::Impact> impacts_;
};

}  // namespace

Visit SegmentIndex::search(const Obstacle& obstacle, PairSink& sink,
                           const Question& question) const {
  if (executor() != nullptr && sink.delivery() == PairSink::Delivery::kAtOnce) {
    SharingSink shared(*this, sink);
    return search(obstacle, shared, question) == Visit::kStop ? Visit::kStop : shared.share();
  }
  const Segment around = aroundOf(obstacle);
  if (!around.isBox()) {
    return search({around, around}, obstacle.error, tree::kNoGroup, /*second=*/0, sink, question);
  }
  const ObstacleFilter touching(movingRange(), obstacle, margin(), question);
  const PairFilter* const filter = keepsSegments() ? &touching : nullptr;
  if (isBounded(around)) {
    return searchAround({around, around}, obstacle.error, tree::kNoGroup, /*second=*/0, filter,
                        sink, question, question.of_step && moves());
  }
  SerialBuffer buffer(filter, sink);
  // The volumes have the other half.
  const double reach = padding();
  const auto isNear = [&](const geometry::Box& box) {
    return mayReach(box, obstacle, /*way=*/{0, 0, 0}, reach, /*error=*/0);
  };
  const Visit visit =
      visitNear(question.of_step, isNear, [&](SegmentId id) { return buffer.push(id, 0); });
  return visit == Visit::kStop ? visit : buffer.full();
}

bool SegmentIndex::isSwampedBy(const SegmentIndex& other) const {
  constexpr double kTwiceTheSize = 0x1p51;  // see frameFor()
  return options_.margin < other.options_.margin && other.padding() > kTwiceTheSize;
}

Visit SegmentIndex::search(const SegmentIndex& other, const SegmentSource* source, PairSink& sink,
                           const Question& question) const {
  const bool can_read = source != nullptr || other.keepsSegments();
  if (!matches(other) || (can_read && isSwampedBy(other))) {
    return searchOneByOne(other, source, sink, question);
  }
  KeptSegments read(other.options_.share_ends);
  const auto rangeOfOther = [&]() -> MovingRange {
    if (!options_.capsules || other.keepsSegments()) return other.movingRange();
    read = other.readSegments(*source);
    return {read.range(), read.range()};
  };
  const bool moves = question.of_step && (this->moves() || other.moves());
  const FrameChange to_this(other.frame(), frame());
  return withFilter(question, moves, rangeOfOther, &to_this, 0, [&](const PairFilter* filter) {
    return visitTrees(other, question, moves,
                      [&](const auto& two) { return find(TreeSearch(two), filter, sink); });
  });
}

/// @param asked  of search(), behind the sink
template <class Sink, class... Asked>
Visit SegmentIndex::searchOneByOne(const SegmentIndex& other, const SegmentSource* source,
                                   Sink& sink, const Asked&... asked) const {
  const FrameChange to_this(other.frame(), frame());
  for (const SegmentId b : other.leaves()) {
    MovingSegment segment;
    if (other.keepsSegments()) {
      segment = other.moving(b);
    } else if (readOne(*source, b, other.frame(), segment.end)) {
      segment.start = segment.end;
    } else {
      continue;
    }
    segment = {to_this.around(segment.start, FrameChange::Grows::kNothing),
               to_this.around(segment.end, FrameChange::Grows::kNothing)};
    const double error = std::max(to_this.error(segment.start), to_this.error(segment.end));
    if (search(segment, error, tree::kNoGroup, b, sink, asked...) == Visit::kStop) {
      return Visit::kStop;
    }
  }
  return Visit::kContinue;
}

// --- The nearest ---

/// Returns a segment as it is kept or, if the index keeps none, as it is now.
FoundSegment SegmentIndex::find(const SegmentSource* source, SegmentId id) const {
  FoundSegment found{};
  if (keepsSegments()) {
    found.hull = segment(id);
    found.is_found = true;
  } else {
    found.is_found = source->readNow(id, frame(), found.hull);
  }
  if (found.is_found) found.error = endPointError(found.hull);
  return found;
}

Visit SegmentIndex::search(NearestSink& sink) const {
  const auto find_one = [&](SegmentId id) { return find(sink.source(), id); };
  const auto searchBy = [&](auto& find_any) {
    NearestFilter filter(find_any, find_any, options_.capsules, sink);
    return std::visit([&](const auto& tree) { return visitNearest(tree, sink.limit(), filter); },
                      fitted().tree);
  };
  if (keepsSegments()) return searchBy(find_one);
  RememberingFind remembering(leaves().size(), find_one);
  return searchBy(remembering);
}

Visit SegmentIndex::search(const MovingSegment& segment, double error, Group group,
                           SegmentId second, NearestSink& sink) const {
  const FoundSegment one{segment.end, error, true};
  const auto find_first = [&](SegmentId id) { return find(sink.source(), id); };
  const auto find_second = [&](SegmentId) -> const FoundSegment& { return one; };
  NearestFilter filter(find_first, find_second, options_.capsules, sink);
  return std::visit(
      [&](const auto& tree) {
        const auto volume = around<std::decay_t<decltype(tree)>>(segment, padding() + error);
        return visitNearest(tree, volume, second, group, sink.limit(), filter);
      },
      fitted().tree);
}

Visit SegmentIndex::search(const SegmentIndex& other, const SegmentSource* source,
                           NearestSink& sink) const {
  if (!matches(other)) return searchOneByOne(other, source, sink);
  const FrameChange to_this(other.frame(), frame());
  const SegmentSource* const second_source = source != nullptr ? source : sink.source();
  const auto find_first = [&](SegmentId a) { return find(sink.source(), a); };
  const auto find_second = [&](SegmentId b) {
    FoundSegment found = other.find(second_source, b);
    if (!found.is_found) return found;
    found.hull = to_this(found.hull);
    found.error = to_this.error(found.hull);
    return found;
  };
  RememberingFind first(keepsSegments() ? 0 : leaves().size(), find_first);
  RememberingFind second(other.keepsSegments() ? 0 : other.leaves().size(), find_second);
  NearestFilter filter(first, second, options_.capsules, sink);
  return std::visit(
      [&](const auto& tree, const auto& other_tree) {
        if constexpr (std::is_same_v<decltype(tree), decltype(other_tree)>) {
          return visitNearest(pairOf(tree, other_tree, other, /*beyond=*/0), sink.limit(), filter);
        } else {
          return Visit::kContinue;
        }
      },
      fitted().tree, other.fitted().tree);
}

}  // namespace fcl_fibers::index
