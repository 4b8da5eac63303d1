// SPDX-License-Identifier: BSD-3-Clause
#include "clients/client_support.h"

namespace fcl_fibers::test {
namespace {

// A manager that is emptied and filled for each request would keep what it knew.
void stateOfARobot(const Swap& swap, Random& random) {
  Scene<double> scene;
  scene.addFiber(wanderingChain(30, 0.1, 0.3, random), 0.03);
  addAllShapes(scene, 28, 0.3, 0.5, random);
  const std::shared_ptr<Manager> manager = swap.make();
  for (int request = 0; request < 4; ++request) {
    SCOPED_TRACE("request " + std::to_string(request));
    manager->clear();
    jolt(scene.objects(), random, 0.1, 0.5);
    manager->registerObjects(scene.objects());
    Truth(scene.objects()).expectAll(*manager);
  }
}

MANAGER_SUITE(Exotica, ClientManagers);
TYPED_TEST(Exotica, StateOfARobot) { runClient<TypeParam>(&stateOfARobot, 3801); }

}  // namespace
}  // namespace fcl_fibers::test
