// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/triangle_test.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/triangle_test.cpp"
#include <hwy/foreach_target.h>

#include "geometry/pair_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

/// Pairs relative to the first corner of their triangle and in float.
struct RelativeTriangles {
  Quads w;       ///< from the first corner to the capsule's first end; and the radius there
  Quads u;       ///< along the capsule; and by how much the radius grows, if it may be tapered
  Quads v1, v2;  ///< from the first corner to the second and to the third

  FCL_FIBERS_ALWAYS_INLINE void set(int i, const TrianglePairs& pairs) {
    const hn::CappedTag<double, 4> d;
    constexpr int kWidth = static_cast<int>(hn::MaxLanes(d));
    const auto scale = hn::Set(d, pairs.unit());
    const CapsuleEnd* const capsule = pairs.p(i);
    const MeshCorners& corners = pairs.q(i);
    const auto& posing = pairs.posing();
    for (int k = 0; k < 4; k += kWidth) {
      // The operations of AffineMap.
      const auto posed = [&](const MeshPoint& p) HWY_ATTR {
        const auto term = [&](int axis) HWY_ATTR {
          return hn::Mul(hn::Set(d, p.numbers[axis]), hn::Load(d, posing[axis].numbers + k));
        };
        return hn::Add(hn::Add(hn::Add(term(0), term(1)), term(2)),
                       hn::Load(d, posing[3].numbers + k));
      };
      const auto p0 = hn::Load(d, capsule[0].numbers + k);
      const auto p1 = hn::Load(d, capsule[1].numbers + k);
      const auto a = posed(*corners.a);
      w.set(d, i, k, hn::Sub(p0, a), scale);
      u.set(d, i, k, hn::Sub(p1, p0), scale);
      v1.set(d, i, k, hn::Sub(posed(*corners.b), a), scale);
      v2.set(d, i, k, hn::Sub(posed(*corners.c), a), scale);
    }
  }
};

/// The squared distance of a point of the axis and a point of the triangle, f(s, x, y) =
/// |w + s u - x v1 - y v2|^2, is convex over the unit interval and the triangle x, y >= 0,
/// x + y <= 1. So f at any point is an upper bound of its minimum, and f minus the fall of the
/// tangent plane is a lower bound (Frank and Wolfe, 1956). Hence the points need not be exact; only
/// the rounding of f and of its slopes has to be bounded.
class TriangleBounds {
 public:
  FCL_FIBERS_ALWAYS_INLINE TriangleBounds(const RelativeTriangles& relative, int i) {
    radius = relative.w.get(i, w_);
    taper = relative.u.get(i, u_);
    relative.v1.get(i, v1_);
    relative.v2.get(i, v2_);
    uu_ = dot(u_, u_);
    const Float vv1 = dot(v1_, v1_), vv2 = dot(v2_, v2_);
    squares = dot(w_, w_) + uu_ + vv1 + vv2;

    // A point of the axis crosses the triangle, is the end nearest to its plane, or the closest
    // point of the triangle is on an edge.
    const Vec3Lanes normal = cross(v1_, v2_);
    const Float climb = dot(normal, u_);
    startAbove(quotientInUnitInterval(Float::all(0) - dot(normal, w_) * climb, climb * climb), vv1,
               vv2);
    const Float zero = Float::all(0), one = Float::all(1);
    tryEdge(w_, v1_, vv1, [&](const Float& t) HWY_ATTR { tryAt(s_, t, zero); });
    tryEdge(w_, v2_, vv2, [&](const Float& t) HWY_ATTR { tryAt(s_, zero, t); });
    const Vec3Lanes v3 = v2_ - v1_;
    tryEdge(w_ - v1_, v3, dot(v3, v3), [&](const Float& t) HWY_ATTR { tryAt(s_, one - t, t); });
  }

  Float radius, taper;  ///< at the first end, and by how much it grows if it may be tapered
  Float squares;        ///< the sum of the squared lengths of w, u, v1 and v2
  Float least_squared;  ///< at the closest of the points
  Float squared, gap;   ///< f and the fall of the tangent plane where their difference is greatest

 private:
  /// Tries the point of the triangle under a point of the axis.
  FCL_FIBERS_ALWAYS_INLINE void startAbove(const Float& s, const Float& vv1, const Float& vv2) {
    const Vec3Lanes p{w_.x + s * u_.x, w_.y + s * u_.y, w_.z + s * u_.z};
    const Float v12 = dot(v1_, v2_), p1 = dot(p, v1_), p2 = dot(p, v2_);
    const Float area = vv1 * vv2 - v12 * v12;
    const Float x = quotientInUnitInterval(p1 * vv2 - p2 * v12, area);
    const Float y = quotientInUnitInterval(p2 * vv1 - p1 * v12, area);
    at(s, x, min(y, Float::all(1) - x), squared, gap);
    least_squared = squared;
  }

