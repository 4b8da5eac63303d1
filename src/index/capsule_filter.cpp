// SPDX-License-Identifier: BSD-3-Clause
#include "index/capsule_filter.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/capsule_test.h"
#include "geometry/touch.h"

namespace fcl_fibers::index {
namespace {

using geometry::Segment;
using tree::Pair;

/// Stands in for a FrameChange if the second segments are in the first ones' frame.
struct FirstFrame {
  const Segment& operator()(const Segment& segment) const { return segment; }
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
    for (std::size_t i = begin; i < end; ++i) {
      const Segment& p = a_[pairs[i].a];
      const auto& q = to_first(b_[pairs[i].b]);
      block.add(p, q, margin_, endPointError(p) + to_first.error(q));
    }
    const auto verdict = block.decide();
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t byte = (i - begin) / 8, bit = (i - begin) % 8;
      if (verdict.apart[byte] >> bit & 1u) continue;
      bool touches = verdict.touching[byte] >> bit & 1u;
      if (!touches) {
        const Segment& p = a_[pairs[i].a];
        const auto& q = to_first(b_[pairs[i].b]);
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

double usualUnit(const std::vector<Segment>& segments) {
  constexpr std::size_t kSamples = 255;
  std::array<double, kSamples> sizes;
  std::size_t found = 0;
  for (std::size_t i = 0; i < segments.size(); i += segments.size() / kSamples + 1) {
    const Segment& s = segments[i];
    const double size = maxNorm(s.b - s.a) + s.thickness();
    if (std::isfinite(size) && size > 0) sizes[found++] = size;
  }
  if (found == 0) return 1;
  const auto median = sizes.begin() + found / 2;
  std::nth_element(sizes.begin(), median, sizes.begin() + found);
  return std::ldexp(1.0, -std::ilogb(*median));
}

}  // namespace fcl_fibers::index
