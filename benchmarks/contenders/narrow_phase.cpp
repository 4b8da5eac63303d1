// SPDX-License-Identifier: BSD-3-Clause
#include "contenders/narrow_phase.h"

#include <algorithm>

#include <fcl/narrowphase/collision.h>

namespace fcl_fibers::benchmarks {

std::size_t NarrowPhase::strideFor(std::size_t reported, std::size_t pairs) {
  // Fewer blocks than these say little of a scene whose parts differ.
  constexpr std::size_t kLeastBlocks = 20;
  const std::size_t blocks = std::max(kLeastBlocks, pairs / kBlock);
  return std::max<std::size_t>(1, reported / kBlock / blocks);
}

double NarrowPhase::time(const Manager& manager) {
  pairs_now_ = sampled_now_ = touching_now_ = 0;
  seconds_in_fcl_ = 0;
  const double all = seconds([&] {
    manager.collide(this, callback);
    collideBlock();
  });
  const double scale =
      sampled_now_ == 0 ? 1 : static_cast<double>(pairs_now_) / static_cast<double>(sampled_now_);
  pairs_ += pairs_now_;
  sampled_ += sampled_now_;
  touching_ += scale * static_cast<double>(touching_now_);
  return all + (scale - 1) * seconds_in_fcl_;
}

bool NarrowPhase::callback(Object* a, Object* b, void* data) {
  auto& self = *static_cast<NarrowPhase*>(data);
  if (self.pairs_now_++ / kBlock % self.stride_ == 0) {
    self.block_.emplace_back(a, b);
    if (self.block_.size() == kBlock) self.collideBlock();
  }
  return false;
}

void NarrowPhase::collideBlock() {
  seconds_in_fcl_ += seconds([this] {
    const fcl::CollisionRequestd request;
    for (const auto& [a, b] : block_) {
      fcl::CollisionResultd result;
      fcl::collide(a, b, request, result);
      if (result.isCollision()) ++touching_now_;
    }
  });
  sampled_now_ += block_.size();
  block_.clear();
}

}  // namespace fcl_fibers::benchmarks
