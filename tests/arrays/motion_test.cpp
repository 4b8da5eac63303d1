// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
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

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/array_fibers.h"
#include "arrays/meshes.h"
#include "support/scalars.h"
#include "support/triangle_oracle.h"

namespace fcl_fibers::test {
namespace {

/// What a reported pair may miss a touch by: 2^-36 of its size, which is below 4.
constexpr double kTolerance = 4 * 0x1p-36;

constexpr int kSamples = 32;

/// Fibers at the start and at the end of a step.
template <typename S>
struct Motion {
  Assembly<S> start, end;

  /// Fibers that fly through each other, each as a whole and each point by itself.
  static Motion random(std::uint64_t seed, int fibers, double away) {
    Motion motion{curledFibers<S>(seed, fibers), {}};
    motion.end = motion.start;
    Random random(seed + 1000);
    for (std::size_t f = 0; f < motion.end.fiberCount(); ++f) {
      const Eigen::Vector3d whole = random.inCube(away);
      for (std::size_t i = motion.end.point_begin[f]; i < motion.end.point_begin[f + 1]; ++i) {
        const Eigen::Vector3d way = whole + random.inCube(0.2 * away);
        for (std::size_t k = 0; k < 3; ++k) {
          motion.end.points[3 * i + k] += static_cast<S>(way[static_cast<Eigen::Index>(k)]);
        }
        if (i % 3 == 0) motion.end.radii[i] *= S(1.5);
      }
    }
    return motion;
  }

