// SPDX-License-Identifier: BSD-3-Clause
#include "index/step.h"

#include <atomic>
#include <type_traits>

#include "index/impact_filter.h"
#include "index/tree_search.h"
#include "index/volume_around.h"
#include "tree/moving_tree.h"

namespace fcl_fibers::index {

using geometry::Box;
using geometry::CapsuleEnd;
using geometry::FrameChange;
using geometry::MovingBox;
using geometry::MovingSegment;
using tree::Group;
using tree::Visit;

MovingRange Step::segments() const { return {start_.keptRange(), end_.keptRange()}; }

template <class F>
Visit Step::visitTrees(const Step& other, F&& visit, const std::atomic<float>& until) const {
  const auto visitBoth = [&](const auto& tree, const auto& other_tree) {
    using Tree = std::decay_t<decltype(tree)>;
    if constexpr (std::is_same_v<decltype(tree), decltype(other_tree)>) {
      // As in SegmentIndex::visitTrees().
      const double growth = (end_.options_.margin - other.end_.options_.margin) / 2;
      const FrameChange b_to_a(other.end_.frame_, end_.frame_, growth * end_.frame_.scale);
      const FrameChange a_to_b(end_.frame_, other.end_.frame_, growth * other.end_.frame_.scale);
      return visit(tree::TreePair<Tree>{tree, other_tree, b_to_a, a_to_b});
    } else {
      return Visit::kContinue;
    }
  };
  return visitTree(
      [&](const auto& tree) {
        return other.visitTree([&](const auto& other_tree) { return visitBoth(tree, other_tree); },
                               until);
      },
      until);
}

Visit Step::searchMoving(const PairFilter* wanted, PairSink& sink) const {
  return visitTree([&](const auto& tree) {
    return findPairs(TreeSearch(tree), wanted, end_.executor_.get(), *end_.scratch_, sink);
  });
}

Visit Step::searchMoving(const MovingSegment& segment, double error, Group group, SegmentId second,
                         const PairFilter* wanted, PairSink& sink) const {
  SerialBuffer buffer(wanted, sink);
  return visitTree([&](const auto& tree) {
    const double padding = end_.padding() + error;
    const MovingBox box{volumeAround<Box>(segment.start, padding),
                        volumeAround<Box>(segment.end, padding)};
    return visitOverlaps(tree, box, second, group, buffer) == Visit::kStop ? Visit::kStop
                                                                           : buffer.full();
  });
}

Visit Step::searchImpacts(const PairFilter* wanted, PairSink& sink) const {
  const ImpactFilter filter(segments(), segments(), nullptr, end_.margin(), end_.unit_, 0, wanted);
  return searchMoving(&filter, sink);
}

Visit Step::searchMoving(const Step& other, const PairFilter* wanted, PairSink& sink) const {
  return visitTrees(other, [&](const auto& two) {
    return findPairs(TreeSearch(two), wanted, end_.executor_.get(), *end_.scratch_, sink);
  });
}

Visit Step::searchImpacts(const Step& other, const PairFilter* wanted, PairSink& sink) const {
  return visitTrees(other, [&](const auto& two) {
    const ImpactFilter filter(segments(), other.segments(), &two.b_to_a, end_.margin(), end_.unit_,
                              0, wanted);
    return findPairs(TreeSearch(two), &filter, end_.executor_.get(), *end_.scratch_, sink);
  });
}

Visit Step::searchImpacts(const MovingSegment& segment, double error, Group group, SegmentId second,
                          const PairFilter* wanted, PairSink& sink) const {
  const CapsuleEnd start[] = {firstEndOf(segment.start), secondEndOf(segment.start)};
  const CapsuleEnd end[] = {firstEndOf(segment.end), secondEndOf(segment.end)};
  const MovingRange one{{start, 2, second}, {end, 2, second}};
  const ImpactFilter filter(segments(), one, nullptr, end_.margin(), end_.unit_, error, wanted);
  return searchMoving(segment, error, group, second, &filter, sink);
}

double Step::safeTime(const PairFilter* wanted) const {
  NoSink nothing;
  const ImpactFilter filter(segments(), segments(), nullptr, end_.margin(), end_.unit_, 0, wanted);
  FirstTime first;
  const FirstImpact first_impact(filter, first);
  visitTree(
      [&](const auto& tree) {
        return findPairs(TreeSearch(tree), &first_impact, end_.executor_.get(), *end_.scratch_,
                         nothing);
      },
      first.until());
  return first.get();
}

double Step::safeTime(const Step& other) const {
  NoSink nothing;
  FirstTime first;
  visitTrees(
      other,
      [&](const auto& two) {
        const ImpactFilter filter(segments(), other.segments(), &two.b_to_a, end_.margin(),
                                  end_.unit_, 0, nullptr);
        const FirstImpact first_impact(filter, first);
        return findPairs(TreeSearch(two), &first_impact, end_.executor_.get(), *end_.scratch_,
                         nothing);
      },
      first.until());
  return first.get();
}

}  // namespace fcl_fibers::index
