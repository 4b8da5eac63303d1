// SPDX-License-Identifier: BSD-3-Clause
#include "fibers/fiber_of.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace fcl_fibers::fibers {
namespace {

TEST(FiberOf, IsTheOneThatOwnsTheId) {
  // If this fails, neighbours are taken for strangers. Fibers of like and of very unlike lengths,
  // and without segments; the largest ids, of which products would leave 32 bits.
  constexpr std::int32_t kMost = INT32_MAX;
  const std::vector<std::vector<std::int32_t>> all = {{1},
                                                      {5, 5, 5, 5},
                                                      {1, 1000, 1, 1, 1},
                                                      {1, 1, 1, 1000},
                                                      {3, 0, 0, 2, 0, 7, 0},
                                                      {kMost / 2, 10, kMost / 4, 1}};
  for (const auto& lengths : all) {
    std::vector<std::int32_t> begin = {0};
    for (const std::int32_t length : lengths) begin.push_back(begin.back() + length);
    for (std::size_t f = 0; f < lengths.size(); ++f) {
      if (lengths[f] == 0) continue;
      for (const std::int32_t id : {begin[f], begin[f] + lengths[f] / 2, begin[f + 1] - 1}) {
        EXPECT_EQ(fiberOf(begin.data(), lengths.size(), begin.back(), id), f) << id;
      }
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::fibers
