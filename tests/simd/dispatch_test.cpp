// SPDX-License-Identifier: BSD-3-Clause
#include "simd/dispatch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/scoped_target.h"

namespace fcl_fibers::simd {
namespace {

// The instruction set is chosen once in a process, so each choice below is made in a new one: a
// death test of this style runs the program again, up to its statement.
class SimdEnvironment : public testing::Test {
 protected:
  SimdEnvironment() { testing::FLAGS_gtest_death_test_style = "threadsafe"; }
};

/// Prints what is chosen under that environment.
[[noreturn]] void choose(const char* name) {
  if (name == nullptr) {
    ::unsetenv("FCL_FIBERS_SIMD");
  } else {
    ::setenv("FCL_FIBERS_SIMD", name, 1);
  }
  try {
    std::cerr << "chosen: " << targetName(targetInUse()) << ';' << std::endl;
  } catch (const std::invalid_argument& refusal) {
    std::cerr << "refused: " << refusal.what() << std::endl;
    std::exit(1);
  }
  std::exit(0);
}
std::string chosen(std::int64_t target) {
  return std::string("chosen: ") + targetName(target) + ";";
}

// Queries would crash on a machine for which there is no target.
TEST(SimdTargets, ThereIsOneForEveryMachine) {
  const std::vector<std::int64_t> available = availableTargets();
  ASSERT_FALSE(available.empty());
  std::set<std::string> names;
  for (const std::int64_t target : available) names.insert(targetName(target));
  EXPECT_EQ(names.size(), available.size()) << "two of one name cannot both be asked for";
  // Emulated, unless all is compiled for one instruction set.
  EXPECT_EQ(names.count(targetName(HWY_STATIC_TARGET)), 1u);
}

// Nobody could compare instruction sets, or go around a broken one.
TEST_F(SimdEnvironment, EachNameThatIsToBeHadWorks) {
  for (const std::int64_t target : availableTargets()) {
    EXPECT_EXIT(choose(targetName(target)), testing::ExitedWithCode(0), chosen(target));
  }
}

// Users who set nothing would not get the best.
TEST_F(SimdEnvironment, TheBestIsTakenWhereNoneIsNamed) {
  EXPECT_EXIT(choose(nullptr), testing::ExitedWithCode(0), chosen(availableTargets()[0]));
  EXPECT_EXIT(choose(""), testing::ExitedWithCode(0), chosen(availableTargets()[0]));
}

// A misspelt name would run silently with another instruction set.
TEST_F(SimdEnvironment, AnUnknownNameIsRefusedAndTheKnownOnesAreListed) {
  for (const char* name : {"mmx", "AVX2", "scalar ", "avx2,sse4"}) {
    EXPECT_EXIT(choose(name), testing::ExitedWithCode(1),
                std::string("refused: .*FCL_FIBERS_SIMD=") + name);
    for (const std::int64_t target : availableTargets()) {
      EXPECT_EXIT(choose(name), testing::ExitedWithCode(1),
                  std::string("set one of .*") + targetName(target));
    }
  }
}

// A name that this machine does not have would end in an illegal instruction.
TEST_F(SimdEnvironment, ANameOfAnotherMachineIsRefused) {
  std::set<std::string> here;
  for (const std::int64_t target : availableTargets()) here.insert(targetName(target));
  for (const char* name : {"sse4", "avx2", "avx512", "neon"}) {
    if (here.count(name) != 0) continue;
    EXPECT_EXIT(choose(name), testing::ExitedWithCode(1),
                std::string("is not available here; set one of "));
  }
}

// Tests of one target would leave it to all that follow.
TEST(ScopedTarget, LastsAsLongAsItsScope) {
  const std::int64_t before = targetInUse();
  for (const std::int64_t outer : availableTargets()) {
    const ScopedTarget scoped(outer);
    EXPECT_EQ(targetInUse(), outer);
    {
      const ScopedTarget inner(availableTargets().back());
      EXPECT_EQ(targetInUse(), availableTargets().back());
    }
    EXPECT_EQ(targetInUse(), outer);
  }
  EXPECT_EQ(targetInUse(), before);
}

}  // namespace
}  // namespace fcl_fibers::simd
