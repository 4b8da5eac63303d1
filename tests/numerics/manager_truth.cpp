// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/manager_truth.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/exact_geometry.h"

namespace fcl_fibers::test {
namespace {

Point real(const Eigen::Vector3d& p) { return p.cast<Real>(); }

/// How often a mesh goes around a point, by the solid angles of its triangles.
double windingNumber(const Eigen::Vector3d& p, const ThingShape& shape, const Instant& mesh) {
  double angle = 0;
  for (const auto& t : shape.triangles) {
    const Eigen::Vector3d a = mesh.points[t[0]] - p, b = mesh.points[t[1]] - p,
                          c = mesh.points[t[2]] - p;
    const double i = a.norm(), j = b.norm(), k = c.norm();
    angle += std::atan2(a.dot(b.cross(c)), i * j * k + a.dot(b) * k + b.dot(c) * i + c.dot(a) * j);
  }
  return angle / (2 * std::acos(-1.0));
}

/// The axis of a capsule to what of another object that does not move along with it.
Real restingDistance(const Instant& capsule, const ThingShape& shape, const Instant& other) {
  const auto local = [&](const Eigen::Vector3d& p) -> Point {
    return other.axes.cast<Real>().transpose() * (real(p) - real(other.points[0]));
  };
  const Point a = local(capsule.points[0]), b = local(capsule.points[1]);
  if (shape.kind == ThingKind::kHalfspace) return std::max(std::min(a[2], b[2]), Real(0));
  const Point half = real(shape.half);
  return segmentBoxDistance(a, b, {-half, half});
}

/// A capsule, and another one or those triangles of a mesh that it may come near.
class MovingPair {
 public:
  MovingPair(const Body& capsule, const Body& other, double near)
      : capsule_(capsule), other_(other) {
    const auto swept = [](const Body& body, std::size_t i) {
      return Eigen::AlignedBox3d(body.start->points[i]).extend(body.end->points[i]);
    };
    const Eigen::AlignedBox3d axis = swept(capsule, 0).merged(swept(capsule, 1));
    std::vector<std::size_t> points = {0, 1};
    if (other.shape->kind == ThingKind::kMesh) {
      points.clear();
      for (const auto& t : other.shape->triangles) {
        const Eigen::AlignedBox3d box =
            swept(other, t[0]).merged(swept(other, t[1])).merged(swept(other, t[2]));
        if (axis.exteriorDistance(box) > near) continue;
        triangles_.push_back(t);
        points.insert(points.end(), t.begin(), t.end());
      }
    }
    const auto way = [](const Body& body, std::size_t i) -> Eigen::Vector3d {
      return body.end->points[i] - body.start->points[i];
    };
    for (const std::size_t i : points) {
      for (std::size_t k = 0; k < 2; ++k) {
        speed_ = std::max(speed_, Real((way(other, i) - way(capsule, k)).norm()));
      }
    }
    speed_ += std::fabs(reachAt(1) - reachAt(0));
  }

  /// Bound on how fast the gap changes, per step.
  Real speed() const { return speed_; }

  /// The distance less radii and margins of the objects; infinite if no triangle is near.
  Real gapAt(Real time) const {
    const Point a = at(capsule_, 0, time), b = at(capsule_, 1, time);
    if (other_.shape->kind == ThingKind::kCapsule) {
      return segmentDistance(a, b, at(other_, 0, time), at(other_, 1, time)) - reachAt(time);
    }
    Real least = std::numeric_limits<Real>::infinity();
    for (const auto& t : triangles_) {
      const ExactTriangle triangle{at(other_, t[0], time), at(other_, t[1], time),
                                   at(other_, t[2], time)};
      least = std::min(least, segmentTriangleDistance(a, b, triangle));
    }
    return least - reachAt(time);
  }

 private:
  static Point at(const Body& body, std::size_t i, Real time) {
    const Point p = real(body.start->points[i]);
    return time == 0 ? p : p + time * (real(body.end->points[i]) - p);
  }
  Real reachAt(Real time) const {
    const auto of = [](const Instant& i) { return Real(i.radius) + i.margin; };
    const Real start = of(*capsule_.start) + of(*other_.start);
    return start + time * (of(*capsule_.end) + of(*other_.end) - start);
  }

  const Body &capsule_, &other_;
  std::vector<std::array<std::size_t, 3>> triangles_;
  Real speed_ = 0;
};

/// Bisects a step from left to right, up to the first time at which the two certainly touch.
class StepSearch {
 public:
  StepSearch(const MovingPair& pair, Real margin, Real tolerance)
      : pair_(pair), margin_(margin), tolerance_(tolerance) {}

