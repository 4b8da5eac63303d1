// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/segment.h"

namespace fcl_fibers::index {

/// The volume around a segment that is not of the index. A segment whose coordinates have
/// overflowed in the index's frame may be anywhere.
template <class Volume>
Volume volumeAround(const geometry::Segment& segment, double padding) {
  const bool is_somewhere = segment.isBox() || isBounded(segment);
  return is_somewhere ? Volume::around(segment, padding) : Volume::unbounded();
}

}  // namespace fcl_fibers::index
