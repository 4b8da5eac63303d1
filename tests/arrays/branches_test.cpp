// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/live_pairs.h>

#include "arrays/array_fibers.h"
#include "support/branched_fibers.h"
#include "support/scalars.h"
#include "support/tree_kinds.h"

namespace fcl_fibers {
namespace {

using test::allKinds;
using test::branchedFibers;
using test::BranchOracle;
using test::PairList;
using test::pairsOf;
using test::Random;

/// The fibers as arrays of S, in gaps of which no point may be read.
template <typename S>
class BranchedArrays {
 public:
  explicit BranchedArrays(const FiberPolylines& scene, bool has_gaps = false) {
    std::vector<std::int32_t> moved(scene.points.size());
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      if (has_gaps) addGap(f % 3);
      begin_.push_back(points_.size() / 3);
      for (std::size_t i = scene.point_begin[f]; i < scene.point_begin[f + 1]; ++i) {
        moved[i] = static_cast<std::int32_t>(points_.size() / 3);
        first_of_.push_back(static_cast<std::int32_t>(i));
        for (const double x : scene.points[i]) points_.push_back(static_cast<S>(x));
      }
      end_.push_back(points_.size() / 3);
    }
    begin_.push_back(points_.size() / 3);
    const auto move = [&](std::vector<std::int32_t> at) {
      for (std::int32_t& point : at)
        point = point < 0 ? -1 : moved[static_cast<std::size_t>(point)];
      return at;
    };
    starts_at = move(scene.starts_at);
    ends_at = move(scene.ends_at);
    closed_ = scene.closed;
    radius_ = static_cast<S>(scene.radius);
    if (!has_gaps) end_.clear();
  }

  FiberArrays<S> view() const {
    FiberArrays<S> arrays;
    arrays.points = points_.data();
    arrays.point_count = points_.size() / 3;
    arrays.point_begin = begin_.data();
    arrays.point_end = end_.empty() ? nullptr : end_.data();
    arrays.fiber_count = begin_.size() - 1;
    arrays.radii = &radius_;
    arrays.closed = closed_.data();
    arrays.starts_at = starts_at.data();
    arrays.ends_at = ends_at.data();
    return arrays;
  }
  /// The point of the scene that this one is.
  std::size_t sceneOf(std::int32_t point) const {
    return static_cast<std::size_t>(first_of_[static_cast<std::size_t>(point)]);
  }
  PairList toScene(PairList pairs) const {
    for (auto& [a, b] : pairs) {
      a = first_of_[static_cast<std::size_t>(a)];
      b = first_of_[static_cast<std::size_t>(b)];
    }
    return pairs;
  }

  std::vector<std::int32_t> starts_at, ends_at;

 private:
  void addGap(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) first_of_.push_back(-1);
    points_.insert(points_.end(), 3 * count, std::numeric_limits<S>::quiet_NaN());
  }

  std::vector<S> points_;
  std::vector<std::size_t> begin_, end_;
  std::vector<std::int32_t> first_of_;
  std::vector<std::uint8_t> closed_;
  S radius_;
};

std::vector<std::pair<int, double>> rules() {
  return {{0, 0}, {1, 0}, {2, 0}, {5, 0}, {0, 0.07}, {0, 0.4}, {2, 0.15}, {1, 1e9}};
}

/// The pairs that are no neighbours.
PairList withoutNeighbors(const PairList& pairs, const BranchOracle& oracle) {
  PairList kept;
  for (const auto& [a, b] : pairs) {
    if (!oracle.areNeighbors(static_cast<std::size_t>(a), static_cast<std::size_t>(b))) {
      kept.emplace_back(a, b);
    }
  }
  return kept;
}

template <typename S>
class Branches : public ::testing::Test {};

TYPED_TEST_SUITE(Branches, test::Scalars, test::ScalarName);

