// SPDX-License-Identifier: BSD-3-Clause
#include "tree/search.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tree/search.cpp"
#include <hwy/foreach_target.h>

#include "tree/traversal-inl.h"
#include "tree/wide_overlaps-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

struct CollectPairs : OverlapAdmission {
  explicit CollectPairs(PairBuffer& buffer, SegmentId id = 0) : out(buffer), second(id) {}

  FCL_FIBERS_ALWAYS_INLINE Visit leafPair(SegmentId a, SegmentId b) { return out.push(a, b); }
  FCL_FIBERS_ALWAYS_INLINE Visit leaf(SegmentId a) { return out.push(a, second); }

  PairBuffer& out;
  SegmentId second;
};

struct CutWork : OverlapAdmission {
  /// Some microseconds of work, so that batches fill, and few enough for any number of threads to
  /// share. A full node three levels above the leaves.
  static constexpr std::int32_t kGrain = 512;
  static constexpr bool kCuts = true;

  explicit CutWork(WorkSink& sink) : out(sink) {}
  static bool cuts(std::int32_t a_leaves, std::int32_t b_leaves) {
    return a_leaves <= kGrain && b_leaves <= kGrain;
  }
  Visit work(const Work& piece) { return out.take(piece); }
  Visit leafPair(SegmentId, SegmentId) { return Visit::kContinue; }  // is work as well

  WorkSink& out;
};

struct VisitNearest : NearestAdmission {
  VisitNearest(double least, NearestVisitor& v, SegmentId id = 0)
      : NearestAdmission{least}, visitor(v), second(id) {}

  Visit leafPair(SegmentId a, SegmentId b) { return visitor.visit(a, b, limit); }
  Visit leaf(SegmentId a) { return visitor.visit(a, second, limit); }

  NearestVisitor& visitor;
  SegmentId second;
};

// What Search offers, for one instruction set.
template <class Tree>
struct TargetSearch {
  using Volume = typename Tree::Volume;
  using Two = typename Search<Tree>::Two;

  static Visit cutSelf(const Tree& tree, WorkSink& out) {
    CutWork query(out);
    return visitPairs(tree, query);
  }
  static Visit cutTwo(const Two& two, WorkSink& out) {
    CutWork query(out);
    return visitPairs(two.a, two.b, two.b_to_a, two.a_to_b, query);
  }
  static Visit overlapsSelf(const Tree& tree, const Work& work, PairBuffer& out) {
    constexpr geometry::SameFrame kSame;
    return internal::withGroups(tree, [&](auto meet) HWY_ATTR {
      return overlapsOf(tree, tree, kSame, kSame, meet, work, out);
    });
  }
  static Visit overlapsTwo(const Two& two, const Work& work, PairBuffer& out) {
    return overlapsOf(two.a, two.b, two.b_to_a, two.a_to_b, AllMeet(), work, out);
  }
  static Visit overlapsOne(const Tree& tree, const Volume& volume, SegmentId second, Group group,
                           PairBuffer& out) {
    CollectPairs query(out, second);
    return visitLeaves(tree, volume, query, group);
  }
  static Visit nearestSelf(const Tree& tree, double limit, NearestVisitor& visitor) {
    VisitNearest query(limit, visitor);
    return visitPairs(tree, query);
  }
  static Visit nearestTwo(const Two& two, double limit, NearestVisitor& visitor) {
    VisitNearest query(limit, visitor);
    return visitPairs(two.a, two.b, two.b_to_a, two.a_to_b, query);
  }
  static Visit nearestOne(const Tree& tree, const Volume& volume, SegmentId second, Group group,
                          double limit, NearestVisitor& visitor) {
    VisitNearest query(limit, visitor, second);
    return visitLeaves(tree, volume, query, group);
  }

  template <class Kernels>
  static Kernels kernels() {
    return {&cutSelf,     &cutTwo,      &overlapsSelf, &overlapsTwo,
            &overlapsOne, &nearestSelf, &nearestTwo,   &nearestOne};
  }

