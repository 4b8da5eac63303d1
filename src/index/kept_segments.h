// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <fcl_fibers/tree_export.h>

#include "geometry/capsule_test.h"
#include "geometry/segment_block.h"
#include "parallel/executor.h"
#include "parallel/unwritten.h"
#include "tree/segment_range.h"

namespace fcl_fibers::index {

using tree::SegmentId;
using tree::SegmentRange;

/// The segments of an index by id, for the test of capsules. If a segment begins where the one with
/// the id before ends, the point is kept once.
class KeptSegments {
 public:
  explicit KeptSegments(bool share_ends) : share_ends_(share_ends) {}

  /// Makes room for the segments `ids`, which are in [begin, end). They are unspecified until set.
  /// @param executor  null for one thread
  void reset(SegmentId begin, SegmentId end, const tree::SegmentIds& ids,
             parallel::Executor* executor = nullptr);
  /// Makes room for the ids in [begin, end). Segments that are set and among them stay.
  /// @pre ends are not shared
  void resize(SegmentId begin, SegmentId end);
  /// Gives each segment the id newId(id), or forgets it if that is negative. It needs no memory.
  /// @pre ends are not shared; the order stays, and no id grows
  template <class NewId>
  void renumber(NewId&& newId) {
    SegmentId next = begin_;
    for (SegmentId old = begin_; old < end(); ++old) {
      const SegmentId id = newId(old);
      if (id < 0) continue;
      set(id, (*this)[old]);
      next = id + 1;
    }
    count_ = static_cast<std::size_t>(next - begin_);
  }
  void clear() { *this = KeptSegments(share_ends_); }

  SegmentId begin() const { return begin_; }
  SegmentId end() const { return begin_ + static_cast<SegmentId>(count_); }
  bool has(SegmentId id) const { return id >= begin() && id < end(); }

  bool sharesEnds() const { return share_ends_; }
  /// Whether the point is kept once where a segment meets the one with the next id, or the one with
  /// the id before.
  ///@{
  bool sharesSecondEnd(SegmentId id) const { return share_ends_ && isSegment(id + 1); }
  bool sharesFirstEnd(SegmentId id) const {
    return share_ends_ && id > begin_ && isSegment(id - 1);
  }
  ///@}
  /// Whether the segments include this id.
  /// @pre ends are shared
  bool isSegment(SegmentId id) const { return has(static_cast<std::size_t>(id - begin_)); }

  /// Several threads may set different segments at the same time.
  FCL_FIBERS_ALWAYS_INLINE void set(SegmentId id, const geometry::Segment& segment) {
    set(id, segment, geometry::firstEndOf(segment), geometry::secondEndOf(segment));
  }
  /// Sets segment i of a block, with the radii at its ends to the last bit.
  FCL_FIBERS_ALWAYS_INLINE void set(SegmentId id, const geometry::SegmentBlock& block, int i) {
    const geometry::Segment segment = block[i];
    geometry::CapsuleEnd ends[] = {geometry::firstEndOf(segment), geometry::secondEndOf(segment)};
    for (int end = 0; end < 2 && block.are_tapered; ++end) {
      ends[end].numbers[3] = block.end_radius[end][i];
    }
    set(id, segment, ends[0], ends[1]);
  }
  /// Sets those of a block that are present.
  void set(const SegmentId* ids, int count, geometry::BlockMask present,
           const geometry::SegmentBlock& block) {
    for (int i = 0; i < count; ++i) {
      if ((present >> i & 1u) != 0) set(ids[i], block, i);
    }
  }
  /// The ends of all ids, to be written.
  /// @pre ends are shared
  geometry::CapsuleEnd* ends() {
    has_capsules_.set();
    return ends_.data();
  }
  geometry::Segment operator[](SegmentId id) const { return range()[id]; }
  FCL_FIBERS_TREE_EXPORT SegmentRange range() const;
  /// Whether a box was set since the last reset() or forgetKinds().
  bool hasBoxes() const { return has_boxes_.isSet(); }
  /// Whether a capsule or a box around one was set since.
  bool hasCapsules() const { return has_capsules_.isSet(); }
  /// Whether a segment may be tapered. It is true once one was set since, or told by setMayTaper().
  bool mayTaper() const { return may_taper_.isSet(); }
  void setMayTaper() { may_taper_.set(); }
  /// All segments are about to be set.
  void forgetKinds() { has_boxes_ = has_capsules_ = may_taper_ = {}; }

  /// The power of two that scales the median segment of a sample to a size of about one. Without
  /// capsules it is 1, because nothing needs it.
  double usualUnit() const;

  std::size_t memoryUsage() const {
    return ends_.capacity() * sizeof(geometry::CapsuleEnd) + is_segment_.capacity() * sizeof(Word);
  }

 private:
  /// A flag that several threads may set.
  class Flag {
   public:
    Flag() = default;
    Flag(const Flag& other) : is_set_(other.isSet()) {}
    Flag& operator=(const Flag& other) {
      is_set_.store(other.isSet(), std::memory_order_relaxed);
      return *this;
    }
    void set() {
      if (!isSet()) is_set_.store(true, std::memory_order_relaxed);
    }
    bool isSet() const { return is_set_.load(std::memory_order_relaxed); }

   private:
    std::atomic<bool> is_set_{false};
  };

  using Word = std::uint64_t;
  static constexpr std::size_t kBits = 64;

  FCL_FIBERS_ALWAYS_INLINE void set(SegmentId id, const geometry::Segment& segment,
                                    const geometry::CapsuleEnd& first,
                                    const geometry::CapsuleEnd& second) {
    const auto i = static_cast<std::size_t>(id - begin_);
    geometry::CapsuleEnd* const out = ends_.data() + stride() * i;
    if (segment.isBox()) has_boxes_.set();
    if (!segment.isOtherBox()) has_capsules_.set();
    if (segment.isTapered()) may_taper_.set();
    out[0] = first;
    // A point that two segments share is written by the second, so no two threads write it.
    if (share_ends_ && has(i + 1)) return;
    out[1] = second;
  }

  std::size_t stride() const { return share_ends_ ? 1 : 2; }
  bool has(std::size_t i) const { return (is_segment_[i / kBits] >> i % kBits & 1u) != 0; }

  bool share_ends_;
  SegmentId begin_ = 0;
  std::size_t count_ = 0;
  /// By id: two each or, if ends are shared, one each and one more.
  parallel::UnwrittenVector<geometry::CapsuleEnd> ends_;
  std::vector<Word> is_segment_;  ///< a bit by id, if ends are shared
  Flag has_boxes_, has_capsules_, may_taper_;
};

}  // namespace fcl_fibers::index
