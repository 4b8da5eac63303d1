// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <string>

namespace fcl_fibers::test {

/// What FCL's templates, and so ours, are compiled for.
/// Usage: TYPED_TEST_SUITE(Suite, Scalars, ScalarName)
using Scalars = testing::Types<float, double>;

inline std::string scalarName(float) { return "Float"; }
inline std::string scalarName(double) { return "Double"; }

struct ScalarName {
  template <typename S>
  static std::string GetName(int) {
    return scalarName(S());
  }
};

}  // namespace fcl_fibers::test
