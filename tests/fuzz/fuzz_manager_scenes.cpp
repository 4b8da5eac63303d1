// SPDX-License-Identifier: BSD-3-Clause
//
// The random scenes of two managers that docs/numerics.md tells of, with the input in the place of
// chance: motion, times of impact, distances, clones and failed updates, on one thread and on two.
// Brute force judges all answers.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>

#include "fuzz_input.h"
#include "numerics/manager_differential.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using fcl_fibers::test::Random;
  if (size == 0) return 0;
  fcl_fibers::test::ManagerTally tally;
  const Random random(bytes[0], bytes + 1, size - 1);
  const std::string wrong = differManagers(random, 1 + bytes[0] % 2, tally);
  if (!wrong.empty()) std::fprintf(stderr, "%s\n", wrong.c_str());
  fcl_fibers::fuzz::require(wrong.empty());
  return 0;
}