  /// In doubles, because the points in between are not those of a float array.
  Assembly<double> at(double time) const {
    Assembly<double> now;
    now.point_begin = start.point_begin;
    const auto between = [&](S a, S b) {
      return (1 - time) * static_cast<double>(a) + time * static_cast<double>(b);
    };
    for (std::size_t i = 0; i < start.points.size(); ++i) {
      now.points.push_back(between(start.points[i], end.points[i]));
    }
    for (std::size_t i = 0; i < start.radii.size(); ++i) {
      now.radii.push_back(between(start.radii[i], end.radii[i]));
    }
    return now;
  }
};

using Pair = std::pair<std::int32_t, std::int32_t>;

FiberTreeOptions capsules(int ignored = 1, double margin = 0) {
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = ignored;
  options.margin = margin;
  return options;
}

template <typename S>
FiberTree treeOf(const Motion<S>& motion, const FiberTreeOptions& options) {
  FiberTree tree(options);
  tree.build(motion.end.view());
  tree.update(motion.start.view(), motion.end.view());
  return tree;
}

std::map<Pair, Impact> impactsOf(const FiberTree& tree) {
  std::map<Pair, Impact> impacts;
  tree.visitImpacts([&](const Impact& impact) {
    EXPECT_LT(impact.pair.a, impact.pair.b);
    EXPECT_TRUE(impacts.emplace(Pair{impact.pair.a, impact.pair.b}, impact).second)
        << "a pair came twice";
  });
  return impacts;
}

template <typename S>
class MotionOf : public testing::Test {};
TYPED_TEST_SUITE(MotionOf, Scalars);

/// Whatever touches at one of many sampled times was found, and not after that time. What was found
/// touches at its time.
TYPED_TEST(MotionOf, ImpactsAreThoseOfTheWholeStep) {
  using S = TypeParam;
  std::size_t late = 0, all = 0;
  for (const Topology topology : {Topology::kBundle, Topology::kSuperThread}) {
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
      const Motion<S> motion = Motion<S>::random(seed, 14, seed % 2 == 0 ? 0.4 : 0.02);
      FiberTreeOptions options = capsules(1, seed % 2 == 0 ? 0 : 0.003);
      options.topology = topology;
      const auto impacts = impactsOf(treeOf(motion, options));
      std::map<Pair, double> sampled;
      for (int k = 0; k <= kSamples; ++k) {
        const double time = static_cast<double>(k) / kSamples;
        const Assembly<double> now = motion.at(time);
        for (const Pair& pair : touchingPairs(now, now, 1, options.margin)) {
          sampled.emplace(pair, time);
        }
      }
      for (const auto& [pair, time] : sampled) {
        const auto found = impacts.find(pair);
        ASSERT_NE(found, impacts.end()) << pair.first << ", " << pair.second << " at " << time;
        EXPECT_LE(found->second.time, time);
        late += time > 0;
      }
      for (const auto& [pair, impact] : impacts) {
        const Contact contact = impactContact(motion.start.view(), motion.end.view(), impact);
        EXPECT_LE(contact.distance, options.margin + kTolerance);
        if (impact.time > 0) {
          EXPECT_GE(contact.distance, options.margin - kTolerance);
        }
        EXPECT_NEAR(contact.s, impact.s, 1e-3);
        EXPECT_NEAR(contact.t, impact.t, 1e-3);
      }
      all += impacts.size();
    }
  }
  EXPECT_GT(late, 500u);
  EXPECT_GT(all, late);
}

/// Moving pairs contain all impacts, and are fewer than the pairs of boxes around both positions.
TEST(Motion, MovingPairsAreFewAndContainAllImpacts) {
  const auto motion = Motion<double>::random(7, 30, 0.4);
  FiberTreeOptions options = capsules();
  const FiberTree tree = treeOf(motion, options);
  const Pairs moving = pairsFrom([&](auto&& visit) { tree.visitMovingPairs(visit); });
  for (const auto& [pair, impact] : impactsOf(tree)) {
    EXPECT_TRUE(std::binary_search(moving.begin(), moving.end(), pair));
  }
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
  options = {};
  FiberTree boxes(options);
  boxes.build(swept.view());
  EXPECT_LT(2 * moving.size(), pairsOf(boxes).size());

  // Under kVolumes there are moving pairs but no impacts.
  options.ignored_neighbors = 1;
  const FiberTree volumes = treeOf(motion, options);
  EXPECT_EQ(pairsFrom([&](auto&& visit) { volumes.visitMovingPairs(visit); }), moving);
  EXPECT_THROW(volumes.visitImpacts([](const Impact&) {}), std::invalid_argument);
  EXPECT_THROW((void)volumes.safeStep(), std::invalid_argument);
}

TEST(Motion, OtherQueriesAnswerForTheEnd) {
  const auto motion = Motion<double>::random(11, 30, 0.3);
  const FiberTree moving = treeOf(motion, capsules());
  FiberTree still(capsules());
  still.build(motion.end.view());
  EXPECT_EQ(pairsOf(moving), pairsOf(still));
  EXPECT_GT(moving.memoryUsage(), still.memoryUsage());
}

TEST(Motion, FibersThatRestTouchAtTheStart) {
  const auto fibers = curledFibers<double>(3);
  const FiberTree tree = treeOf(Motion<double>{fibers, fibers}, capsules());
  Pairs pairs;
  for (const auto& [pair, impact] : impactsOf(tree)) {
    EXPECT_EQ(impact.time, 0);
    pairs.push_back(pair);
  }
  EXPECT_EQ(pairs, pairsOf(tree));
  EXPECT_EQ(tree.safeStep(), 1);
}

/// A bullet 1000 times as far from the wall as it is thick.
TEST(Motion, FastFibersAreNotMissed) {
  Motion<double> motion;
  motion.start.addFiber({{-1, 0, 0}, {-1, 0.01, 0}}, 0.001);
  motion.start.addFiber({{0, -1, -1}, {0, 1, 1}}, 0.001);
  motion.end = motion.start;
  motion.end.points[0] = motion.end.points[3] = 1;
  const auto impacts = impactsOf(treeOf(motion, capsules()));
  ASSERT_EQ(impacts.size(), 1u);
  EXPECT_NEAR(impacts.begin()->second.time, (1 - 0.002) / 2, 1e-9);
}

/// The order does not depend on the number of threads, nor on how often one asks.
TEST(Motion, ThreadsDoNotShow) {
  const auto motion = Motion<double>::random(5, 300, 0.1);
  std::vector<std::vector<double>> found;
  std::vector<double> safe;
  for (const int threads : {1, 2, 3, 2}) {
    FiberTreeOptions options = capsules();
    options.threads = threads;
    const FiberTree tree = treeOf(motion, options);
    std::vector<double>& numbers = found.emplace_back();
    std::vector<Impact> impacts;
    tree.findImpacts(impacts);
    for (const Impact& i : impacts) {
      numbers.insert(numbers.end(), {static_cast<double>(i.pair.a), static_cast<double>(i.pair.b),
                                     i.time, i.s, i.t});
    }
    safe.push_back(tree.safeStep());
  }
  EXPECT_GT(found[0].size(), 5000u);
  for (std::size_t i = 1; i < found.size(); ++i) {
    EXPECT_EQ(found[i], found[0]);
    EXPECT_EQ(safe[i], safe[0]);
  }
}

TEST(Motion, AVisitorEndsTheQuery) {
  const FiberTree tree = treeOf(Motion<double>::random(5, 100, 0.1), capsules());
  int visits = 0;
  EXPECT_TRUE(tree.visitImpacts([&](const Impact&) { return ++visits == 3; }));
  EXPECT_EQ(visits, 3);
}

/// If nothing touches at the start, the safe step ends at the first impact.
TYPED_TEST(MotionOf, TheSafeStepEndsAtTheFirstImpact) {
  using S = TypeParam;
  int with_impacts = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    auto motion = Motion<S>::random(seed, 12, 0.05);
    for (auto* fibers : {&motion.start, &motion.end}) {
      for (S& radius : fibers->radii) radius *= S(0.02);
    }
    const FiberTree tree = treeOf(motion, capsules());
    double first = 1;
    bool touches_at_start = false;
    for (const auto& [pair, impact] : impactsOf(tree)) {
      touches_at_start |= impact.time == 0;
      first = std::min(first, impact.time);
    }
    if (touches_at_start) continue;
    with_impacts += first < 1;
    EXPECT_NEAR(tree.safeStep(), first, 1e-12);
  }
  EXPECT_GT(with_impacts, 5);
}

