// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/meshes.h"
#include "arrays/motion.h"
#include "arrays/queries.h"
#include "support/scalars.h"
#include "support/text_of.h"

namespace fcl_fibers::test {
namespace {

template <typename S>
class ImpactsOf : public testing::Test {};
TYPED_TEST_SUITE(ImpactsOf, Scalars, ScalarName);

/// The pairs that touch at one of many sampled times of a step, and the first such time.
/// @param touchingAt  the pairs that touch at a time
template <class F>
std::map<Pair, double> sampledTimes(const F& touchingAt) {
  std::map<Pair, double> times;
  for (int k = 0; k <= kSamples; ++k) {
    const double time = static_cast<double>(k) / kSamples;
    for (const Pair& pair : touchingAt(time)) times.emplace(pair, time);
  }
  return times;
}

/// Expects that each sampled pair was found, and not after its sampled time. Returns how many of
/// them do not touch at the start.
std::size_t expectFound(const std::map<Pair, double>& sampled,
                        const std::map<Pair, Impact>& impacts) {
  std::size_t late = 0;
  for (const auto& [pair, time] : sampled) {
    const auto found = impacts.find(pair);
    if (found == impacts.end()) {
      ADD_FAILURE() << pair.first << ", " << pair.second << " at " << time << " is missing";
      continue;
    }
    EXPECT_LE(found->second.time, time);
    late += time > 0;
  }
  return late;
}

/// Expects that two capsules touch at the time of their impact, at its places.
void expectTouching(const Contact& contact, const Impact& impact, double margin) {
  EXPECT_LE(contact.distance, margin + kTolerance);
  if (impact.time > 0) {
    EXPECT_GE(contact.distance, margin - kTolerance);
  }
  EXPECT_NEAR(contact.s, impact.s, 1e-3);
  EXPECT_NEAR(contact.t, impact.t, 1e-3);
}

/// Whatever touches at one of many sampled times was found, and not after that time. What was found
/// touches at its time.
TYPED_TEST(ImpactsOf, ImpactsAreThoseOfTheWholeStep) {
  using S = TypeParam;
  std::size_t late = 0, all = 0;
  for (const Topology topology : {Topology::kBundle, Topology::kSuperThread}) {
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
      Motion<S> motion = Motion<S>::random(seed, 14, seed % 2 == 0 ? 0.4 : 0.02);
      if (seed > 1) motion.closeAndGroup();
      FiberTreeOptions options = capsules(1, seed % 2 == 0 ? 0 : 0.003);
      options.topology = topology;
      const FiberTree tree = treeOf(motion, options);
      const auto impacts = impactsOf(tree);
      const PairList moving = pairsFrom([&](auto&& visit) { tree.visit(MovingPairs{}, visit); });
      const auto is_left_out = [&](const Pair& pair) { return motion.leavesOut(pair, 1); };
      EXPECT_TRUE(std::none_of(moving.begin(), moving.end(), is_left_out));
      const auto sampled = sampledTimes([&](double time) {
        const Assembly<double> now = motion.at(time);
        PairList pairs = touchingPairs(now, now, 1, options.margin);
        pairs.erase(std::remove_if(pairs.begin(), pairs.end(), is_left_out), pairs.end());
        return pairs;
      });
      late += expectFound(sampled, impacts);
      for (const auto& [pair, impact] : impacts) {
        EXPECT_FALSE(is_left_out(pair)) << pair.first << ", " << pair.second;
        EXPECT_TRUE(std::binary_search(moving.begin(), moving.end(), pair));
        expectTouching(impactContact(motion.start.view(), motion.end.view(), impact), impact,
                       options.margin);
      }
      all += impacts.size();
    }
  }
  EXPECT_GT(late, 500u);
  EXPECT_GT(all, late);
}

/// They are fewer than the pairs of boxes around both positions.
TEST(Impacts, MovingPairsAreFew) {
  const auto motion = Motion<double>::random(7, 30, 0.4);
  FiberTreeOptions options = capsules();
  const FiberTree tree = treeOf(motion, options);
  const PairList moving = pairsFrom([&](auto&& visit) { tree.visit(MovingPairs{}, visit); });
  EXPECT_GT(moving.size(), 100u);
  // A capsule along the diagonal of the box around both positions has that box.
  Assembly<double> swept;
  const auto extent = [&](std::size_t i, std::size_t axis) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const auto* fibers : {&motion.start, &motion.end}) {
      const GivenCapsule c = fibers->capsule(i);
      low = std::min({low, c.a[axis] - c.radius, c.b[axis] - c.radius});
      high = std::max({high, c.a[axis] + c.radius, c.b[axis] + c.radius});
    }
    return std::pair(low, high);
  };
  motion.start.visitCapsules([&](std::size_t, std::size_t i) {
    const auto x = extent(i, 0), y = extent(i, 1), z = extent(i, 2);
    swept.addCapsule({x.first, y.first, z.first}, {x.second, y.second, z.second}, 0);
  });
  options = FiberOptions{Topology::kBundle, Report::kVolumes};
  FiberTree boxes(options);
  boxes.build(swept.view());
  EXPECT_LT(2 * moving.size(), pairsOf(boxes).size());

  // Under kVolumes there are moving pairs but no impacts.
  options.ignored_neighbors = 1;
  const FiberTree volumes = treeOf(motion, options);
  EXPECT_EQ(pairsFrom([&](auto&& visit) { volumes.visit(MovingPairs{}, visit); }), moving);
  EXPECT_THROW(volumes.visit(Impacts{}, [](const Impact&) {}), std::invalid_argument);
  EXPECT_THROW((void)volumes.safeStep(), std::invalid_argument);
}

