// A file named -inl.h is compiled once for every instruction set (Google Highway's "target"), each
// time into another namespace. It must not include Eigen or FCL. A function that it calls in its
// inner loops must be in such a file too, or be inlined.
#if defined(FCL_FIBERS_SIMD_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_SIMD_LANES_INL_H
#undef FCL_FIBERS_SIMD_LANES_INL_H
#else
#define FCL_FIBERS_SIMD_LANES_INL_H
#endif

#include <cmath>

// Where Highway has one lane, it calls isnan() without std.
namespace hwy {
using std::isnan;
}  // namespace hwy

#include <hwy/highway.h>

#include "simd/always_inline.h"
#include "simd/lanes.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::simd::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// @param truth  has at most sixteen lanes
template <class Tag>
FCL_FIBERS_ALWAYS_INLINE LaneMask laneMask(Tag tag, hn::Mask<Tag> truth) {
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(tag, truth, bits);
  return bits[0] | LaneMask{bits[1]} << 8;
}

/// N floats, or doubles, that take part in one operation at once. Each lane has the type's own
/// arithmetic on every machine: no fused operations, no reciprocals.
template <int N, class T = float>
class Lanes {
  using Tag = hn::CappedTag<T, static_cast<std::size_t>(N)>;
  using Integers = hn::RebindToSigned<Tag>;
  using Vector = hn::Vec<Tag>;
  static constexpr int kWidth = static_cast<int>(hn::MaxLanes(Tag()));
  static constexpr int kVectors = N / kWidth;

 public:
  /// @pre values is aligned to N numbers
  FCL_FIBERS_ALWAYS_INLINE static Lanes load(const T* values) {
    return generate([values](int i) HWY_ATTR { return hn::Load(Tag(), values + i * kWidth); });
  }
  FCL_FIBERS_ALWAYS_INLINE static Lanes all(T value) {
    const Vector vector = hn::Set(Tag(), value);
    return generate([vector](int) HWY_ATTR { return vector; });
  }
  /// Doubles of N floats.
  FCL_FIBERS_ALWAYS_INLINE static Lanes promoted(const float* values) {
    return generate([values](int i) HWY_ATTR {
      const hn::Rebind<float, Tag> floats;
      return hn::PromoteTo(Tag(), hn::LoadU(floats, values + i * kWidth));
    });
  }
  FCL_FIBERS_ALWAYS_INLINE void store(T (&values)[N]) const {
    for (int i = 0; i < kVectors; ++i) hn::StoreU(vector_[i], Tag(), values + i * kWidth);
  }

  /// @pre values is aligned to N numbers
  FCL_FIBERS_ALWAYS_INLINE void storeAligned(T* values) const {
    for (int i = 0; i < kVectors; ++i) hn::Store(vector_[i], Tag(), values + i * kWidth);
  }
  /// Loads N times four numbers: the first of each four into x, and so on.
  FCL_FIBERS_ALWAYS_INLINE static void loadInterleaved(const T* values, Lanes& x, Lanes& y,
                                                       Lanes& z, Lanes& w) {
    for (int i = 0; i < kVectors; ++i) {
      hn::LoadInterleaved4(Tag(), values + 4 * i * kWidth, x.vector_[i], y.vector_[i], z.vector_[i],
                           w.vector_[i]);
    }
  }
  /// Loads the first `count` lanes; the others are NaN.
  FCL_FIBERS_ALWAYS_INLINE static Lanes loadFirst(const T* values, int count) {
    return generate([=](int i) HWY_ATTR {
      const auto is_first = hn::RebindMask(
          Tag(), hn::Lt(hn::Iota(Integers(), i * kWidth), hn::Set(Integers(), count)));
      return hn::IfThenElse(is_first, hn::LoadU(Tag(), values + i * kWidth), hn::NaN(Tag()));
    });
  }
  /// The lanes, with `other` in place of NaN.
  FCL_FIBERS_ALWAYS_INLINE Lanes unlessNaN(T other) const {
    return generate([&](int i) HWY_ATTR {
      return hn::IfThenElse(hn::IsNaN(vector_[i]), hn::Set(Tag(), other), vector_[i]);
    });
  }
  /// @pre no lane is NaN, and not all are infinity for least(), or -infinity for greatest()
  ///@{
  FCL_FIBERS_ALWAYS_INLINE T least() const {
    Vector least = vector_[0];
    for (int i = 1; i < kVectors; ++i) least = hn::Min(least, vector_[i]);
    return hn::GetLane(hn::MinOfLanes(Tag(), least));
  }
  FCL_FIBERS_ALWAYS_INLINE T greatest() const {
    Vector greatest = vector_[0];
    for (int i = 1; i < kVectors; ++i) greatest = hn::Max(greatest, vector_[i]);
    return hn::GetLane(hn::MaxOfLanes(Tag(), greatest));
  }
  ///@}
  /// Whether the bits of any lane differ.
  FCL_FIBERS_ALWAYS_INLINE bool differs(const Lanes& other) const {
    auto bits = hn::Zero(Integers());
    for (int i = 0; i < kVectors; ++i) {
      bits = hn::Or(bits, hn::Xor(hn::BitCast(Integers(), vector_[i]),
                                  hn::BitCast(Integers(), other.vector_[i])));
    }
    return !hn::AllTrue(Integers(), hn::Eq(bits, hn::Zero(Integers())));
  }

