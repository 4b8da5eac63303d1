// SPDX-License-Identifier: BSD-3-Clause
#include "index/kept_segments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace fcl_fibers::index {

using geometry::Segment;

void KeptSegments::reset(SegmentId begin, SegmentId end, const tree::SegmentIds& ids,
                         parallel::Executor* executor) {
  constexpr std::size_t kRange = 16384;
  forgetKinds();
  begin_ = begin;
  count_ = static_cast<std::size_t>(end - begin);
  if (!share_ends_) {
    ends_.resize(2 * count_);
    if (ids.size() == count_) return;
    // usualUnit() passes over what is no segment, because it has no size.
    parallel::forRanges(executor, ends_.size(), kRange, [&](std::size_t from, std::size_t to) {
      std::fill(ends_.data() + from, ends_.data() + to, geometry::CapsuleEnd{});
    });
    return;
  }
  ends_.resize(count_ + 1);
  is_segment_.assign(count_ / kBits + 1, 0);
  parallel::forRanges(executor, ids.size(), kRange, [&](std::size_t from, std::size_t to) {
    // Ids that follow each other are mostly in one word, which other threads may write, too.
    std::size_t word = 0;
    Word bits = 0;
    const auto write = [&] {
      if (bits != 0) __atomic_fetch_or(&is_segment_[word], bits, __ATOMIC_RELAXED);
      bits = 0;
    };
    for (std::size_t i = from; i < to; ++i) {
      const auto at = static_cast<std::size_t>(ids[i] - begin);
      if (at / kBits != word) write();
      word = at / kBits;
      bits |= Word{1} << at % kBits;
    }
    write();
  });
}

void KeptSegments::resize(SegmentId begin, SegmentId end) {
  if (begin == begin_ && end == this->end()) return;
  // See reset() for what is no segment.
  parallel::UnwrittenVector<geometry::CapsuleEnd> ends(2 * static_cast<std::size_t>(end - begin),
                                                       geometry::CapsuleEnd{});
  const SegmentId first = std::max(begin, begin_), last = std::min(end, this->end());
  if (first < last) {
    std::copy_n(range().capsule(first), 2 * (last - first), ends.data() + 2 * (first - begin));
  }
  ends_ = std::move(ends);
  begin_ = begin;
  count_ = static_cast<std::size_t>(end - begin);
}

SegmentRange KeptSegments::range() const {
  SegmentRange range(ends_.data(), stride(), begin_);
  range.setHasBoxes(hasBoxes());
  range.setMayTaper(mayTaper());
  return range;
}

double KeptSegments::usualUnit() const {
  constexpr std::size_t kSamples = 255;
  if (!hasCapsules()) return 1;
  std::array<double, kSamples> sizes;
  std::size_t found = 0;
  const SegmentRange all = range();
  for (std::size_t i = 0; i < count_; i += count_ / kSamples + 1) {
    if (share_ends_ && !has(i)) continue;
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
