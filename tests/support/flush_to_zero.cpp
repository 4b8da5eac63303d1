// SPDX-License-Identifier: BSD-3-Clause

// With FCL_FIBERS_FLUSH_TO_ZERO in the environment a test flushes subnormals to zero and takes them
// for zero from its start on, in all threads, as a program does that is linked with -ffast-math.
#include <cstdio>
#include <cstdlib>

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace {

// Of a static object, as threads have the setting of the one that starts them.
[[maybe_unused]] const bool flushes_to_zero = [] {
  if (std::getenv("FCL_FIBERS_FLUSH_TO_ZERO") == nullptr) return false;
#if defined(__SSE2__)
  constexpr unsigned kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040;
  _mm_setcsr(_mm_getcsr() | kFlushToZero | kDenormalsAreZero);
  return true;
#else
  std::fputs("FCL_FIBERS_FLUSH_TO_ZERO needs SSE2\n", stderr);
  std::exit(1);
#endif
}();

}  // namespace
