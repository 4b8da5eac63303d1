// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/cone_distance.h"
#include "geometry/double_double.h"
#include "geometry/impact.h"
#include "geometry/squared_distance.h"
#include "geometry/squared_triangle_distance.h"

namespace fcl_fibers::geometry {

/// The axis of a capsule or rounded cone, and the hull of K corners, at one time. Each end of the
/// axis has a radius. If K is 2, the hull is an axis too, and each corner has a radius.
template <int K>
struct Instant {
  Vec3d axis[2], corner[K];
  double radii;             ///< the sum of the radii of the first end and the first corner
  double reach;             ///< the distance at which these two are in reach: radii and margin
  double taper = 0;         ///< by how much both grow from the first end of the axis to the second
  double corner_taper = 0;  ///< and from the first of two corners to the second
};

/// The differences that distances depend on: the axis is from w to w + u, and the corners are 0 and
/// v, relative to the first of them. So a place far from the origin costs no precision.
template <int K>
struct Pose {
  Vec3d w, u, v[K - 1];
  double taper, corner_taper;

  explicit Pose(const Instant<K>& i)
      : w(i.axis[0] - i.corner[0]),
        u(i.axis[1] - i.axis[0]),
        taper(i.taper),
        corner_taper(i.corner_taper) {
    for (int k = 1; k < K; ++k) v[k - 1] = i.corner[k] - i.corner[0];
  }
  Vec3d corner(int k) const { return k == 0 ? Vec3d{0, 0, 0} : v[k - 1]; }
  /// By how much a corner's reach is larger than that of the first.
  double grownAt(int k) const { return K == 2 && k == 1 ? corner_taper : 0; }
  bool isTapered() const { return taper != 0 || corner_taper != 0; }
  /// The sum of the 1-norms, by which rounding is bounded. Of the corners of a box the furthest is
  /// enough.
  double size() const {
    double sum = 0, most = 0;
    for (const Vec3d& x : v) {
      sum += norm1(x);
      most = std::max(most, norm1(x));
    }
    return norm1(w) + norm1(u) + (K > 3 ? most : sum);
  }
  friend Pose operator*(double f, Pose p) {
    p.w = f * p.w, p.u = f * p.u;
    for (Vec3d& x : p.v) x = f * x;
    p.taper *= f, p.corner_taper *= f;
    return p;
  }
  friend Pose operator+(Pose p, const Pose& q) {
    p.w = p.w + q.w, p.u = p.u + q.u;
    for (int k = 0; k < K - 1; ++k) p.v[k] = p.v[k] + q.v[k];
    p.taper += q.taper, p.corner_taper += q.corner_taper;
    return p;
  }
};

/// A bound of the sum of the radii anywhere.
template <int K>
double mostRadii(const Instant<K>& i) {
  return i.radii + (std::fabs(i.taper) + std::fabs(i.corner_taper));
}
template <int K>
double sizeOf(const Instant<K>& start, const Instant<K>& end) {
  return std::max(Pose<K>(start).size(), Pose<K>(end).size()) +
         std::max(mostRadii(start), mostRadii(end));
}

/// Where the distance less the reach is least.
template <int K>
struct Closest {
  double s, weight[K];
  Vec3d apart;  ///< from the point of the hull to that of the axis
  /// By how much the reach there is larger than that of the first end and the first corner.
  double grownIn(const Pose<K>& pose) const {
    return s * pose.taper + (K == 2 ? weight[1] * pose.corner_taper : 0);
  }
};
template <typename T>
Vec3<T> as(const Vec3d& p) {
  return {T(p.x), T(p.y), T(p.z)};
}
inline Vec3d rounded(const Vec3d& p) { return p; }
inline Vec3d rounded(const Vec3<DoubleDouble>& p) {
  return {double(p.x), double(p.y), double(p.z)};
}

/// The axis as a cone. Its radii are what the reach grows by from the first end on.
template <int K>
Segment coneOf(const Pose<K>& pose) {
  return Segment::cone(pose.w, pose.w + pose.u, 0, pose.taper);
}
template <typename T>
Closest<2> closestOf(const Pose<2>& pose) {
  if (pose.isTapered()) {
    const ClosestPoints best =
        closestOfCone(coneOf(pose), Segment::cone({0, 0, 0}, pose.v[0], 0, pose.corner_taper));
    return {best.s, {1 - best.t, best.t}, -1.0 * best.apart};
  }
  const SquaredDistance<T> distance(as<T>(pose.w), as<T>(pose.u), as<T>(pose.v[0]));
  const Certified<T> best = distance.atClosestByProjection();
  const auto t = double(best.t);
  return {double(best.s), {1 - t, t}, rounded(distance.between(best.s, best.t))};
}
template <typename T>
Closest<3> closestOf(const Pose<3>& pose) {
  if (pose.isTapered()) {
    const ClosestOnTriangle best =
        closestOfCone(coneOf(pose), Triangle{{0, 0, 0}, pose.v[0], pose.v[1]});
    return {best.s, {best.weight[0], best.weight[1], best.weight[2]}, -1.0 * best.apart};
  }
  const SquaredTriangleDistance<T> distance(as<T>(pose.w), as<T>(pose.u), as<T>(pose.v[0]),
                                            as<T>(pose.v[1]));
  const CertifiedOnTriangle<T> best = distance.atNearest();
  const auto x = double(best.x), y = double(best.y);
  return {double(best.s), {std::max(1 - x - y, 0.0), x, y}, rounded(distance.between(best))};
}

/// How much too early an arrival may be, as a distance, for a pair of a size. It is 2^16 eps, which
/// is far more than double needs to find a direction that parts the two.
constexpr double toleranceFor(double size) { return 0x1p-36 * size; }

/// The first time x, not negative, at which a + b x + c x^2 falls to 0. It is 0 if a is not
/// positive, and infinity if there is no such time.
inline double firstRoot(double a, double b, double c) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  if (!(a > 0)) return 0;
  if (b >= 0 && c >= 0) return kNever;
  if (c == 0) return a / -b;
  const double discriminant = b * b - 4 * a * c;
  if (discriminant < 0) return kNever;
  const double root = std::sqrt(discriminant);
  return b < 0 ? 2 * a / (root - b) : (b + root) / (-2 * c);
}

