// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/live_pairs.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/meshes.h"
#include "arrays/tapered_fibers.h"
#include "support/least_of_convex.h"
#include "support/scalars.h"

// Fibers with a radius at each point, so that their segments are rounded cones, and meshes.
namespace fcl_fibers::test::cone_meshes {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// The library rounds towards touching, by a few ulp of the coordinates, which are below 4.
constexpr Real kRounding = 1e-13L;

Point toPoint(const std::array<double, 3>& p) { return {p[0], p[1], p[2]}; }
Point normalOf(const ExactTriangle& t) { return (t.b - t.a).cross(t.c - t.a); }

/// The distance by its definition: the least over all balls.
Real distanceOf(const Cone& cone, const ExactTriangle& t) {
  return leastOfConvex([&](Real s) {
    return segmentTriangleDistance(cone.at(s), cone.at(s), t) - cone.radiusAt(s);
  });
}

/// The distances of cones and triangles, by segment and triangle. Those that are far apart are
/// bounded only.
template <typename S>
class Gaps {
 public:
  Gaps(const Assembly<S>& fibers, const Triangles<S>& mesh, const MeshPose& pose) {
    for (std::size_t t = 0; t < mesh.count(); ++t) triangles_.push_back(mesh.triangle(t, pose));
    fibers.visitCapsules([&](std::size_t, std::size_t i) {
      segments_.push_back(static_cast<std::int32_t>(i));
      cones_.push_back(coneOf(fibers, i));
    });
  }

  const std::vector<ExactTriangle>& triangles() const { return triangles_; }
  const std::vector<std::int32_t>& segments() const { return segments_; }
  const Cone& cone(std::size_t row) const { return cones_[row]; }

  Real gap(std::size_t row, std::size_t t) const { return distanceOf(cones_[row], triangles_[t]); }
  /// Of the capsule around the cone, which is at most gap().
  Real least(std::size_t row, std::size_t t) const {
    const Cone& c = cones_[row];
    return segmentTriangleDistance(c.a, c.b, triangles_[t]) - c.thickest();
  }
  Real leastOfRow(std::size_t row) const {
    Real found = kInfinity;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if (least(row, t) < found) found = std::min(found, gap(row, t));
    }
    return found;
  }

 private:
  std::vector<ExactTriangle> triangles_;
  std::vector<std::int32_t> segments_;
  std::vector<Cone> cones_;
};

std::set<std::pair<std::int32_t, std::int32_t>> pairsOf(const FiberTree& tree,
                                                        const TriangleMesh& mesh) {
  std::set<std::pair<std::int32_t, std::int32_t>> pairs;
  tree.visit(Pairs{}, mesh, [&](TrianglePair pair) {
    EXPECT_TRUE(pairs.emplace(pair.segment, pair.triangle).second) << "a pair came twice";
  });
  return pairs;
}

template <typename S>
FiberTree treeOf(const Assembly<S>& fibers, const FiberTreeOptions& options = FiberOptions{
                                                Topology::kBundle, Report::kCapsules}) {
  FiberTree tree(options);
  tree.build(fibers.view());
  return tree;
}

/// What contact.h says of points, normal and depth at a surface.
void expectRight(const Cone& cone, const ExactTriangle& t, const MeshContact& contact) {
  const Point normal = toPoint(contact.normal), x = cone.at(contact.s);
  EXPECT_LE(std::fabs(normal.norm() - 1), 1e-14L);
  EXPECT_LE((x + cone.radiusAt(contact.s) * normal - toPoint(contact.point_a)).norm(), 1e-14L);
  const auto& w = contact.weights;
  const Point q = Real(w[0]) * t.a + Real(w[1]) * t.b + Real(w[2]) * t.c;
  EXPECT_LE((q - toPoint(contact.point_b)).norm(), 1e-14L);
  if (segmentTriangleDistance(cone.a, cone.b, t) > 1e-10L) {
    EXPECT_LE(std::fabs(contact.distance - distanceOf(cone, t)), 1e-14L);
  } else if (normalOf(t).norm() < 1e-6L) {
    return;  // it has no plane to be moved off
  }
  const Point move = Real(contact.distance) * normal;
  const Cone moved{cone.a + move, cone.b + move, cone.at_a, cone.at_b};
  if (contact.distance < 0) {
    EXPECT_GE(distanceOf(moved, t), -1e-9L);
  }
}

