// SPDX-License-Identifier: BSD-3-Clause
#include "live/anchors.h"

#include <algorithm>
#include <array>
#include <limits>

#include "geometry/rounding.h"

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
          /*anchors=*/nullptr,
          now.segments->mayTaper()};
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
  // The anchors are the ends, rounded to float. Radii may be larger than the reach, but what is
  // not listed stays apart by more than their rounding.
  reach_ = now.reach;
  error_ = errorOf(now);
  const float rounding = roundedUp(reach_ * std::numeric_limits<float>::epsilon());
  const Box moved{{-rounding, -rounding, -rounding}, {rounding, rounding, rounding}};
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
      if (!ends.sharesSecond(i))
        set(place++, pointOf(now, capsule[1]), capsule[ends.may_taper ? 1 : 0]);
    }
    setBlock(block, {boxAround(ends), moved, rounding});
  });
  joinAbove();
}

/// @param end  that has the radius: the first one, unless the segment may taper
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
  const geometry::Vec3d from{a[0], a[1], a[2]}, to{b[0], b[1], b[2]};
  if (a[3] == kRadiusOfBox) return geometry::Segment::box(from, to);
  return geometry::Segment::cone(from, to, a[3], now.segments->mayTaper() ? b[3] : a[3]);
}

/// Bounds the error of a displacement, by axis.
double Anchors::errorOf(const SegmentsNow& now) const {
  // A turn takes three products and sums of numbers of this size, and another frame as many.
  return 64 * std::numeric_limits<double>::epsilon() *
         (now.reach + reach_ + maxNorm(motion_.shift));
}

void Anchors::measure(const SegmentsNow& now, const AffineMap& motion,
                      parallel::Executor* executor) {
  motion_ = motion;
  displacing_ = Displacing(now.to_anchors, motion);
  error_ = errorOf(now);
  forBlocks(executor, [&](std::int32_t block) {
    Node node = nodeOf(displacementsOf(anchored(now, block), displacing_));
    node.where = this->block(block).where;
    setBlock(block, node);
  });
  joinAbove();
}

/// The node of a few segments, with a box around everything in place of that of their anchors.
Node Anchors::nodeOf(const Displacements& bounds) const {
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
  std::array<Displacements, static_cast<std::size_t>(kBlock)> bounds;
  eachDisplacement(all, displacing_, bounds.data());
  one.count = 1;
  one.ahead = 0;
  for (int i = 0; i < all.count; ++i) {
    Node node = nodeOf(bounds[static_cast<std::size_t>(i)]);
    node.where = boxAround(one);
    nodes.set(i, node);
    one.anchors += all.sharesSecond(i) ? 1 : 2;
    ++one.ids;
  }
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