/// Conservative advancement of a pair whose size neither overflows nor vanishes. It goes from one
/// time to a later one. At each time it takes a direction along which the two are apart. The gaps
/// along this direction, between each end of the axis and each corner, are polynomials of time,
/// because the direction is fixed or is itself a polynomial of time. The distance of the two is at
/// least the least gap. So they are out of reach until the first of the gaps falls to the reach,
/// and that is the next time. The same holds if each end has a reach of its own.
///
/// The times converge quadratically where the two meet at an angle. Where they graze, a direction
/// that turns with the shapes serves longer.
template <int K>
class Advancement {
 public:
  Advancement(const Instant<K>& start, const Instant<K>& end)
      : start_(start),
        rate_(Pose<K>(end) + -1.0 * start_),
        reach_(start.reach),
        reach_rate_(end.reach - start.reach),
        radii_rate_(end.radii - start.radii),
        is_tapered_(start_.isTapered() || Pose<K>(end).isTapered()),
        tolerance_(toleranceFor(sizeOf(start, end))) {}

  /// If the two are in reach at the start, find() looks from now on for the first time at which
  /// they are nearer than there, by twice the tolerance. Otherwise this changes nothing.
  void requireApproach() {
    const Closest<K> closest = closestOf<double>(start_);
    const double distance = norm(closest.apart) - closest.grownIn(start_);
    if (distance > reach_ + tolerance_ / 2) return;
    reach_ = distance - 2 * tolerance_;
    // A margin far above the size hides how the radii change.
    reach_rate_ = radii_rate_;
  }

  /// @return false if the two are never in reach
  bool find(double from, Arrival<K>& arrival) const {
    double accepted = tolerance_ / 2;
    double time = from;
    for (int round = 0;; ++round) {
      const Pose<K> pose = start_ + time * rate_;
      const double reach = reach_ + time * reach_rate_;
      Closest<K> closest = closestOf<double>(pose);
      double distance = norm(closest.apart);
      double reached = reach + closest.grownIn(pose);
      double step = 0;
      if (distance > reached + accepted && round < kPlainRounds) {
        step = stepAlong(pose, (1 / distance) * closest.apart, time);
      } else if (distance > reached + accepted) {
        const auto turn = static_cast<Turn>(round % 3);
        Direction n = directionAt(pose, closest, distance, turn);
        if (gapAlong(pose, n.n) - reach < (distance - reached) / 2) {
          closest = closestOf<DoubleDouble>(pose);
          distance = norm(closest.apart);
          reached = reach + closest.grownIn(pose);
          n = directionAt(pose, closest, distance, turn);
        }
        step = stepAlong(pose, n.n, time);
        if (step <= 1 - time) step = std::max(step, stepWhileTurning(pose, n, time));
      }
      if (!(distance > reached + accepted)) {
        arrival.time = time;
        arrival.s = closest.s;
        std::copy_n(closest.weight, K, arrival.weight);
        return true;
      }
      if (step > 1 - time) return false;
      time += step;
      if (round >= kRoundsAtFullPrecision) accepted *= 2;
    }
  }

