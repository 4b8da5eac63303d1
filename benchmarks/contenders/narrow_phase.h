// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "contenders/contender.h"

namespace fcl_fibers::benchmarks {

/// fcl::collide on the pairs that a manager reports, or on blocks of them that are spread evenly,
/// and then its time counts as if it had been called on all. Blocks, for the objects of pairs that
/// follow each other are in the cache.
class NarrowPhase {
 public:
  /// @param stride  one block out of so many
  explicit NarrowPhase(std::size_t stride) : stride_(stride) { block_.reserve(kBlock); }

  /// The stride for about so many pairs out of `reported`.
  static std::size_t strideFor(std::size_t reported, std::size_t pairs);

  /// Seconds that a self-collision query takes together with fcl::collide on each pair.
  double time(const Manager& manager);

  // Of all queries so far.
  std::size_t pairs() const { return pairs_; }
  std::size_t sampled() const { return sampled_; }
  double touching() const { return touching_; }  ///< estimated by what was tried

 private:
  static constexpr std::size_t kBlock = 500;

  static bool callback(Object* a, Object* b, void* data);
  void collideBlock();

  std::size_t stride_;
  std::size_t pairs_ = 0;
  std::size_t sampled_ = 0;
  double touching_ = 0;
  // Of this query.
  std::size_t pairs_now_ = 0;
  std::size_t sampled_now_ = 0;
  std::size_t touching_now_ = 0;
  double seconds_in_fcl_ = 0;
  std::vector<std::pair<Object*, Object*>> block_;
};

}  // namespace fcl_fibers::benchmarks
