// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <sstream>
#include <stdexcept>

namespace fcl_fibers::scenes {

/// "call: name is value; remedy".
template <typename Value>
[[noreturn]] void refuseArgument(const char* call, const char* name, const Value& value,
                                 const char* remedy) {
  std::ostringstream message;
  message << call << ": " << name << " is " << value << "; " << remedy;
  throw std::invalid_argument(message.str());
}

/// The radius as S, which has to hold it with two bits to spare.
template <typename S>
S requireRadius(const char* call, double radius) {
  constexpr double kLimit = std::numeric_limits<S>::max() / 4;
  if (!(radius >= 0 && radius <= kLimit)) {
    refuseArgument(call, "radius", radius, "give a finite radius, zero or positive");
  }
  return static_cast<S>(radius);
}

}  // namespace fcl_fibers::scenes
