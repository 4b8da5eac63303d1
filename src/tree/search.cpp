// SPDX-License-Identifier: BSD-3-Clause
#include "tree/search.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include "geometry/rounding.h"
#include "tree/kernels.h"
#include "tree/traversal-inl.h"

// The searches that make few tests, or much else with each, are compiled once. Their tests are the
// kernels'.

namespace fcl_fibers::tree {
namespace {

using HWY_NAMESPACE::Called;
using HWY_NAMESPACE::FrameOf;
using HWY_NAMESPACE::Inlined;
using HWY_NAMESPACE::PairTraversal;
using HWY_NAMESPACE::visitLeaves;
using HWY_NAMESPACE::withAnyPairing;

/// The kernels of two trees, which may be the same, by the packs that they test.
template <class TreeA, class TreeB>
struct Tests {
  template <class Pack>
  FCL_FIBERS_ALWAYS_INLINE const auto& of(const Pack& /*pack*/) const {
    if constexpr (std::is_same_v<Pack, typename TreeA::Pack>) {
      return a;
    } else {
      return b;
    }
  }

  const Kernels<TreeA>& a = kernels<TreeA>();
  const Kernels<TreeB>& b = kernels<TreeB>();
};

/// Splits the pairs whose volumes overlap into tasks of at most `grain` leaves on either side.
template <class TreeA, class TreeB>
struct SplitIntoTasks {
  static constexpr bool kSplits = true;
  static constexpr bool kNearestFirst = false;

  template <class Pairing>
  SplitIntoTasks(const Pairing& /*pairing*/, std::int32_t most_leaves, TaskSink& sink)
      : grain(most_leaves), out(sink) {}

