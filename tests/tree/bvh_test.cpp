// SPDX-License-Identifier: BSD-3-Clause
#include "tree/bvh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include "geometry/enclosing_sphere.h"
#include "support/overlap.h"
#include "support/random.h"
#include "support/segments.h"
#include "support/tree_segments.h"
#include "tree/found_pairs.h"
#include "tree/search.h"
#include "tree/search_scenes.h"

namespace fcl_fibers::tree {
namespace {

using geometry::Ball;
using geometry::Box;
using geometry::fromEigen;
using geometry::Segment;
using geometry::Sphere;
using geometry::Vec3d;
using test::ExactBox;
using test::ExactSphere;
using test::Point;
using test::Random;
using test::Real;

// Scenes.

/// Fibers that wander about from a cube of side 2; every third segment number is left out.
FiberScene wanderingFibers(const std::vector<int>& lengths, std::uint64_t seed, double step = 0.1) {
  Random random(seed);
  FiberScene scene;
  for (const int length : lengths) {
    Vec3d p = fromEigen(random.inCube(1));
    for (int i = 0; i < length; ++i) {
      const Vec3d direction = fromEigen(random.direction());
      const Vec3d q = p + step * random.unit() * direction;
      if (scene.segments.size() % 3 == 0) scene.segments.push_back({{99, 99, 99}, {0, 0, 0}, 99});
      scene.fibers.ids.push_back(static_cast<SegmentId>(scene.segments.size()));
      scene.segments.push_back({p, q, 0.3 * step * random.unit()});
      p = q;
    }
    scene.fibers.endFiber();
  }
  return scene;
}
FiberScene mediumScene() { return wanderingFibers({1, 60, 0, 2, 33, 17, 1, 90, 8, 9, 1}, 1); }

void jiggle(Random& random, double by, Segment& segment) {
  segment.a = segment.a + by * fromEigen(random.inCube(1));
  segment.b = segment.b + by * fromEigen(random.inCube(1));
}

/// A motion of all segments: small, large, rigid, a swelling or a shrinking, by turns.
void moveAll(Random& random, int frame, std::vector<Segment>& segments) {
  const Vec3d shift = 3.0 * fromEigen(random.inCube(1));
  for (Segment& segment : segments) {
    switch (frame % 6) {
      case 0:
        jiggle(random, 1e-3, segment);
        break;
      case 1:
        jiggle(random, 0.3, segment);
        break;
      case 2:
        segment = {segment.a + shift, segment.b + shift, segment.radius};
        break;
      case 3:
        segment = {1.5 * segment.a, 1.5 * segment.b, 1.5 * segment.radius};
        break;
      case 4:
        segment = {0.5 * segment.a, 0.5 * segment.b, 0.5 * segment.radius};
        break;
      case 5:
        jiggle(random, 1e-8, segment);
        break;
    }
  }
}

// Volumes, one at a time.

template <class Volume>
bool overlap(const Volume& p, const Volume& q) {
  typename Volume::template Pack<2> pack;
  pack.set(0, p);
  return overlaps(pack, q) != 0;
}

bool contains(const Box& outer, const Box& inner) {
  for (int axis = 0; axis < 3; ++axis) {
    if (!(outer.low[axis] <= inner.low[axis] && inner.high[axis] <= outer.high[axis])) return false;
  }
  return true;
}
bool contains(const Box& box, const Segment& s, double padding) {
  const ExactBox exact = test::boxOf({toPoint(s.a), toPoint(s.b), Real(s.radius) + Real(padding)});
  for (int axis = 0; axis < 3; ++axis) {
    if (!(Real(box.low[axis]) <= exact.min[axis] && exact.max[axis] <= Real(box.high[axis])))
      return false;
  }
  return true;
}
bool contains(const Sphere& sphere, const Segment& s, double padding) {
  const Point center = centerOf(sphere);
  const Real radius = Real(s.radius) + Real(padding);
  return (toPoint(s.a) - center).norm() + radius <= Real(sphere.radius) &&
         (toPoint(s.b) - center).norm() + radius <= Real(sphere.radius);
}
bool contains(const Sphere& sphere, const Ball& ball) {
  return (toPoint(ball.center) - centerOf(sphere)).norm() + Real(ball.radius) <=
         Real(sphere.radius);
}

/// Whether what two segments' volumes are rounded from overlaps.
bool exactlyOverlap(const Segment& p, const Segment& q, const Box*) {
  return test::boxGap(test::boxOf({toPoint(p.a), toPoint(p.b), p.radius}),
                      test::boxOf({toPoint(q.a), toPoint(q.b), q.radius})) <= 0;
}
bool exactlyOverlap(const Segment& p, const Segment& q, const Sphere*) {
  return test::sphereGap(test::sphereOf({toPoint(p.a), toPoint(p.b), p.radius}),
                         test::sphereOf({toPoint(q.a), toPoint(q.b), q.radius})) <= 0;
}

/// The volumes of leaves by segment number.
template <class Tree>
std::vector<typename Tree::Volume> leafVolumes(const Tree& tree) {
  std::vector<typename Tree::Volume> volumes;
  const auto& nodes = tree.nodes();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (int lane = 0; lane < nodes[i].child_count; ++lane) {
      const Link child = nodes[i].children[static_cast<std::size_t>(lane)];
      if (!child.isLeaf()) continue;
      const auto id = static_cast<std::size_t>(child.segment());
      volumes.resize(std::max(volumes.size(), id + 1));
      volumes[id] = tree.pack(static_cast<std::int32_t>(i)).get(lane);
    }
  }
  return volumes;
}

template <int N>
void expectInnerVolumes(const LayeredBoxTree<N>& tree, const std::vector<Segment>&) {
  const auto& nodes = tree.nodes();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto node = static_cast<std::int32_t>(i);
    for (int lane = 0; lane < nodes[i].child_count; ++lane) {
      const Link child = nodes[i].children[static_cast<std::size_t>(lane)];
      if (child.isLeaf()) continue;
      const Box outer = tree.pack(node).get(lane);
      for (int below = 0; below < tree.node(child.node()).child_count; ++below) {
        ASSERT_TRUE(contains(outer, tree.pack(child.node()).get(below)))
            << "node " << i << " lane " << lane;
      }
      const Box least = tree.nodeVolume(child.node());
      ASSERT_TRUE(contains(least, outer)) << "a box is larger than the segments below";
    }
  }
}

