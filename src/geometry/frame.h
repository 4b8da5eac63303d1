// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <fcl_fibers/tree_export.h>

#include "geometry/box.h"
#include "geometry/moving_box.h"
#include "geometry/segment.h"
#include "geometry/sphere.h"

namespace fcl_fibers::geometry {

/// The frame in which an index keeps its segments: q = scale (p - origin). Its origin is among the
/// segments, so float bounds are tight wherever the segments are. Its scale puts their extent in
/// the middle of float's range, so squares of lengths neither overflow nor vanish.
struct Frame {
  Vec3d origin{0, 0, 0};
  double scale = 1;  ///< a power of two, so that scaling is exact

  Vec3d fromWorld(const Vec3d& p) const { return scale * (p - origin); }
  Segment fromWorld(const Segment& s) const {
    return {fromWorld(s.a), fromWorld(s.b), s.isBox() ? s.radius : scale * s.radius,
            scale * s.taper};
  }
};

inline bool operator==(const Frame& p, const Frame& q) {
  return p.origin == q.origin && p.scale == q.scale;
}

/// Whether squares of the coordinates fit float, which makes volumes tight, or the segment is
/// unbounded.
inline bool isInFloatRange(const Segment& segment) {
  const double size = std::max(maxNorm(segment.a), maxNorm(segment.b)) + segment.thickness();
  return size <= 0x1p62 || !isBounded(segment);
}

/// Returns a frame for segments of which `samples` are a sample, and changes the order of these.
/// Its origin is near their median. So bounds are tightest where most segments are, even if some
/// are far out.
Frame frameFor(Segment* samples, std::size_t count);

/// Takes segments and volumes from one frame into another, rounding outward. If coordinates
/// overflow because sizes or places of the frames differ too much, volumes become unbounded.
class FrameChange {
 public:
  /// @param growth  length in the frame `to` by which volumes grow; they shrink if it is negative
  FrameChange(const Frame& from, const Frame& to, double growth = 0)
      : scale_(std::min(to.scale / from.scale, std::numeric_limits<double>::max())),
        shift_(to.fromWorld(from.origin)),
        growth_(growth) {
    setShift();
  }

  /// A change that scales, moves and does not turn.
  FrameChange(double scale, const Vec3d& shift, double growth)
      : scale_(scale), shift_(shift), growth_(growth) {
    setShift();
  }

  /// Whether it changes nothing, as between managers whose scenes have about the same place and
  /// size.
  bool isIdentity() const { return scale_ == 1 && growth_ == 0 && shift_ == Vec3d{0, 0, 0}; }

  /// The length in `to` of a unit of `from`; finite.
  double scale() const { return scale_; }
  /// Where the origin of `from` is in `to`.
  const Vec3d& shift() const { return shift_; }

  /// The result is not finite if coordinates overflow.
  Segment operator()(const Segment& s) const {
    return {scale_ * s.a + shift_, scale_ * s.b + shift_, s.isBox() ? s.radius : scale_ * s.radius,
            scale_ * s.taper};
  }

  /// Bounds how far the result lies from an exact change of frame. The shift and each of the two
  /// operations carry one rounding, of numbers no larger than shift and result together.
  double error(const Segment& result) const {
    return endPointError(result) + 8 * kEps * maxNorm(shift_);
  }

  /// What grows by error().
  enum class Grows { kNothing, kBoxes, kAll };
  /// The same for a segment that may overflow. A box becomes open to all sides then, and so does a
  /// capsule that was to grow.
  FCL_FIBERS_TREE_EXPORT Segment around(const Segment& segment, Grows grows) const;

  FCL_FIBERS_ALWAYS_INLINE Box operator()(const Box& box) const {
    // A high side is the low side of the mirrored box, so all six take the same steps, several at
    // once. An infinite shift leaves NaN, which no comparison holds for.
    const double sides[8] = {box.low[0],   box.low[1],   box.low[2], -box.high[0],
                             -box.high[1], -box.high[2], 0,          0};
    float low[8];
    for (int i = 0; i < 8; ++i) {
      const double side = scale_ * sides[i] + low_shift_[i];
      low[i] = roundedDown(side > double{-kInfinity} ? side : double{-kInfinity});
    }
    return {{low[0], low[1], low[2]}, {-low[3], -low[4], -low[5]}};
  }

  FCL_FIBERS_ALWAYS_INLINE MovingBox operator()(const MovingBox& box) const {
    return {(*this)(box.start), (*this)(box.end)};
  }

  Sphere operator()(const Sphere& sphere) const {
    const Vec3d center{sphere.center[0], sphere.center[1], sphere.center[2]};
    const Vec3d moved = scale_ * center + shift_;
    if (!std::isfinite(maxNorm(moved) + maxNorm(shift_))) return {{0, 0, 0}, kInfinity};
    const double padding = growth_ + 16 * kEps * (maxNorm(shift_) + maxNorm(moved));
    const double radius = scale_ * double{sphere.radius} + padding;
    // A sphere that has become infinite by its padding stays so, whatever the growth.
    if (std::isinf(sphere.radius)) return Sphere::unbounded();
    // If it shrinks, the radius may be negative. The other sphere of a pair has the rest then.
    return Sphere::around(Ball{moved, radius});
  }

  /// The same for the volume of a leaf.
  template <class Volume>
  FCL_FIBERS_ALWAYS_INLINE Volume ofLeaf(std::int32_t /*segment*/, const Volume& volume) const {
    return (*this)(volume);
  }
  void prefetchLeaf(std::int32_t /*segment*/) const {}

 private:
  void setShift() {
    const double shift[3] = {shift_.x, shift_.y, shift_.z};
    for (int axis = 0; axis < 3; ++axis) {
      // The roundings of error(), as lengths. The outward step of float covers those relative to
      // the result.
      const double padding = growth_ + 8 * kEps * std::fabs(shift[axis]);
      low_shift_[axis] = shift[axis] - padding;
      low_shift_[3 + axis] = -shift[axis] - padding;
    }
  }

  static constexpr double kEps = std::numeric_limits<double>::epsilon();
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  double scale_;
  Vec3d shift_;
  double growth_;
  double low_shift_[8] = {};  ///< of the low sides, then of the mirrored high sides
};

/// The volume around a segment of another frame. A segment whose coordinates have overflowed may be
/// anywhere.
template <class Volume>
Volume volumeAround(const Segment& segment, double padding) {
  const bool is_somewhere = segment.isBox() || isBounded(segment);
  return is_somewhere ? Volume::around(segment, padding) : Volume::unbounded();
}

/// The identity change of frame.
struct SameFrame {
  double scale() const { return 1; }
  template <class Volume>
  FCL_FIBERS_ALWAYS_INLINE const Volume& operator()(const Volume& volume) const {
    return volume;
  }
  template <class Volume>
  FCL_FIBERS_ALWAYS_INLINE const Volume& ofLeaf(std::int32_t /*segment*/,
                                                const Volume& volume) const {
    return volume;
  }
  void prefetchLeaf(std::int32_t /*segment*/) const {}
};

}  // namespace fcl_fibers::geometry
