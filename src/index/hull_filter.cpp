// SPDX-License-Identifier: BSD-3-Clause
#include "index/hull_filter.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "geometry/impact.h"
#include "geometry/rounding.h"
#include "geometry/touch.h"
#include "geometry/triangle_test.h"
#include "index/posed_mesh.h"

namespace fcl_fibers::index {

using geometry::CapsuleEnd;
using geometry::CapsulePairs;
using geometry::FrameChange;
using geometry::Impact;
using geometry::ImpactPairs;
using geometry::MovingCapsule;
using geometry::MovingSegment;
using geometry::MovingTriangle;
using geometry::PairBlock;
using geometry::Segment;
using geometry::TrianglePairs;
using tree::Pair;
using tree::SegmentId;
using tree::SegmentRange;

namespace {

// The same for what rests and for what moves.

FCL_FIBERS_ALWAYS_INLINE Segment changed(const FrameChange& change, const Segment& s) {
  return change(s);
}
FCL_FIBERS_ALWAYS_INLINE MovingSegment changed(const FrameChange& change, const MovingSegment& s) {
  return {change(s.start), change(s.end)};
}
double errorOf(const FrameChange& change, const Segment& moved) { return change.error(moved); }
double errorOf(const FrameChange& change, const MovingSegment& moved) {
  return std::max(change.error(moved.start), change.error(moved.end));
}
FCL_FIBERS_ALWAYS_INLINE const CapsuleEnd* store(const Segment& s, CapsuleEnd* ends) {
  ends[0] = firstEndOf(s);
  ends[1] = secondEndOf(s);
  return ends;
}
FCL_FIBERS_ALWAYS_INLINE MovingCapsule store(const MovingSegment& s, CapsuleEnd* ends) {
  return {store(s.start, ends), store(s.end, ends + 2)};
}
bool mayTaper(const SegmentRange& segments) { return segments.mayTaper(); }
geometry::Moving<bool> mayTaper(const MovingRange& segments) {
  return {segments.start.mayTaper(), segments.end.mayTaper()};
}
std::uint64_t apart(const CapsulePairs::Verdict& verdict) { return verdict.apart; }
std::uint64_t apart(std::uint64_t verdict) { return verdict; }

/// A segment and a hull in its frame, and a bound on the error of all their points.
template <class First, class Second>
struct Both {
  First p;
  Second q;
  double error;

  // As an aggregate it would be cleared first, which takes as long as the rest.
  FCL_FIBERS_ALWAYS_INLINE Both(const First& first, const Second& second, double both_error)
      : p(first), q(second), error(both_error) {}
};

// For each kind of hulls: how a pair is read, and how its block is filled.

template <class Range>
FCL_FIBERS_ALWAYS_INLINE auto together(const Range& segments, const SegmentHulls<Range>& hulls,
                                       const Pair& pair) {
  using S = decltype(segments[0]);
  Both<S, S> both(segments[pair.a], hulls.segments[pair.b], 0);
  const double p_error = endPointError(both.p);
  if (hulls.to_first == nullptr) {
    both.error = p_error + std::max(endPointError(both.q), hulls.error);
  } else {
    both.q = changed(*hulls.to_first, both.q);
    both.error = p_error + errorOf(*hulls.to_first, both.q);
  }
  return both;
}
Both<MovingSegment, MovingTriangle> together(const MovingRange& segments,
                                             const TriangleHulls<PosedMesh>& hulls,
                                             const Pair& pair) {
  const MovingSegment segment = segments[pair.a];
  return {segment, hulls.mesh[pair.b], endPointError(segment) + hulls.mesh.error()};
}

bool touches(const SegmentRange& segments, const SegmentHulls<SegmentRange>& hulls,
             const Pair& pair, double margin) {
  const auto [p, q, error] = together(segments, hulls, pair);
  return touch(p, q, margin, error);
}
bool touches(const SegmentRange& segments, const TriangleHulls<PosedTriangles>& hulls,
             const Pair& pair, double margin) {
  return hulls.mesh.touches(segments[pair.a], /*its_error=*/0, pair.b, margin);
}

template <class Range>
double mostErrorOf(const SegmentHulls<Range>& hulls) {
  return hulls.to_first != nullptr ? std::numeric_limits<double>::infinity()
                                   : std::max(hulls.segments.mostError(), hulls.error);
}
template <class Mesh>
double mostErrorOf(const TriangleHulls<Mesh>& hulls) {
  return hulls.mesh.error();
}

/// Whether a box and what may be another one are two boxes that touch even if their corners have no
/// error.
FCL_FIBERS_ALWAYS_INLINE bool areBoxesWithin(const CapsuleEnd* p, const CapsuleEnd* q,
                                             double margin) {
  // Without branches, which could not be predicted.
  unsigned apart = isBox(q) ? 0 : 1;
  for (int axis = 0; axis < 3; ++axis) {
    apart |= p[0].numbers[axis] - q[1].numbers[axis] <= margin ? 0u : 1u;
    apart |= q[0].numbers[axis] - p[1].numbers[axis] <= margin ? 0u : 1u;
  }
  return apart == 0;
}
/// A bit for each pair of a block for which that is known.
FCL_FIBERS_ALWAYS_INLINE std::uint64_t boxesWithin(const SegmentRange& segments,
                                                   const SegmentHulls<SegmentRange>& hulls,
                                                   const Pair* pairs, std::size_t count,
                                                   double margin) {
  std::uint64_t within = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const CapsuleEnd* p = segments.capsule(pairs[i].a);
    // Pairs of one segment follow each other, so this can be predicted.
    if (!isBox(p)) continue;
    const CapsuleEnd* q = hulls.segments.capsule(pairs[i].b);
    CapsuleEnd ends[2];
    if (hulls.to_first != nullptr) q = store((*hulls.to_first)(hulls.segments[pairs[i].b]), ends);
    within |= std::uint64_t{areBoxesWithin(p, q, margin)} << i;
  }
  return within;
}

/// The segments that were found to touch last, because pairs of one segment follow soon after each
/// other.
class RecentSegments {
 public:
  RecentSegments() { ids_.fill(-1); }
  bool has(SegmentId id) const { return ids_[entry(id)] == id; }
  void add(SegmentId id) { ids_[entry(id)] = id; }

