// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_TREE_WIDE_OVERLAPS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_TREE_WIDE_OVERLAPS_INL_H
#undef FCL_FIBERS_TREE_WIDE_OVERLAPS_INL_H
#else
#define FCL_FIBERS_TREE_WIDE_OVERLAPS_INL_H
#endif

#include <algorithm>
#include <cstdint>

#include "simd/lanes-inl.h"
#include "tree/search.h"
#include "tree/traversal-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

using geometry::HWY_NAMESPACE::overlaps;
using simd::HWY_NAMESPACE::LaneNumbers;

/// Finds the overlapping pairs of a task on trees with eight children per node, many at a time.
///
/// In a recursion the branches after the tests cost more than the tests, because they cannot be
/// predicted. Here each step takes a batch of pairs of nodes and writes all pairs of children that
/// overlap, a whole mask at a time and without a branch. So the nodes of the next step are known
/// early enough to be prefetched.
template <class Pairing, class Trees>
class WideOverlaps {
  using TreeA = typename Pairing::TreeA;
  using TreeB = typename Pairing::TreeB;
  static_assert(TreeA::kArity == 8 && TreeB::kArity == 8);

 public:
  /// @param trees  those of the pairing
  WideOverlaps(const Pairing& pairing, const Trees& trees, PairBuffer& out)
      : trees_(trees),
        a_(pairing.a),
        b_(pairing.b),
        b_to_a_(pairing.b_to_a),
        a_to_b_(pairing.a_to_b),
        filter_(pairing.filter),
        out_(out) {}

  Visit run(const TraversalTask& task) {
    if (task.node == TraversalTask::kCross) {
      waiting_[count_++] = {task.a_slot, task.b_slot};
      return drain();
    }
    if (a_.empty() || b_.empty()) return Visit::kContinue;
    if constexpr (kIsPair<Trees>) {
      // The root's volume is in no pack, so the search starts with the children of b's root.
      for (int lane = 0; lane < b_.node(0).child_count; ++lane) openA(0, lane);
    } else {
      const std::int32_t node = task.node == TraversalTask::kAll ? 0 : task.node;
      if (overlapSelf(node) == Visit::kStop) return Visit::kStop;
    }
    return drain();
  }

 private:
  static constexpr int kBatch = 32;       ///< pairs opened at a time
  static constexpr int kCapacity = 2048;  ///< waiting pairs; each may lead to 64 more

  /// Two overlapping children, to be opened.
  struct Slots {
    std::int32_t a, b;
  };
  /// A child in A, to be tested against all children of a node in B.
  struct Row {
    std::int32_t a_slot, b_node;
  };

  // Slots are never negative. A division of signed numbers would have to allow for that.
  template <class Tree>
  FCL_FIBERS_ALWAYS_INLINE static Link link(const Tree& tree, std::int32_t slot) {
    return tree.node(slot >> 3).children[static_cast<std::size_t>(slot & 7)];
  }
  template <class Tree>
  FCL_FIBERS_ALWAYS_INLINE static typename Tree::Volume volume(const Tree& tree,
                                                               std::int32_t slot) {
    return tree.pack(slot >> 3).get(slot & 7);
  }
  template <class Tree>
  FCL_FIBERS_ALWAYS_INLINE static void prefetch(const Tree& tree, Link link) {
    if (!link.isLeaf()) tree.prefetch(link.node());
  }

  Visit overlapSelf(std::int32_t index) {
    const auto& node = a_.node(index);
    const auto slots = LaneNumbers::from(8 * index);
    const auto segments = LaneNumbers::inverse(node.links());
    const bool only_leaves = node.hasOnlyLeaves();
    for (int lane = 0; lane < node.child_count; ++lane) {
      const auto later = simd::firstLanes(node.child_count) & ~simd::firstLanes(lane + 1);
      const std::int32_t slot = 8 * index + lane;
      const auto mask = overlaps(a_.pack(index), a_.pack(index).get(lane)) & later &
                        filter_.lanesOfB(slot, index);
      const Link child = node.children[static_cast<std::size_t>(lane)];
      if (only_leaves) {
        if (writeSegments(child.segment(), segments, mask) == Visit::kStop) return Visit::kStop;
        continue;
      }
      count_ += slots.writeAfter(slot, mask, waiting_ + count_);
      if (count_ >= kCapacity / 2 && drain() == Visit::kStop) return Visit::kStop;
      if (!child.isLeaf() && filter_.passesSelf(slot) &&
          overlapSelf(child.node()) == Visit::kStop) {
        return Visit::kStop;
      }
    }
    return Visit::kContinue;
  }

