// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "index/segment_index.h"
#include "support/random.h"
#include "support/volume_tests.h"

namespace fcl_fibers::index {
namespace {

using geometry::Frame;
using geometry::Segment;
using geometry::Vec3d;

constexpr int kFibers = 200, kSegments = 20;

/// Straight fibers along z whose roots are the points of a grid, in the order given.
std::vector<Segment> fibersAt(const std::vector<int>& order) {
  std::vector<Segment> segments;
  for (const int place : order) {
    const double x = place % 20, y = place / 20;
    for (int i = 0; i < kSegments; ++i) {
      segments.push_back({{x, y, 0.5 * i}, {x, y, 0.5 * (i + 1)}, 0.1});
    }
  }
  return segments;
}

/// What is behind the last fiber is one of its own.
struct TestScene : SegmentSource {
  std::vector<Segment> segments;
  SegmentIndex index{IndexOptions{}};

  bool read(const SegmentId* ids, int count, int, const Frame&, SegmentBlock& out,
            BlockMask& present) const override {
    for (int i = 0; i < count; ++i) out.set(i, segments[static_cast<std::size_t>(ids[i])]);
    present = geometry::firstOfBlock(count);
    return true;
  }
  bool staysFiniteIn(const geometry::Frame&) const override { return true; }
  bool isFasterInOrder() const override { return false; }
  [[noreturn]] void refuse(SegmentId, const Frame&) const override {
    throw std::invalid_argument("all can be read");
  }

  void build() {
    tree::Fibers fibers;
    const auto count = static_cast<SegmentId>(segments.size());
    for (SegmentId id = 0; id < count; ++id) {
      fibers.ids.push_back(id);
      if (id % kSegments == kSegments - 1 || id >= kFibers * kSegments) fibers.endFiber();
    }
    index.build(*this, Frame{}, 0, count, fibers);
  }
  std::size_t volumeTests() const {
    return std::visit([](const auto& tree) { return test::countVolumeTests(tree).tests; },
                      index.tree());
  }
  bool refit() { return index.refit(*this, Frame{}); }
};

std::vector<int> inOrder() {
  std::vector<int> order;
  for (int f = 0; f < kFibers; ++f) order.push_back(f);
  return order;
}

// Queries would become slow for good when fibers have changed places.
TEST(Decay, FibersThatHaveChangedPlacesAreBundledAnew) {
  TestScene moved;
  moved.segments = fibersAt(inOrder());
  moved.build();
  const std::size_t before = moved.volumeTests();

  std::vector<int> shuffled = inOrder();
  test::Random(1).shuffle(shuffled);
  moved.segments = fibersAt(shuffled);
  EXPECT_FALSE(moved.refit());
  EXPECT_GT(moved.volumeTests(), 3 * before);
  moved.build();
  EXPECT_LT(moved.volumeTests(), 2 * before);
  EXPECT_TRUE(moved.refit()) << "once is enough";
}

// A program that only ever updates some objects would slow down without end.
TEST(Decay, IsFoundOutByRefitsOfSomeSegmentsToo) {
  TestScene moved;
  moved.segments = fibersAt(inOrder());
  moved.build();
  std::vector<int> shuffled = inOrder();
  test::Random(1).shuffle(shuffled);
  const std::vector<Segment> there = fibersAt(shuffled);
  bool stays = true;
  for (std::size_t fiber = 0; stays && fiber < 2 * kFibers; ++fiber) {
    std::vector<SegmentId> ids;
    std::vector<Segment> segments;
    for (std::size_t i = fiber % kFibers * kSegments; ids.size() < kSegments; ++i) {
      moved.segments[i] = there[i];
      moved.segments[i].radius += 1e-3 * static_cast<double>(fiber);
      ids.push_back(static_cast<SegmentId>(i));
      segments.push_back(moved.segments[i]);
    }
    stays = moved.index.refitSome(ids, segments);
  }
  EXPECT_FALSE(stays);
}

// A scene that only turns, drifts, bends or grows would be built again and again.
TEST(Decay, MotionTogetherIsNone) {
  TestScene moved;
  moved.segments = fibersAt(inOrder());
  moved.build();
  for (Segment& s : moved.segments) {
    for (Vec3d* p : {&s.a, &s.b}) {
      // Turned by pi/4 about y, bent, moved and made three times as large.
      const double x = 0.7071 * (p->x + p->z), z = 0.7071 * (p->z - p->x);
      *p = {100 + 3 * x, 3 * (p->y + 0.02 * z * z), 3 * z};
    }
    s.radius *= 3;
  }
  EXPECT_TRUE(moved.refit());
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();
Segment slab() { return Segment::box({-kInfinity, -kInfinity, -1}, {kInfinity, kInfinity, -0.9}); }

// With a half-space in it a scene would slow down for good, or be built again and again.
TEST(Decay, BoxesThatAreOpenNeitherHideNorFeignIt) {
  const Segment bounded = Segment::box({3, 3, -1}, {4, 4, -0.9});
  for (const int open_when_built : {0, 1}) {
    for (const int open_then : {0, 1}) {
      SCOPED_TRACE(open_when_built * 10 + open_then);
      TestScene moved;
      const std::vector<Segment> fibers = fibersAt(inOrder());
      const auto place = [&](const std::vector<Segment>& at, int open) {
        moved.segments = at;
        for (int i = 0; i < 3; ++i) moved.segments.push_back(open ? slab() : bounded);
      };
      place(fibers, open_when_built);
      moved.build();
      place(fibers, open_then);
      EXPECT_TRUE(moved.refit()) << "nothing but the boxes has changed";

      std::vector<int> shuffled = inOrder();
      test::Random(1).shuffle(shuffled);
      place(fibersAt(shuffled), open_then);
      EXPECT_FALSE(moved.refit());
      moved.build();
      EXPECT_TRUE(moved.refit()) << "once is enough";
    }
  }
}

// A scene in which all is open would be built anew for each frame.
TEST(Decay, OfBoxesThatAreAllOpenIsNone) {
  TestScene moved;
  moved.segments.assign(kFibers * kSegments, slab());
  moved.build();
  EXPECT_TRUE(moved.refit());
  moved.segments = fibersAt(inOrder());
  moved.refit();
  moved.build();
  EXPECT_TRUE(moved.refit());
  moved.segments.assign(kFibers * kSegments, slab());
  EXPECT_TRUE(moved.refit());
  moved.segments = fibersAt(inOrder());
  EXPECT_TRUE(moved.refit()) << "they are where they were";
}

}  // namespace
}  // namespace fcl_fibers::index
