// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_polylines.h>
#include <nlohmann/json.hpp>

#include "found_pairs.h"

namespace fcl_fibers::tools {

inline nlohmann::ordered_json contactJson(const Contact& c) {
  return {{"fiber_a", c.a.fiber},   {"number_a", c.a.number}, {"s", c.s},
          {"fiber_b", c.b.fiber},   {"number_b", c.b.number}, {"t", c.t},
          {"distance", c.distance}, {"point_a", c.point_a},   {"point_b", c.point_b},
          {"normal", c.normal}};
}

/// With the names of contactJson() for what both have.
inline nlohmann::ordered_json meshContactJson(const FoundContact& c) {
  return {{"fiber_a", c.a.fiber}, {"number_a", c.a.number}, {"s", c.s},
          {"mesh", c.mesh},       {"triangle", c.triangle}, {"weights", c.weights},
          {"solid", c.solid},     {"distance", c.distance}, {"point_a", c.point_a},
          {"point_b", c.point_b}, {"normal", c.normal}};
}

/// Null if it differs by segment.
inline nlohmann::ordered_json radiusJson(const FiberPolylines& scene) {
  return scene.radii.empty() ? nlohmann::ordered_json(scene.radius) : nlohmann::ordered_json();
}

}  // namespace fcl_fibers::tools
