// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "harness/runs.h"
#include "measures.h"
#include "scenes/random.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 9;

std::int32_t groupOf(std::size_t fiber) { return static_cast<std::int32_t>(fiber % 10) + 1; }

/// A scene as arrays that a case may add to.
template <typename S>
struct Arrays {
  explicit Arrays(const FiberPolylines& scene)
      : point_begin(scene.point_begin),
        radius(scene.points.size(), static_cast<S>(scene.radius)),
        closed(scene.fiberCount(), 1) {
    for (const Point& point : scene.points) {
      for (const double x : point) points.push_back(static_cast<S>(x));
    }
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) groups.push_back(groupOf(f));
    view = {points.data(), scene.points.size(), point_begin.data(), scene.fiberCount(),
            radius.data()};
  }

  std::vector<S> points;
  std::vector<std::size_t> point_begin;
  std::vector<S> radius;
  std::vector<std::uint8_t> closed;
  std::vector<std::int32_t> groups;
  FiberArrays<S> view;
};

/// Returns the seconds of a frame.
double addCounts(Numbers& numbers, std::size_t bytes, std::size_t segments) {
  numbers["bytes"] = static_cast<double>(bytes);
  numbers["segments"] = static_cast<double>(segments);
  return numbers["update"] + numbers["detection"];
}

/// FiberTree over arrays of two frames, to which `add` adds.
template <typename S = double>
void registerTree(
    const std::array<FiberPolylines, 2>& scenes, const std::string& name,
    const FiberTreeOptions& options, void (*add)(Arrays<S>&) = [](Arrays<S>&) {}) {
  const auto frames = std::make_shared<std::vector<Arrays<S>>>(scenes.begin(), scenes.end());
  for (Arrays<S>& arrays : *frames) add(arrays);
  const auto tree = std::make_shared<FiberTree>(options);
  tree->build(frames->front().view);
  registerRuns("Costs/arrays/" + name, kRuns, [=](Numbers& numbers) {
    tree->update(frames->front().view);
    numbers["update"] = seconds([&] { tree->update(frames->back().view); });
    numbers["detection"] = secondsOfCount(*tree, Pairs{}, numbers["pairs"]);
    return addCounts(numbers, tree->memoryUsage(), tree->segmentCount());
  });
}

enum class Register { kLoose, kFibers, kGroups };

/// @param pose_before  1: an update finds everything where it was
template <class FiberManager = LayeredAABBTreeCollisionManagerd>
void registerManager(MovingFibers& fibers, const std::string& name, const FiberOptions& options,
                     Register as = Register::kFibers, int pose_before = 0,
                     Bounds bounds = Bounds::kShapesAndMargins) {
  const auto manager = std::make_shared<FiberManager>(FiberManagerOptions{options, bounds});
  if (as == Register::kLoose) manager->registerObjects(fibers.objects());
  for (std::size_t f = 0; as != Register::kLoose && f < fibers.fiberCount(); ++f) {
    const MovingFibers::Fiber& fiber = fibers.fibers()[f];
    const FiberGroup group{as == Register::kGroups ? groupOf(f) : 0};
    manager->registerFiber(fiber.objects, fiber.ends, group);
  }
  manager->setup();
  registerRuns("Costs/objects/" + name, kRuns, [=, &fibers](Numbers& numbers) {
    fibers.setPoses(pose_before);
    manager->update();
    fibers.setPoses(1);
    numbers["update"] = seconds([&] { manager->update(); });
    std::size_t pairs = 0;
    numbers["detection"] = seconds([&] { pairs = countPairs(*manager).pairs; });
    numbers["pairs"] = static_cast<double>(pairs);
    return addCounts(numbers, manager->memoryUsage(), fibers.segmentCount());
  });
}

/// By up to a tenth of each, with the same mean.
void jitterRadii(std::vector<double>& radii) {
  scenes::Random random(56);
  for (double& radius : radii) radius *= 0.9 + 0.2 * random.uniform();
}

template <class Set>
FiberTreeOptions with(Set set) {
  FiberTreeOptions options = FiberOptions{Topology::kBundle, Report::kVolumes};
  set(options);
  return options;
}

FiberTreeOptions spheres(FiberTreeOptions options) {
  options.volumes = FiberTreeOptions::Volumes::kWrappedSpheres;
  return options;
}