 private:
  static constexpr std::size_t kEntries = 512;
  static std::size_t entry(SegmentId id) { return static_cast<std::size_t>(id) % kEntries; }
  std::array<SegmentId, kEntries> ids_;
};

/// The pairs of a filter that are tested together.
template <class Range, class Hulls>
class Block;

template <class Range>
using SegmentPairs =
    std::conditional_t<std::is_same_v<Range, MovingRange>, ImpactPairs, CapsulePairs>;
template <class Range>
class Block<Range, SegmentHulls<Range>> : public SegmentPairs<Range> {
  using Pairs = SegmentPairs<Range>;

 public:
  Block(const Range& segments, const SegmentHulls<Range>& hulls, double unit)
      : Pairs(unit), segments_(segments), hulls_(hulls) {
    this->setMayTaper(mayTaper(segments), mayTaper(hulls.segments));
  }

  void keep(const Pair& /*pair*/) const {}
  /// @pre there is a pair before this one
  FCL_FIBERS_ALWAYS_INLINE void prefetch(const Pair* pair) const {
    // Segments are stored by id, so neighbours in the tree are far from each other in memory.
    if (pair[0].a != pair[-1].a) segments_.prefetch(pair->a);
    hulls_.segments.prefetch(pair->b);
  }
  FCL_FIBERS_ALWAYS_INLINE void add(const Pair& pair, double margin, double error) {
    Pairs::add(segments_.capsule(pair.a), hulls_.segments.capsule(pair.b), margin, error);
  }
  FCL_FIBERS_ALWAYS_INLINE void add(const Pair& pair, double margin) {
    const auto both = together(segments_, hulls_, pair);
    CapsuleEnd* const ends = moved_.data() + kEnds * static_cast<std::size_t>(this->size());
    Pairs::add(segments_.capsule(pair.a), store(both.q, ends), margin, both.error);
  }

 private:
  static constexpr std::size_t kEnds = std::is_same_v<Range, MovingRange> ? 4 : 2;
  const Range& segments_;
  const SegmentHulls<Range>& hulls_;
  std::array<CapsuleEnd, kEnds * Pairs::kCapacity> moved_;
};

template <>
class Block<SegmentRange, TriangleHulls<PosedTriangles>> : public TrianglePairs {
 public:
  Block(const SegmentRange& segments, const TriangleHulls<PosedTriangles>& hulls, double unit)
      : TrianglePairs(hulls.mesh.posing(), unit), segments_(segments), hulls_(hulls) {
    setMayTaper(segments.mayTaper(), false);
  }