 private:
  /// Most pairs that meet are found by then, and for the others it is a waste of time to turn the
  /// direction before it is known that they are near.
  static constexpr int kPlainRounds = 3;
  /// After that the tolerance doubles each round, so that every search ends.
  static constexpr int kRoundsAtFullPrecision = 4096;

  /// How a direction turns: it stays orthogonal to the ways in which the closest points can move,
  /// or keeps its angle to the ways in which they can hardly move as well, or follows the closest
  /// points. Which one lasts longest depends on the motion, so rounds take them in turn.
  enum class Turn { kWithAll, kWithFree, kWithPoints };

  /// n + rate x + bend x^2 after a time x.
  struct Direction {
    Vec3d n{0, 0, 0}, rate{0, 0, 0}, bend{0, 0, 0};
  };

  /// A way in which points of the shapes can move along them.
  struct Way {
    Vec3d along, rate;
    double grown, grown_rate;  ///< by how much the reach grows along it
  };
  class Freedoms {
   public:
    void add(const Way& way) {
      if (count_ == 2) return;
      const Vec3d& along = way.along;
      Vec3d rest = along;
      if (count_ == 1) rest = rest - (dot(rest, of_[0].rest) / of_[0].squared) * of_[0].rest;
      constexpr double kNoise = 0x1p-44;
      const double squared = squaredNorm(rest);
      if (squared > kNoise * kNoise * squaredNorm(along)) {
        of_[count_++] = {way, rest, squared};
      }
    }
    /// What is to be added to a direction so that no gap along it changes along the freedoms.
    Vec3d straightening(const Vec3d& n) const {
      return correction(n, &Way::along, &Way::grown, {0, 0, 0});
    }
    /// The change per time next to `wanted` that keeps these changes as they are.
    Vec3d turning(const Vec3d& n, const Vec3d& wanted) const {
      return correction(n, &Way::rate, &Way::grown_rate, wanted);
    }
    /// The change of that per time, where the reach does not change faster and faster.
    Vec3d bending(const Vec3d& rate, const Vec3d& wanted) const {
      return correction(rate, &Way::rate, nullptr, wanted);
    }

   private:
    struct Freedom {
      Way way;
      Vec3d rest;  ///< of the way, across the freedom before
      double squared;
    };
    Vec3d correction(const Vec3d& v, Vec3d Way::*of, double Way::*grown, Vec3d sum) const {
      for (int i = 0; i < count_; ++i) {
        const Freedom& f = of_[i];
        const double more = grown != nullptr ? f.way.*grown : 0;
        sum = sum - ((dot(v, f.way.*of) + more + dot(sum, f.way.along)) / f.squared) * f.rest;
      }
      return sum;
    }

    Freedom of_[2];
    int count_ = 0;
  };

  /// The direction from the hull to the axis. Rounding of closest points would show in it if they
  /// are near. So it is made orthogonal to the ways in which they can move, and turns so that it
  /// stays orthogonal. If the reach grows along a way, it leans by as much.
  Direction directionAt(const Pose<K>& pose, const Closest<K>& closest, double distance,
                        Turn turn) const {
    Direction d;
    const bool meet = distance <= tolerance_ / 4;
    if (meet && !is_tapered_) return d;
    if (!meet) d.n = (1 / distance) * closest.apart;
    Freedoms active;
    forEachWay(pose, closest, [&](const Way& way, bool is_free) {
      if (is_free || dot(d.n, way.along) + way.grown > 0) active.add(way);
    });
    const Vec3d lean = is_tapered_ ? active.straightening({0, 0, 0}) : Vec3d{0, 0, 0};
    const double upright = 1 - squaredNorm(lean);
    if (!(upright > 0)) return d;
    // Where the axis meets the hull, a shorter direction is as good.
    if (meet) {
      d.n = lean;
      return d;
    }
    const Vec3d n = d.n + active.straightening(d.n) - lean;
    const double length = norm(n);
    if (!(length > 0.5 * std::sqrt(upright))) return d;
    d.n = (std::sqrt(upright) / length) * n + lean;
    // A direction that turns stays as long if it turns across itself.
    const auto flat = [&d](Way way) {
      way.along = way.along - dot(d.n, way.along) * d.n;
      return way;
    };
    Freedoms turning;
    if (!is_tapered_) {
      turning = active;
    } else {
      forEachWay(pose, closest, [&](const Way& way, bool is_free) {
        if (is_free || dot(closest.apart, way.along) + distance * way.grown > 0) {
          turning.add(flat(way));
        }
      });
    }
    if (turn == Turn::kWithAll) {
      forEachWay(pose, closest, [&](const Way& way, bool) {
        const Way across = flat(way);
        constexpr double kHardly = 0.25;
        const double squared = squaredNorm(way.along);
        if (squared - squaredNorm(across.along) <= kHardly * squared) turning.add(across);
      });
    }
    Vec3d rate{0, 0, 0}, bend{0, 0, 0};
    if (turn == Turn::kWithPoints) {
      const Vec3d apart = velocityOf(closest);
      const double fall = dot(d.n, apart);
      rate = (1 / distance) * (apart - fall * d.n);
      bend = (-fall / distance) * rate;
    }
    d.rate = turning.turning(d.n, rate);
    d.bend = turning.bending(d.rate, bend);
    return d;
  }

