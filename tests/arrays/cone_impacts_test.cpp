// SPDX-License-Identifier: BSD-3-Clause
// Fibers whose radii are given at points, during a step.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>

#include "arrays/motion.h"
#include "geometry/segment.h"
#include "support/cone_oracle.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

using Radii = FiberArrays<double>::Radii;

template <typename S>
class ConesInMotion : public testing::Test {};
TYPED_TEST_SUITE(ConesInMotion, Scalars, ScalarName);

/// Fibers in motion with another radius at each point, also from the start to the end.
template <typename S>
Motion<S> taperedMotion(std::uint64_t seed, int fibers, double away, double thickness = 1) {
  Motion<S> motion = Motion<S>::random(seed, fibers, away);
  Random random(seed + 2000);
  for (auto* assembly : {&motion.start, &motion.end}) {
    assembly->radii_are = FiberArrays<S>::Radii::kPerPoint;
    for (S& radius : assembly->radii) {
      radius *= static_cast<S>(thickness * (random.below(8) == 0 ? 0 : random.between(0.5, 2)));
    }
  }
  return motion;
}

geometry::Segment coneOf(const Assembly<double>& fibers, std::int32_t first) {
  const auto i = static_cast<std::size_t>(first);
  const auto point = [&](std::size_t k) {
    return geometry::Vec3d{fibers.points[3 * k], fibers.points[3 * k + 1],
                           fibers.points[3 * k + 2]};
  };
  const bool tapers = fibers.radii_are == Radii::kPerPoint;
  return geometry::Segment::cone(point(i), point(i + 1), fibers.radii[i],
                                 fibers.radii[tapers ? i + 1 : i]);
}
/// Far pairs are told apart by the balls around them.
double gapOf(const geometry::Segment& p, const geometry::Segment& q) {
  const double around = geometry::norm(geometry::midpoint(p) - geometry::midpoint(q)) -
                        0.5 * geometry::norm(p.b - p.a) - 0.5 * geometry::norm(q.b - q.a) -
                        p.radius - q.radius;
  return around > 0.01 ? around : static_cast<double>(coneDistance(p, q));
}
/// With what the array's own scalar left of the numbers of both.
template <typename S>
Assembly<double> at(const Motion<S>& motion, double time) {
  Assembly<double> now = motion.at(time);
  now.radii_are = Radii::kPerPoint;
  return now;
}

// A radius of another point, or that at the start for that at the end, would make impacts late,
// early or missed.
TYPED_TEST(ConesInMotion, ImpactsAreThoseOfTheWholeStep) {
  using S = TypeParam;
  std::size_t late = 0;
  for (const double margin : {0.0, 0.003}) {
    const Motion<S> motion = taperedMotion<S>(margin == 0 ? 1 : 2, 8, 0.3);
    const FiberTree tree = treeOf(motion, capsules(1, margin));
    const auto impacts = impactsOf(tree);
    const PairList moving = pairsFrom([&](auto&& visit) { tree.visit(MovingPairs{}, visit); });
    for (const auto& [pair, impact] : impacts) {
      const Assembly<double> now = at(motion, impact.time);
      const double gap = gapOf(coneOf(now, pair.first), coneOf(now, pair.second)) - margin;
      EXPECT_LE(gap, kTolerance);
      EXPECT_TRUE(impact.time == 0 || gap > -1e-12) << gap;
      EXPECT_TRUE(std::binary_search(moving.begin(), moving.end(), pair));
      const Contact contact = impactContact(motion.start.view(), motion.end.view(), impact);
      EXPECT_NEAR(contact.distance - margin, gap, 1e-12);
      late += impact.time > 0;
    }
    constexpr int kTimes = 6;
    for (int k = 0; k <= kTimes; ++k) {
      const double time = double(k) / kTimes;
      const Assembly<double> now = at(motion, time);
      now.visitCapsules([&](std::size_t, std::size_t i) {
        now.visitCapsules([&](std::size_t, std::size_t j) {
          const Pair pair(static_cast<std::int32_t>(i), static_cast<std::int32_t>(j));
          if (j <= i || motion.leavesOut(pair, 1)) return;
          if (gapOf(coneOf(now, pair.first), coneOf(now, pair.second)) > margin - 1e-12) return;
          const auto found = impacts.find(pair);
          ASSERT_TRUE(found != impacts.end() && found->second.time <= time)
              << i << ", " << j << " at " << time;
        });
      });
    }
  }
  EXPECT_GT(late, 100u);
}

