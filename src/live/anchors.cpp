// SPDX-License-Identifier: BSD-3-Clause
#include "live/anchors.h"

#include <algorithm>
#include <array>
#include <cmath>
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

Vec3d pointOf(const CapsuleEnd& end) { return {end.numbers[0], end.numbers[1], end.numbers[2]}; }

/// The radius of a capsule that begins there; 0 for a box.
double radiusOf(const CapsuleEnd& end) {
  const double radius = end.numbers[3];
  return radius == radius ? radius : 0;
}

/// The ends of a segment, in the frame of the anchors.
struct Ends {
  Vec3d a, b;
  double radius;
};
Ends endsOf(const SegmentsNow& now, const tree::SegmentRange& segments, SegmentId id) {
  const CapsuleEnd* const capsule = segments.capsule(id);
  const Ends ends{pointOf(capsule[0]), pointOf(capsule[1]), radiusOf(capsule[0])};
  if (now.to_anchors == nullptr) return ends;
  const geometry::Segment moved = (*now.to_anchors)({ends.a, ends.b, ends.radius});
  return {moved.a, moved.b, moved.radius};
}

Vec3d middleOf(const Box& box) {
  return {0.5 * (double{box.low[0]} + double{box.high[0]}),
          0.5 * (double{box.low[1]} + double{box.high[1]}),
          0.5 * (double{box.low[2]} + double{box.high[2]})};
}

Box join(const Box& p, const Box& q) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = std::min(p.low[axis], q.low[axis]);
    box.high[axis] = std::max(p.high[axis], q.high[axis]);
  }
  return box;
}

/// Boxes a few displacements or places. Sums find out NaN and infinity, which minima may pass over.
class Bounds {
 public:
  void add(const Vec3d& p) {
    low_ = min(low_, p);
    high_ = max(high_, p);
    sum_ += p.x + p.y + p.z;
  }
  /// @param larger  by how much the box is larger on all sides
  Box box(double larger) const {
    if (!std::isfinite(sum_)) return Box::unbounded();
    return {
        {roundedDown(low_.x - larger), roundedDown(low_.y - larger), roundedDown(low_.z - larger)},
        {roundedUp(high_.x + larger), roundedUp(high_.y + larger), roundedUp(high_.z + larger)}};
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3d low_{kInfinity, kInfinity, kInfinity}, high_{-kInfinity, -kInfinity, -kInfinity};
  double sum_ = 0;
};

}  // namespace

template <class Visit>
void Anchors::forBlocks(parallel::Executor* executor, const Visit& visit) const {
  constexpr std::size_t kBlocksAtOnce = 128;  // they take some hundredths of a millisecond
  parallel::forRanges(executor, static_cast<std::size_t>(blockCount()), kBlocksAtOnce,
                      [&](std::size_t from, std::size_t to) {
                        for (std::size_t i = from; i < to; ++i) {
                          visit(static_cast<std::int32_t>(i));
                        }
                      });
}

void Anchors::set(const SegmentsNow& now, parallel::Executor* executor) {
  const index::KeptSegments& kept = *now.segments;
  stride_ = kept.sharesEnds() ? 1 : 2;
  begin_ = kept.begin();
  leaf_count_ = static_cast<std::int32_t>(now.order->size());
  anchors_.resize(stride_ * static_cast<std::size_t>(kept.end() - kept.begin()) + 1);
  levels_.assign(1, 0);
  for (std::int32_t count = leaf_count_, last = 0; count > 0 && last != 1; last = count) {
    count = levels_.size() == 1 ? (count + kBlock - 1) / kBlock : (count + kArity - 1) / kArity;
    levels_.push_back(levels_.back() + count);
  }
  nodes_.resize(static_cast<std::size_t>(levels_.back()));
  const tree::SegmentRange segments = kept.range();
  forBlocks(executor, [&](std::int32_t block) {
    for (const SegmentId id : idsOf(now, block)) {
      const Ends ends = endsOf(now, segments, id);
      set(placeOf(id), ends.a);
      anchors_[placeOf(id)].numbers[3] = std::max(roundedDown(ends.radius), 0.0F);
      // An end that two segments share is written by the second, so no two threads write it.
      if (!kept.sharesSecondEnd(id)) set(placeOf(id) + 1, ends.b);
    }
  });
  measure(now, AffineMap(), executor);
}

void Anchors::set(std::size_t place, const Vec3d& p) {
  float* const numbers = anchors_[place].numbers;
  numbers[0] = static_cast<float>(p.x);
  numbers[1] = static_cast<float>(p.y);
  numbers[2] = static_cast<float>(p.z);
}

geometry::Segment Anchors::segment(SegmentId id, bool is_box) const {
  const std::size_t place = placeOf(id);
  return {at(place), at(place + 1), is_box ? -1 : double{anchors_[place].numbers[3]}};
}