bool measureCosts(const Request&) {
  using Radii = FiberArrays<double>::Radii;
  tools::progress("costs: make the scenes");
  SceneRequest helix;
  helix.text = "helix:fibers=1000,segments=100";
  const auto frames = twoFrames(helix);
  MovingFibers fibers(helix.text, frames[0], frames[1]);

  const FiberTreeOptions plain = FiberOptions{Topology::kBundle, Report::kVolumes};
  const auto neighbors = with([](auto& options) { options.ignored_neighbors = 1; });
  const auto arc_length = with([](auto& options) { options.ignored_arc_length = 0.3; });
  const auto margin = with([](auto& options) { options.margin = 0.0035; });
  const auto threads = with([](auto& options) { options.threads = 2; });
  const auto capsules = with([](auto& options) { options.report = Report::kCapsules; });
  const auto super_thread = with([](auto& options) { options.topology = Topology::kSuperThread; });
  FiberTreeOptions much = arc_length;
  much.report = Report::kCapsules;
  much.threads = 2;
  const auto addGroups = [](Arrays<double>& arrays) { arrays.view.groups = arrays.groups.data(); };

  registerTree(frames, "boxes", plain);
  registerTree<float>(frames, "boxes, float", plain);
  registerTree<double>(frames, "boxes, radius by fiber", plain,
                       [](auto& arrays) { arrays.view.radii_are = Radii::kPerFiber; });
  registerTree<double>(frames, "boxes, radius by segment", plain,
                       [](auto& arrays) { arrays.view.radii_are = Radii::kPerFirstPoint; });
  registerTree(frames, "boxes, neighbours by number", neighbors);
  registerTree<double>(frames, "boxes, neighbours by number, closed fibers", neighbors,
                       [](auto& arrays) { arrays.view.closed = arrays.closed.data(); });
  registerTree(frames, "boxes, neighbours by arc length", arc_length);
  registerTree<double>(frames, "boxes, groups", plain, addGroups);
  registerTree(frames, "boxes, 2 threads", threads);
  registerTree(frames, "boxes, margin of a radius", margin);
  registerTree<double>(frames, "boxes, capsules, arc length, groups, 2 threads", much, addGroups);
  registerTree(frames, "boxes, capsules", capsules);
  registerTree<double>(frames, "boxes, capsules, radius by point, that differ by 10 %", capsules,
                       [](auto& arrays) {
                         jitterRadii(arrays.radius);
                         arrays.view.radii_are = Radii::kPerPoint;
                       });
  registerTree(frames, "boxes, super thread", super_thread);
  registerTree(frames, "spheres", spheres(plain));
  registerTree(frames, "spheres, neighbours by arc length", spheres(arc_length));
  registerTree(frames, "spheres, capsules", spheres(capsules));
  registerTree(frames, "spheres, super thread", spheres(super_thread));

  registerManager(fibers, "boxes, loose objects", plain, Register::kLoose);
  registerManager(fibers, "boxes, fibers", plain);
  registerManager(fibers, "boxes, fibers, bounds of shapes", plain, Register::kFibers, 0,
                  Bounds::kShapes);
  registerManager(fibers, "boxes, fibers, bounds of objects", plain, Register::kFibers, 0,
                  Bounds::kObjects);
  registerManager(fibers, "boxes, fibers, none has moved", plain, Register::kFibers, 1);
  registerManager(fibers, "boxes, fibers, neighbours by number", neighbors);
  registerManager(fibers, "boxes, fibers, neighbours by arc length", arc_length);
  registerManager(fibers, "boxes, fibers, groups", plain, Register::kGroups);
  registerManager(fibers, "boxes, fibers, 2 threads", threads);
  registerManager(fibers, "boxes, fibers, capsules", capsules);
  registerManager(fibers, "boxes, fibers, super thread", super_thread);
  registerManager(fibers, "boxes, fibers, capsules, arc length, groups, 2 threads", much,
                  Register::kGroups);
  using SphereManager = WrappedSphereTreeCollisionManagerd;
  registerManager<SphereManager>(fibers, "spheres, fibers", plain);
  registerManager<SphereManager>(fibers, "spheres, fibers, capsules", capsules);
  return runRegistered();
}

const AddMeasure kMeasure("costs", measureCosts);

}  // namespace

}  // namespace fcl_fibers::benchmarks
