// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/posed_shapes.h"

#include <cstdint>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/posed_shapes.cpp"
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
FCL_FIBERS_ALWAYS_INLINE Vectors choose(const DoubleMask& truth, const Vectors& a,
                                        const Vectors& b) {
  return {hn::IfThenElse(truth, a.x, b.x), hn::IfThenElse(truth, a.y, b.y),
          hn::IfThenElse(truth, a.z, b.z)};
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

/// Whether boxes of objects have the sizes that FCL gives to boxes, turned or not. isStockSize()
/// decides in the same way, and has the reasons. A turn that these entries of a rotation do not
/// tell is left to it.
FCL_FIBERS_ALWAYS_INLINE DoubleMask areStockSizes(const PosedShapes& shapes, int i,
                                                  const Vectors& own_half,
                                                  const ScalarLimits& limits) {
  const Doubles d;
  const auto one_half = hn::Set(d, 0.5);
  const Vectors low = Vectors::load(shapes.low, i), high = Vectors::load(shapes.high, i);
  const Vectors half = one_half * high - one_half * low;
  const auto farthest = hn::Max(largest(abs(low)), largest(abs(high)));
  const auto rounding = hn::Add(
      hn::Mul(hn::Set(d, limits.epsilon), hn::Add(hn::Mul(hn::Set(d, 1.25), farthest),
                                                  hn::Mul(hn::Set(d, 4), largest(abs(half))))),
      hn::Set(d, limits.tiny));
  const auto isWithin = [](const DoubleLanes& off, const DoubleLanes& slack)
                            HWY_ATTR { return hn::Le(hn::Abs(off), slack); };
  const Vectors off = half - own_half;
  const auto is_local = hn::And(isWithin(off.x, rounding),
                                hn::And(isWithin(off.y, rounding), isWithin(off.z, rounding)));
  constexpr double kSmall = 1e-280;
  const auto square = dot(own_half, own_half);
  const auto is_cube = hn::And(isWithin(hn::Sub(half.y, half.x), rounding),
                               isWithin(hn::Sub(half.z, half.x), rounding));
  const auto is_around_ball = isWithin(hn::Sub(hn::Mul(half.x, half.x), square),
                                       hn::Mul(hn::Add(rounding, rounding), half.x));
  const auto turns = [&](int column, int axis) HWY_ATTR {
    return hn::Gt(hn::Abs(hn::Load(d, shapes.rotation[column][axis] + i)),
                  hn::Set(d, limits.no_turn));
  };
  const auto is_turned = hn::And(hn::Or(turns(0, 1), hn::Or(turns(1, 2), turns(2, 0))),
                                 hn::Gt(square, hn::Set(d, kSmall)));
  const auto is_bounded = hn::Le(farthest, hn::Set(d, limits.far));
  return hn::And(is_bounded,
                 hn::Or(is_local, hn::And(is_turned, hn::And(is_cube, is_around_ball))));
}

/// The segments of some shapes, and which of them are proper.
struct Segments {
  Vectors a, b;
  DoubleLanes radius;
  DoubleMask are_usual;
};

/// The lanes of a block from place i on.
class Lanes {
 public:
  FCL_FIBERS_ALWAYS_INLINE Lanes(const PosedShapes& shapes, int i, const Frame& frame,
                                 const ScalarLimits& limits, bool count_boxes)
      : shapes_(shapes),
        i_(i),
        frame_(frame),
        limits_(limits),
        count_boxes_(count_boxes),
        position_(Vectors::load(shapes.position, i)),
        size_(Vectors::load(shapes.size, i)),
        radius_(hn::Load(Doubles(), shapes.radius + i)) {
    const Doubles d;
    const Vectors origin = {hn::Set(d, frame.origin.x), hn::Set(d, frame.origin.y),
                            hn::Set(d, frame.origin.z)};
    center_ = hn::Set(d, frame.scale) * (position_ - origin);
  }

  FCL_FIBERS_ALWAYS_INLINE Segments capsules() const {
    const Doubles d;
    const Vectors axis = column(2);
    const DoubleLanes& length = size_.z;
    // Halving the length instead of the scale could lose the last bit of a subnormal length.
    const Vectors half = hn::Mul(hn::Set(d, frame_.scale / 2), length) * axis;
    Segments found = {
        center_ - half, center_ + half, hn::Mul(hn::Set(d, frame_.scale), radius_), {}};
    found.are_usual = hn::And(hn::And(isSize(length), isSize(radius_)),
                              hn::And(isSize(found.radius), areFinite(found)));
    if (count_boxes_) {
      const Vectors size = Vectors::load(shapes_.high, i_) - Vectors::load(shapes_.low, i_);
      found.are_usual = hn::And(
          found.are_usual, addNothing(size, position_, axis, length, radius_, limits_.epsilon));
    }
    return found;
  }

  FCL_FIBERS_ALWAYS_INLINE Segments boxes() const {
    const Doubles d;
    const auto scale = hn::Set(d, frame_.scale);
    const Vectors half = hn::Set(d, 0.5) * size_;
    const Vectors posed =
        half.x * abs(column(0)) + half.y * abs(column(1)) + half.z * abs(column(2));
    // See ShapeBox::rounding().
    const auto outward =
        hn::Add(hn::Mul(hn::Set(d, 16 * std::numeric_limits<double>::epsilon()), largest(posed)),
                hn::Set(d, 4 * std::numeric_limits<double>::min()));
    const Vectors reach = scale * (posed + Vectors{outward, outward, outward});
    Segments found = {center_ - reach, center_ + reach, radius_, {}};
    found.are_usual = hn::And(hn::And(isSize(size_.x), hn::And(isSize(size_.y), isSize(size_.z))),
                              areFinite(found));
    if (count_boxes_) {
      found.are_usual = hn::And(found.are_usual, areStockSizes(shapes_, i_, half, limits_));
    }
    return found;
  }

  FCL_FIBERS_ALWAYS_INLINE DoubleMask areRotations(double tolerance) const {
    return isRotation(column(0), column(1), column(2), tolerance);
  }

 private:
  FCL_FIBERS_ALWAYS_INLINE Vectors column(int i) const {
    return Vectors::load(shapes_.rotation[i], i_);
  }
  FCL_FIBERS_ALWAYS_INLINE static DoubleMask isSize(const DoubleLanes& size) {
    const Doubles d;
    return hn::And(hn::Ge(size, hn::Zero(d)), hn::Lt(size, hn::Inf(d)));
  }
  FCL_FIBERS_ALWAYS_INLINE static DoubleMask areFinite(const Segments& s) {
    // Infinities and NaN survive addition.
    const auto sum =
        hn::Add(hn::Add(hn::Add(hn::Add(hn::Add(s.a.x, s.a.y), s.a.z), s.b.x), s.b.y), s.b.z);
    return hn::Lt(hn::Abs(sum), hn::Inf(Doubles()));
  }

  const PosedShapes& shapes_;
  const int i_;
  const Frame& frame_;
  const ScalarLimits& limits_;
  const bool count_boxes_;
  Vectors position_, size_, center_;
  DoubleLanes radius_;
};

/// @tparam kBoxes  whether there are boxes. Without them the loop needs fewer registers.
template <bool kBoxes>
BlockMask segmentsIn(const PosedShapes& shapes, BlockMask boxes, int count, const Frame& frame,
                     double rotation_tolerance, const ScalarLimits& limits, bool count_boxes,
                     SegmentBlock& out) {
  const Doubles d;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(Doubles()));
  static_assert(8 % kLanes == 0);
  constexpr BlockMask kAll = firstOfBlock(kLanes);
  BlockMask result = 0;
  for (int i = 0; i < count; i += kLanes) {
    const Lanes lanes(shapes, i, frame, limits, count_boxes);
    const BlockMask here = kBoxes ? boxes >> i & kAll : 0;
    Segments found = here == kAll ? lanes.boxes() : lanes.capsules();
    if (here != 0 && here != kAll) {
      const Segments other = lanes.boxes();
      const std::uint8_t bits[8] = {static_cast<std::uint8_t>(here)};
      const DoubleMask is_box = hn::LoadMaskBits(d, bits);
      found = {choose(is_box, other.a, found.a), choose(is_box, other.b, found.b),
               hn::IfThenElse(is_box, other.radius, found.radius),
               hn::Or(hn::And(is_box, other.are_usual), hn::AndNot(is_box, found.are_usual))};
    }
    found.a.store(out.a, i);
    found.b.store(out.b, i);
    hn::Store(found.radius, d, out.radius + i);
    const DoubleMask are_usual = hn::And(found.are_usual, lanes.areRotations(rotation_tolerance));
    std::uint8_t bits[8];
    hn::StoreMaskBits(d, are_usual, bits);
    result |= BlockMask{bits[0]} << i;
  }
  return result;
}

BlockMask segmentsOf(const PosedShapes& shapes, BlockMask boxes, int count, const Frame& frame,
                     double rotation_tolerance, const ScalarLimits& limits, bool count_boxes,
                     SegmentBlock& out) {
  const auto segments = boxes != 0 ? segmentsIn<true> : segmentsIn<false>;
  return segments(shapes, boxes, count, frame, rotation_tolerance, limits, count_boxes, out);
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::geometry {

HWY_EXPORT(segmentsOf);

void PosedShapes::clear(int i) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int column = 0; column < 3; ++column) rotation[column][axis][i] = column == axis;
    position[axis][i] = size[axis][i] = 0;
    low[axis][i] = -1;
    high[axis][i] = 1;
  }
  radius[i] = 1;
}

BlockMask segmentsOf(const PosedShapes& shapes, BlockMask boxes, int count, const Frame& frame,
                     double rotation_tolerance, const ScalarLimits& limits, bool count_boxes,
                     SegmentBlock& out) {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(segmentsOf)(shapes, boxes, count, frame, rotation_tolerance, limits,
                                          count_boxes, out);
}

}  // namespace fcl_fibers::geometry
#endif
