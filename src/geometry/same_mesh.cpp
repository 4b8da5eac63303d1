// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/same_mesh.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/same_mesh.cpp"
#include <hwy/foreach_target.h>

#include <algorithm>
#include <cstdint>

#include "simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// A loop that looks at each answer would wait for it, and one that looks at none would read a mesh
/// to its end that differs at its beginning.
constexpr std::size_t kAtOnce = 256;

using Doubles = hn::CappedTag<double, 4>;
FCL_FIBERS_ALWAYS_INLINE hn::Vec<Doubles> load(const double* numbers) {
  return hn::LoadU(Doubles(), numbers);
}
FCL_FIBERS_ALWAYS_INLINE hn::Vec<Doubles> load(const float* numbers) {
  const Doubles d;
  return hn::PromoteTo(d, hn::LoadU(hn::Rebind<float, Doubles>(), numbers));
}

template <class T>
bool haveNumbers(const MeshPoint* points, const T* numbers, std::size_t count) {
  const Doubles d;
  constexpr int kWidth = static_cast<int>(hn::MaxLanes(d));
  if (count == 0) return true;
  // Four numbers are loaded for a point, and behind the last point there may be none.
  const std::size_t last = count - 1;
  for (std::size_t begin = 0; begin < last; begin += kAtOnce) {
    auto are_same = hn::Eq(hn::Zero(d), hn::Zero(d));
    for (std::size_t i = begin; i < std::min(begin + kAtOnce, last); ++i) {
      for (int k = 0; k < 3; k += kWidth) {
        // Highway's test of what is not equal passes over NaN.
        const auto is_same = hn::Eq(load(numbers + 3 * i + k), hn::Load(d, points[i].numbers + k));
        const auto is_beyond = hn::Not(hn::FirstN(d, static_cast<std::size_t>(3 - k)));
        are_same = hn::And(are_same, hn::Or(is_same, is_beyond));
      }
    }
    if (!hn::AllTrue(d, are_same)) return false;
  }
  const auto isLast = [&](std::size_t k) {
    return static_cast<double>(numbers[3 * last + k]) == points[last].numbers[k];
  };
  return isLast(0) && isLast(1) && isLast(2);
}
bool arePointsOfDoubles(const MeshPoint* points, const double* numbers, std::size_t count) {
  return haveNumbers(points, numbers, count);
}
bool arePointsOfFloats(const MeshPoint* points, const float* numbers, std::size_t count) {
  return haveNumbers(points, numbers, count);
}

bool areTriangles(const TriangleIndices* triangles, const std::size_t* indices, std::size_t count) {
  static_assert(sizeof(TriangleIndices) == 3 * sizeof(std::int32_t));
  const auto* const known = reinterpret_cast<const std::uint32_t*>(triangles);
  const std::size_t numbers = 3 * count;
  std::size_t i = 0;
  if constexpr (sizeof(std::size_t) == sizeof(std::uint64_t)) {
    const hn::CappedTag<std::uint64_t, 8> d;
    const hn::Rebind<std::uint32_t, decltype(d)> narrow;
    const std::size_t width = hn::Lanes(d);
    const auto* const wide = reinterpret_cast<const std::uint64_t*>(indices);
    while (i + width <= numbers) {
      const std::size_t end = std::min(i + 4 * kAtOnce, numbers);
      auto differ = hn::Zero(d);
      for (; i + width <= end; i += width) {
        const auto its = hn::PromoteTo(d, hn::LoadU(narrow, known + i));
        differ = hn::Or(differ, hn::Xor(hn::LoadU(d, wide + i), its));
      }
      if (!hn::AllTrue(d, hn::Eq(differ, hn::Zero(d)))) return false;
    }
  }
  for (; i < numbers; ++i) {
    if (indices[i] != known[i]) return false;
  }
  return true;
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::geometry {

HWY_EXPORT(arePointsOfDoubles);
HWY_EXPORT(arePointsOfFloats);
HWY_EXPORT(areTriangles);

bool arePoints(const MeshPoint* points, const double* numbers, std::size_t count) {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(arePointsOfDoubles)(points, numbers, count);
}
bool arePoints(const MeshPoint* points, const float* numbers, std::size_t count) {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(arePointsOfFloats)(points, numbers, count);
}
bool areTriangles(const TriangleIndices* triangles, const std::size_t* indices, std::size_t count) {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(areTriangles)(triangles, indices, count);
}

}  // namespace fcl_fibers::geometry
#endif
