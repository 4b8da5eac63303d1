// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/live_pairs.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>

#include "arrays/cones.h"
#include "arrays/live_calls.h"
#include "support/random.h"

namespace fcl_fibers {
namespace {

using test::LiveCalls;
using test::LiveWatch;
using test::MovingFibers;
using test::Random;

/// What random scenes have had.
struct Seen {
  std::size_t pairs = 0, safe_points = 0;
};

/// Random scenes and calls, each compared with a tree that has just been built.
template <typename S>
void runScene(std::uint64_t seed, Seen& seen) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  Random random(seed);
  LiveCalls<S> calls(random);
  for (int step = 0; step < 12; ++step) {
    SCOPED_TRACE("step " + std::to_string(step));
    calls.step(random);
    if (::testing::Test::HasFailure()) return;
  }
  seen.pairs += calls.pairsSeen();
  seen.safe_points += calls.safePoints();
}

// A pair would be missed where fibers move, grow, jump or change their tree, or get a wrong slot.
// What is told would depend on the threads, or a step within the safe distances would let fibers
// touch.
TEST(LivePairs, AreThoseOfAFreshTree) {
  Seen seen;
  for (std::uint64_t seed = 1; seed <= test::sceneCount(150); ++seed) {
    seed % 3 == 0 ? runScene<float>(seed, seen) : runScene<double>(seed, seen);
    if (HasFailure()) return;
  }
  EXPECT_GT(seen.pairs, 500 * test::sceneCount(150));
  EXPECT_GT(seen.safe_points, 20 * test::sceneCount(150));
}

test::PairList pairsOf(const LivePairs<FiberTree>& live) {
  std::vector<SegmentPair> pairs;
  live.find(pairs);
  return test::sorted(pairs);
}

/// A few hundred fibers of one radius in a box, most of which touch some others.
MovingFibers<double> bundle(std::uint64_t seed, int fibers = 300, int points = 9) {
  Random random(seed);
  MovingFibers<double> bundle;
  for (int f = 0; f < fibers; ++f) {
    Eigen::Vector3d p = random.inCube(1);
    for (int i = 0; i < points; ++i) {
      bundle.addPoint(p);
      p += Eigen::Vector3d(0.1, 0, 0) + random.inCube(0.01);
    }
    bundle.endFiber();
  }
  bundle.radii = {0.02};
  return bundle;
}

// Each step would search the whole scene again, which the pairs alone do not show.
TEST(LivePairs, AreListedSeldomWhileNeighboursMoveTogether) {
  MovingFibers<double> fibers = bundle(1);
  FiberTree tree;
  tree.build(fibers.view());
  LivePairs live(tree);
  LiveWatch<FiberTree> watch;
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, 3).normalized();
  for (int step = 0; step < 60; ++step) {
    // A turn by which the ends move fifty radii in all.
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.01, axis).toRotationMatrix();
    for (auto& p : fibers.points) p = turn * p + Eigen::Vector3d(0.01, 0, 0);
    tree.update(fibers.view());
    live.update();
    watch.check(live, tree);
  }
  EXPECT_GT(live.count(), 100u);
  EXPECT_EQ(live.counters().updates, 60);
  EXPECT_LE(live.counters().listings, 5) << "the list is to move with the scene";
}

// One fiber that whips would cost a search of all others in each step.
TEST(LivePairs, AreTestedOneByOneWhereOneFiberWhips) {
  MovingFibers<double> fibers = bundle(2, 1500);
  FiberTree tree;
  tree.build(fibers.view());
  LivePairs live(tree, {0.04});
  LiveWatch<FiberTree> watch;
  Random random(3);
  for (int step = 0; step < 20; ++step) {
    for (std::size_t i = 0; i < 9; ++i) fibers.points[i] += random.inCube(0.1);
    tree.update(fibers.view());
    live.update();
    watch.check(live, tree);
  }
  EXPECT_LE(live.counters().listings, 8);
  EXPECT_GT(live.counters().uncovered_pairs, 50);
}