  template <class Pack, class Volume, class F>
  Visit forEachPassing(const Pack& pack, FrameOf /*frame*/, const Volume& volume,
                       simd::LaneMask lanes, F&& visit) {
    for (auto rest = tests.of(pack).overlaps(pack, volume) & lanes; rest != 0; rest &= rest - 1) {
      if (visit(__builtin_ctz(rest)) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }
  bool isTask(std::int32_t a_leaves, std::int32_t b_leaves) const {
    return a_leaves <= grain && b_leaves <= grain;
  }
  Visit addTask(const TraversalTask& task) { return out.take(task); }

  Tests<TreeA, TreeB> tests;
  std::int32_t grain;
  TaskSink& out;
};

/// At most kMost places.
template <int kMost>
struct Places {
  static constexpr bool kInOrder = kMost <= 16;  ///< from the start, and not only once sorted

  int count = 0;
  Place all[kMost];
};

/// Passes volumes nearer than a limit, which may shrink as pairs are found, the nearest first.
template <class TreeA, class TreeB>
class VisitNearest {
 public:
  static constexpr bool kSplits = false;
  static constexpr bool kNearestFirst = true;
  template <int kMost>
  using Places = tree::Places<kMost>;

  /// @param limit  in the frame of A
  template <class Pairing>
  VisitNearest(const Pairing& pairing, double limit, NearestVisitor& visitor)
      : unit_of_b_(pairing.b_to_a.scale()), visitor_(visitor) {
    setLimit(limit);
  }
  /// For pairs of one tree and a volume.
  /// @param second  stands for the volume
  VisitNearest(SegmentId second, double limit, NearestVisitor& visitor)
      : visitor_(visitor), second_(second) {
    setLimit(limit);
  }

  /// Adds the places first + lane of those of the lanes that may be nearer than the limit.
  template <class Pack, class Volume, int kMost>
  FCL_FIBERS_ALWAYS_INLINE void addNearer(const Pack& pack, FrameOf frame, const Volume& volume,
                                          simd::LaneMask lanes, int first,
                                          Places<kMost>& places) const {
    const float limit = frame == FrameOf::kA ? limit_in_a_ : limit_in_b_;
    places.count = tests_.of(pack).nearer(pack, volume, lanes, limit, first, places.all,
                                          places.count, Places<kMost>::kInOrder);
  }
  /// Calls visit(number), the nearest place first, as long as they are nearer than the limit.
  template <int kMost, class F>
  FCL_FIBERS_ALWAYS_INLINE Visit visitNearestFirst(Places<kMost>& places, FrameOf frame,
                                                   F&& visit) {
    const double unit = frame == FrameOf::kA ? 1 : unit_of_b_;
    if constexpr (!Places<kMost>::kInOrder) std::sort(places.all, places.all + places.count);
    for (int i = 0; i < places.count; ++i) {
      // If the limit is infinite, the product may be infinite too.
      if (!(places.all[i].distance() * unit < limit_) && std::isfinite(limit_)) break;
      if (visit(places.all[i].number()) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }
  template <int N, template <int> class Pack, class Volume, class F>
  FCL_FIBERS_ALWAYS_INLINE Visit forEachPassing(const Pack<N>& pack, FrameOf frame,
                                                const Volume& volume, simd::LaneMask lanes,
                                                F&& visit) {
    Places<N> places;
    addNearer(pack, frame, volume, lanes, 0, places);
    return visitNearestFirst(places, frame, visit);
  }
  Visit leafPair(SegmentId a, SegmentId b) {
    double limit = limit_;
    const Visit visit = visitor_.visit(a, b, limit);
    if (limit != limit_) setLimit(limit);
    return visit;
  }
  Visit leaf(SegmentId a) { return leafPair(a, second_); }

 private:
  void setLimit(double limit) {
    limit_ = limit;
    limit_in_a_ = geometry::roundedUp(limit);
    limit_in_b_ = geometry::roundedUp(limit / unit_of_b_);
  }

  const Tests<TreeA, TreeB> tests_;
  double limit_;  ///< in the frame of A
  float limit_in_a_, limit_in_b_;
  const double unit_of_b_ = 1;  ///< the length of the unit of B's frame in A's
  NearestVisitor& visitor_;
  const SegmentId second_ = 0;
};

template <class Trees>
struct IsPair : std::false_type {};
template <class TreeA, class TreeB>
struct IsPair<TreePair<TreeA, TreeB>> : std::true_type {};

/// Visits all pairs of one tree or of two.
/// @param Query  a template over the types of both trees
/// @param How    see withAnyPairing()
template <template <class, class> class Query, template <class> class How, class Trees,
          class... Arguments>
Visit visitAll(const Trees& trees, Arguments&&... arguments) {
  return withAnyPairing<How>(trees, [&](const auto& pairing) {
    using Pairing = std::decay_t<decltype(pairing)>;
    if (pairing.a.empty() || pairing.b.empty()) return Visit::kContinue;
    using ThisQuery = Query<typename Pairing::TreeA, typename Pairing::TreeB>;
    ThisQuery query(pairing, arguments...);
    PairTraversal<Pairing, ThisQuery> traversal(pairing, query);
    if constexpr (IsPair<Trees>::value) {
      return traversal.visitBoth();
    } else {
      return traversal.visitSelf(0);
    }
  });
}

template <class Tree>
Visit runKernel(const Tree& tree, const TraversalTask& task, PairBuffer& out) {
  return kernels<Tree>().within(tree, task, out);
}
template <class TreeA, class TreeB>
Visit runKernel(const TreePair<TreeA, TreeB>& trees, const TraversalTask& task, PairBuffer& out) {
  if constexpr (std::is_same_v<TreeA, TreeB>) {
    return kernels<TreeA>().between(trees, task, out);
  } else {
    return kernels<TreeA>().with_mesh(trees, task, out);
  }
}

}  // namespace

template <class Trees>
Visit splitIntoTasks(const Trees& trees, TaskSink& out) {
  // A task takes some microseconds. So batches fill, and there are enough tasks for any number of
  // threads. This is the size of a full node three levels above the leaves.
  constexpr std::int32_t kGrain = 512;
  return visitAll<SplitIntoTasks, Called>(trees, kGrain, out);
}

template <class Trees>
Visit visitOverlaps(const Trees& trees, const TraversalTask& task, PairBuffer& out) {
  return runKernel(trees, task, out);
}

template <class Trees>
Visit visitNearest(const Trees& trees, double limit, NearestVisitor& visitor) {
  return visitAll<VisitNearest, Inlined>(trees, limit, visitor);
}

template <class Tree>
Visit visitOverlaps(const Tree& tree, const typename Tree::Volume& volume, SegmentId second,
                    Group group, PairBuffer& out) {
  return kernels<Tree>().with_volume(tree, volume, second, group, out);
}

template <class Tree>
Visit visitNearest(const Tree& tree, const typename Tree::Volume& volume, SegmentId second,
                   Group group, double limit, NearestVisitor& visitor) {
  VisitNearest<Tree, Tree> query(second, limit, visitor);
  return visitLeaves(tree, volume, query, group);
}

template <class Trees>
Visit visitOneByOne(const Trees& trees, std::int32_t a_slot, std::int32_t b_slot, PairBuffer& out) {
  return withAnyPairing<Called>(trees, [&](const auto& pairing) {
    using Pairing = std::decay_t<decltype(pairing)>;
    using Query = SplitIntoTasks<typename Pairing::TreeA, typename Pairing::TreeB>;
    /// A task of one leaf on either side is a pair.
    struct Pairs final : TaskSink {
      Pairs(const Pairing& p, PairBuffer& buffer) : pairing(p), out(buffer) {}
      Visit take(const TraversalTask& task) override {
        return out.push(Child<typename Pairing::TreeA>::of(pairing.a, task.a_slot).link.segment(),
                        Child<typename Pairing::TreeB>::of(pairing.b, task.b_slot).link.segment());
      }
      const Pairing& pairing;
      PairBuffer& out;
    } pairs(pairing, out);
    Query query(pairing, /*most_leaves=*/1, pairs);
    return PairTraversal<Pairing, Query>(pairing, query)
        .run({TraversalTask::kCross, a_slot, b_slot});
  });
}

#define FCL_FIBERS_SEARCH(...)                                  \
  template Visit splitIntoTasks(const __VA_ARGS__&, TaskSink&); \
  template Visit visitOverlaps(const __VA_ARGS__&, const TraversalTask&, PairBuffer&);
#define FCL_FIBERS_SEARCH_OF_ONE(TREE) \
  FCL_FIBERS_SEARCH(TREE)              \
  FCL_FIBERS_SEARCH(TreePair<TREE>)    \
  template Visit visitOverlaps(const TREE&, const TREE::Volume&, SegmentId, Group, PairBuffer&);
#define FCL_FIBERS_NEAREST(...) \
  template Visit visitNearest(const __VA_ARGS__&, double, NearestVisitor&);
#define FCL_FIBERS_NEAREST_OF_ONE(TREE)                                                   \
  FCL_FIBERS_NEAREST(TREE)                                                                \
  FCL_FIBERS_NEAREST(TreePair<TREE>)                                                      \
  template Visit visitNearest(const TREE&, const TREE::Volume&, SegmentId, Group, double, \
                              NearestVisitor&);
#define FCL_FIBERS_ONE_BY_ONE(...) \
  template Visit visitOneByOne(const __VA_ARGS__&, std::int32_t, std::int32_t, PairBuffer&);

FCL_FIBERS_SEARCH_OF_ONE(LayeredBoxTree<2>)
FCL_FIBERS_SEARCH_OF_ONE(LayeredBoxTree<8>)
FCL_FIBERS_SEARCH_OF_ONE(WrappedSphereTree<2>)
FCL_FIBERS_SEARCH_OF_ONE(WrappedSphereTree<8>)
FCL_FIBERS_SEARCH_OF_ONE(MovingTree<2>)
FCL_FIBERS_SEARCH_OF_ONE(MovingTree<8>)
FCL_FIBERS_SEARCH(MeshPair<LayeredBoxTree<2>>)
FCL_FIBERS_SEARCH(MeshPair<WrappedSphereTree<2>>)
FCL_FIBERS_SEARCH(MeshPair<WrappedSphereTree<8>>)
FCL_FIBERS_SEARCH(MovingMeshPair<2>)
FCL_FIBERS_NEAREST_OF_ONE(LayeredBoxTree<2>)
FCL_FIBERS_NEAREST_OF_ONE(LayeredBoxTree<8>)
FCL_FIBERS_NEAREST_OF_ONE(WrappedSphereTree<2>)
FCL_FIBERS_NEAREST_OF_ONE(WrappedSphereTree<8>)
FCL_FIBERS_NEAREST(MeshPair<LayeredBoxTree<2>>)
FCL_FIBERS_NEAREST(MeshPair<WrappedSphereTree<2>>)
FCL_FIBERS_NEAREST(MeshPair<WrappedSphereTree<8>>)
FCL_FIBERS_ONE_BY_ONE(LayeredBoxTree<8>)
FCL_FIBERS_ONE_BY_ONE(TreePair<LayeredBoxTree<8>>)
FCL_FIBERS_ONE_BY_ONE(WrappedSphereTree<8>)
FCL_FIBERS_ONE_BY_ONE(TreePair<WrappedSphereTree<8>>)
FCL_FIBERS_ONE_BY_ONE(MovingTree<8>)
FCL_FIBERS_ONE_BY_ONE(TreePair<MovingTree<8>>)
FCL_FIBERS_ONE_BY_ONE(MeshPair<WrappedSphereTree<8>>)

}  // namespace fcl_fibers::tree
