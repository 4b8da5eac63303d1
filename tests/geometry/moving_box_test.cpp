// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/moving_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "support/overlap.h"
#include "support/random.h"

namespace fcl_fibers::geometry {
namespace {

using simd::LaneMask;
using test::Random;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kLanes = 8;

/// Sides are whole numbers, so times are fractions of such, and 128 bits hold their comparisons.
struct WholeBox {
  std::array<std::int64_t, 3> low, high;
  Box box() const {
    Box b;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      b.low[axis] = static_cast<float>(low[axis]);
      b.high[axis] = static_cast<float>(high[axis]);
    }
    return b;
  }
};
struct WholeMotion {
  WholeBox start, end;
};

__extension__ using Wide = __int128;

struct Fraction {
  std::int64_t above, below;  ///< below > 0
  friend bool operator<(const Fraction& p, const Fraction& q) {
    return static_cast<Wide>(p.above) * q.below < static_cast<Wide>(q.above) * p.below;
  }
};

/// Whether two boxes overlap at one common time, without error. `slack` is the least difference of
/// the last time and the first one if they do, or of the first and the last if they do not.
bool overlapExactly(const WholeMotion& p, const WholeMotion& q, double& slack) {
  Fraction first{0, 1}, last{1, 1};
  bool never = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t depths[2][2] = {
        {p.start.high[axis] - q.start.low[axis], p.end.high[axis] - q.end.low[axis]},
        {q.start.high[axis] - p.start.low[axis], q.end.high[axis] - p.end.low[axis]}};
    for (const auto& [d0, d1] : depths) {
      if (d0 < 0 && d1 < 0) never = true;
      const std::int64_t size = std::llabs(d0 - d1);
      if (d0 < 0 && d1 >= 0) first = std::max(first, Fraction{-d0, size});
      if (d0 >= 0 && d1 < 0) last = std::min(last, Fraction{d0, size});
    }
  }
  const auto value = [](const Fraction& f) {
    return static_cast<double>(f.above) / static_cast<double>(f.below);
  };
  slack = never ? 1 : std::fabs(value(last) - value(first));
  return !never && !(last < first);
}

WholeBox randomBox(Random& random, std::int64_t range, std::int64_t size) {
  WholeBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto below = [&](std::int64_t n) {
      return static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(n)));
    };
    box.low[axis] = below(2 * range) - range;
    box.high[axis] = box.low[axis] + below(size);
  }
  return box;
}

struct Packs {
  /// Tests all lanes at once, and in packs of two, whose answer has to be the same.
  LaneMask overlapping(float until, const MovingBox& box) const {
    const LaneMask found = overlaps(MovingBox::Pack<kLanes>{start, end, until}, box);
    for (int lane = 0; lane < kLanes; ++lane) {
      Box::Pack<2> two_at_start, two_at_end;
      two_at_start.set(lane % 2, start.get(lane));
      two_at_end.set(lane % 2, end.get(lane));
      EXPECT_EQ(overlaps(MovingBox::Pack<2>{two_at_start, two_at_end, until}, box),
                (found >> lane & 1u) << lane % 2);
    }
    return found;
  }

  Box::Pack<kLanes> start, end;
};

/// No common time is missed, and boxes that have none are reported only if they miss one by less
/// than rounding.
TEST(MovingBox, OverlapsAtACommonTime) {
  Random random(1);
  std::size_t overlapping = 0, apart = 0, at_one_time = 0;
  for (int i = 0; i < 20000; ++i) {
    // Small numbers often touch at one time only.
    const bool small = i % 2 == 0;
    const std::int64_t range = small ? 4 : 1 << 20, size = small ? 3 : 1 << 19;
    const auto motion = [&] {
      return WholeMotion{randomBox(random, range, size), randomBox(random, range, size)};
    };
    const WholeMotion q = motion();
    std::array<WholeMotion, kLanes> p;
    Packs packs;
    for (int lane = 0; lane < kLanes; ++lane) {
      p[static_cast<std::size_t>(lane)] = motion();
      packs.start.set(lane, p[static_cast<std::size_t>(lane)].start.box());
      packs.end.set(lane, p[static_cast<std::size_t>(lane)].end.box());
    }
    const LaneMask found = packs.overlapping(1, MovingBox{q.start.box(), q.end.box()});
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      double slack = 0;
      const bool expected = overlapExactly(p[lane], q, slack);
      if ((found >> lane & 1u) != 0) {
        ASSERT_TRUE(expected || slack < 0x1p-19) << i;
      } else {
        ASSERT_FALSE(expected) << i;
      }
      overlapping += expected;
      apart += !expected;
      at_one_time += expected && slack == 0;
    }
  }
  EXPECT_GT(overlapping, 10000u);
  EXPECT_GT(apart, 10000u);
  EXPECT_GT(at_one_time, 100u);
}