// A whole frame of hair would be listed with a skin, in vain.
TEST(LivePairs, MakeNoListsWhereAllFlies) {
  MovingFibers<double> fibers = bundle(4, 100);
  FiberTree tree;
  tree.build(fibers.view());
  LivePairs live(tree);
  LiveWatch<FiberTree> watch;
  Random random(5);
  for (int step = 0; step < 40; ++step) {
    for (auto& p : fibers.points) p += random.inCube(0.1);
    tree.update(fibers.view());
    live.update();
    watch.check(live, tree);
    EXPECT_EQ(live.skin(), 0);
  }
}

// A storm would be paid for with a wide list that does not outlast it, and a calm after it would be
// searched for long.
TEST(LivePairs, EndTheirListInAStormAndListAgainInTheCalm) {
  MovingFibers<double> fibers = bundle(8);
  FiberTree tree;
  tree.build(fibers.view());
  LivePairs live(tree);
  LiveWatch<FiberTree> watch;
  Random random(9);
  const std::vector<Eigen::Vector3d> middle = fibers.points;
  const auto step = [&](double motion) {
    for (auto& p : fibers.points) p += random.inCube(motion);
    tree.update(fibers.view());
    live.update();
    watch.check(live, tree);
  };
  for (int spell = 0; spell < 3; ++spell) {
    int without = 0;
    for (int i = 0; i < 20; ++i) {
      step(0.0005);
      without += live.skin() == 0 ? 1 : 0;
    }
    EXPECT_LE(without, spell == 0 ? 2 : 12);
    for (int i = 0; i < 12; ++i) {
      step(0.06);
      EXPECT_EQ(live.skin(), 0) << "no list outlasts a step of a storm";
    }
    fibers.points = middle;
  }
}

// The same calls would list at other times, or hand pairs out in another order.
TEST(LivePairs, DoNotDependOnThreads) {
  std::vector<std::vector<LivePair<SegmentPair>>> expected;
  for (const int threads : {1, 2, 3, 8}) {
    MovingFibers<double> fibers = bundle(6);
    FiberTreeOptions options;
    options.threads = threads;
    FiberTree tree(options);
    tree.build(fibers.view());
    LivePairs live(tree);
    Random random(7);
    for (std::size_t step = 0; step < 25; ++step) {
      for (auto& p : fibers.points) p += random.inCube(0.001);
      for (std::size_t i = 0; i < 9; ++i) fibers.points[i] += random.inCube(0.05);
      tree.update(fibers.view());
      live.update();
      std::vector<LivePair<SegmentPair>> pairs;
      live.find(pairs);
      if (threads == 1) expected.push_back(pairs);
      ASSERT_EQ(pairs.size(), expected[step].size());
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        ASSERT_EQ(pairs[i].pair.a, expected[step][i].pair.a);
        ASSERT_EQ(pairs[i].pair.b, expected[step][i].pair.b);
        ASSERT_EQ(pairs[i].slot, expected[step][i].slot);
      }
    }
  }
}

// The pairs of a build that has given their names to others would live on.
TEST(LivePairs, EndWithABuildAndOutlastOtherTrees) {
  MovingFibers<double> fibers = bundle(8);
  FiberTree tree;
  tree.build(fibers.view());
  LivePairs live(tree);
  live.update();
  const std::size_t count = live.count();
  ASSERT_GT(count, 100u);
  EXPECT_EQ(live.begun().size(), count);
  // Fibers that have changed places make the tree loose, so that an update builds it again.
  for (std::size_t f = 0; f + 1 < fibers.fiberCount(); f += 2) fibers.swapFibers(f, f + 1);
  LiveWatch<FiberTree> watch;
  watch.check(live, tree);
  for (int step = 0; step < 3; ++step) {
    tree.update(fibers.view());
    live.update();
    watch.check(live, tree);
  }
  tree.build(fibers.view());
  live.update();
  watch.checkAfterBuild(live, tree);
}

// The names of a tree that was assigned would be taken for those of the one before.
TEST(LivePairs, EndIfTheTreeIsAnotherOne) {
  MovingFibers<double> fibers = bundle(13);
  FiberTree tree;
  tree.build(fibers.view());
  LivePairs live(tree);
  LiveWatch<FiberTree> watch;
  for (int i = 0; i < 3; ++i) {
    live.update();
    watch.check(live, tree);
    tree.update(fibers.view());
  }
  for (std::size_t f = 0; f + 1 < fibers.fiberCount(); f += 2) fibers.swapFibers(f, f + 1);
  FiberTree other;
  other.build(fibers.view());
  tree = std::move(other);
  live.update();
  watch.checkAfterBuild(live, tree);
}

