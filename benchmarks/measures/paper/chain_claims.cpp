// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/runs.h"
#include "measures.h"
#include "measures/paper/bounding_volumes.h"
#include "measures/paper/chain_scenes.h"
#include "measures/paper/chain_tree.h"
#include "tree/bundle.h"
#include "tree/topology.h"

namespace fcl_fibers::benchmarks {
namespace {

std::vector<Capsule> linksOf(const FiberPolylines& chain) {
  return MovingFibers("", chain, chain).capsules();
}

/// The balanced tree in the order of the chain.
tree::Topology<2> alongChain(std::size_t links) {
  tree::Fibers fibers;
  fibers.ids.resize(links);
  std::iota(fibers.ids.begin(), fibers.ids.end(), 0);
  fibers.endFiber();
  return superThread(fibers);
}

/// A tree that follows space: each link is a fiber of its own, over which a bundle is a kd-tree.
tree::Topology<8> inSpace(const std::vector<Capsule>& links) {
  tree::Fibers fibers;
  std::vector<tree::Middle> middles;
  for (const Capsule& c : links) {
    fibers.ids.push_back(static_cast<tree::SegmentId>(middles.size()));
    fibers.endFiber();
    middles.push_back(
        tree::middleOf({{c.from.x(), c.from.y(), c.from.z()}, {c.to.x(), c.to.y(), c.to.z()}, 0}));
  }
  return bundle(fibers, middles);
}

/// What a query of boxes has tested and found.
struct Found {
  double tests = 0, pairs = 0;
};

template <int Arity>
Found query(const tree::Topology<Arity>& topology, const std::vector<Capsule>& links) {
  const BinaryTree tree(topology);
  std::vector<Capsule> by_leaf;
  for (const tree::SegmentId id : topology.leaves) {
    by_leaf.push_back(links[static_cast<std::size_t>(id)]);
  }
  std::vector<AxisBox> boxes(tree.size());
  fitVolumes(tree, by_leaf, boxes);
  Found found;
  found.tests = static_cast<double>(
      queryItself(tree, boxes, [&](std::int32_t, std::int32_t) { found.pairs += 1; }));
  return found;
}

/// The number of pairs whose spheres meet, by all pairs.
double countMeeting(const std::vector<Capsule>& links) {
  double count = 0;
  for (std::size_t i = 0; i < links.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (overlaps(LayeredBall::around(links[i]), LayeredBall::around(links[j]))) ++count;
    }
  }
  return count;
}

/// Section 2: how many others the sphere of a link meets.
Numbers neighbors(Chain kind, int edge) {
  const std::vector<Capsule> links = linksOf(makeChain(kind, edge));
  const BinaryTree tree(alongChain(links.size()));
  std::vector<LayeredBall> balls(tree.size());
  fitVolumes(tree, links, balls);
  std::vector<double> met(links.size());
  queryItself(tree, balls, [&](std::int32_t a, std::int32_t b) {
    met[static_cast<std::size_t>(a)] += 1;
    met[static_cast<std::size_t>(b)] += 1;
  });
  const double sum = std::accumulate(met.begin(), met.end(), 0.0);
  constexpr std::size_t kMostOfAllPairs = 5000;
  if (links.size() <= kMostOfAllPairs && sum != 2 * countMeeting(links)) {
    throw std::logic_error("chain-claims: the tree finds other pairs than a loop over all");
  }
  return {{"segments", static_cast<double>(links.size())},
          {"most", *std::max_element(met.begin(), met.end())}};
}

/// So many links of a random walk in a cube, which mixes them: what is near in space is anywhere
/// along the chain. It visits some points several times.
std::vector<Capsule> wadded(std::size_t count, int edge) {
  std::vector<Capsule> links;
  std::mt19937_64 random(1);
  fcl::Vector3d at(0, 0, 0);
  while (links.size() < count) {
    fcl::Vector3d next = at;
    const std::uint64_t drawn = random() >> 32;
    next[static_cast<int>(drawn / 2 % 3)] += drawn % 2 == 0 ? 1 : -1;
    if (next.minCoeff() < 0 || next.maxCoeff() >= edge) continue;
    links.push_back({at, next, 0.2});
    at = next;
  }
  return links;
}

/// Section 2.1: trees of a wad that is pulled straight after they were built.
Numbers keptTrees(int edge) {
  const std::vector<Capsule> after = linksOf(makeChain(Chain::kStraight, edge));
  const std::vector<Capsule> before = wadded(after.size(), edge);
  const Found chain = query(alongChain(after.size()), after);
  const Found kept = query(inSpace(before), after), anew = query(inSpace(after), after);
  if (kept.pairs != chain.pairs || anew.pairs != chain.pairs) {
    throw std::logic_error("chain-claims: trees over the same boxes find other pairs");
  }
  return {{"segments", static_cast<double>(after.size())},
          {"chain", chain.tests},
          {"kept", kept.tests},
          {"anew", anew.tests}};
}

/// Boxes of a chain of which some joints have moved. What lies between two of these is rigid: its
/// boxes stay in a frame of their own, and its pairs stay what they were.
struct PrunedNodes : VolumeNodes<AxisBox> {
  const std::vector<std::int32_t>& moved;  ///< by link: moved joints before it
  std::size_t* tests;

