// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "scenes/random.h"

namespace fcl_fibers::scenes {

/// The random numbers of one fiber, which depend on seed and fiber alone. The increment is that of
/// Steele, Lea and Flood, Fast Splittable Pseudorandom Number Generators, OOPSLA 2014.
inline Random fiberRandom(std::uint64_t seed, std::size_t fiber) {
  return Random(seed + 0x9e3779b97f4a7c15U * (fiber + 1));
}

}  // namespace fcl_fibers::scenes