// One stray fiber would make the list of all others blind: so far out, anchors are rounded by more
// than the skin.
TEST(LivePairs, OutlastAFiberFarOut) {
  for (const double far : {1e6, 1e9, 1e30}) {
    MovingFibers<double> fibers = bundle(14);
    for (std::size_t i = 0; i < 9; ++i) fibers.points[i].x() += far;
    FiberTree tree;
    tree.build(fibers.view());
    LivePairs live(tree, {0.01});
    LiveWatch<FiberTree> watch;
    Random random(15);
    for (int step = 0; step < 8; ++step) {
      for (std::size_t i = 9; i < fibers.points.size(); ++i) {
        fibers.points[i] += random.inCube(step == 4 ? 0.02 : 0.002);
      }
      tree.update(fibers.view());
      live.update();
      watch.check(live, tree);
    }
    EXPECT_GT(live.count(), 100u);
  }
}

// A failed update would lose pairs, or hand out changes twice.
TEST(LivePairs, StayAsTheyWereIfTheTreeCannotBeRead) {
  MovingFibers<double> fibers = bundle(9);
  FiberTree tree;
  tree.build(fibers.view());
  LivePairs live(tree, {0.01});
  live.update();
  LiveWatch<FiberTree> watch;
  watch.check(live, tree);
  const double x = fibers.points[7].x();
  fibers.points[7].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(tree.update(fibers.view()), std::invalid_argument);
  fibers.points[7].x() = x;
  std::vector<double> distances;
  EXPECT_NO_THROW(live.safeDistances(distances)) << "the tree is as it was";
  live.update();
  EXPECT_TRUE(live.begun().empty());
  EXPECT_TRUE(live.ended().empty());
  watch.check(live, tree);
}

// Programs would wait for a query that never ends, or read what changes.
TEST(LivePairs, RefuseWhileAQueryRuns) {
  MovingFibers<double> fibers = bundle(10);
  FiberTree tree;
  tree.build(fibers.view());
  LivePairs live(tree);
  live.update();
  EXPECT_THROW(tree.visit(Pairs{}, [&](SegmentPair) { live.update(); }), std::invalid_argument);
  live.update();
  // The partner is only read.
  FiberTree other;
  other.build(fibers.view());
  LivePairs<FiberTree> both(tree, other);
  other.visit(Pairs{}, [&](SegmentPair) {
    both.update();
    return true;
  });
  EXPECT_GT(both.count(), live.count());
}

/// Gives radii of one of two kinds that take turns, mostly at each point.
void giveRadii(Random& random, MovingFibers<double>& fibers) {
  using Radii = FiberArrays<double>::Radii;
  const bool are_cones = random.below(3) != 0;
  fibers.radii_are = are_cones ? Radii::kPerPoint : Radii::kPerFirstPoint;
  fibers.radii.clear();
  for (std::size_t i = 0; i < fibers.points.size(); ++i) {
    fibers.radii.push_back(random.between(0, 0.03));
  }
}

