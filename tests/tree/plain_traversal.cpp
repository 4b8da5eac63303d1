// SPDX-License-Identifier: BSD-3-Clause
#include "tree/plain_traversal.h"

#include <type_traits>

#include "tree/traversal-inl.h"

namespace fcl_fibers::tree::plain {
namespace {

using geometry::FrameChange;
using HWY_NAMESPACE::OverlapTest;
using HWY_NAMESPACE::PairTraversal;
using HWY_NAMESPACE::withAnyPairing;

struct Overlapping : OverlapTest {
  explicit Overlapping(OverlapVisitor& visitor) : to(visitor) {}

  Visit leafPair(SegmentId a, SegmentId b) { return to.leafPair(a, b); }
  Visit leaf(SegmentId a) { return to.leaf(a); }

  OverlapVisitor& to;
};

}  // namespace

template <class Tree>
Visit visitPairs(const Tree& tree, OverlapVisitor& visitor) {
  Overlapping query(visitor);
  if (tree.empty()) return Visit::kContinue;
  return withAnyPairing<HWY_NAMESPACE::Inlined>(tree, [&](const auto& pairing) {
    return PairTraversal<std::decay_t<decltype(pairing)>, Overlapping>(pairing, query).visitSelf(0);
  });
}
template <class Tree>
Visit visitPairs(const Tree& a, const Tree& b, const FrameChange& b_to_a, const FrameChange& a_to_b,
                 OverlapVisitor& visitor) {
  Overlapping query(visitor);
  if (a.empty() || b.empty()) return Visit::kContinue;
  const TreePair<Tree> two{a, b, b_to_a, a_to_b};
  const HWY_NAMESPACE::ChangingPairing pairing(two, b_to_a, a_to_b);
  return PairTraversal<std::decay_t<decltype(pairing)>, Overlapping>(pairing, query).visitBoth();
}
template <class Tree>
Visit visitLeaves(const Tree& tree, const typename Tree::Volume& volume, OverlapVisitor& visitor) {
  Overlapping query(visitor);
  return HWY_NAMESPACE::visitLeaves(tree, volume, query);
}

#define FCL_FIBERS_TRAVERSALS(TREE)                                                           \
  template Visit visitPairs(const TREE&, OverlapVisitor&);                                    \
  template Visit visitPairs(const TREE&, const TREE&, const FrameChange&, const FrameChange&, \
                            OverlapVisitor&);                                                 \
  template Visit visitLeaves(const TREE&, const TREE::Volume&, OverlapVisitor&)
FCL_FIBERS_TRAVERSALS(LayeredBoxTree<2>);
FCL_FIBERS_TRAVERSALS(LayeredBoxTree<8>);
FCL_FIBERS_TRAVERSALS(WrappedSphereTree<2>);
FCL_FIBERS_TRAVERSALS(WrappedSphereTree<8>);
#undef FCL_FIBERS_TRAVERSALS

}  // namespace fcl_fibers::tree::plain