  StepVerdict run() {
    StepVerdict verdict;
    const Real last = gap(1);
    look(0, gap(0), 1, last);
    if (!is_touching_ && last <= -tolerance_) touchesAt(1);
    verdict.state = is_touching_         ? StepVerdict::kTouching
                    : std::isinf(first_) ? StepVerdict::kApart
                                         : StepVerdict::kOpen;
    verdict.first = std::min(1.0, static_cast<double>(first_));
    verdict.touch = static_cast<double>(touch_);
    return verdict;
  }

 private:
  // Pairs in contact all the time would need too many parts.
  static constexpr int kMostParts = 1000;

  Real gap(Real time) const { return pair_.gapAt(time) - margin_; }
  void touchesAt(Real time) {
    is_touching_ = true;
    touch_ = time;
    first_ = std::min(first_, time);
  }
  void look(Real from, Real gap_from, Real to, Real gap_to) {
    if (is_touching_) return;
    if (gap_from <= -tolerance_) return touchesAt(from);
    const Real most = pair_.speed() * (to - from);
    if ((gap_from + gap_to - most) / 2 > tolerance_) return;
    if (most <= tolerance_ / 2 || ++parts_ > kMostParts) {
      first_ = std::min(first_, from);
      return;
    }
    const Real middle = (from + to) / 2, gap_middle = gap(middle);
    look(from, gap_from, middle, gap_middle);
    look(middle, gap_middle, to, gap_to);
  }

  const MovingPair& pair_;
  const Real margin_, tolerance_;
  int parts_ = 0;
  bool is_touching_ = false;
  Real first_ = std::numeric_limits<Real>::infinity();
  Real touch_ = 1;
};

StepVerdict verdictOf(Real start, Real end, bool rests, Real tolerance) {
  if (start <= -tolerance) return {StepVerdict::kTouching, 0, 0};
  if (end <= -tolerance) return {StepVerdict::kTouching, 0, 1};
  if (rests && end > tolerance) return {StepVerdict::kApart, 1, 1};
  return {};
}

}  // namespace

bool isJudged(const Body& a, const Body& b) {
  return a.shape->kind == ThingKind::kCapsule || b.shape->kind == ThingKind::kCapsule;
}

StepVerdict judgeStep(const Body& a, const Body& b, double margin, double tolerance) {
  if (a.shape->kind != ThingKind::kCapsule) return judgeStep(b, a, margin, tolerance);
  const auto reach = [](const Body& body) {
    return std::max(body.start->radius + body.start->margin, body.end->radius + body.end->margin);
  };
  const double near = reach(a) + reach(b) + margin + tolerance;
  const bool rests = a.start == a.end && b.start == b.end;
  if (b.shape->kind == ThingKind::kBox || b.shape->kind == ThingKind::kHalfspace) {
    const auto gap = [&](const Instant& capsule, const Instant& other) {
      return restingDistance(capsule, *b.shape, other) - capsule.radius - capsule.margin - margin;
    };
    const Real end = gap(*a.end, *b.end);
    return verdictOf(rests ? end : gap(*a.start, *b.start), end, rests, tolerance);
  }
  const auto swept = [](const Body& body) { return body.start->around.merged(body.end->around); };
  // The filter is wider than the rounding of its sums.
  if (swept(a).exteriorDistance(swept(b)) > near * (1 + 1e-12)) {
    return {StepVerdict::kApart, 1, 1};
  }
  const MovingPair pair(a, b, near * (1 + 1e-12));
  const Real start = pair.gapAt(0) - margin;
  if (b.is_solid && start > -tolerance &&
      windingNumber(a.start->points[0], *b.shape, *b.start) > 0.5) {
    return start > tolerance ? StepVerdict{StepVerdict::kTouching, 0, 0} : StepVerdict{};
  }
  if (rests) return verdictOf(start, start, rests, tolerance);
  return StepSearch(pair, margin, tolerance).run();
}

double distanceAtEnd(const Body& a, const Body& b) {
  if (a.shape->kind != ThingKind::kCapsule) return distanceAtEnd(b, a);
  const auto positive = [](Real x) { return static_cast<double>(std::max(x, Real(0))); };
  const Real radii = Real(a.end->radius) + b.end->radius;
  if (b.shape->kind == ThingKind::kBox || b.shape->kind == ThingKind::kHalfspace) {
    return positive(restingDistance(*a.end, *b.shape, *b.end) - radii);
  }
  if (b.is_solid && windingNumber(a.end->points[0], *b.shape, *b.end) > 0.5) return 0;
  const Body p{a.shape, a.end, a.end, false}, q{b.shape, b.end, b.end, false};
  const MovingPair pair(p, q, std::numeric_limits<double>::infinity());
  return positive(pair.gapAt(0) + a.end->margin + b.end->margin);
}

}  // namespace fcl_fibers::test
