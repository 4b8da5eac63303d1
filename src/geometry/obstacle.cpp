// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/obstacle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "geometry/cone_distance.h"
#include "geometry/double_double.h"
#include "geometry/least_distance.h"
#include "geometry/obstacle_impact.h"
#include "geometry/polytope_distance.h"
#include "geometry/polytope_vertices.h"
#include "geometry/touch.h"
#include "geometry/triangle_distance.h"

namespace fcl_fibers::geometry {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// The vectors w + sum of x_i c_i, each x_i from -1 to 1, which are twice the differences between
/// the points of a segment and those of a box. The squared length is a convex function of x, so any
/// x bounds its minimum from both sides, as in segment_distance.cpp. The search is an active-set
/// method (Nocedal and Wright, Numerical Optimization, 2006, section 16.5).
template <typename T>
class Differences {
 public:
  static constexpr int kCount = 4;
  /// More than enough for four variables, each of which has two bounds.
  static constexpr int kMostSteps = 24;

  /// @param size  see sizeOf()
  Differences(const Segment& segment, const Obstacle& box, double size)
      : w_(difference<T>(segment.a, box.point) + difference<T>(segment.b, box.point)),
        negligible_(kNegligible * size * size) {
    for (int i = 0; i < 3; ++i) c_[i] = difference<T>(box.vector[i], -1.0 * box.vector[i]);
    c_[3] = difference<T>(segment.b, segment.a);
  }

  /// Starts near the least vector, or at it if the box is rectangular and the segment does not
  /// change the face that it is closest to.
  void start() {
    Vec3<T> r = w_;
    for (int round = 0; round < 2; ++round) {
      for (int i = 0; i < kCount; ++i) {
        const T squared = significant(squaredNorm(c_[i]));
        const T before = x_[i];
        x_[i] = clamped(before - quotientOrZero(dot(c_[i], r), squared));
        r = r + (x_[i] - before) * c_[i];
      }
    }
    begin();
  }
  /// Starts where a search in less precision has ended.
  void startAt(const Differences<double>& other) {
    for (int i = 0; i < kCount; ++i) x_[i] = T(other.x(i));
    begin();
  }

  /// The squared length at x, and how much it may exceed the least one.
  const T& squared() const { return squared_; }
  const T& gap() const { return gap_; }
  double x(int i) const { return double(x_[i]); }
  Vec3d vector() const { return {double(r_.x), double(r_.y), double(r_.z)}; }

  /// Goes on until no more than this is left to gain, as far as rounding shows.
  void finish(const T& gain) {
    for (int step = 0; step < kMostSteps && gap_ > gain && descend(); ++step) continue;
  }

  /// Whether rounding hardly moves the least vector: whether those c_i are far from dependent whose
  /// x_i are between their bounds, or may be.
  /// @param rounding  bounds the error of the vector
  bool isSteady(double rounding) const {
    constexpr double kLeastSine = 0x1p-8;  // squared
    Vec3<T> q[kCount];
    for (int i = 0; i < kCount; ++i) {
      const T squared = squaredNorm(c_[i]);
      q[i] = {T(0), T(0), T(0)};
      const T rise = x_[i] < T(0) ? slope_[i] : -slope_[i];
      const bool is_held = distanceFromZero(x_[i]) == T(1) && rise > T(0) &&
                           rise * rise > T(rounding * rounding) * squared;
      if (is_held) continue;
      q[i] = c_[i];
      for (int k = 0; k < i; ++k) {
        q[i] = q[i] - quotientOrZero(dot(q[k], q[i]), squaredNorm(q[k])) * q[k];
      }
      if (squaredNorm(q[i]) < T(kLeastSine) * squared) return false;
    }
    return true;
  }

  /// Moves to the least vector over the free x_i, or to the first bound on the way there.
  /// @return whether that may not be the least vector over all x_i
  bool descend() {
    T move[kCount];
    leastOverFree(move);
    T step(1);
    int stopped = -1;
    for (int i = 0; i < kCount; ++i) {
      const T room = (move[i] > T(0) ? T(1) : T(-1)) - x_[i];
      if (distanceFromZero(step * move[i]) > distanceFromZero(room)) {
        step = room / move[i];
        stopped = i;
      }
    }
    for (int i = 0; i < kCount; ++i) x_[i] = clamped(x_[i] + step * move[i]);
    if (stopped >= 0) {
      x_[stopped] = move[stopped] > T(0) ? T(1) : T(-1);
      is_free_[stopped] = false;
    }
    measure();
    return stopped >= 0 || freeSteepest();
  }

