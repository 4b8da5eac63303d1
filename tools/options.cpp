// SPDX-License-Identifier: BSD-3-Clause
#include "options.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace fcl_fibers::tools {
namespace {

// CLI11's own validators print their range, up to the largest double in 300 digits.
CLI::Validator numberFrom(bool zero_is_one) {
  const auto problem = [zero_is_one](const std::string& text) -> std::string {
    char* end = nullptr;
    const double number = std::strtod(text.c_str(), &end);
    if (*end == '\0' && end != text.c_str() && std::isfinite(number) &&
        (number > 0 || (zero_is_one && number == 0))) {
      return "";
    }
    return "'" + text + "' is not a number " + (zero_is_one ? "of 0 or more" : "above 0");
  };
  return CLI::Validator(problem, "");
}
const CLI::Validator kZeroOrMore = numberFrom(true), kAboveZero = numberFrom(false);

const CLI::Validator kName(
    [](const std::string& name) -> std::string {
      return name.empty() ? "give the name of an array, or the number of a column" : "";
    },
    "");

const CLI::Validator kVtp(
    [](const std::string& path) -> std::string {
      const bool is_vtp = std::filesystem::path(path).extension() == ".vtp";
      return is_vtp ? "" : "'" + path + "' does not end in .vtp";
    },
    "");

/// @param type  what --help calls the value
template <typename Value>
CLI::Option* add(CLI::App& command, const char* names, Value& value, const char* type,
                 const std::string& what) {
  return command.add_option(names, value, what)->type_name(type);
}

template <typename Value>
void addChoice(CLI::App& command, const char* name, Value& value, const char* type,
               const std::map<std::string, Value>& choices, const char* what) {
  add(command, name, value, type, what)
      ->transform(CLI::CheckedTransformer(choices).description(""));
}

void addRadiusOption(CLI::App& command, Arguments& arguments, const char* what, int most) {
  CLI::Option* const radius = add(command, "-r,--radius", arguments.radii, "LENGTH", what)
                                  ->expected(1, most)
                                  ->check(kZeroOrMore)
                                  ->allow_extra_args(false);
  add(command, "--radius-from", arguments.radius_from, "NAME",
      "Take the radii from the array NAME of a .vtp file, instead of\n"
      "`radius`, or from column NAME of text, the fourth or a later\none.")
      ->check(kName)
      ->excludes(radius);
}

}  // namespace

void Arguments::nameScenes() {
  std::vector<std::string> texts = scenes;
  for (const std::string& text : {other, end}) {
    if (!text.empty()) texts.push_back(text);
  }
  const auto files = static_cast<std::size_t>(std::count_if(texts.begin(), texts.end(), isFile));
  if (radii.size() > 1 && radii.size() != files) {
    throw std::invalid_argument(
        fmt::format("--radius is given {} times for {}; give it once for all files, or once for "
                    "each",
                    radii.size(), counted(files, "file")));
  }
  std::size_t file = 0;
  for (const std::string& text : texts) {
    io::FiberFileOptions options;
    // If no scene is a file, the first one refuses the radius.
    if (files == 0 || isFile(text)) {
      if (!radii.empty()) options.radius = radii.size() == 1 ? radii[0] : radii[file++];
      options.radius_from = radius_from;
    }
    request.scenes.push_back({text, options, &generated});
  }
  for (const auto& [text, scene] : {std::pair(&end, &request.end), {&other, &request.other}}) {
    if (text->empty()) continue;
    *scene = std::move(request.scenes.back());
    request.scenes.pop_back();
  }
}

std::string sceneText(const Arguments& arguments) {
  return arguments.generated.make ? "A file, `-`, or a generated scene." : "A file, or `-`.";
}

void addScene(CLI::App& command, const char* name, const std::string& what, Arguments& arguments) {
  const auto take = [&](const std::string& text) { arguments.scenes = {text}; };
  command.add_option_function<std::string>(name, take, what)->required()->type_name("");
}

void addScenes(CLI::App& command, const std::string& what, Arguments& arguments) {
  add(command, "SCENES", arguments.scenes, "", what)->required();
}

void addFile(CLI::App& command, const char* name, const char* type, Arguments& arguments) {
  add(command, name, arguments.request.path, type,
      "The file to write. It ends in .vtp (ParaView), .hair or .txt.")
      ->required();
}

void addRadius(CLI::App& command, Arguments& arguments) {
  addRadiusOption(
      command, arguments,
      "The radius of all fibers, in the file's unit. It replaces\nthe radii in the file.", 1);
}

void addRadii(CLI::App& command, Arguments& arguments) {
  addRadiusOption(command, arguments,
                  "The radius of all files, in their unit. It replaces the\n"
                  "radii in a file. Repeat it for a radius of each file.",
                  CLI::detail::expected_max_vector_size);
}

void addNeighbors(CLI::App& command, FiberTreeOptions& tree) {
  add(command, "-n,--ignored-neighbors", tree.ignored_neighbors, "N",
      "Leave out pairs of one fiber that are at most N segments\n"
      "apart. The default is 1, which leaves out adjacent segments.")
      ->check(kZeroOrMore);
  add(command, "-a,--ignored-arc-length", tree.ignored_arc_length, "LENGTH",
      "Leave out pairs of one fiber with at most LENGTH of it\n"
      "between them. The default is 0.")
      ->check(kZeroOrMore);
}

