// SPDX-License-Identifier: BSD-3-Clause

// 1,000 fibers that were thrown into a box lie in each other. They are pushed apart until nothing
// overlaps, and keep their lengths: position based dynamics over plain arrays. Lengths are in radii
// of a fiber.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/live_pairs.h>

namespace {

using namespace fcl_fibers;

constexpr std::size_t kFibers = 1000, kPoints = 21;  // points of a fiber
constexpr double kSegment = 4, kRadius = 1, kBox = 110, kGap = 0.02;

struct Vec {
  double x, y, z;
};
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator*(double f, Vec a) { return {f * a.x, f * a.y, f * a.z}; }
double length(Vec a) { return std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z); }

/// The numbers are those of any compiler and library.
class Random {
 public:
  /// In a cube from -1 to 1.
  Vec inCube() { return {next(), next(), next()}; }
  Vec direction() {
    for (;;) {
      const Vec v = inCube();
      const double l = length(v);
      if (0.1 < l && l < 1) return 1 / l * v;
    }
  }

 private:
  double next() { return 2 * (static_cast<double>(numbers_()) / 0x1p32) - 1; }
  std::mt19937 numbers_{1};
};

/// Straight fibers of any direction, whose middles are in the box.
std::vector<Vec> thrown() {
  Random random;
  std::vector<Vec> points;
  for (std::size_t fiber = 0; fiber < kFibers; ++fiber) {
    const Vec middle = kBox / 2 * random.inCube(), along = kSegment * random.direction();
    for (std::size_t i = 0; i < kPoints; ++i) {
      points.push_back(middle + (static_cast<double>(i) - (kPoints - 1) / 2.0) * along);
    }
  }
  return points;
}

/// Gives all segments their length again.
void keepLengths(std::vector<Vec>& points) {
  for (int round = 0; round < 5; ++round) {
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      if ((i + 1) % kPoints == 0) continue;  // the next point is of another fiber
      const Vec along = points[i + 1] - points[i];
      const Vec excess = 0.5 * (1 - kSegment / length(along)) * along;
      points[i] = points[i] + excess;
      points[i + 1] = points[i + 1] - excess;
    }
  }
}

/// Moves the points so that each contact opens to the gap. What a point gets of several contacts is
/// averaged.
void push(const FiberTree& tree, const std::vector<Contact>& contacts, std::vector<Vec>& points) {
  std::vector<double> pushes;
  std::vector<int> counts(points.size(), 0);
  for (const Contact& contact : contacts) {
    const auto [ends, weights] = contact.nodes();  // two of a, then two of b
    double share = 0;
    for (const double weight : weights) share += weight * weight;
    pushes.push_back((kGap - contact.distance) / share);
    for (const int end : ends) ++counts[static_cast<std::size_t>(end)];
  }
  std::vector<Vec> sums(points.size(), {0, 0, 0});
  tree.accumulate({contacts, pushes}, {&sums[0].x, sums.size()});
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (counts[i] > 0) points[i] = points[i] + 1.0 / counts[i] * sums[i];
  }
}

}  // namespace

int main() {
  std::vector<Vec> points = thrown();
  std::vector<std::size_t> point_begin;
  for (std::size_t f = 0; f <= kFibers; ++f) point_begin.push_back(f * kPoints);
  const FiberArrays<double> fibers = {&points[0].x, points.size(), point_begin.data(), kFibers,
                                      &kRadius};

  FiberTreeOptions options;
  options.margin = kGap;  // what is near is kept apart before it overlaps again
  FiberTree tree(options);
  tree.build(fibers);
  LivePairs<> live(tree);
  std::vector<Contact> contacts;
  for (int iteration = 0;; ++iteration) {
    live.update();
    live.find(Contacts{fibers}, contacts);
    double deepest = 0;
    for (const Contact& contact : contacts) deepest = std::max(deepest, -contact.distance);
    if (iteration % 50 == 0 || deepest == 0) {
      std::printf("iteration %3d: %4zu pairs, the deepest overlap is %.3f radii\n", iteration,
                  contacts.size(), deepest);
    }
    if (deepest == 0) break;
    push(tree, contacts, points);
    keepLengths(points);
    tree.update(fibers);
  }

  const LivePairsCounters counters = live.counters();
  std::printf("%ld updates took %ld searches for all pairs\n", static_cast<long>(counters.updates),
              static_cast<long>(counters.listings));

  double longest = 0;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    if ((i + 1) % kPoints != 0) longest = std::max(longest, length(points[i + 1] - points[i]));
  }
  std::printf("the longest segment has %.2f %% more than at first\n",
              100 * (longest / kSegment - 1));
  // A tree that has seen nothing of this finds nothing that overlaps.
  FiberTree judge;
  judge.build(fibers);
  return judge.visit(Pairs{}, [](SegmentPair) { return true; }) ? 1 : 0;
}
