// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/double_double.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "support/random.h"

namespace fcl_fibers::geometry {
namespace {

using test::Random;

__extension__ typedef __int128 Int128;

Int128 magnitude(Int128 x) { return x < 0 ? -x : x; }

/// The integer nearest to a sum of two doubles that is one.
DoubleDouble fromInteger(Int128 value) {
  const auto high = static_cast<double>(value);
  return {high, static_cast<double>(value - static_cast<Int128>(high))};
}
Int128 toInteger(const DoubleDouble& x) {
  return static_cast<Int128>(x.high) + static_cast<Int128>(x.low);
}

/// An integer of up to `bits` bits, small ones as likely as large ones, either sign.
double integerOf(Random& random, int bits) {
  const int used = 1 + static_cast<int>(random.below(static_cast<std::size_t>(bits)));
  const double x = std::floor(std::ldexp(random.unit(), used));
  return random.below(2) == 0 ? x : -x;
}
Int128 longIntegerOf(Random& random, int bits) {
  const auto high = static_cast<Int128>(integerOf(random, 53));
  const auto low = static_cast<Int128>(integerOf(random, bits - 53));
  return high * (Int128{1} << (bits - 53)) + low;
}

bool isNormalized(const DoubleDouble& x) { return x.high + x.low == x.high; }

TEST(ExactSum, LosesNothing) {
  // If this fails, a sum of two doubles drops bits, and nothing built on it is more exact than
  // double.
  Random random(1);
  for (int i = 0; i < 100000; ++i) {
    const double a = std::ldexp(integerOf(random, 53), static_cast<int>(random.below(60)));
    const double b = std::ldexp(integerOf(random, 53), static_cast<int>(random.below(60)));
    const DoubleDouble sum = exactSum(a, b);
    ASSERT_EQ(sum.high, a + b);
    ASSERT_TRUE(toInteger(sum) == static_cast<Int128>(a) + static_cast<Int128>(b)) << a << ' ' << b;
    ASSERT_TRUE(isNormalized(sum)) << a << ' ' << b;
  }
}

TEST(DoubleDouble, ProductOfTwoDoublesIsExact) {
  // If this fails, squared lengths are no more exact than in double.
  Random random(2);
  for (int i = 0; i < 100000; ++i) {
    const double a = integerOf(random, 53), b = integerOf(random, 53);
    const DoubleDouble product = DoubleDouble(a) * DoubleDouble(b);
    ASSERT_EQ(product.high, a * b);
    ASSERT_TRUE(toInteger(product) == static_cast<Int128>(a) * static_cast<Int128>(b))
        << a << ' ' << b;
  }
}

TEST(DoubleDouble, SumCarriesARelativeErrorOf2ToTheMinus103) {
  // If this fails, differences of nearly equal numbers are noise: a determinant, a distance of 0.
  Random random(3);
  for (int i = 0; i < 100000; ++i) {
    const Int128 a = longIntegerOf(random, 106);
    // Every other time nearly the opposite.
    const Int128 b = i % 2 == 0 ? longIntegerOf(random, 106) : -a + longIntegerOf(random, 60);
    const DoubleDouble p = fromInteger(a), q = fromInteger(b);
    const DoubleDouble sum = p + q, difference = p - -q;
    ASSERT_TRUE(isNormalized(sum));
    ASSERT_TRUE(magnitude(toInteger(sum) - (a + b)) <= magnitude(a + b) >> 103);
    ASSERT_EQ(difference.high, sum.high);
    ASSERT_EQ(difference.low, sum.low);
  }
}

TEST(DoubleDouble, ProductCarriesARelativeErrorOf2ToTheMinus100) {
  // If this fails, the low parts take no part in the product.
  Random random(4);
  for (int i = 0; i < 100000; ++i) {
    // 2^56 + k has k as its low part, and the product fits into 127 bits.
    const Int128 one = 1;
    const Int128 a = (one << 56) + static_cast<Int128>(integerOf(random, 3));
    const Int128 b = (one << 60) + static_cast<Int128>(integerOf(random, 7));
    const DoubleDouble product = fromInteger(a) * fromInteger(b);
    ASSERT_TRUE(isNormalized(product));
    ASSERT_TRUE(magnitude(toInteger(product) - a * b) <= (a * b) >> 100);
  }
}

TEST(DoubleDouble, QuotientTimesDivisorGivesTheDividend) {
  // If this fails, closest points carry errors that the certificate then pays for with precision.
  Random random(5);
  for (int i = 0; i < 100000; ++i) {
    const double a = 1 + std::fabs(integerOf(random, 53)), b = 1 + std::fabs(integerOf(random, 53));
    const DoubleDouble quotient = DoubleDouble(a) / DoubleDouble(b);
    ASSERT_TRUE(isNormalized(quotient));
    ASSERT_EQ(quotient.high, a / b);
    // Products of two doubles are exact, see above; so is the first difference, and the others are
    // far smaller.
    const DoubleDouble high = DoubleDouble(quotient.high) * DoubleDouble(b);
    const DoubleDouble low = DoubleDouble(quotient.low) * DoubleDouble(b);
    const double rest = (((a - high.high) - high.low) - low.high) - low.low;
    ASSERT_LE(std::fabs(rest), 0x1p-100 * a) << a << ' ' << b;

    const DoubleDouble divisor(b, std::ldexp(b, -60));
    const DoubleDouble back = DoubleDouble(a) / divisor * divisor - DoubleDouble(a);
    ASSERT_LE(std::fabs(back.high), 0x1p-98 * a) << a << ' ' << b;
  }
}

TEST(DoubleDouble, IsOrderedAsTheNumbersAre) {
  // If this fails, a distance equal to the reach in its first 53 bits is judged by those alone.
  Random random(6);
  for (int i = 0; i < 100000; ++i) {
    const Int128 a = longIntegerOf(random, 106);
    const Int128 b = a + static_cast<Int128>(integerOf(random, i % 3 == 0 ? 2 : 70));
    const DoubleDouble p = fromInteger(a), q = fromInteger(b);
    ASSERT_EQ(p < q, a < b);
    ASSERT_EQ(p > q, a > b);
    ASSERT_EQ(p <= q, a <= b);
  }
}

}  // namespace
}  // namespace fcl_fibers::geometry
