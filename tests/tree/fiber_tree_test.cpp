// SPDX-License-Identifier: BSD-3-Clause
#include "tree/fiber_tree.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "geometry/overlap.h"
#include "tree/plain_traversal.h"

namespace fcl_fibers::tree {
namespace {

using geometry::Ball;
using geometry::Box;
using geometry::Frame;
using geometry::FrameChange;
using geometry::Segment;
using geometry::Sphere;
using geometry::Vec3d;
using Pairs = std::set<std::pair<SegmentId, SegmentId>>;

constexpr int kFiberCount = 12;
constexpr int kSegments = 25;  // per fiber
constexpr double kRadius = 0.02;

Fibers regularFibers() {
  Fibers fibers;
  for (int f = 0; f < kFiberCount; ++f) {
    for (int i = 0; i < kSegments; ++i) {
      fibers.ids.push_back(static_cast<SegmentId>(fibers.ids.size()));
    }
    fibers.endFiber();
  }
  return fibers;
}

/// In [0, 1); the standard's distributions differ between libraries.
double unit(std::mt19937& random) { return static_cast<double>(random()) / 4294967296.0; }

/// Random walks from a small disc, thickness differing by a factor of ten.
std::vector<Segment> randomFibers(unsigned seed) {
  std::mt19937 random(seed);
  const auto uniform = [&] { return 2 * unit(random) - 1; };
  std::vector<Segment> segments;
  for (int f = 0; f < kFiberCount; ++f) {
    Vec3d p{0.2 * uniform(), 0.2 * uniform(), 0};
    for (int i = 0; i < kSegments; ++i) {
      const Vec3d q = p + Vec3d{0.05 * uniform(), 0.05 * uniform(), 0.05 + 0.03 * uniform()};
      segments.push_back({p, q, kRadius * (1 + 9 * (f % 2))});
      p = q;
    }
  }
  return segments;
}

/// Moves all segments a little, and not rigidly.
void move(std::vector<Segment>& segments, std::mt19937& random, double size) {
  const auto uniform = [&] { return size * (2 * unit(random) - 1); };
  for (Segment& s : segments) {
    s.a = s.a + Vec3d{uniform(), uniform(), uniform()};
    s.b = s.b + Vec3d{uniform(), uniform(), uniform()};
  }
}

// Containment in long double, where floats and sums of a few of them are exact.
bool contains(const Box& box, const Segment& s) {
  const auto inside = [&](const Vec3d& p) {
    const double coordinate[3] = {p.x, p.y, p.z};
    for (int axis = 0; axis < 3; ++axis) {
      const long double c = coordinate[axis], r = s.radius;
      if (c - r < box.low[axis] || c + r > box.high[axis]) return false;
    }
    return true;
  };
  return inside(s.a) && inside(s.b);
}
bool contains(const Sphere& sphere, const Segment& s) {
  const auto inside = [&](const Vec3d& p) {
    const long double x = static_cast<long double>(p.x) - sphere.center[0];
    const long double y = static_cast<long double>(p.y) - sphere.center[1];
    const long double z = static_cast<long double>(p.z) - sphere.center[2];
    return std::sqrt(x * x + y * y + z * z) + static_cast<long double>(s.radius) <= sphere.radius;
  };
  return inside(s.a) && inside(s.b);
}
/// Wrapped nodes enclose the leaves' spheres, layered ones the leaves' boxes.
bool containsVolume(const Box& outer, const Box& inner) {
  for (int axis = 0; axis < 3; ++axis) {
    if (inner.low[axis] < outer.low[axis] || inner.high[axis] > outer.high[axis]) return false;
  }
  return true;
}

template <class Tree>
Topology<Tree::kArity> topologyFor(const Fibers& fibers, const std::vector<Segment>& segments) {
  if constexpr (Tree::kArity == 2) {
    return superThread(fibers);
  } else {
    return bundle(fibers, segments);
  }
}

template <class Tree>
class FiberTreeTest : public ::testing::Test {
 protected:
  FiberTreeTest() : segments_(randomFibers(7)) { build(); }

