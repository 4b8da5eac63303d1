// SPDX-License-Identifier: BSD-3-Clause

// Fibers from a file's bytes in a tree, by the libraries that need neither FCL nor Eigen. Exits
// with failure if their crossing is not found.
#include <cstdio>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/io/fiber_file.h>
#include <fcl_fibers/io/sampling.h>

int main() {
  using namespace fcl_fibers;
  io::FiberFileOptions options;
  options.radius = 0.06;
  const FiberPolylines fibers = io::parseFibers("-1 0 0\n1 0 0\n\n0 -1 0.1\n0 1 0.1\n", "two lines",
                                                io::FiberFormat::kPolylines, options)
                                    .fibers;
  FiberTree tree;
  tree.build(fiberArrays(fibers));
  int pairs = 0;
  tree.visitPairs([&](SegmentPair) { ++pairs; });
  std::printf("pairs %d, largest curvature %g\n", pairs, io::largestCurvature(fibers));
  return pairs == 1 && io::largestCurvature(fibers) == 0 ? 0 : 1;
}
