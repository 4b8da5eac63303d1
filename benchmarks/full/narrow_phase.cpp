// SPDX-License-Identifier: BSD-3-Clause
#include "narrow_phase.h"

#include <fcl/narrowphase/collision.h>

namespace fcl_fibers::benchmarks {

double NarrowPhase::time(const Manager& manager) {
  const double before = seconds_in_fcl_;
  const double all = seconds([&] {
    manager.collide(this, callback);
    collideBlock();
  });
  const double in_fcl = seconds_in_fcl_ - before;
  return all - in_fcl + in_fcl * static_cast<double>(stride_);
}

bool NarrowPhase::callback(Object* a, Object* b, void* data) {
  auto& self = *static_cast<NarrowPhase*>(data);
  if (self.pairs_++ / kBlock % self.stride_ == 0) {
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
      if (result.isCollision()) ++touching_;
    }
  });
  block_.clear();
}

}  // namespace fcl_fibers::benchmarks
