// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include <boost/multiprecision/cpp_int.hpp>

// What the exact oracles share.
namespace fcl_fibers::test {

using Integer = boost::multiprecision::cpp_int;
constexpr double kEps = std::numeric_limits<double>::epsilon();

template <typename T>
using Vector = std::array<T, 3>;

template <typename T>
Vector<T> operator+(const Vector<T>& p, const Vector<T>& q) {
  return {T(p[0] + q[0]), T(p[1] + q[1]), T(p[2] + q[2])};
}
template <typename T>
Vector<T> operator-(const Vector<T>& p, const Vector<T>& q) {
  return {T(p[0] - q[0]), T(p[1] - q[1]), T(p[2] - q[2])};
}
template <typename T>
Vector<T> operator*(const T& s, const Vector<T>& p) {
  return {T(s * p[0]), T(s * p[1]), T(s * p[2])};
}
template <typename T>
T dot(const Vector<T>& p, const Vector<T>& q) {
  return p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
}
template <typename T>
Vector<T> cross(const Vector<T>& p, const Vector<T>& q) {
  return {T(p[1] * q[2] - p[2] * q[1]), T(p[2] * q[0] - p[0] * q[2]), T(p[0] * q[1] - p[1] * q[0])};
}

/// The exponent of the last bit of a double that is not 0.
inline int lastBit(double x) {
  int exponent = 0;
  const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(x, &exponent), 53));
  return exponent - 53 + __builtin_ctzll(static_cast<unsigned long long>(mantissa));
}

/// @pre x is a multiple of 2^unit
inline Integer inUnits(double x, int unit) {
  int exponent = 0;
  const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(x, &exponent), 53));
  const int shift = exponent - 53 - unit;
  // A negative shift drops zeros only.
  return shift >= 0 ? Integer(Integer(mantissa) << shift) : Integer(Integer(mantissa) >> -shift);
}

inline double intoUnit(double t) { return t > 0 ? std::min(t, 1.0) : 0; }

}  // namespace fcl_fibers::test