std::vector<MeshPose> poses() { return {MeshPose(), randomPose(5, 0.1)}; }

template <typename S>
class ConeMeshes : public testing::Test {};
TYPED_TEST_SUITE(ConeMeshes, Scalars, ScalarName);

// A tapered rope would be met by the capsules around its segments.
TYPED_TEST(ConeMeshes, PairsAndContactsAreTheConesThatTouch) {
  using S = TypeParam;
  const auto fibers = taperedFibers<S>(171, 12);
  std::size_t spared = 0, found = 0;
  for (const Triangles<S>& triangles : {soup<S>(172, 80, 0.4), ball<S>(0.35, 6, 9)}) {
    TriangleMesh mesh(triangles.view());
    for (const MeshPose& pose : poses()) {
      mesh.setPose(pose);
      const Gaps<S> gaps(fibers, triangles, pose);
      for (const double margin : {0.0, 0.02}) {
        std::set<std::pair<std::int32_t, std::int32_t>> must, may;
        for (std::size_t row = 0; row < gaps.segments().size(); ++row) {
          for (std::size_t t = 0; t < gaps.triangles().size(); ++t) {
            if (gaps.least(row, t) > margin + kRounding) continue;
            const std::pair pair(gaps.segments()[row], static_cast<std::int32_t>(t));
            const Real gap = gaps.gap(row, t) - margin;
            if (gap <= 0) must.insert(pair);
            if (gap <= kRounding) may.insert(pair);
            spared += gap > kRounding;
          }
        }
        for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
          options.margin = margin;
          options.threads = margin > 0 ? 3 : 1;
          const FiberTree tree = treeOf(fibers, options);
          const auto pairs = pairsOf(tree, mesh);
          EXPECT_TRUE(std::includes(pairs.begin(), pairs.end(), must.begin(), must.end()));
          EXPECT_TRUE(std::includes(may.begin(), may.end(), pairs.begin(), pairs.end()));
          found += pairs.size();
          std::vector<MeshContact> contacts;
          tree.find(Contacts{fibers.view()}, mesh, contacts);
          ASSERT_EQ(contacts.size(), pairs.size());
          if (options.topology != Topology::kBundle) continue;
          for (const MeshContact& contact : contacts) {
            expectRight(coneOf(fibers, static_cast<std::size_t>(contact.segment)),
                        gaps.triangles()[static_cast<std::size_t>(contact.triangle)], contact);
          }
        }
      }
    }
  }
  EXPECT_GT(found, 2000u);
  EXPECT_GT(spared, 200u);
}

