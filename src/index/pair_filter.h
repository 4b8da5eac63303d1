// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "tree/search.h"

namespace fcl_fibers::index {

/// Decides which of the pairs whose volumes overlap are handed on. Several threads may ask it at
/// the same time.
class PairFilter {
 public:
  /// Moves the pairs that touch to the front in their order, and returns their number.
  virtual std::size_t keepTouching(tree::Pair* pairs, std::size_t count) const = 0;

 protected:
  ~PairFilter() = default;
};

}  // namespace fcl_fibers::index
