// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/meshes.h"
#include "arrays/motion.h"
#include "support/impact_oracle.h"
#include "support/scalars.h"
#include "support/text_of.h"

namespace fcl_fibers::test {
namespace {

/// An impact may be early by 2^-36 of a pair's size, however slowly the pair closes.
constexpr double kEarly = 1e-8;

template <typename S>
class SafeStepOf : public testing::Test {};
TYPED_TEST_SUITE(SafeStepOf, Scalars, ScalarName);

/// If nothing touches at the start, the safe step ends at the first impact.
TYPED_TEST(SafeStepOf, TheSafeStepEndsAtTheFirstImpact) {
  using S = TypeParam;
  int with_impacts = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    auto motion = Motion<S>::random(seed, 12, 0.05);
    for (auto* fibers : {&motion.start, &motion.end}) {
      for (S& radius : fibers->radii) radius *= S(0.02);
    }
    // Neighbours and groups, whose capsules are near each other, do not shorten the step.
    if (seed % 2 == 1) motion.closeAndGroup();
    const FiberTree tree = treeOf(motion, capsules(1, seed % 4 < 2 ? 0 : 0.0005));
    double first = 1;
    bool touches_at_start = false;
    for (const auto& [pair, impact] : impactsOf(tree)) {
      touches_at_start |= impact.time == 0;
      first = std::min(first, impact.time);
    }
    if (touches_at_start) continue;
    with_impacts += first < 1;
    EXPECT_NEAR(tree.safeStep(), first, kEarly);
  }
  EXPECT_GT(with_impacts, 5);
}

/// What touches at the start counts once it is nearer than there.
TEST(SafeStep, WhatSeparatesDoesNotShortenTheSafeStep) {
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
  EXPECT_NEAR(pairOf(0.3, 0.1).safeStep(), 0.5, kEarly);
  // It passes through the other one and is as near as before on the other side.
  EXPECT_LT(pairOf(0.15, -0.15).safeStep(), 1e-6);
}

/// The ways that are documented to leave out what touches at the start would not do so, or would
/// leave out more.
TEST(SafeStep, LaterImpactsAndSmallerRadiiLeaveOutWhatTouchesAtTheStart) {
  // The second fiber touches the first and comes nearer. The third reaches the first at 0.5.
  const auto treeWith = [](double radius) {
    Motion<double> motion;
    motion.start.addFiber({{0, 0, 0}, {1, 0, 0}}, radius);
    motion.start.addFiber({{0, 0.15, 0}, {1, 0.15, 0}}, radius);
    motion.start.addFiber({{0, 0, 0.3}, {1, 0, 0.3}}, radius);
    motion.end = motion.start;
    motion.end.points[7] = motion.end.points[10] = 0.14;
    motion.end.points[14] = motion.end.points[17] = 0.1;
    return treeOf(motion, capsules());
  };
  const FiberTree tree = treeWith(0.1);
  EXPECT_LT(tree.safeStep(), 1e-6);
  double later = 1;
  tree.visit(Impacts{}, [&](const Impact& impact) {
    if (impact.time > 0) later = std::min(later, impact.time);
  });
  EXPECT_NEAR(later, 0.5, kEarly);
  // With a radius of 0.06 nothing touches at the start, and the third gets to 0.12 at 0.9.
  EXPECT_NEAR(treeWith(0.06).safeStep(), 0.9, kEarly);
}

// --- With a mesh ---

/// Triangles that move as one and each by itself.
TriangleMesh moved(const TriangleMesh& mesh, Triangles<double> triangles, std::uint64_t seed) {
  Random random(seed);
  const Eigen::Vector3d way = random.inCube(0.2);
  for (std::size_t i = 0; i < triangles.points.size(); ++i) {
    triangles.points[i] += way[static_cast<Eigen::Index>(i % 3)] + 0.02 * random.inCube(1).x();
  }
  TriangleMesh end = mesh;
  end.update(triangles.view());
  return end;
}

bool crosses(const GivenCapsule& capsule, const Triangles<double>& triangles, std::int32_t t) {
  const auto corner = [&](std::size_t k) {
    const std::size_t i =
        3 * static_cast<std::size_t>(triangles.indices[3 * static_cast<std::size_t>(t) + k]);
    return std::array<double, 3>{triangles.points[i], triangles.points[i + 1],
                                 triangles.points[i + 2]};
  };
  const GivenInstant pair{{capsule.a, capsule.b}, {corner(0), corner(1), corner(2)}};
  return ImpactOracle::within(pair, 3, 0).certain;
}

/// The safe step ends at the first impact, or where what touches at the start comes nearer. Some
/// steps have a margin.
TYPED_TEST(SafeStepOf, WithAMeshItEndsAtTheFirstImpact) {
  using S = TypeParam;
  int with_impacts = 0, shortened = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    auto motion = Motion<S>::random(seed, 8, 0.2);
    for (auto* fibers : {&motion.start, &motion.end}) {
      for (S& radius : fibers->radii) radius *= S(0.02);
    }
    const auto triangles = soup<double>(seed, 40, 0.3);
    const TriangleMesh start(triangles.view()), end = moved(start, triangles, seed);
    FiberTreeOptions options = capsules(1, seed % 4 < 2 ? 0 : 0.001);
    options.topology = seed % 2 == 0 ? Topology::kBundle : Topology::kSuperThread;
    options.threads = seed % 3 == 0 ? 2 : 1;
    const FiberTree tree = treeOf(motion, options);
    double first = 1;
    std::vector<Pair> touching;
    for (const auto& [pair, time] : impactsOf(tree, start, end, motion)) {
      time == 0 ? touching.push_back(pair) : void(first = std::min(first, time));
    }
    const double safe = tree.safeStep(MeshStep{start, end});
    // What touches counts once it is nearer. What crosses a triangle can only become thicker.
    const auto gapAt = [&](const Pair& pair, double time) {
      const auto i = static_cast<std::size_t>(pair.first);
      if (crosses(motion.start.capsule(i), triangles, pair.second)) {
        return -((1 - time) * motion.start.capsule(i).radius + time * motion.end.capsule(i).radius);
      }
      const MeshImpact at{{pair.first, pair.second}, time};
      return impactContact(motion.start.view(), motion.end.view(), MeshStep{start, end}, at)
          .distance;
    };
    bool comes_nearer = false;
    for (const Pair& pair : touching) {
      const double gap = gapAt(pair, 0);
      for (int k = 1; k <= kSamples; ++k) {
        EXPECT_GE(gapAt(pair, safe * k / kSamples), gap - kTolerance) << pair.first;
      }
      comes_nearer |= gapAt(pair, std::min(1.0, safe + kEarly)) < gap;
    }
    with_impacts += touching.empty() && first < 1;
    shortened += comes_nearer;
    EXPECT_LE(safe, first);
    if (!comes_nearer) {
      EXPECT_NEAR(safe, first, kEarly);
    }
  }
  EXPECT_GT(with_impacts, 5);
  EXPECT_GT(shortened, 2);
}

