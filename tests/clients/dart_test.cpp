// SPDX-License-Identifier: BSD-3-Clause
#include "clients/client_support.h"

namespace fcl_fibers::test {
namespace {

std::unique_ptr<Manager> groupOf(const Swap& swap, const Objects& objects) {
  auto manager = swap.make();
  for (auto* object : objects) {
    manager->registerObject(object);
    manager->setup();
  }
  return manager;
}

// Groups that are set up after each object would be wrong, or know no floor.
void groupsOfBodies(const Swap& swap, Random& random) {
  Scene<double> bodies, others;
  bodies.addFiber(wanderingChain(14, 0.15, 0.5, random), 0.03);
  addAllShapes(bodies, 21, 0.3, 0.7, random);
  bodies.addHalfspace({0, 0, 1}, -0.5);
  others.addFiber(wanderingChain(14, 0.15, 0.5, random), 0.03);
  addAllShapes(others, 14, 0.3, 0.7, random);
  const auto group = groupOf(swap, bodies.objects()), other = groupOf(swap, others.objects());
  // What moves; a half-space stays.
  Objects moving = bodies.objects();
  moving.pop_back();
  for (int step = 0; step < 4; ++step) {
    SCOPED_TRACE("step " + std::to_string(step));
    jolt(moving, random, 0.05, 0.2);
    jolt(others.objects(), random, 0.05, 0.2);
    // A group calls it in each of its queries.
    group->update();
    other->update();
    Truth truth(bodies.objects());
    truth.read(others.objects());
    truth.expectAll(*group);
    truth.expectAll(*group, *other);
    truth.expectAll(*other, *group);
    truth.expectNearest(*group, *other);
    if (step % 2 == 1) {
      for (const std::size_t i : {std::size_t(step), std::size_t(20 + step)}) {
        group->unregisterObject(bodies[i]);
        truth.expectAll(*group);
        group->registerObject(bodies[i]);
        group->setup();
      }
    }
    if (step == 2) {
      other->clear();
      truth.expectAll(*group, *other, 0);
      for (auto* object : others.objects()) {
        other->registerObject(object);
        other->setup();
      }
    }
  }
}

MANAGER_SUITE(Dart, ClientManagers);
TYPED_TEST(Dart, GroupsOfBodies) { runClient<TypeParam>(&groupsOfBodies, 3701); }

}  // namespace
}  // namespace fcl_fibers::test