// What is inside would be lost, or what is beside be taken for it.
TYPED_TEST(ConeMeshes, SolidsAreTouchedAndLeftByTheWholeCone) {
  using S = TypeParam;
  const auto fibers = taperedFibers<S>(173, 40);
  const auto triangles = ball<S>(0.3, 6, 9);
  TriangleMesh solid(triangles.view(), TriangleMesh::Kind::kSolid);
  for (const MeshPose& pose : poses()) {
    solid.setPose(pose);
    const Gaps<S> gaps(fibers, triangles, pose);
    // The ball is star-shaped: from a point inside, the way to the middle meets no triangle.
    const auto isInside = [&, middle = toPoint(pose.position)](const Point& x) {
      return std::none_of(
          gaps.triangles().begin(), gaps.triangles().end(),
          [&](const ExactTriangle& t) { return segmentTriangleDistance(x, middle, t) <= 0; });
    };
    std::set<std::int32_t> expected;
    for (std::size_t row = 0; row < gaps.segments().size(); ++row) {
      const Real least = gaps.leastOfRow(row);
      // Without radii the axis alone may cross.
      const bool touches = least < 1e-17L;
      ASSERT_TRUE(touches || least > kRounding);
      if (touches || isInside(gaps.cone(row).a)) expected.insert(gaps.segments()[row]);
    }
    for (const FiberTreeOptions& options : allKinds(Report::kCapsules)) {
      std::vector<std::int32_t> found;
      treeOf(fibers, options).find(TouchingSegments{}, solid, found);
      EXPECT_THAT(found, testing::UnorderedElementsAreArray(expected));
    }
    std::vector<MeshContact> contacts;
    treeOf(fibers).find(Contacts{fibers.view()}, solid, contacts);
    int inside = 0, crossing = 0;
    for (const MeshContact& contact : contacts) {
      const Cone cone = coneOf(fibers, static_cast<std::size_t>(contact.segment));
      const ExactTriangle& t = gaps.triangles()[static_cast<std::size_t>(contact.triangle)];
      const bool crosses = segmentTriangleDistance(cone.a, cone.b, t) < 1e-17L;
      const bool is_inside = crosses || isInside(cone.at(contact.s));
      ASSERT_EQ(contact.solid, is_inside);
      if (!is_inside) {
        EXPECT_LE(std::fabs(contact.distance - distanceOf(cone, t)), 1e-14L);
        continue;
      }
      ++(crosses ? crossing : inside);
      const Point outward = normalOf(t).normalized();
      EXPECT_LE((outward + toPoint(contact.normal)).norm(), 1e-12L);
      const Real depth =
          std::max(cone.at_a - outward.dot(cone.a - t.a), cone.at_b - outward.dot(cone.b - t.a));
      // Beside the triangle its plane may be further out than the ball of the contact.
      EXPECT_LE(std::fabs(contact.distance + std::max(depth, cone.radiusAt(contact.s))), 1e-14L);
    }
    EXPECT_GT(std::min(inside, crossing), 10);
  }
}

// A solver would be told a triangle that is further away than another.
TYPED_TEST(ConeMeshes, TheNearestTriangleIsThatOfTheSurface) {
  using S = TypeParam;
  const auto fibers = taperedFibers<S>(174, 10);
  const auto triangles = soup<S>(175, 60, 0.4);
  TriangleMesh mesh(triangles.view());
  for (const MeshPose& pose : poses()) {
    mesh.setPose(pose);
    const Gaps<S> gaps(fibers, triangles, pose);
    std::vector<Real> least;
    for (std::size_t row = 0; row < gaps.segments().size(); ++row) {
      least.push_back(gaps.leastOfRow(row));
    }
    for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
      const FiberTree tree = treeOf(fibers, options);
      for (const double distance : {0.0, 0.05, kInfinity}) {
        std::vector<TrianglePair> pairs;
        tree.find(Nearest{distance}, mesh, pairs);
        std::vector<std::int32_t> triangle_of(fibers.pointCount(), -1);
        for (const TrianglePair& pair : pairs) {
          triangle_of[static_cast<std::size_t>(pair.segment)] = pair.triangle;
        }
        for (std::size_t row = 0; row < gaps.segments().size(); ++row) {
          const auto found = triangle_of[static_cast<std::size_t>(gaps.segments()[row])];
          ASSERT_EQ(found >= 0, least[row] <= distance) << row;
          if (found < 0) continue;
          ASSERT_LE(gaps.gap(row, static_cast<std::size_t>(found)), least[row] + kRounding);
        }
      }
    }
  }
}