  /// The velocity of the closest point of the axis relative to that of the hull.
  Vec3d velocityOf(const Closest<K>& closest) const {
    Vec3d v = rate_.w + closest.s * rate_.u;
    for (int k = 1; k < K; ++k) v = v - closest.weight[k] * rate_.v[k - 1];
    return v;
  }

  /// Calls take(way, is_free) for each way in which a closest point can move: towards the
  /// other ends of the axis and the other corners of the hull. Those of the axis are reversed, so
  /// that each is away from the other shape if it is right.
  template <class Take>
  void forEachWay(const Pose<K>& pose, const Closest<K>& closest, Take&& take) const {
    // Less is rounding of a weight.
    constexpr double kNone = 0x1p-50;
    const auto base =
        static_cast<int>(std::max_element(closest.weight, closest.weight + K) - closest.weight);
    for (int k = 0; k < K; ++k) {
      if (k == base) continue;
      take(Way{pose.corner(k) - pose.corner(base), rate_.corner(k) - rate_.corner(base),
               pose.grownAt(k) - pose.grownAt(base), rate_.grownAt(k) - rate_.grownAt(base)},
           closest.weight[k] > kNone);
    }
    const double sign = closest.s < 0.5 ? -1 : 1;
    take(Way{sign * pose.u, sign * rate_.u, -sign * pose.taper, -sign * rate_.taper},
         closest.s > 0 && closest.s < 1);
  }

  /// By how much all of the axis lies beyond all of the hull, at least, less what the reach grows.
  static double gapAlong(const Pose<K>& pose, const Vec3d& n) {
    double most = 0;
    for (int k = 1; k < K; ++k) most = std::max(most, dot(n, pose.v[k - 1]) + pose.grownAt(k));
    return dot(n, pose.w) + std::min(dot(n, pose.u) - pose.taper, 0.0) - most;
  }

  /// How long each end of the axis is certainly out of reach of each corner, measured along a
  /// direction. Then the two are apart as well, because reaches change evenly in between.
  double stepAlong(const Pose<K>& pose, const Vec3d& n, double time) const {
    const double level = reach_ + time * reach_rate_ + slack();
    const double u = dot(n, pose.u) - pose.taper, u_rate = dot(n, rate_.u) - rate_.taper;
    const double w = dot(n, pose.w) - level, w_rate = dot(n, rate_.w) - reach_rate_;
    double step = std::numeric_limits<double>::infinity();
    for (int k = 0; k < K; ++k) {
      const double a = w - (dot(n, pose.corner(k)) + pose.grownAt(k));
      const double b = w_rate - (dot(n, rate_.corner(k)) + rate_.grownAt(k));
      step = std::min({step, firstRoot(a, b, 0), firstRoot(a + u, b + u_rate, 0)});
    }
    return step;
  }

