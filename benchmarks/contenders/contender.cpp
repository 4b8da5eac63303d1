// SPDX-License-Identifier: BSD-3-Clause
#include "contenders/contender.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fcl/broadphase/broadphase_SSaP.h>
#include <fcl/broadphase/broadphase_SaP.h>
#include <fcl/broadphase/broadphase_bruteforce.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree_array.h>
#include <fcl/broadphase/broadphase_interval_tree.h>
#include <fcl/broadphase/broadphase_spatialhash.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

namespace fcl_fibers::benchmarks {
namespace {

using Objects = std::vector<Object*>;
using Contenders = std::vector<Contender>;
using DynamicTree = fcl::DynamicAABBTreeCollisionManagerd;
using DynamicTreeArray = fcl::DynamicAABBTreeCollisionManager_Arrayd;

const char* boxesName(Boxes boxes) { return boxes == Boxes::kStock ? "stock" : "tight"; }

template <typename FiberManager>
Contender ours(const char* manager, const char* variant, Reported reported,
               const FiberManagerOptions& options) {
  const auto make = [options](const Objects&) { return std::make_unique<FiberManager>(options); };
  return {manager, variant, true, Boxes::kNone, reported, make};
}

/// Our trees with these options and other topologies and reports.
Contenders ourTrees(FiberManagerOptions options) {
  FiberManagerOptions capsules = options, super_thread = options;
  capsules.report = Report::kCapsules;
  super_thread.topology = Topology::kSuperThread;
  using BoxTree = LayeredAABBTreeCollisionManagerd;
  using SphereTree = WrappedSphereTreeCollisionManagerd;
  return {ours<BoxTree>("LayeredAABBTree", "boxes", Reported::kTightBoxes, options),
          ours<BoxTree>("LayeredAABBTree", "capsules", Reported::kTouching, capsules),
          ours<BoxTree>("LayeredAABBTree", "super_thread", Reported::kTightBoxes, super_thread),
          ours<SphereTree>("WrappedSphereTree", "spheres", Reported::kSpheres, options),
          ours<SphereTree>("WrappedSphereTree", "capsules", Reported::kTouching, capsules),
          ours<SphereTree>("WrappedSphereTree", "super_thread", Reported::kSpheres, super_thread)};
}

template <typename FclManager>
Contender fclManager(const char* manager, Boxes boxes) {
  const auto make = [](const Objects&) { return std::make_unique<FclManager>(); };
  return {manager, boxesName(boxes), false, boxes, Reported::kTouchingAtLeast, make};
}

template <typename FclTree>
Contender fclTree(const char* manager, Boxes boxes, int level) {
  const auto make = [level](const Objects&) {
    auto tree = std::make_unique<FclTree>();
    tree->tree_init_level = level;
    return tree;
  };
  // What the box tree is held to.
  const auto reported = boxes == Boxes::kTight ? Reported::kTightBoxes : Reported::kTouchingAtLeast;
  const std::string variant = boxesName(boxes) + ("_level_" + std::to_string(level));
  return {manager, variant, false, boxes, reported, make};
}

// FCL's hash wants to be told what it is for. Cells of 1.5 times the mean box edge: half or twice
// as much was slower on the helix. As many buckets as objects: four times as many gained nothing,
// and its default of 1000 makes it quadratic. Limits that the motion stays within: objects outside
// are compared with all others.
std::unique_ptr<Manager> makeSpatialHashing(const Objects& objects) {
  fcl::AABBd bounds;
  double edges = 0;
  for (const Object* object : objects) {
    const fcl::AABBd& box = object->getAABB();
    bounds += box;
    edges += (box.max_ - box.min_).sum();
  }
  const double mean_edge = edges / (3.0 * static_cast<double>(objects.size()));
  const fcl::Vector3d spare = 0.1 * (bounds.max_ - bounds.min_);
  return std::make_unique<fcl::SpatialHashingCollisionManagerd<>>(
      1.5 * mean_edge, bounds.min_ - spare, bounds.max_ + spare,
      static_cast<unsigned int>(objects.size()));
}

}  // namespace

std::string Contender::title() const {
  std::string title = manager + ", " + variant;
  std::replace(title.begin(), title.end(), '_', ' ');
  return title;
}

std::unique_ptr<Manager> Contender::setUp(const std::vector<Object*>& objects) const {
  std::unique_ptr<Manager> result = make(objects);
  result->registerObjects(objects);
  result->setup();
  return result;
}

std::unique_ptr<Manager> Contender::setUp(const MovingFibers& fibers) const {
  if (!leaves_out_adjacent) return setUp(fibers.objects());
  std::unique_ptr<Manager> result = make(fibers.objects());
  auto& fiber_manager = dynamic_cast<FiberCollisionManager<double>&>(*result);
  for (const MovingFibers::Fiber& fiber : fibers.fibers()) {
    fiber_manager.registerFiber(fiber.objects, fiber.ends);
  }
  result->setup();
  return result;
}

std::vector<Contender> ourContenders() {
  Contenders contenders = ourTrees({});
  FiberManagerOptions two;
  two.threads = 2;
  for (Contender& contender : ourTrees(two)) {
    if (contender.manager != "LayeredAABBTree" || contender.variant == "super_thread") continue;
    contender.variant += "_2_threads";
    contenders.push_back(std::move(contender));
  }
  return contenders;
}

std::vector<Contender> paperTrees() {
  FiberManagerOptions options;
  options.ignored_neighbors = 1;
  Contenders contenders = ourTrees(options);
  for (Contender& contender : contenders) contender.leaves_out_adjacent = true;
  return contenders;
}

std::vector<Contender> fclTrees(Boxes boxes) {
  Contenders contenders;
  for (const int level : {0, 1, 2, 3}) {
    contenders.push_back(fclTree<DynamicTree>("DynamicAABBTree", boxes, level));
    contenders.push_back(fclTree<DynamicTreeArray>("DynamicAABBTree_Array", boxes, level));
  }
  return contenders;
}

std::vector<Contender> fclManagers(Boxes boxes) {
  Contenders contenders = {fclManager<DynamicTree>("DynamicAABBTree", boxes),
                           fclManager<DynamicTreeArray>("DynamicAABBTree_Array", boxes),
                           fclManager<fcl::SaPCollisionManagerd>("SaP", boxes),
                           fclManager<fcl::SSaPCollisionManagerd>("SSaP", boxes),
                           fclManager<fcl::IntervalTreeCollisionManagerd>("IntervalTree", boxes),
                           {"SpatialHashing", boxesName(boxes), false, boxes,
                            Reported::kTouchingAtLeast, makeSpatialHashing},
                           fclManager<fcl::NaiveCollisionManagerd>("Naive", boxes)};
  // Our box tree is held to do the work of FCL's own tree on tight boxes.
  if (boxes == Boxes::kTight) contenders.front().reported = Reported::kTightBoxes;
  return contenders;
}

const char* phaseName(Phase phase) {
  constexpr std::array kNames = {"set_up", "update", "detection"};
  return kNames[static_cast<std::size_t>(phase)];
}

PairCount countPairs(const Manager& manager) {
  if (const auto* foreign = dynamic_cast<const ForeignManager*>(&manager)) {
    return foreign->countPairs();
  }
  std::size_t count = 0;
  manager.collide(&count, countPair);
  return {count, count};
}

}  // namespace fcl_fibers::benchmarks
