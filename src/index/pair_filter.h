// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "geometry/impact.h"
#include "tree/search.h"

namespace fcl_fibers::index {

/// Decides which of the pairs whose volumes overlap are handed on. Several threads may ask it at
/// the same time.
class PairFilter {
 public:
  /// Moves the pairs that are handed on to the front in their order, and returns their number.
  /// @param impacts  empty; a filter that finds impacts adds that of each pair it keeps
  virtual std::size_t keep(tree::Pair* pairs, std::size_t count,
                           std::vector<geometry::Impact>& impacts) const = 0;

 protected:
  ~PairFilter() = default;
};

}  // namespace fcl_fibers::index
