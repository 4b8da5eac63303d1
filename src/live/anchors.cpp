// SPDX-License-Identifier: BSD-3-Clause
#include "live/anchors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geometry/rounding.h"
#include "simd/dispatch.h"
#include "tree/extent.h"

namespace fcl_fibers::live {
namespace {

using geometry::AffineMap;
using geometry::Box;
using geometry::CapsuleEnd;
using geometry::roundedDown;
using geometry::roundedUp;
using geometry::Vec3d;
using tree::SegmentId;

Vec3d pointOf(const SegmentsNow& now, const CapsuleEnd& end) {
  const Vec3d p{end.numbers[0], end.numbers[1], end.numbers[2]};
  if (now.to_anchors == nullptr) return p;
  return now.to_anchors->scale() * p + now.to_anchors->shift();
}

}  // namespace

/// The ends of a block, without anchors.
AnchoredEnds Anchors::endsOf(const SegmentsNow& now, std::int32_t block) const {
  const Leaf begin = block * kBlock, end = blockEnd(block);
  const SegmentId first = now.segments->begin();
  return {now.order->data() + begin,
          end - begin,
          std::min(kBlock, leafCount() - end),
          now.segments->range().capsule(first),
          now.segments->sharesEnds() ? std::size_t{1} : std::size_t{2},
          first,
          /*anchors=*/nullptr};
}

AnchoredEnds Anchors::anchored(const SegmentsNow& now, std::int32_t block) const {
  AnchoredEnds ends = endsOf(now, block);
  ends.anchors = anchors_.data() + begins_[static_cast<std::size_t>(block)];
  return ends;
}

void Anchors::set(const SegmentsNow& now, parallel::Executor* executor) {
  motion_ = {};
  displacing_ = Displacing(now.to_anchors, motion_);
  resize(now.order->size());
  begins_.assign(static_cast<std::size_t>(blockCount()) + 1, 0);
  forBlocks(executor, [&](std::int32_t block) {
    const AnchoredEnds ends = endsOf(now, block);
    std::int32_t count = 2 * ends.count;
    for (int i = 0; i < ends.count; ++i) count -= ends.sharesSecond(i) ? 1 : 0;
    begins_[static_cast<std::size_t>(block) + 1] = count;
  });
  for (std::size_t i = 1; i < begins_.size(); ++i) begins_[i] += begins_[i - 1];
  anchors_.resize(static_cast<std::size_t>(begins_.back()));
  forBlocks(executor, [&](std::int32_t block) {
    const AnchoredEnds ends = anchored(now, block);
    for (int i = ends.count; i < ends.count + ends.ahead; ++i) {
      __builtin_prefetch(ends.ends + ends.placeOf(ends.ids[i]));
      __builtin_prefetch(ends.ends + ends.placeOf(ends.ids[i]) + 1);
    }
    auto place = static_cast<std::size_t>(begins_[static_cast<std::size_t>(block)]);
    for (int i = 0; i < ends.count; ++i) {
      const CapsuleEnd* const capsule = ends.ends + ends.placeOf(ends.ids[i]);
      set(place++, pointOf(now, capsule[0]), capsule[0]);
      if (!ends.sharesSecond(i)) set(place++, pointOf(now, capsule[1]), capsule[0]);
    }
    bound(now, block);
  });
  joinAbove();
  // The anchors are the ends, rounded to float.
  reach_ = now.reach;
  const float rounding = roundedUp(reach_ * std::numeric_limits<float>::epsilon());
  for (Node& node : nodes_) {
    node.moved = {{-rounding, -rounding, -rounding}, {rounding, rounding, rounding}};
    node.growth = rounding;
  }
}

/// @param end  at which the capsule or the box begins
void Anchors::set(std::size_t place, const Vec3d& point, const CapsuleEnd& end) {
  const double radius = displacing_.scale[3] * end.numbers[3];
  anchors_[place] = {{geometry::nearestFloat(point.x), geometry::nearestFloat(point.y),
                      geometry::nearestFloat(point.z),
                      geometry::isBox(&end) ? kRadiusOfBox : std::max(roundedDown(radius), 0.0F)}};
}

/// The place of the anchor of a segment's first end. That of its second end is the next.
std::size_t Anchors::anchorOf(const SegmentsNow& now, Leaf leaf) const {
  const AnchoredEnds ends = anchored(now, leaf / kBlock);
  auto place = static_cast<std::size_t>(begins_[static_cast<std::size_t>(leaf / kBlock)]);
  for (int i = 0; i < leaf % kBlock; ++i) place += ends.sharesSecond(i) ? 1 : 2;
  return place;
}

geometry::Segment Anchors::segment(const SegmentsNow& now, Leaf leaf) const {
  const Anchor* const anchor = &anchors_[anchorOf(now, leaf)];
  const float *const a = anchor[0].numbers, *const b = anchor[1].numbers;
  return {{a[0], a[1], a[2]}, {b[0], b[1], b[2]}, a[3] == kRadiusOfBox ? -1 : double{a[3]}};
}

void Anchors::measure(const SegmentsNow& now, const AffineMap& motion,
                      parallel::Executor* executor) {
  motion_ = motion;
  displacing_ = Displacing(now.to_anchors, motion);
  // A turn takes three products and sums of numbers of this size, and another frame as many.
  error_ =
      64 * std::numeric_limits<double>::epsilon() * (now.reach + reach_ + maxNorm(motion.shift));
  forBlocks(executor, [&](std::int32_t block) {
    Node& node = nodes_[static_cast<std::size_t>(block)];
    const Box where = node.where;
    node = measured(anchored(now, block));
    node.where = where;
  });
  joinAbove();
}

/// Bounds the displacements of a few segments.
Anchors::Node Anchors::measured(const AnchoredEnds& ends) const {
  const Displacements bounds = displacementsOf(ends, displacing_);
  Node node{Box::unbounded(), Box::unbounded(), roundedUp(bounds.growth)};
  if (!bounds.are_finite) return node;
  for (int axis = 0; axis < 3; ++axis) {
    node.moved.low[axis] = roundedDown(bounds.low[axis] - error_);
    node.moved.high[axis] = roundedUp(bounds.high[axis] + error_);
  }
  return node;
}

void Anchors::writeNodes(const SegmentsNow& now, std::int32_t block, BlockNodes& nodes) const {
  AnchoredEnds one = anchored(now, block);
  const AnchoredEnds all = one;
  one.count = 1;
  one.ahead = 0;
  for (int i = 0; i < all.count; ++i) {
    Node& node = nodes[static_cast<std::size_t>(i)];
    node = measured(one);
    node.where = boxAround(one);
    one.anchors += all.sharesSecond(i) ? 1 : 2;
    ++one.ids;
  }
}

/// Bounds the anchors of a block.
void Anchors::bound(const SegmentsNow& now, std::int32_t block) {
  nodes_[static_cast<std::size_t>(block)].where = boxAround(anchored(now, block));
}

void Anchors::renew(const SegmentsNow& now, std::vector<Renewal> renewals,
                    std::vector<Leaf>& changed) {
  const AffineMap back = motion_.inverse();
  std::stable_sort(renewals.begin(), renewals.end(),
                   [](const Renewal& p, const Renewal& q) { return p.leaf < q.leaf; });
  for (auto first = renewals.begin(); first != renewals.end();) {
    const Leaf leaf = first->leaf;
    const auto last = std::find_if(first, renewals.end(),
                                   [leaf](const Renewal& renewal) { return renewal.leaf != leaf; });
    Vec3d displacement{0, 0, 0};
    for (double Vec3d::*axis : geometry::kAxes) {
      const auto middle = first + (last - first) / 2;
      std::nth_element(first, middle, last, [axis](const Renewal& p, const Renewal& q) {
        return p.displacement.*axis < q.displacement.*axis;
      });
      displacement.*axis = middle->displacement.*axis;
    }
    first = last;

    const int i = leaf % kBlock;
    const AnchoredEnds ends = anchored(now, leaf / kBlock);
    const CapsuleEnd* const capsule = ends.ends + ends.placeOf(ends.ids[i]);
    const std::size_t place = anchorOf(now, leaf);
    const bool is_followed = ends.sharesSecond(i);
    for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) {
      const Vec3d p = back(pointOf(now, capsule[k]) - displacement);
      set(place + k, p, capsule[is_followed ? k : 0]);
      reach_ = std::max(reach_, maxNorm(p));
    }
    changed.push_back(leaf);
    if (is_followed) changed.push_back(leaf + 1);
    if (i > 0 && ends.sharesSecond(i - 1)) changed.push_back(leaf - 1);
  }
  std::sort(changed.begin(), changed.end());
  changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
  for (auto leaf = changed.begin(); leaf != changed.end(); ++leaf) {
    const std::int32_t block = *leaf / kBlock;
    if (leaf != changed.begin() && leaf[-1] / kBlock == block) continue;
    Node& node = nodes_[static_cast<std::size_t>(block)];
    const Node before = node;
    node = measured(anchored(now, block));
    node.moved = join(node.moved, before.moved);
    node.growth = std::max(node.growth, before.growth);
    bound(now, block);
  }
  joinAbove();
}

void Anchors::sample(const SegmentsNow& now, std::vector<geometry::MovedPoint>& points) const {
  // A share of the segments, because the fit must not cost more than to bound them.
  constexpr Leaf kMost = 256, kShare = 16;
  const tree::SegmentRange segments = now.segments->range();
  for (Leaf leaf = 0; leaf < leafCount(); leaf += std::max(leafCount() / kMost, kShare) + 1) {
    const SegmentId id = (*now.order)[static_cast<std::size_t>(leaf)];
    points.push_back({segment(now, leaf).a, pointOf(now, *segments.capsule(id))});
  }
}

}  // namespace fcl_fibers::live
