// SPDX-License-Identifier: BSD-3-Clause
#include "clients/client_support.h"

namespace fcl_fibers::test {
namespace {

/// An object with a contact distance, half of which it adds to its box after every move.
template <typename S>
class WidenedObject : public fcl::CollisionObject<S> {
 public:
  using fcl::CollisionObject<S>::CollisionObject;

  void moveTo(const fcl::Transform3<S>& pose) {
    this->setTransform(pose);
    widen();
  }
  void setContactDistance(double distance) {
    half_distance_ = static_cast<S>(distance / 2);
    widen();
  }

 private:
  void widen() {
    fcl::Vector3<S> margin = fcl::Vector3<S>::Constant(half_distance_);
    if (this->t.linear().isIdentity()) {
      this->aabb = fcl::translate(this->cgeom->aabb_local, this->t.translation());
    } else {
      const fcl::Vector3<S> center = this->t * this->cgeom->aabb_center;
      this->aabb.min_ = this->aabb.max_ = center;
      margin.array() += this->cgeom->aabb_radius;
    }
    this->aabb.min_ -= margin;
    this->aabb.max_ += margin;
  }

  S half_distance_ = 0;
};

template <typename S>
class ContactManager {
 public:
  using Object = WidenedObject<S>;
  using Objects = std::vector<fcl::CollisionObject<S>*>;

  explicit ContactManager(const Swap<S>& swap) : fixed_(swap.make()), moving_(swap.make()) {}

  Object* add(std::shared_ptr<fcl::CollisionGeometry<S>> shape, const fcl::Transform3<S>& pose) {
    objects_.push_back(std::make_unique<Object>(std::move(shape), pose));
    objects_.back()->setContactDistance(distance_);
    fixed_->registerObject(objects_.back().get());
    fixed_->update();
    return objects_.back().get();
  }

  void setActive(Object& object, bool is_active) {
    auto& from = is_active ? *fixed_ : *moving_;
    auto& to = is_active ? *moving_ : *fixed_;
    Objects held;
    from.getObjects(held);
    if (std::find(held.begin(), held.end(), &object) == held.end()) return;
    from.unregisterObject(&object);
    to.registerObject(&object);
    from.update();
    to.update();
  }

  void setContactDistance(double distance) {
    distance_ = distance;
    for (const auto& object : objects_) object->setContactDistance(distance);
    fixed_->update();
    moving_->update();
  }

  /// Those that are turned and those that are not have boxes of two kinds.
  void jolt(const Objects& moved, Random& random) {
    for (auto* object : moved) {
      fcl::Transform3<S> pose = object->getTransform();
      pose.translation() += random.inCube(0.1).cast<S>();
      if (random.below(2) == 0) {
        pose.linear() = random.rotation().toRotationMatrix().template cast<S>();
      } else if (random.below(2) == 0) {
        pose.linear().setIdentity();
      }
      static_cast<Object*>(object)->moveTo(pose);
    }
  }
  void moveSome(Random& random) {
    for (auto* manager : {fixed_.get(), moving_.get()}) {
      Objects moved;
      for (auto* object : objectsOf(*manager)) {
        if (random.below(3) == 0) moved.push_back(object);
      }
      jolt(moved, random);
      if (!moved.empty()) manager->update(moved);
    }
  }
  void moveAll(Random& random) {
    for (auto* manager : {fixed_.get(), moving_.get()}) {
      jolt(objectsOf(*manager), random);
      manager->update();
    }
  }

  void expectContacts() const {
    Truth<S> truth(objectsOf(*fixed_), distance_ / 2);
    truth.read(objectsOf(*moving_), distance_ / 2);
    EXPECT_EQ(fixed_->size() + moving_->size(), objects_.size());
    if (!fixed_->empty()) {
      truth.expectAll(*moving_, *fixed_);
      truth.expectAll(*fixed_, *moving_);
    }
    truth.expectAll(*moving_);
  }

 private:
  double distance_ = 0.1;
  std::vector<std::unique_ptr<Object>> objects_;
  std::unique_ptr<fcl::BroadPhaseCollisionManager<S>> fixed_, moving_;
};

// Whoever is within the contact distance would be lost.
template <typename S>
void linksWithinTheContactDistance(const Swap<S>& swap, Random& random) {
  Scene<S> links;
  links.addFiber(wanderingChain(20, 0.2, 0.5, random), 0.03);
  addAllShapes(links, 42, 0.3, 0.6, random);
  ContactManager<S> manager(swap);
  std::vector<WidenedObject<S>*> objects;
  for (auto* link : links.objects()) {
    objects.push_back(
        manager.add(std::const_pointer_cast<fcl::CollisionGeometry<S>>(link->collisionGeometry()),
                    link->getTransform()));
  }
  for (auto* object : objects) manager.setActive(*object, random.below(2) == 0);
  manager.expectContacts();
  for (int step = 0; step < 6; ++step) {
    SCOPED_TRACE("step " + std::to_string(step));
    manager.moveSome(random);
    manager.expectContacts();
    if (step == 1) manager.setContactDistance(0.2);
    if (step == 3) manager.setContactDistance(0);
    if (step == 4) manager.setContactDistance(0.05);
    for (int i = 0; i < 5; ++i) {
      manager.setActive(*objects[random.below(objects.size())], random.below(2) == 0);
    }
    manager.expectContacts();
  }
  manager.moveAll(random);
  manager.expectContacts();
}

MANAGER_SUITE(Tesseract, ClientManagers);
TYPED_TEST(Tesseract, LinksWithinTheContactDistance) {
  runClient<TypeParam>(&linksWithinTheContactDistance, 3301);
}

}  // namespace
}  // namespace fcl_fibers::test
