// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_GEOMETRY_PAIR_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_GEOMETRY_PAIR_LANES_INL_H
#undef FCL_FIBERS_GEOMETRY_PAIR_LANES_INL_H
#else
#define FCL_FIBERS_GEOMETRY_PAIR_LANES_INL_H
#endif

#include "geometry/capsule_test.h"
#include "simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

// What the tests of many pairs at a time share.

namespace hn = hwy::HWY_NAMESPACE;

/// With AVX2 these are two vectors: one computes while the other waits.
using Float = simd::HWY_NAMESPACE::Lanes<PairBlock::kGroup>;

/// @tparam Row  a number for each pair
template <class Row>
struct Vec3Rows {
  Row x, y, z;
};
using Vec3Lanes = Vec3Rows<Float>;
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Row dot(const Vec3Rows<Row>& a, const Vec3Rows<Row>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Vec3Rows<Row> operator-(const Vec3Rows<Row>& a, const Vec3Rows<Row>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Vec3Rows<Row> cross(const Vec3Rows<Row>& a, const Vec3Rows<Row>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// By how much the tangent plane of a convex function falls from x to the end of [0, 1] that lies
/// downhill.
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Row fall(const Row& slope, const Row& x) {
  return max(slope * x, slope * (x - Row::all(1)));
}

/// Four numbers for each pair of a block: a vector and something else.
class Quads {
 public:
  /// @return the fourth
  FCL_FIBERS_ALWAYS_INLINE Float get(int first, Vec3Lanes& vector) const {
    Float fourth;
    Float::loadInterleaved(numbers_ + 4 * first, vector.x, vector.y, vector.z, fourth);
    return fourth;
  }
  /// Stores the numbers [k, k + width of d) of a pair. Beyond float's range the conversion gives
  /// infinity or the largest float. Its square is out of the range that the tests ask for.
  template <class Tag>
  FCL_FIBERS_ALWAYS_INLINE void set(Tag /*d*/, int pair, int k, const hn::Vec<Tag>& numbers,
                                    const hn::Vec<Tag>& unit) {
    const hn::Rebind<float, Tag> f;
    hn::StoreU(hn::DemoteTo(f, hn::Mul(numbers, unit)), f, numbers_ + 4 * pair + k);
  }

 private:
  alignas(64) float numbers_[4 * PairBlock::kCapacity];
};

/// Whether a pair whose squared lengths have this sum is decided. Otherwise products may overflow
/// or vanish, and then the bounds do not hold.
FCL_FIBERS_ALWAYS_INLINE Float::Truth isInRange(const Float& squares) {
  return (Float::all(0x1p-40f) <= squares) & (squares <= Float::all(0x1p40f));
}

struct VerdictLanes {
  Float::Truth touching, apart;
};

/// Adds the verdict about the group of pairs that begins at i.
FCL_FIBERS_ALWAYS_INLINE void add(const VerdictLanes& lanes, int i, PairBlock::Verdict& verdict) {
  verdict.touching |= std::uint64_t{lanes.touching.mask()} << i;
  verdict.apart |= std::uint64_t{lanes.apart.mask()} << i;
}

/// Pairs relative to one of their own points and in float.
struct RelativePairs {
  Quads w;  ///< from the second capsule's first end to the first one's; and the sum of the radii
  Quads u;  ///< along the first capsule; and by how much its radius grows, if it may be tapered
  Quads v;  ///< along the second capsule; and the same of it

  FCL_FIBERS_ALWAYS_INLINE void set(int pair, const CapsuleEnd* p, const CapsuleEnd* q,
                                    double unit) {
    const hn::CappedTag<double, 4> d;
    constexpr int kWidth = static_cast<int>(hn::MaxLanes(d));
    const auto scale = hn::Set(d, unit);
    for (int k = 0; k < 4; k += kWidth) {
      const auto p0 = hn::Load(d, p[0].numbers + k), p1 = hn::Load(d, p[1].numbers + k);
      const auto q0 = hn::Load(d, q[0].numbers + k), q1 = hn::Load(d, q[1].numbers + k);
      const auto is_point = hn::FirstN(d, static_cast<std::size_t>(k < 3 ? 3 - k : 0));
      w.set(d, pair, k, hn::IfThenElse(is_point, hn::Sub(p0, q0), hn::Add(p0, q0)), scale);
      u.set(d, pair, k, hn::Sub(p1, p0), scale);
      v.set(d, pair, k, hn::Sub(q1, q0), scale);
    }
  }
};

/// w + s u - t v
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Vec3Rows<Row> pointBetween(const Vec3Rows<Row>& w, const Vec3Rows<Row>& u,
                                                    const Vec3Rows<Row>& v, const Row& s,
                                                    const Row& t) {
  return {w.x + s * u.x - t * v.x, w.y + s * u.y - t * v.y, w.z + s * u.z - t * v.z};
}

/// A number for each arc parameter, s of the first axis and t of the second one.
template <class Row>
struct ArcRows {
  Row s, t;
};

/// Pairs of capsules or, if they taper, of rounded cones.
template <class Row, bool kMayTaper>
struct PairRows {
  Vec3Rows<Row> w, u, v;  ///< as in RelativePairs
  Row reach;              ///< how near the first ends touch
  Row taper_u, taper_v;   ///< by how much that grows along u and along v; capsules do not look

  /// The sum of the squares of all lengths that an error grows with, except the reach.
  FCL_FIBERS_ALWAYS_INLINE Row squares() const {
    const Row of_axes = dot(w, w) + dot(u, u) + dot(v, v);
    if constexpr (kMayTaper) return of_axes + (taper_u * taper_u + taper_v * taper_v);
    return of_axes;
  }
  /// How near the balls at s and t touch.
  FCL_FIBERS_ALWAYS_INLINE Row reachAt(const Row& s, const Row& t) const {
    if constexpr (kMayTaper) return reach + s * taper_u + t * taper_v;
    return reach;
  }
  /// By how much the gap of the balls at s and t grows with s and shrinks with t, seen along a
  /// direction and times the direction's length.
  FCL_FIBERS_ALWAYS_INLINE ArcRows<Row> slopes(const Vec3Rows<Row>& direction,
                                               const Row& length) const {
    const Row of_u = dot(u, direction), of_v = dot(v, direction);
    if constexpr (kMayTaper) return {of_u - taper_u * length, of_v + taper_v * length};
    return {of_u, of_v};
  }
};

/// Finds where |w + s u - t v| is least, up to rounding: the closest points of the lines, each
/// clamped in turn.
///
/// Of cones it is where the gap of the balls, |w + s u - t v| - reachAt(s, t), is least, up to a
/// small part of the tapers. The slopes of the gap vanish where those of |w + s u - t v|^2 -
/// 2 distance reachAt(s, t) do, with the distance of the centres there. That changes so little with
/// the place that a guess will do, and then the distance at the place found with it.
/// @param distance  a guess; the place is right if it is
template <class Row, bool kMayTaper>
FCL_FIBERS_ALWAYS_INLINE ArcRows<Row> closestOfAxes(const PairRows<Row, kMayTaper>& pair,
                                                    Row distance) {
  const Vec3Rows<Row>&w = pair.w, &u = pair.u, &v = pair.v;
  const Row uu = dot(u, u), vv = dot(v, v), uv = dot(u, v);
  ArcRows<Row> at;
  for (int pass = 0; pass < (kMayTaper ? 2 : 1); ++pass) {
    const auto [uw, vw] = pair.slopes(w, distance);
    at.s = quotientInUnitInterval(uv * vw - uw * vv, uu * vv - uv * uv);
    at.t = quotientInUnitInterval(uv * at.s + vw, vv);
    at.s = quotientInUnitInterval(uv * at.t - uw, uu);
    const Vec3Rows<Row> r = pointBetween(w, u, v, at.s, at.t);
    distance = squareRoot(dot(r, r));
  }
  return at;
}

/// As closestOfAxes(), but the points are closest even where axes that are nearly parallel cross.
/// See SquaredDistance::atClosestByProjection().
template <class Row>
FCL_FIBERS_ALWAYS_INLINE ArcRows<Row> closestByProjection(const Vec3Rows<Row>& w,
                                                          const Vec3Rows<Row>& u,
                                                          const Vec3Rows<Row>& v) {
  const Row zero = Row::all(0);
  const Row vv = dot(v, v), uv = dot(u, v), vw = dot(v, w);
  const auto is_point = vv <= zero;
  const Row u_share = choose(is_point, zero, quotient(uv, vv));
  const Row w_share = choose(is_point, zero, quotient(vw, vv));
  const Vec3Rows<Row> across = pointBetween(u, v, v, zero, u_share);
  const Vec3Rows<Row> apart = pointBetween(w, v, v, zero, w_share);
  const Row s = quotientInUnitInterval(zero - dot(apart, across), dot(across, across));
  const Row t = quotientInUnitInterval(uv * s + vw, vv);
  return {quotientInUnitInterval(uv * t - dot(u, w), dot(u, u)), t};
}

/// Loads the group of pairs that begins at i. A second end may have the radius of another capsule,
/// where its own does not taper.
template <bool kMayTaper>
FCL_FIBERS_ALWAYS_INLINE PairRows<Float, kMayTaper> load(const RelativePairs& relative, int i,
                                                         bool p_may_taper, bool q_may_taper) {
  PairRows<Float, kMayTaper> pair;
  pair.reach = relative.w.get(i, pair.w);
  pair.taper_u = relative.u.get(i, pair.u);
  pair.taper_v = relative.v.get(i, pair.v);
  if (!p_may_taper) pair.taper_u = Float::all(0);
  if (!q_may_taper) pair.taper_v = Float::all(0);
  return pair;
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
