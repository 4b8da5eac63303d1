// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/meshes.h"
#include "arrays/motion.h"
#include "support/exact_geometry.h"
#include "support/impact_oracle.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

template <typename S>
class MeshImpactsOf : public testing::Test {};
TYPED_TEST_SUITE(MeshImpactsOf, Scalars, ScalarName);

/// A turn by a few degrees about any axis, and a shift.
MeshPose turned(std::uint64_t seed) {
  Random random(seed);
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(0.1, random.direction()).toRotationMatrix().transpose();
  MeshPose pose;
  // Rows and columns change places, as Eigen keeps columns.
  std::copy_n(rotation.data(), 9, pose.rotation.begin());
  const Eigen::Vector3d shift = random.inCube(0.1);
  std::copy_n(shift.data(), 3, pose.position.begin());
  return pose;
}

/// Odd seeds have a margin, and from 3 on the mesh turns, too.
TYPED_TEST(MeshImpactsOf, ImpactsWithAMeshAreThoseOfTheWholeStep) {
  using S = TypeParam;
  std::size_t late = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const double margin = seed % 2 == 0 ? 0 : 0.03;
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
    if (seed > 2) end.setPose(turned(seed));
    std::vector<ExactTriangle> exact_start, exact_end;
    for (std::size_t t = 0; t < soup_at_end.count(); ++t) {
      exact_start.push_back(soup_at_start.triangle(t, {}));
      exact_end.push_back(soup_at_end.triangle(t, end.pose()));
    }
    const FiberTree tree = treeOf(motion, capsules(1, margin));
    const MeshPairs impacts = impactsOf(tree, start, end, motion);
    std::map<Pair, double> sampled;
    for (int k = 0; k <= kSamples; ++k) {
      const double time = static_cast<double>(k) / kSamples;
      const Assembly<double> now = motion.at(time);
      std::vector<Eigen::Vector3d> middles;
      std::vector<double> extents;
      for (std::size_t t = 0; t < exact_start.size(); ++t) {
        const ExactTriangle &p = exact_start[t], &q = exact_end[t];
        const auto at = [&](const Point& a, const Point& b) -> Eigen::Vector3d {
          return ((1 - time) * a + time * b).template cast<double>();
        };
        const Eigen::Vector3d corners[] = {at(p.a, q.a), at(p.b, q.b), at(p.c, q.c)};
        middles.push_back((corners[0] + corners[1] + corners[2]) / 3);
        extents.push_back(0);
        for (const auto& corner : corners) {
          extents.back() = std::max(extents.back(), (corner - middles.back()).norm());
        }
      }
      const auto between = [&](const Point& a, const Point& b) {
        const Point p = (1 - time) * a + time * b;
        return std::array<double, 3>{static_cast<double>(p[0]), static_cast<double>(p[1]),
                                     static_cast<double>(p[2])};
      };
      now.visitCapsules([&](std::size_t, std::size_t i) {
        const GivenCapsule c = now.capsule(i);
        const Eigen::Vector3d a(c.a[0], c.a[1], c.a[2]), b(c.b[0], c.b[1], c.b[2]);
        const double reach = (b - a).norm() / 2 + c.radius + margin + 1e-9;
        for (std::size_t t = 0; t < soup_at_start.count(); ++t) {
          const Pair numbers{static_cast<std::int32_t>(i), static_cast<std::int32_t>(t)};
          if (sampled.count(numbers) != 0) continue;
          // Most pairs are farther apart than balls around them.
          if ((middles[t] - (a + b) / 2).norm() > reach + extents[t]) continue;
          const ExactTriangle &p = exact_start[t], &q = exact_end[t];
          const GivenInstant pair{{c.a, c.b},
                                  {between(p.a, q.a), between(p.b, q.b), between(p.c, q.c)}};
          if (!ImpactOracle::within(pair, 3, c.radius + margin).certain) continue;
          sampled.emplace(numbers, time);
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
TEST(MeshImpacts, SolidsCountFromTheStart) {
  const auto triangles = ball<double>(1, 8, 12);
  const TriangleMesh mesh(triangles.view(), TriangleMesh::Kind::kSolid);
  Motion<double> motion;
  motion.start.addFiber({{0.1, 0, 0}, {0.2, 0, 0}}, 0.01);  // inside, flies out
  motion.start.addFiber({{3, 0, 0}, {3.1, 0, 0}}, 0.01);    // outside, flies in
  motion.start.addFiber({{3, 3, 0}, {3.1, 3, 0}}, 0.01);    // flies by
  TriangleMesh moved = mesh;
  moved.setPose({{1, 0, 0, 0, 1, 0, 0, 0, 1}, {3, 0, 0}});
  for (const bool mesh_moves : {false, true}) {
    const TriangleMesh& end = mesh_moves ? moved : mesh;
    motion.end = motion.start;
    for (std::size_t i = 0; i < 6 && !mesh_moves; ++i) {
      motion.end.points[3 * i] += i < 2 ? 3.0 : -3.0;
    }
    std::map<std::int32_t, std::vector<double>> times;
    for (const auto& [pair, time] : impactsOf(treeOf(motion, capsules()), mesh, end, motion)) {
      times[pair.first].push_back(time);
    }
    EXPECT_THAT(times[0], testing::ElementsAre(0));
    ASSERT_FALSE(times[2].empty());
    EXPECT_NEAR(*std::min_element(times[2].begin(), times[2].end()), (3 - 1) / 3.0, 0.05);
    EXPECT_EQ(times.size(), 2u);
  }
}

/// What is inside at the start comes with another triangle than the one by which it is to be let
/// out.
TEST(MeshImpacts, WhatIsInsideAtTheStartMeetsItsNearestTriangle) {
  const auto triangles = ball<double>(1, 8, 12);
  const TriangleMesh mesh(triangles.view(), TriangleMesh::Kind::kSolid);
  Random random(5);
  Motion<double> motion;
  const auto point = [](const Eigen::Vector3d& p) { return std::array{p.x(), p.y(), p.z()}; };
  for (int f = 0; f < 60; ++f) {
    const Eigen::Vector3d p = 0.6 * random.unit() * random.direction();
    motion.start.addFiber({point(p), point(p + random.inCube(0.1))}, 0.01);
  }
  motion.end = motion.start;
  for (double& x : motion.end.points) x += 3;
  const MeshPairs impacts = impactsOf(treeOf(motion, capsules()), mesh, mesh, motion);
  EXPECT_EQ(impacts.size(), 60u);
  for (const auto& [pair, time] : impacts) {
    EXPECT_EQ(time, 0);
    const ExactCapsule c =
        roundedCapsule(motion.start.capsule(static_cast<std::size_t>(pair.first)));
    const auto distance = [&](std::size_t t) {
      return segmentTriangleDistance(c.a, c.b, triangles.triangle(t, {}));
    };
    for (std::size_t t = 0; t < triangles.count(); ++t) {
      EXPECT_LE(distance(static_cast<std::size_t>(pair.second)), distance(t) + 1e-13L);
    }
  }
}

/// A corner of a mesh that turns by 3 degrees comes nearer to the axis by 0.034 %.
TEST(MeshImpacts, OfAMeshThatTurnsAreThoseOfTheStraightWay) {
  Triangles<double> tiny;
  for (int i = 0; i < 3; ++i) tiny.addPoint({1, 0, 1e-9 * i});
  tiny.addTriangle(0, 1, 2);
  const TriangleMesh start(tiny.view());
  TriangleMesh end = start;
  const double angle = 3 * 3.141592653589793 / 180, c = std::cos(angle), s = std::sin(angle);
  end.setPose({{c, -s, 0, s, c, 0, 0, 0, 1}, {0, 0, 0}});
  const auto isMet = [&](double radius) {
    Motion<double> motion;
    motion.start.addFiber({{0, 0, -1}, {0, 0, 1}}, radius);
    motion.end = motion.start;
    return !impactsOf(treeOf(motion, capsules()), start, end, motion).empty();
  };
  EXPECT_FALSE(isMet(1 - 0.0004));
  EXPECT_TRUE(isMet(1 - 0.0003));
}

TEST(MeshImpacts, RootsAndCategoriesMeetNoMesh) {
  auto motion = Motion<double>::random(2, 30, 0.3);
  TriangleMesh mesh(ball<double>(0.2, 6, 8).view());
  mesh.setCategories(0b0110);
  const std::vector<std::int32_t> roots(motion.start.fiberCount(), 2);
  std::vector<std::uint32_t> meets;
  for (std::size_t f = 0; f < motion.start.fiberCount(); ++f) {
    meets.push_back(f % 2 == 0 ? 0b1001 : 0b0100);
  }
  auto start = motion.start.view(), end = motion.end.view();
  end.root_segments = roots.data();
  end.meets = meets.data();
  FiberTree tree(capsules());
  tree.build(end);
  tree.update(start, end);
  const FiberTree all = treeOf(motion, capsules());
  MeshPairs expected = impactsOf(all, mesh, mesh, motion);
  std::size_t of_roots = 0, of_categories = 0;
  for (auto i = expected.begin(); i != expected.end();) {
    const FiberSegment place = all.fiberSegment(i->first.first);
    const bool is_root = place.number < 2, meets_none = place.fiber % 2 == 0;
    of_roots += is_root && !meets_none;
    of_categories += meets_none && !is_root;
    i = is_root || meets_none ? expected.erase(i) : std::next(i);
  }
  EXPECT_GT(of_roots, 0u);
  EXPECT_GT(of_categories, 0u);
  EXPECT_FALSE(expected.empty());
  EXPECT_EQ(impactsOf(tree, mesh, mesh, motion), expected);
}

}  // namespace
}  // namespace fcl_fibers::test
