// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gmock/gmock.h>

#include <stdexcept>
#include <string>

namespace fcl_fibers::test {

/// The text of the error that a call throws.
template <class F>
std::string textOf(F&& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing was thrown";
}

/// That a call throws an error that has this in its text.
template <class F>
void expectRefusal(F&& call, const std::string& text) {
  EXPECT_THAT(textOf(call), testing::HasSubstr(text));
}

}  // namespace fcl_fibers::test
