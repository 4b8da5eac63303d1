// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "geometry/always_inline.h"

namespace fcl_fibers::geometry {

/// One bit a lane.
using LaneMask = std::uint32_t;

constexpr LaneMask firstLanes(int count) { return (LaneMask{1} << count) - 1; }

/// N floats that are computed with at once. Arithmetic is that of float, lane by lane, whatever the
/// machine: no fused operations, no reciprocals.
template <int N>
class Lanes {
 public:
  FCL_FIBERS_ALWAYS_INLINE static Lanes load(const float* values) {
    return generate([values](int i) { return values[i]; });
  }
  FCL_FIBERS_ALWAYS_INLINE static Lanes all(float value) {
    return generate([value](int) { return value; });
  }

  FCL_FIBERS_ALWAYS_INLINE friend Lanes operator+(const Lanes& a, const Lanes& b) {
    return generate([&](int i) { return a.lane_[i] + b.lane_[i]; });
  }
  FCL_FIBERS_ALWAYS_INLINE friend Lanes operator-(const Lanes& a, const Lanes& b) {
    return generate([&](int i) { return a.lane_[i] - b.lane_[i]; });
  }
  FCL_FIBERS_ALWAYS_INLINE friend Lanes operator*(const Lanes& a, const Lanes& b) {
    return generate([&](int i) { return a.lane_[i] * b.lane_[i]; });
  }

  /// What holds in which lane.
  struct Truth {
    LaneMask lanes;

    FCL_FIBERS_ALWAYS_INLINE friend Truth operator&(const Truth& p, const Truth& q) {
      return {p.lanes & q.lanes};
    }
    FCL_FIBERS_ALWAYS_INLINE LaneMask mask() const { return lanes; }
  };

  /// False where one of the two is NaN.
  FCL_FIBERS_ALWAYS_INLINE friend Truth operator<=(const Lanes& a, const Lanes& b) {
    Truth truth{0};
    for (int i = 0; i < N; ++i) truth.lanes |= LaneMask{a.lane_[i] <= b.lane_[i]} << i;
    return truth;
  }

 private:
  template <class F>
  FCL_FIBERS_ALWAYS_INLINE static Lanes generate(F&& f) {
    Lanes result;
    for (int i = 0; i < N; ++i) result.lane_[i] = f(i);
    return result;
  }
  float lane_[N];
};

#if defined(__SSE2__)
/// SSE2 is part of x86-64, so this needs no compiler flag.
template <>
class Lanes<8> {
 public:
  FCL_FIBERS_ALWAYS_INLINE static Lanes load(const float* values) {
    return {_mm_load_ps(values), _mm_load_ps(values + 4)};
  }
  FCL_FIBERS_ALWAYS_INLINE static Lanes all(float value) {
    return {_mm_set1_ps(value), _mm_set1_ps(value)};
  }

  FCL_FIBERS_ALWAYS_INLINE friend Lanes operator+(const Lanes& a, const Lanes& b) {
    return {_mm_add_ps(a.low_, b.low_), _mm_add_ps(a.high_, b.high_)};
  }
  FCL_FIBERS_ALWAYS_INLINE friend Lanes operator-(const Lanes& a, const Lanes& b) {
    return {_mm_sub_ps(a.low_, b.low_), _mm_sub_ps(a.high_, b.high_)};
  }
  FCL_FIBERS_ALWAYS_INLINE friend Lanes operator*(const Lanes& a, const Lanes& b) {
    return {_mm_mul_ps(a.low_, b.low_), _mm_mul_ps(a.high_, b.high_)};
  }

  struct Truth {
    __m128 low, high;

    FCL_FIBERS_ALWAYS_INLINE friend Truth operator&(const Truth& p, const Truth& q) {
      return {_mm_and_ps(p.low, q.low), _mm_and_ps(p.high, q.high)};
    }
    FCL_FIBERS_ALWAYS_INLINE LaneMask mask() const {
      return static_cast<LaneMask>(_mm_movemask_ps(low) | _mm_movemask_ps(high) << 4);
    }
  };
  FCL_FIBERS_ALWAYS_INLINE friend Truth operator<=(const Lanes& a, const Lanes& b) {
    return {_mm_cmple_ps(a.low_, b.low_), _mm_cmple_ps(a.high_, b.high_)};
  }

 private:
  FCL_FIBERS_ALWAYS_INLINE Lanes(__m128 low, __m128 high) : low_(low), high_(high) {}
  __m128 low_, high_;
};
#endif

}  // namespace fcl_fibers::geometry