template <int N>
void expectInnerVolumes(const WrappedSphereTree<N>& tree, const std::vector<Segment>& segments) {
  const auto& nodes = tree.nodes();
  const auto& balls = tree.hierarchy().leafBalls();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Ball& cage = tree.hierarchy().cage(i).ball;
    Real reach = 0;
    for (auto k = static_cast<std::size_t>(nodes[i].leaf_begin);
         k < static_cast<std::size_t>(nodes[i].leaf_end); ++k) {
      reach = std::max(
          reach, (toPoint(balls[k].center) - toPoint(cage.center)).norm() + Real(balls[k].radius));
    }
    ASSERT_LE(reach, Real(cage.radius)) << "a leaf sticks out of the cage of node " << i;

    const auto node = static_cast<std::int32_t>(i);
    std::int32_t leaf = nodes[i].leaf_begin;
    for (int lane = 0; lane < nodes[i].child_count; ++lane) {
      const Link child = nodes[i].children[static_cast<std::size_t>(lane)];
      const std::int32_t end = child.isLeaf() ? leaf + 1 : tree.node(child.node()).leaf_end;
      for (; leaf < end; ++leaf) {
        const auto k = static_cast<std::size_t>(leaf);
        const Segment& segment = segments[static_cast<std::size_t>(tree.leaves()[k])];
        const Sphere volume = tree.pack(node).get(lane);
        ASSERT_TRUE(contains(volume, balls[k]) && contains(volume, segment, tree.padding()))
            << "leaf " << leaf << " sticks out of lane " << lane << " of node " << i;
      }
    }
  }
}

