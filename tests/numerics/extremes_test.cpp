// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "numerics/extreme_rows.h"
#include "numerics/specimen.h"
#include "support/float_environment.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

/// The number of a row.
class ExtremeTest : public testing::TestWithParam<std::size_t> {};

template <typename S>
bool hasSubnormals(const Assembly<S>& fibers) {
  const auto is_subnormal = [](S x) { return std::fpclassify(x) == FP_SUBNORMAL; };
  return std::any_of(fibers.points.begin(), fibers.points.end(), is_subnormal) ||
         std::any_of(fibers.radii.begin(), fibers.radii.end(), is_subnormal);
}

/// What the findings of a row's queries have to be.
template <typename S>
class Expectation {
 public:
  Expectation(const ExtremeRow<S>& row, const TouchOracle& truth, std::vector<NumberPair> touching)
      : truth_(truth),
        touching_(std::move(touching)),
        // Scenes that vanish altogether have nothing to tell their parts by.
        vanishes_(row.environment.flushes_to_zero && hasSubnormals(row.fibers)) {}

  void check(const FiberTreeOptions& options, std::vector<NumberPair> pairs,
             const std::string& query) const {
    const Findings findings = examine(truth_, touching_, options, std::move(pairs));
    EXPECT_EQ(findings.missed, 0u)
        << query << ": " << findings.first_wrong << " of " << touching_.size();
    EXPECT_EQ(findings.repeated, 0u) << query << ": " << findings.first_wrong;
    if (vanishes_) return;
    EXPECT_EQ(findings.unpromised, 0u)
        << query << ": " << findings.first_wrong << " of " << findings.reported;
  }

 private:
  const TouchOracle& truth_;
  const std::vector<NumberPair> touching_;
  const bool vanishes_;
};

template <typename S>
std::vector<Form> formsOf(const ExtremeRow<S>& row) {
  if (row.isTapered()) return {Form::kArrays};
  return {Form::kArrays, Form::kObjects};
}

template <typename S>
void expectRight(const ExtremeRow<S>& row) {
  if (!row.environment.isPossible()) {
    GTEST_SKIP() << "no SSE2, which flushes subnormals to zero";
  }
  for (const Form form : formsOf(row)) {
    const Specimen<S> specimen(row.fibers, form);
    const Expectation<S> expected(row, specimen.truth(),
                                  touchingPairs(specimen.truth(), row.margin));
    for (const FiberTreeOptions& options : allKinds(row.margin)) {
      std::vector<NumberPair> pairs;
      {
        const ScopedFloatEnvironment scoped(row.environment);
        pairs = specimen.pairs(options);
      }
      EXPECT_TRUE(options.report == Report::kCapsules || !pairs.empty()) << "the row shows nothing";
      expected.check(options, std::move(pairs), describe(form, options));
    }
  }
}

// Touching capsules would be missed, or others reported that the report's promise rules out.
TEST_P(ExtremeTest, Float) { expectRight(extremeRows<float>()[GetParam()]); }
TEST_P(ExtremeTest, Double) { expectRight(extremeRows<double>()[GetParam()]); }

/// That each of `all` is called once, and nothing else. The last of `all` has the largest numbers.
void expectEach(const std::vector<NumberPair>& pairs, const std::vector<NumberPair>& all,
                const std::string& query) {
  ASSERT_FALSE(all.empty());
  ASSERT_EQ(pairs.size(), all.size()) << query;
  const auto count = static_cast<std::size_t>(all.back().b) + 1;
  std::vector<int> calls(count * count);
  const auto callsOf = [&](const NumberPair& pair) -> int& {
    const auto [low, high] = std::minmax(pair.a, pair.b);
    return calls.at(static_cast<std::size_t>(low) * count + static_cast<std::size_t>(high));
  };
  for (const NumberPair& pair : pairs) ++callsOf(pair);
  EXPECT_TRUE(std::all_of(all.begin(), all.end(), [&](const NumberPair& pair) {
    return callsOf(pair) == 1;
  })) << query;
}

/// By one report, to save time: by the one that passes over pairs for their capsules as well.
bool asksForDistances(const FiberTreeOptions& options) {
  return options.report == Report::kCapsules;
}

template <typename S>
void expectRightWhenGrown(const ExtremeRow<S>& row) {
  const Specimen<S> specimen(row.fibers, Form::kObjects);
  const Expectation<S> expected(row, specimen.truth(), touchingPairs(specimen.truth(), row.margin));
  const auto count = static_cast<std::int32_t>(specimen.truth().size());
  std::vector<NumberPair> all;
  for (std::int32_t i = 0; i < count; ++i) {
    for (std::int32_t j = i + 1; j < count; ++j) all.push_back({i, j});
  }
  for (const FiberTreeOptions& options : allKinds(row.margin)) {
    for (const History history : {History::kGrown, History::kLate}) {
      const std::string query =
          describe(Form::kObjects, options) + (history == History::kGrown ? ", grown" : ", late");
      const bool asks_distances = history == History::kLate && asksForDistances(options);
      std::vector<NumberPair> pairs, calls;
      {
        const ScopedFloatEnvironment scoped(row.environment);
        pairs = specimen.pairs(options, history);
        if (asks_distances) calls = specimen.pairs(options, history, Query::kDistance);
      }
      expected.check(options, std::move(pairs), query);
      if (asks_distances) expectEach(std::move(calls), all, query + ", distance");
    }
  }
}