  /// As stepAlong(), while the direction turns.
  double stepWhileTurning(const Pose<K>& pose, const Direction& d, double time) const {
    struct Cubic {
      double a, b, c, d;
    };
    const auto along = [&d](const Vec3d& x, const Vec3d& rate) -> Cubic {
      return {dot(d.n, x), dot(d.n, rate) + dot(d.rate, x), dot(d.rate, rate) + dot(d.bend, x),
              dot(d.bend, rate)};
    };
    const Cubic w = along(pose.w, rate_.w);
    Cubic u = along(pose.u, rate_.u);
    u.a -= pose.taper, u.b -= rate_.taper;
    Cubic gaps[2 * K];
    for (int k = 0; k < K; ++k) {
      Cubic v = along(pose.corner(k), rate_.corner(k));
      v.a += pose.grownAt(k), v.b += rate_.grownAt(k);
      gaps[2 * k] = {w.a - v.a, w.b - v.b, w.c - v.c, w.d - v.d};
      const Cubic& g = gaps[2 * k];
      gaps[2 * k + 1] = {g.a + u.a, g.b + u.b, g.c + u.c, g.d + u.d};
    }
    const double reach = reach_ + time * reach_rate_;
    const double most =
        std::max({reach + mostGrown(pose), reach_ + reach_rate_ + mostGrown(start_ + rate_), 0.0});
    // The direction is no longer than 1 + (|n + rate x + bend x^2|^2 - 1) / 2. It hardly turns
    // towards itself.
    const double turn = squaredNorm(d.rate), bend = squaredNorm(d.bend);
    if (!std::isfinite(turn + bend)) return 0;
    const double growth = most * std::max(dot(d.n, d.rate), 0.0);
    const auto growthSquared = [&](double h) {
      return most * (turn / 2 + std::fabs(dot(d.n, d.bend)) +
                     h * (std::fabs(dot(d.rate, d.bend)) + h * bend / 2));
    };
    // So that the direction does not grow much.
    const double rest = 1 - time;
    double h = std::min({rest, 1 / std::sqrt(turn), 1 / std::sqrt(std::sqrt(bend))});
    double longest = 0;
    for (int trial = 0; trial < 4; ++trial) {
      double step = std::numeric_limits<double>::infinity();
      const double loss = growthSquared(h);
      for (const Cubic& g : gaps) {
        step = std::min(step, firstRoot(g.a - reach - slack(), g.b - reach_rate_ - growth,
                                        g.c + h * std::min(g.d, 0.0) - loss));
      }
      if (step >= h) return h == rest ? step : h;
      longest = std::max(longest, step);
      h = std::sqrt(h * step);
    }
    return longest;
  }

  static double mostGrown(const Pose<K>& pose) {
    return std::max(pose.taper, 0.0) + std::max(pose.corner_taper, 0.0);
  }

  /// Covers all rounding of a gap, which is 2^7 eps of the size. Differences of points and of radii
  /// and their change carry an error of 3 eps of the size at any time; products with a direction,
  /// which is at most twice as long as 1, 8 eps more; the length of a direction, reach and time 2
  /// eps each. The root of a polynomial is that of one with coefficients that are 4 eps off, so its
  /// value there is below 4 eps of the sum of its terms. These are at most a few sizes, as h is
  /// bounded.
  double slack() const { return 0x1p-9 * tolerance_; }

  Pose<K> start_, rate_;
  double reach_, reach_rate_, radii_rate_;
  bool is_tapered_;
  double tolerance_;
};

/// The first time, not before `from`, at which an axis and a hull are in reach. It returns false if
/// they never are.
/// @param only_nearer  if they are in reach at the start, they have to be nearer by twice the
///                     tolerance
template <int K>
bool findArrival(const Instant<K>& start, const Instant<K>& end, double from, bool only_nearer,
                 Arrival<K>& arrival) {
  const double size = sizeOf(start, end);
  if (size > 0x1p-150 && size < 0x1p150) {
    Advancement<K> advancement(start, end);
    if (only_nearer) advancement.requireApproach();
    return advancement.find(from, arrival);
  }
  double largest = 0;
  for (const Instant<K>* i : {&start, &end}) {
    for (const Vec3d& x : i->axis) largest = std::max(largest, maxNorm(x));
    for (const Vec3d& x : i->corner) largest = std::max(largest, maxNorm(x));
    largest = std::max(largest, mostRadii(*i));
  }
  if (!(size > 0) || !std::isfinite(largest)) {
    arrival = {from, 0, {1}};
    return !(size == 0 && only_nearer);
  }
  const double scale = scaleForSize(size, largest);
  const auto scaled = [scale](Instant<K> i) {
    for (Vec3d& x : i.axis) x = scale * x;
    for (Vec3d& x : i.corner) x = scale * x;
    i.radii *= scale, i.taper *= scale, i.corner_taper *= scale;
    // The scaled reach must not overflow either.
    i.reach = std::min(scale * i.reach, 0x1p150);
    return i;
  };
  return findArrival(scaled(start), scaled(end), from, only_nearer, arrival);
}

}  // namespace fcl_fibers::geometry
