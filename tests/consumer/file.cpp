// SPDX-License-Identifier: BSD-3-Clause

// Fibers and a mesh from files' bytes, by the libraries that need neither FCL nor Eigen. Exits with
// failure if their crossings are not found.
#include <cstdio>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/io/fiber_file.h>
#include <fcl_fibers/io/mesh_file.h>
#include <fcl_fibers/io/sampling.h>
#include <fcl_fibers/triangle_mesh.h>

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
  tree.visit(Pairs{}, [&](SegmentPair) { ++pairs; });
  const io::MeshFile file = io::parseMesh("v 0 -1 -1\nv 0 1 -1\nv 0 0 1\nf 1 2 3\n", "a triangle");
  const TriangleMesh mesh(meshArrays(file));
  tree.visit(Pairs{}, mesh, [&](TrianglePair) { ++pairs; });
  std::printf("pairs %d, largest curvature %g\n", pairs, io::largestCurvature(fibers));
  return pairs == 3 && io::largestCurvature(fibers) == 0 ? 0 : 1;
}
