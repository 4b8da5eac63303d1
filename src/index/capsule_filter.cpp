// SPDX-License-Identifier: BSD-3-Clause
#include "index/capsule_filter.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "geometry/capsule_test.h"
#include "geometry/touch.h"

namespace fcl_fibers::index {

using geometry::CapsuleEnd;
using geometry::CapsulePairs;
using geometry::Segment;
using tree::Pair;

CapsuleFilter::CapsuleFilter(SegmentRange a, SegmentRange b, const geometry::FrameChange* b_to_a,
                             double margin, double unit, double error)
    : a_(a), b_(b), b_to_a_(b_to_a), margin_(margin), unit_(unit), error_(error) {
  const double most = a.mostError() + std::max(b.mostError(), error);
  if (b_to_a == nullptr && CapsulePairs::isSmall(unit * most)) error_of_all_ = most;
}

/// The second segment of a pair in the first one's frame.
Segment CapsuleFilter::second(const Pair& pair) const {
  const Segment q = b_[pair.b];
  return b_to_a_ == nullptr ? q : (*b_to_a_)(q);
}

/// @param q  second(pair)
double CapsuleFilter::error(const Pair& pair, const Segment& q) const {
  const double q_error =
      b_to_a_ == nullptr ? std::max(endPointError(q), error_) : b_to_a_->error(q);
  return endPointError(a_[pair.a]) + q_error;
}

std::size_t CapsuleFilter::keep(Pair* pairs, std::size_t count,
                                std::vector<geometry::Impact>& /*impacts*/) const {
  constexpr std::size_t kBlock = CapsulePairs::kCapacity;
  CapsulePairs block(unit_);
  std::array<CapsuleEnd, 2 * kBlock> moved;
  std::size_t kept = 0;
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, count);
    block.clear();
    // Segments are stored by id, so neighbours in the tree are far from each other in memory.
    for (std::size_t i = end; i < std::min(end + kBlock, count); ++i) {
      if (pairs[i].a != pairs[i - 1].a) a_.prefetch(pairs[i].a);
      b_.prefetch(pairs[i].b);
    }
    if (error_of_all_ >= 0) {
      for (std::size_t i = begin; i < end; ++i) {
        block.add(a_.capsule(pairs[i].a), b_.capsule(pairs[i].b), margin_, error_of_all_);
      }
    } else {
      for (std::size_t i = begin; i < end; ++i) {
        const Segment q = second(pairs[i]);
        CapsuleEnd* const q_ends = moved.data() + 2 * (i - begin);
        q_ends[0] = geometry::firstEndOf(q);
        q_ends[1] = geometry::secondEndOf(q);
        block.add(a_.capsule(pairs[i].a), q_ends, margin_, error(pairs[i], q));
      }
    }
    const CapsulePairs::Verdict verdict = block.decide();
    const std::uint64_t all = ~std::uint64_t{0} >> (kBlock - (end - begin));
    for (std::uint64_t rest = all & ~verdict.apart; rest != 0; rest &= rest - 1) {
      const int bit = __builtin_ctzll(rest);
      const Pair pair = pairs[begin + static_cast<std::size_t>(bit)];
      if ((verdict.touching >> bit & 1u) == 0) {
        const Segment q = second(pair);
        if (!touch(a_[pair.a], q, margin_, error(pair, q))) continue;
      }
      pairs[kept++] = pair;
    }
  }
  return kept;
}

}  // namespace fcl_fibers::index
