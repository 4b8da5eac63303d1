// SPDX-License-Identifier: BSD-3-Clause
#include "clients/client_support.h"

namespace fcl_fibers::test {
namespace {

/// An object with a contact distance, half of which it adds to its box after every move.
class WidenedObject : public fcl::CollisionObjectd {
 public:
  using fcl::CollisionObjectd::CollisionObject;

  void moveTo(const fcl::Transform3d& pose) {
    setTransform(pose);
    widen();
  }
  void setContactDistance(double distance) {
    half_distance_ = distance / 2;
    widen();
  }

 private:
  void widen() {
    fcl::Vector3d margin = fcl::Vector3d::Constant(half_distance_);
    if (t.linear().isIdentity()) {
      aabb = fcl::translate(cgeom->aabb_local, t.translation());
    } else {
      const fcl::Vector3d center = t * cgeom->aabb_center;
      aabb.min_ = aabb.max_ = center;
      margin.array() += cgeom->aabb_radius;
    }
    aabb.min_ -= margin;
    aabb.max_ += margin;
  }

  double half_distance_ = 0;
};

class ContactManager {
 public:
  explicit ContactManager(const Swap& swap) : fixed_(swap.make()), moving_(swap.make()) {}

  WidenedObject* add(Geometry shape, const fcl::Transform3d& pose) {
    objects_.push_back(std::make_unique<WidenedObject>(std::move(shape), pose));
    objects_.back()->setContactDistance(distance_);
    fixed_->registerObject(objects_.back().get());
    fixed_->update();
    return objects_.back().get();
  }

  void setActive(WidenedObject& object, bool is_active) {
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
      fcl::Transform3d pose = object->getTransform();
      pose.translation() += random.inCube(0.1);
      if (random.below(2) == 0) {
        pose.linear() = random.rotation().toRotationMatrix();
      } else if (random.below(2) == 0) {
        pose.linear().setIdentity();
      }
      static_cast<WidenedObject*>(object)->moveTo(pose);
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
    Truth truth(objectsOf(*fixed_), distance_ / 2);
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
  std::vector<std::unique_ptr<WidenedObject>> objects_;
  std::unique_ptr<Manager> fixed_, moving_;
};

// Whoever is within the contact distance would be lost.
void linksWithinTheContactDistance(const Swap& swap, Random& random) {
  Scene<double> links;
  links.addFiber(wanderingChain(20, 0.2, 0.5, random), 0.03);
  addAllShapes(links, 42, 0.3, 0.6, random);
  ContactManager manager(swap);
  std::vector<WidenedObject*> objects;
  for (auto* link : links.objects()) {
    objects.push_back(
        manager.add(std::const_pointer_cast<fcl::CollisionGeometryd>(link->collisionGeometry()),
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
