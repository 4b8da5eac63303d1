// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fuzzer/FuzzedDataProvider.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>

namespace fcl_fibers::fuzz {

inline void require(bool condition) {
  if (!condition) std::abort();
}

template <typename Call>
bool isRefused(Call&& call) {
  try {
    call();
  } catch (const std::invalid_argument&) {
    return true;
  }
  return false;
}

/// Mostly tame, as a scene with one wild number is refused mostly: two of `kinds` are not.
template <typename S>
S readNumber(FuzzedDataProvider& data, int kinds) {
  switch (data.ConsumeIntegralInRange(0, kinds - 1)) {
    case 0:
      return data.ConsumeFloatingPoint<S>();
    case 1:
      return std::ldexp(S(data.ConsumeIntegral<std::int8_t>()),
                        data.ConsumeIntegralInRange(-140, 120));
    default:
      return S(data.ConsumeIntegral<std::int8_t>()) / 16;
  }
}

}  // namespace fcl_fibers::fuzz
