// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "support/random.h"
#include "support/volume_tests.h"
#include "tree/scene.h"

namespace fcl_fibers::tree {
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

Fibers allFibers() {
  Fibers fibers;
  for (int f = 0; f < kFibers; ++f) {
    for (int i = 0; i < kSegments; ++i) fibers.ids.push_back(f * kSegments + i);
    fibers.endFiber();
  }
  return fibers;
}

struct TestScene {
  std::vector<Segment> segments;
  Scene scene{SceneOptions{}};

  auto reader() const {
    return [this](SegmentId id, Segment& segment) {
      segment = segments[static_cast<std::size_t>(id)];
      return true;
    };
  }
  void build() {
    scene.build(
        Frame{}, segments.size(), [](auto&&) { return allFibers(); }, reader());
  }
  std::size_t volumeTests() const {
    return std::visit([](const auto& tree) { return test::countVolumeTests(tree).tests; },
                      scene.tree());
  }
  bool update() { return scene.update(Frame{}, segments.size(), reader()); }
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
  EXPECT_FALSE(moved.update());
  EXPECT_GT(moved.volumeTests(), 3 * before);
  moved.build();
  EXPECT_LT(moved.volumeTests(), 2 * before);
  EXPECT_TRUE(moved.update()) << "once is enough";
}

// A program that only ever updates some objects would slow down without end.
TEST(Decay, IsFoundOutByUpdatesOfSomeSegmentsToo) {
  TestScene moved;
  moved.segments = fibersAt(inOrder());
  moved.build();
  std::vector<int> shuffled = inOrder();
  test::Random(1).shuffle(shuffled);
  const std::vector<Segment> there = fibersAt(shuffled);
  bool stays = true;
  for (std::size_t fiber = 0; stays && fiber < 2 * kFibers; ++fiber) {
    std::vector<SegmentId> ids;
    for (std::size_t i = fiber % kFibers * kSegments; ids.size() < kSegments; ++i) {
      moved.segments[i] = there[i];
      moved.segments[i].radius += 1e-3 * static_cast<double>(fiber);
      ids.push_back(static_cast<SegmentId>(i));
    }
    stays = moved.scene.updateSome(ids, moved.reader());
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
  EXPECT_TRUE(moved.update());
}

}  // namespace
}  // namespace fcl_fibers::tree