  void build() {
    tree_ = Tree(topologyFor<Tree>(regularFibers(), segments_));
    tree_.refit(segments_, kPadding);
  }

  const Segment& segment(std::int32_t leaf) const {
    return segments_[static_cast<std::size_t>(
        tree_.topology().leaves[static_cast<std::size_t>(leaf)])];
  }

  /// Every volume holds all segments below it, thickened by the padding, with no tolerance.
  void expectContainment() const {
    for (std::size_t i = 0; i < tree_.topology().nodes.size(); ++i) {
      const auto index = static_cast<std::int32_t>(i);
      std::int32_t leaf = tree_.node(index).leaf_begin;
      for (int lane = 0; lane < tree_.node(index).child_count; ++lane) {
        const Link child = tree_.node(index).children[static_cast<std::size_t>(lane)];
        const std::int32_t end = child.isLeaf() ? leaf + 1 : tree_.node(child.node()).leaf_end;
        for (; leaf < end; ++leaf) {
          Segment thick = segment(leaf);
          thick.radius += kPadding;
          ASSERT_TRUE(contains(tree_.pack(index).get(lane), thick))
              << "segment " << leaf << " below lane " << lane << " of node " << index;
        }
      }
    }
  }

  /// All overlapping pairs of leaf volumes, from a pack of one lane's width at a time.
  Pairs bruteForcePairs() const {
    using Volume = typename Tree::Volume;
    Pairs pairs;
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      typename Volume::template Pack<2> pack;
      pack.set(0, Volume::around(segments_[i], kPadding));
      for (std::size_t j = i + 1; j < segments_.size(); ++j) {
        if (overlaps(pack, Volume::around(segments_[j], kPadding)) & 1u) {
          pairs.insert({static_cast<SegmentId>(i), static_cast<SegmentId>(j)});
        }
      }
    }
    return pairs;
  }

  static constexpr double kPadding = 0.001;
  std::vector<Segment> segments_;
  Tree tree_;
};

struct TreeNames {
  template <class Tree>
  static std::string GetName(int) {
    return std::string(std::is_same_v<typename Tree::Volume, Box> ? "LayeredBoxes"
                                                                  : "WrappedSpheres") +
           std::to_string(Tree::kArity);
  }
};
using Trees = ::testing::Types<LayeredBoxTree<2>, LayeredBoxTree<8>, WrappedSphereTree<2>,
                               WrappedSphereTree<8>>;
TYPED_TEST_SUITE(FiberTreeTest, Trees, TreeNames);

struct CollectPairs : plain::OverlapVisitor {
  Pairs pairs;
  std::size_t calls = 0;
  std::size_t stop_after = SIZE_MAX;

