// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <boost/multiprecision/cpp_int.hpp>

#include "geometry/obstacle.h"
#include "geometry/segment.h"

// How far a segment is from a box of any edges, in integers and rational numbers.
namespace fcl_fibers::test {

using Rational = boost::multiprecision::cpp_rational;
using Integer = boost::multiprecision::cpp_int;
using Exact = std::array<Rational, 3>;
using Whole = std::array<Integer, 3>;

template <typename T>
std::array<T, 3> exact(const geometry::Vec3d& v) {
  return {T(v.x), T(v.y), T(v.z)};
}
template <typename T>
std::array<T, 3> sum(const std::array<T, 3>& p, const T& s, const std::array<T, 3>& q) {
  return {T(p[0] + s * q[0]), T(p[1] + s * q[1]), T(p[2] + s * q[2])};
}
template <typename T>
T product(const std::array<T, 3>& p, const std::array<T, 3>& q) {
  return p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
}
inline Whole crossed(const Whole& p, const Whole& q) {
  return {Integer(p[1] * q[2] - p[2] * q[1]), Integer(p[2] * q[0] - p[0] * q[2]),
          Integer(p[0] * q[1] - p[1] * q[0])};
}
inline Integer determinant(const Whole& p, const Whole& q, const Whole& r) {
  return product(p, crossed(q, r));
}

/// The vectors as whole multiples of a unit, of which one is 1 / `units`.
inline std::array<Whole, 5> inUnits(const std::array<Exact, 5>& vectors, Integer& units) {
  units = 1;
  for (const Exact& v : vectors) {
    // Denominators are powers of two.
    for (const Rational& x : v) units = std::max(units, Integer(denominator(x)));
  }
  std::array<Whole, 5> whole;
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t k = 0; k < 3; ++k) whole[i][k] = numerator(Rational(vectors[i][k] * units));
  }
  return whole;
}

/// A least difference of a segment and a box.
struct ExactWay {
  Rational squared;
  Exact apart;  ///< from the segment to the box
};

/// The way between the closest points of a segment and a box. It is the least over all features of
/// both: each of four coefficients is at one of its ends or between them, and those between are
/// where the lines, planes or spaces are closest.
inline ExactWay exactWay(const geometry::Segment& s, const geometry::Obstacle& box) {
  Integer units;
  const std::array<Whole, 5> all =
      inUnits({sum(exact<Rational>(s.a), Rational(-1), exact<Rational>(box.point)),
               exact<Rational>(box.vector[0]), exact<Rational>(box.vector[1]),
               exact<Rational>(box.vector[2]),
               sum(exact<Rational>(s.a), Rational(-1), exact<Rational>(s.b))},
              units);
  ExactWay least{-1, {}};
  for (int choice = 0; choice < 81; ++choice) {
    Whole r = all[0];
    std::vector<Whole> free;
    std::vector<int> low;
    int rest = choice;
    for (std::size_t i = 1; i < 5; ++i, rest /= 3) {
      const int at[2] = {i == 4 ? 0 : -1, 1};
      if (rest % 3 < 2) {
        r = sum(r, Integer(-at[rest % 3]), all[i]);
        continue;
      }
      free.push_back(all[i]);
      low.push_back(at[0]);
    }
    if (free.size() == 4) continue;  // three of them reach as far
    // Cramer's rule.
    Integer divisor = 1;
    std::vector<Integer> x;
    if (free.size() == 1) {
      divisor = product(free[0], free[0]);
      x = {product(free[0], r)};
    } else if (free.size() > 1) {
      const Whole third = free.size() == 3 ? free[2] : crossed(free[0], free[1]);
      divisor = determinant(free[0], free[1], third);
      x = {determinant(r, free[1], third), determinant(free[0], r, third),
           determinant(free[0], free[1], r)};
    }
    if (divisor == 0) continue;  // fewer of them reach as far
    const int sign = divisor < 0 ? -1 : 1;
    Whole apart = sum({0, 0, 0}, divisor, r);
    bool is_inside = true;
    for (std::size_t i = 0; i < free.size(); ++i) {
      is_inside =
          is_inside && sign * x[i] >= low[i] * sign * divisor && sign * x[i] <= sign * divisor;
      apart = sum(apart, Integer(-x[i]), free[i]);
    }
    if (!is_inside) continue;
    const Rational squared(product(apart, apart), Integer(divisor * divisor));
    if (least.squared >= 0 && squared >= least.squared) continue;
    least.squared = squared;
    for (std::size_t k = 0; k < 3; ++k) {
      least.apart[k] = -Rational(apart[k]) / Rational(divisor * units);
    }
  }
  least.squared /= Rational(units * units);
  return least;
}

/// What rounding is relative to: the 1-norms of all differences.
inline double extentOf(const geometry::Segment& s, const geometry::Obstacle& box) {
  double extent = 0;
  for (const geometry::Vec3d& v : {s.a - box.point, s.b - box.point, s.b - s.a, 2.0 * box.vector[0],
                                   2.0 * box.vector[1], 2.0 * box.vector[2]}) {
    extent += std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z);
  }
  return extent;
}

/// A square root rounded to nearest, or nearly, over the whole range of double.
inline double rootOf(const Rational& squared) {
  if (squared == 0) return 0;
  // An even power of two brings the number near one.
  const auto bits = [](const Rational& x) {
    return static_cast<int>(msb(numerator(x))) - static_cast<int>(msb(denominator(x)));
  };
  const int half = bits(squared) / 2;
  const Rational power = boost::multiprecision::cpp_int(1) << (2 * std::abs(half));
  const Rational near_one = half > 0 ? Rational(squared / power) : Rational(squared * power);
  return std::ldexp(std::sqrt(static_cast<double>(near_one)), half);
}

}  // namespace fcl_fibers::test
