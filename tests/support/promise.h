// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/fiber_manager_options.h>

#include "support/exact_geometry.h"
#include "support/touch_oracle.h"

namespace fcl_fibers::test {

/// What bounds one object in the manager or tree under test.
enum class LeafVolume {
  kBox,     ///< the capsule's tight box
  kSphere,  ///< the segment's sphere
  kStock,   ///< getAABB(), as FCL's managers use it
};

/// How far apart volumes may be that Report::kVolumes takes for overlapping, as bounds are floats
/// of the scene's size.
/// @param extent  diagonal of the box around all capsules of the scene
Real volumeBand(Real extent);

/// Whether docs/numerics.md allows the report to hold a pair, which need not touch: for float and
/// double alike, as capsules count as they are given.
/// @pre volume is no LeafVolume::kStock
bool isPromised(const GivenCapsule& p, const GivenCapsule& q, Report report, LeafVolume volume,
                double margin, Real extent);

}  // namespace fcl_fibers::test
