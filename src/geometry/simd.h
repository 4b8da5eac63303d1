// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include <hwy/highway.h>

namespace fcl_fibers::geometry {

/// Instruction sets that files named -inl.h are compiled for, the best first.
constexpr std::array<std::int64_t, 6> kSimdTargets = {HWY_AVX3, HWY_AVX2,   HWY_SSE4,
                                                      HWY_NEON, HWY_EMU128, HWY_SCALAR};

/// The target in use: the best that both this machine and the compiler know, or the one that the
/// environment variable FCL_FIBERS_SIMD names: scalar, sse4, avx2, avx512 or neon. Throws
/// std::invalid_argument if that is none of these or not to be had here.
std::int64_t simdTarget();

/// For tests: another target than the environment's, until it goes out of scope.
class ScopedSimdTarget {
 public:
  /// @pre the machine and the compiler know it, see simdTargets()
  explicit ScopedSimdTarget(std::int64_t target);
  ~ScopedSimdTarget();
  ScopedSimdTarget(const ScopedSimdTarget&) = delete;
  ScopedSimdTarget& operator=(const ScopedSimdTarget&) = delete;

 private:
  std::int64_t before_;
};

/// The targets to be had, as a mask.
std::int64_t simdTargets();

const char* simdTargetName(std::int64_t target);

}  // namespace fcl_fibers::geometry

// OF(NAMESPACE) for the target in use, in a file that foreach_target.h has compiled for all.
#if HWY_TARGETS & HWY_AVX3
#define FCL_FIBERS_AVX3_TARGET(OF) OF(N_AVX3)
#else
#define FCL_FIBERS_AVX3_TARGET(OF) nullptr
#endif
#if HWY_TARGETS & HWY_AVX2
#define FCL_FIBERS_AVX2_TARGET(OF) OF(N_AVX2)
#else
#define FCL_FIBERS_AVX2_TARGET(OF) nullptr
#endif
#if HWY_TARGETS & HWY_SSE4
#define FCL_FIBERS_SSE4_TARGET(OF) OF(N_SSE4)
#else
#define FCL_FIBERS_SSE4_TARGET(OF) nullptr
#endif
#if HWY_TARGETS & HWY_NEON
#define FCL_FIBERS_NEON_TARGET(OF) OF(N_NEON)
#else
#define FCL_FIBERS_NEON_TARGET(OF) nullptr
#endif
#if HWY_TARGETS & HWY_EMU128
#define FCL_FIBERS_EMU128_TARGET(OF) OF(N_EMU128)
#else
#define FCL_FIBERS_EMU128_TARGET(OF) nullptr
#endif
#if HWY_TARGETS & HWY_SCALAR
#define FCL_FIBERS_SCALAR_TARGET(OF) OF(N_SCALAR)
#else
#define FCL_FIBERS_SCALAR_TARGET(OF) nullptr
#endif

#define FCL_FIBERS_BEST_TARGET(TYPE, OF)                                                  \
  ::fcl_fibers::geometry::forSimdTarget(std::array<TYPE, 6>{                              \
      FCL_FIBERS_AVX3_TARGET(OF), FCL_FIBERS_AVX2_TARGET(OF), FCL_FIBERS_SSE4_TARGET(OF), \
      FCL_FIBERS_NEON_TARGET(OF), FCL_FIBERS_EMU128_TARGET(OF), FCL_FIBERS_SCALAR_TARGET(OF)})

namespace fcl_fibers::geometry {

/// The entry of the target in use, of one for each of kSimdTargets.
template <class T>
T forSimdTarget(const std::array<T, 6>& of_targets) {
  const std::int64_t target = simdTarget();
  for (std::size_t i = 0; i < of_targets.size(); ++i) {
    if (kSimdTargets[i] == target) return of_targets[i];
  }
  return nullptr;
}

}  // namespace fcl_fibers::geometry