/// Each segment is in its leaf's volume and in those of all nodes above.
template <class Tree>
void expectContainment(const Tree& tree, const std::vector<Segment>& segments) {
  const auto leaves = leafVolumes(tree);
  for (const SegmentId id : tree.leaves()) {
    const auto i = static_cast<std::size_t>(id);
    ASSERT_TRUE(contains(leaves[i], segments[i], tree.padding())) << "segment " << id;
  }
  expectInnerVolumes(tree, segments);
}

template <int N>
void expectLikeRefit(const LayeredBoxTree<N>& tree, const LayeredBoxTree<N>& other) {
  for (std::size_t i = 0; i < tree.nodes().size(); ++i) {
    const auto node = static_cast<std::int32_t>(i);
    for (int lane = 0; lane < tree.node(node).child_count; ++lane) {
      const Box p = tree.pack(node).get(lane), q = other.pack(node).get(lane);
      ASSERT_TRUE(contains(p, q) && contains(q, p)) << "node " << i << " lane " << lane;
    }
  }
}
template <int N>
void expectLikeRefit(const WrappedSphereTree<N>& tree, const WrappedSphereTree<N>& other) {
  for (std::size_t i = 0; i < tree.nodes().size(); ++i) {
    const double p = tree.hierarchy().cage(i).ball.radius,
                 q = other.hierarchy().cage(i).ball.radius;
    ASSERT_NEAR(p, q, 0x1p-28 * p) << "node " << i;
  }
}

// Queries.

/// Looks for the smallest distance of capsules.
struct Nearest final : NearestVisitor {
  const std::vector<Segment>& a;
  const std::vector<Segment>& b;
  double least = std::numeric_limits<double>::infinity();
  std::size_t visited = 0;

  Nearest(const std::vector<Segment>& first, const std::vector<Segment>& second)
      : a(first), b(second) {}

  double distance(SegmentId i, SegmentId j) const {
    return std::max(0.0, static_cast<double>(capsuleDistance(a[static_cast<std::size_t>(i)],
                                                             b[static_cast<std::size_t>(j)])));
  }
  Visit visit(SegmentId i, SegmentId j, double& limit) override {
    ++visited;
    least = std::min(least, distance(i, j));
    limit = std::min(limit, least);
    return Visit::kContinue;
  }
};

template <class Tree>
class BvhTest : public testing::Test {
 protected:
  using Volume = typename Tree::Volume;

  static Tree build(const FiberScene& scene, double padding = 0) {
    return treeOf<Tree>(scene, padding);
  }
  static bool exactly(const Segment& p, const Segment& q) {
    return exactlyOverlap(p, q, static_cast<const Volume*>(nullptr));
  }
  static const Segment& at(const FiberScene& scene, SegmentId id) {
    return scene.segments[static_cast<std::size_t>(id)];
  }

  /// What overlaps exactly is found, and nothing whose leaf volumes do not overlap. Boxes that
  /// overlap by their rounding alone are found as well; such spheres need not be, as the rounding
  /// may stick out of the node above.
  static void expectRight(bool found, bool overlapping, bool exactly_overlapping) {
    ASSERT_TRUE(overlapping || !exactly_overlapping);
    if (exactly_overlapping || (std::is_same_v<Volume, Box> && overlapping)) {
      ASSERT_TRUE(found) << "missing";
    }
    ASSERT_TRUE(overlapping || !found) << "extra";
  }

  /// Pairs come once, and are right.
  static void expectPairsOfLeafVolumes(const Tree& tree, const FiberScene& scene,
                                       std::size_t least) {
    const PairList pairs = asSet(pairsFound<Tree>(tree), false);
    ASSERT_FALSE(hasDuplicates(pairs)) << "one comes twice";
    for (const auto& [a, b] : pairs) ASSERT_NE(a, b) << "a segment is paired with itself";
    ASSERT_GE(pairs.size(), least);

    const auto volumes = leafVolumes(tree);
    SegmentIds ids = scene.fibers.ids;
    std::sort(ids.begin(), ids.end());
    for (auto i = ids.begin(); i != ids.end(); ++i) {
      for (auto j = i + 1; j != ids.end(); ++j) {
        const bool found = std::binary_search(pairs.begin(), pairs.end(), std::pair(*i, *j));
        const bool overlapping =
            overlap(volumes[static_cast<std::size_t>(*i)], volumes[static_cast<std::size_t>(*j)]);
        const bool exactly_overlapping = exactly(at(scene, *i), at(scene, *j));
        expectRight(found, overlapping, exactly_overlapping);
        if (HasFatalFailure()) FAIL() << *i << ' ' << *j;
      }
    }
  }
};