 private:
  static T clamped(const T& x) { return x < T(-1) ? T(-1) : x > T(1) ? T(1) : x; }
  static T distanceFromZero(const T& x) { return x < T(0) ? -x : x; }
  /// What is left of a vector after rounding, squared and as a part of the size. A vector that is
  /// no longer moves nothing by more than that.
  static constexpr double kNegligible = std::is_same_v<T, double> ? 0x1p-104 : 0x1p-200;
  T significant(const T& squared) const { return squared > T(negligible_) ? squared : T(0); }

  void begin() {
    for (int i = 0; i < kCount; ++i) is_free_[i] = distanceFromZero(x_[i]) < T(1);
    measure();
  }
  void measure() {
    Vec3<T> r = w_;
    for (int i = 0; i < kCount; ++i) r = r + x_[i] * c_[i];
    r_ = r;
    squared_ = squaredNorm(r);
    gap_ = T(0);
    for (int i = 0; i < kCount; ++i) {
      slope_[i] = dot(c_[i], r);
      gap_ = gap_ + T(2) * (distanceFromZero(slope_[i]) + slope_[i] * x_[i]);
    }
  }

  /// The move of the free x_i that makes r least, by Gram and Schmidt's orthogonalization. Vectors
  /// that depend on those before them do not move.
  void leastOverFree(T (&move)[kCount]) const {
    Vec3<T> q[kCount], rest = r_;
    T squared[kCount], share[kCount][kCount];
    for (int i = 0; i < kCount; ++i) {
      q[i] = c_[i];
      for (int k = 0; k < i; ++k) {
        share[k][i] = quotientOrZero(dot(q[k], q[i]), squared[k]);
        q[i] = q[i] - share[k][i] * q[k];
      }
      squared[i] = is_free_[i] ? significant(squaredNorm(q[i])) : T(0);
      move[i] = -quotientOrZero(dot(q[i], rest), squared[i]);
      rest = rest + move[i] * q[i];
    }
    for (int i = kCount - 1; i >= 0; --i) {
      for (int k = i + 1; k < kCount; ++k) move[i] = move[i] - share[i][k] * move[k];
    }
  }

  /// Frees the x_i at a bound along which r falls most steeply away from that bound.
  /// @return whether there is one
  bool freeSteepest() {
    int steepest = -1;
    T most(0);
    for (int i = 0; i < kCount; ++i) {
      const T fall = x_[i] < T(0) ? -slope_[i] : slope_[i];
      if (is_free_[i] || !(fall > most)) continue;
      steepest = i;
      most = fall;
    }
    if (steepest < 0) return false;
    is_free_[steepest] = true;
    return true;
  }

