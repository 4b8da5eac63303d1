// SPDX-License-Identifier: BSD-3-Clause
//
// The judges are judged: each is given wrong answers, and has to say what is wrong with them.
#include "support/pair_oracle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "support/distance_search.h"
#include "support/promise.h"
#include "support/scalars.h"
#include "support/scene.h"

namespace fcl_fibers::test {
namespace {

using testing::HasSubstr;
using testing::Not;
using NumberPairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// Five balls in a row, each touching the next. The first three are a fiber, whose neighbours are
/// ignored.
template <typename S>
class Judges : public testing::Test {
 protected:
  using Objects = typename PairOracle<S>::Objects;

  Judges() {
    for (int i = 0; i < 5; ++i) scene.addSphere({1.0 * i, 0, 0}, 0.6);
    all = scene.objects();
    first = {all[0], all[1], all[2]};
    last = {all[3], all[4]};
  }
  static PairRules rules() {
    return {LeafVolume::kBox, Report::kCapsules, 0, /*ignored_neighbors=*/1};
  }
  PairOracle<S> oracle() const { return {all, rules(), {first}}; }
  Calls<S> calls(const NumberPairs& numbers) const {
    Calls<S> calls;
    for (const auto& [a, b] : numbers) calls.emplace_back(all[a], all[b]);
    return calls;
  }

  Scene<S> scene;
  Objects all, first, last;
};
TYPED_TEST_SUITE(Judges, Scalars, ScalarName);

/// That the judge finds this and nothing else.
void expectFound(const testing::AssertionResult& result, const std::string& what) {
  EXPECT_FALSE(result) << what;
  EXPECT_THAT(result.message(), HasSubstr(what));
  for (const char* word :
       {"missing", "extra", "repeated", "turned", "self", "ignored", "unasked", "nothing"}) {
    if (what.find(word) != std::string::npos) continue;
    EXPECT_THAT(result.message(), Not(HasSubstr(word)));
  }
}

// A manager that answers wrongly would pass every contract test.
TYPED_TEST(Judges, NameEachWrongPairOfASelfCollision) {
  const auto oracle = this->oracle();
  const auto answer = [&](const NumberPairs& pairs) {
    return oracle.answersSelf(this->calls(pairs), this->all);
  };
  EXPECT_TRUE(answer({{2, 3}, {3, 4}}));
  EXPECT_TRUE(answer({{3, 4}, {2, 3}}));
  expectFound(answer({{2, 3}}), "missing pair (3, 4)");
  expectFound(answer({}), "missing pair (2, 3)");
  expectFound(answer({{2, 3}, {3, 4}, {0, 2}}), "extra pair (0, 2)");
  expectFound(answer({{2, 3}, {3, 4}, {2, 3}}), "repeated pair (2, 3)");
  expectFound(answer({{3, 2}, {3, 4}}), "turned pair (3, 2)");
  expectFound(answer({{2, 3}, {3, 4}, {1, 1}}), "self pair (1, 1)");
  expectFound(answer({{2, 3}, {3, 4}, {0, 1}}), "ignored pair (0, 1)");
  EXPECT_TRUE(oracle.answersSelf(this->calls({{3, 2}, {3, 4}}), this->all, ArgumentOrder::kAny));
  // Of the objects that are managed.
  expectFound(oracle.answersSelf(this->calls({{3, 4}, {2, 3}}), this->last), "unasked pair (2, 3)");
  Scene<TypeParam> stranger;
  EXPECT_THAT(
      oracle.answersSelf({{stranger.addSphere({0, 0, 0}, 1), this->all[0]}}, this->all).message(),
      HasSubstr("an object nobody registered"));
}

// The same between two managers.
TYPED_TEST(Judges, NameEachWrongPairOfTwoManagers) {
  const auto oracle = this->oracle();
  const auto answer = [&](const NumberPairs& pairs) {
    return oracle.answersBetween(this->calls(pairs), this->first, this->last);
  };
  EXPECT_TRUE(answer({{2, 3}}));
  expectFound(answer({}), "missing pair (2, 3)");
  expectFound(answer({{2, 3}, {0, 4}}), "extra pair (0, 4)");
  expectFound(answer({{2, 3}, {2, 3}}), "repeated pair (2, 3)");
  expectFound(answer({{3, 2}}), "turned pair (3, 2)");
  expectFound(answer({{2, 3}, {3, 3}}), "self pair (3, 3)");
  expectFound(answer({{2, 3}, {3, 4}}), "unasked pair (3, 4)");
  expectFound(oracle.answersBetween(this->calls({{1, 2}}), {this->all[1]}, {this->all[2]},
                                    ArgumentOrder::kPromised, 0),
              "ignored pair (1, 2)");
}

// A scene in which nothing is to be found would prove nothing, unnoticed.
TYPED_TEST(Judges, RefuseASceneThatShowsNothing) {
  const auto oracle = this->oracle();
  constexpr auto kOrder = ArgumentOrder::kPromised;
  const auto expected = this->calls({{2, 3}, {3, 4}});
  expectFound(oracle.answersSelf({}, this->first), "shows nothing");
  expectFound(oracle.answersBetween({}, {this->all[0]}, this->last), "shows nothing");
  EXPECT_TRUE(oracle.answersSelf({}, this->first, kOrder, 0));
  EXPECT_TRUE(oracle.answersSelf(expected, this->all, kOrder, 2));
  expectFound(oracle.answersSelf(expected, this->all, kOrder, 3), "shows nothing");
}

// A manager whose distance queries give wrong pairs would pass, as the smallest distance may still
// be right.
TYPED_TEST(Judges, NameAWrongCallOfADistanceQuery) {
  using S = TypeParam;
  const auto oracle = this->oracle();
  const auto search = [&](const NumberPairs& pairs, bool is_self = true) {
    DistanceSearch<S> search(oracle);
    search.lowers = false;
    search.asked.emplace();
    search.asked->managed = is_self ? this->all : this->first;
    if (!is_self) search.asked->partners = this->last;
    search.asked->keeps_promises = true;
    S distance = std::numeric_limits<S>::max();
    for (const auto& [a, b] : this->calls(pairs)) {
      DistanceSearch<S>::visit(a, b, &search, distance);
    }
    return search;
  };
  NumberPairs every;
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t j = std::max(i + 1, std::size_t{3}); j < 5; ++j) {
      every.push_back({i, j});
    }
  }
  every.push_back({0, 2});
  const auto with = [&](std::pair<std::size_t, std::size_t> pair) {
    NumberPairs pairs = every;
    pairs.push_back(pair);
    return search(pairs).keepsToTheRules();
  };
  EXPECT_TRUE(search(every).keepsToTheRules());
  expectFound(with({0, 3}), "repeated");
  expectFound(with({3, 0}), "repeated");
  expectFound(with({4, 4}), "self");
  expectFound(with({0, 1}), "ignored");
  every.pop_back();
  expectFound(search(every).keepsToTheRules(), "missing");
  expectFound(with({2, 0}), "turned");
  EXPECT_TRUE(search({{0, 3}, {0, 4}, {1, 3}, {1, 4}, {2, 3}, {2, 4}}, false).keepsToTheRules());
  expectFound(search({{0, 3}, {3, 4}}, false).keepsToTheRules(), "unasked");
  expectFound(search({{3, 0}}, false).keepsToTheRules(), "turned");

