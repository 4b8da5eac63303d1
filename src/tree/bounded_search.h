// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "tree/search.h"

namespace fcl_fibers::tree {

/// How far a search goes down.
struct Bound {
  /// Nodes smaller than this across are not opened; in the frame of the first tree and the second.
  double a_resolution = 0, b_resolution = 0;
  /// Volumes that are tested against a volume, at most.
  std::size_t tests = 0;
};

/// A part of a tree: leaves [begin, end) of its topology.
struct LeafRange {
  std::int32_t begin, end;
};

/// Where a bounded search brings what it does not open.
class UnresolvedSink {
 public:
  /// Pairs of one of a's segments and one of b's, which are of the first tree and the second.
  virtual Visit between(LeafRange a, LeafRange b) = 0;
  /// Pairs of these.
  virtual Visit within(LeafRange range) = 0;

 protected:
  ~UnresolvedSink() = default;
};

/// Pairs whose volumes overlap, as Search::overlaps() finds them, but level by level, so that what
/// is spent is spent on the coarse first. Each pair of segments whose volumes overlap is written
/// to `out` or in one of the unresolved pieces, never twice.
///
/// By the least instruction set of the platform and without batches: a test costs about three times
/// what it costs in Search.
template <class Tree>
struct BoundedSearch {
  using Two = typename Search<Tree>::Two;

  static Visit overlaps(const Tree& tree, const Bound& bound, PairBuffer& out,
                        UnresolvedSink& unresolved);
  static Visit overlaps(const Two& trees, const Bound& bound, PairBuffer& out,
                        UnresolvedSink& unresolved);
};

extern template struct BoundedSearch<LayeredBoxTree<2>>;
extern template struct BoundedSearch<LayeredBoxTree<8>>;
extern template struct BoundedSearch<WrappedSphereTree<2>>;
extern template struct BoundedSearch<WrappedSphereTree<8>>;

}  // namespace fcl_fibers::tree
