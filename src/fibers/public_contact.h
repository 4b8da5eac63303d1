// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/contact.h>

#include "geometry/contact.h"

namespace fcl_fibers::fibers {

/// Converts a contact between the segments `a` and `b` to its public type.
inline Contact publicContact(const geometry::CapsuleContact& contact, FiberSegment a = {},
                             FiberSegment b = {}) {
  const auto toArray = [](const geometry::Vec3d& v) { return std::array{v.x, v.y, v.z}; };
  return {a,
          b,
          contact.s,
          contact.t,
          contact.distance,
          toArray(contact.point_a),
          toArray(contact.point_b),
          toArray(contact.normal)};
}

}  // namespace fcl_fibers::fibers
