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

/// A number of 0 or more.
template <typename Value>
CLI::Option* addNumber(CLI::App& command, const char* names, Value& value, const char* type,
                       const std::string& what) {
  return add(command, names, value, type, what)->check(kZeroOrMore);
}

template <typename Value>
void addChoice(CLI::App& command, const char* name, Value& value, const char* type,
               const std::map<std::string, Value>& choices, const char* what) {
  add(command, name, value, type, what)
      ->transform(CLI::CheckedTransformer(choices).description(""));
}

std::string sceneText(const Arguments& arguments) {
  return arguments.generated.make ? "A file, `-`, or a generated scene." : "A file, or `-`.";
}

void addScene(CLI::App& command, const char* name, const std::string& what, Arguments& arguments) {
  const auto take = [&](const std::string& text) { arguments.scenes = {text}; };
  command.add_option_function<std::string>(name, take, what)->required()->type_name("");
}

void addFile(CLI::App& command, const char* name, const char* type, Arguments& arguments) {
  add(command, name, arguments.request.path, type,
      "The file to write. It ends in .vtp (ParaView), .hair or .txt.")
      ->required();
}

/// @param several  files, each of which may have a radius
void addRadius(CLI::App& command, Arguments& arguments, bool several) {
  CLI::Option* const radius =
      add(command, "-r,--radius", arguments.radii, "LENGTH",
          several ? "The radius of all files, in their unit. It replaces the\n"
                    "radii in a file. Repeat it for a radius of each file."
                  : "The radius of all fibers, in the file's unit. It replaces\n"
                    "the radii in the file.")
          ->expected(1, several ? CLI::detail::expected_max_vector_size : 1)
          ->check(kZeroOrMore)
          ->allow_extra_args(false);
  add(command, "--radius-from", arguments.radius_from, "NAME",
      "Take the radii from the array NAME of a .vtp file, instead of\n"
      "`radius`, or from column NAME of text, the fourth or a later\none.")
      ->check(kName)
      ->excludes(radius);
}

/// @param excluded  options that go without groups
/// @return the option `--groups`
CLI::Option* addGroups(CLI::App& command, Arguments& arguments,
                       const std::vector<CLI::Option*>& excluded) {
  Request& request = arguments.request;
  CLI::Option* const files =
      command.add_flag("--groups", request.groups,
                       "Take several scenes as groups of one. Pairs within a group do\nnot count.");
  CLI::Option* const numbers =
      add(command, "--groups-from", arguments.groups_from, "NAME",
          "Take fibers with the same number as a group: that of the\narray NAME of a .vtp file, of "
          "column NAME of text, or `type`\nof an .swc file. Of points, the last one of a fiber "
          "counts.")
          ->check(kName)
          ->excludes(files);
  command.add_flag("--within", request.within, "Pairs within a group count, too.");
  for (CLI::Option* const option : excluded) {
    files->excludes(option);
    numbers->excludes(option);
  }
  return files;
}

/// Which pairs of one fiber are left out.
void addNeighbors(CLI::App& command, FiberTreeOptions& tree) {
  addNumber(command, "-n,--ignored-neighbors", tree.ignored_neighbors, "N",
            "Leave out pairs of one fiber that are at most N segments\n"
            "apart. The default is 1, which leaves out adjacent segments.");
  addNumber(command, "-a,--ignored-arc-length", tree.ignored_arc_length, "LENGTH",
            "Leave out pairs of one fiber with at most LENGTH of it\n"
            "between them. The default is 0.");
}

