// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "contenders/contender.h"

namespace fcl_fibers::benchmarks {

/// A self-collision query with fcl::collide on its pairs.
struct NarrowPhase {
  double seconds = 0;  ///< together with fcl::collide on each pair
  std::size_t pairs = 0;
  std::size_t sampled = 0;  ///< those that fcl::collide was called on
  double touching = 0;      ///< estimated by these
};

/// The stride for about so many pairs out of `reported`.
std::size_t narrowPhaseStride(std::size_t reported, std::size_t pairs);

/// Calls fcl::collide on one block of pairs out of `stride`, and scales its time to all pairs.
/// Blocks, for the objects of pairs that follow each other are in the cache.
NarrowPhase collideSample(const Manager& manager, std::size_t stride);

}  // namespace fcl_fibers::benchmarks
