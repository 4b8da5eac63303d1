// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace fcl_fibers::test {

/// Has the calling thread flush subnormals to zero and take them for zero until it goes out of
/// scope, where the processor is known.
class ScopedFlushToZero {
 public:
#if defined(__SSE2__)
  static constexpr bool kIsPossible = true;
  static constexpr std::uint64_t kFlush = 0x8000 | 0x0040;
  static std::uint64_t mode() { return _mm_getcsr(); }
  static void setMode(std::uint64_t mode) { _mm_setcsr(static_cast<unsigned>(mode)); }
#elif defined(__aarch64__)
  static constexpr bool kIsPossible = true;
  static constexpr std::uint64_t kFlush = std::uint64_t{1} << 24;
  static std::uint64_t mode() {
    std::uint64_t mode;
    __asm__ volatile("mrs %0, fpcr" : "=r"(mode));
    return mode;
  }
  static void setMode(std::uint64_t mode) { __asm__ volatile("msr fpcr, %0" : : "r"(mode)); }
#else
  static constexpr bool kIsPossible = false;
  static constexpr std::uint64_t kFlush = 0;
  static std::uint64_t mode() { return 0; }
  static void setMode(std::uint64_t) {}
#endif

  explicit ScopedFlushToZero(bool on) : before_(mode()) {
    if (on) setMode(before_ | kFlush);
  }
  ~ScopedFlushToZero() { setMode(before_); }
  ScopedFlushToZero(const ScopedFlushToZero&) = delete;
  ScopedFlushToZero& operator=(const ScopedFlushToZero&) = delete;

 private:
  std::uint64_t before_;
};

}  // namespace fcl_fibers::test
