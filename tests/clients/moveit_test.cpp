// SPDX-License-Identifier: BSD-3-Clause
#include "clients/client_support.h"

namespace fcl_fibers::test {
namespace {

// Nothing would be found by a program that calls neither setup() nor update().
void robotInAWorld(const Swap& swap, Random& random) {
  Scene<double> world, robot;
  addAllShapes(world, 28, 0.5, 0.7, random);
  addAllShapes(robot, 14, 0.4, 0.5, random);
  robot.addFiber(wanderingChain(12, 0.2, 0.4, random), 0.06);
  const auto manager = swap.make();
  // Objects of the world have several shapes each.
  const auto part = [&](std::size_t i) {
    const auto begin = world.objects().begin() + static_cast<std::ptrdiff_t>(7 * i);
    return Objects(begin, begin + 7);
  };
  for (std::size_t i = 0; i < 3; ++i) manager->registerObjects(part(i));

  for (int request = 0; request < 6; ++request) {
    SCOPED_TRACE("request " + std::to_string(request));
    const auto changed = part(static_cast<std::size_t>(request) % 4);
    if (request > 0) {
      // Moved objects are taken out and put in again.
      if (request < 4) {
        for (auto* object : changed) manager->unregisterObject(object);
      } else {
        manager->clear();
      }
      jolt(changed, random, 0.1, 0.5);
      manager->registerObjects(changed);
    }
    if (request == 2) manager->registerObjects(part(3));
    jolt(robot.objects(), random, 0.1, 0.5);
    Truth truth(world.objects());
    truth.read(robot.objects());
    for (auto* link : robot.objects()) {
      truth.expectAll(*manager, *link);
      truth.expectNearest(*manager, *link);
    }
    const auto own = swap.make();
    own->registerObjects(robot.objects());
    truth.expectAll(*own);
    truth.ignoreNeighbors(robot.fibers()[0]);
    truth.expectNearest(*own);
  }
}

MANAGER_SUITE(Moveit, ClientManagers);
TYPED_TEST(Moveit, RobotInAWorld) { runClient<TypeParam>(&robotInAWorld, 3601); }

}  // namespace
}  // namespace fcl_fibers::test
