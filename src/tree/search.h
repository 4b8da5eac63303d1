// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "simd/always_inline.h"
#include "tree/topology.h"
#include "tree/traversal_task.h"
#include "tree/tree_pair.h"

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

// Searches of one tree (`Trees` is Tree) or of two (`Trees` is a TreePair, whose first tree has the
// frame of all lengths). All instruction sets find the same pairs in the same order.

/// The tasks that visitOverlaps() does have at most so many leaves on either side. So its batches
/// fill. This is the size of a full node three levels above the leaves.
constexpr std::int32_t kLeastGrain = 512;

/// Splits a task of a search for pairs whose volumes overlap into tasks of at most `grain` leaves
/// on either side, in the order of their pairs. Tasks that are split again, with a smaller grain,
/// are those that one split would have made.
/// @param grain  kLeastGrain or more
template <class Trees>
Visit splitIntoTasks(const Trees& trees, const TraversalTask& task, std::int32_t grain,
                     TaskSink& out);
/// Visits the pairs of a task, in an order that depends on the task.
/// @pre the task is one of those with kLeastGrain, or is all pairs of trees that are no larger
template <class Trees>
Visit visitOverlaps(const Trees& trees, const TraversalTask& task, PairBuffer& out);

/// Visits the pairs nearer than `limit`, roughly the nearest first.
template <class Trees>
Visit visitNearest(const Trees& trees, double limit, NearestVisitor& visitor);

/// Visit pairs with one volume alike. b of each pair is `second`, and segments of `group` are left
/// out.
///@{
template <class Tree>
Visit visitOverlaps(const Tree& tree, const typename Tree::Volume& volume, SegmentId second,
                    Group group, PairBuffer& out);
template <class Tree>
Visit visitNearest(const Tree& tree, const typename Tree::Volume& volume, SegmentId second,
                   Group group, double limit, NearestVisitor& visitor);
///@}

/// Calls visit(segment) for the leaves whose volumes overlap a volume, until it returns
/// Visit::kStop.
template <class Tree, class F>
Visit visitOverlapping(const Tree& tree, const typename Tree::Volume& volume, F&& visit) {
  constexpr std::size_t kCapacity = 64;
  struct Each final : PairBuffer {
    explicit Each(F& f) : visit_each(f) { restart(); }
    Visit full() override {
      for (const Pair* pair = found; pair != next_; ++pair) {
        if (visit_each(pair->a) == Visit::kStop) return Visit::kStop;
      }
      // The first one may be all that is looked for.
      if (limit < kCapacity) limit *= 2;
      restart();
      return Visit::kContinue;
    }
    void restart() {
      next_ = found;
      end_ = found + limit;
    }

    F& visit_each;
    std::size_t limit = 1;
    Pair found[kCapacity + kRoom];
  } each(visit);
  return visitOverlaps(tree, volume, 0, kNoGroup, each) == Visit::kStop ? Visit::kStop
                                                                        : each.full();
}

}  // namespace fcl_fibers::tree
