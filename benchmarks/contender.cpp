// SPDX-License-Identifier: BSD-3-Clause
#include "contender.h"

#include <algorithm>

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

std::unique_ptr<Manager> registerAll(std::unique_ptr<Manager> manager, const MovingFibers& fibers) {
  manager->registerObjects(fibers.objects());
  manager->setup();
  return manager;
}

template <typename FiberManager>
std::unique_ptr<Manager> setUpOurs(const MovingFibers& fibers, const FiberManagerOptions& options) {
  return registerAll(std::make_unique<FiberManager>(options), fibers);
}

template <typename FclManager>
std::unique_ptr<Manager> setUpFcl(const MovingFibers& fibers) {
  return registerAll(std::make_unique<FclManager>(), fibers);
}

template <typename FclTree>
Contender fclTreeContender(const char* manager, Boxes boxes, int level) {
  const std::string variant =
      std::string(boxes == Boxes::kStock ? "stock" : "tight") + "_level_" + std::to_string(level);
  return {manager, variant, false, boxes,
          // What the box tree is held to.
          boxes == Boxes::kTight ? Reported::kTightBoxes : Reported::kTouchingAtLeast,
          [level](const MovingFibers& fibers) {
            auto tree = std::make_unique<FclTree>();
            tree->tree_init_level = level;
            return registerAll(std::move(tree), fibers);
          }};
}

// FCL's hash wants to be told what it is for. Cells of 1.5 times the mean box edge: half or twice
// as much was slower on the strand. As many buckets as objects: four times as many gained nothing,
// and its default of 1000 makes it quadratic. Limits that the motion stays within: objects outside
// are compared with all others.
std::unique_ptr<Manager> setUpSpatialHashing(const MovingFibers& fibers) {
  fcl::AABBd bounds;
  double edges = 0;
  for (const Object* object : fibers.objects()) {
    const fcl::AABBd& box = object->getAABB();
    bounds += box;
    edges += (box.max_ - box.min_).sum();
  }
  const double mean_edge = edges / (3.0 * static_cast<double>(fibers.segmentCount()));
  const fcl::Vector3d spare = 0.1 * (bounds.max_ - bounds.min_);
  return registerAll(std::make_unique<fcl::SpatialHashingCollisionManagerd<>>(
                         1.5 * mean_edge, bounds.min_ - spare, bounds.max_ + spare,
                         static_cast<unsigned int>(fibers.segmentCount())),
                     fibers);
}

bool countPair(Object*, Object*, void* count) {
  ++*static_cast<std::size_t*>(count);
  return false;
}

}  // namespace

std::string Contender::title() const {
  std::string title = manager + ", " + variant;
  std::replace(title.begin(), title.end(), '_', ' ');
  return title;
}

std::vector<Contender> allContenders() {
  std::vector<Contender> contenders;

  const auto addOurs = [&](const char* variant, Topology topology, Report report) {
    FiberManagerOptions options;
    options.topology = topology;
    options.report = report;
    options.ignored_neighbors = 0;
    const bool exact = report == Report::kCapsules;
    contenders.push_back({"LayeredAABBTree", variant, true, Boxes::kNone,
                          exact ? Reported::kTouching : Reported::kTightBoxes,
                          [options](const MovingFibers& fibers) {
                            return setUpOurs<LayeredAABBTreeCollisionManagerd>(fibers, options);
                          }});
    contenders.push_back({"WrappedSphereTree", variant, true, Boxes::kNone,
                          exact ? Reported::kTouching : Reported::kSpheres,
                          [options](const MovingFibers& fibers) {
                            return setUpOurs<WrappedSphereTreeCollisionManagerd>(fibers, options);
                          }});
  };
  addOurs("bundle", Topology::kBundle, Report::kVolumes);
  addOurs("super_thread", Topology::kSuperThread, Report::kVolumes);
  addOurs("bundle_capsules", Topology::kBundle, Report::kCapsules);

  const auto addFcl = [&](const char* manager, auto set_up) {
    contenders.push_back(
        {manager, "stock", false, Boxes::kStock, Reported::kTouchingAtLeast, set_up});
    contenders.push_back(
        {manager, "tight", false, Boxes::kTight, Reported::kTouchingAtLeast, set_up});
  };
  addFcl("DynamicAABBTree", setUpFcl<fcl::DynamicAABBTreeCollisionManagerd>);
  // The box tree is held to do the work of FCL's own tree on tight boxes, which this one marks.
  contenders.back().reported = Reported::kTightBoxes;
  addFcl("DynamicAABBTree_Array", setUpFcl<fcl::DynamicAABBTreeCollisionManager_Arrayd>);
  addFcl("SaP", setUpFcl<fcl::SaPCollisionManagerd>);
  addFcl("SSaP", setUpFcl<fcl::SSaPCollisionManagerd>);
  addFcl("IntervalTree", setUpFcl<fcl::IntervalTreeCollisionManagerd>);
  addFcl("SpatialHashing", setUpSpatialHashing);
  addFcl("Naive", setUpFcl<fcl::NaiveCollisionManagerd>);
  return contenders;
}

Contender boxTreeContender(const std::string& variant, Report report, int threads) {
  FiberManagerOptions options;
  options.report = report;
  options.threads = threads;
  return {"LayeredAABBTree",
          variant,
          true,
          Boxes::kNone,
          report == Report::kCapsules ? Reported::kTouching : Reported::kTightBoxes,
          [options](const MovingFibers& fibers) {
            return setUpOurs<LayeredAABBTreeCollisionManagerd>(fibers, options);
          }};
}

std::vector<Contender> fclTreeContenders(Boxes boxes) {
  constexpr int kLevels = 4;
  std::vector<Contender> contenders;
  for (int level = 0; level < kLevels; ++level) {
    contenders.push_back(
        fclTreeContender<fcl::DynamicAABBTreeCollisionManagerd>("DynamicAABBTree", boxes, level));
    contenders.push_back(fclTreeContender<fcl::DynamicAABBTreeCollisionManager_Arrayd>(
        "DynamicAABBTree_Array", boxes, level));
  }
  return contenders;
}

const char* phaseName(Phase phase) {
  switch (phase) {
    case Phase::kSetUp:
      return "SetUp";
    case Phase::kUpdate:
      return "Update";
    case Phase::kSelfCollision:
      return "SelfCollision";
    case Phase::kFrame:
      return "Frame";
  }
  return "";
}

std::size_t countPairs(const Manager& manager) {
  if (const auto* counting = dynamic_cast<const CountsPairs*>(&manager)) {
    return counting->countPairs();
  }
  std::size_t count = 0;
  manager.collide(&count, countPair);
  return count;
}

}  // namespace fcl_fibers::benchmarks
