// SPDX-License-Identifier: BSD-3-Clause
#include "tree/search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "geometry/rounding.h"
#include "tree/kernels.h"
#include "tree/traversal-inl.h"

// The searches that make few tests, or much else with each, are compiled once. Their tests are the
// kernels'.

namespace fcl_fibers::tree {
namespace {

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

  SplitIntoTasks(std::int32_t most_leaves, TaskSink& sink) : grain(most_leaves), out(sink) {}

  template <class Pack, class Volume, class F>
  Visit forEachPassing(const Pack& pack, const Volume& volume, simd::LaneMask lanes,
                       double /*unit*/, F&& visit) {
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

/// At most kMost places, each with a distance in the unit of one pack.
template <std::size_t kMost>
class PlacesByDistance {
 public:
  FCL_FIBERS_ALWAYS_INLINE void add(float distance, int place) {
    std::uint32_t bits;  // have the order of the distances, because these are not negative
    std::memcpy(&bits, &distance, sizeof(bits));
    const std::uint64_t key = std::uint64_t{bits} << 32 | static_cast<std::uint32_t>(place);
    std::size_t at = count_++;
    if constexpr (kIsSmall) {
      for (; at > 0 && key < keys_[at - 1]; --at) keys_[at] = keys_[at - 1];
    }
    keys_[at] = key;
  }
  /// Calls visit(place), the nearest first, as long as they are nearer than the limit.
  /// @param limit  may shrink meanwhile
  template <class F>
  Visit visitNearestFirst(const double& limit, double unit, F&& visit) {
    if constexpr (!kIsSmall) std::sort(keys_.data(), keys_.data() + count_);
    for (std::size_t i = 0; i < count_; ++i) {
      const auto bits = static_cast<std::uint32_t>(keys_[i] >> 32);
      float distance;
      std::memcpy(&distance, &bits, sizeof(bits));
      // If the limit is infinite, the product may be infinite too.
      if (!(distance * unit < limit) && std::isfinite(limit)) break;
      const auto place = static_cast<std::uint32_t>(keys_[i]);
      if (visit(static_cast<int>(place)) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }

 private:
  /// There are few, and keeping them in order takes less than sorting them.
  static constexpr bool kIsSmall = kMost <= 16;
  std::array<std::uint64_t, kMost> keys_;
  std::size_t count_ = 0;
};

/// Passes volumes nearer than a limit, which may shrink as pairs are found, the nearest first.
template <class TreeA, class TreeB>
struct VisitNearest {
  static constexpr bool kSplits = false;
  static constexpr bool kNearestFirst = true;
  template <std::size_t kMost>
  using Places = PlacesByDistance<kMost>;

  VisitNearest(double least, NearestVisitor& v, SegmentId id = 0)
      : limit(least), visitor(v), second(id) {}

  /// Calls add(lane, distance) for those of the lanes that may be nearer than the limit.
  template <int N, template <int> class Pack, class Volume, class F>
  FCL_FIBERS_ALWAYS_INLINE void forEachNearer(const Pack<N>& pack, const Volume& volume,
                                              simd::LaneMask lanes, double unit, F&& add) const {
    float distance[N];
    const float least = geometry::roundedUp(limit / unit);
    for (auto rest = tests.of(pack).nearer(pack, volume, least, distance) & lanes; rest != 0;
         rest &= rest - 1) {
      const int lane = __builtin_ctz(rest);
      add(lane, distance[lane]);
    }
  }
  template <int N, template <int> class Pack, class Volume, class F>
  FCL_FIBERS_ALWAYS_INLINE Visit forEachPassing(const Pack<N>& pack, const Volume& volume,
                                                simd::LaneMask lanes, double unit, F&& visit) {
    Places<N> nearest;
    forEachNearer(pack, volume, lanes, unit,
                  [&](int lane, float distance) { nearest.add(distance, lane); });
    return nearest.visitNearestFirst(limit, unit, visit);
  }
  Visit leafPair(SegmentId a, SegmentId b) { return visitor.visit(a, b, limit); }
  Visit leaf(SegmentId a) { return visitor.visit(a, second, limit); }

  Tests<TreeA, TreeB> tests;
  double limit;  ///< in the frame of the query
  NearestVisitor& visitor;
  SegmentId second;
};

template <class Trees>
struct IsPair : std::false_type {};
template <class TreeA, class TreeB>
struct IsPair<TreePair<TreeA, TreeB>> : std::true_type {};

/// Visits all pairs of one tree or of two.
/// @param Query  a template over the types of both trees
template <template <class, class> class Query, class Trees, class... Arguments>
Visit visitAll(const Trees& trees, Arguments&&... arguments) {
  return withAnyPairing(trees, [&](const auto& pairing) {
    using Pairing = std::decay_t<decltype(pairing)>;
    if (pairing.a.empty() || pairing.b.empty()) return Visit::kContinue;
    using ThisQuery = Query<typename Pairing::TreeA, typename Pairing::TreeB>;
    ThisQuery query(arguments...);
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
  return visitAll<SplitIntoTasks>(trees, kGrain, out);
}

template <class Trees>
Visit visitOverlaps(const Trees& trees, const TraversalTask& task, PairBuffer& out) {
  return runKernel(trees, task, out);
}

template <class Trees>
Visit visitNearest(const Trees& trees, double limit, NearestVisitor& visitor) {
  return visitAll<VisitNearest>(trees, limit, visitor);
}

template <class Tree>
Visit visitOverlaps(const Tree& tree, const typename Tree::Volume& volume, SegmentId second,
                    Group group, PairBuffer& out) {
  return kernels<Tree>().with_volume(tree, volume, second, group, out);
}

template <class Tree>
Visit visitNearest(const Tree& tree, const typename Tree::Volume& volume, SegmentId second,
                   Group group, double limit, NearestVisitor& visitor) {
  VisitNearest<Tree, Tree> query(limit, visitor, second);
  return visitLeaves(tree, volume, query, group);
}

template <class Trees>
Visit visitOneByOne(const Trees& trees, std::int32_t a_slot, std::int32_t b_slot, PairBuffer& out) {
  return withAnyPairing(trees, [&](const auto& pairing) {
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
    Query query(/*most_leaves=*/1, pairs);
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
