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

/// Two arc parameters.
template <class Row>
struct ArcRows {
  Row s, t;
};

/// Finds where |w + s u - t v| is least, up to rounding: the closest points of the lines, each
/// clamped in turn.
template <class Row>
FCL_FIBERS_ALWAYS_INLINE ArcRows<Row> closestOfAxes(const Vec3Rows<Row>& w, const Vec3Rows<Row>& u,
                                                    const Vec3Rows<Row>& v) {
  const Row uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  const Row s = quotientInUnitInterval(uv * vw - uw * vv, uu * vv - uv * uv);
  const Row t = quotientInUnitInterval(uv * s + vw, vv);
  return {quotientInUnitInterval(uv * t - uw, uu), t};
}

/// w + s u - t v
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Vec3Rows<Row> pointBetween(const Vec3Rows<Row>& w, const Vec3Rows<Row>& u,
                                                    const Vec3Rows<Row>& v, const Row& s,
                                                    const Row& t) {
  return {w.x + s * u.x - t * v.x, w.y + s * u.y - t * v.y, w.z + s * u.z - t * v.z};
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

/// The place on a cone that is nearest to a point, as geometry::bestOnCone() finds it.
/// @param squared  the length of the axis
FCL_FIBERS_ALWAYS_INLINE Float bestOnCone(const Vec3Lanes& point, const Vec3Lanes& axis,
                                          const Float& squared, const Float& taper) {
  const Float zero = Float::all(0), one = Float::all(1), tiny = Float::all(0x1p-80f);
  const Float rest = squared - taper * taper;
  const Float foot = quotient(dot(point, axis), max(squared, tiny));
  const Vec3Lanes away = pointBetween(point, axis, axis, zero, foot);
  const Float shift =
      taper * squareRoot(quotient(dot(away, away), max(squared * rest, tiny * tiny)));
  const Float at = min(max(foot + shift, zero), one);
  return choose(zero < rest, at, choose(zero < taper, one, zero));
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
