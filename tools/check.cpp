// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include <fcl_fibers/scenes/export_geometry.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "contacts.h"
#include "output_file.h"

namespace fcl_fibers::tools {
namespace {

using scenes::Contact;

/// Contacts that are listed where not all are asked for.
constexpr std::size_t kFew = 10;

std::string csvText(const std::vector<Contact>& contacts) {
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text), "fiber_a,segment_a,fiber_b,segment_b,distance,x,y,z\n");
  for (const Contact& c : contacts) {
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{}\n", c.a.fiber, c.a.segment,
                   c.b.fiber, c.b.segment, c.distance, (c.on_a[0] + c.on_b[0]) / 2,
                   (c.on_a[1] + c.on_b[1]) / 2, (c.on_a[2] + c.on_b[2]) / 2);
  }
  return fmt::to_string(text);
}

std::string jsonText(const SceneSource& source, const CheckRequest& request,
                     const scenes::FiberScene& scene, const Contacts& found,
                     const std::vector<Contact>& contacts) {
  const bool spheres = request.tree.volumes == FiberTreeOptions::Volumes::kWrappedSpheres;
  const bool capsules = request.tree.report == Report::kCapsules;
  nlohmann::ordered_json json = {{"scene", source.title},
                                 {"fibers", scene.fiberCount()},
                                 {"segments", scene.segmentCount()},
                                 {"report", capsules  ? "capsules"
                                            : spheres ? "spheres"
                                                      : "boxes"},
                                 {"margin", request.tree.margin},
                                 {"ignored_neighbors", request.tree.ignored_neighbors},
                                 {"contact_count", contacts.size()},
                                 {"touching_segments", found.touching_segments}};
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Contact& c : contacts) {
    list.push_back({{"a", {{"fiber", c.a.fiber}, {"segment", c.a.segment}}},
                    {"b", {{"fiber", c.b.fiber}, {"segment", c.b.segment}}},
                    {"distance", c.distance},
                    {"on_a", c.on_a},
                    {"on_b", c.on_b}});
  }
  json["contacts"] = std::move(list);
  return json.dump(1) + "\n";
}

std::string plainText(const SceneSource& source, const CheckRequest& request,
                      const scenes::FiberScene& scene, const Contacts& found,
                      const std::vector<Contact>& contacts) {
  const bool capsules = request.tree.report == Report::kCapsules;
  const bool one = contacts.size() == 1;
  const char* const what = capsules ? (one ? "pair touches" : "pairs touch")
                           : one    ? "pair of volumes overlaps"
                                    : "pairs of volumes overlap";
  std::string text =
      fmt::format("{}: {} segments of {} fibers\n{} {}, of {} segments\n", source.title,
                  countText(scene.segmentCount()), countText(scene.fiberCount()),
                  countText(contacts.size()), what, countText(found.touching_segments));
  if (contacts.empty()) return text;
  text += fmt::format("\n{:>8} {:>8}   {:>8} {:>8}   {:>10}\n", "fiber", "segment", "fiber",
                      "segment", "distance");
  for (std::size_t i = 0; i < std::min(kFew, contacts.size()); ++i) {
    const Contact& c = contacts[i];
    text += fmt::format("{:>8} {:>8}   {:>8} {:>8}   {:>10.4g}\n", c.a.fiber, c.a.segment,
                        c.b.fiber, c.b.segment, c.distance);
  }
  if (contacts.size() > kFew) {
    text +=
        fmt::format("and {} more; --csv or --json lists all\n", countText(contacts.size() - kFew));
  }
  return text;
}

}  // namespace

int check(const SceneSource& source, const CheckRequest& request) {
  progress("reading " + source.title);
  const scenes::FiberScene scene = source.scene();
  progress("looking for contacts");
  FiberTree tree(request.tree);
  tree.build(fiberArrays(scene));
  const Contacts found = findContacts(tree, scene);
  std::vector<Contact> contacts;
  contacts.reserve(found.pairs.size());
  for (const auto& [a, b] : found.pairs) contacts.push_back(makeContact(scene, a, b));

  const auto writeFile = [](const std::string& path, auto&& write) {
    if (path.empty()) return;
    progress("writing " + path);
    OutputFile file(path);
    write(file);
    file.commit();
  };
  writeFile(request.segments_path,
            [&](const OutputFile& file) { exportSegments(file.draft(), scene, found.touching); });
  writeFile(request.contacts_path,
            [&](const OutputFile& file) { exportContacts(file.draft(), contacts); });
  writeFile(request.volumes_path, [&](const OutputFile& file) {
    scenes::exportVolumes(file.draft(), tree.volumes(request.depth));
  });

  const std::string text = request.output == Output::kCsv ? csvText(contacts)
                           : request.output == Output::kJson
                               ? jsonText(source, request, scene, found, contacts)
                               : plainText(source, request, scene, found, contacts);
  progress("");
  if (request.path.empty()) {
    print(text);
  } else {
    writeFile(request.path, [&](OutputFile& file) { file.write(text); });
    progress("");
  }
  return contacts.empty() ? 0 : kExitContacts;
}

}  // namespace fcl_fibers::tools
