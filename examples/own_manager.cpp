// SPDX-License-Identifier: BSD-3-Clause
#include <fcl/broadphase/broadphase_SSaP.h>
#include <fcl_fibers/benchmark/managers.h>

// FCL's sorted sweep stands here for the manager that you wrote.
using MyManager = fcl::SSaPCollisionManagerd;

int main(int argc, char** argv) {
  using namespace fcl_fibers::benchmarks;
  registerManager<MyManager>("mine", Boxes::kTight);
  registerPeers();
  return run(argc, argv);
}
