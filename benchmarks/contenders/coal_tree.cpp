// SPDX-License-Identifier: BSD-3-Clause
#include <dlfcn.h>

#include <stdexcept>
#include <string>

#include <fcl/geometry/shape/capsule.h>

#include "contenders/coal_objects.h"
#include "contenders/foreign_tree.h"

namespace fcl_fibers::benchmarks {
namespace {

/// coal's objects of the scene that is measured. They take poses over from FCL's before each phase,
/// in no time, as a program would move them.
class CoalScene {
 public:
  static CoalScene& only() {
    static CoalScene scene;
    return scene;
  }

  void follow(const std::vector<Object*>& objects) {
    if (objects != of_) {
      of_ = objects;
      objects_.reset(load()());
      capsules_.resize(objects.size());
      for (std::size_t i = 0; i < objects.size(); ++i) {
        const auto& shape = static_cast<const fcl::Capsuled&>(*objects[i]->collisionGeometry());
        capsules_[i].length = shape.lz;
        capsules_[i].radius = shape.radius;
      }
    }
    for (std::size_t i = 0; i < objects.size(); ++i) {
      capsules_[i].rotation = objects[i]->getRotation();
      capsules_[i].center = objects[i]->getTranslation();
    }
    objects_->move(capsules_);
  }

  CoalObjects& objects() { return *objects_; }

 private:
  static MakeCoalObjects load() {
    // Its own libraries come first.
    static void* const module =
        dlopen(FCL_FIBERS_COAL_MODULE, RTLD_NOW | RTLD_LOCAL | RTLD_DEEPBIND);
    if (module == nullptr)
      throw std::runtime_error(std::string("coal cannot be loaded: ") + dlerror());
    return reinterpret_cast<MakeCoalObjects>(dlsym(module, kMakeCoalObjects));
  }

  std::vector<Object*> of_;
  std::vector<PlacedCapsule> capsules_;
  std::unique_ptr<CoalObjects> objects_;
};

class CoalTree : public ForeignTree {
 public:
  explicit CoalTree(const CoalWay& way)
      : ForeignTree(1), manager_(CoalScene::only().objects().makeManager(way)) {}

  void setup() override { manager_->setup(); }
  using ForeignTree::update;
  void update() override { manager_->update(); }

  using ForeignTree::collide;
  void collide(void* cdata, fcl::CollisionCallBack<double> callback) const override {
    manager_->visitPairs([&](CoalManager::NumberPair pair) {
      callback(object(pair.first), object(pair.second), cdata);
    });
  }

  PairCount countPairs() const override {
    const std::size_t pairs = manager_->countPairs();
    return {pairs, pairs};
  }
  std::size_t countTouching() const override { return manager_->countTouching(); }

  NarrowPhase collideSome(const std::vector<std::pair<Object*, Object*>>& pairs) const override {
    std::vector<CoalManager::NumberPair> numbers;
    for (const auto& [a, b] : pairs) {
      numbers.emplace_back(MovingFibers::index(a), MovingFibers::index(b));
    }
    std::size_t colliding = 0;
    const double taken = seconds([&] { colliding = manager_->countColliding(numbers); });
    return {taken, static_cast<double>(colliding)};
  }

 private:
  std::unique_ptr<CoalManager> manager_;
};

Contender treeOf(const CoalWay& way) {
  const std::string variant = (way.tight ? "tight_level_" : "stock_level_") +
                              std::to_string(way.level) +
                              (way.nonbalanced_level == kNeverRebuilt ? "_never_rebuilt" : "");
  Contender tree = foreignContender(way.array ? "coal_Array" : "coal", variant,
                                    [way] { return std::make_unique<CoalTree>(way); });
  tree.group = Group::kForeignTuned;
  if (way.tight) tree.reported = Reported::kTightBoxes;
  tree.is_renewed = true;
  tree.follow = [](const std::vector<Object*>& objects) { CoalScene::only().follow(objects); };
  return tree;
}

/// As those of FCL.
std::vector<Contender> trees() {
  std::vector<Contender> all;
  for (const int level : {0, 1, 2, 3}) {
    for (const bool array : {false, true}) {
      all.push_back(treeOf({array, level, 0, /*tight=*/true}));
      all.push_back(treeOf({array, level, kNeverRebuilt, /*tight=*/true}));
      all.push_back(treeOf({array, level, 0, /*tight=*/false}));
    }
  }
  return all;
}

const AddLibrary kCoal("coal", FCL_FIBERS_COAL_VERSION, trees());

}  // namespace
}  // namespace fcl_fibers::benchmarks