  FCL_FIBERS_ALWAYS_INLINE friend Lanes operator+(const Lanes& a, const Lanes& b) {
    return generate([&](int i) HWY_ATTR { return hn::Add(a.vector_[i], b.vector_[i]); });
  }
  FCL_FIBERS_ALWAYS_INLINE friend Lanes operator-(const Lanes& a, const Lanes& b) {
    return generate([&](int i) HWY_ATTR { return hn::Sub(a.vector_[i], b.vector_[i]); });
  }
  FCL_FIBERS_ALWAYS_INLINE friend Lanes operator*(const Lanes& a, const Lanes& b) {
    return generate([&](int i) HWY_ATTR { return hn::Mul(a.vector_[i], b.vector_[i]); });
  }

  /// a / b clamped to [0, 1], or 0 if b is not above 0. The result of NaN is unspecified.
  FCL_FIBERS_ALWAYS_INLINE friend Lanes quotientInUnitInterval(const Lanes& a, const Lanes& b) {
    return generate([&](int i) HWY_ATTR {
      const Vector zero = hn::Zero(Tag()), one = hn::Set(Tag(), T(1));
      const auto positive = hn::Gt(b.vector_[i], zero);
      const Vector divisor = hn::IfThenElse(positive, b.vector_[i], one);
      const Vector quotient = hn::IfThenElseZero(positive, hn::Div(a.vector_[i], divisor));
      return hn::Min(hn::Max(quotient, zero), one);
    });
  }
  FCL_FIBERS_ALWAYS_INLINE friend Lanes quotient(const Lanes& a, const Lanes& b) {
    return generate([&](int i) HWY_ATTR { return hn::Div(a.vector_[i], b.vector_[i]); });
  }
  FCL_FIBERS_ALWAYS_INLINE friend Lanes squareRoot(const Lanes& a) {
    return generate([&](int i) HWY_ATTR { return hn::Sqrt(a.vector_[i]); });
  }
  /// The result of NaN is unspecified.
  FCL_FIBERS_ALWAYS_INLINE friend Lanes max(const Lanes& a, const Lanes& b) {
    return generate([&](int i) HWY_ATTR { return hn::Max(a.vector_[i], b.vector_[i]); });
  }
  /// The result of NaN is unspecified.
  FCL_FIBERS_ALWAYS_INLINE friend Lanes min(const Lanes& a, const Lanes& b) {
    return generate([&](int i) HWY_ATTR { return hn::Min(a.vector_[i], b.vector_[i]); });
  }

  /// A truth value for each lane.
  struct Truth {
    hn::Mask<Tag> truth[kVectors];

    FCL_FIBERS_ALWAYS_INLINE friend Truth operator&(const Truth& p, const Truth& q) {
      Truth both;
      for (int i = 0; i < kVectors; ++i) both.truth[i] = hn::And(p.truth[i], q.truth[i]);
      return both;
    }
    FCL_FIBERS_ALWAYS_INLINE friend Truth without(const Truth& p, const Truth& q) {
      Truth rest;
      for (int i = 0; i < kVectors; ++i) rest.truth[i] = hn::AndNot(q.truth[i], p.truth[i]);
      return rest;
    }
    FCL_FIBERS_ALWAYS_INLINE friend Truth either(const Truth& p, const Truth& q) {
      Truth one;
      for (int i = 0; i < kVectors; ++i) one.truth[i] = hn::Or(p.truth[i], q.truth[i]);
      return one;
    }
    FCL_FIBERS_ALWAYS_INLINE LaneMask mask() const {
      LaneMask mask = 0;
      for (int i = 0; i < kVectors; ++i) {
        mask |= laneMask(Tag(), truth[i]) << (i * kWidth);
      }
      return mask;
    }
  };

  /// `a` where it is true, else `b`.
  FCL_FIBERS_ALWAYS_INLINE friend Lanes choose(const Truth& truth, const Lanes& a, const Lanes& b) {
    return generate(
        [&](int i) HWY_ATTR { return hn::IfThenElse(truth.truth[i], a.vector_[i], b.vector_[i]); });
  }

