// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/rounding.h"
#include "geometry/segment.h"
#include "geometry/volume.h"

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
  FCL_FIBERS_ALWAYS_INLINE bool holds(int lane, const Box& box) const {
    bool differs = false;
    for (int axis = 0; axis < 3; ++axis) {
      differs |= !(low_[axis][lane] == box.low[axis] && high_[axis][lane] == box.high[axis]);
    }
    return !differs;
  }
  /// Sets the box and returns whether it has changed.
  FCL_FIBERS_ALWAYS_INLINE bool replace(int lane, const Box& box) {
    if (holds(lane, box)) return false;
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

  /// The least box around all of them; it is empty (low > high) if all lanes are clear.
  Box unite() const {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    Box box{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
    for (int axis = 0; axis < 3; ++axis) {
      for (int lane = 0; lane < N; ++lane) {
        // In this order NaN loses every comparison.
        const float low = low_[axis][lane], high = high_[axis][lane];
        box.low[axis] = low < box.low[axis] ? low : box.low[axis];
        box.high[axis] = high > box.high[axis] ? high : box.high[axis];
      }
    }
    return box;
  }

 private:
  float low_[3][N], high_[3][N];
};

}  // namespace fcl_fibers::geometry
