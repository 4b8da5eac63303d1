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

template <typename S>
using Objects = std::vector<fcl::CollisionObject<S>*>;
using Contenders = std::vector<Contender>;
template <typename S>
using DynamicTree = fcl::DynamicAABBTreeCollisionManager<S>;
template <typename S>
using DynamicTreeArray = fcl::DynamicAABBTreeCollisionManager_Array<S>;

const char* boxesName(Boxes boxes) { return boxes == Boxes::kStock ? "stock" : "tight"; }

template <template <typename> class FiberManager, typename S = double>
BasicContender<S> ours(const char* manager, const char* variant, Reported reported,
                       const FiberManagerOptions& options) {
  const auto make = [options](const Objects<S>&) {
    return std::make_unique<FiberManager<S>>(options);
  };
  return {manager, variant, true, Boxes::kNone, reported, make};
}

template <typename S>
using BoxTree = LayeredAABBTreeCollisionManager<S>;
template <typename S>
using SphereTree = WrappedSphereTreeCollisionManager<S>;

/// Our trees with these options and other topologies and reports.
Contenders ourTrees(FiberManagerOptions options) {
  FiberManagerOptions capsules = options, super_thread = options;
  capsules.report = Report::kCapsules;
  super_thread.topology = Topology::kSuperThread;
  return {ours<BoxTree>("LayeredAABBTree", "boxes", Reported::kTightBoxes, options),
          ours<BoxTree>("LayeredAABBTree", "capsules", Reported::kTouching, capsules),
          ours<BoxTree>("LayeredAABBTree", "super_thread", Reported::kTightBoxes, super_thread),
          ours<SphereTree>("WrappedSphereTree", "spheres", Reported::kSpheres, options),
          ours<SphereTree>("WrappedSphereTree", "capsules", Reported::kTouching, capsules),
          ours<SphereTree>("WrappedSphereTree", "super_thread", Reported::kSpheres, super_thread)};
}

template <typename FclManager, typename S>
BasicContender<S> fclManager(const char* manager, Boxes boxes) {
  const auto make = [](const Objects<S>&) { return std::make_unique<FclManager>(); };
  return {manager, boxesName(boxes), false, boxes, Reported::kTouchingAtLeast, make, false, true};
}

template <typename FclTree>
Contender fclTree(const char* manager, Boxes boxes, int level) {
  const auto make = [level](const Objects<double>&) {
    auto tree = std::make_unique<FclTree>();
    tree->tree_init_level = level;
    return tree;
  };
  // What the box tree is held to.
  const auto reported = boxes == Boxes::kTight ? Reported::kTightBoxes : Reported::kTouchingAtLeast;
  const std::string variant = boxesName(boxes) + ("_level_" + std::to_string(level));
  return {manager, variant, false, boxes, reported, make, false, true};
}

// FCL's hash wants to be told what it is for. Cells of 1.5 times the mean box edge: half or twice
// as much was slower on the helix. As many buckets as objects: four times as many gained nothing,
// and its default of 1000 makes it quadratic. Limits that the motion stays within: objects outside
// are compared with all others.
template <typename S>
std::unique_ptr<BasicManager<S>> makeSpatialHashing(const Objects<S>& objects) {
  fcl::AABB<S> bounds;
  double edges = 0;
  for (const fcl::CollisionObject<S>* object : objects) {
    const fcl::AABB<S>& box = object->getAABB();
    bounds += box;
    edges += static_cast<double>((box.max_ - box.min_).sum());
  }
  const double mean_edge = edges / (3.0 * static_cast<double>(objects.size()));
  const fcl::Vector3<S> spare = (bounds.max_ - bounds.min_) / 10;
  return std::make_unique<fcl::SpatialHashingCollisionManager<S>>(
      static_cast<S>(1.5 * mean_edge), bounds.min_ - spare, bounds.max_ + spare,
      static_cast<unsigned int>(objects.size()));
}

}  // namespace