/// What touches at the start counts once it is nearer than there.
TEST(Motion, WhatSeparatesDoesNotShortenTheSafeStep) {
  const auto pairOf = [](double start, double end) {
    Motion<double> motion;
    motion.start.addFiber({{0, 0, 0}, {1, 0, 0}}, 0.1);
    motion.start.addFiber({{0, start, 0}, {1, start, 0}}, 0.1);
    motion.end = motion.start;
    motion.end.points[7] = motion.end.points[10] = end;
    return treeOf(motion, capsules());
  };
  EXPECT_EQ(pairOf(0.15, 0.3).safeStep(), 1);
  EXPECT_EQ(pairOf(0.15, 0.15).safeStep(), 1);
  EXPECT_LT(pairOf(0.15, 0.1).safeStep(), 1e-6);
  EXPECT_NEAR(pairOf(0.3, 0.1).safeStep(), 0.5, 1e-8);
  // It passes through the other one and is as near as before on the other side.
  EXPECT_LT(pairOf(0.15, -0.15).safeStep(), 1e-6);
}

/// A frame that suits the end may not suit the start, and both change from step to step.
TEST(Motion, StepsFollowEachOther) {
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

TEST(Motion, FarAwayIsAsNearTheOrigin) {
  auto motion = Motion<double>::random(9, 14, 0.3);
  for (auto* fibers : {&motion.start, &motion.end}) {
    // Then adding 2^20 rounds nothing.
    for (double& x : fibers->points) x = std::round(x * 0x1p30) / 0x1p30;
  }
  const auto near = impactsOf(treeOf(motion, capsules()));
  for (auto* fibers : {&motion.start, &motion.end}) {
    for (double& x : fibers->points) x += 0x1p20;
  }
  const auto far = impactsOf(treeOf(motion, capsules()));
  ASSERT_EQ(near.size(), far.size());
  for (const auto& [pair, impact] : near) EXPECT_NEAR(far.at(pair).time, impact.time, 1e-7);
}

// --- Meshes ---

using MeshPairs = std::map<Pair, double>;

template <typename S>
MeshPairs impactsOf(const FiberTree& tree, const TriangleMesh& start, const TriangleMesh& end,
                    const Motion<S>& motion) {
  MeshPairs impacts;
  tree.visitImpacts(start, end, [&](const MeshImpact& impact) {
    EXPECT_TRUE(
        impacts.emplace(Pair{impact.pair.segment, impact.pair.triangle}, impact.time).second)
        << "a pair came twice";
    const MeshContact contact =
        impactContact(motion.start.view(), motion.end.view(), start, end, impact);
    EXPECT_LE(contact.distance, tree.options().margin + kTolerance);
  });
  return impacts;
}

TYPED_TEST(MotionOf, ImpactsWithAMeshAreThoseOfTheWholeStep) {
  using S = TypeParam;
  std::size_t late = 0;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const auto motion = Motion<S>::random(seed, 8, seed % 2 == 0 ? 0.3 : 0.02);
    const auto soup_at_start = soup<double>(seed, 40, 0.3);
    auto soup_at_end = soup_at_start;
    Random random(seed);
    const Eigen::Vector3d way = random.inCube(0.2);
    for (std::size_t i = 0; i < soup_at_end.points.size(); ++i) {
      soup_at_end.points[i] += way[static_cast<Eigen::Index>(i % 3)] + 0.02 * random.inCube(1).x();
    }
    const TriangleMesh start(soup_at_start.view());
    TriangleMesh end = start;
    end.update(soup_at_end.view());
    const FiberTree tree = treeOf(motion, capsules());
    const MeshPairs impacts = impactsOf(tree, start, end, motion);
    std::map<Pair, double> sampled;
    for (int k = 0; k <= kSamples; ++k) {
      const double time = static_cast<double>(k) / kSamples;
      const Assembly<double> now = motion.at(time);
      const auto corner = [&](std::int32_t i) {
        std::array<double, 3> p;
        for (std::size_t x = 0; x < 3; ++x) {
          const std::size_t at = 3 * static_cast<std::size_t>(i) + x;
          p[x] = (1 - time) * soup_at_start.points[at] + time * soup_at_end.points[at];
        }
        return p;
      };
      now.visitCapsules([&](std::size_t, std::size_t i) {
        const GivenCapsule c = now.capsule(i);
        for (std::size_t t = 0; t < soup_at_start.count(); ++t) {
          const std::int32_t* id = &soup_at_start.indices[3 * t];
          const GivenTriangle triangle{corner(id[0]), corner(id[1]), corner(id[2])};
          if (!TriangleOracle::judge({c.a, c.b}, triangle, c.radius).within) continue;
          sampled.emplace(Pair{static_cast<std::int32_t>(i), static_cast<std::int32_t>(t)}, time);
        }
      });
    }
    for (const auto& [pair, time] : sampled) {
      ASSERT_EQ(impacts.count(pair), 1u) << pair.first << ", " << pair.second << " at " << time;
      EXPECT_LE(impacts.at(pair), time);
      late += time > 0;
    }
  }
  EXPECT_GT(late, 100u);
}

