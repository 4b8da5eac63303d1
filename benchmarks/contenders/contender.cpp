// SPDX-License-Identifier: BSD-3-Clause
#include "contenders/contender.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <stdexcept>
#include <type_traits>
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
template <typename S>
using DynamicTree = fcl::DynamicAABBTreeCollisionManager<S>;
template <typename S>
using DynamicTreeArray = fcl::DynamicAABBTreeCollisionManager_Array<S>;

template <typename S>
using Contenders = std::vector<BasicContender<S>>;

const char* boxesName(Boxes boxes) { return boxes == Boxes::kStock ? "stock" : "tight"; }

template <typename Item>
void append(std::vector<Item>& items, std::vector<Item> more) {
  std::move(more.begin(), more.end(), std::back_inserter(items));
}

template <template <typename> class FiberManager, typename S>
BasicContender<S> ours(Group group, const char* manager, const std::string& variant,
                       Reported reported, const FiberManagerOptions& options) {
  const auto make = [options](const Objects<S>&) {
    return std::make_unique<FiberManager<S>>(options);
  };
  return {group, manager, variant, true, Boxes::kNone, reported, make};
}

template <typename S>
using BoxTree = LayeredAABBTreeCollisionManager<S>;
template <typename S>
using SphereTree = WrappedSphereTreeCollisionManager<S>;

/// Both trees with these options, named alike or by what they report.
template <typename S>
Contenders<S> bothTrees(Group group, const FiberManagerOptions& options, const std::string& name) {
  const bool capsules = options.report == Report::kCapsules;
  const auto reported = [capsules](Reported volumes) {
    return capsules ? Reported::kTouching : volumes;
  };
  return {ours<BoxTree, S>(group, "LayeredAABBTree", name.empty() ? "boxes" : name,
                           reported(Reported::kTightBoxes), options),
          ours<SphereTree, S>(group, "WrappedSphereTree", name.empty() ? "spheres" : name,
                              reported(Reported::kSpheres), options)};
}

/// Our trees with these options and other topologies and reports.
template <typename S>
Contenders<S> ourTrees(const FiberManagerOptions& options) {
  FiberManagerOptions capsules = options, super_thread = options;
  capsules.report = Report::kCapsules;
  super_thread.topology = Topology::kSuperThread;
  Contenders<S> trees = bothTrees<S>(Group::kOurs, options, "");
  append(trees, bothTrees<S>(Group::kOurs, capsules, "capsules"));
  append(trees, bothTrees<S>(Group::kOurs, super_thread, "super_thread"));
  return trees;
}

/// LayeredAABBTree/{boxes,capsules,super_thread}, the first two on 2 threads too, and
/// WrappedSphereTree/{spheres,capsules,super_thread}; objects are registered without their fibers.
template <typename S>
Contenders<S> ourContenders() {
  Contenders<S> found = ourTrees<S>({});
  FiberManagerOptions two;
  two.threads = 2;
  for (BasicContender<S>& contender : ourTrees<S>(two)) {
    if (contender.manager != "LayeredAABBTree" || contender.variant == "super_thread") continue;
    contender.variant += "_2_threads";
    found.push_back(std::move(contender));
  }
  return found;
}

template <typename S>
Contenders<S> published() {
  FiberManagerOptions published, bundles;
  published.topology = Topology::kSuperThread;
  bundles.topology = Topology::kBundle;
  Contenders<S> found = bothTrees<S>(Group::kPublished, published, "published");
  append(found, bothTrees<S>(Group::kPublished, bundles, "bundles"));
  return found;
}

/// Registers all objects again in each update. SaP's own update moves one end point after another
/// through a list, which takes quadratic time if all move.
template <typename S>
class SaPAnew : public fcl::SaPCollisionManager<S> {
 public:
  using fcl::SaPCollisionManager<S>::update;
  void update() override {
    Objects<S> all;
    this->getObjects(all);
    this->clear();
    this->registerObjects(all);
    this->setup();
  }
};

/// How a dynamic tree of FCL's is set; by default as FCL sets it.
struct TreeOptions {
  int level = -1;  ///< the tree_init_level
  bool is_rebuilt = true;

  std::string suffix() const {
    if (level < 0) return "";
    return "_level_" + std::to_string(level) + (is_rebuilt ? "" : "_never_rebuilt");
  }
};

