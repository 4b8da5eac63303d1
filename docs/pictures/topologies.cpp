// SPDX-License-Identifier: BSD-3-Clause

// Prints the nodes of both topologies over the fibers of a file, for topologies.py:
//
//     topologies FILE RADIUS
//
// Each line has a topology, the low and the high corner of a node's box, x and y of both, and the
// node's segments as FIBER:SEGMENT.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/io/fiber_file.h>

namespace {

using fcl_fibers::FiberTree;
using fcl_fibers::Topology;
using fcl_fibers::TreeVolume;

void printNodes(const fcl_fibers::FiberPolylines& fibers, Topology topology, const char* name,
                int depth) {
  FiberTree tree(fcl_fibers::FiberOptions{topology, fcl_fibers::Report::kVolumes});
  tree.build(fcl_fibers::fiberArrays(fibers));
  for (const TreeVolume& node : tree.volumes(depth)) {
    std::printf("%s %.9g %.9g %.9g %.9g", name, node.center[0] - node.half[0],
                node.center[1] - node.half[1], node.center[0] + node.half[0],
                node.center[1] + node.half[1]);
    for (std::size_t i = 0; i < node.segment_count; ++i) {
      const auto at = tree.fiberSegment(node.segments[i]);
      std::printf(" %zu:%zu", at.fiber, at.number);
    }
    std::puts("");
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: topologies FILE RADIUS\n");
    return 2;
  }
  try {
    fcl_fibers::io::FiberFileOptions how;
    how.radius = std::strtod(argv[2], nullptr);
    const auto file = fcl_fibers::io::readFibers(argv[1], how);
    // Three levels of two children each are as many nodes as one level of eight.
    printNodes(file.fibers, Topology::kSuperThread, "super-thread", 3);
    printNodes(file.fibers, Topology::kBundle, "bundle", 1);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
