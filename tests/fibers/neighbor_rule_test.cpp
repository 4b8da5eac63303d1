// SPDX-License-Identifier: BSD-3-Clause
#include "fibers/neighbor_rule.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "support/random.h"

namespace fcl_fibers::fibers {
namespace {

/// By walking from one segment to the other.
bool meetOnTheWay(const NeighborRule& rule, const std::vector<double>& lengths, std::size_t from,
                  std::size_t to, bool closed) {
  double between = 0;
  for (std::size_t steps = 1; steps <= lengths.size(); ++steps) {
    from = from + 1 == lengths.size() && closed ? 0 : from + 1;
    if (from >= lengths.size()) return false;
    if (from == to) {
      return static_cast<SegmentId>(steps) <= rule.reach ||
             (rule.arc_length > 0 && between <= rule.arc_length);
    }
    between += lengths[from];
  }
  return false;
}

// A pair would be ignored that is far away along the fiber, or one at the seam be reported.
TEST(NeighborRule, IsTheWalkAlongTheFiberInBothDirections) {
  test::Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const std::size_t count = 3 + random.below(20);
    const SegmentId begin = static_cast<SegmentId>(random.below(5));
    // Multiples of 1/4, whose sums are exact.
    std::vector<double> lengths(count), arc_end(static_cast<std::size_t>(begin) + count);
    double end = 0;
    for (std::size_t i = 0; i < count; ++i) {
      lengths[i] = static_cast<double>(random.below(5)) / 4;
      end += lengths[i];
      arc_end[static_cast<std::size_t>(begin) + i] = end;
    }
    const NeighborRule rule(static_cast<SegmentId>(random.below(4)),
                            trial % 3 == 0 ? 0.0 : static_cast<double>(random.below(9)) / 4);
    for (const bool closed : {false, true}) {
      const FiberRange fiber{begin, begin + static_cast<SegmentId>(count), closed};
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t j = i + 1; j < count; ++j) {
          const bool expected = meetOnTheWay(rule, lengths, i, j, closed) ||
                                meetOnTheWay(rule, lengths, j, i, closed);
          ASSERT_EQ(areNeighbors(rule, fiber, arc_end.data(), begin + static_cast<SegmentId>(i),
                                 begin + static_cast<SegmentId>(j)),
                    expected)
              << i << ' ' << j << " of " << count << (closed ? " closed" : " open");
        }
      }
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::fibers
