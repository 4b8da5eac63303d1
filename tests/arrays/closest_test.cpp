// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/array_fibers.h"
#include "arrays/meshes.h"
#include "support/exact_geometry.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// 64 eps of lengths that add up to less than 8, as contact.h bounds them.
constexpr Real kContactError = 64 * 8 * 0x1p-52L;

FiberTreeOptions capsuleOptions(int ignored_neighbors = 1) {
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = ignored_neighbors;
  return options;
}

template <typename S>
FiberTree capsulesOf(const FiberArrays<S>& fibers, FiberTreeOptions options = capsuleOptions()) {
  options.report = Report::kCapsules;
  FiberTree tree(options);
  tree.build(fibers);
  return tree;
}

template <typename S>
Assembly<S> movedBy(Assembly<S> fibers, const Eigen::Vector3d& offset) {
  for (std::size_t i = 0; i < fibers.points.size(); ++i) {
    fibers.points[i] = static_cast<S>(fibers.points[i] + offset[static_cast<Eigen::Index>(i % 3)]);
  }
  return fibers;
}

template <typename S>
Assembly<S> withRadii(Assembly<S> fibers, double times) {
  for (S& radius : fibers.radii) radius = static_cast<S>(times * radius);
  return fibers;
}

/// The distance of the surfaces of two capsules, with an error far below kContactError.
Real exactDistance(const GivenCapsule& p, const GivenCapsule& q) {
  const ExactCapsule a = roundedCapsule(p), b = roundedCapsule(q);
  return segmentDistance(a.a, a.b, b.a, b.b) - a.radius - b.radius;
}

/// Calls visit(segment, other segment) for all pairs that count: of one assembly each once, or from
/// both sides.
template <typename S, class Visit>
void forPairs(const Assembly<S>& a, const Assembly<S>& b, int ignored, bool from_both_sides,
              Visit&& visit) {
  a.visitCapsules([&](std::size_t p_fiber, std::size_t p) {
    b.visitCapsules([&](std::size_t q_fiber, std::size_t q) {
      if (&a == &b) {
        if (p == q || (!from_both_sides && q < p)) return;
        const std::size_t apart = std::max(p, q) - std::min(p, q);
        if (p_fiber == q_fiber && apart <= static_cast<std::size_t>(ignored)) return;
      }
      visit(static_cast<std::int32_t>(p), static_cast<std::int32_t>(q));
    });
  });
}

template <typename S>
Real exactDistance(const Assembly<S>& a, const Assembly<S>& b, std::int32_t p, std::int32_t q) {
  return exactDistance(a.capsule(static_cast<std::size_t>(p)),
                       b.capsule(static_cast<std::size_t>(q)));
}

struct Least {
  Real exact = kInfinity;
  double computed = kInfinity;  ///< by capsuleContact()
  SegmentPair pair{-1, -1};     ///< the first of those
};

template <typename S>
Least leastOf(const Assembly<S>& a, const Assembly<S>& b, int ignored) {
  Least least;
  forPairs(a, b, ignored, false, [&](std::int32_t p, std::int32_t q) {
    least.exact = std::min(least.exact, exactDistance(a, b, p, q));
    const double distance = capsuleContact(a.view(), b.view(), {p, q}).distance;
    if (std::tie(distance, p, q) < std::tie(least.computed, least.pair.a, least.pair.b) ||
        least.pair.a < 0) {
      least.computed = distance;
      least.pair = {p, q};
    }
  });
  return least;
}

void expectIs(const Contact& contact, const Least& least) {
  ASSERT_EQ(std::tie(contact.pair.a, contact.pair.b), std::tie(least.pair.a, least.pair.b));
  EXPECT_EQ(contact.distance, least.computed);
  if (least.pair.a >= 0) {
    EXPECT_LE(std::fabs(contact.distance - least.exact), kContactError);
  }
}

template <typename S>
class Closest : public testing::Test {};
TYPED_TEST_SUITE(Closest, Scalars, ScalarName);

