// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_TREE_NEAREST_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_TREE_NEAREST_INL_H
#undef FCL_FIBERS_TREE_NEAREST_INL_H
#else
#define FCL_FIBERS_TREE_NEAREST_INL_H
#endif

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "geometry/rounding.h"
#include "tree/kernels.h"
#include "tree/pairing-inl.h"
#include "tree/search.h"
#include "tree/traversal-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

/// At most kMost places.
template <int kMost>
struct Places {
  static constexpr bool kInOrder = kMost <= 16;  ///< from the start, and not only once sorted

  int count = 0;
  Place all[kMost];
};

/// Passes volumes nearer than a limit, which may shrink as pairs are found, the nearest first.
/// @param Tests  has nearer() of the kernels
template <class Tests>
class VisitNearest {
 public:
  static constexpr bool kSplits = false;
  static constexpr bool kNearestFirst = true;
  template <int kMost>
  using Places = HWY_NAMESPACE::Places<kMost>;

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
    places.count = tests_.nearer(pack, volume, lanes, limit, first, places.all, places.count,
                                 Places<kMost>::kInOrder);
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

  const Tests tests_ = {};
  double limit_;  ///< in the frame of A
  float limit_in_a_, limit_in_b_;
  const double unit_of_b_ = 1;  ///< the length of the unit of B's frame in A's
  NearestVisitor& visitor_;
  const SegmentId second_ = 0;
};

template <class Trees>
constexpr bool kIsMeshPair = false;
template <class TreeA, class TreeB>
constexpr bool kIsMeshPair<TreePair<TreeA, TreeB>> = !std::is_same_v<TreeA, TreeB>;

/// Visits the pairs of one tree or of two that are nearer than a limit.
/// @param Tests  a template over the types of both trees; see VisitNearest
template <template <class, class> class Tests, class Trees>
Visit nearestOf(const Trees& trees, double limit, NearestVisitor& visitor) {
  const auto visit = [&](const auto& pairing) HWY_ATTR {
    using Pairing = std::decay_t<decltype(pairing)>;
    VisitNearest<Tests<typename Pairing::TreeA, typename Pairing::TreeB>> query(pairing, limit,
                                                                                visitor);
    return visitAll<Trees>(pairing, query);
  };
  // The changes of a mesh are long.
  if constexpr (kIsMeshPair<Trees>) {
    return withAnyPairing<Called>(trees, visit);
  } else {
    return withAnyPairing<Inlined>(trees, visit);
  }
}

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
