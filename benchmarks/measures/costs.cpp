// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/scenes/helix.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "harness/progress.h"
#include "harness/runs.h"
#include "measures.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kFibers = 1000, kSegments = 100, kRuns = 9;

/// The scene as arrays that a combination may add to.
template <typename S>
struct Arrays {
  explicit Arrays(int frame) {
    scenes::HelixParameters parameters;
    parameters.fibers = kFibers;
    parameters.segments = kSegments;
    parameters.frame = frame;
    const scenes::FiberScene scene = scenes::makeHelix(parameters);
    for (const scenes::Point& point : scene.points) {
      for (const double x : point) points.push_back(static_cast<S>(x));
    }
    point_begin = scene.point_begin;
    radius.assign(scene.points.size(), static_cast<S>(scene.radius));
    view = {points.data(), scene.points.size(), point_begin.data(), scene.fiberCount(),
            radius.data()};
  }

  std::vector<S> points;
  std::vector<std::size_t> point_begin;
  std::vector<S> radius;
  std::vector<std::uint8_t> closed = std::vector<std::uint8_t>(kFibers, 1);
  std::vector<std::int32_t> groups = [] {
    std::vector<std::int32_t> numbers(kFibers);
    for (std::size_t f = 0; f < numbers.size(); ++f) {
      numbers[f] = static_cast<std::int32_t>(f % 10) + 1;
    }
    return numbers;
  }();
  FiberArrays<S> view;
};

template <typename S, class Change>
void registerTree(const std::string& name, const FiberTreeOptions& options, Change change) {
  const auto frames = std::make_shared<std::vector<Arrays<S>>>();
  frames->reserve(2);
  for (const int frame : {0, 1}) {
    frames->emplace_back(frame);
    change(frames->back());
  }
  const auto tree = std::make_shared<FiberTree>(options);
  tree->build((*frames)[0].view);
  registerRuns("Costs/arrays/" + name, kRuns, [=](Numbers& numbers) {
    tree->update((*frames)[0].view);
    numbers["update"] = seconds([&] { tree->update((*frames)[1].view); });
    std::size_t pairs = 0;
    numbers["detection"] = seconds([&] { tree->visitPairs([&](SegmentPair) { ++pairs; }); });
    numbers["bytes"] = static_cast<double>(tree->memoryUsage());
    numbers["segments"] = static_cast<double>(tree->segmentCount());
    numbers["pairs"] = static_cast<double>(pairs);
    return numbers["update"] + numbers["detection"];
  });
}

enum class Register { kLoose, kFibers, kGroups };

/// @param pose_before  1: an update finds everything where it was
template <class FiberManager = LayeredAABBTreeCollisionManagerd>
void registerManager(const std::string& name, const FiberManagerOptions& options,
                     const std::shared_ptr<MovingFibers>& fibers, Register as = Register::kFibers,
                     int pose_before = 0) {
  const auto manager = std::make_shared<FiberManager>(options);
  if (as == Register::kLoose) {
    manager->registerObjects(fibers->objects());
  } else {
    std::int32_t number = 0;
    for (const MovingFibers::Fiber& fiber : fibers->fibers()) {
      manager->registerFiber(fiber.objects, fiber.ends,
                             FiberGroup{as == Register::kGroups ? number++ % 10 + 1 : 0});
    }
  }
  manager->setup();
  registerRuns("Costs/objects/" + name, kRuns, [=](Numbers& numbers) {
    fibers->setPoses(pose_before);
    manager->update();
    fibers->setPoses(1);
    numbers["update"] = seconds([&] { manager->update(); });
    std::size_t pairs = 0;
    numbers["detection"] = seconds([&] { pairs = countPairs(*manager).pairs; });
    numbers["bytes"] = static_cast<double>(manager->memoryUsage());
    numbers["segments"] = static_cast<double>(fibers->segmentCount());
    numbers["pairs"] = static_cast<double>(pairs);
    return numbers["update"] + numbers["detection"];
  });
}

FiberTreeOptions with(FiberTreeOptions::Volumes volumes, Topology topology, Report report) {
  FiberTreeOptions options;
  options.volumes = volumes;
  options.topology = topology;
  options.report = report;
  return options;
}

}  // namespace