  Visit leafPair(SegmentId a, SegmentId b) override {
    pairs.insert(std::minmax(a, b));
    return ++calls < stop_after ? Visit::kContinue : Visit::kStop;
  }
  Visit leaf(SegmentId a) override { return leafPair(a, a); }
};

// A touching pair would be missed.
TYPED_TEST(FiberTreeTest, VolumesContainWhatIsBelow) { this->expectContainment(); }

TYPED_TEST(FiberTreeTest, VolumesContainWhatIsBelowAfterMotion) {
  std::mt19937 random(11);
  for (int step = 0; step < 60; ++step) {
    move(this->segments_, random, step % 20 == 19 ? 0.5 : 0.003);
    this->tree_.refit(this->segments_, this->kPadding);
    this->expectContainment();
  }
}

// update(objects) would leave nodes above the moved ones as they were.
TYPED_TEST(FiberTreeTest, VolumesContainWhatIsBelowAfterMotionOfSome) {
  std::mt19937 random(12);
  for (int step = 0; step < 60; ++step) {
    std::vector<SegmentId> moved;
    for (int i = 0; i <= step % 7; ++i) {
      moved.push_back(static_cast<SegmentId>(random() % this->segments_.size()));
      std::vector<Segment> one = {this->segments_[static_cast<std::size_t>(moved.back())]};
      move(one, random, 0.1);
      this->segments_[static_cast<std::size_t>(moved.back())] = one[0];
    }
    this->tree_.refitMoved(this->segments_, moved);
    this->expectContainment();
  }
}

// Boxes would stay larger than they need be after a refit in part.
TYPED_TEST(FiberTreeTest, ARefitInPartIsAsGoodAsAWholeOne) {
  if constexpr (std::is_same_v<typename TypeParam::Volume, Box>) {
    TypeParam whole = this->tree_;
    const Segment before = this->segments_[17];
    this->segments_[17].a.x += 3;
    this->tree_.refitMoved(this->segments_, {17});
    this->segments_[17] = before;
    this->tree_.refitMoved(this->segments_, {17, 17});
    for (std::size_t i = 0; i < whole.topology().nodes.size(); ++i) {
      const auto index = static_cast<std::int32_t>(i);
      for (int lane = 0; lane < whole.node(index).child_count; ++lane) {
        EXPECT_TRUE(containsVolume(whole.pack(index).get(lane), this->tree_.pack(index).get(lane)));
      }
    }
  }
}

// Pairs would be missed, invented or repeated.
TYPED_TEST(FiberTreeTest, VisitsThePairsThatBruteForceFinds) {
  std::mt19937 random(13);
  for (int step = 0; step < 10; ++step) {
    CollectPairs query;
    visitPairs(this->tree_, query);
    EXPECT_EQ(query.pairs, this->bruteForcePairs());
    EXPECT_EQ(query.calls, query.pairs.size()) << "a pair came twice";
    move(this->segments_, random, 0.02);
    this->tree_.refit(this->segments_, this->kPadding);
  }
}

TYPED_TEST(FiberTreeTest, VisitsTheLeavesThatBruteForceFinds) {
  using Volume = typename TypeParam::Volume;
  for (std::size_t i = 0; i < this->segments_.size(); i += 7) {
    const Volume volume = Volume::around(this->segments_[i], 0.01);
    std::set<SegmentId> expected;
    for (std::size_t j = 0; j < this->segments_.size(); ++j) {
      typename Volume::template Pack<2> pack;
      pack.set(0, Volume::around(this->segments_[j], this->kPadding));
      if (overlaps(pack, volume) & 1u) expected.insert(static_cast<SegmentId>(j));
    }
    CollectPairs query;
    visitLeaves(this->tree_, volume, query);
    std::set<SegmentId> found;
    for (const auto& pair : query.pairs) found.insert(pair.first);
    EXPECT_EQ(found, expected);
    EXPECT_EQ(query.calls, expected.size());
  }
}

// Two managers would miss each other's objects where their frames differ.
TYPED_TEST(FiberTreeTest, VisitsPairsOfTwoTreesInDifferentFrames) {
  const Frame here{{0.1, -0.3, 0.7}, 4}, there{{-1e3, 20, 0.1}, 0.0625};
  const std::vector<Segment> world_a = randomFibers(7), world_b = randomFibers(8);
  const auto inFrame = [](const std::vector<Segment>& world, const Frame& frame) {
    std::vector<Segment> local;
    for (const Segment& s : world) {
      local.push_back({frame.fromWorld(s.a), frame.fromWorld(s.b), frame.scale * s.radius});
    }
    return local;
  };
  const std::vector<Segment> a = inFrame(world_a, here), b = inFrame(world_b, there);
  TypeParam tree_a(topologyFor<TypeParam>(regularFibers(), a));
  TypeParam tree_b(topologyFor<TypeParam>(regularFibers(), b));
  tree_a.refit(a, 0);
  tree_b.refit(b, 0);

  struct CollectOrderedPairs : plain::OverlapVisitor {
    Pairs pairs;
    std::size_t calls = 0;
    Visit leafPair(SegmentId p, SegmentId q) override {
      pairs.insert({p, q});
      ++calls;
      return Visit::kContinue;
    }
    Visit leaf(SegmentId) override { return Visit::kContinue; }
  } query;
  visitPairs(tree_a, tree_b, FrameChange(there, here), FrameChange(here, there), query);
  EXPECT_EQ(query.calls, query.pairs.size()) << "a pair came twice";

  using Volume = typename TypeParam::Volume;
  std::size_t overlapping = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    typename Volume::template Pack<2> pack;
    pack.set(0, Volume::around(world_a[i], 0));
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::pair<SegmentId, SegmentId> pair(static_cast<SegmentId>(i),
                                                 static_cast<SegmentId>(j));
      // Float bounds a thousand units from their origin are good to 1e-4.
      const bool surely = (overlaps(pack, Volume::around(world_b[j], -1e-6)) & 1u) != 0;
      const bool hardly = (overlaps(pack, Volume::around(world_b[j], 2e-3)) & 1u) == 0;
      overlapping += surely;
      const bool found = query.pairs.count(pair) != 0;
      EXPECT_TRUE(found || !surely) << i << ", " << j;
      EXPECT_FALSE(found && hardly) << i << ", " << j;
    }
  }
  EXPECT_GT(overlapping, 100u) << "the scenes should meet";
}