// Segments at a branching point would be reported, which always touch, or ones left out that have
// come near from afar.
TYPED_TEST(Branches, NeighborsCountAlongTheTree) {
  std::size_t left_out = 0;
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u, 5u, 6u}) {
    const FiberPolylines scene = branchedFibers(seed);
    for (const auto& [reach, arc] : rules()) {
      const BranchOracle oracle(scene, reach, arc);
      for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
        SCOPED_TRACE(testing::Message() << seed << ", " << reach << ", " << arc);
        FiberTree all(options);
        FiberArrays<double> plain = fiberArrays(scene);
        plain.starts_at = plain.ends_at = nullptr;
        options.ignored_neighbors = 0;
        all = FiberTree(options);
        all.build(plain);
        const PairList touching = pairsOf(all), expected = withoutNeighbors(touching, oracle);
        options.ignored_neighbors = reach;
        options.ignored_arc_length = arc;
        FiberTree tree(options);
        for (const bool has_gaps : {false, true}) {
          const BranchedArrays<TypeParam> arrays(scene, has_gaps);
          tree.build(arrays.view());
          EXPECT_EQ(arrays.toScene(pairsOf(tree)), expected);
          FiberArrays<TypeParam> bare = arrays.view();
          bare.starts_at = bare.ends_at = nullptr;
          tree.update(bare);
          EXPECT_EQ(arrays.toScene(pairsOf(tree)), expected) << "as at the build";
          if (has_gaps) continue;
          tree.build(bare);
          left_out += pairsOf(tree).size() - expected.size();
        }
      }
    }
  }
  EXPECT_GT(left_out, 1000u);
}

// A question would ask another rule than that of Pairs.
TYPED_TEST(Branches, EveryQuestionLeavesOutNeighbors) {
  for (const std::uint64_t seed : {11u, 12u, 13u}) {
    SCOPED_TRACE(seed);
    FiberPolylines scene = branchedFibers(seed), moved = scene;
    Random random(seed);
    // Points that are one move as one.
    for (Point& p : moved.points) p = {p[0] + 0.2 * p[1], p[1] - 0.25 * p[0], 0.5 * p[2]};
    for (Point& p : moved.points) {
      for (double& x : p) x = static_cast<double>(static_cast<float>(x));
    }
    scene.radius = moved.radius = 0.01;
    const BranchOracle oracle(scene, 2, 0);
    FiberTreeOptions options;
    options.ignored_neighbors = 2;
    const BranchedArrays<TypeParam> start(scene), end(moved);
    FiberTree tree(options);
    tree.build(start.view());
    LivePairs live(tree);
    live.update();
    std::vector<SegmentPair> found;
    live.find(found);
    EXPECT_EQ(found.size(), pairsOf(tree).size());
    EXPECT_LT(found.size(), [&] {
      FiberArrays<TypeParam> bare = start.view();
      bare.starts_at = bare.ends_at = nullptr;
      FiberTree plain(options);
      plain.build(bare);
      return pairsOf(plain).size();
    }());

    const FiberArrays<TypeParam> view = start.view();
    const auto isSegment = [&](std::size_t i) {
      for (std::size_t f = 0; f < view.fiber_count; ++f) {
        if (i >= view.point_begin[f] && i + 1 < view.point_begin[f + 1]) return true;
      }
      return false;
    };
    double least = std::numeric_limits<double>::infinity();
    std::vector<double> nearest(view.point_count, least);
    for (std::size_t a = 0; a < view.point_count; ++a) {
      for (std::size_t b = 0; b < view.point_count; ++b) {
        if (a == b || !isSegment(a) || !isSegment(b) || oracle.areNeighbors(a, b)) continue;
        const SegmentPair pair{static_cast<std::int32_t>(a), static_cast<std::int32_t>(b)};
        nearest[a] = std::min(nearest[a], capsuleContact(view, pair).distance);
      }
      least = std::min(least, nearest[a]);
    }
    EXPECT_DOUBLE_EQ(tree.closest(Contacts{view}).distance, least);
    std::size_t asked = 0;
    tree.visit(Nearest{1e9}, [&](SegmentPair pair) {
      EXPECT_NEAR(capsuleContact(view, pair).distance, nearest[static_cast<std::size_t>(pair.a)],
                  1e-12);
      ++asked;
    });
    EXPECT_EQ(asked, static_cast<std::size_t>(
                         std::count_if(nearest.begin(), nearest.end(), [](double distance) {
                           return distance < std::numeric_limits<double>::infinity();
                         })));

    FiberTreeOptions all_options = options;
    all_options.ignored_neighbors = 0;
    FiberTree all(all_options);
    all.build(view);
    all.update(view, end.view());
    tree.update(view, end.view());
    const auto impactsOf = [](const FiberTree& of) {
      PairList pairs;
      of.visit(Impacts{},
               [&](const Impact& impact) { pairs.emplace_back(impact.pair.a, impact.pair.b); });
      std::sort(pairs.begin(), pairs.end());
      return pairs;
    };
    EXPECT_EQ(impactsOf(tree), withoutNeighbors(impactsOf(all), oracle));
    if (impactsOf(tree).empty()) {
      EXPECT_EQ(tree.safeStep(), 1);
    }
    live.update();
    std::vector<SegmentPair> now;
    live.find(now);
    EXPECT_EQ(now.size(), pairsOf(tree).size());
  }
}