/// A fiber, along x at some height and y over time, and a large triangle that is level.
struct OverATriangle {
  Motion<double> motion;
  Triangles<double> triangles;

  OverATriangle(double start, double end) {
    motion.start.addFiber({{-0.5, 0, start}, {0.5, 0, start}}, 0.1);
    motion.end = motion.start;
    motion.end.points[2] = motion.end.points[5] = end;
    triangles.addPoint({-5, -5, 0});
    triangles.addPoint({5, -5, 0});
    triangles.addPoint({0, 5, 0});
    triangles.addTriangle(0, 1, 2);
  }
  double safeStep() const {
    const TriangleMesh mesh(triangles.view());
    return treeOf(motion, capsules()).safeStep(MeshStep{mesh, mesh});
  }
};

TEST(SafeStep, EndsAtATriangle) {
  EXPECT_NEAR(OverATriangle(1, -1).safeStep(), 0.45, kEarly);
  EXPECT_EQ(OverATriangle(1, 0.2).safeStep(), 1);
  // The triangle rises instead.
  const OverATriangle rest(1, 1);
  const TriangleMesh mesh(rest.triangles.view());
  TriangleMesh risen = mesh;
  risen.setPose({{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 2}});
  const FiberTree tree = treeOf(rest.motion, capsules());
  EXPECT_NEAR(tree.safeStep(MeshStep{mesh, risen}), 0.45, kEarly);
  EXPECT_EQ(tree.safeStep(), 1);
}

/// What touches a triangle at the start counts once it is nearer than there.
TEST(SafeStep, WhatLeavesATriangleIsSafe) {
  EXPECT_EQ(OverATriangle(0.05, 1).safeStep(), 1);
  EXPECT_EQ(OverATriangle(0.05, 0.05).safeStep(), 1);
  EXPECT_LT(OverATriangle(0.05, 0.04).safeStep(), 1e-6);
  EXPECT_LT(OverATriangle(0.05, -0.05).safeStep(), 1e-6);
}

