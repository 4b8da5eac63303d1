// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "support/moving_scene.h"

namespace fcl_fibers::test {

/// Checks the pairs of two lists of objects, or of one with itself if `theirs` is null. With
/// `linear` exactly those are reported whose boxes meet.
template <typename S>
void expectPairs(const Calls<S>& calls, const std::vector<Moving<S>*>& mine,
                 const std::vector<Moving<S>*>* theirs, double margin, bool linear) {
  std::vector<Moving<S>*> all = mine;
  if (theirs != nullptr) all.insert(all.end(), theirs->begin(), theirs->end());
  const SeparationOracle<S> apart(all, linear ? 1 : 48);
  const Real rounding = 1e3 * Real(std::numeric_limits<float>::epsilon());
  const std::set<std::pair<Moving<S>*, Moving<S>*>> found(calls.begin(), calls.end());
  EXPECT_EQ(found.size(), calls.size()) << "a pair is reported twice";
  std::size_t due = 0;
  for (std::size_t a = 0; a < mine.size(); ++a) {
    for (std::size_t b = theirs != nullptr ? mine.size() : a + 1; b < all.size(); ++b) {
      if (all[a] == all[b]) continue;
      const Real least = linear ? apart.ofLines(a, b) : apart(a, b);
      const bool is_found = found.count({all[a], all[b]}) > 0;
      if (least < Real(margin) - rounding) {
        ++due;
        EXPECT_TRUE(is_found) << "missing " << a << ", " << b << ": " << double(least);
      } else if (least > Real(margin) + (linear ? rounding : 0.3L)) {
        EXPECT_FALSE(is_found) << "extra " << a << ", " << b << ": " << double(least);
      }
    }
  }
  EXPECT_GT(due, 0u);
  EXPECT_GE(calls.size(), due);
}

}  // namespace fcl_fibers::test