/// Neighbors, margin, topology and threads of a tree, and the limit of a search.
void addSearch(CLI::App& command, Request& request) {
  addNeighbors(command, request.tree);
  addNumber(command, "-m,--margin", request.tree.margin, "LENGTH",
            "Report pairs up to LENGTH apart, too. The default is 0.");
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

/// `--mesh`, which may be repeated, and what belongs to it. Returns the option `--mesh`.
CLI::Option* addMeshes(CLI::App& command, MeshOptions& meshes) {
  CLI::Option* const mesh = add(command, "--mesh", meshes.paths, "FILE",
                                "Triangles that fibers may touch, as a Wavefront OBJ file, in\n"
                                "the frame and unit of the fibers. Repeat it for more.")
                                ->allow_extra_args(false);
  addNumber(command, "--root-length", meshes.root_length, "LENGTH",
            "Segments that begin at less than LENGTH along their fiber\n"
            "meet no mesh, because they are in the scalp.")
      ->needs(mesh);
  addNumber(command, "--root-segments", meshes.root_segments, "N",
            "The first N segments of each fiber meet no mesh.")
      ->needs(mesh);
  command
      .add_flag("--solid", meshes.solid,
                "The inside of meshes counts, too. They have to be watertight.")
      ->needs(mesh);
  return mesh;
}

CLI::Option* addJson(CLI::App& command, Request& request) {
  return command.add_flag_callback(
      "--json", [&request] { request.output = Output::kJson; }, "Print JSON, for programs.");
}

/// Of a program that generates scenes.
void addLoads(CLI::App& command, Arguments& arguments) {
  if (!arguments.generated.make) return;
  add(command, "--loads", arguments.loads, "FILE",
      "Bend `paper-dynamic` by the recorded loads of FILE, one state\nper frame. A page of `view` "
      "records them.");
}

void addGenerate(CLI::App& command, Arguments& arguments) {
  addScene(command, "SCENE", sceneText(arguments), arguments);
  addFile(command, "-o,--output", "FILE", arguments);
  addLoads(command, arguments);
}

void addConvert(CLI::App& command, Arguments& arguments) {
  addScene(command, "IN", "The file to read, or `-`.", arguments);
  addFile(command, "OUT", "", arguments);
  addRadius(command, arguments, false);
  command.footer(
      "No radius is needed. Radii of points are kept, except in .txt, which has no place for them. "
      ".vtp\nkeeps branches, and samples of neurons, too. What else a file holds is not kept, and "
      "is "
      "warned of.");
}

void addInfo(CLI::App& command, Arguments& arguments) {
  addScene(command, "SCENE", sceneText(arguments), arguments);
  addRadius(command, arguments, false);
  addJson(command, arguments.request);
}

void addCheck(CLI::App& command, Arguments& arguments) {
  Request& request = arguments.request;
  add(command, "SCENES", arguments.scenes, "",
      sceneText(arguments) + " Several are frames of one\nscene.")
      ->required();
  CLI::Option* const against =
      add(command, "--against", arguments.other, "SCENE",
          "Look for pairs of each scene with SCENE, instead of pairs\nwithin it.");
  CLI::Option* const end =
      add(command, "--end", arguments.end, "SCENE",
          "List pairs that touch while the fibers move from SCENES to\nSCENE in a straight "
          "line, and when. Both have the same fibers.");
  addGroups(command, arguments, {against, end});
  CLI::Option* const mesh = addMeshes(command, request.meshes);
  command.add_flag("--meshes-only", request.meshes_only, "Leave out pairs of two fibers.")
      ->needs(mesh)
      ->excludes(against);
  addRadius(command, arguments, true);
  addLoads(command, arguments);
  addSearch(command, request);
  using Volumes = FiberTreeOptions::Volumes;
  addChoice<Report>(
      command, "--report", request.tree.report, "capsules|volumes",
      {{"capsules", Report::kCapsules}, {"volumes", Report::kVolumes}},
      "Look for capsules that touch, or for volumes that overlap.\nThe default is capsules.");
  addChoice<Volumes>(command, "--volumes", request.tree.volumes, "boxes|spheres",
                     {{"boxes", Volumes::kLayeredBoxes}, {"spheres", Volumes::kWrappedSpheres}},
                     "The volumes of the tree. The default is boxes.");
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
      "and the deepest of them.");
  CLI::Option* const json = addJson(command, request);
  command
      .add_flag_callback(
          "--csv", [&request] { request.output = Output::kCsv; }, "Print comma-separated values.")
      ->excludes(json);
  add(command, "-o,--output", request.path, "FILE", "Write to FILE instead of stdout.");
  command.add_flag("--exit-zero", request.exit_zero, "Return 0 if there are contacts, too.");
  constexpr const char* kGroup = "Pictures, .vtp";
  const auto picture = [&](const char* name, std::string& path, const char* what) {
    add(command, name, path, "FILE", what)->check(kVtp)->group(kGroup);
  };
  picture("--write-segments", request.segments_path,
          "Write the segments, with `fiber`, `number` and `touching`.");
  picture("--write-contacts", request.contacts_path,
          "Write a point between the two segments of each pair.");
  picture("--write-volumes", request.volumes_path, "Write the volumes of one level of the tree.");
  addNumber(command, "--depth", request.depth, "N",
            "The depth of that level. The root has depth 0. The default\nis 2.")
      ->group(kGroup);
  command.footer(
      "The exit code is 0 without contacts, 1 with contacts, and 2 after an error.\n"
      "CSV has a line for each contact, or with --summary for each two fibers or fiber and mesh,\n"
      "with the number of their `contacts`. Several frames have a column `frame`. JSON has the "
      "same\nnames, with points, normals and weights as lists, and `solid` as true or false:\n"
      "  fiber_a, number_a, s    A segment by fiber and number along it, both counted from 0, and "
      "the\n"
      "                          place along it, from 0 to 1.\n"
      "  fiber_b, number_b, t    The other segment.\n"
      "  distance                From surface to surface. It is negative if they overlap.\n"
      "  point_a_x, ...          The point on the surface of a that is nearest to b, or deepest in "
      "it.\n"
      "  point_b_x, ...          The point on the surface of b that is nearest to a, or deepest in "
      "it.\n"
      "  normal_x, ...           The direction from a to b, of length one.\n"
      "With --mesh there are also contacts of a segment and a mesh, without fiber_b, number_b and "
      "t:\n"
      "  mesh, triangle          A mesh, and the triangle into which the segment is deepest.\n"
      "  weight_0, ...           The place in the triangle: the weights of its three points.\n"
      "  solid                   1 if the segment is in a solid mesh, else 0.\n"
      "With groups there are the numbers of both, and of a file that tells samples:\n"
      "  group_a, group_b        A file, counted from 0, or the number that --groups-from names.\n"
      "  sample_a, type_a, ...   The sample at the second point of segment a, and its type.\n"
      "With --end there is the time at which a pair first touches, and the contact is that of "
      "then:\n"
      "  time                    From 0, the start, where some may touch already, to 1, the end.");
}

