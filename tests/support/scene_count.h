// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstdlib>

namespace fcl_fibers::test {

/// The environment variable FCL_FIBERS_LIVE_SCENES asks for more random scenes than usual.
inline std::uint64_t sceneCount(std::uint64_t usual) {
  const char* const text = std::getenv("FCL_FIBERS_LIVE_SCENES");
  return text != nullptr ? std::strtoull(text, nullptr, 10) : usual;
}

}  // namespace fcl_fibers::test