void Anchors::measure(const SegmentsNow& now, const AffineMap& motion,
                      parallel::Executor* executor) {
  const tree::SegmentRange segments = now.segments->range();
  if (motion.turns()) {
    forBlocks(executor, [&](std::int32_t block) { measureBlock(now, segments, block, motion); });
  } else {
    const auto shift = [&](const Vec3d& p) { return p + motion.shift; };
    forBlocks(executor, [&](std::int32_t block) { measureBlock(now, segments, block, shift); });
  }
  for (int level = 1; level < levelCount(); ++level) {
    for (std::int32_t i = 0; i < nodeCount(level); ++i) {
      const std::int32_t first = i * kArity;
      const std::int32_t end = std::min(first + kArity, nodeCount(level - 1));
      Node above = node(level - 1, first);
      for (std::int32_t child = first + 1; child < end; ++child) {
        const Node& below = node(level - 1, child);
        above.where = join(above.where, below.where);
        above.moved = join(above.moved, below.moved);
        above.growth = std::max(above.growth, below.growth);
      }
      nodes_[static_cast<std::size_t>(levelBegin(level) + i)] = above;
    }
  }
}

/// @param move  takes an anchor to where the rigid motion does
template <class Move>
void Anchors::measureBlock(const SegmentsNow& now, const tree::SegmentRange& segments,
                           std::int32_t block, const Move& move) {
  Bounds where, moved;
  double thickest = 0, growth = 0, largest = 0;
  for (const SegmentId id : idsOf(now, block)) {
    const Ends ends = endsOf(now, segments, id);
    const std::size_t place = placeOf(id);
    const Vec3d a = at(place), b = at(place + 1);
    const double radius = anchors_[place].numbers[3];
    where.add(a);
    where.add(b);
    moved.add(ends.a - move(a));
    moved.add(ends.b - move(b));
    thickest = std::max(thickest, radius);
    growth = std::max(growth, ends.radius - radius);
    largest = std::max({largest, maxNorm(ends.a), maxNorm(ends.b), maxNorm(a), maxNorm(b)});
  }
  // A turn takes three products and sums of numbers of this size, and another frame as many.
  const double error = 64 * std::numeric_limits<double>::epsilon() * largest;
  nodes_[static_cast<std::size_t>(block)] = {where.box(thickest), moved.box(error),
                                             roundedUp(growth)};
}

void Anchors::renew(const SegmentsNow& now, const AffineMap& motion,
                    const std::vector<std::int32_t>& blocks) {
  const AffineMap back = motion.inverse();
  const tree::SegmentRange segments = now.segments->range();
  for (const std::int32_t block : blocks) {
    const Vec3d usual = usualAround(block);
    for (const SegmentId id : idsOf(now, block)) {
      const Ends ends = endsOf(now, segments, id);
      set(placeOf(id), back(ends.a - usual));
      set(placeOf(id) + 1, back(ends.b - usual));
      anchors_[placeOf(id)].numbers[3] = std::max(roundedDown(ends.radius), 0.0F);
    }
  }
}

/// The median of the displacements of the blocks around one, by axis.
Vec3d Anchors::usualAround(std::int32_t block) const {
  // They are below the same node, three levels above.
  constexpr std::int32_t kAround = kArity * kArity * kArity;
  const std::int32_t begin = block / kAround * kAround;
  const std::int32_t end = std::min(begin + kAround, blockCount());
  std::array<double, kAround> numbers;
  Vec3d usual{0, 0, 0};
  for (int axis = 0; axis < 3; ++axis) {
    const auto last = std::transform(
        nodes_.begin() + begin, nodes_.begin() + end, numbers.begin(),
        [axis](const Node& node) { return middleOf(node.moved).*geometry::kAxes[axis]; });
    const auto middle = numbers.begin() + (last - numbers.begin()) / 2;
    std::nth_element(numbers.begin(), middle, last);
    if (std::isfinite(*middle)) usual.*geometry::kAxes[axis] = *middle;
  }
  return usual;
}

double Anchors::deviationOf(std::int32_t block) const {
  const double deviation = norm(middleOf(node(0, block).moved) - usualAround(block));
  return deviation >= 0 ? deviation : std::numeric_limits<double>::infinity();
}

void Anchors::sample(const SegmentsNow& now, std::vector<geometry::MovedPoint>& points) const {
  constexpr std::size_t kMost = 256;
  const tree::SegmentRange segments = now.segments->range();
  const tree::SegmentIds& order = *now.order;
  for (std::size_t i = 0; i < order.size(); i += order.size() / kMost + 1) {
    points.push_back({at(placeOf(order[i])), endsOf(now, segments, order[i]).a});
  }
}

}  // namespace fcl_fibers::live
