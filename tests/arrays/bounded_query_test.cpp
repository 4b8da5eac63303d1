// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_tree.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "arrays/array_fibers.h"

namespace fcl_fibers {
namespace {

using test::allKinds;
using test::Assembly;
using test::curledFibers;
using test::Pairs;
using test::pairsOf;
using test::touchingPairs;

/// What a bounded query answers.
struct Answer {
  Pairs pairs;       ///< that were resolved
  Pairs unresolved;  ///< all that the pieces stand for
  Pairs all;         ///< both
  std::size_t pieces = 0, pieces_between = 0;
};

Answer answerOf(const FiberTree& a, const FiberTree& b, const SearchBound& bound) {
  const bool one = &a == &b;
  Answer answer;
  const auto add = [one](Pairs& to, std::int32_t p, std::int32_t q) {
    if (one && p > q) std::swap(p, q);
    to.emplace_back(p, q);
  };
  const auto pair = [&](SegmentPair p) { add(answer.pairs, p.a, p.b); };
  const auto piece = [&](const UnresolvedPair& p) {
    ++answer.pieces;
    if (p.a != p.b) ++answer.pieces_between;
    for (std::size_t i = 0; i < p.a_count; ++i) {
      for (std::size_t j = p.a == p.b ? i + 1 : 0; j < p.b_count; ++j) {
        add(answer.unresolved, p.a[i], p.b[j]);
      }
    }
  };
  if (one) {
    a.visitPairs(bound, pair, piece);
  } else {
    a.visitPairs(b, bound, pair, piece);
  }
  answer.all = answer.pairs;
  answer.all.insert(answer.all.end(), answer.unresolved.begin(), answer.unresolved.end());
  for (Pairs* pairs : {&answer.pairs, &answer.unresolved, &answer.all}) {
    std::sort(pairs->begin(), pairs->end());
  }
  EXPECT_EQ(std::adjacent_find(answer.all.begin(), answer.all.end()), answer.all.end())
      << "a pair came twice";
  return answer;
}

bool isSubset(const Pairs& part, const Pairs& whole) {
  return std::includes(whole.begin(), whole.end(), part.begin(), part.end());
}

std::vector<SearchBound> someBounds() {
  constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();
  return {{0, 0},       {0, 71},     {0, 72},     {0, 500},    {0, 3000},     {0, 20000},
          {0.02, kAll}, {0.1, kAll}, {0.3, kAll}, {1.0, kAll}, {100.0, kAll}, {0.1, 2000}};
}

class BoundedQuery : public ::testing::TestWithParam<Report> {};

// A contact would be lost where the query stops, or reported twice at its edge.
TEST_P(BoundedQuery, HoldsEveryPairOnceResolvedOrNot) {
  const auto first = curledFibers<double>(41), second = curledFibers<double>(42, 20);
  for (FiberTreeOptions options : allKinds(GetParam())) {
    options.margin = 0.003;
    FiberTree a(options), b(options);
    a.build(first.view());
    b.build(second.view());
    for (const FiberTree* other : {&a, &b}) {
      const Pairs touching = other == &a ? touchingPairs(first, first, 0, 0.003)
                                         : touchingPairs(first, second, 0, 0.003);
      ASSERT_GT(touching.size(), 100u);
      const Pairs exact = pairsOf(a, *other);
      for (const SearchBound& bound : someBounds()) {
        SCOPED_TRACE(std::to_string(bound.resolution) + ", " + std::to_string(bound.volume_tests));
        const Answer answer = answerOf(a, *other, bound);
        // Each is what one test has found, except the whole, which none has.
        if (GetParam() == Report::kVolumes && answer.pieces > 1) {
          EXPECT_LE(answer.pairs.size() + answer.pieces_between, bound.volume_tests);
        }
        EXPECT_TRUE(isSubset(answer.pairs, exact));
        EXPECT_TRUE(isSubset(exact, answer.all));
        EXPECT_TRUE(isSubset(touching, answer.all));
      }
    }
  }
}

// The bound would be none, or no answer would ever be whole.
TEST_P(BoundedQuery, IsCoarserTheLessItMayCost) {
  const auto fibers = curledFibers<float>(43);
  for (const FiberTreeOptions& options : allKinds(GetParam())) {
    FiberTree tree(options);
    tree.build(fibers.view());
    const std::size_t all = tree.segmentCount() * (tree.segmentCount() - 1) / 2;

    const Answer none = answerOf(tree, tree, {0, 0});
    EXPECT_EQ(none.pieces, 1u);
    EXPECT_EQ(none.unresolved.size(), all);
    const Answer whole = answerOf(tree, tree, {});
    EXPECT_EQ(whole.pieces, 0u);
    EXPECT_EQ(whole.pairs, pairsOf(tree, tree));

    std::size_t unresolved = all;
    for (const std::size_t tests : {200u, 2000u, 20000u}) {
      const Answer answer = answerOf(tree, tree, {0, tests});
      EXPECT_LT(answer.unresolved.size(), unresolved) << tests;
      unresolved = answer.unresolved.size();
    }
    unresolved = all;
    for (const double resolution : {0.8, 0.4, 0.1}) {
      const Answer answer =
          answerOf(tree, tree, {resolution, std::numeric_limits<std::size_t>::max()});
      EXPECT_LT(answer.unresolved.size(), unresolved) << resolution;
      unresolved = answer.unresolved.size();
    }
  }
}

// Pieces would be larger than what was asked for.
TEST_P(BoundedQuery, LeavesOnlyWhatIsSmallerThanTheResolution) {
  const auto fibers = curledFibers<double>(44);
  constexpr double kResolution = 0.4;
  for (const FiberTreeOptions& options : allKinds(GetParam())) {
    FiberTree tree(options);
    tree.build(fibers.view());
    std::map<std::pair<const std::int32_t*, std::size_t>, double> extent;
    for (int depth = 0; depth < 30; ++depth) {
      for (const TreeVolume& volume : tree.volumes(depth)) {
        extent[{volume.segments, volume.segment_count}] =
            2 * *std::max_element(volume.half, volume.half + 3);
      }
    }
    std::size_t pieces = 0;
    const auto check = [&](const std::int32_t* segments, std::size_t count) {
      if (count == 1) return;  // cannot be opened
      const auto found = extent.find({segments, count});
      ASSERT_NE(found, extent.end());
      // Volumes are given rounded outward.
      EXPECT_LT(found->second, kResolution * (1 + 1e-9));
    };
    tree.visitPairs(
        {kResolution, std::numeric_limits<std::size_t>::max()}, [](SegmentPair) {},
        [&](const UnresolvedPair& piece) {
          ++pieces;
          check(piece.a, piece.a_count);
          check(piece.b, piece.b_count);
        });
    EXPECT_GT(pieces, 10u);
  }
}

// What is ignored elsewhere would come back.
TEST_P(BoundedQuery, ResolvedPairsKeepTheRules) {
  const auto fibers = curledFibers<double>(45);
  std::vector<std::int32_t> groups;
  for (std::size_t f = 0; f < 30; ++f) groups.push_back(static_cast<std::int32_t>(f % 3));
  for (FiberTreeOptions options : allKinds(GetParam())) {
    options.ignored_neighbors = 2;
    FiberTree tree(options);
    FiberArrays<double> arrays = fibers.view();
    arrays.groups = groups.data();
    tree.build(arrays);
    const Pairs exact = pairsOf(tree, tree);
    EXPECT_EQ(answerOf(tree, tree, {}).pairs, exact);
    const Answer answer = answerOf(tree, tree, {0, 3000});
    EXPECT_TRUE(isSubset(answer.pairs, exact));
    EXPECT_TRUE(isSubset(exact, answer.all));
  }
}

// A program could not end it.
TEST_P(BoundedQuery, EndsWhenToldTo) {
  const auto fibers = curledFibers<double>(46);
  for (const FiberTreeOptions& options : allKinds(GetParam())) {
    FiberTree tree(options);
    tree.build(fibers.view());
    int calls = 0;
    const auto pair = [&](SegmentPair) { return ++calls == 3; };
    EXPECT_TRUE(tree.visitPairs(SearchBound{}, pair, [](const UnresolvedPair&) {}));
    EXPECT_EQ(calls, 3);
    const auto piece = [&](const UnresolvedPair&) { return ++calls == 5; };
    EXPECT_TRUE(tree.visitPairs(
        SearchBound{0, 2000}, [](SegmentPair) {}, piece));
    EXPECT_EQ(calls, 5);
    EXPECT_FALSE(tree.visitPairs(
        SearchBound{0, 2000}, [](SegmentPair) {}, [](const UnresolvedPair&) {}));
  }
}

INSTANTIATE_TEST_SUITE_P(Reports, BoundedQuery,
                         ::testing::Values(Report::kVolumes, Report::kCapsules),
                         [](const auto& info) {
                           return info.param == Report::kVolumes ? "Volumes" : "Capsules";
                         });

// Nonsense would be an answer.
TEST(BoundedQueryInput, RefusesAResolutionThatIsNone) {
  const auto fibers = curledFibers<double>(47);
  FiberTree tree;
  tree.build(fibers.view());
  for (const double resolution :
       {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    SearchBound bound;
    bound.resolution = resolution;
    const auto ask = [&] {
      tree.visitPairs(
          bound, [](SegmentPair) { FAIL(); }, [](const UnresolvedPair&) { FAIL(); });
    };
    EXPECT_THAT(ask, ::testing::ThrowsMessage<std::invalid_argument>(
                         ::testing::HasSubstr("resolution is")));
  }
}

TEST(BoundedQueryInput, OfAnEmptyTreeIsEmpty) {
  FiberTree tree;
  EXPECT_FALSE(tree.visitPairs(
      SearchBound{}, [](SegmentPair) { FAIL(); }, [](const UnresolvedPair&) { FAIL(); }));
}

}  // namespace
}  // namespace fcl_fibers
