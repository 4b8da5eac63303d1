// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/point_boxes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "support/random.h"
#include "support/scoped_target.h"

namespace fcl_fibers::geometry {
namespace {

using test::Random;

template <typename T>
class PointBoxesTest : public testing::Test {};
using Scalars = testing::Types<float, double>;
struct ScalarNames {
  template <typename T>
  static std::string GetName(int /*i*/) {
    return std::is_same_v<T, float> ? "Float" : "Double";
  }
};
TYPED_TEST_SUITE(PointBoxesTest, Scalars, ScalarNames);

template <typename T>
std::vector<T> randomPoints(Random& random, std::size_t count) {
  std::vector<T> points(3 * count);
  for (T& x : points) x = static_cast<T>(random.between(-1, 1));
  return points;
}

AffineMap randomMap(Random& random) {
  AffineMap map;
  for (Vec3d& column : map.column) {
    column = {random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)};
  }
  return map;
}

// A vertex that is left out, as one of those that fill no vector of lanes, would leave its box.
TYPED_TEST(PointBoxesTest, AreThoseOfEachPoint) {
  for (const std::int64_t target : simd::availableTargets()) {
    SCOPED_TRACE(simd::targetName(target));
    const simd::ScopedTarget scoped(target);
    Random random(1101);
    for (std::size_t count = 1; count < 70; ++count) {
      const std::vector<TypeParam> points = randomPoints<TypeParam>(random, count);
      const AffineMap map = randomMap(random);
      const PointBoxes boxes = boxesOf(points.data(), count, map);
      const auto at = [&points](std::size_t i) {
        return Vec3d{double(points[3 * i]), double(points[3 * i + 1]), double(points[3 * i + 2])};
      };
      PointBoxes expected{at(0), at(0), map.linear(at(0)), map.linear(at(0)), true};
      for (std::size_t i = 0; i < count; ++i) {
        const Vec3d p = at(i), q = map.linear(p);
        expected.low = min(expected.low, p);
        expected.high = max(expected.high, p);
        expected.posed_low = min(expected.posed_low, q);
        expected.posed_high = max(expected.posed_high, q);
      }
      EXPECT_TRUE(boxes.is_proper);
      ASSERT_TRUE(boxes.low == expected.low && boxes.high == expected.high) << count;
      ASSERT_TRUE(boxes.posed_low == expected.posed_low && boxes.posed_high == expected.posed_high)
          << count;
    }
  }
}

// A vertex that is no number would be taken, and its object would be found by nothing. One that is
// large would be refused.
TYPED_TEST(PointBoxesTest, AreProperIfAllNumbersAreFinite) {
  using Limits = std::numeric_limits<TypeParam>;
  for (const std::int64_t target : simd::availableTargets()) {
    SCOPED_TRACE(simd::targetName(target));
    const simd::ScopedTarget scoped(target);
    Random random(1102);
    EXPECT_FALSE(boxesOf(static_cast<const TypeParam*>(nullptr), 0, {}).is_proper);
    for (std::size_t count = 1; count < 20; ++count) {
      for (std::size_t i = 0; i < 3 * count; ++i) {
        for (const TypeParam bad : {Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity()}) {
          std::vector<TypeParam> points = randomPoints<TypeParam>(random, count);
          points[i] = bad;
          ASSERT_FALSE(boxesOf(points.data(), count, {}).is_proper) << count << ", " << i;
          ASSERT_FALSE(boxesOf(points.data(), count, randomMap(random)).is_proper) << count;
        }
      }
      std::vector<TypeParam> large(3 * count, Limits::max());
      large[0] = -Limits::max();
      const AffineMap doubles{{{-2, 0, 0}, {2, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
      EXPECT_TRUE(boxesOf(large.data(), count, doubles).is_proper) << count;
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::geometry
