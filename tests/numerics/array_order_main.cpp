// SPDX-License-Identifier: BSD-3-Clause
//
// Prints the lines `arrays` of tests/data/pair_order/hashes.txt, without FCL, Eigen and GoogleTest,
// so that it can be built where they are not.
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "numerics/array_order.h"

int main(int argc, char** argv) try {
  const int threads = argc > 1 ? std::atoi(argv[1]) : 1;
  const auto hashes = fcl_fibers::test::arrayOrderHashes(threads);
  std::fputs(fcl_fibers::test::table("arrays", hashes).c_str(), stdout);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return EXIT_FAILURE;
}