// A cone would be missed that grows at one end while the other one, or the larger one, stays.
TEST(LivePairs, OfConesAreThoseThatTouch) {
  std::size_t pairs_seen = 0;
  std::int64_t updates = 0, listings = 0, uncovered_pairs = 0;
  for (std::uint64_t seed = 1; seed <= test::sceneCount(12); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    MovingFibers<double> fibers = bundle(seed, 25, 5), others = bundle(seed + 1000, 10, 5);
    for (auto* all : {&fibers, &others}) {
      for (auto& p : all->points) p *= 0.3;
    }
    FiberTreeOptions options;
    options.margin = seed % 3 == 0 ? 0.01 : 0;
    FiberTree tree(options), other(options);
    giveRadii(random, fibers);
    giveRadii(random, others);
    tree.build(fibers.view());
    other.build(others.view());
    const LivePairsOptions skin{seed % 4 == 0 ? -1 : random.between(0.01, 0.05)};
    LivePairs own(tree, skin);
    LivePairs<FiberTree> both(tree, other, skin), turned(other, tree, skin);
    for (int step = 0; step < 16; ++step) {
      MovingFibers<double>& changed = random.below(3) == 0 ? others : fibers;
      const auto anyOf = [&](auto& all) -> auto& { return all[random.below(all.size())]; };
      switch (random.below(12)) {
        case 0:
          giveRadii(random, changed);
          break;
        case 1:
          changed.radii_are = FiberArrays<double>::Radii::kOne;
          break;
        case 2:  // back again, or the other way round
          changed.radii_are = FiberArrays<double>::Radii::kPerPoint;
          changed.radii.resize(changed.points.size(), 0.01);
          break;
        case 3:
          anyOf(changed.points) += random.inCube(0.1);
          break;
        case 4:
        case 5:
          for (double& radius : changed.radii) radius += random.between(0, 0.003);
          break;
        default:
          for (int i = 0; i < 10; ++i) anyOf(changed.radii) += random.between(0, 0.02);
          for (int i = 0; i < 10; ++i) anyOf(changed.radii) = 0;
      }
      for (auto& p : changed.points) p += random.inCube(0.001);
      tree.update(fibers.view());
      other.update(others.view());
      own.update();
      both.update();
      turned.update();
      const test::PairList found = pairsOf(own);
      EXPECT_EQ(found, test::touchingCones(fibers.view(), 1, options.margin));
      const test::PairList of_both =
          test::touchingCones(fibers.view(), others.view(), options.margin);
      EXPECT_EQ(pairsOf(both), of_both);
      test::PairList swapped = pairsOf(turned);
      for (auto& [a, b] : swapped) std::swap(a, b);
      std::sort(swapped.begin(), swapped.end());
      EXPECT_EQ(swapped, of_both);
      if (HasFailure()) return;
      pairs_seen += found.size() + of_both.size();
    }
    for (const auto* live : {&own, &both, &turned}) {
      updates += live->counters().updates;
      listings += live->counters().listings;
      uncovered_pairs += live->counters().uncovered_pairs;
    }
  }
  EXPECT_GT(pairs_seen, 200 * test::sceneCount(12));
  EXPECT_LT(2 * listings, updates);
  EXPECT_GT(uncovered_pairs, 0);
}

// An end at which no other segment begins would grow unseen.
TEST(LivePairs, OfConesSeeTheLastEndOfAFiberGrow) {
  MovingFibers<double> fibers;
  for (int f = 0; f < 40; ++f) {
    for (const double x : {0.0, 1.0}) {
      fibers.addPoint({x, 1.0 * f, 0});
      fibers.radii.push_back(0.3 - 0.2 * x);
    }
    fibers.endFiber();
  }
  fibers.radii_are = FiberArrays<double>::Radii::kPerPoint;
  FiberTree tree;
  tree.build(fibers.view());
  LivePairs live(tree, {0.1});
  live.update();
  EXPECT_EQ(live.count(), 0u);
  for (const std::size_t f : {3u, 17u, 30u}) fibers.radii[2 * f + 1] = 0.95;
  tree.update(fibers.view());
  live.update();
  EXPECT_EQ(live.count(), 6u) << "those beside the three";
  EXPECT_EQ(live.counters().listings, 1) << "the list is to tell";
}