  Visit drain() {
    while (count_ > 0) {
      const int batch = std::min({kBatch, count_, (kCapacity - count_) / 64});
      if ((batch > 0 ? openBatch(batch) : visitLast()) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }

  /// Finds the pairs below the last waiting pair one by one, if there is no room for more.
  Visit visitLast() {
    const Slots last = waiting_[--count_];
    return visitOneByOne(trees_, last.a, last.b, out_);
  }

  Visit openBatch(int size) {
    count_ -= size;
    Slots batch[kBatch];
    std::copy_n(waiting_ + count_, size, batch);
    for (int i = 0; i < size; ++i) {
      prefetch(a_, link(a_, batch[i].a));
      prefetch(b_, link(b_, batch[i].b));
    }
    row_count_ = leaf_row_count_ = 0;
    for (int i = 0; i < size; ++i) {
      if (open(batch[i]) == Visit::kStop) return Visit::kStop;
    }
    for (int i = 0; i < leaf_row_count_; ++i) {
      a_to_b_.prefetchLeaf(link(a_, leaf_rows_[i].a_slot).segment());
    }
    for (int i = 0; i < row_count_; ++i) {
      if (openB(rows_[i].a_slot, rows_[i].b_node) == Visit::kStop) return Visit::kStop;
    }
    for (int i = 0; i < leaf_row_count_; ++i) {
      if (openLeaves(leaf_rows_[i].a_slot, leaf_rows_[i].b_node) == Visit::kStop) {
        return Visit::kStop;
      }
    }
    return Visit::kContinue;
  }

  /// Like PairTraversal::visitCross().
  FCL_FIBERS_ALWAYS_INLINE Visit open(const Slots& slots) {
    const Link a = link(a_, slots.a), b = link(b_, slots.b);
    if (b.isLeaf()) {
      return a.isLeaf() ? out_.push(a.segment(), b.segment()) : openA(a.node(), slots.b);
    }
    if (a.isLeaf()) return addRow(slots.a, b.node());

    const auto& a_node = a_.node(a.node());
    const auto& b_node = b_.node(b.node());
    const auto b_volume = volume(b_, slots.b);
    const auto& b_in_a = b_to_a_(b_volume);
    const bool only_leaves = a_node.hasOnlyLeaves() && b_node.hasOnlyLeaves();
    if (!only_leaves) {
      constexpr float kLikeSize = 4;
      const float a_size = volume(a_, slots.a).size(), b_size = b_in_a.size();
      if (a_size > kLikeSize * b_size) return openA(a.node(), slots.b);
      if (b_size > kLikeSize * a_size) return addRow(slots.a, b.node());
    }
    const auto mask = overlaps(a_.pack(a.node()), b_in_a) & filter_.lanesOfA(slots.b, a.node());
    const auto slots_of_a = LaneNumbers::from(8 * a.node());
    if (only_leaves) {
      leaf_row_count_ += slots_of_a.writeBefore(b.node(), mask, leaf_rows_ + leaf_row_count_);
    } else {
      row_count_ += slots_of_a.writeBefore(b.node(), mask, rows_ + row_count_);
    }
    return Visit::kContinue;
  }

  FCL_FIBERS_ALWAYS_INLINE Visit addRow(std::int32_t a_slot, std::int32_t b_node) {
    rows_[row_count_++] = {a_slot, b_node};
    return Visit::kContinue;
  }

  Visit openA(std::int32_t index, std::int32_t b_slot) {
    const auto& node = a_.node(index);
    const auto mask = overlaps(a_.pack(index), b_to_a_(volume(b_, b_slot))) &
                      simd::firstLanes(node.child_count) & filter_.lanesOfA(b_slot, index);
    count_ += LaneNumbers::from(8 * index).writeBefore(b_slot, mask, waiting_ + count_);
    return Visit::kContinue;
  }

  FCL_FIBERS_ALWAYS_INLINE Visit openB(std::int32_t a_slot, std::int32_t index) {
    const auto& node = b_.node(index);
    const Link a = link(a_, a_slot);
    const auto mask = overlaps(b_.pack(index), inB(a, a_slot)) & filter_.lanesOfB(a_slot, index);
    if (a.isLeaf() && node.hasOnlyLeaves()) {
      return writeSegments(a.segment(), LaneNumbers::inverse(node.links()), mask);
    }
    count_ += LaneNumbers::from(8 * index).writeAfter(a_slot, mask, waiting_ + count_);
    return Visit::kContinue;
  }

  /// @pre the child in A and all children of the node in B are leaves
  FCL_FIBERS_ALWAYS_INLINE Visit openLeaves(std::int32_t a_slot, std::int32_t index) {
    const SegmentId a = link(a_, a_slot).segment();
    const auto mask = overlaps(b_.pack(index), a_to_b_.ofLeaf(a, volume(a_, a_slot))) &
                      filter_.lanesOfB(a_slot, index);
    return writeSegments(a, LaneNumbers::inverse(b_.node(index).links()), mask);
  }

  /// The volume of a child in A, in B's frame.
  FCL_FIBERS_ALWAYS_INLINE typename TreeB::Volume inB(Link a, std::int32_t a_slot) const {
    if (a.isLeaf()) return a_to_b_.ofLeaf(a.segment(), volume(a_, a_slot));
    return a_to_b_(volume(a_, a_slot));
  }

  FCL_FIBERS_ALWAYS_INLINE Visit writeSegments(SegmentId a, const LaneNumbers& b,
                                               simd::LaneMask mask) {
    return out_.written(b.writeAfter(a, mask, out_.room()));
  }

  const Trees& trees_;
  const TreeA& a_;
  const TreeB& b_;
  const decltype(Pairing::b_to_a)& b_to_a_;
  const decltype(Pairing::a_to_b)& a_to_b_;
  const decltype(Pairing::filter) filter_;
  PairBuffer& out_;
  int count_ = 0;
  int row_count_ = 0, leaf_row_count_ = 0;
  // Writing a whole mask needs room for eight more.
  Slots waiting_[kCapacity + 8];
  Row rows_[8 * kBatch + 8];
  Row leaf_rows_[8 * kBatch + 8];
};

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
