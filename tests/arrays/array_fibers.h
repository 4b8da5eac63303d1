// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "support/touch_oracle.h"

namespace fcl_fibers::test {

using Pairs = std::set<std::pair<std::int32_t, std::int32_t>>;

/// Arrays and their owner.
template <typename S>
struct Assembly {
  std::vector<S> points;
  std::vector<std::size_t> point_begin = {0};
  std::vector<S> radii;
  typename FiberArrays<S>::Radii radii_are = FiberArrays<S>::Radii::kPerSegment;

  FiberArrays<S> view() const {
    return {points.data(),          points.size() / 3, point_begin.data(),
            point_begin.size() - 1, radii.data(),      radii_are};
  }
  std::array<double, 3> point(std::size_t i) const {
    return {points[3 * i], points[3 * i + 1], points[3 * i + 2]};
  }
  double radius(std::size_t i) const {
    using Radii = typename FiberArrays<S>::Radii;
    const auto fiber = std::upper_bound(point_begin.begin(), point_begin.end(), i) - 1;
    return radii[radii_are == Radii::kOne ? 0
                 : radii_are == Radii::kPerFiber
                     ? static_cast<std::size_t>(fiber - point_begin.begin())
                     : i];
  }
  bool startsCapsule(std::size_t i) const {
    return i + 1 < points.size() / 3 &&
           !std::binary_search(point_begin.begin(), point_begin.end(), i + 1);
  }
};

/// Curled fibers of 1 to 40 points about one place, thick ones among them; some have no point.
template <typename S>
Assembly<S> curledFibers(unsigned seed, int fibers = 30) {
  std::mt19937 random(seed);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0 - 0.5; };
  Assembly<S> assembly;
  for (int f = 0; f < fibers; ++f) {
    double p[3] = {uniform(), uniform(), uniform()};
    const auto count = f % 7 == 3 ? 0 : 1 + random() % 40;
    for (std::size_t i = 0; i < count; ++i) {
      for (double& coordinate : p) {
        assembly.points.push_back(static_cast<S>(coordinate));
        coordinate += 0.2 * uniform();
      }
      assembly.radii.push_back(static_cast<S>(f % 5 == 0 ? 0.05 : 0.005));
    }
    assembly.point_begin.push_back(assembly.points.size() / 3);
  }
  return assembly;
}

/// Touching pairs, those of neighbours up to `ignored` apart left out.
template <typename S>
Pairs touchingPairs(const Assembly<S>& a, const Assembly<S>& b, int ignored, double margin) {
  const bool same = &a == &b;
  Pairs pairs;
  for (std::size_t i = 0; i < a.points.size() / 3; ++i) {
    for (std::size_t j = same ? i + 1 : 0; j < b.points.size() / 3; ++j) {
      if (!a.startsCapsule(i) || !b.startsCapsule(j)) continue;
      const auto last = std::upper_bound(a.point_begin.begin(), a.point_begin.end(), i);
      if (same && j < *last && j - i <= static_cast<std::size_t>(ignored)) continue;
      const GivenCapsule p{a.point(i), a.point(i + 1), a.radius(i)};
      const GivenCapsule q{b.point(j), b.point(j + 1), b.radius(j)};
      if (!TouchOracle::judge(p, q, margin).touching) continue;
      pairs.emplace(static_cast<std::int32_t>(i), static_cast<std::int32_t>(j));
    }
  }
  return pairs;
}

inline FiberTreeOptions optionsOf(FiberTreeOptions::Volumes volumes, Topology topology,
                                  Report report) {
  FiberTreeOptions options;
  options.volumes = volumes;
  options.topology = topology;
  options.report = report;
  return options;
}

inline std::vector<FiberTreeOptions> allKinds(Report report) {
  using Volumes = FiberTreeOptions::Volumes;
  std::vector<FiberTreeOptions> kinds;
  for (const auto volumes : {Volumes::kLayeredBoxes, Volumes::kWrappedSpheres}) {
    for (const auto topology : {Topology::kBundle, Topology::kSuperThread}) {
      kinds.push_back(optionsOf(volumes, topology, report));
    }
  }
  return kinds;
}

}  // namespace fcl_fibers::test
