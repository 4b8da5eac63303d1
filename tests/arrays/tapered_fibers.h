// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "arrays/array_fibers.h"
#include "support/exact_geometry.h"
#include "support/random.h"

// Fibers with a radius at each point, so that their segments are rounded cones.
namespace fcl_fibers::test {

/// The ends of a segment and their radii.
struct Cone {
  Point a, b;
  Real at_a, at_b;

  Real thickest() const { return std::max(at_a, at_b); }
  Point at(Real s) const { return (1 - s) * a + s * b; }
  Real radiusAt(Real s) const { return (1 - s) * at_a + s * at_b; }
};

template <typename S>
Cone coneOf(const Assembly<S>& fibers, std::size_t k) {
  const auto point = [&](std::size_t i) {
    const auto p = fibers.point(i);
    return Point(p[0], p[1], p[2]);
  };
  return {point(k), point(k + 1), Real(fibers.radii[k]), Real(fibers.radii[k + 1])};
}

/// Radii that differ from point to point, some of them 0 and some larger than the segment is long.
template <typename S>
Assembly<S> taperedFibers(std::uint64_t seed, int fibers) {
  Assembly<S> assembly = curledFibers<S>(seed, fibers);
  Random random(seed + 500);
  for (S& radius : assembly.radii) {
    const double kinds[] = {0, 0.1, 0.02 * random.unit(), 0.05 * random.unit()};
    radius = static_cast<S>(kinds[random.below(4)]);
  }
  assembly.radii_are = FiberArrays<S>::Radii::kPerPoint;
  return assembly;
}

}  // namespace fcl_fibers::test