  bool isRigid(std::int32_t begin, std::int32_t end) const {
    return moved[static_cast<std::size_t>(begin)] == moved[static_cast<std::size_t>(end) - 1];
  }
  bool overlap(Id a, Id b) const {
    if (isRigid(tree[a].begin, tree[b].end)) return false;
    ++*tests;
    return VolumeNodes::overlap(a, b);
  }
};

/// Section 3.1: what the pruning of Lotan, Schwarzer, Halperin and Latombe (2002) leaves out where
/// few joints move, chosen at random by the seed. Their boxes are oriented; these are not.
Numbers pruned(int edge, std::size_t joints, std::uint64_t seed) {
  const std::vector<Capsule> links = linksOf(makeChain(Chain::kRandom, edge));
  const BinaryTree tree(alongChain(links.size()));
  std::vector<AxisBox> boxes(tree.size());
  fitVolumes(tree, links, boxes);
  std::vector<std::int32_t> moved(links.size());
  std::vector<std::size_t> all(links.size() - 1);
  std::iota(all.begin(), all.end(), 1);
  std::shuffle(all.begin(), all.end(), std::mt19937_64(seed));
  joints = std::min(joints, all.size());
  for (std::size_t i = 0; i < joints; ++i) moved[all[i]] = 1;
  std::partial_sum(moved.begin(), moved.end(), moved.begin());

  // Pairs between which no joint has moved are what they were.
  double found = 0, wanted = 0;
  const auto countNew = [&](double& count) {
    return [&](std::int32_t a, std::int32_t b) {
      const auto before = [&](std::int32_t leaf) {
        return moved[static_cast<std::size_t>(tree[leaf].begin)];
      };
      count += before(a) != before(b) ? 1 : 0;
    };
  };
  std::size_t tests = 0;
  const PrunedNodes nodes{{tree, boxes}, moved, &tests};
  PlainSelfQuery(nodes, 0, countNew(found));
  const PlainSelfQuery every(VolumeNodes<AxisBox>{tree, boxes}, 0, countNew(wanted));
  if (found != wanted) throw std::logic_error("chain-claims: pruning has lost pairs");
  double refitted = 0, inner = 0;
  for (std::size_t i = 0; i < tree.size(); ++i) {
    const BinaryTree::Node& node = tree[static_cast<std::int32_t>(i)];
    if (node.isLeaf()) continue;
    ++inner;
    if (!nodes.isRigid(node.begin, node.end)) ++refitted;
  }
  return {{"joints", static_cast<double>(joints)},
          {"refitted", refitted / inner},
          {"tests", static_cast<double>(tests) / static_cast<double>(every.volumeTests())}};
}

/// @param count  makes the numbers of a run, from 1
void addCount(const std::string& name, int runs,
              const std::function<Numbers(std::uint64_t run)>& count) {
  registerRuns(name, runs, [=, run = std::uint64_t{0}](Numbers& numbers) mutable {
    numbers = count(++run);
    return 0.0;
  });
}

bool measureChainClaims(const Request&) {
  constexpr int kSeeds = 20;
  for (const int edge : {4, 8, 16, 32, 48}) {
    const std::string name = "edge:" + std::to_string(edge);
    addCount("Neighbors/random/" + name, 1, [=](auto) { return neighbors(Chain::kRandom, edge); });
    addCount("Neighbors/snake/" + name, 1, [=](auto) { return neighbors(Chain::kSnake, edge); });
    addCount("Kept/" + name, 1, [=](auto) { return keptTrees(edge); });
  }
  for (const std::size_t joints : {1u, 10u, 100u, 1000u, 1000000u}) {
    addCount("Pruned/joints:" + std::to_string(joints), kSeeds,
             [=](std::uint64_t seed) { return pruned(32, joints, seed); });
  }
  return runRegistered();
}

const AddMeasure kMeasure("chain-claims", measureChainClaims);

}  // namespace

}  // namespace fcl_fibers::benchmarks
