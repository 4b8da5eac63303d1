// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "contender.h"

namespace fcl_fibers::benchmarks {

/// fcl::collide on the pairs that a manager reports, or on one block of a thousand of them out of
/// every `stride`, whose time then counts `stride` times. Blocks, for the objects of pairs that
/// follow each other are in the cache.
class NarrowPhase {
 public:
  explicit NarrowPhase(std::size_t stride) : stride_(stride) { block_.reserve(kBlock); }

  /// Seconds that a self-collision query takes together with fcl::collide on each pair.
  double time(const Manager& manager);

  /// Pairs of all queries so far, and how many of them touch, estimated by what was tried.
  std::size_t pairs() const { return pairs_; }
  double touching() const { return static_cast<double>(touching_ * stride_); }

 private:
  static constexpr std::size_t kBlock = 1000;

  static bool callback(Object* a, Object* b, void* data);
  void collideBlock();

  std::size_t stride_;
  std::size_t pairs_ = 0;
  std::size_t touching_ = 0;
  std::vector<std::pair<Object*, Object*>> block_;
  double seconds_in_fcl_ = 0;
};

}  // namespace fcl_fibers::benchmarks