TYPED_TEST_SUITE(BvhTest, SearchedTrees, TreeNames);

TYPED_TEST(BvhTest, EverySegmentIsInTheVolumesAboveAfterTheBuild) {
  // If this fails, a traversal prunes pairs that overlap.
  for (const double padding : {0.0, 0.05}) {
    for (const auto& lengths : std::vector<std::vector<int>>{
             {1}, {2}, {3}, {7}, {8}, {9}, {1, 1, 1}, {64}, {65}, {0, 40, 1, 40, 0}, {500}}) {
      const FiberScene scene = wanderingFibers(lengths, 2);
      expectContainment(this->build(scene, padding), scene.segments);
      if (this->HasFatalFailure()) FAIL() << scene.fibers.ids.size() << " segments";
    }
    const FiberScene scene = mediumScene();
    expectContainment(this->build(scene, padding), scene.segments);
  }
}

TYPED_TEST(BvhTest, EverySegmentIsInTheVolumesAboveAfterMotion) {
  // If this fails, a refit leaves volumes where the segments were.
  Random random(3);
  FiberScene scene = mediumScene();
  const auto unfitted = unfittedTreeOf<TypeParam>(scene);
  TypeParam tree = unfitted;
  for (int frame = 0; frame < 60; ++frame) {
    moveAll(random, frame, scene.segments);
    const double padding = frame % 7 == 0 ? 0.02 : 0;
    tree.refit(scene.segments, padding);
    ASSERT_EQ(tree.padding(), padding);
    expectContainment(tree, scene.segments);
    TypeParam fresh = unfitted;
    fresh.refit(scene.segments, padding);
    expectLikeRefit(tree, fresh);
    if (this->HasFatalFailure()) FAIL() << "frame " << frame;
  }
}

TYPED_TEST(BvhTest, EverySegmentIsInTheVolumesAboveAfterPartialRefits) {
  // If this fails, a segment that moves alone leaves a node above it behind.
  Random random(4);
  FiberScene scene = mediumScene();
  const auto unfitted = unfittedTreeOf<TypeParam>(scene);
  TypeParam tree = unfitted;
  tree.refit(scene.segments, 0.01);
  refitMoved(tree, scene.segments, {});
  for (int frame = 0; frame < 200; ++frame) {
    std::vector<SegmentId> moved;
    const std::size_t count = frame % 3 == 0 ? 1 : 1 + random.below(30);
    for (std::size_t i = 0; i < count; ++i) {
      moved.push_back(scene.fibers.ids[random.below(scene.fibers.ids.size())]);  // some twice
      jiggle(random, frame % 4 == 0 ? 1 : 0.05,
             scene.segments[static_cast<std::size_t>(moved.back())]);
    }
    refitMoved(tree, scene.segments, moved);
    expectContainment(tree, scene.segments);
    TypeParam fresh = unfitted;
    fresh.refit(scene.segments, 0.01);
    expectLikeRefit(tree, fresh);
    if (this->HasFatalFailure()) FAIL() << "frame " << frame;
  }
}

