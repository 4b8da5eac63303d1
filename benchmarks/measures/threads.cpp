// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

#include "harness/runs.h"
#include "measures.h"
#include "measures/paper/tree_scene.h"
#include "tests/support/job_counts.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

/// What the runs of one scene share.
struct Scene {
  explicit Scene(const SceneRequest& request)
      : frames(twoFrames(request)), fibers(request.text, frames[0], frames[1]) {}

  std::array<FiberPolylines, 2> frames;
  MovingFibers fibers;  ///< the same as objects
  std::vector<SegmentPair> kept_pairs;
  std::vector<BareContact> kept_contacts;
  Numbers answers;  ///< of the first run
};

/// The stages of one run.
class Stages {
 public:
  Stages(Scene& scene, Numbers& numbers) : scene_(scene), numbers_(numbers) {}

  void set(const char* name, double number) { numbers_[name] = number; }

  template <class Work>
  void time(const char* stage, Work&& work) {
    set(stage, seconds(work));
  }

  /// Times a stage that returns how much it has found, which has to be what all other runs find.
  template <class Work>
  void timeQuery(const char* stage, const std::string& answer, Work&& work) {
    std::size_t found = 0;
    time(stage, [&] { found = work(); });
    const auto number = static_cast<double>(found);
    const double first = scene_.answers.emplace(answer, number).first->second;
    if (first != number) {
      throw std::runtime_error(std::string(stage) + ": " + std::to_string(found) +
                               " instead of the first run's " +
                               std::to_string(static_cast<std::size_t>(first)));
    }
    numbers_[answer] = number;
  }

 private:
  Scene& scene_;
  Numbers& numbers_;
};

FiberOptions optionsOf(Report report, int threads) {
  FiberOptions options = touchingOptions(report == Report::kCapsules ? 1 : 0, threads);
  options.report = report;
  return options;
}

std::size_t countOf(const FiberTree& tree) {
  std::size_t count = 0;
  tree.visit(Pairs{}, [&count](SegmentPair) { ++count; });
  return count;
}

void runArrays(Scene& scene, int threads, Stages& stages) {
  const FiberArrays<double> before = fiberArrays(scene.frames[0]);
  const FiberArrays<double> after = fiberArrays(scene.frames[1]);
  FiberTree capsules(optionsOf(Report::kCapsules, threads));
  stages.time("build", [&] { capsules.build(before); });
  capsules.update(after);
  stages.time("update", [&] { capsules.update(before); });
  stages.timeQuery("query_capsules", "touching", [&] { return countOf(capsules); });
  stages.timeQuery("find_contacts", "touching", [&] {
    capsules.find(Contacts{before}, scene.kept_contacts);
    return scene.kept_contacts.size();
  });
  stages.timeQuery("frame", "touching_after", [&] {
    capsules.update(after);
    return countOf(capsules);
  });

  FiberTree volumes(optionsOf(Report::kVolumes, threads));
  volumes.build(before);
  stages.timeQuery("query_volumes", "pairs", [&] { return countOf(volumes); });
  stages.timeQuery("find_pairs", "pairs", [&] {
    volumes.find(Pairs{}, scene.kept_pairs);
    return scene.kept_pairs.size();
  });
  stages.timeQuery("find_new_pairs", "pairs", [&] {
    std::vector<SegmentPair> pairs;
    volumes.find(Pairs{}, pairs);
    return pairs.size();
  });
}

/// What the threads of a query share: the same on every machine. No public call tells it.
void runJobs(Scene& scene, int /*threads*/, Stages& stages) {
  const TreeScene world(scene.fibers);
  tree::LayeredBoxTree<8> tree(bundle(world.fibers, world.middles()));
  tree.refit(world.segments, 0);
  const test::JobCounts counts = test::countJobs(tree);
  stages.set("tasks", static_cast<double>(counts.tasks));
  stages.set("jobs", static_cast<double>(counts.jobs));
  stages.set("least_tests", counts.least);
  stages.set("median_tests", counts.median);
  stages.set("most_tests", counts.most);
  stages.set("tests", counts.tests);
  stages.set("barriers", static_cast<double>(counts.barriers));
}

