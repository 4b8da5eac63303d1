// SPDX-License-Identifier: BSD-3-Clause
#include "support/touch_oracle.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>

#include "support/exact_cones.h"
#include "support/exact_geometry.h"
#include "support/exact_within.h"

namespace fcl_fibers::test {
namespace {

/// All lengths are doubled, so that half a length needs no fraction.
/// `number` turns a double into a T, `product` two doubles.
template <typename T, class Number, class Product>
PairOf<T> pairOf(const GivenCapsule& p, const GivenCapsule& q, double margin, Number number,
                 Product product) {
  const auto point = [&](const Vector<double>& v) -> Vector<T> {
    return {number(v[0]), number(v[1]), number(v[2])};
  };
  const auto along = [&](const GivenCapsule& c) -> Vector<T> {
    return {product(c.length, c.axis[0]), product(c.length, c.axis[1]),
            product(c.length, c.axis[2])};
  };
  const T two(2);
  const Vector<T> p_along = along(p), q_along = along(q);
  // Differences first, so that a place far from the origin costs no precision.
  return {two * (point(p.a) - point(q.a)) - p_along + q_along,
          two * ((point(p.b) - point(p.a)) + p_along),
          two * ((point(q.b) - point(q.a)) + q_along),
          two * (number(p.radius) + number(q.radius) + number(margin)),
          two * (number(p.radiusAtB()) - number(p.radius)),
          two * (number(q.radiusAtB()) - number(q.radius))};
}

// --- In integers ---

/// The largest power of two of which all lengths of both capsules are multiples.
int commonUnit(const GivenCapsule& p, const GivenCapsule& q, double margin) {
  int unit = std::numeric_limits<int>::max();
  const auto see = [&unit](double x) {
    if (x != 0) unit = std::min(unit, lastBit(x));
  };
  see(margin);
  for (const GivenCapsule* c : {&p, &q}) {
    see(c->radius);
    see(c->radiusAtB());
    for (std::size_t i = 0; i < 3; ++i) {
      see(c->a[i]);
      see(c->b[i]);
      if (c->length != 0 && c->axis[i] != 0) {
        unit = std::min(unit, lastBit(c->length) + lastBit(c->axis[i]));
      }
    }
  }
  return unit == std::numeric_limits<int>::max() ? 0 : unit;
}

// --- In double ---

struct Bounds {
  double low, high;  ///< of the distance of the segments
};

/// The distance of two points bounds it from above. The plane through one of them, across the line
/// to the other, has all of the first segment beyond it by so much at least as the nearer end of
/// each is: that bounds it from below. `size` is the sum of the 1-norms of w, u and v, each of
/// which carries an error of 6 eps of it; so does what is computed of them.
Bounds boundsAt(const PairOf<double>& pair, double s, double t, double size) {
  const auto& [w, u, v, reach, growth_u, growth_v] = pair;
  const Vector<double> r = w + s * u - t * v;
  const double norm = std::sqrt(dot(r, r));
  const double support = dot(r, w) + std::min(dot(r, u), 0.0) - std::max(dot(r, v), 0.0);
  const double error = 32 * kEps * size;
  return {support / norm - error, norm * (1 + 4 * kEps) + error};
}

Bounds distanceBounds(const PairOf<double>& pair, double size) {
  const auto& [w, u, v, reach, growth_u, growth_v] = pair;
  const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  const auto at_first = [&](double s) {
    return boundsAt(pair, s, intoUnit((uv * s + vw) / vv), size);
  };
  const auto at_second = [&](double t) {
    return boundsAt(pair, intoUnit((uv * t - uw) / uu), t, size);
  };
  // The cross product keeps its precision for lines that are nearly parallel.
  const Vector<double> normal = cross(u, v);
  const Vector<double> from_w = cross(v, w);
  const double s = intoUnit(dot(from_w, normal) / dot(normal, normal));
  Bounds bounds{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  const double t = intoUnit((uv * s + vw) / vv);
  for (const Bounds& b :
       {at_second(t), at_first(s), at_first(0), at_first(1), at_second(0), at_second(1)}) {
    // NaN, as of a segment without length, loses every comparison.
    if (b.low > bounds.low) bounds.low = b.low;
    if (b.high < bounds.high) bounds.high = b.high;
  }
  return bounds;
}

double sizeOf(const PairOf<double>& pair) {
  double size = 0;
  for (const Vector<double>& vector : {pair.w, pair.u, pair.v}) {
    for (const double x : vector) size += std::fabs(x);
  }
  return size;
}

PairOf<double> roundedPair(const GivenCapsule& p, const GivenCapsule& q, double margin,
                           double scale) {
  return pairOf<double>(
      p, q, margin, [scale](double x) { return scale * x; },
      [scale](double x, double y) { return scale * x * y; });
}

// --- Cones ---

template <typename T>
ConeBounds<T> coneBounds(const GivenCapsule& p, const GivenCapsule& q, double margin) {
  return ConeBounds<T>(pairOf<T>(
      p, q, margin, [](double x) { return T(x); }, [](double x, double y) { return T(x) * T(y); }));
}

bool conesTouch(const GivenCapsule& p, const GivenCapsule& q, double margin) {
  const ConeBounds<Digits100> bounds = coneBounds<Digits100>(p, q, margin);
  if (bounds.high() <= ldexp(bounds.size(), -200)) return true;
  if (bounds.low() > 0) return false;
  throw std::logic_error("100 digits do not tell whether two cones touch");
}

/// The range of long double holds products of four doubles.
TouchOracle::Verdict judgeCones(const GivenCapsule& p, const GivenCapsule& q, double margin) {
  const ConeBounds<Real> bounds = coneBounds<Real>(p, q, margin);
  const Real error = 64 * std::numeric_limits<Real>::epsilon() * bounds.size();
  const auto excess = static_cast<double>(bounds.high() / 2);
  const double reach =
      std::max(p.radius, p.radiusAtB()) + std::max(q.radius, q.radiusAtB()) + margin;
  if (bounds.high() <= -error) return {true, false, excess, reach};
  if (bounds.low() > error) return {false, false, excess, reach};
  return {conesTouch(p, q, margin), true, excess, reach};
}

}  // namespace

TouchOracle::TouchOracle(std::vector<GivenCapsule> capsules) : capsules_(std::move(capsules)) {
  spheres_.reserve(capsules_.size());
  for (const GivenCapsule& c : capsules_) {
    Vector<double> middle{}, half{};
    double largest = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      middle[i] = c.a[i] / 2 + c.b[i] / 2;
      half[i] = (c.b[i] / 2 - c.a[i] / 2) + c.length / 2 * c.axis[i];
      largest = std::max({largest, std::fabs(c.a[i]), std::fabs(c.b[i])});
    }
    const double half_length = std::hypot(half[0], half[1], half[2]);
    const double radius =
        (half_length + std::max(c.radius, c.radiusAtB())) * (1 + 0x1p-40) + largest * 0x1p-50;
    // What is so small has lost its bits: such capsules are never certainly apart.
    constexpr double kLeast = 0x1p-1000;
    spheres_.push_back({middle[0], middle[1], middle[2], radius + kLeast});
  }
}

TouchOracle::Verdict TouchOracle::judge(const GivenCapsule& p, const GivenCapsule& q,
                                        double margin) {
  if (p.isTapered() || q.isTapered()) return judgeCones(p, q, margin);
  double scale = 1;
  PairOf<double> pair = roundedPair(p, q, margin, scale);
  double size = sizeOf(pair);
  if (!(size > 0x1p-200 && size < 0x1p200) && size > 0) {
    // Where products of four lengths overflow or vanish. The differences keep their precision.
    scale = std::isfinite(size) ? std::ldexp(1.0, std::clamp(-std::ilogb(size), -1000, 1000))
                                : 0x1p-1000;
    pair = roundedPair(p, q, margin, scale);
    size = sizeOf(pair);
  }
  const Bounds bounds = distanceBounds(pair, size);
  const double excess = (bounds.high - pair.reach) / scale / 2, reach = pair.reach / scale / 2;
  const bool in_range = size > 0x1p-200 && size < 0x1p200 && pair.reach < 0x1p400;
  if (in_range && bounds.high <= pair.reach * (1 - 4 * kEps)) return {true, false, excess, reach};
  if (in_range && bounds.low > pair.reach * (1 + 4 * kEps)) return {false, false, excess, reach};
  return {touchExactly(p, q, margin), true, excess, reach};
}

bool TouchOracle::touchExactly(const GivenCapsule& p, const GivenCapsule& q, double margin) {
  if (p.isTapered() || q.isTapered()) return conesTouch(p, q, margin);
  const int unit = commonUnit(p, q, margin);
  const PairOf<Integer> pair = pairOf<Integer>(
      p, q, margin, [unit](double x) { return inUnits(x, unit); },
      [unit](double x, double y) -> Integer {
        if (x == 0 || y == 0) return 0;
        // Each in its own last bit, so that no bit is lost.
        const int of_x = lastBit(x), of_y = lastBit(y);
        return Integer(inUnits(x, of_x) * inUnits(y, of_y)) << (of_x + of_y - unit);
      });
  return segmentsWithin(pair.w, pair.u, pair.v, pair.reach);
}

}  // namespace fcl_fibers::test