void addSearch(CLI::App& command, Request& request) {
  addNeighbors(command, request.tree);
  add(command, "-m,--margin", request.tree.margin, "LENGTH",
      "Report pairs up to LENGTH apart, too. The default is 0.")
      ->check(kZeroOrMore);
  addChoice<Topology>(command, "--topology", request.tree.topology, "bundle|super-thread",
                      {{"bundle", Topology::kBundle}, {"super-thread", Topology::kSuperThread}},
                      "The shape of the tree: `bundle`, which is the default, or\n"
                      "`super-thread`, which is the paper's.");
  add(command, "--threads", request.tree.threads, "N", "Use N threads. The default is 1.")
      ->check(kAboveZero);
  add(command, "--limit", request.limit, "N",
      "End the search of a frame after N pairs, or with --end\n"
      "keep the first N, and warn. The default is 10,000,000.")
      ->check(kAboveZero);
}

CLI::Option* addMeshes(CLI::App& command, MeshOptions& meshes) {
  CLI::Option* const mesh = add(command, "--mesh", meshes.paths, "FILE",
                                "Triangles that fibers may touch, as a Wavefront OBJ file, in\n"
                                "the frame and unit of the fibers. Repeat it for more.")
                                ->allow_extra_args(false);
  add(command, "--root-length", meshes.root_length, "LENGTH",
      "Segments that begin at less than LENGTH along their fiber\n"
      "meet no mesh, because they are in the scalp.")
      ->check(kZeroOrMore)
      ->needs(mesh);
  add(command, "--root-segments", meshes.root_segments, "N",
      "The first N segments of each fiber meet no mesh.")
      ->check(kZeroOrMore)
      ->needs(mesh);
  command
      .add_flag("--solid", meshes.solid,
                "The inside of meshes counts, too. They have to be watertight.")
      ->needs(mesh);
  return mesh;
}

void addEnd(CLI::App& command, Arguments& arguments, const char* what) {
  add(command, "--end", arguments.end, "SCENE", what);
}

void addReport(CLI::App& command, FiberTreeOptions& tree) {
  using Volumes = FiberTreeOptions::Volumes;
  addChoice<Report>(
      command, "--report", tree.report, "capsules|volumes",
      {{"capsules", Report::kCapsules}, {"volumes", Report::kVolumes}},
      "Look for capsules that touch, or for volumes that overlap.\nThe default is capsules.");
  addChoice<Volumes>(command, "--volumes", tree.volumes, "boxes|spheres",
                     {{"boxes", Volumes::kLayeredBoxes}, {"spheres", Volumes::kWrappedSpheres}},
                     "The volumes of the tree. The default is boxes.");
}

void addList(CLI::App& command, Request& request) {
  addChoice<Request::Order>(
      command, "--sort", request.order, "depth|fiber",
      {{"depth", Request::Order::kDepth}, {"fiber", Request::Order::kFiber}},
      "List the deepest first, with --end the first in time, which is\nthe default, or in the "
      "order of the fibers.");
  add(command, "--top", request.top, "N",
      "List the first N only. The default for text is 10. CSV and\nJSON list all.")
      ->check(kAboveZero);
  command.add_flag(
      "--summary", request.summary,
      "List pairs of fibers, or of a fiber and a mesh, with their\nnumbers of contacts "
      "and least distances.");
  CLI::Option* const json = addJson(command, request);
  command
      .add_flag_callback(
          "--csv", [&request] { request.output = Output::kCsv; }, "Print comma-separated values.")
      ->excludes(json);
  add(command, "-o,--output", request.path, "FILE", "Write to FILE instead of stdout.");
  command.add_flag("--exit-zero", request.exit_zero, "Return 0 if there are contacts, too.");
}

void addPictures(CLI::App& command, Request& request) {
  constexpr const char* kGroup = "Pictures, .vtp";
  const auto picture = [&](const char* name, std::string& path, const char* what) {
    add(command, name, path, "FILE", what)->check(kVtp)->group(kGroup);
  };
  picture("--write-segments", request.segments_path,
          "Write the segments, with `fiber`, `segment` and `touching`.");
  picture("--write-contacts", request.contacts_path,
          "Write a point between the two segments of each pair.");
  picture("--write-volumes", request.volumes_path, "Write the volumes of one level of the tree.");
  add(command, "--depth", request.depth, "N",
      "The depth of that level. The root has depth 0. The default\nis 2.")
      ->check(kZeroOrMore)
      ->group(kGroup);
}

void addDrawing(CLI::App& command, Request& request) {
  add(command, "--depth", request.depth, "N", "The depth of the deepest volumes. The default is 2.")
      ->check(CLI::Range(0, 8).description(""));
  add(command, "--points", request.points, "N",
      "The most points to draw, of all frames. The default is 1,000,000.")
      ->check(CLI::Range(std::size_t{1000}, std::size_t{100000000}).description(""));
  add(command, "--up", request.up, "x|y|z",
      "The axis that points up. Without it the program guesses.")
      ->check(CLI::IsMember({"x", "y", "z"}).description(""));
  command.add_flag("--fragment", request.fragment,
                   "Write a fragment without a head, to put into another page.");
}

CLI::Option* addJson(CLI::App& command, Request& request) {
  return command.add_flag_callback(
      "--json", [&request] { request.output = Output::kJson; }, "Print JSON, for programs.");
}

}  // namespace fcl_fibers::tools
