// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "geometry/frame.h"
#include "tree/fiber_tree.h"
#include "tree/work.h"

namespace fcl_fibers::tree {

struct Pair {
  SegmentId a, b;
};

/// Where a search writes the pairs it finds.
class PairBuffer {
 public:
  /// Pairs that may be written at once.
  static constexpr std::size_t kRoom = 8;

  FCL_FIBERS_ALWAYS_INLINE Visit push(SegmentId a, SegmentId b) {
    *next_++ = {a, b};
    return endOfPairs();
  }

  /// Where up to eight pairs may be written, of which `count` are then said to be there.
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

  /// Makes room.
  virtual Visit full() = 0;

  Pair* next_ = nullptr;
  Pair* end_ = nullptr;  ///< from here on there is room for eight more, and no sooner is it full

 private:
  FCL_FIBERS_ALWAYS_INLINE Visit endOfPairs() { return next_ >= end_ ? full() : Visit::kContinue; }
};

/// Where a search for the nearest pair brings those that are nearer than `limit`, which it may
/// lower. Lengths are in the frame of the (first) tree.
class NearestVisitor {
 public:
  virtual Visit visit(SegmentId a, SegmentId b, double& limit) = 0;

 protected:
  ~NearestVisitor() = default;
};

/// Where a search brings pieces of work.
class WorkSink {
 public:
  virtual Visit take(const Work& work) = 0;

 protected:
  ~WorkSink() = default;
};

/// The traversals of traversal-inl.h for the best instruction set of this machine, all with the
/// same pairs in the same order. In those of one volume, b of each pair is `second`, and segments
/// of `group` are left out. Two trees do not know each other's groups.
template <class Tree>
struct Search {
  using Volume = typename Tree::Volume;
  using FrameChange = geometry::FrameChange;
  /// Two trees and their frames.
  struct Two {
    const Tree& a;
    const Tree& b;
    const FrameChange& b_to_a;
    const FrameChange& a_to_b;
  };

  /// Pairs whose volumes overlap: cut() hands out the work in pieces, of which each overlaps() does
  /// one.
  static Visit cut(const Tree& tree, WorkSink& out);
  static Visit cut(const Two& trees, WorkSink& out);
  static Visit overlaps(const Tree& tree, const Work& work, PairBuffer& out);
  static Visit overlaps(const Two& trees, const Work& work, PairBuffer& out);

  /// Pairs whose first volume overlaps this one.
  static Visit overlaps(const Tree& tree, const Volume& volume, SegmentId second, Group group,
                        PairBuffer& out);

  /// Pairs nearer than `limit`, roughly the nearest first.
  static Visit nearest(const Tree& tree, double limit, NearestVisitor& visitor);
  static Visit nearest(const Two& trees, double limit, NearestVisitor& visitor);
  static Visit nearest(const Tree& tree, const Volume& volume, SegmentId second, Group group,
                       double limit, NearestVisitor& visitor);
};

extern template struct Search<LayeredBoxTree<2>>;
extern template struct Search<LayeredBoxTree<8>>;
extern template struct Search<WrappedSphereTree<2>>;
extern template struct Search<WrappedSphereTree<8>>;

}  // namespace fcl_fibers::tree
