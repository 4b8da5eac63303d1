// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_polylines.h>
#include <nlohmann/json.hpp>

#include "found_pairs.h"

namespace fcl_fibers::tools {

/// Of an .swc file.
struct Sample {
  std::int64_t number, type;
};

/// The sample at the second end of a segment, whose parent is at the first one; so it tells which
/// segment of the file it is. None if the scene has no samples.
inline std::optional<Sample> sampleOf(const FiberPolylines& scene, std::int32_t segment) {
  if (scene.samples.empty() || scene.types.empty()) return std::nullopt;
  const auto end = static_cast<std::size_t>(segment) + 1;
  return Sample{scene.samples[end], scene.types[end]};
}

inline void addSample(nlohmann::ordered_json& json, const char* side, const FiberPolylines& scene,
                      std::int32_t segment) {
  const auto sample = sampleOf(scene, segment);
  if (!sample) return;
  json[std::string("sample_") + side] = sample->number;
  json[std::string("type_") + side] = sample->type;
}

/// @param other  the scene of the second segment
inline nlohmann::ordered_json contactJson(const Contact& c, const FiberPolylines& scene,
                                          const FiberPolylines& other) {
  nlohmann::ordered_json json = {
      {"fiber_a", c.a.fiber},   {"number_a", c.a.number}, {"s", c.s},
      {"fiber_b", c.b.fiber},   {"number_b", c.b.number}, {"t", c.t},
      {"distance", c.distance}, {"point_a", c.point_a},   {"point_b", c.point_b},
      {"normal", c.normal}};
  addSample(json, "a", scene, c.pair.a);
  addSample(json, "b", other, c.pair.b);
  return json;
}

/// With the names of contactJson() for what both have.
inline nlohmann::ordered_json meshContactJson(const FoundContact& c, const FiberPolylines& scene) {
  nlohmann::ordered_json json = {
      {"fiber_a", c.a.fiber}, {"number_a", c.a.number}, {"s", c.s},
      {"mesh", c.mesh},       {"triangle", c.triangle}, {"weights", c.weights},
      {"solid", c.solid},     {"distance", c.distance}, {"point_a", c.point_a},
      {"point_b", c.point_b}, {"normal", c.normal}};
  addSample(json, "a", scene, c.pair.a);
  return json;
}

/// Null if it differs by segment.
inline nlohmann::ordered_json radiusJson(const FiberPolylines& scene) {
  return scene.radii.empty() ? nlohmann::ordered_json(scene.radius) : nlohmann::ordered_json();
}

}  // namespace fcl_fibers::tools
