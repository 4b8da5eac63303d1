// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/random.h"
#include "support/segments.h"
#include "support/tree_segments.h"
#include "tree/search.h"

// What tests of searches share: scenes, trees over them, and pairs to compare.
namespace fcl_fibers::tree {

using PairList = std::vector<std::pair<SegmentId, SegmentId>>;

// --- Scenes ---

struct FiberScene {
  std::string name;
  std::vector<geometry::Segment> segments;
  Fibers fibers;
};

inline geometry::Vec3d inCube(test::Random& random, double half_side) {
  return geometry::fromEigen(random.inCube(half_side));
}

/// A fiber that wanders about and turns back where it leaves the unit ball.
inline void addFiber(FiberScene& scene, test::Random& random, int segments, double step,
                     double radius) {
  geometry::Vec3d p = inCube(random, 0.7), direction = inCube(random, 1);
  for (int i = 0; i < segments; ++i) {
    direction = direction + inCube(random, 0.6) - 0.3 * p;
    direction = (1 / geometry::norm(direction)) * direction;
    const geometry::Vec3d q = p + step * direction;
    scene.fibers.ids.push_back(static_cast<SegmentId>(scene.segments.size()));
    scene.segments.push_back({p, q, radius});
    p = q;
  }
  scene.fibers.endFiber();
}

inline FiberScene curled() {
  FiberScene scene{"curled", {}, {}};
  test::Random random(31);
  for (int f = 0; f < 20; ++f) addFiber(scene, random, 60, 0.06, 0.03);
  return scene;
}
inline FiberScene unequal() {
  FiberScene scene{"unequal", {}, {}};
  test::Random random(32);
  for (int f = 0; f < 24; ++f) addFiber(scene, random, 1 + f * f % 97, 0.06, 0.03);
  return scene;
}
inline FiberScene singles() {
  FiberScene scene{"singles", {}, {}};
  test::Random random(33);
  for (int f = 0; f < 900; ++f) addFiber(scene, random, 1, 0.1, 0.04);
  return scene;
}
inline FiberScene mixed() {
  FiberScene scene{"mixed", {}, {}};
  test::Random random(34);
  for (int f = 0; f < 300; ++f) {
    addFiber(scene, random, f % 50 == 7 ? 200 : 1, 0.06, f % 3 == 0 ? 0.1 : 0.01);
  }
  return scene;
}
/// So many that work comes in more pieces than are done at once.
inline FiberScene many() {
  FiberScene scene{"many", {}, {}};
  test::Random random(35);
  for (int f = 0; f < 64; ++f) addFiber(scene, random, 250, 0.03, 0.01);
  return scene;
}
/// All of them in one place: every volume overlaps every other one.
inline FiberScene identical(int fibers, int segments) {
  FiberScene scene{"identical", {}, {}};
  for (int f = 0; f < fibers; ++f) {
    for (int i = 0; i < segments; ++i) {
      scene.fibers.ids.push_back(static_cast<SegmentId>(scene.segments.size()));
      scene.segments.push_back({{0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}, 0.1});
    }
    scene.fibers.endFiber();
  }
  return scene;
}

/// The same scene with groups of every kind: none, large, of one fiber, all in one.
inline std::vector<FiberScene> grouped(const FiberScene& scene) {
  const std::size_t fibers = scene.fibers.begin.size() - 1;
  std::vector<FiberScene> all(4, scene);
  test::Random random(61);
  for (std::size_t f = 0; f < fibers; ++f) {
    all[0].fibers.groups.push_back(static_cast<Group>(random.below(5)) - 2);
    all[1].fibers.groups.push_back(static_cast<Group>(f + 1));
    all[2].fibers.groups.push_back(f == fibers / 3 ? kNoGroup : 7);
    all[3].fibers.groups.push_back(-1);
  }
  return all;
}

// --- Trees ---

template <class Tree>
Tree unfittedTreeOf(const FiberScene& scene) {
  if constexpr (Tree::kArity == 2) {
    return Tree(superThread(scene.fibers));
  } else {
    return Tree(bundleOf(scene.fibers, scene.segments));
  }
}
template <class Tree>
Tree treeOf(const FiberScene& scene, double padding = 0.001) {
  Tree tree = unfittedTreeOf<Tree>(scene);
  tree.refit(scene.segments, padding);
  return tree;
}

inline FiberScene inFrame(const FiberScene& world, const geometry::Frame& frame) {
  FiberScene local = world;
  for (geometry::Segment& s : local.segments) {
    s = {frame.fromWorld(s.a), frame.fromWorld(s.b), frame.scale * s.radius};
  }
  return local;
}

/// Two trees in frames of their own.
template <class Tree>
struct TwoTrees {
  TwoTrees(const FiberScene& world_a, const FiberScene& world_b)
      : a(treeOf<Tree>(inFrame(world_a, here))), b(treeOf<Tree>(inFrame(world_b, there))) {}

  geometry::Frame here{{0.1, -0.3, 0.7}, 4}, there{{-30, 20, 0.1}, 0.0625};
  Tree a, b;
  geometry::FrameChange b_to_a{there, here}, a_to_b{here, there};
  TreePair<Tree> two{a, b, b_to_a, a_to_b};
};

// --- Answers ---

/// Without an order, and of one tree's pairs without a first and a second.
inline PairList asSet(PairList pairs, bool ordered) {
  for (auto& pair : pairs) {
    if (!ordered && pair.first > pair.second) std::swap(pair.first, pair.second);
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}
inline bool hasDuplicates(const PairList& set) {
  return std::adjacent_find(set.begin(), set.end()) != set.end();
}
inline PairList allPairs(SegmentId segments) {
  PairList all;
  for (SegmentId a = 0; a < segments; ++a) {
    for (SegmentId b = a + 1; b < segments; ++b) all.emplace_back(a, b);
  }
  return all;
}

struct TreeNames {
  template <class Tree>
  static std::string GetName(int) {
    return std::string(std::is_same_v<typename Tree::Volume, geometry::Box> ? "LayeredBoxes"
                                                                            : "WrappedSpheres") +
           std::to_string(Tree::kArity);
  }
};
using SearchedTrees = testing::Types<LayeredBoxTree<2>, LayeredBoxTree<8>, WrappedSphereTree<2>,
                                     WrappedSphereTree<8>>;

}  // namespace fcl_fibers::tree