void addDistance(CLI::App& command, Arguments& arguments) {
  addScene(command, "SCENE", sceneText(arguments), arguments);
  add(command, "OTHER", arguments.other, "",
      "Another scene. The distance is then from SCENE to OTHER.");
  addRadius(command, arguments, true);
  addNeighbors(command, arguments.request.tree);
  addJson(command, arguments.request);
  command.footer(
      "The distance is from surface to surface. It is negative if fibers overlap, and then it is "
      "the\ndeepest overlap; `check` lists all. Two segments of one fiber, or of fibers that "
      "branch\nfrom each other, count only if these turn back to themselves: the part between the "
      "two has\nto be longer than half a circle whose diameter is the distance of their axes.");
}

void addReplay(CLI::App& command, Arguments& arguments) {
  add(command, "FILE", arguments.request.path, "", "The file that the ShadowManager has written.")
      ->required();
  command.footer(
      "Asks FCL's manager and ours again, up to the first call in which they differ, and explains "
      "the\ndifference. The exit code is 1 if they differ.");
}

/// A number with one of some units, up to the largest.
void addUnits(CLI::App& command, const char* name, const char* type,
              const std::vector<std::pair<std::string, double>>& units, double largest,
              const char* example, const std::function<void(double)>& take, const char* what) {
  command
      .add_option_function<std::string>(
          name,
          [=](const std::string& text) {
            char* end = nullptr;
            const double number = std::strtod(text.c_str(), &end);
            std::string unit = end;
            unit.erase(0, unit.find_first_not_of(' ') == std::string::npos
                              ? unit.size()
                              : unit.find_first_not_of(' '));
            for (const auto& [word, factor] : units) {
              if (end != text.c_str() && unit == word && number >= 0 &&
                  number * factor <= largest) {
                return take(number * factor);
              }
            }
            throw CLI::ValidationError(name,
                                       "'" + text + "' is no " + type + " such as " + example);
          },
          what)
      ->type_name(type);
}

