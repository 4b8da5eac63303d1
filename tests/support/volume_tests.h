// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <type_traits>

#include "tree/traversal-inl.h"

namespace fcl_fibers::test {

/// What a plain traversal for overlapping pairs does.
struct VolumeTests : tree::HWY_NAMESPACE::OverlapTest {
  template <class Pack, class Volume, class F>
  tree::Visit forEachPassing(const Pack& pack, tree::HWY_NAMESPACE::FrameOf frame,
                             const Volume& volume, simd::LaneMask lanes, F&& visit) {
    tests += static_cast<std::size_t>(__builtin_popcount(lanes));
    return OverlapTest::forEachPassing(pack, frame, volume, lanes, visit);
  }
  tree::Visit leafPair(tree::SegmentId, tree::SegmentId) {
    ++pairs;
    return tree::Visit::kContinue;
  }

  std::size_t tests = 0;  ///< volumes tested against a volume
  std::size_t pairs = 0;  ///< of segments whose volumes overlap
};

/// The pairs of a whole tree.
constexpr tree::TraversalTask kWholeTree = {0, 0, 0};

/// Visits the pairs of a task within a tree.
template <class Tree, class Query>
tree::Visit visitTask(const Tree& tree, const tree::TraversalTask& task, Query& query) {
  return tree::HWY_NAMESPACE::withPairing(tree, [&](const auto& pairing) {
    using Pairing = std::decay_t<decltype(pairing)>;
    return tree::HWY_NAMESPACE::PairTraversal<Pairing, Query>(pairing, query).run(task);
  });
}

template <class Tree>
VolumeTests countVolumeTests(const Tree& tree) {
  VolumeTests count;
  if (!tree.empty()) visitTask(tree, kWholeTree, count);
  return count;
}

}  // namespace fcl_fibers::test
