// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/simd.h"

#include <atomic>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include <hwy/targets.h>

namespace fcl_fibers::geometry {
namespace {

constexpr std::int64_t kNone = 0;

std::int64_t bestOf(std::int64_t targets) {
  for (const std::int64_t target : kSimdTargets) {
    if ((targets & target) != 0) return target;
  }
  return kNone;
}

std::int64_t targetNamed(const std::string& name) {
  for (const std::int64_t target : kSimdTargets) {
    if ((simdTargets() & target) != 0 && name == simdTargetName(target)) return target;
  }
  std::string known;
  for (const std::int64_t target : kSimdTargets) {
    if ((simdTargets() & target) == 0) continue;
    known += (known.empty() ? "" : ", ") + std::string(simdTargetName(target));
  }
  throw std::invalid_argument("fcl_fibers: FCL_FIBERS_SIMD=" + name +
                              " is not to be had here; set one of " + known + ", or unset it");
}

std::int64_t chosenByEnvironment() {
  const char* name = std::getenv("FCL_FIBERS_SIMD");
  return name == nullptr || *name == '\0' ? bestOf(simdTargets()) : targetNamed(name);
}

std::atomic<std::int64_t> in_use{kNone};

}  // namespace

std::int64_t simdTargets() { return (hwy::SupportedTargets() | HWY_STATIC_TARGET) & HWY_TARGETS; }

std::int64_t simdTarget() {
  std::int64_t target = in_use.load(std::memory_order_relaxed);
  if (target == kNone) in_use = target = chosenByEnvironment();
  return target;
}

const char* simdTargetName(std::int64_t target) {
  switch (target) {
    case HWY_AVX3:
      return "avx512";
    case HWY_AVX2:
      return "avx2";
    case HWY_SSE4:
      return "sse4";
    case HWY_NEON:
      return "neon";
    default:
      return "scalar";
  }
}

ScopedSimdTarget::ScopedSimdTarget(std::int64_t target) : before_(simdTarget()) { in_use = target; }
ScopedSimdTarget::~ScopedSimdTarget() { in_use = before_; }

}  // namespace fcl_fibers::geometry