TYPED_TEST(ConeMeshes, TheClosestIsTheLeastOfAllPairs) {
  using S = TypeParam;
  const auto fibers = taperedFibers<S>(176, 8);
  const auto triangles = ball<S>(0.2, 6, 8);
  TriangleMesh mesh(triangles.view());
  for (const double away : {0.0, 0.8, 3.0}) {
    MeshPose pose = randomPose(177, 0);
    pose.position = {away, away, -away};
    mesh.setPose(pose);
    const Gaps<S> gaps(fibers, triangles, pose);
    Real least = kInfinity;
    for (std::size_t row = 0; row < gaps.segments().size(); ++row) {
      least = std::min(least, gaps.leastOfRow(row));
    }
    for (const FiberTreeOptions& options : allKinds(Report::kCapsules)) {
      const MeshContact found = treeOf(fibers, options).closest(Contacts{fibers.view()}, mesh);
      if (away == 0) {
        EXPECT_LE(found.distance, least + kRounding) << "it crosses";
      } else {
        EXPECT_LE(std::fabs(found.distance - least), kRounding) << away;
      }
    }
  }
}

std::vector<double> numbersOf(const MeshContact& c) {
  std::vector<double> numbers = {double(c.segment), double(c.triangle), c.s, c.distance};
  for (const auto& three : {c.weights, c.point_a, c.point_b, c.normal}) {
    numbers.insert(numbers.end(), three.begin(), three.end());
  }
  return numbers;
}

/// All that a tree tells about a mesh of the segments before `end`.
template <typename S>
std::vector<std::vector<double>> answersOf(const Assembly<S>& fibers, const TriangleMesh& mesh,
                                           std::int32_t end) {
  std::vector<std::vector<double>> rows;
  FiberTreeOptions options = FiberOptions{Topology::kBundle, Report::kCapsules};
  options.margin = 0.01;
  const FiberTree tree = treeOf(fibers, options);
  std::vector<MeshContact> contacts;
  tree.find(Contacts{fibers.view()}, mesh, contacts);
  std::vector<TrianglePair> nearest;
  tree.find(Nearest{kInfinity}, mesh, nearest);
  for (const MeshContact& c : contacts) {
    if (c.segment < end) rows.push_back(numbersOf(c));
  }
  for (const TrianglePair& pair : nearest) {
    if (pair.segment >= end) continue;
    rows.push_back({double(pair.segment), double(pair.triangle)});
    rows.push_back(numbersOf(meshContact(fibers.view(), mesh, pair)));
  }
  std::sort(rows.begin(), rows.end());
  return rows;
}

// Whoever gives a radius at each point would have other answers where it is the same at both ends.
TYPED_TEST(ConeMeshes, EqualRadiiGiveTheAnswersOfCapsulesToTheBit) {
  using S = TypeParam;
  constexpr auto kPerPoint = FiberArrays<S>::Radii::kPerPoint;
  const auto capsules = curledFibers<S>(178, 40);
  auto cones = capsules, mixed = capsules;
  cones.radii_are = mixed.radii_are = kPerPoint;
  // The fibers of curledFibers() have one radius each, and the last one tapers.
  const std::size_t last = mixed.point_begin[mixed.fiberCount() - 1];
  for (std::size_t i = last; i < mixed.pointCount(); i += 2) mixed.radii[i] *= S(0.5);
  for (const auto kind : {TriangleMesh::Kind::kSurface, TriangleMesh::Kind::kSolid}) {
    TriangleMesh mesh(ball<S>(0.3, 8, 12).view(), kind);
    for (const MeshPose& pose : poses()) {
      mesh.setPose(pose);
      const auto end = static_cast<std::int32_t>(last);
      const auto expected = answersOf(capsules, mesh, end);
      EXPECT_GT(expected.size(), 500u);
      EXPECT_EQ(answersOf(cones, mesh, end), expected);
      EXPECT_EQ(answersOf(mixed, mesh, end), expected);
    }
  }
}