  // Comparisons are false in lanes where one of the two is NaN.
  FCL_FIBERS_ALWAYS_INLINE friend Truth operator<=(const Lanes& a, const Lanes& b) {
    Truth truth;
    for (int i = 0; i < kVectors; ++i) truth.truth[i] = hn::Le(a.vector_[i], b.vector_[i]);
    return truth;
  }
  FCL_FIBERS_ALWAYS_INLINE friend Truth operator<(const Lanes& a, const Lanes& b) {
    Truth truth;
    for (int i = 0; i < kVectors; ++i) truth.truth[i] = hn::Lt(a.vector_[i], b.vector_[i]);
    return truth;
  }

 private:
  template <class F>
  FCL_FIBERS_ALWAYS_INLINE static Lanes generate(F&& f) {
    Lanes result;
    for (int i = 0; i < kVectors; ++i) result.vector_[i] = f(i);
    return result;
  }
  Vector vector_[kVectors];
};

/// The lanes of N integers that equal `value`.
template <int N>
FCL_FIBERS_ALWAYS_INLINE LaneMask lanesEqual(const std::int32_t* values, std::int32_t value) {
  const hn::CappedTag<std::int32_t, static_cast<std::size_t>(N)> tag;
  constexpr int kWidth = static_cast<int>(hn::MaxLanes(tag));
  LaneMask mask = 0;
  for (int i = 0; i < N; i += kWidth) {
    mask |= laneMask(tag, hn::Eq(hn::LoadU(tag, values + i), hn::Set(tag, value))) << i;
  }
  return mask;
}

/// Eight integers, one for each lane of a mask.
class LaneNumbers {
  using Tag = hn::CappedTag<std::int32_t, 8>;
  static constexpr int kWidth = static_cast<int>(hn::MaxLanes(Tag()));
  static constexpr int kVectors = 8 / kWidth;

 public:
  /// first, first + 1, ...
  FCL_FIBERS_ALWAYS_INLINE static LaneNumbers from(std::int32_t first) {
    LaneNumbers numbers;
    for (int i = 0; i < kVectors; ++i) {
      // Highway writes the numbers of Iota() one by one, which costs nothing only for a constant.
      numbers.vector_[i] = hn::Add(hn::Iota(Tag(), i * kWidth), hn::Set(Tag(), first));
    }
    return numbers;
  }
  /// ~values[0], ~values[1], ...
  FCL_FIBERS_ALWAYS_INLINE static LaneNumbers inverse(const std::int32_t* values) {
    LaneNumbers numbers;
    for (int i = 0; i < kVectors; ++i) {
      numbers.vector_[i] = hn::Not(hn::LoadU(Tag(), values + i * kWidth));
    }
    return numbers;
  }

  // Each function writes a pair of two integers for each lane of the mask, one after the other, and
  // returns their number. No branch can be mispredicted. `out` must have room for eight pairs.

  FCL_FIBERS_ALWAYS_INLINE int writeAfter(std::int32_t first, LaneMask mask, void* out) const {
    return write(
        mask,
        [&](const auto& kept, std::int32_t* to)
            HWY_ATTR { hn::StoreInterleaved2(hn::Set(Tag(), first), kept, Tag(), to); },
        out);
  }
  FCL_FIBERS_ALWAYS_INLINE int writeBefore(std::int32_t second, LaneMask mask, void* out) const {
    return write(
        mask,
        [&](const auto& kept, std::int32_t* to)
            HWY_ATTR { hn::StoreInterleaved2(kept, hn::Set(Tag(), second), Tag(), to); },
        out);
  }

 private:
  using Vector = hn::Vec<Tag>;

  FCL_FIBERS_ALWAYS_INLINE static Vector kept(const Vector& numbers, LaneMask lanes) {
    // Our own table is used because with AVX2 Highway takes four times as long to get from a mask
    // to its table.
    const hn::Rebind<std::uint8_t, Tag> bytes;
    const auto order = hn::PromoteTo(Tag(), hn::LoadU(bytes, kLanesOfMask<kWidth>.lane[lanes]));
    return hn::TableLookupLanes(numbers, hn::IndicesFromVec(Tag(), order));
  }

  template <class F>
  FCL_FIBERS_ALWAYS_INLINE int write(LaneMask mask, F&& store, void* out) const {
    auto* to = static_cast<std::int32_t*>(out);
    int count = 0;
    for (int i = 0; i < kVectors; ++i) {
      const LaneMask lanes = mask >> (i * kWidth) & firstLanes(kWidth);
      store(kept(vector_[i], lanes), to + 2 * count);
      count += __builtin_popcount(lanes);
    }
    return count;
  }

  Vector vector_[kVectors];
};

}  // namespace fcl_fibers::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