TYPED_TEST(Closest, IsTheLeastOfAllPairsOfTwoTrees) {
  using S = TypeParam;
  const double far = std::is_same_v<S, float> ? 1e3 : 1e9;
  // Overlapping deeply, touching a little, apart by less than a radius, and by much.
  const std::tuple<double, double, double> scenes[] = {{0.0, 3, 0}, {0.0, 0.1, 0}, {0.0, 1e-3, far},
                                                       {1.7, 1, 0}, {40, 1, 0},    {1.7, 0, far}};
  bool touches = false, is_apart = false;
  for (const auto& [away, thick, offset] : scenes) {
    const Eigen::Vector3d origin(offset, -offset, offset / 3);
    const auto a = movedBy(withRadii(curledFibers<S>(301, 14), thick), origin);
    const auto b = movedBy(withRadii(curledFibers<S>(302, 11), thick),
                           origin + away * Eigen::Vector3d(1, 0.5, 0.2));
    const auto b_view = b.view();
    const Least least = leastOf(a, b, 0);
    (least.exact < 0 ? touches : is_apart) = true;
    for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
      for (const double margin : {0.0, 0.3}) {
        for (const int threads : {1, 4}) {
          options.margin = margin;
          options.threads = threads;
          expectIs(capsulesOf(a.view(), options)
                       .closest(Contacts{a.view(), &b_view}, capsulesOf(b.view(), options)),
                   least);
        }
      }
    }
  }
  EXPECT_TRUE(touches && is_apart);
}

TYPED_TEST(Closest, OfOneTreeLeavesNeighborsOut) {
  using S = TypeParam;
  bool touches = false, is_apart = false;
  for (const double thick : {1.0, 1e-4}) {
    const auto fibers = withRadii(curledFibers<S>(303, 14), thick);
    for (const int ignored : {0, 1, 3}) {
      const Least least = leastOf(fibers, fibers, ignored);
      (least.exact < 0 ? touches : is_apart) = true;
      for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
        options.ignored_neighbors = ignored;
        for (const int threads : {1, 4}) {
          options.threads = threads;
          expectIs(capsulesOf(fibers.view(), options).closest(Contacts{fibers.view()}), least);
        }
      }
    }
  }
  EXPECT_TRUE(touches && is_apart);
}

/// Balls on the corners of a grid, `size` apart, about an offset; all numbers are exact.
template <typename S>
Assembly<S> gridOfBalls(int count, double size, double radius, double offset) {
  Assembly<S> balls;
  for (int i = 0; i < count * count * count; ++i) {
    const int x = i % count, y = i / count % count, z = i / count / count;
    balls.addBall({offset + size * x, offset + size * y, offset + size * z}, radius);
  }
  return balls;
}

// Which of several pairs that are equally near is the answer would depend on the tree.
TYPED_TEST(Closest, IsThatOfTheLeastNamesIfSeveralAreEquallyNear) {
  using S = TypeParam;
  for (const double radius : {0.0, 0.125, 0.5, 0.75}) {
    for (const double offset : {0.0, 4096.0}) {
      const auto grid = gridOfBalls<S>(5, 1, radius, offset);
      const auto between = gridOfBalls<S>(4, 1, radius, offset + 0.5);
      const auto grid_view = grid.view();
      for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
        for (const int threads : {1, 4}) {
          options.threads = threads;
          options.margin = radius == 0 ? 0.25 : 0;
          const FiberTree tree = capsulesOf(grid.view(), options);
          const FiberTree other = capsulesOf(between.view(), options);
          const Contact own = tree.closest(Contacts{grid.view()});
          EXPECT_EQ(std::tuple(own.pair.a, own.pair.b, own.distance),
                    std::tuple(0, 2, 1 - 2 * radius));
          const Contact two = other.closest(Contacts{between.view(), &grid_view}, tree);
          EXPECT_EQ(std::tuple(two.pair.a, two.pair.b), std::tuple(0, 0));
          // Each ball in between has eight that are equally near, of which the first is the least.
          std::vector<SegmentPair> pairs;
          other.find(Nearest{1}, tree, pairs);
          ASSERT_EQ(pairs.size(), 64u);
          for (const SegmentPair& pair : pairs) {
            const int i = pair.a / 2, x = i % 4, y = i / 4 % 4, z = i / 16;
            EXPECT_EQ(pair.b, 2 * (x + 5 * y + 25 * z)) << pair.a;
          }
        }
      }
    }
  }
}

