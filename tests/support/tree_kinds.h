// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <fcl_fibers/fiber_tree.h>

namespace fcl_fibers::test {

inline FiberTreeOptions optionsOf(FiberTreeOptions::Volumes volumes, Topology topology,
                                  Report report) {
  FiberTreeOptions options = FiberOptions{topology, report};
  options.volumes = volumes;
  return options;
}

/// Both kinds of volumes and both topologies.
inline std::vector<FiberTreeOptions> allKinds(Report report) {
  using Volumes = FiberTreeOptions::Volumes;
  std::vector<FiberTreeOptions> kinds;
  for (const auto volumes : {Volumes::kLayeredBoxes, Volumes::kWrappedSpheres}) {
    for (const auto topology : {Topology::kBundle, Topology::kSuperThread}) {
      kinds.push_back(optionsOf(volumes, topology, report));
    }
  }
  return kinds;
}

}  // namespace fcl_fibers::test