// The wrong kind of tree would answer otherwise than its own queries.
TEST(LivePairs, RefuseTreesByName) {
  FiberTreeOptions spheres;
  spheres.volumes = FiberTreeOptions::Volumes::kWrappedSpheres;
  FiberTree sphere_tree(spheres), volume_tree(FiberOptions{Topology::kBundle, Report::kVolumes, 1});
  FiberTree tree;
  const auto textOf = [](auto&& call) -> std::string {
    try {
      call();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(textOf([&] { LivePairs{sphere_tree}; }), ::testing::HasSubstr("wrapped spheres"));
  EXPECT_THAT(textOf([&] { LivePairs{volume_tree}; }), ::testing::HasSubstr("kCapsules"));
  EXPECT_THAT(textOf([&] { LivePairs<FiberTree>(tree, sphere_tree); }),
              ::testing::HasSubstr("wrapped spheres"));
  EXPECT_THAT(textOf([&] { LivePairs(tree, {std::numeric_limits<double>::infinity()}); }),
              ::testing::HasSubstr("skin"));
  LivePairs live(tree);  // without fibers
  live.update();
  EXPECT_EQ(live.count(), 0u);
  EXPECT_EQ(live.slotCount(), 0);
}

// A query between two updates would be answered by volumes of another time.
TEST(LivePairs, LeaveTheRefitToTheQueryThatNeedsIt) {
  MovingFibers<double> fibers = bundle(11);
  FiberTree tree;
  tree.build(fibers.view());
  LivePairs live(tree);
  Random random(12);
  for (int step = 0; step < 10; ++step) {
    for (auto& p : fibers.points) p += random.inCube(0.003);
    tree.update(fibers.view());
    FiberTree fresh;
    fresh.build(fibers.view());
    std::vector<SegmentPair> nearest, expected;
    if (step % 2 == 0) {
      tree.find(Nearest{0.02}, nearest);
      fresh.find(Nearest{0.02}, expected);
      EXPECT_EQ(nearest.size(), expected.size());
      EXPECT_EQ(test::pairsOf(tree), test::pairsOf(fresh));
    }
    live.update();
    std::vector<SegmentPair> pairs;
    live.find(pairs);
    EXPECT_EQ(test::sorted(pairs), test::pairsOf(fresh));
    EXPECT_EQ(test::pairsOf(tree), test::pairsOf(fresh));
  }
}

/// Moves each point by at most its distance, mostly by all of it.
void moveBy(Random& random, const std::vector<double>& distances, MovingFibers<double>& fibers) {
  const Eigen::Vector3d common = random.direction();
  const std::size_t way = random.below(3);
  for (std::size_t i = 0; i < fibers.points.size(); ++i) {
    const double most = std::isfinite(distances[i]) ? distances[i] : 1;
    // The product rounds by less than this.
    const double length = most * (way == 0 ? random.unit() : 1) * (1 - 0x1p-50);
    fibers.points[i] += length * (way == 2 && random.below(2) == 0 ? common : random.direction());
  }
}

// A solver that cuts its steps to these distances would let fibers through each other.
TEST(LivePairs, SafeDistancesLeaveApartWhatIsApart) {
  std::size_t moved = 0;
  for (std::uint64_t seed = 1; seed <= test::sceneCount(60); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    MovingFibers<double> fibers = bundle(seed, 20 + static_cast<int>(random.below(100)));
    MovingFibers<double> others = bundle(seed + 1000, 40);
    if (seed % 3 == 0) {
      fibers.radii_are = FiberArrays<double>::Radii::kPerFiber;
      fibers.radii.clear();
      for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
        fibers.radii.push_back(random.between(0, 0.03));
      }
    } else if (seed % 3 == 1) {
      giveRadii(random, fibers);
      giveRadii(random, others);
    }
    FiberTreeOptions options;
    if (seed % 4 == 0) options.margin = 0.01;
    FiberTree tree(options), other(options);
    tree.build(fibers.view());
    other.build(others.view());
    const LivePairsOptions skin{random.between(0.005, 0.2)};
    LivePairs own(tree, skin);
    LivePairs<FiberTree> both(tree, other, skin);
    for (int step = 0; step < 8; ++step) {
      // Without being asked, a list serves until less than half of the skin is left.
      for (std::size_t unasked = random.below(4); unasked > 0; --unasked) {
        own.update();
        both.update();
        for (auto& p : fibers.points) p += random.inCube(0.3 * skin.skin);
        tree.update(fibers.view());
      }
      own.update();
      both.update();
      const test::PairList own_before = test::pairsOf(tree);
      const test::PairList both_before = test::pairsOf(tree, other);
      const bool skips = step % 2 == 0;
      std::vector<double> distances, with_other, of_other;
      own.safeDistances(distances, skips);
      both.safeDistances(with_other, of_other, skips);
      for (std::size_t i = 0; i < distances.size(); ++i) {
        ASSERT_GE(std::min(distances[i], with_other[i]), 0);
        distances[i] = std::min(distances[i], with_other[i]);
        moved += distances[i] > 0 ? 1 : 0;
      }
      if (!skips) {
        for (const auto& [a, b] : own_before) {
          for (const std::int32_t i : {a, a + 1, b, b + 1}) {
            EXPECT_EQ(distances[static_cast<std::size_t>(i)], 0);
          }
        }
      }
      moveBy(random, distances, fibers);
      moveBy(random, of_other, others);
      tree.update(fibers.view());
      other.update(others.view());
      const auto expectNoneNew = [](const test::PairList& now, const test::PairList& before) {
        test::PairList begun;
        std::set_difference(now.begin(), now.end(), before.begin(), before.end(),
                            std::back_inserter(begun));
        EXPECT_THAT(begun, ::testing::IsEmpty());
      };
      expectNoneNew(test::pairsOf(tree), own_before);
      expectNoneNew(test::pairsOf(tree, other), both_before);
      if (HasFailure()) return;
    }
  }
  EXPECT_GT(moved, 10000u);
}

// Solvers would stand still: the distances of two fibers that are alone add up to their gap.
TEST(LivePairs, SafeDistancesUseTheGap) {
  MovingFibers<double> fibers;
  for (const double y : {0.0, 0.25}) {
    for (const double x : {0.0, 1.0}) fibers.addPoint({x, y, 0.1 * x});
    fibers.endFiber();
  }
  fibers.radii = {0.1};
  FiberTree tree;
  tree.build(fibers.view());
  for (const double skin : {0.02, 0.5}) {
    LivePairs live(tree, {skin});
    live.update();
    std::vector<double> distances;
    live.safeDistances(distances);
    const double possible = std::min(0.05, skin);
    for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
      EXPECT_GT(distances[i] + distances[i + 2], 0.9 * possible) << skin;
      EXPECT_LE(distances[i] + distances[i + 2], possible * (1 + 1e-12)) << skin;
    }
  }
  LivePairs without(tree, {0});
  without.update();
  std::vector<double> distances;
  EXPECT_THROW(without.safeDistances(distances), std::invalid_argument);
  LivePairs live(tree, {0.1});
  live.update();
  tree.update(fibers.view());
  EXPECT_THROW(live.safeDistances(distances), std::invalid_argument);
}

