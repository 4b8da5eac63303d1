// SPDX-License-Identifier: BSD-3-Clause

// What a FiberTree over arrays of floats takes for many segments, on Linux.
//
//     fcl_fibers_large [MILLIONS [THREADS]]
//
// The scene is one block of a million segments of `helix`, again and again. Blocks are apart, and
// moving them does not round their floats. So the right pairs are those of one block, which are
// found without a tree.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include <fcl_fibers/benchmark/judge.h>
#include "scenes/helix.h"
#include "tools/seconds.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kFibers = 10'000, kSegments = 100;  // of a block
constexpr std::size_t kPointsOfFiber = kSegments + 1, kPointsOfBlock = kFibers * kPointsOfFiber;
constexpr float kRadius = 0.0035f;
// In cm: 2^-16 is 0.4 % of a radius, and floats below 2^8 are exact to it.
constexpr double kGrain = 0x1p-16, kReach = 0x1p8;
constexpr float kApart = 32;

/// Pairs, in any order.
struct Answer {
  std::uint64_t count = 0, sum = 0;

  void add(SegmentPair pair) {
    std::uint64_t bits = static_cast<std::uint64_t>(pair.a) << 32 | static_cast<unsigned>(pair.b);
    bits = (bits ^ bits >> 29) * 0xbf58476d1ce4e5b9;
    sum += bits ^ bits >> 32;
    ++count;
  }
};

using SegmentId = std::int32_t;
using Points = std::vector<std::array<float, 3>>;

/// By the judge, without those that share a point.
Answer touchingSegments(const Points& points) {
  const auto at = [&](std::size_t i) {
    return Eigen::Vector3d(points[i][0], points[i][1], points[i][2]);
  };
  std::vector<SegmentId> ids;
  std::vector<Capsule> capsules;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if ((i + 1) % kPointsOfFiber == 0) continue;
    ids.push_back(static_cast<SegmentId>(i));
    capsules.push_back({at(i), at(i + 1), kRadius});
  }
  if (!touchingPairs(capsules, 0, Contact::kBoundary).empty()) {
    throw std::logic_error("rounding decides a pair");
  }
  Answer answer;
  for (const auto& [a, b] : touchingPairs(capsules)) {
    if (ids[a] + 1 != ids[b]) answer.add({ids[a], ids[b]});
  }
  return answer;
}

/// Coordinates begin at zero, and the block ends before kApart.
Points makeBlock(int frame) {
  const auto fibers = scenes::makeHelix({kFibers, kSegments, kRadius, 1, frame}).points;
  Points points(fibers.size());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double low = fibers[0][axis], high = low;
    for (const Point& point : fibers) {
      low = std::min(low, point[axis]);
      high = std::max(high, point[axis]);
    }
    if (high - low > kApart - 3 * kRadius) throw std::logic_error("blocks touch");
    for (std::size_t i = 0; i < points.size(); ++i) {
      points[i][axis] = static_cast<float>(std::round((fibers[i][axis] - low) / kGrain) * kGrain);
    }
  }
  return points;
}

/// Fills the points with copies of a block that form a cube.
void copyBlock(const Points& block, Points& points) {
  const std::size_t copies = points.size() / block.size();
  std::size_t edge = 1;
  while (edge * edge * edge < copies) ++edge;
  if (static_cast<double>(edge) * kApart > kReach) throw std::logic_error("floats are not exact");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t copy = i / block.size();
    const std::size_t place[3] = {copy % edge, copy / edge % edge, copy / edge / edge};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      points[i][axis] = block[i % block.size()][axis] + kApart * static_cast<float>(place[axis]);
    }
  }
}

/// A number of /proc/self/status, in GB.
double gigabytes(const std::string& name) {
  std::ifstream status("/proc/self/status");
  double kibibytes = 0;
  for (std::string word; status >> word && word != name;) continue;
  status >> kibibytes;
  return kibibytes * 1.024e-6;
}

template <class F>
void phase(const char* name, F&& work) {
  std::ofstream("/proc/self/clear_refs") << 5;  // starts the peak again
  const std::clock_t start = std::clock();
  const double time = tools::seconds(work);
  const double of_cores = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  std::printf("%-8s %7.2f s, %7.2f s of cores, at most %6.2f GB, then %6.2f GB\n", name, time,
              of_cores, gigabytes("VmHWM:"), gigabytes("VmRSS:"));
  std::fflush(stdout);
}

void find(const FiberTree& tree, std::uint64_t copies, const Answer& of_block) {
  constexpr auto kBlock = static_cast<SegmentId>(kPointsOfBlock);
  Answer found;
  phase("find", [&] {
    tree.visit(Pairs{}, [&](SegmentPair pair) {
      const SegmentId first = pair.a / kBlock * kBlock;
      found.add({pair.a - first, pair.b - first});
    });
  });
  std::printf("%llu pairs touch, which would take %.2f GB; the tree has %.2f GB\n",
              static_cast<unsigned long long>(found.count),
              static_cast<double>(found.count * sizeof(SegmentPair)) * 1e-9,
              static_cast<double>(tree.memoryUsage()) * 1e-9);
  if (found.count != copies * of_block.count || found.sum != copies * of_block.sum) {
    throw std::logic_error("these are not the pairs of the blocks");
  }
}

void measure(std::size_t millions, int threads) {
  Points points(millions * kPointsOfBlock);
  std::vector<std::size_t> point_begin(millions * kFibers + 1);
  for (std::size_t f = 0; f < point_begin.size(); ++f) point_begin[f] = f * kPointsOfFiber;
  const FiberArrays<float> fibers = {points[0].data(), points.size(), point_begin.data(),
                                     point_begin.size() - 1, &kRadius};
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = 1;
  options.threads = threads;
  FiberTree tree(options);
  for (const int frame : {0, 1}) {
    const Points block = makeBlock(frame);
    const Answer of_block = touchingSegments(block);
    copyBlock(block, points);
    if (frame == 0) {
      phase("build", [&] { tree.build(fibers); });
    } else {
      phase("update", [&] { tree.update(fibers); });
    }
    find(tree, millions, of_block);
  }
}

}  // namespace
}  // namespace fcl_fibers::benchmarks

int main(int argc, char** argv) {
  try {
    fcl_fibers::benchmarks::measure(argc > 1 ? std::stoul(argv[1]) : 100,
                                    argc > 2 ? std::stoi(argv[2]) : 2);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fcl_fibers_large: %s\n", error.what());
    return 1;
  }
  return 0;
}