// What is no branch would be taken for one, or a mistake in a file be found by nobody.
TYPED_TEST(Branches, WhatIsNoBranchIsRefused) {
  // A trunk, two branches, a fiber of one point, none, and a gap before the last fiber.
  using S = TypeParam;
  const S nan = std::numeric_limits<S>::quiet_NaN();
  const std::vector<S> points = {0,   0,   0,   1, 0, 0, 2, 0, 0,   // 0, 1, 2
                                 1,   0,   0,   1, 1, 0,            // 3, 4
                                 2,   0,   0,   2, 1, 0,            // 5, 6
                                 2,   1,   0,                       // 7
                                 nan, nan, nan, 1, 1, 0, 2, 1, 0};  // 8, 9, 10
  const std::vector<std::size_t> begin = {0, 3, 5, 7, 8, 9, 11}, end = {3, 5, 7, 8, 8, 11};
  const std::vector<std::int32_t> starts = {-1, 1, 2, 6, -1, 4}, ends = {-1, -1, -1, -1, -1, 6};
  const S radius = S(0.1);
  FiberArrays<S> good;
  good.points = points.data();
  good.point_count = 11;
  good.point_begin = begin.data();
  good.point_end = end.data();
  good.fiber_count = 6;
  good.radii = &radius;
  good.starts_at = starts.data();
  good.ends_at = ends.data();
  FiberTree tree;
  tree.build(good);
  EXPECT_EQ(pairsOf(tree), PairList());
  FiberArrays<S> alone = good;
  alone.starts_at = alone.ends_at = nullptr;
  tree.build(alone);
  const PairList before = pairsOf(tree);
  EXPECT_GT(before.size(), 3u);

  const auto expectRefused = [&](auto&& call, const std::string& text) {
    EXPECT_THAT(call, testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(text)));
  };
  const auto expectBad = [&](std::size_t fiber, std::int32_t start, std::int32_t end_at,
                             const std::string& text) {
    std::vector<std::int32_t> bad_starts = starts, bad_ends = ends;
    bad_starts[fiber] = start;
    bad_ends[fiber] = end_at;
    FiberArrays<S> bad = good;
    bad.starts_at = bad_starts.data();
    bad.ends_at = bad_ends.data();
    expectRefused([&] { tree.build(bad); }, "FiberTree::build: " + text);
    expectRefused([&] { tree.update(bad); },
                  "FiberTree::update: starts_at of fiber 1 is " + std::to_string(bad_starts[1]) +
                      ", but was -1 at the last build(); call build() instead");
    EXPECT_EQ(pairsOf(tree), before);
  };
  expectBad(2, 11, -1, "starts_at of fiber 2 is 11; give a point from 0 to 10, or -1 for none");
  expectBad(2, -2, -1, "starts_at of fiber 2 is -2; give a point from 0 to 10, or -1 for none");
  expectBad(2, 2, 2000000000, "ends_at of fiber 2 is 2000000000; give a point from 0 to 10, or -1");
  expectBad(4, 6, -1, "starts_at of fiber 4 is 6, but the fiber has no point; give -1");
  expectBad(4, -1, 6, "ends_at of fiber 4 is 6, but the fiber has no point; give -1");
  expectBad(1, 3, -1, "starts_at of fiber 1 is 3, the same point; give another one, or -1");
  expectBad(1, 1, 4, "ends_at of fiber 1 is 4, the same point; give another one, or -1");
  expectBad(1, 8, -1, "starts_at of fiber 1 is 8, a point of no fiber; give a point of a fiber");
  expectBad(5, 4, 8, "ends_at of fiber 5 is 8, a point of no fiber; give a point of a fiber");
  expectBad(1, 2, -1,
            "starts_at of fiber 1 is 2 at (2, 0, 0), but the fiber starts with point 3 at (1, 0, "
            "0); give both the same coordinates, or -1 for none");
  expectBad(5, 4, 5,
            "ends_at of fiber 5 is 5 at (2, 0, 0), but the fiber ends with point 10 at (2, 1, 0); "
            "give both the same coordinates, or -1 for none");

  // Points that come apart are found at both ends of a step, and without the joints.
  tree.build(good);
  std::vector<S> apart = points;
  apart[3 * 3 + 1] = S(0.1);
  FiberArrays<S> bad = good;
  bad.points = apart.data();
  bad.starts_at = nullptr;
  const std::string text =
      std::is_same_v<S, float> ? "(1, 0.100000001, 0)" : "(1, 0.10000000000000001, 0)";
  const std::string at_point =
      "starts_at of fiber 1 is 1 at (1, 0, 0), but the fiber starts with point 3 at " + text;
  expectRefused([&] { tree.update(bad); }, "FiberTree::update: " + at_point);
  expectRefused([&] { tree.update(bad, good); }, "FiberTree::update: at the start: " + at_point);
  expectRefused([&] { tree.update(good, bad); }, "FiberTree::update: at the end: " + at_point);
  EXPECT_EQ(pairsOf(tree), PairList());
  tree.update(good, good);
}