TYPED_TEST(BvhTest, PairsAreThoseOfOverlappingLeafVolumes) {
  // If this fails, a self-query misses pairs, repeats them or makes them up.
  for (const auto& lengths : std::vector<std::vector<int>>{
           {2}, {3}, {8}, {9}, {17}, {1, 1, 1, 1, 1}, {30, 1, 30}, {300}}) {
    const FiberScene scene = wanderingFibers(lengths, 6);
    this->expectPairsOfLeafVolumes(this->build(scene), scene, 0);
    if (this->HasFatalFailure()) FAIL() << scene.fibers.ids.size() << " segments";
  }
  for (const FiberScene& scene : {curled(), unequal(), singles(), mixed()}) {
    SCOPED_TRACE(scene.name);
    this->expectPairsOfLeafVolumes(this->build(scene), scene, scene.segments.size() / 2);
    if (this->HasFatalFailure()) return;
  }
  Random random(7);
  FiberScene scene = mediumScene();
  TypeParam tree = this->build(scene);
  for (int frame = 0; frame < 12; ++frame) {
    this->expectPairsOfLeafVolumes(tree, scene, 100);
    if (this->HasFatalFailure()) FAIL() << "frame " << frame;
    moveAll(random, frame, scene.segments);
    tree.refit(scene.segments, 0);
  }
}

TYPED_TEST(BvhTest, PaddingFindsPairsThatAreApart) {
  // If this fails, the margin is not half on either side.
  FiberScene scene;
  for (int i = 0; i < 2; ++i) {
    scene.fibers.ids.push_back(i);
    scene.fibers.endFiber();
    scene.segments.push_back({{3.0 * i, 0, 0}, {3.0 * i, 0, 0}, 0.5});
  }
  for (const auto& [padding, count] : {std::pair{0.0, 0u}, {0.99, 0u}, {1.0, 1u}}) {
    EXPECT_EQ(pairsFound<TypeParam>(this->build(scene, padding)).size(), count) << padding;
  }
}

TYPED_TEST(BvhTest, LeavesAreThoseThatOverlapTheVolume) {
  // If this fails, a query of one object misses segments or repeats them.
  Random random(10);
  const FiberScene scene = mediumScene();
  const TypeParam tree = this->build(scene);
  const auto volumes = leafVolumes(tree);
  std::size_t hits = 0;
  for (int i = 0; i < 300; ++i) {
    const Vec3d p = fromEigen(random.inCube(2)), direction = fromEigen(random.direction());
    const Segment segment{p, p + random.unit() * direction, 0.3 * random.unit()};
    const auto volume = TypeParam::Volume::around(segment, 0);
    constexpr SegmentId kVolume = 77;
    const PairList leaves = asSet(pairsWith(tree, volume, kVolume, kNoGroup), true);
    ASSERT_FALSE(hasDuplicates(leaves));
    hits += leaves.size();
    for (const SegmentId id : scene.fibers.ids) {
      const bool found = std::binary_search(leaves.begin(), leaves.end(), std::pair(id, kVolume));
      const bool overlapping = overlap(volumes[static_cast<std::size_t>(id)], volume);
      const bool exactly_overlapping = this->exactly(this->at(scene, id), segment);
      this->expectRight(found, overlapping, exactly_overlapping);
      if (this->HasFatalFailure()) FAIL() << id;
    }
  }
  EXPECT_GT(hits, 100u);
}

TYPED_TEST(BvhTest, TheNearestPairIsFoundByLookingAtFew) {
  // If this fails, a distance query prunes the nearest pair, or looks at all of them.
  for (int i = 0; i < 10; ++i) {
    // Thin segments far from each other, so that few pairs touch.
    FiberScene scene;
    Random random(static_cast<std::uint64_t>(11 + i));
    for (SegmentId id = 0; id < 400; ++id) {
      const Vec3d p = 30.0 * fromEigen(random.inCube(1));
      scene.fibers.ids.push_back(id);
      scene.fibers.endFiber();
      scene.segments.push_back({p, p + 0.2 * fromEigen(random.direction()), 0.01});
    }
    // The binary tree knows no places: it is to have segments that are near on the thread near in
    // space.
    std::sort(scene.segments.begin(), scene.segments.end(),
              [](const Segment& p, const Segment& q) { return p.a.x < q.a.x; });
    const TypeParam tree = this->build(scene);
    const double infinity = std::numeric_limits<double>::infinity();
    Nearest nearest(scene.segments, scene.segments);
    ASSERT_EQ(visitNearest(tree, infinity, nearest), Visit::kContinue);
    double least = infinity;
    for (SegmentId a = 0; a < 400; ++a) {
      for (SegmentId b = 0; b < a; ++b) least = std::min(least, nearest.distance(a, b));
    }
    EXPECT_EQ(nearest.least, least) << i;
    EXPECT_LT(nearest.visited, 400u * 399 / 2 / 10) << i;

    // A limit below the least distance prunes all.
    Nearest below(scene.segments, scene.segments);
    visitNearest(tree, 0.5 * least, below);
    EXPECT_LT(below.visited, nearest.visited) << i;
  }
}