void addTrade(CLI::App& command, Arguments& arguments) {
  Request& request = arguments.request;
  addScene(command, "SCENE", sceneText(arguments), arguments);
  addRadius(command, arguments, true);
  add(command, "--end", arguments.end, "SCENE",
      "Trade what finds the pairs that touch while the fibers move\nfrom SCENE to this one in a "
      "straight line.");
  add(command, "--mesh", request.meshes.paths, "FILE",
      "Trade what finds the segments that touch the triangles of a\nWavefront OBJ file, in the "
      "frame and unit of the fibers.\nRepeat it for more.")
      ->allow_extra_args(false);
  addLoads(command, arguments);
  using Units = std::vector<std::pair<std::string, double>>;
  const Units shares = {{"%", 0.01}, {"", 1}};
  Request::Trade& trade = request.trade;
  addUnits(
      command, "--miss", "SHARE", shares, 1, "0.1%", [&](double x) { trade.wish.missed = x; },
      "The share of contacts that may be missed, such as `0.1%`.\nThe default is 0.");
  addUnits(
      command, "--false", "SHARE", shares, 1, "5%", [&](double x) { trade.wish.wrong = x; },
      "The share of pairs that may be false. The default is 0.");
  const Units times = {{"us", 1e-6}, {"ms", 1e-3}, {"s", 1}};
  addUnits(
      command, "--budget", "TIME", times, 1e9, "5ms", [&](double x) { trade.wish.seconds = x; },
      "The time that a frame may take, such as `5ms`.");
  addUnits(
      command, "--longest", "TIME", times, 1e9, "5s", [&](double x) { trade.longest = x; },
      "End a setting whose frame takes longer. The default is 5s.");
  add(command, "--picture", trade.picture, "FILE.svg", "Draw the front.");
  command.add_flag("--again", trade.again,
                   "Measure all again, also what a run that was stopped has\nmeasured.");
  addJson(command, request);
  add(command, "-o,--output", request.path, "FILE", "Write to FILE instead of stdout.");
  command.footer(
      "Turns each option of a FiberTree from its default" +
      std::string(arguments.generated.make ? ", and asks FCL's managers" : "") +
      ".\n"
      "Every answer is compared with the distances of all pairs, or of a random sample if there\n"
      "are too many. A contact is a pair that touches, or with --mesh a segment that does. Pairs\n"
      "that are near along one fiber, or across a branch, are no contacts. A false pair is\n"
      "reported and is no contact. The program then prints the lines that set the fastest way\n"
      "that --miss, --false and --budget allow. If only a sample was judged, --miss and --false\n"
      "count with bounds of 97.5 % confidence. A setting ends if a frame takes longer than\n"
      "--longest or finds more than 10,000,000 pairs. The next run of the same scene goes on with\n"
      "a run that was stopped.");
}

