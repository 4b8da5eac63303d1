// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cfenv>
#include <cstdint>

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace fcl_fibers::test {

/// How a thread computes: the direction in which it rounds, and whether it flushes subnormals to
/// zero and takes them for zero, which needs a processor that is known here.
struct FloatEnvironment {
#if defined(__SSE2__)
  static constexpr bool kCanFlush = true;
  static constexpr std::uint64_t kFlush = 0x8000 | 0x0040;
  static std::uint64_t mode() { return _mm_getcsr(); }
  static void setMode(std::uint64_t mode) { _mm_setcsr(static_cast<unsigned>(mode)); }
#elif defined(__aarch64__)
  static constexpr bool kCanFlush = true;
  static constexpr std::uint64_t kFlush = std::uint64_t{1} << 24;
  static std::uint64_t mode() {
    std::uint64_t mode;
    __asm__ volatile("mrs %0, fpcr" : "=r"(mode));
    return mode;
  }
  static void setMode(std::uint64_t mode) { __asm__ volatile("msr fpcr, %0" : : "r"(mode)); }
#else
  static constexpr bool kCanFlush = false;
  static constexpr std::uint64_t kFlush = 0;
  static std::uint64_t mode() { return 0; }
  static void setMode(std::uint64_t) {}
#endif

  int rounding = FE_TONEAREST;
  bool flushes_to_zero = false;

  bool isPossible() const { return !flushes_to_zero || kCanFlush; }
};

/// Gives the calling thread an environment until it goes out of scope.
class ScopedFloatEnvironment {
 public:
  explicit ScopedFloatEnvironment(const FloatEnvironment& environment)
      : rounding_(std::fegetround()), mode_(FloatEnvironment::mode()) {
    if (environment.flushes_to_zero) FloatEnvironment::setMode(mode_ | FloatEnvironment::kFlush);
    std::fesetround(environment.rounding);
  }
  ~ScopedFloatEnvironment() {
    FloatEnvironment::setMode(mode_);
    std::fesetround(rounding_);
  }
  ScopedFloatEnvironment(const ScopedFloatEnvironment&) = delete;
  ScopedFloatEnvironment& operator=(const ScopedFloatEnvironment&) = delete;

 private:
  int rounding_;
  std::uint64_t mode_;
};

}  // namespace fcl_fibers::test
