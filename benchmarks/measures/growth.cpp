// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/scenes/helix.h>

#include "harness/progress.h"
#include "harness/runs.h"
#include "measures.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kFibers[] = {1'000, 10'000, 100'000};  // of 100 segments
constexpr int kRuns = 5, kRunsOfLargest = 3;

/// A helix scene as plain arrays, at rest and moved, and a tree over it.
class GrowingHelix {
 public:
  explicit GrowingHelix(int fibers) {
    scenes::HelixParameters parameters;
    parameters.fibers = fibers;
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

  double frame(Numbers& numbers) {
    frame_ = 1 - frame_;
    const double update = seconds([&] { tree_.update(arrays(frame_)); });
    std::size_t pairs = 0;
    const double detection = seconds([&] { tree_.visitPairs([&](SegmentPair) { ++pairs; }); });
    const auto segments = static_cast<double>(segmentCount());
    numbers["segments"] = segments;
    numbers["update"] = update / segments;
    numbers["detection"] = detection / segments;
    numbers["answer"] = static_cast<double>(pairs) / segments;
    numbers["bytes"] = static_cast<double>(tree_.memoryUsage()) / segments;
    return update + detection;
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

bool measureGrowth(const Request&) {
  for (const int fibers : kFibers) {
    showProgress("make " + std::to_string(fibers) + " fibers");
    const auto helix = std::make_shared<GrowingHelix>(fibers);
    const int runs = fibers == kFibers[2] ? kRunsOfLargest : kRuns;
    registerRuns("Growth/" + std::to_string(helix->segmentCount()), runs,
                 [helix](Numbers& numbers) { return helix->frame(numbers); });
  }
  return runRegistered();
}

}  // namespace fcl_fibers::benchmarks
