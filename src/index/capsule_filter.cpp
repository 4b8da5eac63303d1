// SPDX-License-Identifier: BSD-3-Clause
#include "index/capsule_filter.h"

#include <algorithm>

#include "geometry/capsule_test.h"
#include "geometry/touch.h"

namespace fcl_fibers::index {
namespace {

using geometry::Segment;
using tree::Pair;

/// Stands in for a FrameChange if the second segments are in the first ones' frame.
struct FirstFrame {
  Segment operator()(const Segment& segment) const { return segment; }
  double error(const Segment& segment) const { return std::max(endPointError(segment), least); }

  double least;
};

}  // namespace

template <class ToFirst>
std::size_t CapsuleFilter::keep(Pair* pairs, std::size_t count, const ToFirst& to_first) const {
  constexpr std::size_t kBlock = geometry::CapsulePairs::kCapacity;
  geometry::CapsulePairs block(unit_);
  std::size_t kept = 0;
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, count);
    block.clear();
    // Segments are by id, so that those of neighbours in the tree are far from each other.
    for (std::size_t i = end; i < std::min(end + kBlock, count); ++i) b_.prefetch(pairs[i].b);
    for (std::size_t i = begin; i < end; ++i) {
      const Segment p = a_[pairs[i].a];
      const Segment q = to_first(b_[pairs[i].b]);
      block.add(p, q, margin_, endPointError(p) + to_first.error(q));
    }
    const auto verdict = block.decide();
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t byte = (i - begin) / 8, bit = (i - begin) % 8;
      if (verdict.apart[byte] >> bit & 1u) continue;
      bool touches = verdict.touching[byte] >> bit & 1u;
      if (!touches) {
        const Segment p = a_[pairs[i].a];
        const Segment q = to_first(b_[pairs[i].b]);
        touches = touch(p, q, margin_, endPointError(p) + to_first.error(q));
      }
      if (touches) pairs[kept++] = pairs[i];
    }
  }
  return kept;
}

std::size_t CapsuleFilter::keepTouching(Pair* pairs, std::size_t count) const {
  return b_to_a_ == nullptr ? keep(pairs, count, FirstFrame{error_}) : keep(pairs, count, *b_to_a_);
}

}  // namespace fcl_fibers::index
