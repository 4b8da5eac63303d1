// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/segment.h"
#include "tree/topology.h"

namespace fcl_fibers::index {

using tree::SegmentId;

/// A view of segments with consecutive ids.
class SegmentRange {
 public:
  SegmentRange() = default;
  /// Segments one after the other.
  SegmentRange(const geometry::Segment* segments, SegmentId first)
      : SegmentRange(&segments->a.x, 7, &segments->radius, 7, first) {
    static_assert(sizeof(geometry::Segment) == 7 * sizeof(double));
  }
  /// @param ends   the first segment's end points; those of the next are `stride` numbers on
  /// @param radii  the first segment's radius; that of the next is `radius_stride` numbers on
  SegmentRange(const double* ends, std::size_t stride, const double* radii,
               std::size_t radius_stride, SegmentId first)
      : ends_(ends), radii_(radii), stride_(stride), radius_stride_(radius_stride), first_(first) {}

  FCL_FIBERS_ALWAYS_INLINE geometry::Segment operator[](SegmentId id) const {
    const auto i = static_cast<std::size_t>(static_cast<std::uint32_t>(id - first_));
    const double* const p = ends_ + stride_ * i;
    return {{p[0], p[1], p[2]}, {p[3], p[4], p[5]}, radii_[radius_stride_ * i]};
  }

  /// It is inlined because gcc otherwise takes it for a function that does nothing.
  FCL_FIBERS_ALWAYS_INLINE void prefetch(SegmentId id) const {
    const auto i = static_cast<std::size_t>(static_cast<std::uint32_t>(id - first_));
    __builtin_prefetch(ends_ + stride_ * i);
    __builtin_prefetch(ends_ + stride_ * i + 5);
    __builtin_prefetch(radii_ + radius_stride_ * i);
  }

 private:
  const double* ends_ = nullptr;
  const double* radii_ = nullptr;
  std::size_t stride_ = 0, radius_stride_ = 0;
  SegmentId first_ = 0;
};

/// The segments of an index by id, for the test of capsules. If a segment begins where the one with
/// the id before ends, the point is kept once.
class KeptSegments {
 public:
  explicit KeptSegments(bool share_ends) : share_ends_(share_ends) {}

  /// Makes room for the segments `ids`, which are in [begin, end). They are unspecified until set.
  void reset(SegmentId begin, SegmentId end, const std::vector<SegmentId>& ids);
  void clear() { *this = KeptSegments(share_ends_); }

  /// Whether this id is one of those that were given.
  /// @pre ends are shared
  bool isSegment(SegmentId id) const { return is_segment_[static_cast<std::size_t>(id - begin_)]; }

  /// Several threads may set different segments at the same time.
  FCL_FIBERS_ALWAYS_INLINE void set(SegmentId id, const geometry::Segment& segment) {
    const auto i = static_cast<std::size_t>(id - begin_);
    double* const out = numbers_.data() + (share_ends_ ? 3 : kNumbers) * i;
    out[0] = segment.a.x;
    out[1] = segment.a.y;
    out[2] = segment.a.z;
    if (share_ends_) {
      radii_[i] = segment.radius;
      // A point that two segments share is written by the second, so no two threads write it.
      if (is_segment_[i + 1]) return;
    } else {
      out[6] = segment.radius;
    }
    out[3] = segment.b.x;
    out[4] = segment.b.y;
    out[5] = segment.b.z;
  }
  geometry::Segment operator[](SegmentId id) const { return range()[id]; }
  SegmentRange range() const;

  /// The power of two that scales the median segment of a sample to a size of about one.
  double usualUnit() const;

  std::size_t memoryUsage() const {
    return (numbers_.capacity() + radii_.capacity()) * sizeof(double) + is_segment_.capacity() / 8;
  }

 private:
  static constexpr std::size_t kNumbers = 7;  ///< of a segment that shares no end

  bool share_ends_;
  SegmentId begin_ = 0;
  std::size_t count_ = 0;
  /// Three for each id and three more, if ends are shared; else both ends and the radius.
  std::vector<double> numbers_;
  std::vector<double> radii_;     ///< by id, if ends are shared
  std::vector<bool> is_segment_;  ///< by id, if ends are shared
};

}  // namespace fcl_fibers::index
