// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/frame.h"
#include "geometry/impact.h"
#include "geometry/impact_pairs.h"
#include "index/pair_filter.h"
#include "tree/segment_range.h"

namespace fcl_fibers::index {

/// Segments at the start and at the end of a step.
struct MovingRange {
  tree::SegmentRange start, end;

  geometry::MovingSegment operator[](tree::SegmentId id) const { return {start[id], end[id]}; }
  geometry::MovingCapsule capsule(tree::SegmentId id) const {
    return {start.capsule(id), end.capsule(id)};
  }
  FCL_FIBERS_ALWAYS_INLINE void prefetch(tree::SegmentId id) const {
    start.prefetch(id);
    end.prefetch(id);
  }
  /// Bounds endPointError() of every segment at any time.
  double mostError() const { return std::max(start.mostError(), end.mostError()); }
};

/// Keeps the pairs whose capsules touch during a step, and finds when. It decides many pairs at a
/// time in float; findImpact() decides the rest.
class ImpactFilter final : public PairFilter {
 public:
  /// @param b       in a's frame, or in another frame from which `b_to_a` leads to a's
  /// @param margin  in a's frame
  /// @param unit    see ImpactPairs
  /// @param error   bound on the error of b's end points, if it is larger than their coordinates
  ///                imply; unused if `b_to_a` is given, which has its own bound
  /// @param wanted  keeps the pairs that are looked at and finds no impacts; null for all
  ImpactFilter(MovingRange a, MovingRange b, const geometry::FrameChange* b_to_a, double margin,
               double unit, double error, const PairFilter* wanted);

  std::size_t keep(tree::Pair* pairs, std::size_t count,
                   std::vector<geometry::Impact>& impacts) const override;

  /// A pair in a's frame, and a bound of the error of its end points.
  struct Motions {
    geometry::MovingSegment p, q;
    double error;
  };
  Motions motionsOf(const tree::Pair& pair) const;

  double margin() const { return margin_; }

  /// Calls visit(pair, motions, from) for the wanted pairs that the test in float leaves open;
  /// `from` is as in findImpact(). Until a pair is visited, it must stay in its place.
  /// @param impacts  empty
  template <class F>
  void forEachUndecided(tree::Pair* pairs, std::size_t count,
                        std::vector<geometry::Impact>& impacts, F&& visit) const;

 private:
  MovingRange a_, b_;
  const geometry::FrameChange* b_to_a_;
  double margin_, unit_, error_;
  const PairFilter* wanted_;
  /// As in CapsuleFilter.
  double error_of_all_ = -1;
};

/// The first of the times that several threads find; 1 if there is none.
class FirstTime {
 public:
  double get() const { return first_.load(std::memory_order_relaxed); }
  /// The last time that counts in a search, rounded up.
  const std::atomic<float>& until() const { return until_; }
  void add(double time);

 private:
  std::atomic<double> first_{1};
  std::atomic<float> until_{1};
};

/// Keeps no pair, but the first time at which two capsules touch that did not at the start, or are
/// nearer than they were there. Several threads may ask it at the same time.
class FirstImpact final : public PairFilter {
 public:
  /// @param first  gets that time
  FirstImpact(const ImpactFilter& filter, FirstTime& first) : filter_(filter), first_(first) {}

  std::size_t keep(tree::Pair* pairs, std::size_t count,
                   std::vector<geometry::Impact>& impacts) const override;

 private:
  const ImpactFilter& filter_;
  FirstTime& first_;
};

template <class F>
void ImpactFilter::forEachUndecided(tree::Pair* pairs, std::size_t count,
                                    std::vector<geometry::Impact>& impacts, F&& visit) const {
  using geometry::CapsuleEnd;
  constexpr std::size_t kBlock = geometry::ImpactPairs::kCapacity;
  if (wanted_ != nullptr) count = wanted_->keep(pairs, count, impacts);
  geometry::ImpactPairs block(unit_);
  std::array<CapsuleEnd, 4 * kBlock> moved;
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, count);
    block.clear();
    for (std::size_t i = end; i < std::min(end + kBlock, count); ++i) {
      a_.prefetch(pairs[i].a);
      b_.prefetch(pairs[i].b);
    }
    for (std::size_t i = begin; i < end; ++i) {
      const geometry::MovingCapsule p = a_.capsule(pairs[i].a);
      if (error_of_all_ >= 0) {
        block.add(p, b_.capsule(pairs[i].b), margin_, error_of_all_);
        continue;
      }
      const Motions motions = motionsOf(pairs[i]);
      CapsuleEnd* const ends = moved.data() + 4 * (i - begin);
      ends[0] = firstEndOf(motions.q.start);
      ends[1] = secondEndOf(motions.q.start);
      ends[2] = firstEndOf(motions.q.end);
      ends[3] = secondEndOf(motions.q.end);
      block.add(p, {ends, ends + 2}, margin_, motions.error);
    }
    const std::uint64_t all = ~std::uint64_t{0} >> (kBlock - (end - begin));
    for (std::uint64_t rest = all & ~block.decide(); rest != 0; rest &= rest - 1) {
      const int bit = __builtin_ctzll(rest);
      const tree::Pair pair = pairs[begin + static_cast<std::size_t>(bit)];
      visit(pair, motionsOf(pair), block.from(bit));
    }
  }
}

}  // namespace fcl_fibers::index