  auto changed = search(every);
  changed.received[2] = 1;
  EXPECT_THAT(changed.keepsToTheRules().message(), HasSubstr("call 2 was given 1"));
}

// Neighbours that are to be ignored would be judged wrongly, and with them every suite that has
// any.
TYPED_TEST(Judges, KnowNeighborsByNumberAndArcLengthAlongClosedFibersToo) {
  using S = TypeParam;
  // Lengths 1, 2, 1, 3, 2: between 0 and 2 lie 2, between 1 and 3 lies 1, between 4 and 1 lies 1.
  Scene<S> fiber;
  fiber.addFiber({{0, 0, 0}, {1, 0, 0}, {1, 2, 0}, {2, 2, 0}, {2, 5, 0}, {0, 5, 0}}, 0.1);
  const auto ignored = [&](int neighbors, double arc_length, FiberEnds ends) {
    const PairOracle<S> oracle(fiber.objects(),
                               {LeafVolume::kBox, Report::kVolumes, 0, neighbors, arc_length},
                               fiber.fibers(), {}, {ends});
    NumberPairs pairs;
    for (std::size_t i = 0; i < 5; ++i) {
      for (std::size_t j = i + 1; j < 5; ++j) {
        EXPECT_EQ(oracle.ignored(fiber[i], fiber[j]), oracle.ignored(fiber[j], fiber[i]));
        if (oracle.ignored(fiber[i], fiber[j])) pairs.push_back({i, j});
      }
    }
    return pairs;
  };
  const NumberPairs next = {{0, 1}, {1, 2}, {2, 3}, {3, 4}},
                    ring = {{0, 1}, {0, 4}, {1, 2}, {2, 3}, {3, 4}};
  EXPECT_EQ(ignored(0, 0, FiberEnds::kOpen), NumberPairs{});
  EXPECT_EQ(ignored(1, 0, FiberEnds::kOpen), next);
  EXPECT_EQ(ignored(1, 0, FiberEnds::kClosed), ring);
  EXPECT_EQ(ignored(2, 0, FiberEnds::kClosed).size(), 10u);
  EXPECT_EQ(ignored(0, 0.5, FiberEnds::kOpen), next);
  EXPECT_EQ(ignored(0, 0.5, FiberEnds::kClosed), ring);
  EXPECT_EQ(ignored(0, 1.5, FiberEnds::kOpen),
            (NumberPairs{{0, 1}, {1, 2}, {1, 3}, {2, 3}, {3, 4}}));
  EXPECT_EQ(ignored(0, 1.5, FiberEnds::kClosed),
            (NumberPairs{{0, 1}, {0, 4}, {1, 2}, {1, 3}, {1, 4}, {2, 3}, {3, 4}}));
  EXPECT_EQ(ignored(1, 1.5, FiberEnds::kOpen), ignored(0, 1.5, FiberEnds::kOpen));
  EXPECT_EQ(ignored(2, 0.5, FiberEnds::kOpen), ignored(2, 0, FiberEnds::kOpen));
  EXPECT_THROW(ignored(0, 1, FiberEnds::kOpen), std::logic_error) << "rounding decides";
}