  Vec3<T> w_, c_[kCount];
  T x_[kCount] = {};
  bool is_free_[kCount] = {};
  double negligible_;
  Vec3<T> r_;
  T slope_[kCount], squared_, gap_;
};

enum class Verdict { kWithin, kApart, kOpen };

/// @param rounding  bounds the rounding of `squared - gap`
template <typename T>
Verdict decide(Differences<T>& differences, double reach, const T& rounding) {
  const T limit = T(reach) * T(reach);
  for (int step = 0; step < differences.kMostSteps; ++step) {
    const T &squared = differences.squared(), &gap = differences.gap();
    if (squared <= limit) return Verdict::kWithin;
    if (squared - gap - rounding > limit) return Verdict::kApart;
    if (gap <= rounding) break;
    differences.descend();
  }
  return Verdict::kOpen;
}

/// The sum of 1-norms of all differences, by which rounding is bounded.
double sizeOf(const Segment& segment, const Obstacle& box) {
  return norm1(segment.a - box.point) + norm1(segment.b - box.point) +
         norm1(segment.b - segment.a) +
         2 * (norm1(box.vector[0]) + norm1(box.vector[1]) + norm1(box.vector[2]));
}

/// Bounds the rounding of `squared - gap` in double. The vector r carries an error of 4 eps m, its
/// square 10 eps m^2, and all slopes together 14 eps m^2.
double roundingFor(double m) { return 128 * kEps * m * m; }

/// Whether products of four lengths of such a size neither overflow nor vanish.
bool isWellScaled(double m) { return m > 0x1p-200 && m < 0x1p200; }

bool wellScaledBoxWithin(const Segment& segment, const Obstacle& box, double size, double reach) {
  // DoubleDouble rounds to 2^-104, double to 2^-52.
  const double rounding = roundingFor(size);
  Differences<double> rough(segment, box, size);
  rough.start();
  const Verdict verdict = decide(rough, 2 * reach, rounding);
  if (verdict != Verdict::kOpen) return verdict == Verdict::kWithin;
  Differences<DoubleDouble> fine(segment, box, size);
  fine.startAt(rough);
  return decide(fine, 2 * reach, DoubleDouble(0x1p-52 * rounding)) != Verdict::kApart;
}

double scaleFor(const Segment& segment, const Obstacle& box, double size) {
  const auto& [x, y, z] = box.vector;
  return scaleForSize(size, std::max({maxNorm(segment.a), maxNorm(segment.b), maxNorm(box.point),
                                      maxNorm(x), maxNorm(y), maxNorm(z)}));
}

bool boxWithin(const Segment& segment, const Obstacle& box, double reach) {
  const double size = sizeOf(segment, box);
  if (isWellScaled(size)) return wellScaledBoxWithin(segment, box, size, reach);
  if (size == 0 || !std::isfinite(size)) return true;  // one point, or beyond all bounds
  const double scale = scaleFor(segment, box, size);
  // The scaled reach must not overflow either.
  return boxWithin(scaled(segment, scale), scaled(box, scale), std::min(scale * reach, 0x1p200));
}

/// Whether a half-space, or else a plane, is that near.
bool planeWithin(const Segment& segment, const Obstacle& plane, double reach, bool is_halfspace) {
  const Vec3d a = segment.a - plane.point, b = segment.b - plane.point;
  const double at_a = dot(plane.vector[0], a) - plane.offset,
               at_b = dot(plane.vector[0], b) - plane.offset;
  // By how much the balls at the ends are smaller than the reach has it.
  const double less_a = segment.radius - segment.radiusAtA(),
               less_b = segment.radius - segment.radiusAtB();
  // 16 eps are due to the normal, the others to products and sums.
  const double rounding =
      24 * kEps * (norm1(a) + norm1(b) + std::fabs(plane.offset) + std::fabs(segment.taper));
  const double most = reach + rounding;
  const bool is_above = std::min(at_a + less_a, at_b + less_b) > most,
             is_below = std::max(at_a - less_a, at_b - less_b) < -most;
  return !is_above && (is_halfspace || !is_below);
}

}  // namespace

ClosestOnBox closestPoints(const Segment& capsule, const Obstacle& box) {
  if (capsule.isTapered()) return closestOfCone(capsule, box);
  const double size = sizeOf(capsule, box);
  if (size == 0) return {0, {0, 0, 0}, {0, 0, 0}};
  if (!isWellScaled(size)) {
    const double scale = scaleFor(capsule, box, size);
    ClosestOnBox closest = closestPoints(scaled(capsule, scale), scaled(box, scale));
    closest.apart = (1 / scale) * closest.apart;
    return closest;
  }
  const auto closestOf = [&](const auto& differences) -> ClosestOnBox {
    const auto& d = differences;
    return {capsule.a == capsule.b ? 0 : 0.5 + 0.5 * d.x(3),
            {-d.x(0), -d.x(1), -d.x(2)},
            -0.5 * d.vector()};
  };
  Differences<double> rough(capsule, box, size);
  rough.start();
  rough.finish(0);
  // Closer points need more digits, or rounding would show in the direction, unless that is lost in
  // the rounding of coordinates.
  constexpr double kNear = 0x1p-20;
  const double distance = std::sqrt(rough.squared());
  const bool is_far = distance > kNear * size && rough.gap() <= 16 * kEps * size * distance;
  if (distance <= 0.5 * kEps * size || (is_far && rough.isSteady(8 * kEps * size))) {
    return closestOf(rough);
  }
  Differences<DoubleDouble> fine(capsule, box, size);
  fine.startAt(rough);
  // The length of what is gained bounds how far the vector moves.
  fine.finish(DoubleDouble(0x1p-104 * size * size));
  return closestOf(fine);
}

Obstacle scaled(const Obstacle& obstacle, double scale) {
  Obstacle scaled = obstacle;
  scaled.point = scale * obstacle.point;
  for (Vec3d& vector : scaled.vector) vector = scale * vector;
  return scaled;
}

Vec3d reachOfVectors(const Obstacle& obstacle) {
  const bool is_polytope = obstacle.kind == Obstacle::Kind::kPolytope;
  const Vec3d most = is_polytope ? obstacle.vertices->largest() : Vec3d{1, 1, 1};
  return most.x * abs(obstacle.vector[0]) + most.y * abs(obstacle.vector[1]) +
         most.z * abs(obstacle.vector[2]);
}

