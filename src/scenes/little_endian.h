// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstring>
#include <string>
#include <type_traits>

namespace fcl_fibers::scenes {

/// Appends a number, its least byte first, whatever the machine.
template <typename Number>
void appendLittleEndian(std::string& bytes, Number number) {
  static_assert(std::is_arithmetic_v<Number>);
  char raw[sizeof number];
  std::memcpy(raw, &number, sizeof number);
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
  for (std::size_t i = sizeof number; i-- > 0;) bytes += raw[i];
#else
  bytes.append(raw, sizeof number);
#endif
}

}  // namespace fcl_fibers::scenes
