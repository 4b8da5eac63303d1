// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>

#include "geometry/frame.h"
#include "geometry/obstacle.h"

namespace fcl_fibers::broadphase {

/// Takes segments from one frame into another. Boxes grow by the rounding; if they overflow, they
/// become open to all sides.
class FrameOfOther {
 public:
  FrameOfOther(const geometry::Frame& from, const geometry::Frame& to) : change_(from, to) {}

  geometry::Segment operator()(const geometry::Segment& segment) const {
    const geometry::Segment moved = change_(segment);
    if (!segment.isBox()) return moved;
    // An open side stays open.
    geometry::Segment box = boxAround(moved, change_.error(moved));
    const bool is_number = box.a.x <= box.b.x && box.a.y <= box.b.y && box.a.z <= box.b.z;
    if (!is_number || (isBounded(segment) && !isBounded(box)))
      box = geometry::Segment::everywhere();
    box.radius = segment.radius;
    return box;
  }
  /// The same for a segment that is kept: a capsule grows, too, and if it overflows it may be
  /// anywhere.
  geometry::Segment grown(const geometry::Segment& segment) const {
    geometry::Segment moved = (*this)(segment);
    if (moved.isBox()) return moved;
    moved.radius += change_.error(moved);
    return isFinite(moved) ? moved : geometry::Segment::everywhere();
  }
  /// Of an obstacle that overflows nothing is known.
  geometry::Obstacle operator()(const geometry::Obstacle& obstacle) const {
    using Kind = geometry::Obstacle::Kind;
    if (change_.isIdentity() || obstacle.kind == Kind::kNone) return obstacle;
    const auto at = [this](const geometry::Vec3d& p) { return change_({p, p, 0}).a; };
    const bool has_normal = obstacle.kind == Kind::kPlane || obstacle.kind == Kind::kHalfspace;
    geometry::Obstacle moved = obstacle;
    moved.point = at(obstacle.point);
    geometry::Segment around{moved.point, moved.point, 0};
    for (int i = 0; i < 3 && !has_normal; ++i) {
      const bool is_corner = obstacle.kind == Kind::kTriangle;
      moved.vector[i] = is_corner ? at(obstacle.vector[i]) : scale() * obstacle.vector[i];
      around.b = max(abs(around.b), abs(moved.vector[i]));
    }
    moved.offset *= scale();
    moved.margin *= scale();
    // The smallest normal number covers the loss if lengths vanish.
    moved.error =
        scale() * obstacle.error + change_.error(around) + 8 * std::numeric_limits<double>::min();
    const double sum = maxNorm(around.a) + maxNorm(around.b) + moved.offset + moved.margin;
    return std::isfinite(sum + moved.error) ? moved : geometry::Obstacle();
  }
  double error(const geometry::Segment& moved) const { return change_.error(moved); }
  double scale() const { return change_.scale(); }
  bool isIdentity() const { return change_.isIdentity(); }

 private:
  geometry::FrameChange change_;
};

}  // namespace fcl_fibers::broadphase