/// What crosses a triangle cannot come nearer to it, and still meets the next one.
TEST(SafeStep, WhatCrossesATriangleMeetsOthers) {
  OverATriangle both(0, -1);
  both.motion.start.points[5] = 0.5;  // its ends are at 0 and 0.5
  both.motion.start.points[2] = -0.5;
  EXPECT_EQ(both.safeStep(), 1);
  both.triangles.addPoint({-5, -5, -0.8});
  both.triangles.addPoint({5, -5, -0.8});
  both.triangles.addPoint({0, 5, -0.8});
  both.triangles.addTriangle(3, 4, 5);
  // The lower end falls from -0.5 to -1.
  EXPECT_NEAR(both.safeStep(), (0.8 - 0.1 - 0.5) / 0.5, kEarly);
}

/// A fiber that is inside a solid could never leave it if its way out were not safe.
TEST(SafeStep, WhatIsInsideASolidMayLeave) {
  const TriangleMesh mesh(boxMesh({-1, -1, -1}, {1, 1, 1}).view(), TriangleMesh::Kind::kSolid);
  const TriangleMesh surface(boxMesh({-1, -1, -1}, {1, 1, 1}).view());
  Motion<double> motion;
  motion.start.addFiber({{0, 0, 0}, {0.1, 0, 0}}, 0.05);
  motion.end = motion.start;
  motion.end.points[0] = 3;
  motion.end.points[3] = 3.1;
  EXPECT_EQ(treeOf(motion, capsules()).safeStep(MeshStep{mesh, mesh}), 1);
  EXPECT_NEAR(treeOf(motion, capsules()).safeStep(MeshStep{surface, surface}), (1 - 0.15) / 3,
              kEarly);
  std::swap(motion.start, motion.end);
  EXPECT_NEAR(treeOf(motion, capsules()).safeStep(MeshStep{mesh, mesh}), (3 - 1.05) / 3, kEarly);
}

TEST(SafeStep, RootsAndCategoriesMeetNoMesh) {
  const OverATriangle falling(1, -1);
  TriangleMesh mesh(falling.triangles.view());
  mesh.setCategories(0b10);
  const auto stepWith = [&](std::int32_t roots, std::uint32_t meets) {
    auto start = falling.motion.start.view(), end = falling.motion.end.view();
    end.root_segments = &roots;
    end.meets = &meets;
    FiberTree tree(capsules());
    tree.build(end);
    tree.update(start, end);
    return tree.safeStep(MeshStep{mesh, mesh});
  };
  EXPECT_NEAR(stepWith(0, 0b11), 0.45, kEarly);
  EXPECT_EQ(stepWith(1, 0b11), 1);
  EXPECT_EQ(stepWith(0, 0b01), 1);
}

TEST(SafeStep, RefusesAMeshThatIsNotTheSame) {
  const OverATriangle falling(1, -1);
  const auto triangles = boxMesh({-1, -1, -1}, {1, 1, 1});
  const TriangleMesh mesh(triangles.view()), larger(ball<double>(0.2, 4, 8).view());
  const TriangleMesh solid(triangles.view(), TriangleMesh::Kind::kSolid);
  auto turned_inward = triangles;
  std::swap(turned_inward.indices[0], turned_inward.indices[1]);
  const TriangleMesh inward(turned_inward.view());
  TriangleMesh other_categories = mesh;
  other_categories.setCategories(0b1);
  FiberTree tree = treeOf(falling.motion, capsules());
  for (const TriangleMesh* end :
       std::initializer_list<const TriangleMesh*>{&larger, &inward, &solid, &other_categories}) {
    for (const auto& text : {textOf([&] {
                               (void)tree.safeStep(MeshStep{mesh, *end});
                             }),
                             textOf([&] {
                               (void)tree.safeStep(MeshStep{*end, mesh});
                             }),
                             textOf([&] {
                               tree.visit(Impacts{}, MeshStep{mesh, *end}, [](MeshImpact) {});
                             })}) {
      EXPECT_THAT(text, testing::HasSubstr("the mesh at the end has other triangles, another kind "
                                           "or other categories than the one at the start"));
    }
  }
  EXPECT_THAT(textOf([&] {
                (void)tree.safeStep(MeshStep{mesh, larger});
              }),
              testing::HasSubstr("FiberTree::safeStep: "));
  tree.update(falling.motion.end.view());
  EXPECT_THAT(textOf([&] {
                (void)tree.safeStep(MeshStep{mesh, mesh});
              }),
              testing::HasSubstr("update(start, end)"));
}

}  // namespace
}  // namespace fcl_fibers::test
