// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "geometry/rounding.h"
#include "geometry/segment.h"
#include "geometry/segment_block.h"
#include "simd/always_inline.h"

namespace fcl_fibers::geometry {

/// An axis-aligned box, closed.
struct Box {
  float low[3], high[3];

  template <int N>
  class Pack;

  /// Around everything.
  static Box unbounded() {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    return {{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
  }

  /// Around nothing: low > high.
  static Box empty() {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    return {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
  }

  FCL_FIBERS_ALWAYS_INLINE static Box around(const Segment& segment, double padding) {
    const double r = segment.thickness() + padding + endPointError(segment);
    const Vec3d low = min(segment.a, segment.b);
    const Vec3d high = max(segment.a, segment.b);
    return {{roundedDown(low.x - r), roundedDown(low.y - r), roundedDown(low.z - r)},
            {roundedUp(high.x + r), roundedUp(high.y + r), roundedUp(high.z + r)}};
  }

  FCL_FIBERS_ALWAYS_INLINE float size() const {
    return (high[0] - low[0]) + (high[1] - low[1]) + (high[2] - low[2]);
  }
};

/// Boxes in rows, one for each side, so that one operation takes several of them.
struct BoxRows {
  static constexpr int kCapacity = 512;

  Box operator[](int i) const {
    return {{low[0][i], low[1][i], low[2][i]}, {high[0][i], high[1][i], high[2][i]}};
  }
  void clear(int i) {
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    for (int axis = 0; axis < 3; ++axis) low[axis][i] = high[axis][i] = kNone;
  }

  // Eight boxes are read at a time, even from the last one on.
  alignas(64) float low[3][kCapacity + 16];
  alignas(64) float high[3][kCapacity + 16];
};

/// Writes the boxes around the first `count` segments of a block from boxes[first] on. Each is
/// equal to the result of Box::around(), to the last bit.
/// @pre first is a multiple of SegmentBlock::kCapacity
void boxesAround(const SegmentBlock& segments, int count, double padding, BoxRows& boxes,
                 int first);

/// N boxes:  low.x[0..N) low.y[0..N) low.z[0..N) high.x[0..N) high.y[0..N) high.z[0..N)
template <int N>
class alignas(4 * N) Box::Pack {
 public:
  Pack() {
    for (int lane = 0; lane < N; ++lane) clear(lane);
  }

  void set(int lane, const Box& box) {
    for (int axis = 0; axis < 3; ++axis) {
      low_[axis][lane] = box.low[axis];
      high_[axis][lane] = box.high[axis];
    }
  }
  /// Sets the box and returns whether its bits have changed.
  FCL_FIBERS_ALWAYS_INLINE bool replace(int lane, const Box& box) {
    std::uint32_t differs = 0;
    for (int axis = 0; axis < 3; ++axis) {
      differs |= bitsOf(low_[axis][lane]) ^ bitsOf(box.low[axis]);
      differs |= bitsOf(high_[axis][lane]) ^ bitsOf(box.high[axis]);
    }
    if (differs == 0) return false;
    set(lane, box);
    return true;
  }
  void clear(int lane) {
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    set(lane, {{kNone, kNone, kNone}, {kNone, kNone, kNone}});
  }
  FCL_FIBERS_ALWAYS_INLINE Box get(int lane) const {
    return {{low_[0][lane], low_[1][lane], low_[2][lane]},
            {high_[0][lane], high_[1][lane], high_[2][lane]}};
  }

  const float* low(int axis) const { return low_[axis]; }
  const float* high(int axis) const { return high_[axis]; }
  float* low(int axis) { return low_[axis]; }
  float* high(int axis) { return high_[axis]; }

 private:
  static std::uint32_t bitsOf(float x) {
    std::uint32_t bits;
    std::memcpy(&bits, &x, sizeof(bits));
    return bits;
  }

  float low_[3][N], high_[3][N];
};

}  // namespace fcl_fibers::geometry