// Ending at the first pair would cost as much as a whole query.
TYPED_TEST(FiberTreeTest, StopsAtOnce) {
  for (const std::size_t wanted : {1u, 2u, 50u}) {
    CollectPairs query;
    query.stop_after = wanted;
    EXPECT_EQ(visitPairs(this->tree_, query), Visit::kStop);
    EXPECT_EQ(query.calls, wanted);
  }
  CollectPairs whole, first;
  first.stop_after = 1;
  visitPairs(this->tree_, whole);
  visitPairs(this->tree_, first);
  EXPECT_LE(100 * first.tests, whole.tests);
}

// Distance queries would miss the nearest pair, or visit all.
TYPED_TEST(FiberTreeTest, FindsTheNearestPair) {
  for (Segment& s : this->segments_) s.radius = 1e-5;  // so that the nearest pair is apart
  // Neighbours share an end; without every other one nothing overlaps.
  Fibers fibers;
  for (std::size_t i = 0; i < this->segments_.size(); i += 2) {
    fibers.ids.push_back(static_cast<SegmentId>(i));
    fibers.endFiber();
  }
  TypeParam tree(topologyFor<TypeParam>(fibers, this->segments_));
  tree.refit(this->segments_, 0);

  using Volume = typename TypeParam::Volume;
  const auto distance = [&](SegmentId i, SegmentId j) {
    typename Volume::template Pack<2> pack;
    pack.set(0, Volume::around(this->segments_[static_cast<std::size_t>(i)], 0));
    float out[2];
    nearer(pack, Volume::around(this->segments_[static_cast<std::size_t>(j)], 0),
           std::numeric_limits<float>::max(), out);
    return double{out[0]};
  };
  struct Nearest : plain::NearVisitor {
    explicit Nearest(decltype(distance)& d) : NearVisitor(1e30), between(d) {}
    decltype(distance)& between;
    std::size_t calls = 0;
    Visit leafPair(SegmentId a, SegmentId b) override {
      ++calls;
      limit = std::min(limit, between(a, b));
      return Visit::kContinue;
    }
  } query(distance);
  visitPairs(tree, query);

  double expected = 1e30;
  for (const SegmentId i : fibers.ids) {
    for (const SegmentId j : fibers.ids) {
      if (i < j) expected = std::min(expected, distance(i, j));
    }
  }
  EXPECT_EQ(query.limit, expected);
  EXPECT_LT(query.calls, fibers.ids.size()) << "of " << fibers.ids.size() * fibers.ids.size() / 2;
}

// Empty and tiny managers answer too.
TYPED_TEST(FiberTreeTest, HoldsNothingOrOne) {
  TypeParam none(topologyFor<TypeParam>(Fibers{}, {}));
  none.refit({}, 0);
  none.refitMoved({}, {});
  CollectPairs query;
  EXPECT_EQ(visitPairs(none, query), Visit::kContinue);
  EXPECT_EQ(query.calls, 0u);

  Fibers fibers;
  fibers.ids = {0};
  fibers.endFiber();
  TypeParam one(topologyFor<TypeParam>(fibers, this->segments_));
  one.refit(this->segments_, 0);
  visitPairs(one, query);
  EXPECT_EQ(query.calls, 0u);
  visitLeaves(one, TypeParam::Volume::around(this->segments_[0], 0), query);
  EXPECT_EQ(query.calls, 1u);
}

