// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>

#include "geometry/affine_map.h"
#include "geometry/box.h"
#include "geometry/capsule_test.h"
#include "geometry/frame.h"
#include "tree/topology.h"

namespace fcl_fibers::live {

/// The radius of the anchor of a box, which no capsule has.
constexpr float kRadiusOfBox = std::numeric_limits<float>::max();

/// Where an end of a segment was when its pairs were listed: x, y, z and the radius of the capsule
/// that begins there or, of rounded cones, at this end.
struct alignas(16) Anchor {
  float numbers[4];
};

/// A few segments, their ends and the anchors of these. Each segment has an anchor for its first
/// end and one for its second, unless the next one shares it.
struct AnchoredEnds {
  const tree::SegmentId* ids;
  int count;
  int ahead;  ///< how many ids after those will be asked about soon, and so are prefetched

  const geometry::CapsuleEnd* ends;
  std::size_t stride;  ///< ends from a segment to that with the next id; if it is 1, they share one
  tree::SegmentId first;  ///< the segment whose ends are ends[0] and ends[1]
  const Anchor* anchors;  ///< of ids[0] first
  bool may_taper;         ///< whether each end has its own radius

  std::size_t placeOf(tree::SegmentId id) const {
    return stride * static_cast<std::size_t>(id - first);
  }
  /// Whether ids[i + 1] shares its first end with ids[i].
  bool sharesSecond(int i) const {
    return stride == 1 && i + 1 < count && ids[i + 1] == ids[i] + 1;
  }
};

/// A box around the anchors of all these segments and their radii.
geometry::Box boxAround(const AnchoredEnds& ends);

/// Takes ends and anchors to one frame, by numbers for x, y, z and the radius.
struct Displacing {
  /// @param to_anchors  leads from the frame of the ends to that of the anchors; null if it is one
  /// @param motion      a rigid motion of the anchors
  Displacing(const geometry::FrameChange* to_anchors, const geometry::AffineMap& motion);

  bool turns;                                  ///< whether the motion is more than a shift
  alignas(32) double scale[4], shift[4];       ///< of an end
  alignas(32) double columns[4][4], moved[4];  ///< of an anchor
};

/// Bounds of what leads from moved anchors to ends.
struct Displacements {
  double low[3], high[3];  ///< by axis
  double growth;           ///< of a radius; infinite if a box has become a capsule, or the reverse
  bool are_finite;
};
Displacements displacementsOf(const AnchoredEnds& ends, const Displacing& displacing);
/// Writes those of each segment.
void eachDisplacement(const AnchoredEnds& ends, const Displacing& displacing, Displacements* out);

}  // namespace fcl_fibers::live
