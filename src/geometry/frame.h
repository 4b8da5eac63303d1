// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "geometry/box.h"
#include "geometry/segment.h"
#include "geometry/sphere.h"

namespace fcl_fibers::geometry {

/// The frame in which an index keeps its segments: q = scale (p - origin). Its origin is among the
/// segments, so float bounds are tight wherever in the world they are. Its scale puts their extent
/// between the ends of float's range, so squares of lengths neither overflow nor vanish.
struct Frame {
  Vec3d origin{0, 0, 0};
  double scale = 1;  ///< a power of two, so that scaling is exact

  Vec3d fromWorld(const Vec3d& p) const { return scale * (p - origin); }
};

/// Whether squares of the coordinates fit float, so that volumes are tight, or the segment is
/// unbounded.
inline bool isInFloatRange(const Segment& segment) {
  const double size = std::max(maxNorm(segment.a), maxNorm(segment.b)) + segment.thickness();
  return size <= 0x1p62 || !isBounded(segment);
}

/// A frame for segments of which `samples` are a sample, whose order is changed. Its origin is
/// their median, so bounds are tightest where most segments are, whatever lies far out.
Frame frameFor(Segment* samples, std::size_t count);

/// Takes segments and volumes from one frame into another, rounding outward. If coordinates
/// overflow because sizes or places of the frames differ too much, volumes become unbounded.
class FrameChange {
 public:
  /// @param growth  length in the frame `to` by which volumes grow; they shrink if it is negative
  FrameChange(const Frame& from, const Frame& to, double growth = 0)
      : scale_(std::min(to.scale / from.scale, std::numeric_limits<double>::max())),
        shift_(to.fromWorld(from.origin)),
        growth_(growth) {}

  /// The length in `to` of a unit of `from`; finite.
  double scale() const { return scale_; }

  /// The result is not finite if coordinates overflow.
  Segment operator()(const Segment& s) const {
    return {scale_ * s.a + shift_, scale_ * s.b + shift_, scale_ * s.radius};
  }

  /// Bounds how far the result lies from an exact change of frame. The shift and each of the two
  /// operations carry one rounding, of numbers no larger than shift and result together.
  double error(const Segment& result) const {
    return endPointError(result) + 8 * kEps * maxNorm(shift_);
  }

  Box operator()(const Box& box) const {
    Box result;
    const double shift[3] = {shift_.x, shift_.y, shift_.z};
    for (int axis = 0; axis < 3; ++axis) {
      // The roundings of error(), as lengths. The outward step of float covers those relative to
      // the result.
      const double padding = growth_ + 4 * kEps * std::fabs(shift[axis]);
      const double low = scale_ * double{box.low[axis]} + shift[axis] - padding;
      const double high = scale_ * double{box.high[axis]} + shift[axis] + padding;
      // An infinite shift leaves NaN.
      result.low[axis] = std::isnan(low) ? -kInfinity : roundedDown(low);
      result.high[axis] = std::isnan(high) ? kInfinity : roundedUp(high);
    }
    return result;
  }

  Sphere operator()(const Sphere& sphere) const {
    const Vec3d center{sphere.center[0], sphere.center[1], sphere.center[2]};
    const Vec3d moved = scale_ * center + shift_;
    if (!std::isfinite(maxNorm(moved) + maxNorm(shift_))) return {{0, 0, 0}, kInfinity};
    const double padding = growth_ + 16 * kEps * (maxNorm(shift_) + maxNorm(moved));
    const double radius = scale_ * double{sphere.radius} + padding;
    return Sphere::around(Ball{moved, radius > 0 ? radius : 0});
  }

 private:
  static constexpr double kEps = std::numeric_limits<double>::epsilon();
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  double scale_;
  Vec3d shift_;
  double growth_;
};

/// The identity change of frame.
struct SameFrame {
  double scale() const { return 1; }
  template <class Volume>
  FCL_FIBERS_ALWAYS_INLINE const Volume& operator()(const Volume& volume) const {
    return volume;
  }
};

}  // namespace fcl_fibers::geometry