TEST(Impacts, OtherQueriesAnswerForTheEnd) {
  const auto motion = Motion<double>::random(11, 30, 0.3),
             other = Motion<double>::random(12, 20, 0.3);
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberTreeOptions options = capsules();
    options.report = report;
    const FiberTree moving = treeOf(motion, options), moving_other = treeOf(other, options);
    FiberTree still(options), still_other(options);
    still.build(motion.end.view());
    still_other.build(other.end.view());
    std::vector<TreeQuery> queries = volumeQueries();
    if (report == Report::kCapsules) {
      for (TreeQuery& query : capsuleQueries()) queries.push_back(std::move(query));
    }
    for (const TreeQuery& query : queries) {
      Record found, expected;
      query.ask({moving, moving_other, motion.end.view()}, found);
      query.ask({still, still_other, motion.end.view()}, expected);
      EXPECT_GT(expected.size(), 20u) << query.name;
      EXPECT_TRUE(found.sorted().is(expected.sorted())) << query.name;
    }
    EXPECT_GT(moving.memoryUsage(), still.memoryUsage());
  }
}

TEST(Impacts, FibersThatRestTouchAtTheStart) {
  const auto fibers = curledFibers<double>(3);
  const FiberTree tree = treeOf(Motion<double>{fibers, fibers}, capsules());
  PairList pairs;
  for (const auto& [pair, impact] : impactsOf(tree)) {
    EXPECT_EQ(impact.time, 0);
    pairs.push_back(pair);
  }
  EXPECT_EQ(pairs, pairsOf(tree));
  EXPECT_EQ(tree.safeStep(), 1);
}

/// A bullet 1000 times as far from the wall as it is thick.
TEST(Impacts, FastFibersAreNotMissed) {
  Motion<double> motion;
  motion.start.addFiber({{-1, 0, 0}, {-1, 0.01, 0}}, 0.001);
  motion.start.addFiber({{0, -1, -1}, {0, 1, 1}}, 0.001);
  motion.end = motion.start;
  motion.end.points[0] = motion.end.points[3] = 1;
  const auto impacts = impactsOf(treeOf(motion, capsules()));
  ASSERT_EQ(impacts.size(), 1u);
  EXPECT_NEAR(impacts.begin()->second.time, (1 - 0.002) / 2, 1e-9);
}

