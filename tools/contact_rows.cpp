// SPDX-License-Identifier: BSD-3-Clause
#include "contact_rows.h"

#include <cstddef>
#include <cstdint>
#include <iterator>

#include <fmt/format.h>

namespace fcl_fibers::tools {

using nlohmann::ordered_json;

ordered_json contactRow(const FoundContact& c, bool meshes, std::optional<double> time) {
  const bool is_mesh = c.mesh != kNoMesh;
  ordered_json row = {{"fiber_a", c.a.fiber},
                      {"segment_a", c.a.segment},
                      {"s", c.s},
                      {"fiber_b", valueIf(!is_mesh, c.b.fiber)},
                      {"segment_b", valueIf(!is_mesh, c.b.segment)},
                      {"t", valueIf(!is_mesh, c.t)}};
  if (time) row["time"] = *time;
  row["distance"] = c.distance;
  row["point_a"] = c.point_a;
  row["point_b"] = c.point_b;
  row["normal"] = c.normal;
  if (!meshes) return row;
  row["mesh"] = valueIf(is_mesh, c.mesh);
  row["triangle"] = valueIf(is_mesh, c.triangle);
  for (const double weight : c.weights) row["weights"].push_back(valueIf(is_mesh, weight));
  row["solid"] = valueIf(is_mesh, c.solid);
  return row;
}

std::string csvHead(const ordered_json& row) {
  std::string text;
  for (const auto& [name, value] : row.items()) {
    if (!value.is_array()) text += name + ",";
    for (std::size_t i = 0; value.is_array() && i < value.size(); ++i) {
      text += name == "weights" ? fmt::format("weight_{},", i) : name + "_" + "xyz"[i] + ",";
    }
  }
  text.back() = '\n';
  return text;
}

std::string csvLine(const ordered_json& row) {
  std::string text;
  const auto add = [&](const ordered_json& value) {
    if (value.is_number_float()) {
      fmt::format_to(std::back_inserter(text), "{}", value.get<double>());
    } else if (value.is_boolean()) {
      text += value.get<bool>() ? '1' : '0';
    } else if (!value.is_null()) {
      fmt::format_to(std::back_inserter(text), "{}", value.get<std::int64_t>());
    }
    text += ',';
  };
  for (const ordered_json& value : row) {
    if (!value.is_array()) add(value);
    for (std::size_t i = 0; value.is_array() && i < value.size(); ++i) add(value[i]);
  }
  text.back() = '\n';
  return text;
}

ordered_json itemOf(ordered_json row) {
  for (auto at = row.begin(); at != row.end();) {
    const bool is_null = at->is_null() || (at->is_array() && at->front().is_null());
    at = is_null ? row.erase(at) : std::next(at);
  }
  return row;
}

ordered_json radiusJson(const FiberPolylines& scene) {
  return valueIf(scene.radii.empty(), scene.radius);
}

ordered_json sceneJson(const std::string& title, const FiberPolylines& scene) {
  return {{"scene", title},
          {"fibers", scene.fiberCount()},
          {"segments", scene.segmentCount()},
          {"radius", radiusJson(scene)}};
}

std::string openJson(const ordered_json& object) {
  std::string text = object.dump(1);
  text.resize(text.size() - 2);  // "\n}"
  return text;
}

}  // namespace fcl_fibers::tools