bool measureCosts(const Request&) {
  using Volumes = FiberTreeOptions::Volumes;
  showProgress("costs: make the scenes");
  const auto as_it_is = [](auto&) {};
  const FiberTreeOptions least;
  registerTree<double>("boxes", least, as_it_is);
  registerTree<float>("boxes, float", least, as_it_is);
  registerTree<double>("boxes, radius by fiber", least, [](auto& arrays) {
    arrays.view.radii_are = FiberArrays<double>::Radii::kPerFiber;
  });
  registerTree<double>("boxes, radius by segment", least, [](auto& arrays) {
    arrays.view.radii_are = FiberArrays<double>::Radii::kPerSegment;
  });
  FiberTreeOptions neighbors;
  neighbors.ignored_neighbors = 1;
  registerTree<double>("boxes, neighbours by number", neighbors, as_it_is);
  registerTree<double>("boxes, neighbours by number, closed fibers", neighbors,
                       [](auto& arrays) { arrays.view.closed = arrays.closed.data(); });
  FiberTreeOptions arc_length;
  arc_length.ignored_arc_length = 0.3;
  registerTree<double>("boxes, neighbours by arc length", arc_length, as_it_is);
  registerTree<double>("boxes, groups", least,
                       [](auto& arrays) { arrays.view.groups = arrays.groups.data(); });
  FiberTreeOptions threads;
  threads.threads = 2;
  registerTree<double>("boxes, 2 threads", threads, as_it_is);
  const auto kind = [&](const std::string& name, Volumes volumes, Topology topology,
                        Report report) {
    registerTree<double>(name, with(volumes, topology, report), as_it_is);
  };
  FiberTreeOptions margin;
  margin.margin = 0.0035;
  registerTree<double>("boxes, margin of a radius", margin, as_it_is);
  FiberTreeOptions much = arc_length;
  much.report = Report::kCapsules;
  much.threads = 2;
  registerTree<double>("boxes, capsules, arc length, groups, 2 threads", much,
                       [](auto& arrays) { arrays.view.groups = arrays.groups.data(); });
  FiberTreeOptions sphere_neighbors = arc_length;
  sphere_neighbors.volumes = Volumes::kWrappedSpheres;
  registerTree<double>("spheres, neighbours by arc length", sphere_neighbors, as_it_is);
  kind("boxes, capsules", Volumes::kLayeredBoxes, Topology::kBundle, Report::kCapsules);
  kind("boxes, super thread", Volumes::kLayeredBoxes, Topology::kSuperThread, Report::kVolumes);
  kind("spheres", Volumes::kWrappedSpheres, Topology::kBundle, Report::kVolumes);
  kind("spheres, capsules", Volumes::kWrappedSpheres, Topology::kBundle, Report::kCapsules);
  kind("spheres, super thread", Volumes::kWrappedSpheres, Topology::kSuperThread, Report::kVolumes);

  SceneRequest helix;
  helix.text = "helix:fibers=" + std::to_string(kFibers) + ",segments=" + std::to_string(kSegments);
  const auto fibers = std::make_shared<MovingFibers>(movingFibers(openScene(helix)));
  FiberManagerOptions capsules, super_thread, all = arc_length;
  capsules.report = Report::kCapsules;
  super_thread.topology = Topology::kSuperThread;
  all.report = Report::kCapsules;
  all.threads = 2;
  registerManager("boxes, loose objects", {}, fibers, Register::kLoose);
  registerManager("boxes, fibers", {}, fibers);
  registerManager("boxes, fibers, none has moved", {}, fibers, Register::kFibers, 1);
  registerManager("boxes, fibers, neighbours by number", neighbors, fibers);
  registerManager("boxes, fibers, neighbours by arc length", arc_length, fibers);
  registerManager("boxes, fibers, groups", {}, fibers, Register::kGroups);
  registerManager("boxes, fibers, 2 threads", threads, fibers);
  registerManager("boxes, fibers, capsules", capsules, fibers);
  registerManager("boxes, fibers, super thread", super_thread, fibers);
  registerManager("boxes, fibers, capsules, arc length, groups, 2 threads", all, fibers,
                  Register::kGroups);
  registerManager<WrappedSphereTreeCollisionManagerd>("spheres, fibers", {}, fibers);
  registerManager<WrappedSphereTreeCollisionManagerd>("spheres, fibers, capsules", capsules,
                                                      fibers);
  return runRegistered();
}

}  // namespace fcl_fibers::benchmarks