template <typename S>
void expectRightOfHalves(const ExtremeRow<S>& row) {
  // Every other fiber is one half.
  Assembly<S> halves[2];
  for (Assembly<S>& half : halves) half.radii_are = row.fibers.radii_are;
  for (std::size_t f = 0; f < row.fibers.fiberCount(); ++f) {
    Assembly<S>& half = halves[f % 2];
    for (std::size_t i = row.fibers.point_begin[f]; i < row.fibers.point_begin[f + 1]; ++i) {
      half.addPoint(row.fibers.point(i), static_cast<double>(row.fibers.radii[i]));
    }
    half.endFiber();
  }
  for (const Form form : formsOf(row)) {
    const Specimen<S> first(halves[0], form), second(halves[1], form);
    std::vector<GivenCapsule> capsules;
    for (const Specimen<S>* half : {&first, &second}) {
      for (std::size_t i = 0; i < half->truth().size(); ++i) capsules.push_back(half->truth()[i]);
    }
    const TouchOracle truth(std::move(capsules));
    // Those of the second half are counted on from the first.
    const auto middle = static_cast<std::int32_t>(first.truth().size());
    const auto end = static_cast<std::int32_t>(truth.size());
    std::vector<NumberPair> all, touching;
    for (std::int32_t i = 0; i < middle; ++i) {
      for (std::int32_t j = middle; j < end; ++j) {
        all.push_back({i, j});
        if (truth.touch(static_cast<std::size_t>(i), static_cast<std::size_t>(j), row.margin)) {
          touching.push_back({i, j});
        }
      }
    }
    ASSERT_FALSE(all.empty());
    const Expectation<S> expected(row, truth, std::move(touching));
    for (const FiberTreeOptions& options : allKinds(row.margin)) {
      // The margin of the one that is asked counts, which here is the smaller one.
      FiberTreeOptions other = options;
      other.margin = 1.5 * row.margin + row.fibers.radii.front();
      const auto ask = [&](Partner partner, Query query) {
        std::vector<NumberPair> pairs;
        {
          const ScopedFloatEnvironment scoped(row.environment);
          pairs = first.pairsWith(second, options, other, partner, query);
        }
        for (NumberPair& pair : pairs) pair.b += middle;
        return pairs;
      };
      for (const Partner partner : {Partner::kManager, Partner::kEachObject}) {
        if (form == Form::kArrays && partner == Partner::kEachObject) continue;
        const std::string query =
            describe(form, options) + (partner == Partner::kManager ? ", two" : ", one by one");
        expected.check(options, ask(partner, Query::kCollide), query);
        if (form == Form::kArrays || !asksForDistances(options)) continue;
        expectEach(ask(partner, Query::kDistance), all, query + ", distance");
      }
    }
  }
}

template <typename S>
void expectRightByOtherQueries(const ExtremeRow<S>& row) {
  if (!row.environment.isPossible()) {
    GTEST_SKIP() << "no SSE2, which flushes subnormals to zero";
  }
  if (!row.isTapered()) expectRightWhenGrown(row);
  expectRightOfHalves(row);
}

// What holds for the self-collision of a new tree would not hold for the objects of another manager
// or of none, for those registered after a query, or for distances.
TEST_P(ExtremeTest, FloatByOtherQueries) {
  expectRightByOtherQueries(extremeRows<float>()[GetParam()]);
}
TEST_P(ExtremeTest, DoubleByOtherQueries) {
  expectRightByOtherQueries(extremeRows<double>()[GetParam()]);
}

INSTANTIATE_TEST_SUITE_P(Rows, ExtremeTest,
                         testing::Range(std::size_t{0}, extremeRows<double>().size()),
                         [](const testing::TestParamInfo<std::size_t>& info) {
                           return extremeRows<double>()[info.param].name;
                         });

// The table that users read would be of another commit.
TEST(ExtremeRows, AreThoseOfTheDocument) {
  if (!FloatEnvironment::kCanFlush) {
    GTEST_SKIP() << "no SSE2, which flushes subnormals to zero";
  }
  std::ifstream file(FCL_FIBERS_SOURCE_DIR "/docs/numerics/rows.csv");
  std::string document;
  for (std::string line; std::getline(file, line);) document += line + '\n';
  EXPECT_EQ(document, rowsTable());
}

template <typename S>
class NumbersTest : public testing::Test {};
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
          // FCL takes coordinates of such objects for infinite, and a sphere around an open box is
          // around everything.
          const bool may_be_open = form == Form::kObjects && exponent >= kLast - 1 &&
                                   options.volumes == FiberTreeOptions::Volumes::kWrappedSpheres &&
                                   options.report == Report::kVolumes;
          EXPECT_TRUE(findings.isRight() ||
                      (may_be_open && findings.missed == 0 && findings.repeated == 0))
              << "2^" << exponent << ", " << describe(form, options) << ": "
              << findings.first_wrong;
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
