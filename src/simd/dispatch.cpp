// SPDX-License-Identifier: BSD-3-Clause
#include "simd/dispatch.h"

#include <cstdlib>
#include <stdexcept>
#include <string>

#include <hwy/targets.h>

namespace fcl_fibers::simd {
namespace {

/// The targets of the machine, whatever has been chosen since.
std::int64_t machineTargets() {
  static const std::int64_t targets = hwy::SupportedTargets() | HWY_STATIC_TARGET;
  return targets;
}

/// In Highway a better target is a lower bit. Lesser targets stay, because other users of Highway
/// in this process may not be compiled for this one.
void use(std::int64_t target) { hwy::SetSupportedTargetsForTest(machineTargets() & ~(target - 1)); }

std::int64_t targetNamed(const std::string& name) {
  std::string known;
  for (const std::int64_t target : availableTargets()) {
    if (name == targetName(target)) return target;
    known += (known.empty() ? "" : ", ") + std::string(targetName(target));
  }
  throw std::invalid_argument("fcl_fibers: FCL_FIBERS_SIMD=" + name +
                              " is not available here; set one of " + known +
                              ", or unset the variable");
}

}  // namespace

void readEnvironment() {
  [[maybe_unused]] static const bool read = [] {
    const char* name = std::getenv("FCL_FIBERS_SIMD");
    if (name != nullptr && *name != '\0') {
      use(targetNamed(name));
    } else if ((hwy::SupportedTargets() & HWY_STATIC_TARGET) == 0) {
      // Highway 1.0 takes a processor of arm64 without AES for one without NEON.
      use(availableTargets().front());
    }
    return true;
  }();
}

std::vector<std::int64_t> availableTargets() {
  std::vector<std::int64_t> available;
  for (auto rest = machineTargets() & HWY_TARGETS; rest != 0; rest &= rest - 1) {
    available.push_back(rest & -rest);
  }
  return available;
}

const char* targetName(std::int64_t target) {
  switch (target) {
    case HWY_AVX3:
      return "avx512";
    case HWY_AVX2:
      return "avx2";
    case HWY_SSE4:
      return "sse4";
    case HWY_NEON:
#ifdef HWY_NEON_WITHOUT_AES
    case HWY_NEON_WITHOUT_AES:
#endif
      return "neon";
    default:
      return "scalar";
  }
}

}  // namespace fcl_fibers::simd
