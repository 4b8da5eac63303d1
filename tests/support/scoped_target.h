// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <hwy/targets.h>

#include "simd/dispatch.h"

namespace fcl_fibers::simd {

/// The target that HWY_DYNAMIC_DISPATCH chooses.
inline std::int64_t targetInUse() {
  readEnvironment();
  const std::int64_t targets = hwy::SupportedTargets() & HWY_TARGETS;
  return targets & -targets;
}

/// Another target than the environment's is used during its lifetime.
class ScopedTarget {
 public:
  /// @pre the target is one of availableTargets()
  explicit ScopedTarget(std::int64_t target) : before_(targetInUse()) { use(target); }
  ~ScopedTarget() { use(before_); }
  ScopedTarget(const ScopedTarget&) = delete;
  ScopedTarget& operator=(const ScopedTarget&) = delete;

 private:
  /// In Highway a better target is a lower bit.
  static void use(std::int64_t target) {
    std::int64_t left = 0;
    for (const std::int64_t other : availableTargets()) left |= other >= target ? other : 0;
    hwy::SetSupportedTargetsForTest(left);
  }
  std::int64_t before_;
};

}  // namespace fcl_fibers::simd
