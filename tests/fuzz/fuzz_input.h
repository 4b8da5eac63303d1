// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fuzzer/FuzzedDataProvider.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <vector>

namespace fcl_fibers::fuzz {

/// Ends the program and tells where, unless the condition holds.
inline void require(bool condition, const char* file = __builtin_FILE(),
                    int line = __builtin_LINE()) {
  if (condition) return;
  std::fprintf(stderr, "%s:%d: not as required\n", file, line);
  std::abort();
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

/// Bytes from the front of the input, zeros behind its end. All other numbers come from its back,
/// so an input with zeros put before it means what it did.
inline std::vector<std::uint8_t> readBytes(FuzzedDataProvider& data, std::size_t count) {
  std::vector<std::uint8_t> bytes = data.ConsumeBytes<std::uint8_t>(count);
  bytes.resize(count);
  return bytes;
}
inline std::uint8_t readByte(FuzzedDataProvider& data) { return readBytes(data, 1)[0]; }

}  // namespace fcl_fibers::fuzz