/// Groups that leave out all pairs.
FiberTree groupedTree(const Assembly<double>& fibers) {
  static const std::vector<std::int32_t> kOneGroup(1000, 1);
  FiberArrays<double> arrays = fibers.view();
  arrays.groups = kOneGroup.data();
  return capsulesOf(arrays);
}

void expectNone(const Contact& contact) {
  EXPECT_EQ(contact.distance, kInfinity);
  EXPECT_EQ(std::tie(contact.pair.a, contact.pair.b), std::tuple(-1, -1));
  EXPECT_EQ(contact.a.fiber, kNoFiber);
  EXPECT_EQ(contact.b.fiber, kNoFiber);
}

// A program would slow down for nothing, or read a segment that there is not.
TEST(Closest, OfNoPairIsInfinitelyFar) {
  const auto fibers = curledFibers<double>(304, 6);
  const auto view = fibers.view();
  const std::size_t begin[] = {0};
  FiberArrays<double> none;
  none.point_begin = begin;
  Assembly<double> one;
  one.addCapsule({0, 0, 0}, {1, 0, 0}, 0.1);
  const FiberTree empty(capsuleOptions()), built = capsulesOf(none),
                                           tree = capsulesOf(fibers.view());
  expectNone(empty.closest(Contacts{none}));
  expectNone(built.closest(Contacts{none}));
  expectNone(built.closest(Contacts{none, &view}, tree));
  expectNone(tree.closest(Contacts{fibers.view(), &none}, built));
  expectNone(tree.closest(Contacts{fibers.view(), &none}, empty));
  expectNone(capsulesOf(one.view()).closest(Contacts{one.view()}));
  expectNone(groupedTree(fibers).closest(Contacts{fibers.view()}));
  EXPECT_LT(groupedTree(fibers).closest(Contacts{view, &view}, tree).distance, 0);
  const TriangleMesh nothing(MeshArrays<double>{}), mesh(ball<double>(0.3, 6, 8).view());
  for (const MeshContact& contact :
       {tree.closest(Contacts{fibers.view()}, nothing), built.closest(Contacts{none}, mesh)}) {
    EXPECT_EQ(contact.distance, kInfinity);
    EXPECT_EQ(contact.segment, -1);
    EXPECT_EQ(contact.triangle, -1);
    EXPECT_EQ(contact.place.fiber, kNoFiber);
  }
  std::vector<SegmentPair> pairs(3);
  built.find(Nearest{kInfinity}, tree, pairs);
  EXPECT_TRUE(pairs.empty());
  pairs.resize(3);
  tree.find(Nearest{kInfinity}, built, pairs);
  EXPECT_TRUE(pairs.empty());
  pairs.resize(3);
  groupedTree(fibers).find(Nearest{kInfinity}, pairs);
  EXPECT_TRUE(pairs.empty());
}

