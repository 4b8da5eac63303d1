// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "contender.h"
#include "kdop_tree.h"
#include "parts.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 7;

struct Scene {
  std::array<KDopTree::Segments, 2> frame;
  std::size_t touching = 0;  ///< in the second, by the boxes
};

void registerTree(const std::string& name, int directions, Bounds bounds, const Frames& frames,
                  const std::shared_ptr<Scene>& scene) {
  const std::shared_ptr<KDopTree> tree =
      makeKDopTree(directions, bounds, tree::bundle(fibersOf(frames.frame[0]), scene->frame[0]));
  tree->refit(scene->frame[1]);
  const std::size_t pairs = tree->countPairs(), tests = tree->countVolumeTests();
  const std::size_t touching = tree->countTouching(scene->frame[1]);
  if (scene->touching == 0) scene->touching = touching;
  if (touching != scene->touching) {
    throw std::runtime_error(name + ": " + std::to_string(touching) + " pairs touch, not " +
                             std::to_string(scene->touching) + " as with boxes");
  }
  registerRuns("KDops/" + name + "/" + frames.name, kRuns,
               [=, fibers = frames.frame[0].fiberCount()](Numbers& numbers) {
                 tree->refit(scene->frame[0]);
                 numbers["update"] = seconds([&] { tree->refit(scene->frame[1]); });
                 numbers["detection"] = seconds([&] { tree->countPairs(); });
                 numbers["touching_detection"] =
                     seconds([&] { tree->countTouching(scene->frame[1]); });
                 numbers["fibers"] = static_cast<double>(fibers);
                 numbers["segments"] = static_cast<double>(scene->frame[0].size());
                 numbers["bytes"] = static_cast<double>(tree->memoryUsage());
                 numbers["pairs"] = static_cast<double>(pairs);
                 numbers["touching"] = static_cast<double>(touching);
                 numbers["tests"] = static_cast<double>(tests);
                 return numbers["update"] + numbers["touching_detection"];
               });
}

}  // namespace

void registerKDops(const Frames& frames) {
  const auto scene = std::make_shared<Scene>();
  for (std::size_t f : {0u, 1u}) scene->frame[f] = segmentsOf(frames.frame[f]);
  registerTree("6", 6, Bounds::kFloat, frames, scene);
  registerTree("6_double", 6, Bounds::kDouble, frames, scene);
  for (const int directions : {14, 18, 26}) {
    registerTree(std::to_string(directions), directions, Bounds::kFloat, frames, scene);
  }
}

}  // namespace fcl_fibers::benchmarks
