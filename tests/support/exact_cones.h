// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <boost/multiprecision/cpp_bin_float.hpp>

#include "support/exact_numbers.h"

// The distance of rounded cones, bounded from both sides.
namespace fcl_fibers::test {

/// So many that a distance which is wrong by rounding is far below an ulp of any double.
using Digits100 = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<100>,
                                                boost::multiprecision::et_off>;

/// Two segments, from w to w + u and from 0 to v, and how near they have to be: `reach` at their
/// first ends, which grows by so much along each.
template <typename T>
struct PairOf {
  Vector<T> w, u, v;
  T reach;
  T growth_u = T(0), growth_v = T(0);
};

/// The least over both arc parameters of the distance of two points, less the reach there. Any two
/// points bound it from above. Any unit vector n bounds it from below: the ways of all pairs of
/// points have at least the component along n that the least of the four pairs of ends has, and so
/// has what is left of it beyond the reach. The points that are tried are those where the
/// derivatives vanish, if there are any, and those on the four sides of the square of parameters.
/// So the bounds are right whatever is tried, and they meet if these points are.
template <typename T>
class ConeBounds {
 public:
  explicit ConeBounds(const PairOf<T>& pair) : pair_(pair) {
    tryInside();
    for (const T& end : {T(0), T(1)}) {
      tryAt(end, bestOfSecond(end));
      tryAt(bestOfFirst(end), end);
    }
  }

  const T& low() const { return low_; }
  const T& high() const { return high_; }

  /// Sum of all lengths, by which the rounding of both bounds is bounded.
  T size() const {
    using std::abs;
    T sum = abs(pair_.reach) + abs(pair_.growth_u) + abs(pair_.growth_v);
    for (const Vector<T>* vector : {&pair_.w, &pair_.u, &pair_.v}) {
      for (const T& x : *vector) sum += abs(x);
    }
    return sum;
  }

 private:
  static T lengthOf(const Vector<T>& x) {
    using std::sqrt;
    return sqrt(dot(x, x));
  }
  static T intoUnit(const T& t) { return t > 0 ? (t < 1 ? t : T(1)) : T(0); }

  /// At a minimum inside, the unit vector n between the points has n.u = growth_u and n.v =
  /// -growth_v. That gives its part in the plane of u and v; the rest is across.
  void tryInside() {
    using std::abs;
    using std::sqrt;
    const auto& [w, u, v, reach, growth_u, growth_v] = pair_;
    const Vector<T> normal = cross(u, v);
    const T squared = dot(normal, normal);
    if (!(squared > 0)) return;
    // Each is across one of the two, and its product with the other one is `squared`.
    const Vector<T> of_u = cross(v, normal), of_v = cross(normal, u);
    const Vector<T> flat = T(1 / squared) * (growth_u * of_u - growth_v * of_v);
    const T rest = 1 - dot(flat, flat);
    if (!(rest > 0)) return;
    const T height = dot(w, normal), across = sqrt(rest / squared);
    for (const int side : {1, -1}) {
      if (side * height >= 0) seeDirection(flat + T(side * across) * normal);
    }
    const T distance = abs(height) / (squared * across);
    const Vector<T> way = distance * flat - w;
    const T s = intoUnit(dot(way, of_u) / squared), t = intoUnit(-dot(way, of_v) / squared);
    tryAt(s, t);
    tryAt(bestOfFirst(t), t);
    tryAt(s, bestOfSecond(s));
  }

  T bestOfSecond(const T& s) const { return best(pair_.w + s * pair_.u, pair_.v, pair_.growth_v); }
  T bestOfFirst(const T& t) const { return best(t * pair_.v - pair_.w, pair_.u, pair_.growth_u); }

  /// The place on the segment from 0 to `axis` for a fixed point.
  static T best(const Vector<T>& point, const Vector<T>& axis, const T& growth) {
    using std::sqrt;
    const T squared = dot(axis, axis), rest = squared - growth * growth;
    if (!(rest > 0)) return growth > 0 ? T(1) : T(0);
    const T across = lengthOf(cross(point, axis));
    return intoUnit((dot(point, axis) + growth * across / sqrt(rest)) / squared);
  }

  void tryAt(const T& s, const T& t) {
    const Vector<T> between = pair_.w + s * pair_.u - t * pair_.v;
    const T length = lengthOf(between);
    const T distance = length - (pair_.reach + s * pair_.growth_u + t * pair_.growth_v);
    if (distance < high_) high_ = distance;
    if (length > 0) seeDirection(T(1 / length) * between);
  }
  void seeDirection(const Vector<T>& n) {
    const T along_u = dot(n, pair_.u) - pair_.growth_u, along_v = -dot(n, pair_.v) - pair_.growth_v;
    const T bound = dot(n, pair_.w) - pair_.reach + (along_u < 0 ? along_u : T(0)) +
                    (along_v < 0 ? along_v : T(0));
    if (bound > low_) low_ = bound;
  }

  const PairOf<T> pair_;
  T low_ = -std::numeric_limits<T>::infinity(), high_ = std::numeric_limits<T>::infinity();
};

}  // namespace fcl_fibers::test