TYPED_TEST(Closest, NearestOfEachSegmentIsThatOfTheLeastDistance) {
  using S = TypeParam;
  const double far = std::is_same_v<S, float> ? 1e3 : 1e6;
  for (const auto& [away, offset] :
       {std::pair(0.0, 0.0), std::pair(0.0, far), std::pair(1.1, 0.0), std::pair(30.0, far)}) {
    const auto a = movedBy(curledFibers<S>(305, 8), Eigen::Vector3d::Constant(offset));
    const auto other = movedBy(curledFibers<S>(306, 6), Eigen::Vector3d::Constant(offset + away));
    // The frame's rounding comes on top, which is that of the extent.
    const Real rounding = kContactError + 0x1p-45L * (1 + away);
    for (const bool is_own : {false, true}) {
      const auto& b = is_own ? a : other;
      const int ignored = offset == 0 ? 0 : 2;
      std::map<std::int32_t, Real> least;
      std::map<std::pair<std::int32_t, std::int32_t>, Real> distances;
      forPairs(a, b, ignored, true, [&](std::int32_t p, std::int32_t q) {
        const Real distance = exactDistance(a, b, p, q);
        distances[{p, q}] = distance;
        const auto [place, is_new] = least.emplace(p, distance);
        if (!is_new) place->second = std::min(place->second, distance);
      });
      for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
        options.ignored_neighbors = ignored;
        options.margin = 0.5;  // it does not count
        std::vector<SegmentPair> before;
        for (const int threads : {1, 4}) {
          options.threads = threads;
          const FiberTree tree = capsulesOf(a.view(), options),
                          second = capsulesOf(b.view(), options);
          for (const double distance : {0.0, 0.05, away * 1.7, kInfinity}) {
            std::vector<SegmentPair> pairs;
            tree.find(Nearest{distance}, is_own ? tree : second, pairs);
            std::set<std::int32_t> found;
            for (const SegmentPair& pair : pairs) {
              EXPECT_TRUE(found.insert(pair.a).second) << "twice";
              ASSERT_EQ(least.count(pair.a), 1u);
              ASSERT_EQ(distances.count({pair.a, pair.b}), 1u) << "it does not count";
              ASSERT_LE((distances[{pair.a, pair.b}]), least[pair.a] + rounding);
              ASSERT_LE(least[pair.a], distance + rounding);
            }
            for (const auto& [segment, exact] : least) {
              if (exact <= distance) {
                ASSERT_EQ(found.count(segment), 1u) << segment;
              }
            }
            if (distance == kInfinity && threads == 1) before = pairs;
            if (distance != kInfinity || threads == 1) continue;
            EXPECT_TRUE(std::equal(pairs.begin(), pairs.end(), before.begin(), before.end(),
                                   [](const SegmentPair& p, const SegmentPair& q) {
                                     return std::tie(p.a, p.b) == std::tie(q.a, q.b);
                                   }));
          }
        }
      }
    }
  }
}

/// The contact of least distance with a mesh: of all pairs or, if some touch, of the ways of the
/// segments that do. That of a segment in a solid is the shortest of its ways out or, if it touches
/// no triangle, that at the nearest one.
template <typename S>
MeshContact leastOf(const Assembly<S>& fibers, const TriangleMesh& mesh, const Triangles<S>& shape,
                    const MeshPose& pose) {
  // The rounding of the pose comes on top.
  const Real error = kContactError + 16 * 0x1p-52L * pose.position[0];
  MeshContact apart, touching;
  apart.distance = touching.distance = kInfinity;
  fibers.visitCapsules([&](std::size_t, std::size_t i) {
    const ExactCapsule capsule = roundedCapsule(fibers.capsule(i));
    MeshContact nearest, way;
    way.distance = kInfinity;
    Real least = kInfinity;
    const auto keep = [](MeshContact& best, const MeshContact& contact) {
      if (std::tie(contact.distance, contact.segment, contact.triangle) <
          std::tie(best.distance, best.segment, best.triangle)) {
        best = contact;
      }
    };
    for (std::size_t t = 0; t < shape.count(); ++t) {
      const TrianglePair pair{static_cast<std::int32_t>(i), static_cast<std::int32_t>(t)};
      const MeshContact contact = meshContact(fibers.view(), mesh, pair);
      const Real gap = segmentTriangleDistance(capsule.a, capsule.b, shape.triangle(t, pose));
      if (gap <= capsule.radius) {
        const bool is_better =
            contact.solid ? contact.distance > way.distance : contact.distance < way.distance;
        if (contact.solid != way.solid ? contact.solid : is_better) way = contact;
      }
      if (!contact.solid) {
        EXPECT_LE(std::fabs(contact.distance - (gap - capsule.radius)), gap > 0 ? error : 1);
        keep(apart, contact);
      }
      if (gap < least) {
        least = gap;
        nearest = contact;
      }
    }
    if (way.segment < 0 && nearest.solid) way = nearest;
    keep(touching, way);
  });
  return touching.segment >= 0 ? touching : apart;
}

