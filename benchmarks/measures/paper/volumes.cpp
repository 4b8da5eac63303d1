// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "harness/runs.h"
#include "measures.h"
#include "measures/paper/bounding_volumes.h"
#include "measures/paper/oriented_boxes.h"
#include "measures/paper/tree_scene.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 3;
/// What takes more seconds is measured once.
constexpr double kSlow = 20;
/// So few segments are judged by all their pairs, and all their volumes by what they enclose.
constexpr std::size_t kMostOfAllPairs = 2000;
/// The radius of what may only just stick into a volume, relative to that of the capsule.
constexpr double kSpeck = 1e-3;

/// A tree of the paper's and the capsules that its volumes enclose.
struct ChainTree {
  template <int Arity>
  ChainTree(std::string tree_name, const tree::Topology<Arity>& topology,
            const std::vector<Capsule>& by_id, const std::vector<std::uint32_t>& next_by_id)
      : name(std::move(tree_name)), tree(topology) {
    std::vector<std::int32_t> leaf_of(by_id.size());
    for (const tree::SegmentId id : topology.leaves) {
      leaf_of[static_cast<std::size_t>(id)] = static_cast<std::int32_t>(capsules.size());
      capsules.push_back(by_id[static_cast<std::size_t>(id)]);
    }
    for (const tree::SegmentId id : topology.leaves) {
      next.push_back(leaf_of[next_by_id[static_cast<std::size_t>(id)]]);
    }
    thick = thickened(capsules);
  }

  /// Neighbours in a fiber always touch at their joint, and no manager reports them.
  bool areNeighbors(std::int32_t a, std::int32_t b) const {
    return next[static_cast<std::size_t>(a)] == b || next[static_cast<std::size_t>(b)] == a;
  }
  bool touch(std::int32_t a, std::int32_t b) const {
    return contact(capsules[static_cast<std::size_t>(a)], capsules[static_cast<std::size_t>(b)]) ==
           Contact::kTouching;
  }

  std::string name;
  BinaryTree tree;
  std::vector<Capsule> capsules;   ///< by leaf
  std::vector<Capsule> thick;      ///< by leaf, see thickened()
  std::vector<std::int32_t> next;  ///< by leaf: the next one in the fiber, or itself

  PairList touching;  ///< of leaves that every kind has to find, neighbours too, in order
};

