// SPDX-License-Identifier: BSD-3-Clause
#include "contenders/coal_objects.h"

#include <coal/broadphase/broadphase_dynamic_AABB_tree.h>
#include <coal/broadphase/broadphase_dynamic_AABB_tree_array.h>
#include <coal/collision.h>
#include <coal/shape/geometric_shapes.h>

#include "contenders/closed_form.h"

namespace fcl_fibers::benchmarks {
namespace {

using Objects = std::vector<std::unique_ptr<coal::CollisionObject>>;

CapsuleAxis<double> axisOf(const coal::CollisionObject& object) {
  const auto& capsule = static_cast<const coal::Capsule&>(*object.collisionGeometryPtr());
  return {object.getTranslation(), capsule.halfLength * object.getRotation().col(2),
          capsule.radius};
}

template <typename Visit>
struct Callback final : coal::CollisionCallBackBase {
  explicit Callback(Visit& function) : visit(function) {}
  bool collide(coal::CollisionObject* a, coal::CollisionObject* b) override {
    visit(*a, *b);
    return false;
  }
  Visit& visit;
};

std::uint32_t numberOf(const coal::CollisionObject& object) {
  return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(object.getUserData()));
}

template <typename Tree>
class ManagerOf final : public CoalManager {
 public:
  ManagerOf(const Objects& objects, const CoalWay& way) : objects_(objects), way_(way) {
    tree_.tree_init_level = way.level;
    if (way.nonbalanced_level > 0) tree_.max_tree_nonbalanced_level = way.nonbalanced_level;
  }

  void setup() override {
    writeBoxes();
    std::vector<coal::CollisionObject*> all;
    all.reserve(objects_.size());
    for (const auto& object : objects_) all.push_back(object.get());
    tree_.registerObjects(all);
    tree_.setup();
  }

  void update() override {
    writeBoxes();
    tree_.update();
  }

  void visitPairs(const std::function<void(NumberPair)>& visit) const override {
    forEachPair([&](const auto& a, const auto& b) { visit({numberOf(a), numberOf(b)}); });
  }

  std::size_t countPairs() const override {
    std::size_t count = 0;
    forEachPair([&](const auto&, const auto&) { ++count; });
    return count;
  }

  std::size_t countTouching() const override {
    const auto& capsules =
        readAxes<double>(objects_.size(), [this](std::size_t i) { return axisOf(*objects_[i]); });
    std::size_t count = 0;
    forEachPair([&](const auto& a, const auto& b) {
      count += capsulesTouch(capsules[numberOf(a)], capsules[numberOf(b)]);
    });
    return count;
  }

  std::size_t countColliding(const std::vector<NumberPair>& pairs) const override {
    coal::CollisionRequest request;
    request.enable_contact = false;
    std::size_t count = 0;
    coal::CollisionResult result;
    for (const auto& [a, b] : pairs) {
      result.clear();
      count += coal::collide(objects_[a].get(), objects_[b].get(), request, result) > 0;
    }
    return count;
  }

 private:
  void writeBoxes() {
    for (const auto& object : objects_) {
      if (!way_.tight) {
        object->computeAABB();
        continue;
      }
      const CapsuleAxis<double> axis = axisOf(*object);
      const coal::Vec3s extent = axis.half.cwiseAbs().array() + axis.radius;
      object->getAABB().min_ = axis.center - extent;
      object->getAABB().max_ = axis.center + extent;
    }
  }

  template <typename Visit>
  void forEachPair(Visit&& visit) const {
    Callback<Visit> callback(visit);
    tree_.collide(&callback);
  }

  const Objects& objects_;
  CoalWay way_;
  Tree tree_;
};

class TheObjects final : public CoalObjects {
 public:
  void move(const std::vector<PlacedCapsule>& capsules) override {
    for (std::size_t i = objects_.size(); i < capsules.size(); ++i) {
      const auto shape = std::make_shared<coal::Capsule>(capsules[i].radius, capsules[i].length);
      objects_.push_back(std::make_unique<coal::CollisionObject>(shape));
      objects_.back()->setUserData(reinterpret_cast<void*>(i));
    }
    for (std::size_t i = 0; i < capsules.size(); ++i) {
      objects_[i]->setTransform(capsules[i].rotation, capsules[i].center);
    }
  }

  std::unique_ptr<CoalManager> makeManager(const CoalWay& way) override {
    if (way.array) {
      return std::make_unique<ManagerOf<coal::DynamicAABBTreeArrayCollisionManager>>(objects_, way);
    }
    return std::make_unique<ManagerOf<coal::DynamicAABBTreeCollisionManager>>(objects_, way);
  }

 private:
  Objects objects_;
};

}  // namespace
}  // namespace fcl_fibers::benchmarks

extern "C" fcl_fibers::benchmarks::CoalObjects* fcl_fibers_make_coal_objects() {
  return new fcl_fibers::benchmarks::TheObjects;
}