/// A frame that suits the end may not suit the start, and both change from step to step.
TEST(Impacts, StepsFollowEachOther) {
  FiberTree tree(capsules());
  auto motion = Motion<double>::random(21, 20, 0.2);
  tree.build(motion.start.view());
  for (int step = 0; step < 12; ++step) {
    tree.update(motion.start.view(), motion.end.view());
    std::map<Pair, double> times, expected;
    for (const auto& [pair, impact] : impactsOf(tree)) times[pair] = impact.time;
    for (const auto& [pair, impact] : impactsOf(treeOf(motion, capsules()))) {
      expected[pair] = impact.time;
    }
    ASSERT_EQ(times.size(), expected.size());
    for (const auto& [pair, time] : expected) {
      ASSERT_EQ(times.count(pair), 1u);
      EXPECT_NEAR(times[pair], time, 1e-8);
    }
    motion.start = motion.end;
    for (std::size_t i = 0; i < motion.end.points.size(); ++i) {
      // At last they are far away and far apart.
      motion.end.points[i] = step < 8 ? motion.end.points[(i + 3) % motion.end.points.size()]
                                      : 1e3 + 50 * motion.end.points[i];
    }
  }
}

TEST(Impacts, FarAwayIsAsNearTheOrigin) {
  auto motion = Motion<double>::random(9, 14, 0.3);
  for (auto* fibers : {&motion.start, &motion.end}) {
    // Then adding 2^20 rounds nothing.
    for (double& x : fibers->points) x = std::round(x * 0x1p30) / 0x1p30;
  }
  const auto near = impactsOf(treeOf(motion, capsules()));
  auto far_motion = motion;
  for (auto* fibers : {&far_motion.start, &far_motion.end}) {
    for (double& x : fibers->points) x += 0x1p20;
  }
  const auto far = impactsOf(treeOf(far_motion, capsules()));
  ASSERT_EQ(near.size(), far.size());
  for (const auto& [pair, impact] : near) {
    EXPECT_NEAR(far.at(pair).time, impact.time, 1e-7);
    const Contact near_contact = impactContact(motion.start.view(), motion.end.view(), impact);
    const Contact far_contact =
        impactContact(far_motion.start.view(), far_motion.end.view(), impact);
    // Coordinates of 2^20 have steps of 2^-32.
    EXPECT_NEAR(far_contact.distance, near_contact.distance, 0x1p-46);
  }
}

// --- Two trees ---

/// Whatever touches at a sampled time was found with the margin of the tree that is asked, even
/// though the trees have frames and margins of their own.
TYPED_TEST(ImpactsOf, TwoTreesMeetDuringTheStep) {
  using S = TypeParam;
  std::size_t late = 0;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const Motion<S> mine = Motion<S>::random(seed, 10, seed % 2 == 0 ? 0.4 : 0.02);
    Motion<S> theirs = Motion<S>::random(seed + 50, 10, 0.3);
    for (auto* fibers : {&theirs.start, &theirs.end}) {
      fibers->addFiber({{40, 0, 0}, {41, 0, 0}}, 0.1);
    }
    FiberTreeOptions options = capsules(1, seed % 2 == 0 ? 0 : 0.003);
    options.threads = seed == 2 ? 2 : 1;
    const FiberTree tree = treeOf(mine, options), other = treeOf(theirs, capsules(1, 0.5));
    std::map<Pair, Impact> impacts;
    tree.visit(Impacts{}, other, [&](const Impact& impact) {
      const Pair pair{impact.pair.a, impact.pair.b};
      EXPECT_TRUE(impacts.emplace(pair, impact).second) << "a pair came twice";
      const Contact contact = impactContact(mine.start.view(), mine.end.view(), theirs.start.view(),
                                            theirs.end.view(), impact);
      expectTouching(contact, impact, options.margin);
      EXPECT_EQ(contact.a.fiber, tree.fiberSegment(pair.first).fiber);
      EXPECT_EQ(contact.b.fiber, other.fiberSegment(pair.second).fiber);
    });
    const auto sampled = sampledTimes([&](double time) {
      return touchingPairs(mine.at(time), theirs.at(time), /*ignored=*/0, options.margin);
    });
    late += expectFound(sampled, impacts);
  }
  EXPECT_GT(late, 200u);
}

