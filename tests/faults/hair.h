// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <fcl_fibers/fiber_tree.h>

#include "support/assembly.h"
#include "support/random.h"

namespace fcl_fibers::test {

/// Of radius 0.05.
inline Assembly<double> hair(int fibers, int points_each, std::uint64_t seed) {
  Random random(seed);
  Assembly<double> hair;
  for (int f = 0; f < fibers; ++f) {
    Eigen::Vector3d point = random.inCube(0.5);
    for (int i = 0; i < points_each; ++i) {
      hair.addPoint({point.x(), point.y(), point.z()}, 0.05);
      point += 0.2 * random.direction();
    }
    hair.endFiber();
  }
  hair.radii = {0.05};
  hair.radii_are = FiberArrays<double>::Radii::kOne;
  return hair;
}

}  // namespace fcl_fibers::test
