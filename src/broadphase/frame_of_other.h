// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "geometry/frame.h"

namespace fcl_fibers::broadphase {

/// Takes segments from one frame into another. Boxes grow by the rounding; if they overflow, they
/// become open to all sides.
class FrameOfOther {
 public:
  FrameOfOther(const geometry::Frame& from, const geometry::Frame& to) : change_(from, to) {}

  geometry::Segment operator()(const geometry::Segment& segment) const {
    const geometry::Segment moved = change_(segment);
    if (!segment.isBox()) return moved;
    if (!isBounded(segment)) return moved;  // an open side stays open
    return isBounded(moved) ? boxAround(moved, change_.error(moved))
                            : geometry::Segment::everywhere();
  }
  /// The same for a segment that is kept: a capsule grows, too, and if it overflows it may be
  /// anywhere.
  geometry::Segment grown(const geometry::Segment& segment) const {
    geometry::Segment moved = (*this)(segment);
    if (moved.isBox()) return moved;
    moved.radius += change_.error(moved);
    return isFinite(moved) ? moved : geometry::Segment::everywhere();
  }
  double error(const geometry::Segment& moved) const { return change_.error(moved); }
  double scale() const { return change_.scale(); }
  bool isIdentity() const { return change_.isIdentity(); }

 private:
  geometry::FrameChange change_;
};

}  // namespace fcl_fibers::broadphase