template <typename FclManager, typename S>
BasicContender<S> fclManager(Group group, const char* manager, Boxes boxes,
                             const TreeOptions& options = {}) {
  const auto make = [options](const Objects<S>&) {
    auto made = std::make_unique<FclManager>();
    if constexpr (std::is_base_of_v<DynamicTree<S>, FclManager> ||
                  std::is_base_of_v<DynamicTreeArray<S>, FclManager>) {
      if (options.level >= 0) made->tree_init_level = options.level;
      if (!options.is_rebuilt) made->max_tree_nonbalanced_level = kNeverRebuilt;
    } else {
      static_cast<void>(options);
    }
    return made;
  };
  const std::string variant = options.suffix();
  // Our box tree is held to do the work of FCL's own trees on tight boxes.
  const bool is_reference = boxes == Boxes::kTight && group != Group::kFclOthers;
  const auto reported = is_reference ? Reported::kTightBoxes : Reported::kTouchingAtLeast;
  return {group, manager, boxesName(boxes) + variant, false, boxes, reported, make, true};
}

/// The dynamic tree and its array form.
template <typename S>
Contenders<S> fclTrees(Group group, Boxes boxes, const TreeOptions& options = {}) {
  return {fclManager<DynamicTree<S>, S>(group, "DynamicAABBTree", boxes, options),
          fclManager<DynamicTreeArray<S>, S>(group, "DynamicAABBTree_Array", boxes, options)};
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

template <typename S>
Contenders<S> fclManagers(Group group, Boxes boxes) {
  Contenders<S> found;
  if (group == Group::kFclTrees) return fclTrees<S>(group, boxes);
  if (group == Group::kFclTuned) {
    for (const int level : {0, 1, 2, 3}) append(found, fclTrees<S>(group, boxes, {level}));
  }
  if (group == Group::kFclNeverRebuilt && boxes == Boxes::kTight) {
    for (const int level : {0, 1, 2, 3}) {
      append(found, fclTrees<S>(Group::kFclTuned, boxes, {level, /*is_rebuilt=*/false}));
    }
  }
  if (group == Group::kFclOthers) {
    BasicContender<S> anew = fclManager<SaPAnew<S>, S>(group, "SaP", boxes);
    anew.variant += "_anew";
    return {fclManager<fcl::SaPCollisionManager<S>, S>(group, "SaP", boxes),
            std::move(anew),
            fclManager<fcl::SSaPCollisionManager<S>, S>(group, "SSaP", boxes),
            fclManager<fcl::IntervalTreeCollisionManager<S>, S>(group, "IntervalTree", boxes),
            {group, "SpatialHashing", boxesName(boxes), false, boxes, Reported::kTouchingAtLeast,
             makeSpatialHashing<S>, true},
            fclManager<fcl::NaiveCollisionManager<S>, S>(group, "Naive", boxes)};
  }
  return found;
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

template <typename S>
void BasicContender<S>::setPoses(BasicMovingFibers<S>& fibers, int frame) const {
  fibers.setPoses(frame);
  if (follow) follow(fibers.objects());
}

template <typename S>
void BasicContender<S>::bringTo(BasicMovingFibers<S>& fibers, int frame) const {
  fibers.bringTo(frame, boxes);
  if (follow) follow(fibers.objects());
}

template <typename S>
Contenders<S> allOf(std::initializer_list<Group> groups, std::optional<Boxes> boxes) {
  Contenders<S> found;
  for (const Group group : groups) {
    if (group == Group::kOurs) append(found, ourContenders<S>());
    if (group == Group::kPublished) append(found, published<S>());
    if constexpr (std::is_same_v<S, double>) {
      for (const Contender& contender : foreignContenders()) {
        if (contender.group == group) found.push_back(contender);
      }
    }
    for (const Boxes either : {Boxes::kTight, Boxes::kStock}) {
      if (either == boxes.value_or(either)) append(found, fclManagers<S>(group, either));
    }
  }
  return found;
}

Contender ourContender(const std::string& name) {
  for (const Contender& contender : allOf({Group::kOurs})) {
    if (contender.name() == name) return contender;
  }
  throw std::out_of_range("none of ours is " + name);
}

template <typename S>
Contenders<S> paperTrees() {
  FiberManagerOptions options;
  options.ignored_neighbors = 1;
  Contenders<S> trees = ourTrees<S>(options);
  for (BasicContender<S>& contender : trees) contender.leaves_out_adjacent = true;
  return trees;
}

std::vector<Contender>& foreignContenders() {
  static std::vector<Contender> all;
  return all;
}

template struct BasicContender<float>;
template struct BasicContender<double>;
template Contenders<float> allOf(std::initializer_list<Group>, std::optional<Boxes>);
template Contenders<double> allOf(std::initializer_list<Group>, std::optional<Boxes>);
template Contenders<float> paperTrees();
template Contenders<double> paperTrees();

const char* phaseName(Phase phase) {
  constexpr std::array kNames = {"set_up", "update", "detection"};
  return kNames[static_cast<std::size_t>(phase)];
}

}  // namespace fcl_fibers::benchmarks