/// The margin of the tree that is asked counts, and what leaves the other tree is safe.
TEST(Impacts, TwoTreesHaveASafeStep) {
  Motion<double> resting, falling;
  for (auto* fibers : {&resting.start, &resting.end}) {
    fibers->addFiber({{0, 0, 0}, {1, 0, 0}}, 0.5);
  }
  for (const double x : {0.0, 100.0}) {
    falling.start.addFiber({{x, -1, 10}, {x, 1, 10}}, 0.5);
    falling.end.addFiber({{x, -1, -10}, {x, 1, -10}}, 0.5);
  }
  const FiberTree tree = treeOf(resting, capsules(1, 1)), other = treeOf(falling, capsules());
  EXPECT_NEAR(tree.safeStep(other), (10 - 1 - 1) / 20.0, 1e-9);
  EXPECT_NEAR(other.safeStep(tree), (10 - 1) / 20.0, 1e-9);
  EXPECT_EQ(tree.safeStep(tree), 1);
  EXPECT_EQ(pairsFrom([&](auto&& visit) { tree.visit(MovingPairs{}, other, visit); }),
            (PairList{{0, 0}}));
  EXPECT_EQ(pairsFrom([&](auto&& visit) { other.visit(MovingPairs{}, other, visit); }),
            pairsFrom([&](auto&& visit) { other.visit(MovingPairs{}, visit); }));
  falling.start.points = falling.end.points;
  for (double& x : falling.start.points) x /= 16;  // it touches, and leaves
  EXPECT_EQ(tree.safeStep(treeOf(falling, capsules())), 1);
  FiberTree at_rest(capsules());
  at_rest.build(resting.start.view());
  for (const auto& text : {textOf([&] { (void)tree.safeStep(at_rest); }), textOf([&] {
                             tree.visit(MovingPairs{}, at_rest, [](SegmentPair) {});
                           })}) {
    EXPECT_THAT(text, testing::HasSubstr("the other tree: the fibers rest; call update("));
  }
}

TEST(Impacts, ATreeAgainstItselfIsOneTree) {
  const FiberTree tree = treeOf(Motion<double>::random(3, 14, 0.3), capsules());
  std::map<Pair, double> times;
  tree.visit(Impacts{}, tree, [&](const Impact& impact) {
    times[{impact.pair.a, impact.pair.b}] = impact.time;
  });
  std::map<Pair, double> expected;
  for (const auto& [pair, impact] : impactsOf(tree)) expected[pair] = impact.time;
  EXPECT_EQ(times, expected);
}

TEST(Impacts, RefusesATreeThatDoesNotSuit) {
  const auto motion = Motion<double>::random(1, 5, 0.1);
  const FiberTree tree = treeOf(motion, capsules());
  const auto textWith = [&](const FiberTree& other) {
    return textOf([&] { tree.visit(Impacts{}, other, [](const Impact&) {}); });
  };
  FiberTreeOptions options = capsules();
  FiberTree other(options);
  other.build(motion.end.view());
  EXPECT_THAT(textWith(other), testing::HasSubstr("the other tree: the fibers rest; call update("));
  options.topology = Topology::kSuperThread;
  EXPECT_THAT(textWith(treeOf(motion, options)), testing::HasSubstr("different volumes"));
  options = FiberOptions{Topology::kBundle, Report::kVolumes};
  const FiberTree volumes = treeOf(motion, options);
  EXPECT_THAT(textWith(volumes), testing::HasSubstr("keeps no capsules"));
  EXPECT_THAT(textOf([&] { volumes.visit(Impacts{}, tree, [](const Impact&) {}); }),
              testing::HasSubstr("keeps no capsules"));
}

// --- Steps and what is no step ---