TYPED_TEST(Closest, OfAMeshIsTheLeastOfAllPairs) {
  using S = TypeParam;
  const auto shape = ball<S>(0.2, 8, 10);
  int insides = 0, touching = 0, apart = 0;
  for (const auto kind : {TriangleMesh::Kind::kSurface, TriangleMesh::Kind::kSolid}) {
    TriangleMesh mesh(shape.view(), kind);
    for (const double away : {0.0, 0.62, 0.9, 3.0, 1e3}) {
      for (const std::uint64_t turn : {0u, 7u}) {
        MeshPose pose = turn == 0 ? MeshPose() : randomPose(turn, 0);
        pose.position = {away, away, -away};
        mesh.setPose(pose);
        const auto fibers = curledFibers<S>(307, 8);
        const MeshContact least = leastOf(fibers, mesh, shape, pose);
        ++(least.solid ? insides : least.distance < 0 ? touching : apart);
        for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
          for (const int threads : {1, 4}) {
            options.threads = threads;
            options.margin = threads == 1 ? 0 : 0.2;  // it does not count
            const MeshContact found =
                capsulesOf(fibers.view(), options).closest(Contacts{fibers.view()}, mesh);
            ASSERT_EQ(std::tie(found.segment, found.triangle, found.distance),
                      std::tie(least.segment, least.triangle, least.distance))
                << away;
          }
        }
      }
    }
  }
  EXPECT_GT(insides, 0);
  EXPECT_GT(touching, 0);
  EXPECT_GT(apart, 0);
}

// A body would be told to go the longest of its ways out, as if it were the depth.
TEST(Closest, OfASolidIsTheLeastWayOutOfTheDeepestSegment) {
  const Triangles<double> cube = boxMesh({0, 0, 0}, {1, 1, 1});
  const TriangleMesh solid(cube.view(), TriangleMesh::Kind::kSolid);
  Assembly<double> fibers;
  // It leaves through x = 1. There the way out is 0.8, and 0.18 at y = 0.
  fibers.addFiber({{0.3, 0.08, 0.5}, {1.05, 0.08, 0.5}}, 0.1);
  const auto closest = [&] {
    return capsulesOf(fibers.view()).closest(Contacts{fibers.view()}, solid);
  };
  EXPECT_NEAR(closest().distance, -0.18, 1e-14);
  EXPECT_NEAR(closest().normal[1], 1, 1e-14);
  // The axis of this one is outside of the solid.
  fibers.addFiber({{0.2, 1.05, 0.5}, {0.4, 1.05, 0.5}}, 0.1);
  EXPECT_EQ(closest().place.fiber, 0u);
  // The way out of this one is longer than the first one's.
  fibers.addFiber({{0.3, 0.5, 0.8}, {1.05, 0.5, 0.8}}, 0.25);
  EXPECT_EQ(closest().place.fiber, 2u);
  EXPECT_NEAR(closest().distance, -0.45, 1e-14);
}

// Where the lengths of one tree overflow in the unit of the other, there would be a wrong answer.
TEST(Closest, IsRightWhateverTheSizes) {
  const auto sized = [](const Assembly<double>& from, double size, double away) {
    Assembly<double> fibers = from;
    for (double& x : fibers.points) x = size * (x + away);
    for (double& radius : fibers.radii) radius *= size;
    return fibers;
  };
  int refused = 0;
  for (const double own : {1e-300, 1e-140, 1e-3, 1.0, 1e100, 1e290}) {
    const auto a = sized(curledFibers<double>(308, 4), own, 0);
    for (const double its : {1e-300, 1e-20, 1.0, 1e140, 1e290}) {
      const auto b = sized(curledFibers<double>(309, 4), its, 20);
      const auto b_view = b.view();
      double least = kInfinity;
      forPairs(a, b, 0, false, [&](std::int32_t p, std::int32_t q) {
        least = std::min(least, capsuleContact(a.view(), b.view(), {p, q}).distance);
      });
      for (const FiberTreeOptions& options : allKinds(Report::kCapsules)) {
        const FiberTree tree = capsulesOf(a.view(), options), other = capsulesOf(b.view(), options);
        std::vector<SegmentPair> pairs;
        double distance = 0;
        const auto search = [&] {
          tree.find(Nearest{kInfinity}, other, pairs);
          distance = tree.closest(Contacts{a.view(), &b_view}, other).distance;
        };
        try {
          search();
        } catch (const std::invalid_argument& error) {
          EXPECT_THAT(error.what(), HasSubstr("overflow"));
          EXPECT_GT(std::max(own / its, its / own), 1e285) << own << " " << its;
          ++refused;
          continue;
        }
        ASSERT_EQ(pairs.size(), tree.segmentCount());
        EXPECT_EQ(distance, least) << own << " " << its;
      }
    }
  }
  EXPECT_GT(refused, 0);
}

