// SPDX-License-Identifier: BSD-3-Clause
#include "index/kept_segments.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace fcl_fibers::index {

using geometry::Segment;

void KeptSegments::reset(SegmentId begin, SegmentId end, const std::vector<SegmentId>& ids) {
  begin_ = begin;
  count_ = static_cast<std::size_t>(end - begin);
  if (!share_ends_) {
    numbers_.assign(kNumbers * count_, 0);
    return;
  }
  numbers_.assign(3 * (count_ + 1), 0);
  radii_.assign(count_, 0);
  is_segment_.assign(count_ + 1, false);
  for (const SegmentId id : ids) is_segment_[static_cast<std::size_t>(id - begin)] = true;
}

SegmentRange KeptSegments::range() const {
  if (numbers_.empty()) return {};
  if (share_ends_) return {numbers_.data(), 3, radii_.data(), 1, begin_};
  return {numbers_.data(), kNumbers, numbers_.data() + 6, kNumbers, begin_};
}

double KeptSegments::usualUnit() const {
  constexpr std::size_t kSamples = 255;
  std::array<double, kSamples> sizes;
  std::size_t found = 0;
  const SegmentRange all = range();
  for (std::size_t i = 0; i < count_; i += count_ / kSamples + 1) {
    if (share_ends_ && !is_segment_[i]) continue;
    const Segment s = all[begin_ + static_cast<SegmentId>(i)];
    const double size = maxNorm(s.b - s.a) + s.thickness();
    if (std::isfinite(size) && size > 0) sizes[found++] = size;
  }
  if (found == 0) return 1;
  const auto median = sizes.begin() + found / 2;
  std::nth_element(sizes.begin(), median, sizes.begin() + found);
  return std::ldexp(1.0, -std::ilogb(*median));
}

}  // namespace fcl_fibers::index