// A list would go on without a pair that touches, or a step that is told to be safe touch.
TYPED_TEST(ConeMeshes, LiveListsFollowTheCones) {
  using S = TypeParam;
  auto fibers = taperedFibers<S>(179, 12);
  const auto triangles = ball<S>(0.3, 6, 9);
  const TriangleMesh mesh(triangles.view());
  FiberTree tree = treeOf(fibers);
  LivePairs<TriangleMesh> live(tree, mesh, {/*skin=*/0.05});
  Random random(180);
  int bounded = 0;
  for (int step = 0; step < 6; ++step) {
    for (S& x : fibers.points) x += static_cast<S>(0.004 * random.between(-1, 1));
    for (S& r : fibers.radii) r += static_cast<S>(0.001 * random.unit());
    tree.update(fibers.view());
    live.update();
    std::vector<TrianglePair> pairs;
    live.find(pairs);
    std::set<std::pair<std::int32_t, std::int32_t>> found;
    for (const TrianglePair& pair : pairs) found.emplace(pair.segment, pair.triangle);
    EXPECT_EQ(found, pairsOf(treeOf(fibers), mesh));
    std::vector<double> distances;
    live.safeDistances(distances);
    const Gaps<S> gaps(fibers, triangles, {});
    for (std::size_t row = 0; row < gaps.segments().size(); ++row) {
      const auto point = static_cast<std::size_t>(gaps.segments()[row]);
      const double safe = std::min(distances[point], distances[point + 1]);
      const Real least = gaps.leastOfRow(row);
      EXPECT_LE(safe, std::max(least, Real(0)) + 1e-15L) << row;
      bounded += least < live.skin() / 4 && safe > 0.9 * least;
    }
  }
  EXPECT_GT(bounded, 20);
}

// The numbers of contact.h by hand.
TEST(ConeMeshesTest, DepthsAreThoseByHand) {
  const auto box = boxMesh({0, 0, 0}, {4, 4, 4});
  const auto deepest = [&](const Assembly<double>& fibers, TriangleMesh::Kind kind) {
    const TriangleMesh mesh(box.view(), kind);
    std::vector<MeshContact> contacts;
    treeOf(fibers).find(Contacts{fibers.view()}, mesh, contacts);
    EXPECT_FALSE(contacts.empty());
    return *std::min_element(contacts.begin(), contacts.end(),
                             [](const auto& p, const auto& q) { return p.distance < q.distance; });
  };
  const auto cone = [](double low, double at_low, double high, double at_high) {
    Assembly<double> fibers;
    fibers.radii_are = FiberArrays<double>::Radii::kPerPoint;
    fibers.addPoint({1.5, 1.25, low}, at_low);
    fibers.addPoint({1.5, 1.25, high}, at_high);
    fibers.endFiber();
    return fibers;
  };
  const auto up = TriangleMesh::Kind::kSurface, solid = TriangleMesh::Kind::kSolid;
  // Through the top, 1 below it and 0.5 above; both ends have a say by their radii.
  EXPECT_EQ(deepest(cone(3, 0.125, 4.5, 0.25), up).distance, -0.75);
  EXPECT_EQ(deepest(cone(3, 0.125, 4.5, 0.75), up).distance, -1.125) << "up is the shorter way";
  EXPECT_EQ(deepest(cone(3, 0.125, 4.5, 0.75), up).normal[2], -1);
  EXPECT_EQ(deepest(cone(3, 0.125, 4.5, 0.25), solid).distance, -1.125) << "out is up";
  EXPECT_EQ(deepest(cone(3, 0.25, 4.5, 2), solid).distance, -1.5) << "the thick end is";
  EXPECT_EQ(deepest(cone(3.5, 0, 3.75, 0.5), solid).distance, -0.75) << "inside";
  EXPECT_EQ(deepest(cone(3.5, 0, 3.75, 0.125), solid).distance, -0.5) << "the thin end is deeper";
}

}  // namespace
}  // namespace fcl_fibers::test::cone_meshes
