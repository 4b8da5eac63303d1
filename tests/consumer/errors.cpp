// SPDX-License-Identifier: BSD-3-Clause

// Catches errors of the library by their type, and what a visitor throws through the library. Exits
// with failure if one comes as another type, or does not come.
#include <cstdio>
#include <stdexcept>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/io/fiber_file.h>

struct Enough {
  int pairs;
};

template <class Error, class Call>
bool throws(const char* what, Call call) {
  try {
    call();
  } catch (const Error&) {
    return true;
  } catch (...) {
  }
  std::printf("not thrown as its type: %s\n", what);
  return false;
}

int main() {
  const double points[] = {-1, 0, 0, 1, 0, 0, 0, -1, 0.1, 0, 1, 0.1};
  const std::size_t point_begin[] = {0, 2, 4};
  const double radius = 0.06, negative = -1;
  const fcl_fibers::FiberArrays<double> fibers{points, 4, point_begin, 2, &radius};
  const fcl_fibers::FiberArrays<double> wrong{points, 4, point_begin, 2, &negative};
  fcl_fibers::FiberTree tree;
  tree.build(fibers);
  const bool is_right[] = {
      throws<std::invalid_argument>("a negative radius", [&] { tree.update(wrong); }),
      throws<std::runtime_error>("no file",
                                 [] { fcl_fibers::io::readFibers("errors/no_such.hair"); }),
      throws<Enough>("a visitor's own",
                     [&] {
                       tree.visit(fcl_fibers::Pairs{},
                                  [](fcl_fibers::SegmentPair) { throw Enough{1}; });
                     }),
  };
  return is_right[0] && is_right[1] && is_right[2] ? 0 : 1;
}
