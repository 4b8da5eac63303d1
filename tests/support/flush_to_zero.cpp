// SPDX-License-Identifier: BSD-3-Clause

// With FCL_FIBERS_FLUSH_TO_ZERO in the environment a test flushes subnormals to zero and takes them
// for zero from its start on, in all threads, as a program does that is linked with -ffast-math.
#include "support/float_environment.h"

#include <cstdio>
#include <cstdlib>

namespace fcl_fibers::test {
namespace {

// Of a static object, as threads have the setting of the one that starts them.
[[maybe_unused]] const bool flushes_to_zero = [] {
  if (std::getenv("FCL_FIBERS_FLUSH_TO_ZERO") == nullptr) return false;
  if (!FloatEnvironment::kCanFlush) {
    std::fputs("FCL_FIBERS_FLUSH_TO_ZERO is not known for this processor\n", stderr);
    std::exit(1);
  }
  FloatEnvironment::setMode(FloatEnvironment::mode() | FloatEnvironment::kFlush);
  return true;
}();

}  // namespace
}  // namespace fcl_fibers::test