  /// The closest points of the axis and the edge along v, each clamped in turn. `w` leads from the
  /// start of the edge to that of the axis.
  template <class F>
  FCL_FIBERS_ALWAYS_INLINE void tryEdge(const Vec3Lanes& w, const Vec3Lanes& v, const Float& vv,
                                        F&& tryPoint) {
    const Float uv = dot(u_, v), uw = dot(u_, w), vw = dot(v, w);
    const Float s = quotientInUnitInterval(uv * vw - uw * vv, uu_ * vv - uv * uv);
    const Float t = quotientInUnitInterval(uv * s + vw, vv);
    s_ = quotientInUnitInterval(uv * t - uw, uu_);
    tryPoint(t);
  }

  FCL_FIBERS_ALWAYS_INLINE void tryAt(const Float& s, const Float& x, const Float& y) {
    Float other_squared, other_gap;
    at(s, x, y, other_squared, other_gap);
    least_squared = min(least_squared, other_squared);
    const auto is_better = squared - gap <= other_squared - other_gap;
    squared = choose(is_better, other_squared, squared);
    gap = choose(is_better, other_gap, gap);
  }

  FCL_FIBERS_ALWAYS_INLINE void at(const Float& s, const Float& x, const Float& y, Float& f,
                                   Float& fall_of_f) const {
    const Vec3Lanes r{w_.x + s * u_.x - x * v1_.x - y * v2_.x,
                      w_.y + s * u_.y - x * v1_.y - y * v2_.y,
                      w_.z + s * u_.z - x * v1_.z - y * v2_.z};
    const Float along1 = dot(v1_, r), along2 = dot(v2_, r);
    f = dot(r, r);
    fall_of_f =
        Float::all(2) *
        (fall(dot(u_, r), s) + (max(max(along1, along2), Float::all(0)) - along1 * x - along2 * y));
  }

  Vec3Lanes w_, u_, v1_, v2_;
  Float uu_, s_;
};

FCL_FIBERS_ALWAYS_INLINE VerdictLanes decideLanes(const TrianglePairs& pairs,
                                                  const RelativeTriangles& relative, int i) {
  const TriangleBounds bounds(relative, i);
  const auto all = [](float x) HWY_ATTR { return Float::all(x); };
  const Float radius = bounds.radius, margin = Float::load(pairs.margin().data() + i);
  Float reach = max(radius + margin, all(0)), least_reach = reach;
  if (pairs.mayTaperP()) {
    reach = max(max(radius, radius + bounds.taper) + margin, all(0));
    least_reach = max(min(radius, radius + bounds.taper) + margin, all(0));
  }
  const Float error = Float::load(pairs.error().data() + i);

  // With e = 2^-23, which bounds a rounding in any direction, let m = |w| + |u| + |v1| + |v2|,
  // which is at most twice the root of the sum of the squares. The vector r carries an error of 6 e
  // m: of the conversion to float, of products and sums, and of a point that is beyond the edge by
  // rounding. Its length carries another 4 e of itself. A slope carries r's error and 5 e |r|, each
  // times the length of its vector. The gap is a sum of slopes whose vectors have lengths of at
  // most 4 m together, which makes 24 e m^2 and 20 e m |r|. Its own products and sums add 20 e m
  // |r|. Each bound below is wider by at least a fifth, which covers its own rounding.
  constexpr float kEps = 0x1p-23f;
  const Float m = all(2) * squareRoot(bounds.squares);
  const Float r_error = all(8 * kEps) * m;
  const Float distance = squareRoot(bounds.squared);
  const Float gap_error = m * (all(4) * r_error + all(64 * kEps) * distance);

  const Float farthest = squareRoot(bounds.least_squared) * all(1 + 6 * kEps) + r_error;
  const Float nearest = max(distance * all(1 - 6 * kEps) - r_error, all(0));
  const Float reach_up = reach * all(1 + 8 * kEps) + error * all(1 + 8 * kEps);
  const Float least = nearest * nearest * all(1 - 8 * kEps);
  const Float enough = (reach_up * reach_up + bounds.gap + gap_error) * all(1 + 16 * kEps);

  // The radius of a box is NaN.
  const auto is_decided = isInRange(bounds.squares) & (bounds.radius <= bounds.radius);
  return {(farthest <= least_reach * all(1 - 8 * kEps)) & is_decided,
          (enough <= least) & is_decided};
}

TrianglePairs::Verdict decide(const TrianglePairs& pairs) {
  RelativeTriangles relative;
  const int end = pairs.filledSize();
  for (int i = 0; i < end; ++i) relative.set(i, pairs);
  TrianglePairs::Verdict verdict;
  for (int i = 0; i < end; i += PairBlock::kGroup) add(decideLanes(pairs, relative, i), i, verdict);
  return verdict;
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::geometry {

HWY_EXPORT(decide);

TrianglePairs::TrianglePairs(const AffineMap& posing, double unit) : PairsOf(unit) {
  const Vec3d* const columns[] = {&posing.column[0], &posing.column[1], &posing.column[2],
                                  &posing.shift};
  for (int i = 0; i < 4; ++i) posing_[i] = {{columns[i]->x, columns[i]->y, columns[i]->z, 0}};
}

TrianglePairs::Verdict TrianglePairs::decide() {
  static constexpr MeshPoint kPoint = {};
  fill(kNoCapsule, {&kPoint, &kPoint, &kPoint});
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(decide)(*this);
}

}  // namespace fcl_fibers::geometry
#endif