// --- What only wrapped spheres promise ---

template <class Tree>
class WrappedSphereTest : public FiberTreeTest<Tree> {
 protected:
  /// Every cage is the least sphere around the leaves' spheres, up to `looseness` of its radius.
  void expectLeastCages(double looseness) const {
    const auto& hierarchy = this->tree_.hierarchy();
    for (std::size_t i = 0; i < this->tree_.topology().nodes.size(); ++i) {
      const auto& node = this->tree_.topology().nodes[i];
      const Ball& cage = hierarchy.cage(i).ball;
      const Ball* leaves = hierarchy.leafBalls().data() + node.leaf_begin;
      const int count = node.leaf_end - node.leaf_begin;
      for (int leaf = 0; leaf < count; ++leaf) {
        const Vec3d d = leaves[leaf].center - cage.center;
        const long double x = d.x, y = d.y, z = d.z;
        ASSERT_LE(std::sqrt(x * x + y * y + z * z) + static_cast<long double>(leaves[leaf].radius),
                  cage.radius);
      }
      const Ball least = geometry::enclosingSphere(leaves, count).ball;
      ASSERT_LE(cage.radius, least.radius * (1 + looseness)) << "node " << i;
    }
  }
};
using WrappedTrees = ::testing::Types<WrappedSphereTree<2>, WrappedSphereTree<8>>;
TYPED_TEST_SUITE(WrappedSphereTest, WrappedTrees, TreeNames);

// Cages would be looser than the paper's, or leave a segment out.
TYPED_TEST(WrappedSphereTest, CagesAreTheLeastAfterBuildAndMotion) {
  this->expectLeastCages(1e-12);
  std::mt19937 random(14);
  for (int step = 0; step < 30; ++step) {
    move(this->segments_, random, step % 10 == 9 ? 0.3 : 1e-4);
    this->tree_.refit(this->segments_, this->kPadding);
    this->expectLeastCages(0x1p-29);
  }
}

// Checking that nothing has escaped is not enough: cages would grow for ever.
TYPED_TEST(WrappedSphereTest, CagesShrinkWithTheirFibers) {
  for (int step = 0; step < 20; ++step) {
    for (Segment& s : this->segments_) {
      s.a = 0.8 * s.a;
      s.b = 0.8 * s.b;
      s.radius *= 0.8;
    }
    this->tree_.refit(this->segments_, 0);
    this->expectLeastCages(0x1p-29);
  }
}

// The statistic would not say what was done.
TYPED_TEST(WrappedSphereTest, CountsCagesKeptAndRecomputed) {
  const auto& hierarchy = this->tree_.hierarchy();
  const std::size_t cages = this->tree_.topology().nodes.size();
  EXPECT_EQ(hierarchy.cagesKept(), 0u);
  EXPECT_EQ(hierarchy.cagesRecomputed(), cages);
  this->tree_.refit(this->segments_, this->kPadding);
  EXPECT_EQ(hierarchy.cagesKept(), cages) << "nothing has moved";
  EXPECT_EQ(hierarchy.cagesRecomputed(), 0u);

  for (Segment& s : this->segments_) {
    s.a = s.a + Vec3d{0.25, -0.5, 8};
    s.b = s.b + Vec3d{0.25, -0.5, 8};
  }
  this->tree_.refit(this->segments_, this->kPadding);
  EXPECT_GE(hierarchy.cagesKept(), cages * 9 / 10) << "cages move with their basis";
  EXPECT_EQ(hierarchy.cagesKept() + hierarchy.cagesRecomputed(), cages);

  std::mt19937 random(15);
  move(this->segments_, random, 1);
  this->tree_.refit(this->segments_, this->kPadding);
  EXPECT_GE(hierarchy.cagesRecomputed(), cages / 2) << "the scene is another";
}

}  // namespace
}  // namespace fcl_fibers::tree
