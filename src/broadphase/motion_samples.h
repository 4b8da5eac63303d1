// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "broadphase/shape_box.h"
#include "geometry/moving_segment.h"

namespace fcl_fibers::broadphase {

constexpr const char* kNotFinite =
    "its motion has parameters that are NaN or infinite; give it finite ones, and prefer FCL's "
    "constructors that set all of them";

/// A motion is sampled at the ends of at most this many parts, a power of two.
constexpr int kMostParts = 64;

/// The parts of a shape that matter to its bounds: a core, in the shape's own axes, and a thickness
/// that no rotation changes.
struct ShapeCore {
  Corners box;
  double thickness;
  bool is_capsule;
};

template <class Visit>
void forEachCorner(const Corners& box, Visit&& visit) {
  for (const double x : {box.low.x, box.high.x}) {
    for (const double y : {box.low.y, box.high.y}) {
      for (const double z : {box.low.z, box.high.z}) visit(geometry::Vec3d{x, y, z});
    }
  }
}

/// Rotations that have drifted turn a little more than others, and sums are rounded. A matrix R
/// within kMotionTolerance lengthens no vector by more than 1.5e-2 (Gershgorin).
constexpr double kDrift = 1.02;

/// As kRotationTolerance, for poses that FCL's motions compute. They go through a quaternion of the
/// program's matrix, which they do not normalise. By that a deviation becomes up to 5.6 times as
/// large, near half a turn.
constexpr double kMotionTolerance = 1e-2;

/// The boxes of a moving shape at times that are equally far apart.
struct MotionSamples {
  std::array<Corners, kMostParts + 1> boxes;
  int parts = 1;

  /// The box at the start and that at the end whose interpolation contains all, with a slack.
  geometry::MovingSegment bound(const geometry::Vec3d& slack) const {
    const Corners &first = boxes[0], &last = boxes[static_cast<std::size_t>(parts)];
    geometry::Vec3d below{0, 0, 0}, above{0, 0, 0};
    double largest = 0;
    for (int i = 0; i <= parts; ++i) {
      const double t = static_cast<double>(i) / parts;
      const Corners& box = boxes[static_cast<std::size_t>(i)];
      below = max(below, (1 - t) * first.low + t * last.low - box.low);
      above = max(above, box.high - (1 - t) * first.high - t * last.high);
      largest = std::max({largest, maxNorm(box.low), maxNorm(box.high)});
    }
    const double rounding = 16 * std::numeric_limits<double>::epsilon() * largest;
    const geometry::Vec3d outward = slack + geometry::Vec3d{rounding, rounding, rounding};
    below = below + outward;
    above = above + outward;
    return {geometry::Segment::box(first.low - below, first.high + above),
            geometry::Segment::box(last.low - below, last.high + above)};
  }
};

/// Why a bound cannot be used; nullptr if it can.
inline const char* checked(const geometry::MovingSegment& moving) {
  return isFinite(moving.start) && isFinite(moving.end) ? nullptr : kNotFinite;
}

/// Bounds a shape that is unbounded and turns.
inline const char* boundEverywhere(geometry::MovingSegment& moving) {
  moving.start = moving.end = geometry::Segment::everywhere();
  return nullptr;
}

}  // namespace fcl_fibers::broadphase
