// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include "geometry/box.h"
#include "geometry/segment_block.h"
#include "support/overlap.h"
#include "support/random.h"
#include "support/scoped_target.h"

namespace fcl_fibers::geometry {
namespace {

using test::Random;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool areSame(const Box& p, const Box& q) { return std::memcmp(&p, &q, sizeof(p)) == 0; }

/// Coordinates of all sizes, ends that coincide, boxes, and boxes open to some sides.
Segment randomSegment(Random& random) {
  const double size = std::pow(10.0, random.between(-45, 45));
  const auto coordinate = [&] {
    switch (random.below(8)) {
      case 0:
        return 0.0;
      case 1:
        return -0.0;
      case 2:
        return random.between(-1, 1) * std::pow(10.0, random.between(-300, 300));
      default:
        return random.between(-size, size);
    }
  };
  Segment segment{{coordinate(), coordinate(), coordinate()},
                  {coordinate(), coordinate(), coordinate()},
                  random.below(4) == 0 ? 0 : std::fabs(coordinate())};
  if (random.below(4) == 0) segment.b = segment.a;
  if (random.below(4) > 0) return segment;
  segment = Segment::box(min(segment.a, segment.b), max(segment.a, segment.b));
  if (random.below(4) == 0) segment.a.y = -kInfinity;
  if (random.below(4) == 0) segment.b.z = kInfinity;
  return segment;
}

TEST(BoxRows, BoxesOfABlockAreThoseOfItsSegments) {
  // If this fails, boxes depend on how many are computed at once, or on the machine.
  for (const std::int64_t target : simd::availableTargets()) {
    SCOPED_TRACE(simd::targetName(target));
    const simd::ScopedTarget scoped(target);
    Random random(91);
    SegmentBlock block;
    BoxRows boxes;
    for (int round = 0; round < 2000; ++round) {
      const int count = 1 + static_cast<int>(random.below(SegmentBlock::kCapacity));
      const int first = SegmentBlock::kCapacity * static_cast<int>(random.below(8));
      const double padding = round % 3 == 0 ? std::pow(10.0, random.between(-40, 40)) : 0;
      for (int i = 0; i < count; ++i) block.set(i, randomSegment(random));
      boxesAround(block, count, padding, boxes, first);
      for (int i = 0; i < count; ++i) {
        const Box expected = Box::around(block[i], padding);
        ASSERT_TRUE(areSame(boxes[first + i], expected)) << "segment " << i << " of " << count;
      }
    }
  }
}

template <int N>
void expectRows() {
  BoxRows boxes;
  for (int i = 0; i < BoxRows::kCapacity; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      boxes.low[axis][i] = static_cast<float>(10 * i + axis);
      boxes.high[axis][i] = static_cast<float>(10 * i + axis + 5);
    }
  }
  for (const int first : {0, 1, 7, 64, BoxRows::kCapacity - N}) {
    for (int count = 1; count <= N; ++count) {
      Box::Pack<N> pack;
      EXPECT_TRUE(replaceAll(pack, boxes, first, count));
      EXPECT_FALSE(replaceAll(pack, boxes, first, count)) << "nothing has changed";
      for (int lane = 0; lane < N; ++lane) {
        if (lane < count) {
          EXPECT_TRUE(areSame(pack.get(lane), boxes[first + lane])) << lane;
        } else {
          EXPECT_TRUE(std::isnan(pack.get(lane).low[0])) << lane;
        }
      }
      // A change of any side of any lane is noticed.
      for (int lane = 0; lane < count; ++lane) {
        for (int axis = 0; axis < 3; ++axis) {
          for (float* row : {boxes.low[axis], boxes.high[axis]}) {
            row[first + lane] += 1;
            EXPECT_TRUE(replaceAll(pack, boxes, first, count));
            row[first + lane] -= 1;
            EXPECT_TRUE(replaceAll(pack, boxes, first, count));
          }
        }
      }
    }
  }
  boxes.clear(1);
  Box::Pack<N> pack;
  replaceAll(pack, boxes, 0, N);
  EXPECT_TRUE(std::isnan(pack.get(1).low[1]) && std::isnan(pack.get(1).high[2]));
  EXPECT_FALSE(replaceAll(pack, boxes, 0, N)) << "what is cleared has not changed";
}

TEST(BoxRows, APackTakesSomeOfTheRows) {
  // If this fails, a node has boxes of other leaves, or of those that are not there.
  expectRows<2>();
  expectRows<8>();
}

}  // namespace
}  // namespace fcl_fibers::geometry