// Fibers that have come near since they were listed would go through each other.
TEST(LivePairs, SafeDistancesCountWhatIsNotListed) {
  MovingFibers<double> fibers;
  for (const double y : {0.0, 0.62, 5.0, 6.0, 7.0}) {
    for (const double x : {0.0, 1.0}) fibers.addPoint({x, y, 0});
    fibers.endFiber();
  }
  fibers.radii = {0.1};
  FiberTree tree;
  tree.build(fibers.view());
  LivePairs live(tree, {0.4});
  live.update();
  fibers.points[2].y() = fibers.points[3].y() = 0.32;
  tree.update(fibers.view());
  live.update();
  EXPECT_EQ(live.counters().listings, 1);
  std::vector<double> distances;
  live.safeDistances(distances);
  EXPECT_GT(distances[0] + distances[2], 0.09);
  EXPECT_LE(distances[0] + distances[2], 0.12);
  // Now it touches, and was not listed with all others.
  fibers.points[2].y() = fibers.points[3].y() = 0.19;
  tree.update(fibers.view());
  live.update();
  EXPECT_EQ(live.counters().listings, 1);
  EXPECT_EQ(live.count(), 1u);
  live.safeDistances(distances);
  EXPECT_EQ(distances[0], 0);
  live.safeDistances(distances, /*skips_touching=*/true);
  EXPECT_GT(distances[0], 0.05) << "a program that parts them itself would not get them apart";
}

// A solver whose steps are cut to these distances would come to rest in the middle of nowhere.
TEST(LivePairs, SafeDistancesLetFibersArrive) {
  // They slide along each other, further apart than the skin. Their boxes overlap.
  MovingFibers<double> fibers;
  for (const double y : {0.0, 0.5, 1.0}) {
    for (const double x : {0.0, 1.0}) fibers.addPoint({x, x + y, x});
    fibers.endFiber();
  }
  fibers.radii = {0.1};
  FiberTree tree;
  tree.build(fibers.view());
  LivePairs live(tree, {0.1});
  std::vector<double> distances;
  double left = 1;
  for (int step = 0; step < 100 && left > 0; ++step) {
    live.update();
    live.safeDistances(distances);
    const double length = std::min(left, 0.99 * std::min(distances[0], distances[1]));
    for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
      fibers.points[i] += length * Eigen::Vector3d(1, 1, 1).normalized();
    }
    left -= length;
    tree.update(fibers.view());
  }
  EXPECT_EQ(left, 0);
}

}  // namespace
}  // namespace fcl_fibers