// Float managers would be held to less than double ones, as their capsules are as exact as given.
TYPED_TEST(Judges, HoldFloatToThePromiseOfDouble) {
  using S = TypeParam;
  for (const Report report : {Report::kCapsules, Report::kVolumes}) {
    // Apart by an ulp of float, then by more than volumes may be.
    for (const double apart : {std::ldexp(1.0, -22), std::ldexp(1.0, -15)}) {
      Scene<S> scene;
      scene.addSphere({0, 0, 0}, 1);
      scene.addSphere({2 + apart, 0, 0}, 1);
      const PairOracle<S> oracle(scene.objects(), {LeafVolume::kBox, report, 0, 0});
      const bool may = report == Report::kVolumes && apart < 1e-6;
      EXPECT_EQ(oracle.verdict(scene[0], scene[1]), may ? Verdict::kMay : Verdict::kMustNot);
    }
  }
}

// The promise of docs/numerics.md would be another in the tests.
TEST(Promise, IsThatOfTheDocument) {
  constexpr double kExtent = 64, kLength = 16;
  const auto promised = [&](Report report, LeafVolume volume, double apart, double radius = 1) {
    const GivenCapsule p{{0, 0, 0}, {0, kLength, 0}, radius},
        q{{2 * radius + apart, 0, 0}, {2 * radius + apart, 0, 0}, radius};
    return isPromised(p, q, report, volume, 0, kExtent);
  };
  const double sizes = std::ldexp(kExtent + kLength, -52);
  const double volumes = std::ldexp(kExtent, -20);
  for (const auto& [radius, eps] : {std::pair(1.0, 16), {0.0, 256}}) {
    EXPECT_TRUE(promised(Report::kCapsules, LeafVolume::kBox, 0.99 * eps * sizes, radius));
    EXPECT_FALSE(promised(Report::kCapsules, LeafVolume::kBox, 1.01 * eps * sizes, radius));
  }
  EXPECT_TRUE(promised(Report::kVolumes, LeafVolume::kBox, 0.99 * volumes));
  EXPECT_FALSE(promised(Report::kVolumes, LeafVolume::kBox, 1.01 * volumes));
  // The long capsule's sphere reaches 9 from (0, 8, 0), which is apart from the ball's by hypot(8,
  // x) - 10.
  EXPECT_TRUE(promised(Report::kVolumes, LeafVolume::kSphere, 4 + 0.9 * volumes));
  EXPECT_FALSE(promised(Report::kVolumes, LeafVolume::kSphere, 4 + 2.1 * volumes));
}

}  // namespace
}  // namespace fcl_fibers::test
