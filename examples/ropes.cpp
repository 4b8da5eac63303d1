// SPDX-License-Identifier: BSD-3-Clause

// 200 ropes fall onto the ground and onto a box: position based dynamics over plain arrays. Units
// are metres and seconds.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>

namespace {

using namespace fcl_fibers;

constexpr std::size_t kRopes = 200, kPoints = 41;
constexpr double kSegment = 0.025, kRadius = 0.01, kStep = 0.001;
constexpr double kKept = 0.99;   // the part of a motion that air leaves
constexpr double kShare = 0.25;  // of a depth: how far a contact moves its points in a step

/// Layers of 20 parallel ropes, each across the one below.
FiberPolylines layers() {
  FiberPolylines ropes;
  ropes.radius = kRadius;
  for (std::size_t rope = 0; rope < kRopes; ++rope) {
    const std::size_t layer = rope / 20;
    for (std::size_t i = 0; i < kPoints; ++i) {
      const double along = kSegment * (static_cast<double>(i) - 20);
      const double beside = 0.03 * (static_cast<double>(rope % 20) - 9.5);
      const double height = 0.35 + 0.025 * static_cast<double>(layer);
      if (layer % 2 == 0) ropes.points.push_back({along, beside, height});
      if (layer % 2 == 1) ropes.points.push_back({beside, along, height});
    }
    ropes.point_begin.push_back(ropes.points.size());
  }
  return ropes;
}

/// Every point goes on as in the last step, and falls.
void fall(std::vector<Point>& now, std::vector<Point>& before) {
  for (std::size_t i = 0; i < now.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double motion = kKept * (now[i][axis] - before[i][axis]);
      before[i][axis] = now[i][axis];
      now[i][axis] += motion - (axis == 2 ? 9.81 * kStep * kStep : 0);
    }
  }
}

/// Gives all segments their length again.
void keepLengths(std::vector<Point>& points) {
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    if ((i + 1) % kPoints == 0) continue;  // the next point is of another rope
    Point &p = points[i], &q = points[i + 1];
    const double x = q[0] - p[0], y = q[1] - p[1], z = q[2] - p[2];
    const double length = std::sqrt(x * x + y * y + z * z);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double excess = (1 - kSegment / length) * (q[axis] - p[axis]) / 2;
      p[axis] += excess;
      q[axis] -= excess;
    }
  }
}

}  // namespace

int main() {
  FiberPolylines ropes = layers();
  std::vector<Point> before = ropes.points;
  FiberTree tree;
  const FiberArrays<double> arrays = fiberArrays(ropes);
  tree.build(arrays);
  const Shape obstacles[] = {HalfSpaceShape{{0, 0, 1}, 0},
                             BoxShape{{-0.2, -0.2, 0}, {0.2, 0.2, 0.3}}};
  std::vector<Contact> contacts;
  std::vector<ShapeContact> beside;
  std::vector<double> pushes;
  double deepest = 0;
  for (int step = 1; step <= 1200; ++step) {
    fall(ropes.points, before);
    for (int round = 0; round < 10; ++round) keepLengths(ropes.points);
    tree.update(arrays);
    deepest = 0;
    std::vector<Point> moves(ropes.points.size());
    const auto push = [&](const auto& found) {
      pushes.clear();
      for (const auto& contact : found) {
        pushes.push_back(-kShare * contact.distance);
        deepest = std::max(deepest, -contact.distance);
      }
      tree.accumulate({found, pushes}, moves);
    };
    tree.find(Contacts{arrays}, contacts);
    push(contacts);
    for (const Shape& obstacle : obstacles) {
      tree.find(Contacts{arrays}, obstacle, beside);
      push(beside);
    }
    for (std::size_t i = 0; i < moves.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) ropes.points[i][axis] += moves[i][axis];
    }
    if (step % 300 == 0) {
      double lowest = 1;
      for (const Point& point : ropes.points) lowest = std::min(lowest, point[2]);
      std::printf(
          "step %d: %zu contacts of ropes, the deepest %.1f mm, the lowest point at %.0f mm\n",
          step, contacts.size(), 1e3 * deepest, 1e3 * lowest);
    }
  }
}