Box boxAt(float x) { return {{x, 0, 0}, {x + 1, 1, 1}}; }

/// What passes meets at half the time, so a search that ends before does not see it.
TEST(MovingBox, TimesBeyondTheLastDoNotCount) {
  Packs packs;
  packs.start.set(3, boxAt(-10));
  packs.end.set(3, boxAt(10));
  const MovingBox rests{boxAt(0), boxAt(0)};
  EXPECT_EQ(packs.overlapping(1, rests), LaneMask{1} << 3);
  EXPECT_EQ(packs.overlapping(0.46f, rests), LaneMask{1} << 3);
  EXPECT_EQ(packs.overlapping(0.44f, rests), LaneMask{0});
  packs.end.set(3, boxAt(0));
  EXPECT_EQ(packs.overlapping(1, rests), LaneMask{1} << 3);
  EXPECT_EQ(packs.overlapping(0.89f, rests), LaneMask{0});
}

TEST(MovingBox, ClearedLanesNeverOverlap) {
  Packs packs;
  packs.start.set(0, Box::unbounded());  // cleared at the end
  packs.end.set(1, Box::unbounded());    // cleared at the start
  const MovingBox everything{Box::unbounded(), Box::unbounded()};
  EXPECT_EQ(packs.overlapping(1, everything), LaneMask{0});
  packs.start.set(2, Box::unbounded());
  packs.end.set(2, Box::unbounded());
  EXPECT_EQ(packs.overlapping(1, everything), LaneMask{1} << 2);
}

/// Differences of such numbers overflow or are no numbers. They hide nothing.
TEST(MovingBox, InfiniteAndLargestSidesAreMetAtAnyTime) {
  constexpr float kLargest = std::numeric_limits<float>::max();
  constexpr float kSmallest = std::numeric_limits<float>::min();
  const float ends[] = {-kInfinity, -kLargest, -kLargest / 2, -1,       -kSmallest, 0,
                        kSmallest,  1,         kLargest / 2,  kLargest, kInfinity};
  Random random(3);
  const auto any = [&] {
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
      float a = ends[random.below(10)], b = ends[1 + random.below(10)];
      if (a > b) std::swap(a, b);
      // As rounding outward leaves it.
      box.low[axis] = std::min(a, kLargest);
      box.high[axis] = std::max(b, -kLargest);
    }
    return box;
  };
  std::size_t checked = 0;
  for (int i = 0; i < 20000; ++i) {
    Packs packs;
    const MovingBox p{any(), any()}, q{any(), any()};
    packs.start.set(0, p.start);
    packs.end.set(0, p.end);
    const bool found = (packs.overlapping(1, q) & 1u) != 0;
    // Differences of floats do not overflow in double.
    double first = 0, last = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double depths[2][2] = {{double{p.start.high[axis]} - q.start.low[axis],
                                    double{p.end.high[axis]} - q.end.low[axis]},
                                   {double{q.start.high[axis]} - p.start.low[axis],
                                    double{q.end.high[axis]} - p.end.low[axis]}};
      for (const auto& [d0, d1] : depths) {
        if (d0 < 0 && d1 < 0) last = -1;
        if (d0 < 0 && d1 >= 0) first = std::max(first, std::isinf(d1) ? 0 : d0 / (d0 - d1));
        if (d0 >= 0 && d1 < 0) last = std::min(last, std::isinf(d0) ? 1 : d0 / (d0 - d1));
      }
    }
    if (first > last) continue;
    ++checked;
    ASSERT_TRUE(found) << i;
  }
  EXPECT_GT(checked, 1000u);
}

}  // namespace
}  // namespace fcl_fibers::geometry
