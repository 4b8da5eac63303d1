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
    if (!isBounded(moved)) return anywhere();
    const double error = change_.error(moved);
    const geometry::Vec3d outward{error, error, error};
    return geometry::Segment::box(moved.a - outward, moved.b + outward);
  }
  /// The same for a segment that is kept: a capsule grows, too, and if it overflows it may be
  /// anywhere.
  geometry::Segment grown(const geometry::Segment& segment) const {
    geometry::Segment moved = (*this)(segment);
    if (moved.isBox()) return moved;
    moved.radius += change_.error(moved);
    return isBounded(moved) && std::isfinite(moved.radius) ? moved : anywhere();
  }
  double error(const geometry::Segment& moved) const { return change_.error(moved); }
  double scale() const { return change_.scale(); }
  bool isIdentity() const { return change_.isIdentity(); }

 private:
  static geometry::Segment anywhere() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr geometry::Vec3d kFar{kInfinity, kInfinity, kInfinity};
    return geometry::Segment::box(-1.0 * kFar, kFar);
  }

  geometry::FrameChange change_;
};

}  // namespace fcl_fibers::broadphase