// Cages.

template <class Tree>
class CageTest : public testing::Test {
 protected:
  /// The radius of each node's least sphere, found without a start.
  static std::vector<double> leastRadii(const Tree& tree) {
    std::vector<double> radii;
    for (const auto& node : tree.nodes()) {
      radii.push_back(
          geometry::enclosingSphere(tree.hierarchy().leafBalls().data() + node.leaf_begin,
                                    node.leaf_end - node.leaf_begin)
              .ball.radius);
    }
    return radii;
  }
  static void expectLeastCages(const Tree& tree, double tolerance) {
    const std::vector<double> least = leastRadii(tree);
    for (std::size_t i = 0; i < least.size(); ++i) {
      const double radius = tree.hierarchy().cage(i).ball.radius;
      ASSERT_LE(radius, least[i] * (1 + tolerance)) << "the cage of node " << i << " is too large";
      ASSERT_GE(radius, least[i] * (1 - 1e-9)) << "the cage of node " << i << " is too small";
    }
  }
};
using CageTrees = testing::Types<WrappedSphereTree<2>, WrappedSphereTree<8>>;
TYPED_TEST_SUITE(CageTest, CageTrees, TreeNames);

TYPED_TEST(CageTest, CagesAreMinimumEnclosingSpheres) {
  // If this fails, the hierarchy is not the paper's wrapped one: cages are larger than need be.
  for (const FiberScene& scene :
       {mediumScene(), wanderingFibers({300}, 17, 0.01), wanderingFibers({1}, 18)}) {
    const TypeParam tree = treeOf<TypeParam>(scene, 0);
    this->expectLeastCages(tree, 1e-9);
    // The basis' leaves are counted from the node's first leaf, and touch the cage.
    for (std::size_t i = 0; i < tree.nodes().size(); ++i) {
      const auto& cage = tree.hierarchy().cage(i);
      const auto& node = tree.nodes()[i];
      for (std::size_t k = 0; k < static_cast<std::size_t>(cage.basis.size); ++k) {
        ASSERT_LT(cage.basis.ball[k], node.leaf_end - node.leaf_begin);
        const Ball& ball =
            tree.hierarchy()
                .leafBalls()[static_cast<std::size_t>(node.leaf_begin + cage.basis.ball[k])];
        ASSERT_NEAR(geometry::norm(ball.center - cage.ball.center) + ball.radius, cage.ball.radius,
                    1e-9 * cage.ball.radius);
      }
    }
  }
}

TYPED_TEST(CageTest, SlowMotionKeepsMostCagesAndAllOfThemMinimal) {
  // If this fails, every frame costs a build, or savings come at the price of loose cages.
  Random random(20);
  FiberScene scene = mediumScene();
  TypeParam tree = treeOf<TypeParam>(scene, 0);
  std::size_t kept = 0, recomputed = 0;
  for (int frame = 0; frame < 60; ++frame) {
    for (Segment& segment : scene.segments) jiggle(random, 1e-4, segment);
    tree.refit(scene.segments, 0);
    kept += tree.nodes().size() - tree.hierarchy().cagesRecomputed();
    recomputed += tree.hierarchy().cagesRecomputed();
    this->expectLeastCages(tree, 0x1p-29);
    if (this->HasFatalFailure()) FAIL() << "frame " << frame;
  }
  EXPECT_GT(kept, 9 * recomputed);
  EXPECT_GT(recomputed, 0u);
}

