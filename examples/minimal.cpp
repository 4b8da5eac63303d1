// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>

#include <fcl_fibers/fiber_tree.h>

int main() {
  using namespace fcl_fibers;
  double points[] = {-1, 0, 0, 0, 0, 0, 1, 0, 0, 0.5, -1, 0.15, 0.5, 1, 0.15};  // x, y, z of five
  const std::size_t point_begin[] = {0, 3, 5};  // the first fiber has three of them, the second two
  const double radius = 0.1;
  const FiberArrays<double> fibers = {points, 5, point_begin, 2, &radius};

  FiberTree tree;
  tree.build(fibers);
  const auto print = [](SegmentPair p) { std::printf("segments %d and %d touch\n", p.a, p.b); };
  tree.visit(Pairs{}, print);

  points[9] = points[12] = -0.5;  // the second fiber moves along the first
  tree.update(fibers);
  tree.visit(Pairs{}, print);
}
