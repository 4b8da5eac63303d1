// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace fcl_fibers::fibers {

/// The fiber that owns `id`, of `count` fibers whose runs of ids follow each other in [0, end).
/// Fiber f starts at begin[f]. The first guess is right if all fibers have about the same length,
/// and is off by a few if a few have another, as objects beside fibers do. It is worthwhile because
/// queries look up millions of neighbours, and a binary search mispredicts at every step.
/// @pre 0 <= id < end
template <typename Id>
std::size_t fiberOf(const Id* begin, std::size_t count, Id end, Id id) {
  auto guess = static_cast<std::size_t>(static_cast<std::uint64_t>(id) * count /
                                        static_cast<std::uint64_t>(end));
  constexpr int kSteps = 4;
  for (int step = 0; step < kSteps; ++step) {
    if (begin[guess] > id) {
      --guess;
    } else if (guess + 1 < count && begin[guess + 1] <= id) {
      ++guess;
    } else {
      return guess;
    }
  }
  return static_cast<std::size_t>(std::upper_bound(begin, begin + count, id) - begin - 1);
}

}  // namespace fcl_fibers::fibers