/// The pairs that touch among those whose volumes overlap, in order.
template <class Volume>
PairList touchingPairs(const ChainTree& chains) {
  std::vector<Volume> volumes(chains.tree.size());
  fitVolumes(chains.tree, chains.thick, volumes);
  PairList pairs;
  const auto visit = [&](std::int32_t a, std::int32_t b) {
    if (chains.touch(a, b)) pairs.push_back(std::minmax(a, b));
  };
  queryItself(chains.tree, volumes, visit);
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// Finds what every kind is checked against: by all pairs if they are few, else by boxes.
void judge(ChainTree& chains) {
  tools::progress("volumes: judge " + chains.name);
  if (chains.capsules.size() <= kMostOfAllPairs) {
    const auto count = static_cast<std::int32_t>(chains.capsules.size());
    for (std::int32_t a = 0; a < count; ++a) {
      for (std::int32_t b = a + 1; b < count; ++b) {
        if (chains.touch(a, b)) chains.touching.emplace_back(a, b);
      }
    }
  } else {
    chains.touching = touchingPairs<AxisBox>(chains);
  }
}

/// Whether every volume reaches to the surface of all capsules below, seen by specks on the balls
/// at their ends. Touching pairs alone would not tell of loose volumes that are a little too small.
template <class Volume>
bool reachesSurfaces(const ChainTree& chains) {
  std::vector<Volume> volumes(chains.tree.size());
  fitVolumes(chains.tree, chains.thick, volumes);
  for (std::size_t i = 0; i < chains.tree.size(); ++i) {
    const BinaryTree::Node& node = chains.tree[static_cast<std::int32_t>(i)];
    for (std::int32_t leaf = node.begin; leaf < node.end; ++leaf) {
      const Capsule& c = chains.capsules[static_cast<std::size_t>(leaf)];
      for (const auto& signs : SlabDirections<true, true>::all()) {
        const fcl::Vector3d reach =
            c.radius * fcl::Vector3d(signs[0], signs[1], signs[2]).normalized();
        for (const fcl::Vector3d* end : {&c.from, &c.to}) {
          for (const fcl::Vector3d& speck :
               {fcl::Vector3d(*end + reach), fcl::Vector3d(*end - reach)}) {
            const Capsule small{speck, speck, kSpeck * c.radius};
            if (!overlaps(volumes[i], Volume::around(small))) return false;
          }
        }
      }
    }
  }
  return true;
}

/// What is wrong with a kind of volume and the touching pairs that it finds; empty if it is right.
template <class Volume>
std::string errorOf(const ChainTree& chains) {
  const PairList found = touchingPairs<Volume>(chains);
  if (std::adjacent_find(found.begin(), found.end()) != found.end()) return "finds a pair twice";
  if (const std::size_t missed = countWithout(chains.touching, found); missed > 0) {
    return "misses " + std::to_string(missed) + " of " + std::to_string(chains.touching.size()) +
           " touching pairs";
  }
  if (chains.capsules.size() <= kMostOfAllPairs && !reachesSurfaces<Volume>(chains)) {
    return "does not enclose all capsules";
  }
  if (const std::size_t more = countWithout(found, chains.touching); more > 0) {
    return "finds " + std::to_string(more) + " touching pairs that boxes miss";
  }
  return "";
}

/// Fits all volumes and makes one query. It ends at leaves whose volumes overlap, because the exact
/// test behind it is the same for all kinds.
template <class Volume>
double measure(const ChainTree& chains, Numbers& numbers) {
  // Their memory is there before, as when fibers move and their tree is updated.
  std::vector<Volume> volumes(chains.tree.size());
  const double fit = seconds([&] { fitVolumes(chains.tree, chains.thick, volumes); });
  std::size_t tests = 0, leaf_pairs = 0;
  const double detection = seconds([&] {
    const auto visit = [&](std::int32_t a, std::int32_t b) {
      if (!chains.areNeighbors(a, b)) ++leaf_pairs;
    };
    tests = queryItself(chains.tree, volumes, visit);
  });
  numbers = {{"segments", static_cast<double>(chains.capsules.size())},
             {"volume_tests", static_cast<double>(tests)},
             {"leaf_pairs", static_cast<double>(leaf_pairs)},
             {"bytes", static_cast<double>(sizeof(Volume))},
             {"fit", fit},
             {"detection", detection}};
  return fit + detection;
}

/// Returns whether the kind is right, and measures it only then.
/// @param chains  borrowed until runRegistered() returns
template <class Volume>
bool registerKind(const ChainTree& chains, const std::string& kind) {
  const std::string name = "Volumes/" + chains.name + "/" + kind;
  tools::progress("check " + name);
  std::string error;
  const double taken = seconds([&] { error = errorOf<Volume>(chains); });
  if (!error.empty()) {
    return tellWrong(name + ": " + error);
  }
  registerRuns(name, taken > kSlow ? 1 : kRuns,
               [&chains](Numbers& numbers) { return measure<Volume>(chains, numbers); });
  return true;
}

bool registerKinds(const ChainTree& chains) {
  bool right = registerKind<AxisBox>(chains, "boxes");
  right &= registerKind<BoxByVolume>(chains, "boxes_by_volume");
  right &= registerKind<Polytope14>(chains, "polytopes_14");
  right &= registerKind<Polytope18>(chains, "polytopes_18");
  right &= registerKind<Polytope26>(chains, "polytopes_26");
  right &= registerKind<LayeredBall>(chains, "layered_spheres");
  right &= registerKind<WrappedBall>(chains, "wrapped_spheres");
  right &= registerKind<FittedOrientedBox>(chains, "oriented_boxes");
  right &= registerKind<LayeredOrientedBox>(chains, "layered_oriented_boxes");
  return right;
}

bool measureVolumes(const Request& request) {
  const tools::SceneSource source = openScene(request.scene.text, request.scene.radius);
  const MovingFibers fibers = movingFibers(source, request.scene.rows);
  const TreeScene scene(fibers);
  const std::vector<Capsule> capsules = fibers.capsules();
  const std::vector<std::uint32_t> next = fibers.nextInFiber();
  if (capsules.empty()) throw std::invalid_argument("--measure=volumes: the scene is empty");
  std::vector<ChainTree> trees;
  trees.emplace_back("super_thread", superThread(scene.fibers), capsules, next);
  trees.emplace_back("bundle", bundle(scene.fibers, scene.middles()), capsules, next);
  bool right = true;
  for (ChainTree& chains : trees) {
    judge(chains);
    right &= registerKinds(chains);
  }
  return runRegistered() && right;
}

const AddMeasure kMeasure("volumes", measureVolumes);

}  // namespace

}  // namespace fcl_fibers::benchmarks
