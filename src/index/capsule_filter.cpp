// SPDX-License-Identifier: BSD-3-Clause
#include "index/capsule_filter.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <type_traits>

#include "geometry/capsule_test.h"
#include "geometry/impact.h"
#include "geometry/rounding.h"
#include "geometry/touch.h"

namespace fcl_fibers::index {

using geometry::CapsuleEnd;
using geometry::CapsulePairs;
using geometry::FrameChange;
using geometry::Impact;
using geometry::ImpactPairs;
using geometry::ImpactQuery;
using geometry::MovingCapsule;
using geometry::MovingSegment;
using geometry::Segment;
using tree::Pair;
using tree::SegmentRange;

namespace {

// The same for what rests and for what moves.

FCL_FIBERS_ALWAYS_INLINE Segment changed(const FrameChange& change, const Segment& s) {
  return change(s);
}
FCL_FIBERS_ALWAYS_INLINE MovingSegment changed(const FrameChange& change, const MovingSegment& s) {
  return {change(s.start), change(s.end)};
}
double errorOf(const FrameChange& change, const Segment& moved) { return change.error(moved); }
double errorOf(const FrameChange& change, const MovingSegment& moved) {
  return std::max(change.error(moved.start), change.error(moved.end));
}
FCL_FIBERS_ALWAYS_INLINE const CapsuleEnd* store(const Segment& s, CapsuleEnd* ends) {
  ends[0] = firstEndOf(s);
  ends[1] = secondEndOf(s);
  return ends;
}
FCL_FIBERS_ALWAYS_INLINE MovingCapsule store(const MovingSegment& s, CapsuleEnd* ends) {
  return {store(s.start, ends), store(s.end, ends + 2)};
}
std::uint64_t apart(const CapsulePairs::Verdict& verdict) { return verdict.apart; }
std::uint64_t apart(std::uint64_t verdict) { return verdict; }

}  // namespace

void FirstTime::add(double time) {
  double first = get();
  while (time < first && !first_.compare_exchange_weak(first, time)) {
  }
  // Another thread may just have written a later time, which costs time and no impact.
  until_.store(geometry::roundedUp(get()), std::memory_order_relaxed);
}

CapsuleFilter::CapsuleFilter(const MovingRange& a, const MovingRange& b, const FrameChange* b_to_a,
                             double margin, double unit, double error, bool moves,
                             const Question& question)
    : a_(a),
      b_(b),
      b_to_a_(b_to_a),
      margin_(margin),
      unit_(unit),
      error_(error),
      moves_(moves),
      question_(question) {
  const double most = moves ? a.mostError() + std::max(b.mostError(), error)
                            : a.end.mostError() + std::max(b.end.mostError(), error);
  if (b_to_a == nullptr && CapsulePairs::isSmall(unit * most)) error_of_all_ = most;
}

/// The segments of a pair in a's frame, and a bound on the error of their end points.
template <class Range>
FCL_FIBERS_ALWAYS_INLINE auto CapsuleFilter::together(const Range& a, const Range& b,
                                                      const Pair& pair) const {
  struct {
    std::decay_t<decltype(a[0])> p, q;
    double error;
  } both{a[pair.a], b[pair.b], 0};
  const double p_error = endPointError(both.p);
  if (b_to_a_ == nullptr) {
    both.error = p_error + std::max(endPointError(both.q), error_);
  } else {
    both.q = changed(*b_to_a_, both.q);
    both.error = p_error + errorOf(*b_to_a_, both.q);
  }
  return both;
}

/// Calls visit(pair, i, block, verdict) for the pairs that are not apart by a test of blocks; i is
/// the place in the block. Until a pair is visited, it must stay in its place.
template <class Block, class Range, class F>
FCL_FIBERS_ALWAYS_INLINE void CapsuleFilter::forEachLeft(const Range& a, const Range& b,
                                                         const Pair* pairs, std::size_t count,
                                                         F&& visit) const {
  constexpr std::size_t kBlock = Block::kCapacity;
  constexpr std::size_t kEnds = std::is_same_v<Range, MovingRange> ? 4 : 2;
  Block block(unit_);
  std::array<CapsuleEnd, kEnds * kBlock> moved;
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, count);
    block.clear();
    // Segments are stored by id, so neighbours in the tree are far from each other in memory.
    for (std::size_t i = end; i < std::min(end + kBlock, count); ++i) {
      if (pairs[i].a != pairs[i - 1].a) a.prefetch(pairs[i].a);
      b.prefetch(pairs[i].b);
    }
    if (error_of_all_ >= 0) {
      for (std::size_t i = begin; i < end; ++i) {
        block.add(a.capsule(pairs[i].a), b.capsule(pairs[i].b), margin_, error_of_all_);
      }
    } else {
      for (std::size_t i = begin; i < end; ++i) {
        const auto both = together(a, b, pairs[i]);
        CapsuleEnd* const ends = moved.data() + kEnds * (i - begin);
        block.add(a.capsule(pairs[i].a), store(both.q, ends), margin_, both.error);
      }
    }
    const auto verdict = block.decide();
    const std::uint64_t all = ~std::uint64_t{0} >> (kBlock - (end - begin));
    for (std::uint64_t rest = all & ~apart(verdict); rest != 0; rest &= rest - 1) {
      const int i = __builtin_ctzll(rest);
      visit(pairs[begin + static_cast<std::size_t>(i)], i, block, verdict);
    }
  }
}