// There would be distances of boxes, or of other fibers.
TEST(Closest, IsRefusedWithoutCapsulesAndOfOtherArrays) {
  const auto fibers = curledFibers<double>(310, 6);
  const FiberTree tree = capsulesOf(fibers.view());
  FiberTreeOptions options = capsuleOptions();
  options.report = Report::kVolumes;
  FiberTree volumes(options);
  volumes.build(fibers.view());
  const TriangleMesh mesh(ball<double>(0.3, 6, 8).view());
  const auto view = fibers.view();
  const Contacts<double> both{view, &view};
  std::vector<SegmentPair> pairs(3);
  const auto refusal = ThrowsMessage<std::invalid_argument>(HasSubstr("keeps no capsules"));
  EXPECT_THAT([&] { volumes.closest(both); }, refusal);
  EXPECT_THAT([&] { volumes.closest(both, tree); }, refusal);
  EXPECT_THAT([&] { tree.closest(both, volumes); }, refusal);
  EXPECT_THAT([&] { volumes.closest(both, mesh); }, refusal);
  EXPECT_THAT([&] { volumes.find(Nearest{1}, tree, pairs); }, refusal);
  EXPECT_THAT([&] { tree.find(Nearest{1}, volumes, pairs); }, refusal);
  for (const double bad : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THAT(
        [&] { tree.find(Nearest{bad}, pairs); },
        ThrowsMessage<std::invalid_argument>(HasSubstr("FiberTree::find(Nearest): distance is")));
  }
  EXPECT_EQ(pairs.size(), 3u);
  const auto others = curledFibers<double>(311, 5);
  EXPECT_THAT([&] { tree.closest(Contacts{others.view()}); },
              ThrowsMessage<std::invalid_argument>(
                  HasSubstr("FiberTree::closest: the fibers have other numbers of points")));
  EXPECT_THAT([&] { tree.closest(Contacts{fibers.view()}, capsulesOf(others.view())); },
              ThrowsMessage<std::invalid_argument>(
                  HasSubstr("FiberTree::closest: give Contacts the fibers of the other tree too")));
}

// Points are fibers without length.
TYPED_TEST(Closest, OfPointsAreTheNearestSegmentsAndThoseThatHoldThem) {
  using S = TypeParam;
  const auto fibers = withRadii(curledFibers<S>(312, 20), 3);
  Random random(313);
  Assembly<S> points;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d p = random.inCube(0.6);
    points.addBall({p.x(), p.y(), p.z()}, 0);
  }
  for (const double margin : {0.0, 0.02}) {
    FiberTreeOptions options = capsuleOptions();
    options.margin = margin;
    options.threads = 4;
    const FiberTree tree = capsulesOf(fibers.view(), options),
                    cloud = capsulesOf(points.view(), options);
    EXPECT_EQ(pairsOf(cloud, tree), touchingPairs(points, fibers, 0, margin));
    EXPECT_GT(pairsOf(cloud, tree).size(), 100u);
    std::vector<SegmentPair> pairs;
    cloud.find(Nearest{kInfinity}, tree, pairs);
    ASSERT_EQ(pairs.size(), 300u);
    for (const SegmentPair& pair : pairs) {
      Real least = kInfinity;
      fibers.visitCapsules([&](std::size_t, std::size_t i) {
        least =
            std::min(least, exactDistance(points, fibers, pair.a, static_cast<std::int32_t>(i)));
      });
      EXPECT_LE(exactDistance(points, fibers, pair.a, pair.b), least + kContactError);
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::test
