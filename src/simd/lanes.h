// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace fcl_fibers::simd {

/// One bit per lane.
using LaneMask = std::uint32_t;

constexpr LaneMask firstLanes(int count) { return (LaneMask{1} << count) - 1; }

/// The numbers of the lanes of each mask over N lanes, the lowest first.
template <int N>
struct LanesOfMask {
  std::uint8_t lane[1u << N][N];

  constexpr LanesOfMask() : lane() {
    for (LaneMask mask = 0; mask < 1u << N; ++mask) {
      int count = 0;
      for (int i = 0; i < N; ++i) {
        if ((mask >> i & 1u) != 0) lane[mask][count++] = static_cast<std::uint8_t>(i);
      }
    }
  }
};
template <int N>
inline constexpr LanesOfMask<N> kLanesOfMask{};

}  // namespace fcl_fibers::simd
