// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/frame.h"
#include "geometry/segment.h"

namespace fcl_fibers::index {

/// Like FrameChange, but a box that overflows becomes open to all sides.
inline geometry::Segment inFrame(const geometry::FrameChange& change,
                                 const geometry::Segment& segment) {
  const geometry::Segment moved = change(segment);
  if (!segment.isBox()) return moved;
  const bool is_box = moved.a.x <= moved.b.x && moved.a.y <= moved.b.y && moved.a.z <= moved.b.z;
  const bool is_right = is_box && (isBounded(moved) || !isBounded(segment));
  return is_right ? moved : geometry::Segment::everywhere();
}

/// The volume around a segment that is not of the index. A segment whose coordinates have
/// overflowed in the index's frame may be anywhere.
template <class Volume>
Volume volumeAround(const geometry::Segment& segment, double padding) {
  const bool is_somewhere = segment.isBox() || isBounded(segment);
  return is_somewhere ? Volume::around(segment, padding) : Volume::unbounded();
}

}  // namespace fcl_fibers::index