  bool leavesOut(SegmentId segment) const { return hulls_.once && touching_.has(segment); }
  void keep(const Pair& pair) {
    if (hulls_.once) touching_.add(pair.a);
  }
  void prefetch(const Pair* pair, std::size_t left) const {
    if (left > 2 * kAhead) __builtin_prefetch(&corners_[pair[2 * kAhead].b]);
    if (left <= kAhead) return;
    if (pair[kAhead].a != pair[kAhead - 1].a) segments_.prefetch(pair[kAhead].a);
    const geometry::TriangleIndices& t = corners_[pair[kAhead].b];
    for (const std::int32_t corner : {t.a, t.b, t.c}) __builtin_prefetch(&points_[corner]);
  }
  void add(const Pair& pair, double margin, double error_of_all) {
    const geometry::TriangleIndices& t = corners_[pair.b];
    PairsOf::add(
        segments_.capsule(pair.a), {&points_[t.a], &points_[t.b], &points_[t.c]}, margin,
        error_of_all >= 0 ? error_of_all : endPointError(segments_[pair.a]) + hulls_.mesh.error());
  }

 private:
  static constexpr std::size_t kAhead = kCapacity;
  const SegmentRange& segments_;
  const TriangleHulls<PosedTriangles>& hulls_;
  const geometry::MeshPoint* const points_ = hulls_.mesh.mesh().points().data();
  const geometry::TriangleIndices* const corners_ = hulls_.mesh.mesh().triangles().data();
  RecentSegments touching_;
};

/// Triangles in a step have no test in float, so all are left.
template <>
class Block<MovingRange, TriangleHulls<PosedMesh>> : public PairBlock {
 public:
  Block(const MovingRange&, const TriangleHulls<PosedMesh>& hulls, double unit)
      : PairBlock(unit), left_out_(*hulls.left_out) {}
  bool leavesOut(SegmentId segment) const { return left_out_.has(segment); }
  void prefetch(const Pair*, std::size_t) const {}
  void add(const Pair&, double, double) { ++size_; }
  std::uint64_t decide() const { return 0; }
  double from(int) const { return 0; }

 private:
  const SegmentMarks& left_out_;
};

}  // namespace

void FirstTime::add(double time) {
  double first = get();
  while (time < first && !first_.compare_exchange_weak(first, time)) {
  }
  // Another thread may just have written a later time, which costs time and no impact.
  until_.store(geometry::roundedUp(get()), std::memory_order_relaxed);
}

void FirstTime::addComputed(std::size_t count) {
  if (count == 0) return;
  constexpr std::size_t kMost = std::size_t{1} << 24;  // three seconds
  const std::size_t before = computed_.fetch_add(count, std::memory_order_relaxed);
  requireFew("FiberTree::safeStep", before + count, kMost, elements_);
}

template <class Range, class Hulls>
HullFilter<Range, Hulls>::HullFilter(const Range& segments, const Hulls& hulls, double margin,
                                     double unit, const Question& question)
    : segments_(segments), hulls_(hulls), margin_(margin), unit_(unit), question_(question) {
  const double most = segments.mostError() + mostErrorOf(hulls);
  error_of_all_ = PairBlock::isSmall(unit * most) ? most : -1;
}

/// Calls visit(pair, i, block, verdict) for the pairs that are not left out and not apart by a test
/// of blocks; i is the place in the block. Until a pair is visited, it must stay in its place.
template <class Range, class Hulls>
template <class Visit>
FCL_FIBERS_ALWAYS_INLINE void HullFilter<Range, Hulls>::forEachLeft(const Pair* pairs,
                                                                    std::size_t count,
                                                                    Visit&& visit) const {
  constexpr int kBlock = PairBlock::kCapacity;
  Block<Range, Hulls> block(segments_, hulls_, unit_);
  std::array<Pair, kBlock> chosen;
  for (std::size_t i = 0; i < count;) {
    const Pair* added = chosen.data();
    block.clear();
    if constexpr (std::is_same_v<Hulls, SegmentHulls<Range>>) {
      // None is left out, and a loop for each task takes fewer operations.
      const std::size_t end = std::min(i + kBlock, count);
      added = pairs + i;
      for (std::size_t k = end; k < std::min(end + kBlock, count); ++k) block.prefetch(pairs + k);
      if (error_of_all_ >= 0) {
        for (; i < end; ++i) block.add(pairs[i], margin_, error_of_all_);
      } else {
        for (; i < end; ++i) block.add(pairs[i], margin_);
      }
    } else {
      for (; i < count && block.size() < kBlock; ++i) {
        block.prefetch(pairs + i, count - i);
        if (block.leavesOut(pairs[i].a)) continue;
        chosen[static_cast<std::size_t>(block.size())] = pairs[i];
        block.add(pairs[i], margin_, error_of_all_);
      }
    }
    if (block.size() == 0) return;
    const auto verdict = block.decide();
    const std::uint64_t all = ~std::uint64_t{0} >> (kBlock - block.size());
    for (std::uint64_t rest = all & ~apart(verdict); rest != 0; rest &= rest - 1) {
      const int k = __builtin_ctzll(rest);
      visit(added[k], k, block, verdict);
    }
  }
}