// Loops would be told by ends alone, and other programs' files not be built.
TYPED_TEST(Branches, FibersMayStartAtEachOtherInACircle) {
  // A lasso that starts inside of itself, and three arcs, each from the end of the one before.
  using S = TypeParam;
  const std::vector<S> points = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 9,  // 0 to 4
                                 5, 0, 0, 6, 1, 0, 6, 0, 0,                    // 5, 6, 7
                                 6, 0, 0, 6, 0, 6, 6, 0, 7,                    // 8, 9, 10
                                 6, 0, 7, 5, 1, 7, 5, 0, 0};                   // 11, 12, 13
  const std::vector<std::size_t> begin = {0, 5, 8, 11, 14};
  const std::vector<std::int32_t> starts = {3, 13, 7, 10};
  const S radius = S(0.1);
  FiberArrays<S> fibers;
  fibers.points = points.data();
  fibers.point_count = points.size() / 3;
  fibers.point_begin = begin.data();
  fibers.fiber_count = 4;
  fibers.radii = &radius;
  FiberTree tree;
  tree.build(fibers);
  EXPECT_EQ(pairsOf(tree), (PairList{{0, 2}, {0, 3}, {5, 12}, {6, 8}, {9, 11}}));
  fibers.starts_at = starts.data();
  tree.build(fibers);
  EXPECT_EQ(pairsOf(tree), PairList());
}

// Nothing of this may cost a scene without branches.
TYPED_TEST(Branches, NothingIsKeptWithoutBranches) {
  FiberPolylines scene = branchedFibers(31);
  const BranchedArrays<TypeParam> with(scene);
  scene.starts_at.assign(scene.fiberCount(), -1);
  scene.ends_at = scene.starts_at;
  const BranchedArrays<TypeParam> without(scene);
  FiberArrays<TypeParam> bare = without.view();
  bare.starts_at = bare.ends_at = nullptr;
  FiberTreeOptions options;
  std::vector<std::size_t> bytes;
  for (const auto& fibers : {bare, without.view(), with.view()}) {
    FiberTree tree(options);
    tree.build(fibers);
    bytes.push_back(tree.memoryUsage());
  }
  EXPECT_EQ(bytes[1], bytes[0]);
  EXPECT_GT(bytes[2], bytes[0]);
}

}  // namespace
}  // namespace fcl_fibers