TYPED_TEST(CageTest, CagesThatAreRecomputedAreCounted) {
  // If this fails, the counts of the cascade verification say nothing.
  Random random(21);
  FiberScene scene = mediumScene();
  TypeParam tree = treeOf<TypeParam>(scene, 0);
  const std::size_t nodes = tree.nodes().size();
  EXPECT_EQ(tree.hierarchy().cagesRecomputed(), nodes);
  for (int frame = 0; frame < 12; ++frame) {
    moveAll(random, frame, scene.segments);
    tree.refit(scene.segments, 0);
    tree.refit(scene.segments, 0);
    EXPECT_EQ(tree.hierarchy().cagesRecomputed(), 0u) << "nothing has moved";
  }
  for (Segment& segment : scene.segments) jiggle(random, 1, segment);
  tree.refit(scene.segments, 0);
  EXPECT_GE(tree.hierarchy().cagesRecomputed(), nodes / 2) << "the scene is another";
}

TYPED_TEST(CageTest, RigidMotionKeepsTheCages) {
  // If this fails, cages are recomputed although they move along with their bases.
  FiberScene scene = wanderingFibers({60, 60, 60, 60}, 22);
  TypeParam tree = treeOf<TypeParam>(scene, 0);
  for (int frame = 0; frame < 10; ++frame) {
    for (Segment& s : scene.segments) {
      // A turn by the angle of 3-4-5 about z, and a shift.
      for (Vec3d* p : {&s.a, &s.b})
        *p = {0.6 * p->x - 0.8 * p->y + 0.3, 0.8 * p->x + 0.6 * p->y, p->z - 0.1};
    }
    tree.refit(scene.segments, 0);
    EXPECT_LE(tree.hierarchy().cagesRecomputed(), tree.nodes().size() / 10) << frame;
    this->expectLeastCages(tree, 0x1p-29);
  }
}

TYPED_TEST(CageTest, ABasisThatIsNoneAnyMoreIsGivenUp) {
  // If this fails, only escaped leaves are looked for, and cages stay larger than need be.
  // Three points of an acute triangle, the third of which falls onto the line of the others.
  FiberScene scene;
  for (SegmentId id = 0; id < 3; ++id) scene.fibers.ids.push_back(id);
  scene.fibers.endFiber();
  const auto point = [](double x, double y) { return Segment{{x, y, 0}, {x, y, 0}, 0}; };
  scene.segments = {point(-1, 0), point(0, 1.5), point(1, 0)};
  TypeParam tree = treeOf<TypeParam>(scene, 0);
  EXPECT_EQ(tree.hierarchy().cage(0).basis.size, 3);
  EXPECT_NEAR(tree.hierarchy().cage(0).ball.radius, 3.25 / 3, 1e-12);
  scene.segments[1] = point(0, 0.5);  // all three are still on one circle, of radius 1.25
  tree.refit(scene.segments, 0);
  EXPECT_EQ(tree.hierarchy().cage(0).basis.size, 2);
  EXPECT_NEAR(tree.hierarchy().cage(0).ball.radius, 1, 1e-12);
}

TYPED_TEST(CageTest, AnEscapedLeafIsCaught) {
  // If this fails, a leaf that is not in the basis leaves the cage unnoticed.
  FiberScene scene;
  for (SegmentId id = 0; id < 20; ++id) {
    scene.fibers.ids.push_back(id);
    scene.segments.push_back({{0.1 * id, 0, 0}, {0.1 * id, 0, 0}, 0.01});
  }
  scene.fibers.endFiber();
  for (SegmentId id = 1; id < 19; ++id) {
    FiberScene moved = scene;
    TypeParam tree = treeOf<TypeParam>(moved, 0);
    moved.segments[static_cast<std::size_t>(id)].a.y =
        moved.segments[static_cast<std::size_t>(id)].b.y = 5;
    refitMoved(tree, moved.segments, {id});
    expectContainment(tree, moved.segments);
    this->expectLeastCages(tree, 0x1p-29);
    EXPECT_GT(tree.hierarchy().cage(0).ball.radius, 2.5);
  }
}

}  // namespace
}  // namespace fcl_fibers::tree
