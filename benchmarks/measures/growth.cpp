// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/scenes/helix.h>

#include "parts.h"
#include "preflight.h"
#include "progress.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 5;
constexpr int kSmall = 10000, kTimesLarger = 10;  // fibers

/// A strand as plain arrays, at rest and moved, and a tree over it.
class GrowingStrand {
 public:
  GrowingStrand(const PartRequest& request, int fibers) {
    scenes::HelixParameters parameters;
    parameters.fibers = fibers;
    if (request.segments > 0) parameters.segments = request.segments;
    parameters.seed = request.seed;
    radius_ = parameters.radius;
    for (std::size_t frame = 0; frame < points_.size(); ++frame) {
      parameters.frame = static_cast<int>(frame);
      const scenes::FiberScene scene = scenes::makeHelix(parameters);
      points_[frame].reserve(3 * scene.points.size());
      for (const scenes::Point& point : scene.points) {
        points_[frame].insert(points_[frame].end(), point.begin(), point.end());
      }
    }
    const auto points_of_fiber = static_cast<std::size_t>(parameters.segments) + 1;
    for (std::size_t f = 0; f <= static_cast<std::size_t>(fibers); ++f) {
      point_begin_.push_back(f * points_of_fiber);
    }
    tree_.build(arrays(0));
  }

  std::size_t segmentCount() const { return tree_.segmentCount(); }

  void time(benchmark::State& state) {
    frame_ = 1 - frame_;
    const double update = seconds([&] { tree_.update(arrays(frame_)); });
    std::size_t pairs = 0;
    const double detection = seconds([&] { tree_.visitPairs([&](SegmentPair) { ++pairs; }); });
    state.SetIterationTime(update + detection);
    const auto segments = static_cast<double>(segmentCount());
    state.counters["segments"] = segments;
    state.counters["update"] = update / segments;
    state.counters["detection"] = detection / segments;
    state.counters["answer"] = static_cast<double>(pairs) / segments;
    state.counters["bytes"] = static_cast<double>(tree_.memoryUsage()) / segments;
  }

 private:
  FiberArrays<double> arrays(std::size_t frame) const {
    FiberArrays<double> fibers;
    fibers.points = points_[frame].data();
    fibers.point_count = points_[frame].size() / 3;
    fibers.point_begin = point_begin_.data();
    fibers.fiber_count = point_begin_.size() - 1;
    fibers.radii = &radius_;
    return fibers;
  }

  std::array<std::vector<double>, 2> points_;
  std::vector<std::size_t> point_begin_;
  double radius_;
  std::size_t frame_ = 0;
  FiberTree tree_;
};

}  // namespace

bool timeGrowth(const PartRequest& request) {
  const int small = request.fibers > 0 ? request.fibers : kSmall;
  std::vector<std::unique_ptr<GrowingStrand>> strands;
  for (const int fibers : {small, kTimesLarger * small}) {
    showProgress("make " + std::to_string(fibers) + " fibers");
    strands.push_back(std::make_unique<GrowingStrand>(request, fibers));
    GrowingStrand& strand = *strands.back();
    const std::string name = "Growth/" + std::to_string(strand.segmentCount());
    benchmark::RegisterBenchmark(name.c_str(),
                                 [&strand, name](benchmark::State& state) {
                                   showProgress("time " + name);
                                   for ([[maybe_unused]] auto _ : state) strand.time(state);
                                 })
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond)
        ->Iterations(1)
        ->Repetitions(kRuns);
  }
  return runRegistered();
}

}  // namespace fcl_fibers::benchmarks
