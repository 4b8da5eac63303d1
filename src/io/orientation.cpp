// SPDX-License-Identifier: BSD-3-Clause
#include "io/orientation.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace fcl_fibers::io {
namespace {

/// A sum of products of doubles without error, in digits of base 2^32. The first digit counts
/// 2^-2306, below the last bit of any product, and each may be off by carries.
class ExactSum {
 public:
  void addProduct(double x, double y, int sign) {
    const Digits a(x), b(y);
    if ((x < 0) != (y < 0)) sign = -sign;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint64_t product = a.digits[i] * b.digits[k];
        std::int64_t* const to = &digits_[a.first + b.first + i + k];
        to[0] += sign * static_cast<std::int64_t>(product & kLow);
        to[1] += sign * static_cast<std::int64_t>(product >> 32);
      }
    }
  }

  int sign() const {
    std::int64_t carry = 0;
    bool is_zero = true;
    for (const std::int64_t digit : digits_) {
      const std::int64_t value = digit + carry;
      const auto low = static_cast<std::int64_t>(static_cast<std::uint64_t>(value) & kLow);
      is_zero = is_zero && low == 0;
      carry = (value - low) / (std::int64_t{1} << 32);
    }
    return carry < 0 ? -1 : carry > 0 || !is_zero ? 1 : 0;
  }

 private:
  static constexpr std::uint64_t kLow = 0xFFFFFFFF;

  /// The 53 bits of a double, shifted to where digits begin.
  struct Digits {
    explicit Digits(double x) {
      int exponent = 0;
      const double fraction = std::frexp(std::fabs(x), &exponent);
      const auto mantissa = static_cast<std::uint64_t>(std::ldexp(fraction, 53));
      const auto place = static_cast<unsigned>(exponent + 1100);  // from 27 to 2124
      const unsigned shift = place % 32;
      first = place / 32;
      digits[0] = mantissa << shift & kLow;
      digits[1] = mantissa << shift >> 32;
      digits[2] = shift == 0 ? 0 : mantissa >> (64 - shift);
    }
    std::size_t first;
    std::uint64_t digits[3];
  };

  std::int64_t digits_[140] = {};
};

int signOf(double x) { return (x > 0) - (x < 0); }

}  // namespace

int areaSign(const std::vector<PlanePoint>& polygon) {
  ExactSum area;
  for (std::size_t i = 0, last = polygon.size() - 1; i < polygon.size(); last = i++) {
    area.addProduct(polygon[last][0], polygon[i][1], 1);
    area.addProduct(polygon[last][1], polygon[i][0], -1);
  }
  return area.sign();
}

int orientation(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c, double tolerance) {
  const double bx = b[0] - a[0], by = b[1] - a[1], cx = c[0] - a[0], cy = c[1] - a[1];
  if (tolerance > 0) {
    const double longest =
        std::max({std::hypot(bx, by), std::hypot(cx, cy), std::hypot(cx - bx, cy - by)});
    if (std::fabs(bx * (cy / longest) - by * (cx / longest)) <= tolerance) return 0;
  }
  // Signs of differences are right, however small or large these are.
  const int left_sign = signOf(bx) * signOf(cy), right_sign = signOf(by) * signOf(cx);
  if (left_sign * right_sign <= 0) return (left_sign > right_sign) - (left_sign < right_sign);
  const double left = bx * cy, right = by * cx;
  const double rounding =
      8 * std::numeric_limits<double>::epsilon() * (std::fabs(left) + std::fabs(right)) +
      std::numeric_limits<double>::min();
  // After an overflow this is false.
  if (std::fabs(left - right) > rounding) return signOf(left - right);
  return areaSign({a, b, c});
}

}  // namespace fcl_fibers::io