// A tree that keeps each segment by itself, or in another frame, would lose the radii.
TYPED_TEST(ConesInMotion, ImpactsWithAnotherTreeAreTheSame) {
  using S = TypeParam;
  const Motion<S> motion = taperedMotion<S>(3, 8, 0.3);
  // Both halves of the fibers, each with all points.
  const std::size_t half = motion.start.fiberCount() / 2;
  const auto part = [&](bool first) {
    Motion<S> some = motion;
    for (auto* assembly : {&some.start, &some.end}) {
      auto& begin = assembly->point_begin;
      // The others' points become fibers of one point.
      std::vector<std::size_t> parts = {0};
      for (std::size_t f = 0; f + 1 < begin.size(); ++f) {
        const bool stays = (f < half) == first;
        if (stays && begin[f + 1] > begin[f]) parts.push_back(begin[f + 1]);
        for (std::size_t i = begin[f]; !stays && i < begin[f + 1]; ++i) parts.push_back(i + 1);
      }
      begin = parts;
    }
    return some;
  };
  const auto expected = impactsOf(treeOf(motion, capsules()));
  const FiberTree a = treeOf(part(true), capsules()), b = treeOf(part(false), capsules());
  std::map<Pair, double> found;
  a.visit(Impacts{}, b, [&](const Impact& impact) {
    found.emplace(Pair{impact.pair.a, impact.pair.b}, impact.time);
  });
  std::size_t count = 0;
  for (const auto& [pair, impact] : expected) {
    const auto f = motion.start.fiberOf(static_cast<std::size_t>(pair.first));
    const auto g = motion.start.fiberOf(static_cast<std::size_t>(pair.second));
    if ((f < half) == (g < half)) continue;
    ++count;
    ASSERT_EQ(found.count(pair), 1u);
    EXPECT_NEAR(found[pair], impact.time, 1e-7);
  }
  EXPECT_EQ(found.size(), count);
  EXPECT_GT(count, 50u);
}

// A step would end at the impact of larger radii, or not at all.
TYPED_TEST(ConesInMotion, TheSafeStepEndsAtTheFirstImpact) {
  using S = TypeParam;
  int with_impacts = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Motion<S> motion = taperedMotion<S>(seed, 12, 0.05, 0.02);
    const FiberTree tree = treeOf(motion, capsules());
    double first = 1;
    for (const auto& [pair, impact] : impactsOf(tree)) first = std::min(first, impact.time);
    if (first == 0) continue;
    with_impacts += first < 1;
    EXPECT_NEAR(tree.safeStep(), first, 1e-8);
  }
  EXPECT_GT(with_impacts, 5);
}

// Radii that are the same at all points would cost, or answer otherwise.
TYPED_TEST(ConesInMotion, WithoutTapersTheyAreCapsulesToTheLastBit) {
  using S = TypeParam;
  Motion<S> motion = Motion<S>::random(5, 20, 0.3);
  std::fill(motion.start.radii.begin(), motion.start.radii.end(), S(0.01));
  std::fill(motion.end.radii.begin(), motion.end.radii.end(), S(0.02));
  const FiberTree plain = treeOf(motion, capsules());
  const auto expected = impactsOf(plain);
  const double safe = plain.safeStep();
  for (auto* assembly : {&motion.start, &motion.end}) {
    assembly->radii_are = FiberArrays<S>::Radii::kPerPoint;
  }
  const FiberTree tree = treeOf(motion, capsules());
  const auto impacts = impactsOf(tree);
  ASSERT_EQ(impacts.size(), expected.size());
  for (const auto& [pair, impact] : impacts) {
    const auto other = expected.find(pair);
    ASSERT_TRUE(other != expected.end());
    EXPECT_EQ(impact.time, other->second.time);
    EXPECT_EQ(impact.s, other->second.s);
    EXPECT_EQ(impact.t, other->second.t);
  }
  EXPECT_EQ(tree.safeStep(), safe);
  EXPECT_GT(impacts.size(), 200u);
}

// The radius of the next segment would count for the second end of a capsule.
TEST(ConesInMotion, CapsulesMayBecomeCones) {
  Motion<double> motion;
  motion.start.addPoint({0, 0, 0}, 0.1);
  motion.start.addPoint({1, 0, 0}, 0.9);  // of the next segment, which is far from the ball
  motion.start.addPoint({1, -9, 0}, 0.9);
  motion.start.endFiber();
  motion.start.addFiber({{0.9, 2, 0}, {0.9, 2, 0}}, 0.1);
  motion.end = motion.start;
  motion.end.radii_are = Radii::kPerPoint;
  motion.end.radii = {0.1, 0.9, 0.9, 0.1, 0.1};
  FiberTreeOptions options = capsules();
  options.ignored_neighbors = 1;
  EXPECT_EQ(impactsOf(treeOf(motion, options)).size(), 0u);
  // At a time x the radius at its second end is 0.1 + 2 x.
  motion.end.radii = {0.1, 2.1, 2.1, 0.1, 0.1};
  motion.start.points[3 * 3] = motion.start.points[3 * 4] = 1;
  motion.end.points = motion.start.points;
  const auto impacts = impactsOf(treeOf(motion, options));
  const auto found = impacts.find({0, 3});
  ASSERT_TRUE(found != impacts.end());
  EXPECT_NEAR(found->second.time, 0.9, 1e-9);
}

}  // namespace
}  // namespace fcl_fibers::test
