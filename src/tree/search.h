// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "geometry/frame.h"
#include "tree/bvh.h"
#include "tree/moving_tree.h"
#include "tree/traversal_task.h"

namespace fcl_fibers::tree {

struct Pair {
  SegmentId a, b;
};

/// A search writes the pairs that it finds here.
class PairBuffer {
 public:
  /// The number of pairs that may be written at once.
  static constexpr std::size_t kRoom = 8;

  FCL_FIBERS_ALWAYS_INLINE Visit push(SegmentId a, SegmentId b) {
    *next_++ = {a, b};
    return endOfPairs();
  }

  /// Up to eight pairs may be written at room(); written() then counts those that were.
  FCL_FIBERS_ALWAYS_INLINE Pair* room() { return next_; }
  FCL_FIBERS_ALWAYS_INLINE Visit written(int count) {
    next_ += count;
    return endOfPairs();
  }

 protected:
  PairBuffer() = default;
  ~PairBuffer() = default;
  PairBuffer(const PairBuffer&) = default;
  PairBuffer& operator=(const PairBuffer&) = default;

  /// Called when the buffer is full, to make room.
  virtual Visit full() = 0;

  Pair* next_ = nullptr;
  Pair* end_ = nullptr;  ///< the buffer is full from here on; eight more pairs still fit

 private:
  FCL_FIBERS_ALWAYS_INLINE Visit endOfPairs() { return next_ >= end_ ? full() : Visit::kContinue; }
};

/// Receives the pairs that are nearer than `limit`, and may lower `limit`. Lengths are in the frame
/// of the tree, or of the first tree of two.
class NearestVisitor {
 public:
  virtual Visit visit(SegmentId a, SegmentId b, double& limit) = 0;

 protected:
  ~NearestVisitor() = default;
};

class TaskSink {
 public:
  virtual Visit take(const TraversalTask& task) = 0;

 protected:
  ~TaskSink() = default;
};

/// Two trees and the changes between their frames. Their groups are independent.
template <class Tree>
struct TreePair {
  const Tree& a;
  const Tree& b;
  const geometry::FrameChange& b_to_a;
  const geometry::FrameChange& a_to_b;
};

/// Searches for pairs of one tree (`Trees` is Tree) or of two trees (TreePair<Tree>).
template <class Trees>
struct PairKernels {
  /// splitIntoTasks() hands out the tasks of a search for pairs whose volumes overlap; overlaps()
  /// does one of them.
  Visit (*splitIntoTasks)(const Trees& trees, TaskSink& out);
  Visit (*overlaps)(const Trees& trees, const TraversalTask& task, PairBuffer& out);
  /// Finds the pairs nearer than `limit`, roughly the nearest first.
  Visit (*nearest)(const Trees& trees, double limit, NearestVisitor& visitor);
};

/// The traversals of traversal-inl.h for one instruction set. All instruction sets find the same
/// pairs in the same order. In searches with one volume, b of each pair is `second`, and segments
/// of `group` are left out.
template <class Tree>
struct Kernels {
  using Volume = typename Tree::Volume;

  PairKernels<Tree> self;
  PairKernels<TreePair<Tree>> cross;
  Visit (*overlapsVolume)(const Tree& tree, const Volume& volume, SegmentId second, Group group,
                          PairBuffer& out);
  Visit (*nearestVolume)(const Tree& tree, const Volume& volume, SegmentId second, Group group,
                         double limit, NearestVisitor& visitor);
};

/// The kernels for the instruction set in use (simd/dispatch.h). A tree that moves has no search
/// for what is nearest. Fetch them once for each query.
template <class Tree>
const Kernels<Tree>& kernels();
template <>
const Kernels<LayeredBoxTree<2>>& kernels();
template <>
const Kernels<LayeredBoxTree<8>>& kernels();
template <>
const Kernels<WrappedSphereTree<2>>& kernels();
template <>
const Kernels<WrappedSphereTree<8>>& kernels();

template <>
const Kernels<MovingTree<2>>& kernels();
template <>
const Kernels<MovingTree<8>>& kernels();

template <class Tree>
const PairKernels<Tree>& pairKernels(const Tree& /*tree*/) {
  return kernels<Tree>().self;
}
template <class Tree>
const PairKernels<TreePair<Tree>>& pairKernels(const TreePair<Tree>& /*trees*/) {
  return kernels<Tree>().cross;
}

}  // namespace fcl_fibers::tree
