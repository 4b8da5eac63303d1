// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "harness/runs.h"
#include "measures.h"
#include "scenes/ball.h"
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

using Frames = std::array<FiberPolylines, 2>;
/// Asks a tree of these fibers, and returns how much it finds.
using Ask = std::function<std::size_t(const FiberTree&, const FiberArrays<double>&)>;

template <class Question>
Ask countOf(const Question& question) {
  return [=](const FiberTree& tree, const auto&) {
    double count = 0;
    secondsOfCount(tree, question, count);
    return static_cast<std::size_t>(count);
  };
}

/// Fibers beside those that lack something, in turns: `times` is the ratio of the queries. It is an
/// error if what they find differs by more than one for a hundred segments, because the work is not
/// equal then.
/// @param is_step  asks for the motion from the first frame to the second
void registerBeside(const Frames& with, const Frames& without, const std::string& name,
                    const FiberTreeOptions& options, const Ask& ask, bool is_step = false) {
  const auto sides = std::make_shared<std::array<Frames, 2>>();
  *sides = {with, without};
  const std::array trees = {makeTree(fiberArrays(with[0]), options),
                            makeTree(fiberArrays(without[0]), options)};
  registerRuns("Costs/arrays/" + name, kRuns, [=, turn = 0u](Numbers& numbers) mutable {
    std::array<double, 2> update, query, found;
    ++turn;
    for (const std::size_t side : {turn % 2, (turn + 1) % 2}) {
      const FiberArrays<double> start = fiberArrays((*sides)[side][0]),
                                end = fiberArrays((*sides)[side][1]);
      FiberTree& tree = *trees[side];
      tree.update(start);
      update[side] = seconds([&] { is_step ? tree.update(start, end) : tree.update(end); });
      query[side] = seconds([&] { found[side] = static_cast<double>(ask(tree, end)); });
    }
    numbers["update"] = update[0];
    numbers["detection"] = query[0];
    numbers["times"] = query[0] / query[1];
    numbers["pairs"] = found[0];
    numbers["pairs_without"] = found[1];
    if (std::fabs(found[0] - found[1]) > 0.01 * static_cast<double>(trees[0]->segmentCount())) {
      throw std::runtime_error("finds " + std::to_string(found[0]) + ", and " +
                               std::to_string(found[1]) + " without it");
    }
    return addCounts(numbers, trees[0]->memoryUsage(), trees[0]->segmentCount());
  });
}

/// Radii at points that differ by up to a tenth, with the same mean.
Frames withJitteredRadii(Frames frames) {
  for (FiberPolylines& fibers : frames) {
    scenes::Random random(56);
    fibers.radii_are = FiberArrays<double>::Radii::kPerPoint;
    for (std::size_t i = 0; i < fibers.points.size(); ++i) {
      fibers.radii.push_back(fibers.radius * (0.9 + 0.2 * random.uniform()));
    }
  }
  return frames;
}

/// Tapers and branches beside fibers without them.
void registerTapersAndBranches(const Frames& frames) {
  const Frames tapered = withJitteredRadii(frames);
  const TriangleMesh mesh(scenes::makeBall({3, 3, 3}, 10000).arrays());
  const auto add = [&](const std::string& name, const Ask& ask, bool is_step = false) {
    registerBeside(tapered, frames,
                   "boxes, capsules, neighbours by number, radii at points differ by 10 %" + name,
                   touchingOptions(1), ask, is_step);
  };
  add("", countOf(Pairs{}));
  add(", impacts", countOf(Impacts{}), true);
  add(
      ", safe step", [](const FiberTree& tree, const auto&) { return tree.safeStep() < 1; }, true);
  add(", contacts with a mesh", [mesh](const FiberTree& tree, const FiberArrays<double>& fibers) {
    std::vector<MeshContact> contacts;
    tree.find(Contacts{fibers}, mesh, contacts);
    return contacts.size();
  });
  add(", closest", [](const FiberTree& tree, const FiberArrays<double>& fibers) {
    return tree.closest(Contacts{fibers}).pair.a >= 0;
  });
  SceneRequest neuron;
  neuron.text = "neuron:fibers=10,segments=200";
  const Frames branched = twoFrames(neuron);
  // Its pairs at branching points are few, as a fiber has 200 segments from one to the next.
  Frames unbranched = branched;
  for (FiberPolylines& fibers : unbranched) fibers.starts_at.clear();
  registerBeside(branched, unbranched, "boxes, capsules, neighbours by number, branches",
                 touchingOptions(1), countOf(Pairs{}));
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
  registerTree(frames, "boxes, super thread", super_thread);
  registerTree(frames, "spheres", spheres(plain));
  registerTree(frames, "spheres, neighbours by arc length", spheres(arc_length));
  registerTree(frames, "spheres, capsules", spheres(capsules));
  registerTree(frames, "spheres, super thread", spheres(super_thread));

  registerTapersAndBranches(frames);

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
