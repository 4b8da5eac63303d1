// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <string>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/io/export_geometry.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "found_pairs.h"
#include "output_file.h"

namespace fcl_fibers::tools {
namespace {

/// The number of contacts in a plain list.
constexpr std::size_t kFew = 10;

/// The request and what was found.
struct Answer {
  const SceneSource& source;
  const CheckRequest& request;
  const FiberPolylines& scene;
  const FoundPairs& found;

  /// Contacts are computed one by one, because memory may not hold all of them.
  std::size_t count() const { return found.pairs.size(); }
  Contact contact(std::size_t i) const {
    return capsuleContact(fiberArrays(scene), found.pairs[i]);
  }
};

std::string csvText(const Answer& answer) {
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text),
                 "fiber_a,segment_a,s,fiber_b,segment_b,t,distance,point_a_x,point_a_y,point_a_z,"
                 "point_b_x,point_b_y,point_b_z,normal_x,normal_y,normal_z\n");
  for (std::size_t i = 0; i < answer.count(); ++i) {
    const Contact c = answer.contact(i);
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{}", c.a.fiber, c.a.segment, c.s,
                   c.b.fiber, c.b.segment, c.t, c.distance);
    for (const std::array<double, 3>& vector : {c.point_a, c.point_b, c.normal}) {
      fmt::format_to(std::back_inserter(text), ",{},{},{}", vector[0], vector[1], vector[2]);
    }
    text.push_back('\n');
  }
  return fmt::to_string(text);
}

std::string jsonText(const Answer& answer) {
  const FiberTreeOptions& tree = answer.request.tree;
  const bool spheres = tree.volumes == FiberTreeOptions::Volumes::kWrappedSpheres;
  const bool capsules = tree.report == Report::kCapsules;
  nlohmann::ordered_json json = {{"scene", answer.source.title},
                                 {"fibers", answer.scene.fiberCount()},
                                 {"segments", answer.scene.segmentCount()},
                                 {"report", capsules  ? "capsules"
                                            : spheres ? "spheres"
                                                      : "boxes"},
                                 {"margin", tree.margin},
                                 {"ignored_neighbors", tree.ignored_neighbors},
                                 {"ignored_arc_length", tree.ignored_arc_length},
                                 {"contact_count", answer.count()},
                                 {"touching_segments", answer.found.touching_segments}};
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < answer.count(); ++i) {
    const Contact c = answer.contact(i);
    list.push_back({{"fiber_a", c.a.fiber},
                    {"segment_a", c.a.segment},
                    {"s", c.s},
                    {"fiber_b", c.b.fiber},
                    {"segment_b", c.b.segment},
                    {"t", c.t},
                    {"distance", c.distance},
                    {"point_a", c.point_a},
                    {"point_b", c.point_b},
                    {"normal", c.normal}});
  }
  json["contacts"] = std::move(list);
  return json.dump(1) + "\n";
}

std::string plainText(const Answer& answer) {
  const FiberPolylines& scene = answer.scene;
  const bool capsules = answer.request.tree.report == Report::kCapsules;
  const bool one = answer.count() == 1;
  const char* const what = capsules ? (one ? "pair touches" : "pairs touch")
                           : one    ? "pair of volumes overlaps"
                                    : "pairs of volumes overlap";
  std::string text = fmt::format("{}: {} of {}\n{} {}, of {}\n", answer.source.title,
                                 counted(scene.segmentCount(), "segment"),
                                 counted(scene.fiberCount(), "fiber"), countText(answer.count()),
                                 what, counted(answer.found.touching_segments, "segment"));
  if (answer.count() == 0) return text;
  text += fmt::format("\n{:>8} {:>8}   {:>8} {:>8}   {:>10}\n", "fiber", "segment", "fiber",
                      "segment", "distance");
  for (std::size_t i = 0; i < std::min(kFew, answer.count()); ++i) {
    const Contact c = answer.contact(i);
    text += fmt::format("{:>8} {:>8}   {:>8} {:>8}   {:>10.4g}\n", c.a.fiber, c.a.segment,
                        c.b.fiber, c.b.segment, c.distance);
  }
  if (answer.count() > kFew) {
    text +=
        fmt::format("and {} more; --csv or --json lists all\n", countText(answer.count() - kFew));
  }
  return text;
}

std::vector<Contact> allContacts(const Answer& answer) {
  std::vector<Contact> contacts;
  contacts.reserve(answer.count());
  for (std::size_t i = 0; i < answer.count(); ++i) contacts.push_back(answer.contact(i));
  return contacts;
}

}  // namespace

int check(const SceneSource& source, const CheckRequest& request) {
  progress("reading " + source.title);
  const FiberPolylines scene = source.scene();
  progress("looking for contacts");
  FiberTree tree(request.tree);
  tree.build(fiberArrays(scene));
  const FoundPairs found = findPairs(tree, scene);
  const Answer answer{source, request, scene, found};

  const auto writeFile = [](const std::string& path, auto&& write) {
    if (path.empty()) return;
    progress("writing " + path);
    OutputFile file(path);
    write(file);
    file.commit();
  };
  writeFile(request.segments_path, [&](const OutputFile& file) {
    io::exportSegments(file.draft(), scene, found.touching);
  });
  writeFile(request.contacts_path,
            [&](const OutputFile& file) { io::exportContacts(file.draft(), allContacts(answer)); });
  writeFile(request.volumes_path, [&](const OutputFile& file) {
    io::exportVolumes(file.draft(), tree.volumes(request.depth));
  });

  const std::string text = request.output == Output::kCsv    ? csvText(answer)
                           : request.output == Output::kJson ? jsonText(answer)
                                                             : plainText(answer);
  progress("");
  if (request.path.empty()) {
    print(text);
  } else {
    writeFile(request.path, [&](OutputFile& file) { file.write(text); });
    progress("");
  }
  return answer.count() == 0 ? 0 : kExitContacts;
}

}  // namespace fcl_fibers::tools