/// Fibers that fly into a ball meet its surface. One that is inside at the start meets it once.
TEST(Motion, SolidsCountFromTheStart) {
  const auto triangles = ball<double>(1, 8, 12);
  const TriangleMesh mesh(triangles.view(), TriangleMesh::Kind::kSolid);
  Motion<double> motion;
  motion.start.addFiber({{0.1, 0, 0}, {0.2, 0, 0}}, 0.01);  // inside, flies out
  motion.start.addFiber({{3, 0, 0}, {3.1, 0, 0}}, 0.01);    // outside, flies in
  motion.start.addFiber({{3, 3, 0}, {3.1, 3, 0}}, 0.01);    // flies by
  motion.end = motion.start;
  for (std::size_t i = 0; i < 6; ++i) motion.end.points[3 * i] += i < 2 ? 3.0 : -3.0;
  const FiberTree tree = treeOf(motion, capsules());
  std::map<std::int32_t, std::vector<double>> times;
  for (const auto& [pair, time] : impactsOf(tree, mesh, mesh, motion)) {
    times[pair.first].push_back(time);
  }
  EXPECT_THAT(times[0], testing::ElementsAre(0));
  ASSERT_FALSE(times[2].empty());
  EXPECT_NEAR(*std::min_element(times[2].begin(), times[2].end()), (3 - 1) / 3.0, 0.05);
  EXPECT_EQ(times.size(), 2u);

  // The mesh moves instead.
  const Motion<double> rest{motion.start, motion.start};
  TriangleMesh moved = mesh;
  moved.setPose({{1, 0, 0, 0, 1, 0, 0, 0, 1}, {3, 0, 0}});
  times.clear();
  const FiberTree resting = treeOf(rest, capsules());
  for (const auto& [pair, time] : impactsOf(resting, mesh, moved, rest)) {
    times[pair.first].push_back(time);
  }
  EXPECT_THAT(times[0], testing::ElementsAre(0));
  ASSERT_FALSE(times[2].empty());
  EXPECT_NEAR(*std::min_element(times[2].begin(), times[2].end()), (3 - 1) / 3.0, 0.05);
}