/// A tree that has had a step is as it was before.
TEST(Impacts, AStepLeavesNothingBehind) {
  const auto motion = Motion<double>::random(4, 60, 0.1);
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberTreeOptions options = capsules();
    options.report = report;
    FiberTree stepped(options), still(options);
    for (FiberTree* tree : {&stepped, &still}) {
      tree->build(motion.start.view());
      tree->update(motion.end.view());
    }
    const std::size_t before = stepped.memoryUsage();
    EXPECT_EQ(before, still.memoryUsage());
    stepped.update(motion.start.view(), motion.end.view());
    EXPECT_GT(stepped.memoryUsage(), before);
    stepped.update(motion.end.view());
    EXPECT_EQ(stepped.memoryUsage(), before);
    // With the same volumes a query tests the same nodes and finds the same pairs in their order.
    for (const int depth : {0, 1, 2, 3}) {
      const auto volumes = stepped.volumes(depth), expected = still.volumes(depth);
      ASSERT_EQ(volumes.size(), expected.size());
      for (std::size_t i = 0; i < volumes.size(); ++i) {
        EXPECT_THAT(volumes[i].center, testing::ElementsAreArray(expected[i].center));
        EXPECT_THAT(volumes[i].half, testing::ElementsAreArray(expected[i].half));
      }
    }
    std::vector<SegmentPair> pairs, expected;
    stepped.find(Pairs{}, pairs);
    still.find(Pairs{}, expected);
    ASSERT_EQ(pairs.size(), expected.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      EXPECT_EQ(std::pair(pairs[i].a, pairs[i].b), std::pair(expected[i].a, expected[i].b));
    }
  }
}

TEST(Impacts, RefusalsSayWhatToDo) {
  using testing::HasSubstr;
  auto motion = Motion<double>::random(1, 5, 0.1);
  FiberTree tree(capsules());
  tree.build(motion.end.view());
  const auto ask = [&] { tree.visit(Impacts{}, [](const Impact&) {}); };
  EXPECT_THAT(textOf(ask), HasSubstr("update(start, end)"));
  EXPECT_THAT(textOf([&] { (void)tree.safeStep(); }), HasSubstr("update(start, end)"));
  EXPECT_THAT(textOf([&] { tree.visit(MovingPairs{}, [](SegmentPair) {}); }),
              HasSubstr("update(start, end)"));

  tree.update(motion.start.view(), motion.end.view());
  const auto before = impactsOf(tree).size();
  auto other = motion.start;
  other.addFiber({{0, 0, 0}, {1, 0, 0}}, 0.1);
  EXPECT_THAT(textOf([&] { tree.update(other.view(), motion.end.view()); }),
              HasSubstr("call build() instead"));
  other = motion.start;
  other.points[4] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(textOf([&] { tree.update(other.view(), motion.end.view()); }), HasSubstr("point 1"));
  EXPECT_EQ(impactsOf(tree).size(), before);

  // An update without a start ends the step.
  tree.update(motion.end.view());
  EXPECT_THAT(textOf(ask), HasSubstr("update(start, end)"));

  FiberTreeOptions spheres = capsules();
  spheres.volumes = FiberTreeOptions::Volumes::kWrappedSpheres;
  FiberTree wrapped(spheres);
  wrapped.build(motion.end.view());
  EXPECT_THAT(textOf([&] { wrapped.update(motion.start.view(), motion.end.view()); }),
              HasSubstr("kLayeredBoxes"));

  tree.update(motion.start.view(), motion.end.view());
  const TriangleMesh mesh(ball<double>(0.2, 6, 8).view()), coarse(ball<double>(0.2, 4, 8).view());
  EXPECT_THAT(textOf([&] {
                tree.visit(Impacts{}, MeshStep{mesh, coarse}, [](const MeshImpact&) {});
              }),
              HasSubstr("other triangles"));
  EXPECT_THAT(
      textOf([&] {
        (void)impactContact(motion.start.view(), motion.end.view(), Impact{{0, 1}, 2, 0, 0});
      }),
      HasSubstr("[0, 1]"));
}

}  // namespace
}  // namespace fcl_fibers::test
