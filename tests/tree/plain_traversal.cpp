// SPDX-License-Identifier: BSD-3-Clause
#include "tree/plain_traversal.h"

#include "tree/traversal.h"

namespace fcl_fibers::tree::plain {
namespace {

using geometry::FrameChange;

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
  return tree::visitPairs(tree, query);
}
template <class Tree>
Visit visitPairs(const Tree& a, const Tree& b, const FrameChange& b_to_a, const FrameChange& a_to_b,
                 OverlapVisitor& visitor) {
  Overlapping query(visitor);
  return tree::visitPairs(a, b, b_to_a, a_to_b, AllGroups(), query);
}
template <class Tree>
Visit visitLeaves(const Tree& tree, const typename Tree::Volume& volume, OverlapVisitor& visitor) {
  Overlapping query(visitor);
  return tree::visitLeaves(tree, volume, query);
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
