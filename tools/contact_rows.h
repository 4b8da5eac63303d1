// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <utility>

#include <fcl_fibers/fiber_polylines.h>
#include <nlohmann/json.hpp>

#include "answer_stream.h"
#include "found_pairs.h"

namespace fcl_fibers::tools {

// A row of a list is an object. What it has not is null, which CSV leaves blank and JSON leaves
// out.

/// The value, or null.
template <typename Value>
nlohmann::ordered_json valueIf(bool is_there, const Value& value) {
  return is_there ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

/// @param meshes  whether rows of the list may have meshes
/// @param time    of an impact
nlohmann::ordered_json contactRow(const FoundContact& contact, bool meshes,
                                  std::optional<double> time = {});

/// The names of a row, or its values. Vectors have a column for each part.
std::string csvHead(const nlohmann::ordered_json& row);
std::string csvLine(const nlohmann::ordered_json& row);

/// What the row has.
nlohmann::ordered_json itemOf(nlohmann::ordered_json row);

/// Null if it differs by segment.
nlohmann::ordered_json radiusJson(const FiberPolylines& scene);

/// Title, numbers of fibers and segments, and radius.
nlohmann::ordered_json sceneJson(const std::string& title, const FiberPolylines& scene);

/// An object without its closing brace.
std::string openJson(const nlohmann::ordered_json& object);

/// Writes `head` as an object that ends with the list of row(item) of all items.
template <typename Items, typename Row>
void writeJson(const nlohmann::ordered_json& head, const std::string& list, const Items& items,
               Row&& row, AnswerStream& stream) {
  stream.write(openJson(head) + ",\n \"" + list + "\": [");
  const char* between = "\n  ";
  for (const auto& item : items) {
    stream.write(std::exchange(between, ",\n  ") + itemOf(row(item)).dump());
  }
  stream.write("\n ]\n}");
}

}  // namespace fcl_fibers::tools
