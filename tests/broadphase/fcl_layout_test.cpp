// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/fcl_layout.h"

#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace fcl_fibers::broadphase {
namespace {

// The check is compiled here as AVX-512 flags would compile it, without their instructions; that it
// lets a library of FCL's layout pass is what every other test relies on.
TEST(FclLayout, RefusesALibraryCompiledForAnotherLayout) {
  // If this fails, a library built with -march=native reads poses that FCL's objects do not have.
  try {
    requireLayoutOfFcl();
    ADD_FAILURE() << "nothing was thrown";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("aligned to 64 bytes"));
    EXPECT_THAT(error.what(), testing::HasSubstr("add -DEIGEN_MAX_ALIGN_BYTES=16"));
  }
}

}  // namespace
}  // namespace fcl_fibers::broadphase
