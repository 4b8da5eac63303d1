// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/live_pairs.h>

#include "harness/runs.h"
#include "measures.h"
#include "measures/live_motions.h"
#include "measures/live_steps.h"

namespace fcl_fibers::benchmarks {
namespace {

/// A tree that searches in every step.
class Searched {
 public:
  explicit Searched(const FiberPolylines& fibers) : tree_(touchingOptions(1)) {
    tree_.build(fiberArrays(fibers));
  }
  void moveTo(const FiberPolylines& fibers) { fibers_ = &fibers; }
  void update() { tree_.update(fiberArrays(*fibers_)); }
  template <class Visitor>
  void visit(Visitor&& visit) const {
    tree_.visit(Pairs{}, visit);
  }

 private:
  const FiberPolylines* fibers_ = nullptr;
  FiberTree tree_;
};

constexpr double kChosen = -1;  ///< a skin

/// A tree whose pairs live.
class Listed {
 public:
  explicit Listed(const FiberPolylines& fibers, double skin = kChosen)
      : tree_(touchingOptions(1)), live_(tree_, {skin}) {
    tree_.build(fiberArrays(fibers));
    live_.update();
  }
  void moveTo(const FiberPolylines& fibers) { fibers_ = &fibers; }
  void update() {
    tree_.update(fiberArrays(*fibers_));
    live_.update();
  }
  template <class Visitor>
  void visit(Visitor&& visit) const {
    live_.visit([&visit](SegmentPair pair, std::int32_t) { visit(pair); });
  }
  const LivePairs<>& live() const { return live_; }

 private:
  const FiberPolylines* fibers_ = nullptr;
  FiberTree tree_;
  LivePairs<> live_;
};

/// Compares a search with a list of this skin.
/// @param radii  the skin, in radii
double runTrees(const std::string& motion, const SceneRequest& request, double radii,
                Numbers& numbers) {
  double radius = 0;
  const auto makeSearched = [](const FiberPolylines& fibers) {
    return std::make_unique<Searched>(fibers);
  };
  const auto makeListed = [&](const FiberPolylines& fibers) {
    radius = fibers.radius;
    return std::make_unique<Listed>(fibers, radii * radius);
  };
  const auto listed = runSteps(motion, request, numbers, makeSearched, makeListed);
  const LivePairsCounters counters = listed->live().counters();
  const auto updates = static_cast<double>(counters.updates);
  numbers["skin"] = listed->live().skin() / radius;
  numbers["listings"] = static_cast<double>(counters.listings);
  numbers["longest_life"] = static_cast<double>(counters.longest_life);
  numbers["uncovered"] = static_cast<double>(counters.uncovered_pairs) / updates;
  numbers["tested"] = static_cast<double>(counters.tested_pairs) / updates;
  numbers["tested_touching"] = static_cast<double>(counters.touching_pairs) / updates;
  numbers["bytes"] = static_cast<double>(listed->live().memoryUsage());
  return numbers["with_total"];
}

bool measureLive(const Request& request) {
  registerMotions("Live", request, [&request](const std::string& motion, Numbers& numbers) {
    return runTrees(motion, request.scene, kChosen, numbers);
  });
  return runRegistered();
}

bool measureSkins(const Request& request) {
  for (const std::string radii : {"0", "0.25", "0.5", "1", "2", "4", "chosen"}) {
    const double skin = radii == "chosen" ? kChosen : std::stod(radii);
    registerMotions("LiveSkins/" + radii, request,
                    [&request, skin](const std::string& motion, Numbers& numbers) {
                      return runTrees(motion, request.scene, skin, numbers);
                    });
  }
  return runRegistered();
}

/// How far each point may move, from a list of one radius that lives.
double runSafeDistances(const std::string& motion, const SceneRequest& request, Numbers& numbers) {
  const SceneSource source = openScene(request.text, request.radius);
  FiberPolylines fibers = source.scene();
  const Mover move = makeMover(motion, source);
  Listed listed(fibers, fibers.radius);
  std::vector<double> distances, times, updates;
  double sum = 0;
  for (int step = 0; step < request.steps; ++step) {
    move(fibers.points);
    listed.moveTo(fibers);
    updates.push_back(seconds([&] { listed.update(); }));
    times.push_back(seconds([&] { listed.live().safeDistances(distances); }));
    for (const double distance : distances) sum += distance;
  }
  numbers["update"] = Times::median(updates);
  numbers["safe"] = Times::median(times);
  numbers["safe_longest"] = *std::max_element(times.begin(), times.end());
  numbers["distance"] =
      sum / (request.steps * static_cast<double>(distances.size()) * fibers.radius);
  numbers["segments"] = static_cast<double>(fibers.segmentCount());
  numbers["listings"] = static_cast<double>(listed.live().counters().listings);
  return numbers["safe"];
}

bool measureSafeDistances(const Request& request) {
  registerMotions("SafeDistances", request,
                  [&request](const std::string& motion, Numbers& numbers) {
                    return runSafeDistances(motion, request.scene, numbers);
                  });
  return runRegistered();
}

const AddMeasure kMeasure("live", measureLive), kSkins("live-skins", measureSkins),
    kSafeDistances("safe-distances", measureSafeDistances);

}  // namespace

}  // namespace fcl_fibers::benchmarks