template <typename S>
std::string BasicContender<S>::title() const {
  std::string title = variant.empty() ? manager : manager + ", " + variant;
  std::replace(title.begin(), title.end(), '_', ' ');
  return title;
}

template <typename S>
std::unique_ptr<BasicManager<S>> BasicContender<S>::setUp(const Objects& objects) const {
  std::unique_ptr<BasicManager<S>> result = make(objects);
  result->registerObjects(objects);
  result->setup();
  return result;
}

template <typename S>
std::unique_ptr<BasicManager<S>> BasicContender<S>::setUp(
    const BasicMovingFibers<S>& fibers) const {
  if (!leaves_out_adjacent) return setUp(fibers.objects());
  std::unique_ptr<BasicManager<S>> result = make(fibers.objects());
  auto& fiber_manager = dynamic_cast<FiberCollisionManager<S>&>(*result);
  for (const auto& fiber : fibers.fibers()) {
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
    contenders.push_back(fclTree<DynamicTree<double>>("DynamicAABBTree", boxes, level));
    contenders.push_back(fclTree<DynamicTreeArray<double>>("DynamicAABBTree_Array", boxes, level));
  }
  return contenders;
}

template <typename S>
std::vector<BasicContender<S>> fclManagers(Boxes boxes) {
  std::vector<BasicContender<S>> contenders = {
      fclManager<DynamicTree<S>, S>("DynamicAABBTree", boxes),
      fclManager<DynamicTreeArray<S>, S>("DynamicAABBTree_Array", boxes),
      fclManager<fcl::SaPCollisionManager<S>, S>("SaP", boxes),
      fclManager<fcl::SSaPCollisionManager<S>, S>("SSaP", boxes),
      fclManager<fcl::IntervalTreeCollisionManager<S>, S>("IntervalTree", boxes),
      {"SpatialHashing", boxesName(boxes), false, boxes, Reported::kTouchingAtLeast,
       makeSpatialHashing<S>, false, true},
      fclManager<fcl::NaiveCollisionManager<S>, S>("Naive", boxes)};
  // Our box tree is held to do the work of FCL's own tree on tight boxes.
  if (boxes == Boxes::kTight) contenders.front().reported = Reported::kTightBoxes;
  return contenders;
}

Contenders otherFclManagers(Boxes boxes) {
  Contenders contenders = fclManagers(boxes);
  contenders.erase(contenders.begin(), contenders.begin() + 2);  // the dynamic tree's two forms
  return contenders;
}

template <typename S>
std::vector<BasicContender<S>> cardContenders() {
  std::vector<BasicContender<S>> contenders;
  for (const Boxes boxes : {Boxes::kTight, Boxes::kStock}) {
    for (BasicContender<S>& contender : fclManagers<S>(boxes)) {
      contenders.push_back(std::move(contender));
    }
  }
  for (const Topology topology : {Topology::kSuperThread, Topology::kBundle}) {
    FiberManagerOptions options;
    options.topology = topology;
    const char* const variant = topology == Topology::kBundle ? "bundles" : "published";
    contenders.push_back(
        ours<BoxTree, S>("LayeredAABBTree", variant, Reported::kTightBoxes, options));
    contenders.push_back(
        ours<SphereTree, S>("WrappedSphereTree", variant, Reported::kSpheres, options));
  }
  return contenders;
}

template struct BasicContender<float>;
template struct BasicContender<double>;
template std::vector<BasicContender<float>> fclManagers(Boxes boxes);
template std::vector<BasicContender<double>> fclManagers(Boxes boxes);
template std::vector<BasicContender<float>> cardContenders();
template std::vector<BasicContender<double>> cardContenders();

const char* phaseName(Phase phase) {
  constexpr std::array kNames = {"set_up", "update", "detection"};
  return kNames[static_cast<std::size_t>(phase)];
}

}  // namespace fcl_fibers::benchmarks
