// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <vector>

#include "geometry/same_mesh.h"
#include "support/random.h"
#include "support/scoped_target.h"

namespace fcl_fibers::geometry {
namespace {

using simd::ScopedTarget;
using test::Random;

constexpr std::size_t kCounts[] = {0, 1, 2, 3, 5, 8, 17, 255, 256, 257, 700};

/// Expects that `isSame()` notices that any of these numbers is another one.
template <class T, class IsSame, class Change>
void expectNoticed(std::vector<T>& numbers, const IsSame& isSame, const Change& change) {
  EXPECT_TRUE(isSame()) << numbers.size() << " numbers";
  for (T& number : numbers) {
    const T before = number;
    number = change(before);
    EXPECT_FALSE(isSame()) << "number " << &number - numbers.data() << " of " << numbers.size();
    number = before;
  }
}

template <class T>
void expectPointsNoticed(Random& random) {
  for (const std::size_t count : kCounts) {
    std::vector<T> numbers(3 * count);
    std::vector<MeshPoint> points(count);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      numbers[i] = static_cast<T>(random.between(-1, 1));
      points[i / 3].numbers[i % 3] = double{numbers[i]};
    }
    const auto isSame = [&] { return arePoints(points.data(), numbers.data(), count); };
    expectNoticed(numbers, isSame, [](T x) { return x + std::numeric_limits<T>::epsilon(); });
    expectNoticed(numbers, isSame, [](T) { return std::numeric_limits<T>::quiet_NaN(); });
  }
}

// A mesh that a program deforms in place would stay as it was.
TEST(SameMesh, AnyPointThatMovesIsNoticed) {
  for (const auto target : simd::availableTargets()) {
    const ScopedTarget scoped(target);
    Random random(1);
    expectPointsNoticed<double>(random);
    expectPointsNoticed<float>(random);
  }
}

// A triangle that a program replaces would stay, or an index beyond 32 bits would be taken for one
// that is in range.
TEST(SameMesh, AnyIndexThatChangesIsNoticed) {
  for (const auto target : simd::availableTargets()) {
    const ScopedTarget scoped(target);
    Random random(2);
    for (const std::size_t count : kCounts) {
      std::vector<std::size_t> indices(3 * count);
      for (std::size_t& index : indices) index = random.below(std::size_t{1} << 27);
      std::vector<TriangleIndices> triangles(count);
      for (std::size_t i = 0; i < count; ++i) {
        const auto at = [&](std::size_t k) {
          return static_cast<std::int32_t>(indices[3 * i + k]);
        };
        triangles[i] = {at(0), at(1), at(2)};
      }
      const auto isSame = [&] { return areTriangles(triangles.data(), indices.data(), count); };
      expectNoticed(indices, isSame, [](std::size_t x) { return x + 1; });
      expectNoticed(indices, isSame, [](std::size_t x) { return x + (std::size_t{1} << 32); });
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::geometry