void addView(CLI::App& command, Arguments& arguments) {
  Request& request = arguments.request;
  add(command, "SCENES", arguments.scenes, "",
      "The scenes that the page shows, one at a time if there are\nseveral.")
      ->required();
  addRadius(command, arguments, true);
  command.add_option("-o,--output", request.path, "Write the page to FILE, which ends in .html.")
      ->required()
      ->type_name("FILE");
  CLI::Option* const end =
      add(command, "--end", arguments.end, "SCENE",
          "Play a step from the one scene to SCENE, which has the same\nfibers, and mark pairs "
          "when they first touch.");
  CLI::Option* const groups = addGroups(command, arguments, {end});
  command.add_flag("--frames", request.frames, "Play several scenes as frames of one.")
      ->excludes(groups, end);
  addMeshes(command, request.meshes);
  addLoads(command, arguments);
  addSearch(command, request);
  add(command, "--depth", request.depth, "N", "The depth of the deepest volumes. The default is 2.")
      ->check(CLI::Range(0, 8).description(""));
  add(command, "--points", request.points, "N",
      "The most points to draw of a scene, in all its frames together.\nThe default is 1,000,000.")
      ->check(CLI::Range(std::size_t{1000}, std::size_t{100000000}).description(""));
  add(command, "--up", request.up, "x|y|z",
      "The axis that points up. Without it the program guesses.")
      ->check(CLI::IsMember({"x", "y", "z"}).description(""));
  if (arguments.generated.make) {
    command.add_flag("--record", request.record,
                     "Let the mouse bend the guide filament of `paper-dynamic` in the\npage, which "
                     "saves its loads as a file for --loads.");
  }
  command.add_flag("--fragment", request.fragment,
                   "Write a fragment without a head, to put into another page.");
  const bool generated = static_cast<bool>(arguments.generated.make);
  command.footer(
      std::string(
          generated ? "Generated scenes have a radius of their own, or the key `radius`.\n"
                      "Scenes with frames are played: `paper-dynamic`, or `helix:frames=0:100:5`.\n"
                    : "") +
      "If a scene has more points than --points, every nth fiber and point is drawn.\n"
      "Contacts are searched among all points. A page marks the deepest 100,000 of a frame, or of\n"
      "more than five frames an equal share of 500,000 each. With --end it marks those that begin\n"
      "first.\n"
      "Without --up, " +
      (generated ? "z points up in generated scenes and y in TressFX files; for others it is\n"
                 : "y points up in TressFX files; for others it is\n") +
      "guessed from how the fibers run.");
}

}  // namespace

void Arguments::nameScenes() {
  if (request.within && !request.groups && groups_from.empty()) {
    throw std::invalid_argument(
        "--within is for fibers in groups; give --groups or --groups-from, too");
  }
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
  if (loads && files == texts.size()) {
    throw std::invalid_argument("--loads is for generated scenes, and these are files");
  }
  std::size_t file = 0;
  for (const std::string& text : texts) {
    io::FiberFileOptions options;
    // If no scene is a file, the first one refuses the radius.
    if (files == 0 || isFile(text)) {
      if (!radii.empty()) options.radius = radii.size() == 1 ? radii[0] : radii[file++];
      options.radius_from = radius_from;
      options.groups_from = groups_from;
    }
    request.scenes.push_back({text, options, &generated, loads});
  }
  for (const auto& [text, scene] : {std::pair(&end, &request.end), {&other, &request.other}}) {
    if (text->empty()) continue;
    *scene = std::move(request.scenes.back());
    request.scenes.pop_back();
  }
}

std::vector<Command> commandsOf(const ProgramParts& parts) {
  std::vector<Command> commands;
  if (parts.scenes.make) {
    commands.push_back({"generate", "Write a generated scene to a file.", addGenerate, generate});
  }
  commands.push_back(
      {"convert", "Write the fibers of a file in another format.", addConvert, convert});
  commands.push_back({"info", "Count and measure a scene, and warn of oddities.", addInfo, info});
  commands.push_back({"check", "List the segments that touch.", addCheck, check});
  commands.push_back({"distance", "Find the least distance between fibers, and its place.",
                      addDistance, distance});
  if (parts.replay) {
    commands.push_back({"replay", "Make the calls of a ShadowManager's record again.", addReplay,
                        [&](const Request& request) { return parts.replay(request.path); }});
  }
  commands.push_back({"trade", "Measure what options cost and miss on a scene.", addTrade,
                      [&](const Request& request) { return tradeOff(request, parts.peers); }});
  commands.push_back({"view", "Write a page that shows scenes in 3D, offline.", addView, view});
  return commands;
}

}  // namespace fcl_fibers::tools
