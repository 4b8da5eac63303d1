// SPDX-License-Identifier: BSD-3-Clause
#include <vector>

#include <gtest/gtest.h>

#include "support/random.h"
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
  const std::size_t before = moved.scene.countVolumeTests();

  std::vector<int> shuffled = inOrder();
  test::Random(1).shuffle(shuffled);
  moved.segments = fibersAt(shuffled);
  EXPECT_FALSE(moved.update());
  EXPECT_GT(moved.scene.countVolumeTests(), 3 * before);
  moved.build();
  EXPECT_LT(moved.scene.countVolumeTests(), 2 * before);
  EXPECT_TRUE(moved.update()) << "once is enough";
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
