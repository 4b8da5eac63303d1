// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace fcl_fibers::tree {

/// Of `count` fibers that share out [0, end) in order, fiber f from begin[f] on, the one that owns
/// `id`. Where fibers are of like length the first guess is right: neighbours are asked for by the
/// million, and a binary search mispredicts at every step.
/// @pre 0 <= id < end
template <typename Id>
std::size_t fiberOf(const Id* begin, std::size_t count, Id end, Id id) {
  const auto guess = static_cast<std::size_t>(static_cast<std::uint64_t>(id) * count /
                                              static_cast<std::uint64_t>(end));
  if (begin[guess] <= id && (guess + 1 == count || id < begin[guess + 1])) return guess;
  return static_cast<std::size_t>(std::upper_bound(begin, begin + count, id) - begin - 1);
}

}  // namespace fcl_fibers::tree
