// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>

#include "harness/runs.h"
#include "measures.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 9;

struct FloatBox {
  float low[3], high[3];
};

/// The least that an update can do: it reads every point and writes a box for each capsule, one
/// after the other, without rounding outward and without a tree.
void writeBoxes(const FiberPolylines& scene, std::vector<FloatBox>& boxes) {
  const auto radius = static_cast<float>(scene.radius);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Point &p = scene.points[i], &q = scene.points[i + 1];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      boxes[i].low[axis] = static_cast<float>(std::min(p[axis], q[axis])) - radius;
      boxes[i].high[axis] = static_cast<float>(std::max(p[axis], q[axis])) + radius;
    }
  }
  benchmark::DoNotOptimize(boxes.data());
  benchmark::ClobberMemory();
}

/// What one scene needs in all its runs.
struct Scene {
  explicit Scene(const SceneRequest& request) : frames(twoFrames(request)) {
    boxes.resize(frames[0].points.size() - 1);
  }

  std::array<FiberPolylines, 2> frames;
  std::vector<FloatBox> boxes;
};

/// Seconds of the loop, a build, an update after motion, one without, and a query.
void registerTree(const std::string& name, const std::shared_ptr<Scene>& scene,
                  const FiberTreeOptions& options) {
  const auto tree = std::make_shared<FiberTree>(options);
  registerRuns("Arrays/" + name, kRuns, [=](Numbers& numbers) {
    const FiberArrays<double> before = fiberArrays(scene->frames[0]);
    const FiberArrays<double> after = fiberArrays(scene->frames[1]);
    writeBoxes(scene->frames[0], scene->boxes);
    numbers["loop"] = seconds([&] { writeBoxes(scene->frames[1], scene->boxes); });
    numbers["build"] = seconds([&] { tree->build(before); });
    tree->update(after);
    tree->update(before);
    numbers["update"] = seconds([&] { tree->update(after); });
    numbers["unmoved"] = seconds([&] { tree->update(after); });
    numbers["query"] = secondsOfCount(*tree, Pairs{}, numbers["pairs"]);
    numbers["segments"] = static_cast<double>(tree->segmentCount());
    numbers["bytes"] = static_cast<double>(tree->memoryUsage());
    return numbers["update"] + numbers["query"];
  });
}

bool measureArrays(const Request& request) {
  tools::progress(request.scene.text + ": make the scene");
  const auto scene = std::make_shared<Scene>(request.scene);
  for (const auto volumes :
       {FiberTreeOptions::Volumes::kLayeredBoxes, FiberTreeOptions::Volumes::kWrappedSpheres}) {
    const bool boxes = volumes == FiberTreeOptions::Volumes::kLayeredBoxes;
    for (const auto report : {Report::kVolumes, Report::kCapsules}) {
      for (const int threads : {1, 2}) {
        FiberTreeOptions options = FiberOptions{Topology::kBundle, Report::kVolumes};
        options.volumes = volumes;
        options.report = report;
        options.threads = threads;
        std::string name = boxes ? "boxes" : "spheres";
        if (report == Report::kCapsules) name += "_capsules";
        if (threads == 2) name += "_2_threads";
        registerTree(name, scene, options);
      }
    }
  }
  return runRegistered();
}

const AddMeasure kMeasure("arrays", measureArrays);

}  // namespace

}  // namespace fcl_fibers::benchmarks
