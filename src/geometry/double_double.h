// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

namespace fcl_fibers::geometry {

/// An unevaluated sum of two doubles with about 32 decimal digits: Dekker, A floating-point
/// technique for extending the available precision, 1971. `std::fma` is used only for an exact
/// product, so the bits are the same whether or not the machine has the instruction.
struct DoubleDouble {
  double high = 0;
  double low = 0;

  DoubleDouble() = default;
  DoubleDouble(double value) : high(value) {}  // NOLINT: the conversion is exact
  DoubleDouble(double h, double l) : high(h), low(l) {}

  explicit operator double() const { return high; }
};

/// a + b without error, for any two doubles: Knuth, The Art of Computer Programming 2, section
/// 4.2.2.
inline DoubleDouble exactSum(double a, double b) {
  const double sum = a + b;
  const double b_part = sum - a;
  return {sum, (a - (sum - b_part)) + (b - b_part)};
}

/// a + b without error if |a| >= |b|: Dekker, 1971.
inline DoubleDouble renormalized(double a, double b) {
  const double sum = a + b;
  return {sum, b - (sum - a)};
}

inline DoubleDouble operator+(const DoubleDouble& p, const DoubleDouble& q) {
  const DoubleDouble high = exactSum(p.high, q.high);
  const DoubleDouble low = exactSum(p.low, q.low);
  const DoubleDouble sum = renormalized(high.high, high.low + low.high);
  return renormalized(sum.high, sum.low + low.low);
}

inline DoubleDouble operator-(const DoubleDouble& p) { return {-p.high, -p.low}; }
inline DoubleDouble operator-(const DoubleDouble& p, const DoubleDouble& q) { return p + -q; }

inline DoubleDouble operator*(const DoubleDouble& p, const DoubleDouble& q) {
  const double product = p.high * q.high;
  const double error = std::fma(p.high, q.high, -product);
  return renormalized(product, error + (p.high * q.low + p.low * q.high));
}

inline DoubleDouble operator/(const DoubleDouble& p, const DoubleDouble& q) {
  const double first = p.high / q.high;
  const DoubleDouble rest = p - q * DoubleDouble(first);
  const double second = rest.high / q.high;
  const DoubleDouble rest2 = rest - q * DoubleDouble(second);
  return renormalized(first, second) + DoubleDouble(rest2.high / q.high);
}

/// 0 of a number that is not positive. Newton's method doubles the digits of the double's root.
inline DoubleDouble squareRoot(const DoubleDouble& x) {
  if (!(x.high > 0)) return {};
  const DoubleDouble root = std::sqrt(x.high);
  return root + (x - root * root) / DoubleDouble(2 * root.high);
}
inline double squareRoot(double x) { return x > 0 ? std::sqrt(x) : 0; }

inline bool operator<(const DoubleDouble& p, const DoubleDouble& q) {
  return p.high < q.high || (p.high == q.high && p.low < q.low);
}
inline bool operator>(const DoubleDouble& p, const DoubleDouble& q) { return q < p; }
inline bool operator<=(const DoubleDouble& p, const DoubleDouble& q) {
  return p.high < q.high || (p.high == q.high && p.low <= q.low);
}

}  // namespace fcl_fibers::geometry
