// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "geometry/segment.h"

namespace fcl_fibers::geometry {

/// Segments in rows, one for each coordinate, so that one operation takes several of them.
struct SegmentBlock {
  static constexpr int kCapacity = 64;

  void set(int i, const Segment& segment) {
    const double from[3] = {segment.a.x, segment.a.y, segment.a.z};
    const double to[3] = {segment.b.x, segment.b.y, segment.b.z};
    for (int axis = 0; axis < 3; ++axis) {
      a[axis][i] = from[axis];
      b[axis][i] = to[axis];
    }
    radius[i] = segment.radius;
  }
  Segment operator[](int i) const {
    const Vec3d from{a[0][i], a[1][i], a[2][i]}, to{b[0][i], b[1][i], b[2][i]};
    return are_tapered ? Segment::cone(from, to, end_radius[0][i], end_radius[1][i])
                       : Segment{from, to, radius[i]};
  }

  alignas(64) double a[3][kCapacity];  ///< one end, as in Segment
  alignas(64) double b[3][kCapacity];  ///< the other end
  alignas(64) double radius[kCapacity];
  alignas(64) double end_radius[2][kCapacity];  ///< those at the ends, if segments may be tapered
  bool are_tapered = false;                     ///< whether these are set
};

/// A bit for each segment of a block.
using BlockMask = std::uint64_t;
static_assert(SegmentBlock::kCapacity == 64);

/// The bits of the first `count` segments.
constexpr BlockMask firstOfBlock(int count) {
  return count == 64 ? ~BlockMask{0} : (BlockMask{1} << count) - 1;
}

}  // namespace fcl_fibers::geometry
