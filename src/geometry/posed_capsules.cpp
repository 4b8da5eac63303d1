// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/posed_capsules.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/posed_capsules.cpp"
#include <hwy/foreach_target.h>

#include "simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, 8>;
using DoubleLanes = hn::Vec<Doubles>;
using DoubleMask = hn::Mask<Doubles>;

/// Three rows of a block.
struct Vectors {
  DoubleLanes x, y, z;

  FCL_FIBERS_ALWAYS_INLINE static Vectors load(const double (&rows)[3][SegmentBlock::kCapacity],
                                               int i) {
    const Doubles d;
    return {hn::Load(d, rows[0] + i), hn::Load(d, rows[1] + i), hn::Load(d, rows[2] + i)};
  }
  FCL_FIBERS_ALWAYS_INLINE void store(double (&rows)[3][SegmentBlock::kCapacity], int i) const {
    const Doubles d;
    hn::Store(x, d, rows[0] + i);
    hn::Store(y, d, rows[1] + i);
    hn::Store(z, d, rows[2] + i);
  }
};

FCL_FIBERS_ALWAYS_INLINE Vectors operator+(const Vectors& a, const Vectors& b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
FCL_FIBERS_ALWAYS_INLINE Vectors operator-(const Vectors& a, const Vectors& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
FCL_FIBERS_ALWAYS_INLINE Vectors operator*(const DoubleLanes& s, const Vectors& v) {
  return {hn::Mul(s, v.x), hn::Mul(s, v.y), hn::Mul(s, v.z)};
}
FCL_FIBERS_ALWAYS_INLINE DoubleLanes dot(const Vectors& a, const Vectors& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
FCL_FIBERS_ALWAYS_INLINE Vectors cross(const Vectors& a, const Vectors& b) {
  return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)),
          hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
          hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}
FCL_FIBERS_ALWAYS_INLINE Vectors abs(const Vectors& v) {
  return {hn::Abs(v.x), hn::Abs(v.y), hn::Abs(v.z)};
}
FCL_FIBERS_ALWAYS_INLINE DoubleLanes largest(const Vectors& v) {
  return hn::Max(hn::Max(v.x, v.y), v.z);
}

/// Whether a rotation is close to an orthonormal one. Two columns must be perpendicular unit
/// vectors, and the third their cross product. NaN and infinity fail the comparison.
FCL_FIBERS_ALWAYS_INLINE DoubleMask isRotation(const Vectors& x, const Vectors& y, const Vectors& z,
                                               double tolerance) {
  const auto one = hn::Set(Doubles(), 1);
  const Vectors off = abs(cross(x, y) - z);
  const auto lengths = hn::Add(hn::Abs(hn::Sub(dot(x, x), one)), hn::Abs(hn::Sub(dot(y, y), one)));
  const auto deviation =
      hn::Add(hn::Add(lengths, hn::Add(hn::Abs(dot(x, y)), off.x)), hn::Add(off.y, off.z));
  return hn::Le(deviation, hn::Set(Doubles(), tolerance));
}

/// Whether boxes have the sizes that FCL gives to capsules, or the least sizes in their pose, up to
/// the rounding of their sides. Boxes of turned capsules that are too small to be squared or have
/// hardly any length are left to a second look.
FCL_FIBERS_ALWAYS_INLINE DoubleMask addNothing(const Vectors& size, const Vectors& position,
                                               const Vectors& axis, const DoubleLanes& length,
                                               const DoubleLanes& radius, double epsilon) {
  const Doubles d;
  const auto thickness = hn::Add(radius, radius);
  const auto end = hn::Add(length, thickness);
  const auto slack = hn::Mul(
      hn::Set(d, epsilon),
      hn::Add(hn::Mul(hn::Set(d, 2.5), largest(abs(position))), hn::Mul(hn::Set(d, 8), end)));
  const auto is = [&](const Vectors& sides) HWY_ATTR {
    const Vectors off = abs(size - sides);
    return hn::And(hn::Le(off.x, slack), hn::And(hn::Le(off.y, slack), hn::Le(off.z, slack)));
  };
  // The side of a turned box is the diagonal of the box that is not turned.
  constexpr double kSmall = 1e-280;
  const auto square =
      hn::Add(hn::Mul(hn::Mul(thickness, thickness), hn::Set(d, 2)), hn::Mul(end, end));
  // Without length both are cubes, and one that a program widened may be as large as the other.
  const auto twice = hn::Add(slack, slack);
  const auto is_turned = hn::And(
      hn::And(is({size.x, size.x, size.x}), hn::Gt(length, twice)),
      hn::And(hn::Gt(square, hn::Set(d, kSmall)),
              hn::Le(hn::Abs(hn::Sub(hn::Mul(size.x, size.x), square)), hn::Mul(twice, size.x))));
  const Vectors tight = length * abs(axis) + Vectors{thickness, thickness, thickness};
  return hn::Or(is_turned, hn::Or(is({thickness, thickness, end}), is(tight)));
}

BlockMask segmentsOf(const PosedCapsules& capsules, int count, const Frame& frame,
                     double rotation_tolerance, double epsilon, bool count_boxes,
                     SegmentBlock& out) {
  const Doubles d;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(Doubles()));
  static_assert(8 % kLanes == 0);
  const auto scale = hn::Set(d, frame.scale), infinity = hn::Inf(d);
  const Vectors origin = {hn::Set(d, frame.origin.x), hn::Set(d, frame.origin.y),
                          hn::Set(d, frame.origin.z)};
  BlockMask result = 0;
  for (int i = 0; i < count; i += kLanes) {
    const Vectors x = Vectors::load(capsules.rotation[0], i);
    const Vectors y = Vectors::load(capsules.rotation[1], i);
    const Vectors z = Vectors::load(capsules.rotation[2], i);
    const Vectors position = Vectors::load(capsules.position, i);
    const auto length = hn::Load(d, capsules.length + i);
    const auto radius = hn::Load(d, capsules.radius + i);

    const Vectors center = scale * (position - origin);
    // Halving the length instead of the scale could lose the last bit of a subnormal length.
    const Vectors half = hn::Mul(hn::Set(d, frame.scale / 2), length) * z;
    const Vectors a = center - half, b = center + half;
    const auto thickness = hn::Mul(scale, radius);
    a.store(out.a, i);
    b.store(out.b, i);
    hn::Store(thickness, d, out.radius + i);

    const auto isSize = [&](const DoubleLanes& size) HWY_ATTR {
      return hn::And(hn::Ge(size, hn::Zero(d)), hn::Lt(size, infinity));
    };
    // Infinities and NaN survive addition.
    const auto ends = hn::Add(hn::Add(hn::Add(hn::Add(hn::Add(a.x, a.y), a.z), b.x), b.y), b.z);
    auto is_usual = hn::And(isRotation(x, y, z, rotation_tolerance), isSize(length));
    is_usual = hn::And(is_usual, hn::And(isSize(radius), isSize(thickness)));
    is_usual = hn::And(is_usual, hn::Lt(hn::Abs(ends), infinity));
    if (count_boxes) {
      const Vectors size = Vectors::load(capsules.high, i) - Vectors::load(capsules.low, i);
      is_usual = hn::And(is_usual, addNothing(size, position, z, length, radius, epsilon));
    }
    std::uint8_t bits[8];
    hn::StoreMaskBits(d, is_usual, bits);
    result |= BlockMask{bits[0]} << i;
  }
  return result;
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::geometry {

HWY_EXPORT(segmentsOf);

void PosedCapsules::clear(int i) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int column = 0; column < 3; ++column) rotation[column][axis][i] = column == axis;
    position[axis][i] = length[i] = 0;
    low[axis][i] = -1;
    high[axis][i] = 1;
  }
  radius[i] = 1;
}

BlockMask segmentsOf(const PosedCapsules& capsules, int count, const Frame& frame,
                     double rotation_tolerance, double epsilon, bool count_boxes,
                     SegmentBlock& out) {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(segmentsOf)(capsules, count, frame, rotation_tolerance, epsilon,
                                          count_boxes, out);
}

}  // namespace fcl_fibers::geometry
#endif