std::size_t CapsuleFilter::keep(Pair* pairs, std::size_t count,
                                std::vector<Impact>& impacts) const {
  if (question_.wanted != nullptr) count = question_.wanted->keep(pairs, count, impacts);
  return moves_ ? keepImpacts(pairs, count, impacts) : keepTouching(pairs, count);
}

std::size_t CapsuleFilter::keepTouching(Pair* pairs, std::size_t count) const {
  std::size_t kept = 0;
  forEachLeft<CapsulePairs>(
      a_.end, b_.end, pairs, count,
      [&](Pair pair, int i, const CapsulePairs&, const CapsulePairs::Verdict& verdict) {
        if ((verdict.touching >> i & 1u) == 0) {
          const auto [p, q, error] = together(a_.end, b_.end, pair);
          if (!touch(p, q, margin_, error)) return;
        }
        pairs[kept++] = pair;
      });
  return kept;
}

std::size_t CapsuleFilter::keepImpacts(Pair* pairs, std::size_t count,
                                       std::vector<Impact>& impacts) const {
  Pair waiting[geometry::kImpactsAtOnce];
  ImpactQuery queries[geometry::kImpactsAtOnce];
  Impact found[geometry::kImpactsAtOnce];
  int waits = 0;
  std::size_t kept = 0;
  const auto decide = [&] {
    for (auto rest = geometry::findImpacts(queries, waits, found); rest != 0; rest &= rest - 1) {
      const int i = __builtin_ctz(rest);
      impacts.push_back(found[i]);
      pairs[kept++] = waiting[i];
    }
    waits = 0;
  };
  const auto take = [&](const Pair& pair, int i, const ImpactPairs& block, std::uint64_t) {
    const auto [p, q, error] = together(a_, b_, pair);
    const double from = block.from(i);
    if (FirstTime* const first = question_.first; first != nullptr) {
      Impact impact;
      if (from < first->get() && findApproach(p, q, margin_, error, from, impact)) {
        first->add(impact.time);
      }
      return;
    }
    waiting[waits] = pair;
    queries[waits++] = {p, q, margin_, error, from};
    if (waits == geometry::kImpactsAtOnce) decide();
  };
  forEachLeft<ImpactPairs>(a_, b_, pairs, count, take);
  decide();
  return kept;
}

}  // namespace fcl_fibers::index
