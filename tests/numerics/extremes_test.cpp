// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "numerics/extreme_rows.h"
#include "numerics/specimen.h"

namespace fcl_fibers::test {
namespace {

/// The number of a row.
class ExtremeTest : public testing::TestWithParam<std::size_t> {};

template <typename S>
void expectRight(const ExtremeRow<S>& row) {
  for (const Form form : {Form::kArrays, Form::kObjects}) {
    const Specimen<S> specimen(row.fibers, form);
    const std::vector<NumberPair> touching = touchingPairs(specimen.truth(), row.margin);
    for (const FiberTreeOptions& options : allKinds(row.margin)) {
      std::vector<NumberPair> pairs;
      {
        const ScopedFlushToZero flush(row.flush_to_zero);
        pairs = specimen.pairs(options);
      }
      EXPECT_TRUE(options.report == Report::kCapsules || !pairs.empty()) << "the row shows nothing";
      const Findings findings = examine(specimen.truth(), touching, options, pairs);
      EXPECT_EQ(findings.missed, 0u)
          << describe(form, options) << ": " << findings.first_wrong << " of " << touching.size();
      EXPECT_EQ(findings.repeated, 0u) << describe(form, options) << ": " << findings.first_wrong;
      // Scenes that vanish altogether have nothing to tell their parts by.
      if (row.flush_to_zero) continue;
      EXPECT_EQ(findings.unpromised, 0u)
          << describe(form, options) << ": " << findings.first_wrong << " of " << pairs.size();
    }
  }
}

// Touching capsules would be missed, or others reported that the report's promise rules out.
TEST_P(ExtremeTest, Float) { expectRight(extremeRows<float>()[GetParam()]); }
TEST_P(ExtremeTest, Double) { expectRight(extremeRows<double>()[GetParam()]); }

INSTANTIATE_TEST_SUITE_P(Rows, ExtremeTest,
                         testing::Range(std::size_t{0}, extremeRows<double>().size()),
                         [](const testing::TestParamInfo<std::size_t>& info) {
                           return extremeRows<double>()[info.param].name;
                         });

template <typename S>
class NumbersTest : public testing::Test {};
using Scalars = testing::Types<float, double>;
struct ScalarName {
  template <typename S>
  static std::string GetName(int) {
    return std::is_same_v<S, float> ? "Float" : "Double";
  }
};
TYPED_TEST_SUITE(NumbersTest, Scalars, ScalarName);

/// Five balls in a row, each touching the next, with coordinates up to `size`.
template <typename S>
Assembly<S> row(double size) {
  Assembly<S> fibers;
  for (int i = -2; i <= 2; ++i)
    fibers.addBall({size * (i / 2.0), 0, size * (i / 2.0)}, 0.36 * size);
  return fibers;
}

// An overflow would go by in silence, and with it pairs; or what can be answered be refused.
TYPED_TEST(NumbersTest, AreAnsweredOrRefusedUpToTheEndOfTheRange) {
  using S = TypeParam;
  constexpr int kLast = std::numeric_limits<S>::max_exponent;
  for (int exponent = kLast - 8; exponent <= kLast; ++exponent) {
    const double size = std::ldexp(1 - std::ldexp(1.0, -20), exponent);
    const Assembly<S> fibers = row<S>(size);
    for (const Form form : {Form::kArrays, Form::kObjects}) {
      const Specimen<S> specimen(fibers, form);
      const std::vector<NumberPair> touching = touchingPairs(specimen.truth());
      ASSERT_EQ(touching.size(), 4u);
      for (const FiberTreeOptions& options : allKinds()) {
        try {
          const Findings findings =
              examine(specimen.truth(), touching, options, specimen.pairs(options));
          EXPECT_TRUE(findings.isRight()) << "2^" << exponent << ", " << describe(form, options)
                                          << ": " << findings.first_wrong;
        } catch (const std::invalid_argument& error) {
          EXPECT_THAT(error.what(), testing::HasSubstr("coordinates overflow"));
          EXPECT_TRUE((std::is_same_v<S, double>)) << "float is read as double";
          EXPECT_GE(exponent, kLast - 3) << describe(form, options);
        }
      }
    }
  }
}

// Answers would be given for numbers that there are none for.
TYPED_TEST(NumbersTest, ThatAreNoneAreRefused) {
  using S = TypeParam;
  constexpr S kNaN = std::numeric_limits<S>::quiet_NaN();
  constexpr S kInfinity = std::numeric_limits<S>::infinity();
  for (const S bad : {kNaN, kInfinity, -kInfinity}) {
    for (const Form form : {Form::kArrays, Form::kObjects}) {
      Assembly<S> point = row<S>(1), radius = row<S>(1);
      point.points[3 * 4 + 1] = point.points[3 * 5 + 1] = bad;
      radius.radii[4] = bad;
      for (const FiberTreeOptions& options : allKinds()) {
        EXPECT_THROW(Specimen<S>(point, form).pairs(options), std::invalid_argument);
        EXPECT_THROW(Specimen<S>(radius, form).pairs(options), std::invalid_argument);
      }
    }
  }
}

// One tree's frame would be out of the other's range, and both be taken for apart.
TYPED_TEST(NumbersTest, OfTwoTreesMayLieAtOppositeEnds) {
  using S = TypeParam;
  constexpr int kFirst = std::is_same_v<S, float> ? -120 : -1010;
  for (const int exponent : {kFirst, kFirst / 2, 0}) {
    const double small = std::ldexp(1.0, exponent), large = std::ldexp(1.0, -exponent);
    const Assembly<S> tiny = row<S>(small);
    Assembly<S> huge;
    huge.addCapsule({-large, 0, 0}, {large, 0, 0}, 0.5 * small);    // through the row
    huge.addCapsule({-large, large, 0}, {large, large, 0}, large);  // up to it
    huge.addCapsule({-large, large, 0}, {large, large, 0}, large / 2);
    std::vector<GivenCapsule> all = tiny.capsules();
    for (const GivenCapsule& capsule : huge.capsules()) all.push_back(capsule);
    const TouchOracle truth(all);
    std::vector<NumberPair> expected;
    for (int i = 0; i < 5; ++i) {
      for (int j = 0; j < 3; ++j) {
        if (truth.touch(static_cast<std::size_t>(i), static_cast<std::size_t>(5 + j))) {
          expected.push_back({i, j});
        }
      }
    }
    ASSERT_GT(expected.size(), 5u);
    for (const Form form : {Form::kArrays, Form::kObjects}) {
      const Specimen<S> first(tiny, form), second(huge, form);
      for (const FiberTreeOptions& options : allKinds()) {
        for (const Topology topology : {Topology::kBundle, Topology::kSuperThread}) {
          FiberTreeOptions other = options;
          other.topology = topology;
          if (form == Form::kArrays && other.topology != options.topology) continue;
          auto forward = first.pairsWith(second, options, other);
          auto backward = second.pairsWith(first, other, options);
          for (NumberPair& pair : backward) std::swap(pair.a, pair.b);
          for (auto* pairs : {&forward, &backward}) {
            std::sort(pairs->begin(), pairs->end());
            EXPECT_TRUE(
                std::includes(pairs->begin(), pairs->end(), expected.begin(), expected.end()))
                << "2^" << exponent << ", " << describe(form, options) << ", " << pairs->size()
                << " of " << expected.size();
            EXPECT_EQ(std::adjacent_find(pairs->begin(), pairs->end()), pairs->end());
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::test
