// SPDX-License-Identifier: BSD-3-Clause
#include "contenders/narrow_phase.h"

#include <algorithm>

#include <fcl/narrowphase/collision.h>

#include "contenders/closed_form.h"

namespace fcl_fibers::benchmarks {
namespace {

struct Sampler {
  static constexpr std::size_t kBlock = 500;

  std::size_t stride;  ///< in blocks
  PairSample sample = {};

  static bool callback(Object* a, Object* b, void* data) {
    auto& self = *static_cast<Sampler*>(data);
    if (self.sample.of++ / kBlock % self.stride == 0) self.sample.pairs.emplace_back(a, b);
    return false;
  }
};

}  // namespace

PairSample samplePairs(const Manager& manager, std::size_t reported, std::size_t size) {
  // Fewer blocks than these say little of a scene whose parts differ.
  constexpr std::size_t kLeastBlocks = 20;
  const std::size_t blocks = std::max(kLeastBlocks, size / Sampler::kBlock);
  Sampler sampler{std::max<std::size_t>(1, reported / Sampler::kBlock / blocks)};
  manager.collide(&sampler, Sampler::callback);
  return std::move(sampler.sample);
}

NarrowPhase collide(const PairSample& sample) {
  if (sample.pairs.empty()) return {};
  std::size_t touching = 0;
  const double taken = seconds([&] {
    const fcl::CollisionRequestd request;
    for (const auto& [a, b] : sample.pairs) {
      fcl::CollisionResultd result;
      fcl::collide(a, b, request, result);
      if (result.isCollision()) ++touching;
    }
  });
  const double scale = static_cast<double>(sample.of) / static_cast<double>(sample.pairs.size());
  return {scale * taken, scale * static_cast<double>(touching)};
}

template <typename S>
std::size_t countTouching(const BasicManager<S>& manager) {
  std::size_t count = 0;
  manager.collide(&count, [](auto* a, auto* b, void* data) {
    *static_cast<std::size_t*>(data) += capsulesTouch(*a, *b);
    return false;
  });
  return count;
}

template std::size_t countTouching(const BasicManager<float>&);
template std::size_t countTouching(const BasicManager<double>&);

}  // namespace fcl_fibers::benchmarks