bool touch(const Segment& capsule, const Obstacle& obstacle, double margin, double error) {
  const double near = margin + obstacle.margin, errors = error + obstacle.error;
  const double reach = (capsule.radius + near) * (1 + 4 * kEps) + errors;
  const Vec3d(&v)[3] = obstacle.vector;
  switch (obstacle.kind) {
    case Obstacle::Kind::kBox:
      return capsule.isTapered() ? coneWithin(capsule, obstacle, near, errors)
                                 : boxWithin(capsule, obstacle, reach);
    case Obstacle::Kind::kHalfspace:
    case Obstacle::Kind::kPlane:
      return planeWithin(capsule, obstacle, reach, obstacle.kind == Obstacle::Kind::kHalfspace);
    case Obstacle::Kind::kTriangle:
      return touch(capsule, Triangle{v[0], v[1], v[2]}, near, errors);
    case Obstacle::Kind::kAxis: {
      Segment axis = obstacle.capsule();
      axis.radius = 0;
      return touch(capsule, axis, near, errors);
    }
    case Obstacle::Kind::kPolytope:
      return capsule.isTapered() ? coneWithin(capsule, obstacle, near, errors)
                                 : polytopeWithin(capsule, obstacle, reach);
    case Obstacle::Kind::kNone:
      break;
  }
  return true;
}

bool mayReach(const Box& box, const Obstacle& obstacle, const Vec3d& way, double margin,
              double error) {
  const bool is_halfspace = obstacle.kind == Obstacle::Kind::kHalfspace;
  if (!is_halfspace && obstacle.kind != Obstacle::Kind::kPlane) return true;
  const Vec3d& n = obstacle.vector[0];
  const Vec3d low = Vec3d{box.low[0], box.low[1], box.low[2]} - obstacle.point,
              high = Vec3d{box.high[0], box.high[1], box.high[2]} - obstacle.point;
  // The lowest and highest corner along the normal. At the start the obstacle is back by `way`.
  double lowest = -obstacle.offset, highest = -obstacle.offset;
  for (const auto axis : kAxes) {
    const double p = n.*axis * low.*axis, q = n.*axis * high.*axis;
    lowest += std::min(p, q);
    highest += std::max(p, q);
  }
  const double turned_way = dot(n, way);
  lowest += std::min(turned_way, 0.0);
  highest += std::max(turned_way, 0.0);
  const double rounding =
      24 * kEps *
      (norm1(low) + norm1(high) + norm1(way) + norm1(obstacle.point) + std::fabs(obstacle.offset));
  const double most = margin + obstacle.margin + error + obstacle.error + rounding;
  // NaN fails both comparisons.
  return !(lowest > most) && (is_halfspace || !(highest < -most));
}

bool touch(const MovingSegment& capsule, const Obstacle& obstacle, double margin, double error) {
  if (rests(capsule)) return touch(capsule.end, obstacle, margin, error);
  Impact impact;
  return findImpact(capsule, obstacle, margin, error, /*only_nearer=*/false, impact);
}

Obstacle inFrame(const FrameChange& change, const Obstacle& obstacle) {
  using Kind = Obstacle::Kind;
  if (change.isIdentity() || obstacle.kind == Kind::kNone) return obstacle;
  const auto at = [&](const Vec3d& p) { return change({p, p, 0}).a; };
  const double scale = change.scale();
  const bool has_normal = obstacle.kind == Kind::kPlane || obstacle.kind == Kind::kHalfspace;
  Obstacle moved = obstacle;
  moved.point = at(obstacle.point);
  Segment around{moved.point, moved.point, 0};
  const bool is_polytope = obstacle.kind == Kind::kPolytope;
  for (int i = 0; i < 3 && !has_normal; ++i) {
    const bool is_corner = obstacle.kind == Kind::kTriangle;
    moved.vector[i] = is_corner ? at(obstacle.vector[i]) : scale * obstacle.vector[i];
    around.b = max(abs(around.b), abs(moved.vector[i]));
  }
  if (is_polytope) around.b = reachOfVectors(moved);
  moved.offset *= scale;
  moved.margin *= scale;
  // The smallest normal number covers the loss if lengths vanish.
  moved.error =
      scale * obstacle.error + change.error(around) + 8 * std::numeric_limits<double>::min();
  const double sum = maxNorm(around.a) + maxNorm(around.b) + moved.offset + moved.margin;
  return std::isfinite(sum + moved.error) ? moved : Obstacle();
}

}  // namespace fcl_fibers::geometry
