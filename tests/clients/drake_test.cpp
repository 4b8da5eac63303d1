// SPDX-License-Identifier: BSD-3-Clause
#include "clients/client_support.h"

#include <fcl/geometry/shape/sphere.h>

namespace fcl_fibers::test {
namespace {

/// What moves, and what is anchored to the world.
class ProximityEngine {
 public:
  explicit ProximityEngine(const Swap& swap) : moving_(swap.make()), anchored_(swap.make()) {}

  void add(const Objects& objects, double margin, bool is_anchored) {
    for (auto* object : objects) {
      widenShape(*object, margin);
      (is_anchored ? *anchored_ : *moving_).registerObject(object);
    }
    truth_.read(objects, margin);
    (is_anchored ? *anchored_ : *moving_).update();
  }

  void move(const Objects& objects, double margin, Random& random) {
    jolt(objects, random, 0.05, 0.3);
    truth_.read(objects, margin);
    moving_->update();
  }
  void remove(Object* object) { moving_->unregisterObject(object); }
  void clear() {
    moving_->clear();
    anchored_->clear();
  }

  void expectContacts(std::size_t least = 1) const {
    truth_.expectAll(moving(), least);
    truth_.expectAll(moving(), *anchored_, least);
    truth_.expectNearest(moving(), *anchored_);
  }

  void expectDistancesFrom(const Eigen::Vector3d& point) {
    Object query(std::make_shared<fcl::Sphered>(0),
                 makePose<double>(Eigen::Quaterniond::Identity(), point));
    Truth truth = truth_;
    truth.read({&query});
    truth.expectNearest(moving(), query);
    truth.expectNearest(*anchored_, query);
  }

  const Manager& moving() const { return *moving_; }
  const Manager& anchored() const { return *anchored_; }

 private:
  std::unique_ptr<Manager> moving_, anchored_;
  Truth truth_;
};

Scene<double> chainAndShapes(std::size_t shapes, Random& random) {
  Scene<double> scene;
  scene.addFiber(wanderingChain(14, 0.2, 0.5, random), 0.03);
  addAllShapes(scene, shapes, 0.25, 0.6, random);
  return scene;
}

// Soft bodies would lose whoever is within their margins.
void bodiesWithMargins(const Swap& swap, Random& random) {
  const Scene<double> soft = chainAndShapes(14, random), hard = chainAndShapes(7, random);
  const Scene<double> walls = chainAndShapes(14, random);
  ProximityEngine engine(swap);
  EXPECT_TRUE(engine.moving().empty());
  engine.add(soft.objects(), 0.06, false);
  engine.add(hard.objects(), 0, false);
  engine.add(walls.objects(), 0.02, true);
  EXPECT_EQ(engine.moving().size(), soft.size() + hard.size());
  for (int step = 0; step < 4; ++step) {
    SCOPED_TRACE("step " + std::to_string(step));
    engine.expectContacts();
    engine.expectDistancesFrom(random.inCube(1));
    engine.move(soft.objects(), 0.06, random);
    engine.move(hard.objects(), 0, random);
  }
  engine.remove(soft[3]);
  engine.remove(hard[0]);
  EXPECT_EQ(objectsOf(engine.moving()).size(), soft.size() + hard.size() - 2);
  engine.expectContacts();
  engine.clear();
  EXPECT_EQ(engine.moving().size(), 0);
  EXPECT_TRUE(engine.anchored().empty());
  engine.expectContacts(0);
  engine.add(hard.objects(), 0.03, false);
  engine.expectContacts(0);
}

MANAGER_SUITE(Drake, ClientManagers);
TYPED_TEST(Drake, BodiesWithMargins) { runClient<TypeParam>(&bodiesWithMargins, 3401); }

}  // namespace
}  // namespace fcl_fibers::test