void runManager(Scene& scene, int threads, Stages& stages) {
  MovingFibers& fibers = scene.fibers;
  const auto countOf = [](const Manager& manager) { return countPairs(manager).pairs; };
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    const bool boxes = report == Report::kVolumes;
    LayeredAABBTreeCollisionManagerd manager(FiberManagerOptions{optionsOf(report, threads)});
    fibers.setPoses(0);
    stages.time(boxes ? "set_up_volumes" : "set_up_capsules", [&] {
      for (const auto& fiber : fibers.fibers()) manager.registerFiber(fiber.objects, fiber.ends);
      manager.setup();
    });
    fibers.setPoses(1);
    manager.update();
    fibers.setPoses(0);
    stages.time(boxes ? "update_volumes" : "update_capsules", [&] { manager.update(); });
    stages.timeQuery(boxes ? "collide_volumes" : "collide_capsules",
                     boxes ? "objects_pairs" : "objects_touching",
                     [&] { return countOf(manager); });
  }
}

/// What the machine gains: each thread sums squares of its share of the points, so often that the
/// start of the threads takes no part of the time.
void runLoop(Scene& scene, int threads, Stages& stages) {
  constexpr std::size_t kPoints = 50'000'000;
  const std::vector<Point>& points = scene.frames[0].points;
  const std::size_t passes = (kPoints + points.size() - 1) / points.size();
  const auto sumShare = [&points, passes](std::size_t begin, std::size_t end) {
    for (std::size_t pass = 0; pass < passes; ++pass) {
      Point sums = {0, 0, 0};
      for (std::size_t i = begin; i < end; ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis)
          sums[axis] += points[i][axis] * points[i][axis];
      }
      benchmark::DoNotOptimize(sums);
      benchmark::ClobberMemory();
    }
  };
  const auto share = [&points, count = static_cast<std::size_t>(threads)](std::size_t thread) {
    return points.size() * thread / count;
  };
  const double taken = seconds([&] {
    std::vector<std::thread> others;
    for (std::size_t t = 1; t < static_cast<std::size_t>(threads); ++t) {
      others.emplace_back(sumShare, share(t), share(t + 1));
    }
    sumShare(0, share(1));
    for (std::thread& other : others) other.join();
  });
  stages.set("pass", taken / static_cast<double>(passes));
}

/// 1, 2, 4, ... up to the number that the machine has, and that number.
std::vector<int> threadsOfMachine() {
  const int all = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::vector<int> threads;
  for (int n = 1; n < all; n *= 2) threads.push_back(n);
  threads.push_back(all);
  return threads;
}

bool measureThreads(const Request& request) {
  tools::progress(request.scene.text + ": make the scene");
  const auto scene = std::make_shared<Scene>(request.scene);
  using Run = void (*)(Scene&, int, Stages&);
  for (const auto& [name, run] : {std::pair<const char*, Run>{"loop", runLoop},
                                  {"jobs", runJobs},
                                  {"arrays", runArrays},
                                  {"manager", runManager}}) {
    const bool counts = run == runJobs;
    for (const int threads : counts                    ? std::vector<int>{1}
                             : request.threads.empty() ? threadsOfMachine()
                                                       : request.threads) {
      registerRuns(std::string("Threads/") + name + "/" + std::to_string(threads),
                   counts ? 1 : request.runs, [=, run = run](Numbers& numbers) {
                     Stages stages(*scene, numbers);
                     stages.set("segments", static_cast<double>(scene->fibers.segmentCount()));
                     return seconds([&] { run(*scene, threads, stages); });
                   });
    }
  }
  return runRegistered();
}

const AddMeasure kMeasure("threads", measureThreads);

}  // namespace

}  // namespace fcl_fibers::benchmarks
