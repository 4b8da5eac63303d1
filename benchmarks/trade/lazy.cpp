// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <fcl_fibers/scenes/paper_scenes.h>

#include "contender.h"
#include "parts.h"
#include "progress.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 9;

struct BoxOfSegment {
  std::array<double, 3> low, high;
};

BoxOfSegment boxOf(const scenes::FiberScene& scene, std::size_t i, double fatness) {
  BoxOfSegment box;
  const double r = scene.radiusAt(i) + fatness;
  for (std::size_t k = 0; k < 3; ++k) {
    box.low[k] = std::min(scene.points[i][k], scene.points[i + 1][k]) - r;
    box.high[k] = std::max(scene.points[i][k], scene.points[i + 1][k]) + r;
  }
  return box;
}

bool contains(const BoxOfSegment& outer, const BoxOfSegment& inner) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (inner.low[k] < outer.low[k] || inner.high[k] > outer.high[k]) return false;
  }
  return true;
}

/// Share of the segments that leave their fat box in a step, over all steps.
double shareThatLeaves(const std::vector<scenes::FiberScene>& steps, double fatness) {
  std::vector<std::size_t> firsts;  // points that a segment starts at
  for (std::size_t f = 0; f < steps[0].fiberCount(); ++f) {
    const std::size_t last = steps[0].point_begin[f + 1] - 1;
    for (std::size_t i = steps[0].point_begin[f]; i < last; ++i) firsts.push_back(i);
  }
  std::vector<BoxOfSegment> fat;
  for (const std::size_t first : firsts) fat.push_back(boxOf(steps[0], first, fatness));
  std::size_t left = 0;
  for (std::size_t s = 1; s < steps.size(); ++s) {
    for (std::size_t i = 0; i < fat.size(); ++i) {
      if (contains(fat[i], boxOf(steps[s], firsts[i], 0))) continue;
      fat[i] = boxOf(steps[s], firsts[i], fatness);
      ++left;
    }
  }
  return static_cast<double>(left) / static_cast<double>(fat.size() * (steps.size() - 1));
}

}  // namespace

void registerLazy(const PartRequest& request) {
  showProgress("dynamic: make the scene");
  scenes::PaperDynamicParameters parameters;
  parameters.seed = request.seed;
  const scenes::PaperDynamic assembly(parameters);
  const auto steps = std::make_shared<std::vector<scenes::FiberScene>>();
  for (int step = 0; step < assembly.steps(); ++step) steps->push_back(assembly.scene(step));

  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    for (const double radii : {0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0}) {
      const double fatness = radii * parameters.radius;
      const double share = radii == 0 ? 1 : shareThatLeaves(*steps, fatness);
      FiberTreeOptions options;
      options.report = report;
      options.margin = 2 * fatness;  // boxes are thickened by half of it
      const auto tree = std::make_shared<FiberTree>(options);
      const std::string name = std::string("Lazy/") +
                               (report == Report::kVolumes ? "volumes" : "capsules") +
                               "/radii:" + std::to_string(radii).substr(0, 4);
      registerRuns(name, kRuns, [=](Numbers& numbers) {
        tree->build(scenes::fiberArrays(steps->front()));
        double moved = 0, still = 0, detection = 0, pairs = 0;
        for (std::size_t s = 1; s < steps->size(); ++s) {
          const FiberArrays<double> arrays = scenes::fiberArrays((*steps)[s]);
          moved += seconds([&] { tree->update(arrays); });
          still += seconds([&] { tree->update(arrays); });
          detection += seconds([&] { tree->visitPairs([&](SegmentPair) { ++pairs; }); });
        }
        numbers["share"] = share;
        numbers["moved"] = moved;
        numbers["still"] = still;
        numbers["detection"] = detection;
        numbers["pairs"] = pairs;
        // As if a refit in part cost its share of one in full: it costs more.
        return still + share * (moved - still) + detection;
      });
    }
  }
}

}  // namespace fcl_fibers::benchmarks
