// SPDX-License-Identifier: BSD-3-Clause

// A simulation that keeps its fibers in arrays, without FCL objects. 400 ropes hang in a square and
// swing. Every step asks which segments touch.
#include <cmath>
#include <cstdio>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

namespace {

constexpr std::size_t kRopes = 20 * 20, kPoints = 30;

/// Ropes of one metre, 5 cm apart, each swinging to its own side.
void swing(std::vector<float>& points, double time) {
  points.clear();
  for (std::size_t rope = 0; rope < kRopes; ++rope) {
    const double side = static_cast<double>(rope);
    for (std::size_t i = 0; i < kPoints; ++i) {
      const double depth = static_cast<double>(i) / (kPoints - 1);
      const double sway = 0.2 * depth * depth * std::sin(3 * time + 0.1 * side);
      points.push_back(
          static_cast<float>(0.05 * static_cast<double>(rope % 20) + sway * std::cos(side)));
      points.push_back(
          static_cast<float>(0.05 * static_cast<double>(rope / 20) + sway * std::sin(side)));
      points.push_back(static_cast<float>(-depth));
    }
  }
}

}  // namespace

int main() {
  std::vector<float> points;
  swing(points, 0);
  std::vector<std::size_t> point_begin;
  for (std::size_t rope = 0; rope <= kRopes; ++rope) point_begin.push_back(rope * kPoints);
  const float radius = 0.01f;

  fcl_fibers::FiberArrays<float> ropes;
  ropes.points = points.data();  // stays where it is: the number of points does not change
  ropes.point_count = kRopes * kPoints;
  ropes.point_begin = point_begin.data();
  ropes.fiber_count = kRopes;
  ropes.radii = &radius;

  fcl_fibers::FiberTreeOptions options;
  options.report = fcl_fibers::Report::kCapsules;
  options.ignored_neighbors = 1;  // adjacent segments share a point
  options.threads = 2;

  fcl_fibers::FiberTree tree(options);
  tree.build(ropes);
  for (int step = 0; step < 5; ++step) {
    std::size_t touching = 0;
    tree.visitPairs([&](fcl_fibers::SegmentPair) { ++touching; });
    std::printf("step %d: %zu pairs touch\n", step, touching);

    swing(points, 0.1 * (step + 1));
    tree.update(ropes);
  }
  return 0;
}
