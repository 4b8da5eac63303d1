// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "geometry/capsule_test.h"
#include "tree/topology.h"

namespace fcl_fibers::tree {

/// A view of segments with consecutive ids.
class SegmentRange {
 public:
  SegmentRange() = default;
  /// @param capsules  the first segment; the one with the next id is `stride` ends further on
  SegmentRange(const geometry::CapsuleEnd* capsules, std::size_t stride, SegmentId first)
      : capsules_(capsules), stride_(stride), first_(first) {}

  /// Bounds endPointError() of every segment. It is infinite unless it has been set.
  double mostError() const { return most_error_; }
  void setMostError(double error) { most_error_ = error; }

  /// Whether a segment may be a box. It is true unless it has been set.
  bool hasBoxes() const { return has_boxes_; }
  void setHasBoxes(bool has_boxes) { has_boxes_ = has_boxes; }

  /// Whether a segment may be tapered. It is false unless it has been set.
  bool mayTaper() const { return may_taper_; }
  void setMayTaper(bool may_taper) { may_taper_ = may_taper; }

  FCL_FIBERS_ALWAYS_INLINE const geometry::CapsuleEnd* capsule(SegmentId id) const {
    return capsules_ + stride_ * static_cast<std::uint32_t>(id - first_);
  }
  FCL_FIBERS_ALWAYS_INLINE geometry::Segment operator[](SegmentId id) const {
    return geometry::segmentOf(capsule(id), may_taper_);
  }
  /// It is inlined because gcc otherwise takes it for a function that does nothing.
  FCL_FIBERS_ALWAYS_INLINE void prefetch(SegmentId id) const {
    __builtin_prefetch(capsule(id));
    __builtin_prefetch(capsule(id) + 1);
  }

 private:
  const geometry::CapsuleEnd* capsules_ = nullptr;
  std::size_t stride_ = 0;
  SegmentId first_ = 0;
  double most_error_ = std::numeric_limits<double>::infinity();
  bool has_boxes_ = true;
  bool may_taper_ = false;
};

}  // namespace fcl_fibers::tree
