// SPDX-License-Identifier: BSD-3-Clause
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree_array.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "harness/runs.h"
#include "measures.h"
#include "measures/paper/plain_self_query.h"
#include "measures/paper/tree_scene.h"
#include "tests/support/volume_tests.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

using Clock = std::chrono::steady_clock;

/// What a self query does. If its time was up before its end, these are estimates.
struct Count {
  double tests = 0;    ///< of two volumes
  double pairs = 0;    ///< of segments whose volumes overlap
  double seconds = 0;  ///< of the traversal
  double share = 1;    ///< of the parts of the traversal that were gone through
  double made = 0;     ///< tests
  double error = 0;    ///< standard error of `tests`, relative
};

/// Leaves below the larger of two nodes whose pairs are one part of a traversal. The parts of one
/// scene are a few hundred thousand.
constexpr std::int32_t kPartLeaves = 1024;
/// A sample of fewer parts has no standard error that can be trusted.
constexpr std::size_t kLeastParts = 100;

/// Cuts a traversal into parts.
struct Splitter : test::VolumeTests {
  static constexpr bool kSplits = true;

  bool isTask(std::int32_t a_leaves, std::int32_t b_leaves) const {
    return std::max(a_leaves, b_leaves) <= kPartLeaves;
  }
  tree::Visit addTask(const tree::TraversalTask& task) {
    parts.push_back(task);
    return tree::Visit::kContinue;
  }

  std::vector<tree::TraversalTask> parts;
};

/// Goes through the parts of a self query in random order, so that those done before the limit are
/// a sample of all.
template <class Tree>
Count countOurs(const Tree& tree, double limit) {
  const Clock::time_point begin = Clock::now();
  const auto taken = [begin] {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  };
  Splitter splitter;
  test::visitTask(tree, test::kWholeTree, splitter);
  const double split_seconds = taken();
  std::vector<tree::TraversalTask>& parts = splitter.parts;
  std::shuffle(parts.begin(), parts.end(), std::mt19937_64(1));

  test::VolumeTests all;
  double squares = 0;
  std::size_t done = 0;
  for (; done < parts.size() && (done < kLeastParts || taken() < limit); ++done) {
    const std::size_t before = all.tests;
    test::visitTask(tree, parts[done], all);
    const auto tests = static_cast<double>(all.tests - before);
    squares += tests * tests;
  }

  // The sum over all parts, from those drawn without putting back.
  const auto n = static_cast<double>(done), of = static_cast<double>(parts.size());
  const auto cut = static_cast<double>(splitter.tests), counted = static_cast<double>(all.tests);
  Count count;
  count.share = n / of;
  count.made = cut + counted;
  count.tests = cut + counted / count.share;
  count.pairs = static_cast<double>(all.pairs) / count.share;
  count.seconds = split_seconds + (taken() - split_seconds) / count.share;
  if (done < parts.size()) {
    const double mean = counted / n;
    const double variance = (squares / n - mean * mean) * n / (n - 1);
    count.error = of * std::sqrt(variance / n * (1 - n / of)) / count.tests;
  }
  return count;
}

struct PointerNodes {
  using Id = fcl::DynamicAABBTreeCollisionManagerd::DynamicAABBNode*;
  static bool isLeaf(Id node) { return node->isLeaf(); }
  static Id child(Id node, int which) { return node->children[which]; }
  static bool overlap(Id a, Id b) { return a->bv.overlap(b->bv); }
  static bool opensFirst(Id a, Id b) { return a->bv.size() > b->bv.size(); }
};

struct ArrayNodes {
  using Id = std::size_t;
  const fcl::DynamicAABBTreeCollisionManager_Arrayd::DynamicAABBNode* nodes;
  bool isLeaf(Id node) const { return nodes[node].isLeaf(); }
  Id child(Id node, int which) const { return nodes[node].children[which]; }
  bool overlap(Id a, Id b) const { return nodes[a].bv.overlap(nodes[b].bv); }
  bool opensFirst(Id a, Id b) const { return nodes[a].bv.size() > nodes[b].bv.size(); }
};

template <class Nodes>
Count countFcl(Nodes nodes, typename Nodes::Id root) {
  std::size_t tests = 0, pairs = 0;
  Count count;
  count.seconds = seconds([&] {
    const auto visit = [&pairs](const auto&, const auto&) { ++pairs; };
    tests = PlainSelfQuery(nodes, root, visit).volumeTests();
  });
  count.tests = count.made = static_cast<double>(tests);
  count.pairs = static_cast<double>(pairs);
  return count;
}

Count countTests(const Contender& contender, const MovingFibers& fibers, double limit) {
  if (contender.ours) {
    Count count;
    withTree(contender, fibers, [&](const auto& tree) { count = countOurs(tree, limit); });
    return count;
  }
  const std::unique_ptr<Manager> manager = contender.setUp(fibers);
  if (auto* tree = dynamic_cast<fcl::DynamicAABBTreeCollisionManagerd*>(manager.get())) {
    return countFcl(PointerNodes(), tree->getTree().getRoot());
  }
  auto& tree = dynamic_cast<fcl::DynamicAABBTreeCollisionManager_Arrayd&>(*manager);
  return countFcl(ArrayNodes{tree.getTree().getNodes()}, tree.getTree().getRoot());
}

/// Whether all who find overlapping tight boxes found the same number, up to the rounding of
/// bounds: the traversals that are counted are then those of the managers.
class SamePairs {
 public:
  void note(const Contender& contender, const Count& count) {
    if (contender.reported != Reported::kTightBoxes || count.share != 1) return;
    fewest_ = std::min(fewest_, count.pairs);
    most_ = std::max(most_, count.pairs);
  }
  bool agree() const { return most_ <= (1 + kRoundingExcess) * fewest_; }

 private:
  static constexpr double kRoundingExcess = 0.01;
  double fewest_ = std::numeric_limits<double>::infinity(), most_ = 0;
};

Numbers numbersOf(const Count& count, const MovingFibers& fibers) {
  return {{"segments", static_cast<double>(fibers.segmentCount())},
          {"volume_tests", count.tests},
          {"leaf_pairs", count.pairs},
          {"traversal", count.seconds},
          {"share", count.share},
          {"made", count.made},
          {"error", count.error}};
}

Numbers countTouching(const Contender& contender, const MovingFibers& fibers) {
  const std::unique_ptr<Manager> manager = contender.setUp(fibers);
  return {{"segments", static_cast<double>(fibers.segmentCount())},
          {"touching", static_cast<double>(countPairs(*manager).pairs)}};
}

bool measureVolumeTests(const Request& request) {
  Motion motion = makeMotion(request.scene);
  MovingFibers& fibers = motion.fibers;
  SamePairs same_pairs;
  for (const Contender& contender : readAgainst(request.against).all()) {
    const bool finds_touching = contender.reported == Reported::kTouching;
    // Boxes and spheres find the same, and boxes sooner.
    if (finds_touching && contender.manager != "LayeredAABBTree") continue;
    tools::progress(fibers.name() + ": volume tests: " + contender.title());
    contender.bringTo(fibers, 0);
    Numbers numbers;
    if (finds_touching) {
      numbers = countTouching(contender, fibers);
    } else {
      const Count count = countTests(contender, fibers, request.limit);
      same_pairs.note(contender, count);
      numbers = numbersOf(count, fibers);
    }
    registerNumbers("VolumeTests/" + contender.name(), numbers);
  }
  return runRegistered() && same_pairs.agree();
}

const AddMeasure kMeasure("volume-tests", measureVolumeTests);

}  // namespace

}  // namespace fcl_fibers::benchmarks
