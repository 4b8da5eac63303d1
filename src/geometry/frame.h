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

/// The frame in which a scene is kept: q = scale (p - origin). With the origin among the segments,
/// float bounds are tight wherever in the world the scene is; with a scale that puts its size
/// between the ends of float's range, squares of lengths neither overflow nor vanish.
struct Frame {
  Vec3d origin{0, 0, 0};
  double scale = 1;  ///< a power of two, so that scaling is exact

  Vec3d fromWorld(const Vec3d& p) const { return scale * (p - origin); }
};

/// A frame for segments of which these are a sample, whose order is changed: its origin is their
/// median, so that bounds are tightest where most segments are, whatever lies far out.
Frame frameFor(Segment* samples, std::size_t count);

/// Takes segments and volumes of one frame into another, rounding outward. Between frames of sizes
/// or places so different that coordinates overflow, volumes become unbounded.
class FrameChange {
 public:
  /// Volumes grow by `growth`, a length in the frame `to`; negative shrinks them.
  FrameChange(const Frame& from, const Frame& to, double growth = 0)
      : scale_(std::min(to.scale / from.scale, std::numeric_limits<double>::max())),
        shift_(to.fromWorld(from.origin)),
        growth_(growth) {}

  /// Lengths of `to` per length of `from`; finite.
  double scale() const { return scale_; }

  /// Not finite where coordinates overflow.
  Segment operator()(const Segment& s) const {
    return {scale_ * s.a + shift_, scale_ * s.b + shift_, scale_ * s.radius};
  }

  /// How far the result may lie from an exact change of frame. The shift carries one rounding and
  /// so does each of the two operations, all of numbers no larger than shift and result together.
  double error(const Segment& result) const {
    return endPointError(result) + 8 * kEps * maxNorm(shift_);
  }

  Box operator()(const Box& box) const {
    Box result;
    const double shift[3] = {shift_.x, shift_.y, shift_.z};
    for (int axis = 0; axis < 3; ++axis) {
      // The roundings above, as lengths: float's outward step covers those relative to the result.
      const double padding = growth_ + 4 * kEps * std::fabs(shift[axis]);
      const double low = scale_ * double{box.low[axis]} + shift[axis] - padding;
      const double high = scale_ * double{box.high[axis]} + shift[axis] + padding;
      // NaN is what an infinite shift leaves.
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

/// The change that changes nothing.
struct SameFrame {
  double scale() const { return 1; }
  template <class Volume>
  FCL_FIBERS_ALWAYS_INLINE const Volume& operator()(const Volume& volume) const {
    return volume;
  }
};

}  // namespace fcl_fibers::geometry