template <class Range, class Hulls>
std::size_t HullFilter<Range, Hulls>::keep(Pair* pairs, std::size_t count,
                                           std::vector<Impact>& impacts) const {
  if (question_.wanted != nullptr) count = question_.wanted->keep(pairs, count, impacts);
  std::size_t kept = 0;
  if constexpr (std::is_same_v<Range, MovingRange>) {
    using Hull = decltype(together(segments_, hulls_, Pair()).q.start);
    Pair waiting[geometry::kImpactsAtOnce];
    geometry::ImpactQuery<Hull> queries[geometry::kImpactsAtOnce];
    Impact found[geometry::kImpactsAtOnce];
    int waits = 0;
    std::size_t approaches = 0;
    const auto decide = [&] {
      for (auto rest = geometry::findImpacts(queries, waits, found); rest != 0; rest &= rest - 1) {
        const int i = __builtin_ctz(rest);
        impacts.push_back(found[i]);
        pairs[kept++] = waiting[i];
      }
      waits = 0;
    };
    forEachLeft(pairs, count, [&](const Pair& pair, int i, const auto& block, std::uint64_t) {
      const auto [p, q, error] = together(segments_, hulls_, pair);
      const double from = block.from(i);
      if (FirstTime* const first = question_.first; first != nullptr) {
        geometry::ImpactWith<Hull> impact;
        if (from >= first->get()) return;
        ++approaches;
        if (findApproach(p, q, margin_, error, from, impact)) first->add(impact.time);
        return;
      }
      waiting[waits] = pair;
      queries[waits++] = {p, q, margin_, error, from};
      if (waits == geometry::kImpactsAtOnce) decide();
    });
    decide();
    if (question_.first != nullptr) question_.first->addComputed(approaches);
  } else {
    const auto keepSome = [&](std::size_t begin, std::size_t end, std::uint64_t known) {
      forEachLeft(pairs + begin, end - begin,
                  [&](const Pair& pair, int i, auto& block, const PairBlock::Verdict& verdict) {
                    if (((verdict.touching | known) >> i & 1u) == 0 &&
                        !touches(segments_, hulls_, pair, margin_)) {
                      return;
                    }
                    block.keep(pair);
                    pairs[kept++] = pair;
                  });
    };
    if constexpr (std::is_same_v<Hulls, SegmentHulls<Range>>) {
      // Two boxes have no test in float, and most that come here touch without a doubt.
      const bool may_be_boxes = segments_.hasBoxes() && hulls_.segments.hasBoxes();
      std::size_t end = 0;
      for (std::size_t i = 0; may_be_boxes && i < count; i = end) {
        end = std::min(i + PairBlock::kCapacity, count);
        const std::uint64_t known = boxesWithin(segments_, hulls_, pairs + i, end - i, margin_);
        if (known != ~std::uint64_t{0} >> (PairBlock::kCapacity - (end - i))) {
          keepSome(i, end, known);
        } else {
          if (kept != i) std::copy(pairs + i, pairs + end, pairs + kept);
          kept += end - i;
        }
      }
      if (may_be_boxes) return kept;
    }
    keepSome(0, count, 0);
  }
  return kept;
}

template class HullFilter<SegmentRange, SegmentHulls<SegmentRange>>;
template class HullFilter<MovingRange, SegmentHulls<MovingRange>>;
template class HullFilter<SegmentRange, TriangleHulls<PosedTriangles>>;
template class HullFilter<MovingRange, TriangleHulls<PosedMesh>>;

}  // namespace fcl_fibers::index
