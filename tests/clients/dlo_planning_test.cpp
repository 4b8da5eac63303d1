// SPDX-License-Identifier: BSD-3-Clause
#include "clients/client_support.h"

namespace fcl_fibers::test {
namespace {

// A cable among robots that its planner moves without telling their manager: those count where they
// were when they were registered.
void cableAmongRobots(const Swap& swap, Random& random) {
  Scene<double> cable, robots;
  cable.addFiber(wanderingChain(40, 0.1, 0.3, random), 0.02);
  addAllShapes(robots, 21, 0.3, 0.6, random);
  const auto cable_manager = swap.make(), robot_manager = swap.make();
  for (auto* link : cable.objects()) cable_manager->registerObject(link);
  cable_manager->setup();
  for (auto* link : robots.objects()) robot_manager->registerObject(link);
  robot_manager->setup();
  Truth truth(robots.objects());
  for (int plan = 0; plan < 4; ++plan) {
    SCOPED_TRACE("plan " + std::to_string(plan));
    jolt(cable.objects(), random, 0.02, 0.1);
    jolt(robots.objects(), random, 0.02, 0.1);
    cable_manager->update();
    truth.read(cable.objects());
    truth.expectAll(*cable_manager);
    truth.expectAll(*cable_manager, *robot_manager);
    truth.expectNearest(*cable_manager, *robot_manager);
    Truth links_apart(cable.objects());
    links_apart.ignoreNeighbors(cable.objects());
    links_apart.expectNearest(*cable_manager);
  }
}

MANAGER_SUITE(DloPlanning, ClientManagers);
TYPED_TEST(DloPlanning, CableAmongRobots) { runClient<TypeParam>(&cableAmongRobots, 3201); }

}  // namespace
}  // namespace fcl_fibers::test