TEST(Motion, RootsAndCategoriesMeetNoMesh) {
  auto motion = Motion<double>::random(2, 8, 0.3);
  const TriangleMesh mesh(ball<double>(0.2, 6, 8).view());
  const std::vector<std::int32_t> roots(motion.start.fiberCount(), 2);
  auto start = motion.start.view(), end = motion.end.view();
  end.root_segments = roots.data();
  FiberTree tree(capsules());
  tree.build(end);
  tree.update(start, end);
  const FiberTree all = treeOf(motion, capsules());
  MeshPairs expected = impactsOf(all, mesh, mesh, motion);
  for (auto i = expected.begin(); i != expected.end();) {
    i = all.fiberSegment(i->first.first).segment < 2 ? expected.erase(i) : std::next(i);
  }
  EXPECT_FALSE(expected.empty());
  EXPECT_EQ(impactsOf(tree, mesh, mesh, motion), expected);
}

// --- Refusals ---

template <class F>
std::string textOf(F&& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Motion, RefusalsSayWhatToDo) {
  using testing::HasSubstr;
  auto motion = Motion<double>::random(1, 5, 0.1);
  FiberTree tree(capsules());
  tree.build(motion.end.view());
  const auto ask = [&] { tree.visitImpacts([](const Impact&) {}); };
  EXPECT_THAT(textOf(ask), HasSubstr("update(start, end)"));
  EXPECT_THAT(textOf([&] { (void)tree.safeStep(); }), HasSubstr("update(start, end)"));
  EXPECT_THAT(textOf([&] { tree.visitMovingPairs([](SegmentPair) {}); }),
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
  EXPECT_THAT(textOf([&] { tree.visitImpacts(mesh, coarse, [](const MeshImpact&) {}); }),
              HasSubstr("other triangles"));
  EXPECT_THAT(
      textOf([&] {
        (void)impactContact(motion.start.view(), motion.end.view(), Impact{{0, 1}, 2, 0, 0});
      }),
      HasSubstr("[0, 1]"));
}

}  // namespace
}  // namespace fcl_fibers::test
