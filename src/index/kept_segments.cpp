// SPDX-License-Identifier: BSD-3-Clause
#include "index/kept_segments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace fcl_fibers::index {

using geometry::Segment;

void KeptSegments::reset(SegmentId begin, SegmentId end, const std::vector<SegmentId>& ids) {
  forgetBoxes();
  begin_ = begin;
  count_ = static_cast<std::size_t>(end - begin);
  if (!share_ends_) {
    ends_.assign(2 * count_, {});
    return;
  }
  ends_.assign(count_ + 1, {});
  is_segment_.assign(count_ + 1, false);
  for (const SegmentId id : ids) is_segment_[static_cast<std::size_t>(id - begin)] = true;
}

void KeptSegments::resize(SegmentId begin, SegmentId end) {
  if (begin == begin_ && end == this->end()) return;
  std::vector<geometry::CapsuleEnd> ends(2 * static_cast<std::size_t>(end - begin));
  const SegmentId first = std::max(begin, begin_), last = std::min(end, this->end());
  if (first < last) {
    std::copy_n(range().capsule(first), 2 * (last - first), ends.data() + 2 * (first - begin));
  }
  ends_ = std::move(ends);
  begin_ = begin;
  count_ = static_cast<std::size_t>(end - begin);
}

SegmentRange KeptSegments::range() const { return {ends_.data(), stride(), begin_}; }

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
  return geometry::PairBlock::unitFor(*median);
}

}  // namespace fcl_fibers::index
