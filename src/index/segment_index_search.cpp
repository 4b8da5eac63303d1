// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <type_traits>

#include "index/capsule_filter.h"
#include "index/nearest_filter.h"
#include "index/segment_index.h"
#include "index/tree_search.h"
#include "index/volume_around.h"

namespace fcl_fibers::index {
namespace {

using geometry::FrameChange;
using geometry::Segment;
using tree::Group;
using tree::Visit;

/// Like FrameChange, but a box that overflows becomes open to all sides.
Segment inFrame(const FrameChange& change, const Segment& segment) {
  const Segment result = change(segment);
  if (!segment.isBox() || isBounded(result) || !isBounded(segment)) return result;
  return Segment::everywhere();
}

}  // namespace

KeptSegments SegmentIndex::readSegments(const SegmentSource& source) const {
  KeptSegments segments(options_.share_ends);
  segments.reset(begin_, end_, leaves());
  for (const SegmentId id : leaves()) {
    Segment segment;
    if (readOne(source, id, frame_, segment)) segments.set(id, segment);
  }
  return segments;
}

Visit SegmentIndex::search(PairSink& sink) const {
  const CapsuleFilter filter(keptRange(), keptRange(), nullptr, margin(), unit_);
  return std::visit(
      [&](const auto& tree) {
        return findPairs(TreeSearch(tree), options_.capsules ? &filter : nullptr, executor_.get(),
                         *scratch_, sink);
      },
      tree_);
}

/// Returns a segment as it is kept or, if the index keeps none, as it is now.
FoundSegment SegmentIndex::find(const SegmentSource& source, SegmentId id) const {
  FoundSegment found{};
  if (keepsSegments()) {
    found.segment = segments_[id];
    found.is_found = true;
  } else {
    found.is_found = source.readNow(id, frame_, found.segment);
  }
  if (found.is_found) found.error = endPointError(found.segment);
  return found;
}

Visit SegmentIndex::search(NearestSink& sink) const {
  const auto find_one = [&](SegmentId id) { return find(sink.source(), id); };
  RememberingFind first(find_one);
  RememberingFind second(find_one);
  NearestFilter filter(first, second, options_.capsules, sink);
  return std::visit([&](const auto& tree) { return visitNearest(tree, sink.limit(), filter); },
                    tree_);
}

Visit SegmentIndex::search(const Segment& segment, double error, Group group, SegmentId second,
                           PairSink& sink) const {
  const geometry::CapsuleEnd ends[] = {geometry::firstEndOf(segment),
                                       geometry::secondEndOf(segment)};
  SegmentRange one(ends, 2, second);
  one.setMostError(endPointError(segment));
  const CapsuleFilter filter(keptRange(), one, nullptr, margin(), unit_, error);
  SerialBuffer buffer(options_.capsules ? &filter : nullptr, sink);
  return std::visit(
      [&](const auto& tree) {
        using ATree = std::decay_t<decltype(tree)>;
        const auto volume = volumeAround<typename ATree::Volume>(segment, tree.padding() + error);
        return visitOverlaps(tree, volume, second, group, buffer) == Visit::kStop ? Visit::kStop
                                                                                  : buffer.full();
      },
      tree_);
}

Visit SegmentIndex::search(const Segment& segment, double error, Group group, SegmentId second,
                           NearestSink& sink) const {
  const FoundSegment one{segment, error, true};
  const auto find_first = [&](SegmentId id) { return find(sink.source(), id); };
  const auto find_second = [&](SegmentId) -> const FoundSegment& { return one; };
  NearestFilter filter(find_first, find_second, options_.capsules, sink);
  return std::visit(
      [&](const auto& tree) {
        using ATree = std::decay_t<decltype(tree)>;
        const auto volume = volumeAround<typename ATree::Volume>(segment, tree.padding() + error);
        return visitNearest(tree, volume, second, group, sink.limit(), filter);
      },
      tree_);
}

/// Calls visit(trees, b_to_a) with both trees, if they have one type, and the change of frame of
/// the other.
template <class F>
Visit SegmentIndex::visitTrees(const SegmentIndex& other, F&& visit) const {
  return std::visit(
      [&](const auto& tree, const auto& other_tree) {
        using ATree = std::decay_t<decltype(tree)>;
        if constexpr (std::is_same_v<decltype(tree), decltype(other_tree)>) {
          // Each tree is padded by half its own margin. The sum must be this index's margin.
          const double growth = (options_.margin - other.options_.margin) / 2;
          const FrameChange b_to_a(other.frame_, frame_, growth * frame_.scale);
          const FrameChange a_to_b(frame_, other.frame_, growth * other.frame_.scale);
          return visit(tree::TreePair<ATree>{tree, other_tree, b_to_a, a_to_b}, b_to_a);
        } else {
          return Visit::kContinue;  // one of the two has never been built
        }
      },
      tree_, other.tree_);
}

bool SegmentIndex::isSwampedBy(const SegmentIndex& other) const {
  constexpr double kTwiceTheSize = 0x1p51;  // see frameFor()
  return options_.margin < other.options_.margin && other.padding() > kTwiceTheSize;
}

Visit SegmentIndex::search(const SegmentIndex& other, const SegmentSource* source,
                           PairSink& sink) const {
  const bool can_read = source != nullptr || other.keepsSegments();
  if (!matches(other) || (can_read && isSwampedBy(other))) {
    return searchOneByOne(other, source, sink);
  }
  KeptSegments read(other.options_.share_ends);
  if (options_.capsules && !other.keepsSegments()) read = other.readSegments(*source);
  const SegmentRange second = (other.keepsSegments() ? other.segments_ : read).range();
  return visitTrees(other, [&](const auto& two, const FrameChange& b_to_a) {
    const CapsuleFilter filter(keptRange(), second, &b_to_a, margin(), unit_);
    return findPairs(TreeSearch(two), options_.capsules ? &filter : nullptr, executor_.get(),
                     *scratch_, sink);
  });
}

Visit SegmentIndex::search(const SegmentIndex& other, const SegmentSource* source,
                           NearestSink& sink) const {
  if (!matches(other)) return searchOneByOne(other, source, sink);
  const FrameChange to_this(other.frame_, frame_);
  const SegmentSource& second_source = source != nullptr ? *source : sink.source();
  const auto find_first = [&](SegmentId a) { return find(sink.source(), a); };
  const auto find_second = [&](SegmentId b) {
    FoundSegment found = other.find(second_source, b);
    if (!found.is_found) return found;
    found.segment = to_this(found.segment);
    found.error = to_this.error(found.segment);
    return found;
  };
  RememberingFind first(find_first);
  RememberingFind second(find_second);
  NearestFilter filter(first, second, options_.capsules, sink);
  return visitTrees(other, [&](const auto& two, const FrameChange&) {
    return visitNearest(two, sink.limit(), filter);
  });
}

template <class Sink>
Visit SegmentIndex::searchOneByOne(const SegmentIndex& other, const SegmentSource* source,
                                   Sink& sink) const {
  const FrameChange to_this(other.frame_, frame_);
  for (const SegmentId b : other.leaves()) {
    Segment segment;
    if (other.keepsSegments()) {
      segment = other.segments_[b];
    } else if (!readOne(*source, b, other.frame_, segment)) {
      continue;
    }
    segment = inFrame(to_this, segment);
    if (search(segment, to_this.error(segment), tree::kNoGroup, b, sink) == Visit::kStop) {
      return Visit::kStop;
    }
  }
  return Visit::kContinue;
}

}  // namespace fcl_fibers::index
