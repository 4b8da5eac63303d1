// SPDX-License-Identifier: BSD-3-Clause
#include "contenders/narrow_phase.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <fcl/narrowphase/collision.h>

namespace fcl_fibers::benchmarks {
namespace {

constexpr std::size_t kBlock = 500;

struct Sample {
  std::size_t stride;
  std::size_t pairs = 0, sampled = 0, touching = 0;
  std::ptrdiff_t to_skip = 0;  ///< a countdown, because FCL's query is timed with it
  double seconds_in_fcl = 0;
  std::vector<std::pair<Object*, Object*>> block = {};

  static bool callback(Object* a, Object* b, void* data) {
    auto& self = *static_cast<Sample*>(data);
    ++self.pairs;
    if (self.to_skip-- > 0) return false;
    self.block.emplace_back(a, b);
    if (self.block.size() == kBlock) self.collideBlock();
    return false;
  }

  void collideBlock() {
    seconds_in_fcl += seconds([this] {
      const fcl::CollisionRequestd request;
      for (const auto& [a, b] : block) {
        fcl::CollisionResultd result;
        fcl::collide(a, b, request, result);
        if (result.isCollision()) ++touching;
      }
    });
    sampled += block.size();
    to_skip = static_cast<std::ptrdiff_t>((stride - 1) * kBlock);
    block.clear();
  }
};

}  // namespace

std::size_t narrowPhaseStride(std::size_t reported, std::size_t pairs) {
  // Fewer blocks than these say little of a scene whose parts differ.
  constexpr std::size_t kLeastBlocks = 20;
  const std::size_t blocks = std::max(kLeastBlocks, pairs / kBlock);
  return std::max<std::size_t>(1, reported / kBlock / blocks);
}

NarrowPhase collideSample(const Manager& manager, std::size_t stride) {
  Sample sample{stride};
  sample.block.reserve(kBlock);
  const double all = seconds([&] {
    manager.collide(&sample, Sample::callback);
    sample.collideBlock();
  });
  const auto pairs = static_cast<double>(sample.pairs);
  const double scale = sample.sampled == 0 ? 1 : pairs / static_cast<double>(sample.sampled);
  return {all + (scale - 1) * sample.seconds_in_fcl, sample.pairs, sample.sampled,
          scale * static_cast<double>(sample.touching)};
}

}  // namespace fcl_fibers::benchmarks