 private:
  /// The paper's binary tree is searched as published.
  template <class BToA, class AToB, class Meet>
  static Visit overlapsOf(const Tree& a, const Tree& b, const BToA& b_to_a, const AToB& a_to_b,
                          Meet meet, const Work& work, PairBuffer& out) {
    if constexpr (Tree::kArity == 2) {
      CollectPairs query(out);
      return internal::PairTraversal<Tree, Tree, CollectPairs, BToA, AToB, Meet>(
                 a, b, b_to_a, a_to_b, meet, query)
          .resume(work);
    } else {
      return WideOverlaps<Tree, BToA, AToB, Meet>(a, b, b_to_a, a_to_b, meet, out).run(work);
    }
  }
};

template <class Kernels, class Tree>
const Kernels& kernels() {
  static const Kernels kKernels = TargetSearch<Tree>::template kernels<Kernels>();
  return kKernels;
}

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "geometry/simd.h"

namespace fcl_fibers::tree {
namespace {

template <class Tree>
struct Kernels {
  using Two = typename Search<Tree>::Two;
  using Volume = typename Tree::Volume;

  Visit (*cutSelf)(const Tree&, WorkSink&);
  Visit (*cutTwo)(const Two&, WorkSink&);
  Visit (*overlapsSelf)(const Tree&, const Work&, PairBuffer&);
  Visit (*overlapsTwo)(const Two&, const Work&, PairBuffer&);
  Visit (*overlapsOne)(const Tree&, const Volume&, SegmentId, Group, PairBuffer&);
  Visit (*nearestSelf)(const Tree&, double, NearestVisitor&);
  Visit (*nearestTwo)(const Two&, double, NearestVisitor&);
  Visit (*nearestOne)(const Tree&, const Volume&, SegmentId, Group, double, NearestVisitor&);

  static const Kernels& best() {
    using Get = const Kernels& (*)();
#define FCL_FIBERS_KERNELS(NAMESPACE) static_cast<Get>(&NAMESPACE::kernels<Kernels, Tree>)
    return FCL_FIBERS_BEST_TARGET(Get, FCL_FIBERS_KERNELS)();
#undef FCL_FIBERS_KERNELS
  }
};

}  // namespace

template <class Tree>
Visit Search<Tree>::cut(const Tree& tree, WorkSink& out) {
  return Kernels<Tree>::best().cutSelf(tree, out);
}
template <class Tree>
Visit Search<Tree>::cut(const Two& trees, WorkSink& out) {
  return Kernels<Tree>::best().cutTwo(trees, out);
}
template <class Tree>
Visit Search<Tree>::overlaps(const Tree& tree, const Work& work, PairBuffer& out) {
  return Kernels<Tree>::best().overlapsSelf(tree, work, out);
}
template <class Tree>
Visit Search<Tree>::overlaps(const Two& trees, const Work& work, PairBuffer& out) {
  return Kernels<Tree>::best().overlapsTwo(trees, work, out);
}
template <class Tree>
Visit Search<Tree>::overlaps(const Tree& tree, const Volume& volume, SegmentId second, Group group,
                             PairBuffer& out) {
  return Kernels<Tree>::best().overlapsOne(tree, volume, second, group, out);
}
template <class Tree>
Visit Search<Tree>::nearest(const Tree& tree, double limit, NearestVisitor& visitor) {
  return Kernels<Tree>::best().nearestSelf(tree, limit, visitor);
}
template <class Tree>
Visit Search<Tree>::nearest(const Two& trees, double limit, NearestVisitor& visitor) {
  return Kernels<Tree>::best().nearestTwo(trees, limit, visitor);
}
template <class Tree>
Visit Search<Tree>::nearest(const Tree& tree, const Volume& volume, SegmentId second, Group group,
                            double limit, NearestVisitor& visitor) {
  return Kernels<Tree>::best().nearestOne(tree, volume, second, group, limit, visitor);
}

template struct Search<LayeredBoxTree<2>>;
template struct Search<LayeredBoxTree<8>>;
template struct Search<WrappedSphereTree<2>>;
template struct Search<WrappedSphereTree<8>>;

}  // namespace fcl_fibers::tree
#endif
