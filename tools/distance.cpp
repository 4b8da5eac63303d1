// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include <fcl_fibers/contact.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "contact_json.h"
#include "nearest.h"
#include "seconds.h"

namespace fcl_fibers::tools {
namespace {

std::string sizeText(const SceneSource& source, const FiberPolylines& scene) {
  return fmt::format("{}: {} of {}\n", source.title, counted(scene.segmentCount(), "segment"),
                     counted(scene.fiberCount(), "fiber"));
}

std::string placeText(const FiberSegment& place, double along, const std::array<double, 3>& point) {
  return fmt::format("{:>8} {:>8} {:>7.4f} {:>12.6g} {:>12.6g} {:>12.6g}\n", place.fiber,
                     place.number, along, point[0], point[1], point[2]);
}

}  // namespace

int distance(const Request& request) {
  const SceneSource source = request.scenes.front().open();
  const FiberPolylines scene = source.scene();
  std::optional<SceneSource> other_source;
  std::optional<FiberPolylines> other;
  if (request.other) {
    other_source = request.other->open();
    other = other_source->scene();
  }
  progress("looking for the least distance");
  std::optional<Contact> nearest;
  const double seconds = tools::seconds(
      [&] { nearest = findNearest(scene, other ? &*other : nullptr, request.tree); });
  progress("");

  if (request.output == Output::kJson) {
    nlohmann::ordered_json json = {{"version", FCL_FIBERS_VERSION},
                                   {"scene", source.title},
                                   {"fibers", scene.fiberCount()},
                                   {"segments", scene.segmentCount()},
                                   {"radius", radiusJson(scene)}};
    if (other) json["against"] = {{"scene", other_source->title}, {"radius", radiusJson(*other)}};
    json["ignored_neighbors"] = request.tree.ignored_neighbors;
    json["ignored_arc_length"] = request.tree.ignored_arc_length;
    json["seconds"] = seconds;
    json["nearest"] =
        nearest ? contactJson(*nearest, scene, other ? *other : scene) : nlohmann::ordered_json();
    print(json.dump(2) + "\n");
    return 0;
  }

  std::string text = sizeText(source, scene);
  if (other) text += "against " + sizeText(*other_source, *other);
  if (!nearest) {
    print(text + "there are no two segments between which a distance counts\n");
    return 0;
  }
  text += nearest->distance > 0
              ? fmt::format("the least distance is {:.6g}\n", nearest->distance)
              : fmt::format("fibers touch; the deepest overlap is {:.6g}\n", 0 - nearest->distance);
  text += fmt::format("found in {:.3g} s\n\n{:>8} {:>8} {:>7} {:>12} {:>12} {:>12}\n", seconds,
                      "fiber", "number", "s", "x", "y", "z");
  text += placeText(nearest->a, nearest->s, nearest->point_a);
  text += placeText(nearest->b, nearest->t, nearest->point_b);
  print(text);
  return 0;
}

}  // namespace fcl_fibers::tools
