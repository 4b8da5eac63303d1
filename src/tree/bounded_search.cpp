// SPDX-License-Identifier: BSD-3-Clause
#include "tree/bounded_search.h"

#include <utility>
#include <vector>

#include "tree/traversal.h"

namespace fcl_fibers::tree {
namespace {

template <class Tree>
Link linkOf(const Tree& tree, std::int32_t slot) {
  return tree.node(slot / Tree::kArity).children[static_cast<std::size_t>(slot % Tree::kArity)];
}

/// One step of the traversal: what is met on the next level is work for later.
template <class Tree>
struct Step : CountedOverlapAdmission {
  static constexpr bool kCuts = true;

  Step(const Tree& first, const Tree& second, PairBuffer& pairs)
      : a(first), b(second), out(pairs) {}

  bool cuts(std::int32_t, std::int32_t) { return !std::exchange(opens, false); }
  Visit work(const Work& piece) {
    if (piece.node == Work::kBetween) {
      const Link a_link = linkOf(a, piece.a_slot), b_link = linkOf(b, piece.b_slot);
      if (a_link.isLeaf() && b_link.isLeaf()) return leafPair(a_link.segment(), b_link.segment());
    }
    next_level.push_back(piece);
    return Visit::kContinue;
  }
  Visit leafPair(SegmentId first, SegmentId second) { return out.push(first, second); }

  const Tree& a;
  const Tree& b;
  PairBuffer& out;
  bool opens = false;  ///< whether the next piece is the one to be opened
  std::vector<Work> next_level;
};

template <class Tree>
class LevelByLevel {
 public:
  LevelByLevel(const Tree& a, const Tree& b, const Bound& bound, PairBuffer& out,
               UnresolvedSink& unresolved)
      : a_(a), b_(b), bound_(bound), unresolved_(unresolved), step_(a, b, out) {}

  /// @param open_roots  open_roots(step)
  /// @param open        open(work, step)
  template <class OpenRoots, class Open>
  Visit run(const OpenRoots& open_roots, const Open& open) {
    if (a_.empty() || b_.empty()) return Visit::kContinue;
    if (!mayOpen(a_.nodeVolume(0), b_.nodeVolume(0))) {
      return &a_ == &b_ ? unresolved_.within(all(a_)) : unresolved_.between(all(a_), all(b_));
    }
    if (open_roots(step_) == Visit::kStop) return Visit::kStop;
    for (std::vector<Work> level; !step_.next_level.empty();) {
      level.clear();
      std::swap(level, step_.next_level);
      for (const Work& work : level) {
        step_.opens = true;
        const Visit visit = mayOpen(work) ? open(work, step_) : leave(work);
        if (visit == Visit::kStop) return Visit::kStop;
      }
    }
    return Visit::kContinue;
  }

 private:
  using Volume = typename Tree::Volume;

  /// Tests of one step, at most: a volume against the children of one node, and each of these
  /// against the children of another.
  static constexpr std::size_t kStepTests = Tree::kArity * (Tree::kArity + 1);

  static LeafRange all(const Tree& tree) {
    return {0, static_cast<std::int32_t>(tree.topology().leaves.size())};
  }
  static LeafRange range(const Tree& tree, std::int32_t slot) {
    const auto& node = tree.node(slot / Tree::kArity);
    std::int32_t begin = node.leaf_begin;
    for (int lane = 0; lane < slot % Tree::kArity; ++lane) {
      begin += leafCount(tree, node.children[static_cast<std::size_t>(lane)]);
    }
    return {begin, begin + leafCount(tree, linkOf(tree, slot))};
  }

  bool mayOpen(const Volume& a, const Volume& b) const {
    return hasTestsLeft() && (isLarge(a, bound_.a_resolution) || isLarge(b, bound_.b_resolution));
  }
  bool mayOpen(const Work& work) const {
    if (!hasTestsLeft()) return false;
    if (work.node != Work::kBetween) return isLarge(a_.nodeVolume(work.node), bound_.a_resolution);
    return isLarge(a_, work.a_slot, bound_.a_resolution) ||
           isLarge(b_, work.b_slot, bound_.b_resolution);
  }
  bool hasTestsLeft() const {
    return step_.tests <= bound_.tests && bound_.tests - step_.tests >= kStepTests;
  }
  static bool isLarge(const Volume& volume, double resolution) {
    return !(double{volume.extent()} < resolution);
  }
  /// A leaf cannot be opened, however large.
  static bool isLarge(const Tree& tree, std::int32_t slot, double resolution) {
    const auto child = Child<Tree>::of(tree, slot);
    return !child.link.isLeaf() && isLarge(child.volume, resolution);
  }

  Visit leave(const Work& work) {
    if (work.node == Work::kBetween) {
      return unresolved_.between(range(a_, work.a_slot), range(b_, work.b_slot));
    }
    const auto& node = a_.node(work.node);
    return unresolved_.within({node.leaf_begin, node.leaf_end});
  }

  const Tree& a_;
  const Tree& b_;
  const Bound bound_;
  UnresolvedSink& unresolved_;
  Step<Tree> step_;
};

}  // namespace

template <class Tree>
Visit BoundedSearch<Tree>::overlaps(const Tree& tree, const Bound& bound, PairBuffer& out,
                                    UnresolvedSink& unresolved) {
  const auto open = [&](const Work& work, Step<Tree>& step) {
    return visitPairs(tree, work, step);
  };
  const auto open_root = [&](Step<Tree>& step) {
    step.opens = true;
    return visitPairs(tree, step);
  };
  return LevelByLevel<Tree>(tree, tree, bound, out, unresolved).run(open_root, open);
}

template <class Tree>
Visit BoundedSearch<Tree>::overlaps(const Two& trees, const Bound& bound, PairBuffer& out,
                                    UnresolvedSink& unresolved) {
  const auto open = [&](const Work& work, Step<Tree>& step) {
    return visitPairs(trees.a, trees.b, trees.b_to_a, trees.a_to_b, work, step);
  };
  const auto open_roots = [&](Step<Tree>& step) {
    return visitPairs(trees.a, trees.b, trees.b_to_a, trees.a_to_b, step);
  };
  return LevelByLevel<Tree>(trees.a, trees.b, bound, out, unresolved).run(open_roots, open);
}

template struct BoundedSearch<LayeredBoxTree<2>>;
template struct BoundedSearch<LayeredBoxTree<8>>;
template struct BoundedSearch<WrappedSphereTree<2>>;
template struct BoundedSearch<WrappedSphereTree<8>>;

}  // namespace fcl_fibers::tree
