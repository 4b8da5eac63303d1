// SPDX-License-Identifier: BSD-3-Clause
#include "program.h"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <iostream>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "options.h"

namespace fcl_fibers::tools {
namespace {

/// The parsed command line.
struct Arguments {
  const GeneratedScenes& generated;
  std::string scene, other, end;
  std::vector<std::string> scenes;
  std::optional<double> radius;
  std::vector<double> radii;
  std::string radius_from;
  bool json = false, csv = false;
  std::string path;
  FiberTreeOptions tree;
  std::size_t limit = kPairLimit;
  std::optional<std::size_t> top;
  CheckRequest check;
  ViewRequest view;

  explicit Arguments(const GeneratedScenes& scenes) : generated(scenes) {
    tree.report = Report::kCapsules;
    tree.ignored_neighbors = 1;
  }

  /// What a scene may be.
  std::string choice() const {
    return generated.make ? "A file, `-`, or a generated scene." : "A file, or `-`.";
  }

  /// The scenes, and then those of `other` and `end` that are given. One radius is for all files;
  /// several are for the files in order.
  std::vector<SceneName> named() const {
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
    std::vector<SceneName> names;
    std::size_t file = 0;
    for (const std::string& text : texts) {
      io::FiberFileOptions options;
      // If no scene is a file, the first one refuses the radius.
      if (files == 0 || isFile(text)) {
        if (!radii.empty()) options.radius = radii.size() == 1 ? radii[0] : radii[file++];
        options.radius_from = radius_from;
      }
      names.push_back({text, options, &generated});
    }
    return names;
  }

  Output output() const { return json ? Output::kJson : csv ? Output::kCsv : Output::kText; }
};

const std::map<std::string, Report> kReports = {{"capsules", Report::kCapsules},
                                                {"volumes", Report::kVolumes}};
const std::map<std::string, FiberTreeOptions::Volumes> kVolumes = {
    {"boxes", FiberTreeOptions::Volumes::kLayeredBoxes},
    {"spheres", FiberTreeOptions::Volumes::kWrappedSpheres}};
const std::map<std::string, CheckRequest::Order> kOrders = {{"depth", CheckRequest::Order::kDepth},
                                                            {"fiber", CheckRequest::Order::kFiber}};

void addScene(CLI::App& command, Arguments& arguments) {
  command.add_option("SCENE", arguments.scene, arguments.choice())->required()->type_name("");
}

void addRadius(CLI::App& command, Arguments& arguments) {
  CLI::Option* const radius =
      command
          .add_option(
              "-r,--radius", arguments.radius,
              "The radius of all fibers, in the file's unit. It replaces\nthe radii in the file.")
          ->check(zeroOrMore())
          ->type_name("LENGTH");
  addRadiusFrom(command, arguments.radius_from, radius);
}

void addJson(CLI::App& command, Arguments& arguments) {
  command.add_flag("--json", arguments.json, "Print JSON, for programs.");
}

void addOutput(CLI::App& command, const char* name, const char* type, Arguments& arguments) {
  command
      .add_option(name, arguments.path,
                  "The file to write. It ends in .vtp (ParaView), .hair or .txt.")
      ->required()
      ->type_name(type);
}

void addEnd(CLI::App& command, Arguments& arguments, const char* what) {
  command.add_option("--end", arguments.end, what)->type_name("SCENE");
}

void addCheck(CLI::App& check, Arguments& arguments) {
  check
      .add_option("SCENES", arguments.scenes,
                  arguments.choice() + " Several are frames of one\nscene.")
      ->required()
      ->type_name("");
  CLI::Option* const against =
      check
          .add_option("--against", arguments.other,
                      "Look for pairs of each scene with SCENE, instead of pairs\nwithin it.")
          ->type_name("SCENE");
  addEnd(check, arguments,
         "List pairs that touch while the fibers move from SCENES to\nSCENE in a straight "
         "line, and when. Both have the same fibers.");
  CLI::Option* const mesh = addMeshes(check, arguments.check.meshes);
  check.add_flag("--meshes-only", arguments.check.meshes_only, "Leave out pairs of two fibers.")
      ->needs(mesh)
      ->excludes(against);
  addRadii(check, arguments.radii, arguments.radius_from);
  addTree(check, arguments.tree);
  addLimit(check, arguments.limit);
  addChoice(check, "--report", arguments.tree.report, kReports, "capsules|volumes",
            "Look for capsules that touch, or for volumes that overlap.\nThe default is capsules.");
  addChoice(check, "--volumes", arguments.tree.volumes, kVolumes, "boxes|spheres",
            "The volumes of the tree. The default is boxes.");
  addChoice(
      check, "--sort", arguments.check.order, kOrders, "depth|fiber",
      "List the deepest first, with --end the first in time, which is\nthe default, or in the "
      "order of the fibers.");
  check
      .add_option("--top", arguments.top,
                  "List the first N only. The default for text is 10. CSV and\nJSON list all.")
      ->check(aboveZero())
      ->type_name("N");
  check.add_flag(
      "--summary", arguments.check.summary,
      "List pairs of fibers, or of a fiber and a mesh, with their\nnumbers of contacts and "
      "least distances.");
  CLI::Option* const json = check.add_flag("--json", arguments.json, "Print JSON, for programs.");
  check.add_flag("--csv", arguments.csv, "Print comma-separated values.")->excludes(json);
  check.add_option("-o,--output", arguments.check.path, "Write to FILE instead of stdout.")
      ->type_name("FILE");
  check.add_flag("--exit-zero", arguments.check.exit_zero, "Return 0 if there are contacts, too.");
  addPicture(check, "--write-segments", arguments.check.segments_path,
             "Write the segments, with `fiber`, `segment` and `touching`.");
  addPicture(check, "--write-contacts", arguments.check.contacts_path,
             "Write a point between the two segments of each pair.");
  addPicture(check, "--write-volumes", arguments.check.volumes_path,
             "Write the volumes of one level of the tree.");
  check
      .add_option("--depth", arguments.check.depth,
                  "The depth of that level. The root has depth 0. The default\nis 2.")
      ->check(zeroOrMore())
      ->type_name("N")
      ->group("Pictures, .vtp");
  check.footer(
      "The exit code is 0 without contacts, 1 with contacts, and 2 after an error.\n"
      "CSV has a line for each contact. JSON has the same names, with points and normals as "
      "lists:\n"
      "  fiber_a, segment_a, s   One segment, counted from 0, and the place along it, from 0 to "
      "1.\n"
      "  fiber_b, segment_b, t   The other segment.\n"
      "  distance                From surface to surface. It is negative if they overlap.\n"
      "  point_a_x, ...          The point on the surface of a that is nearest to b, or deepest in "
      "it.\n"
      "  point_b_x, ...          The point on the surface of b, likewise.\n"
      "  normal_x, ...           The direction from a to b, of length one.\n"
      "With --mesh there are also contacts of a segment and a mesh, without fiber_b, segment_b and "
      "t:\n"
      "  mesh, triangle          A mesh, and the triangle into which the segment is deepest.\n"
      "  weight_0, ...           The place in the triangle: the weights of its three points.\n"
      "  solid                   1 if the segment is in a solid mesh, else 0.\n"
      "With --end there is the time at which a pair first touches, and the contact is that of "
      "then:\n"
      "  time                    From 0, the start, where some may touch already, to 1, the end.");
}

void addConvert(CLI::App& convert, Arguments& arguments) {
  convert.add_option("IN", arguments.scene, "The file to read, or `-`.")->required()->type_name("");
  addOutput(convert, "OUT", "", arguments);
  addRadius(convert, arguments);
  convert.footer(
      "No radius is needed. Radii of points are kept, except in .txt, which has no place for them. "
      "What\nelse a file holds is not, and is warned of.");
}

void addDistance(CLI::App& distance, Arguments& arguments) {
  addScene(distance, arguments);
  distance
      .add_option("OTHER", arguments.other,
                  "Another scene. The distance is then from SCENE to OTHER.")
      ->type_name("");
  addRadii(distance, arguments.radii, arguments.radius_from);
  addNeighbors(distance, arguments.tree);
  addJson(distance, arguments);
  distance.footer(
      "The distance is from surface to surface. It is negative if fibers overlap, and then it is "
      "the\ndeepest overlap; `check` lists all. Two segments of one fiber count only if the fiber "
      "turns\nback to itself: the part between them has to be longer than half a circle over their "
      "distance.");
}

void addReplay(CLI::App& replay, Arguments& arguments) {
  replay.add_option("FILE", arguments.path, "The file that the ShadowManager has written.")
      ->required()
      ->type_name("");
  replay.footer(
      "Asks FCL's manager and ours again, up to the first call in which they differ, and explains "
      "the\ndifference. The exit code is 1 if they differ.");
}

void addView(CLI::App& view, Arguments& arguments) {
  view.add_option("SCENES", arguments.scenes, "The scenes that the page shows.")
      ->required()
      ->type_name("");
  addRadii(view, arguments.radii, arguments.radius_from);
  view.add_option("-o,--output", arguments.view.path,
                  "Write the page to FILE, which ends in .html.")
      ->required()
      ->type_name("FILE");
  addEnd(view, arguments,
         "Play a step from the one scene to SCENE, which has the same\nfibers, and mark pairs "
         "when they first touch.");
  addMeshes(view, arguments.view.meshes);
  addTree(view, arguments.tree);
  addLimit(view, arguments.limit);
  view.add_option("--depth", arguments.view.depth,
                  "The depth of the deepest volumes. The default is 2.")
      ->check(CLI::Range(0, 8).description(""))
      ->type_name("N");
  view.add_option("--points", arguments.view.points,
                  "The most points to draw, of all frames. The default is 1,000,000.")
      ->check(CLI::Range(std::size_t{1000}, std::size_t{100000000}).description(""))
      ->type_name("N");
  view.add_option("--up", arguments.view.up,
                  "The axis that points up. Without it the program guesses.")
      ->check(CLI::IsMember({"x", "y", "z"}).description(""))
      ->type_name("x|y|z");
  view.add_flag("--fragment", arguments.view.fragment,
                "Write a fragment without a head, to put into another page.");
  const bool generated = static_cast<bool>(arguments.generated.make);
  view.footer(
      std::string(
          generated ? "Generated scenes have a radius of their own, or the key `radius`.\n"
                      "Scenes with frames are played: `paper-dynamic`, or `helix:frames=0:100:5`.\n"
                    : "") +
      "If a scene has more points than --points, every nth fiber and point is drawn.\n"
      "Contacts are searched among all points. A page marks the deepest 100,000 of a frame.\n"
      "Without --up, " +
      (generated ? "z points up in generated scenes and y in TressFX files; for others it is\n"
                 : "y points up in TressFX files; for others it is\n") +
      "guessed from how the fibers run.");
}

/// Runs the command that the arguments are for.
int runCommand(const std::string& command, Arguments& arguments, const ProgramParts& parts) {
  io::FiberFileOptions options;
  options.radius = arguments.radius;
  options.radius_from = arguments.radius_from;
  const auto found = [&] { return findScene(arguments.scene, options, arguments.generated); };
  if (command == "generate") return generate(found(), arguments.path);
  if (command == "convert") {
    const SceneSource source = found();
    printWarnings(source);
    return convert(source, arguments.path);
  }
  if (command == "info") return info(found(), arguments.output());
  if (command == "replay") return parts.replay(arguments.path);
  if (command == "distance") arguments.scenes = {arguments.scene};
  std::vector<SceneName> names = arguments.named();
  const auto taken = [&](const std::string& text) {
    std::optional<SceneName> name;
    if (text.empty()) return name;
    name = names.back();
    names.pop_back();
    return name;
  };
  const std::optional<SceneName> end_scene = taken(arguments.end), other = taken(arguments.other);
  if (command == "distance") {
    return distance({names.front(), other, arguments.tree, arguments.output()});
  }
  if (command == "check") {
    arguments.check.scenes = names;
    arguments.check.against = other;
    arguments.check.end = end_scene;
    arguments.check.tree = arguments.tree;
    arguments.check.limit = arguments.limit;
    arguments.check.top = arguments.top;
    arguments.check.output = arguments.output();
    return check(arguments.check);
  }
  std::vector<SceneSource> sources;
  for (const SceneName& name : names) sources.push_back(name.open());
  arguments.view.tree = arguments.tree;
  arguments.view.limit = arguments.limit;
  arguments.view.end = end_scene;
  return view(sources, arguments.view);
}

int parseAndRun(std::vector<std::string> words, const ProgramParts& parts) {
  Arguments arguments(parts.scenes);
  CLI::App app("Finds collisions among fibers: hair, cables, ropes, yarn.", parts.name);
  app.footer(
      sceneHelp(parts.scenes) +
      "\nThe exit code is 2 after an error, with its message on stderr. `check` returns 1 if it "
      "finds\ncontacts" +
      (parts.replay ? ", and `replay` if managers differ.\nFiles" : ". Files") +
      " are written whole or not at all.\n`" + parts.name +
      " COMMAND --help` describes the options of a command.");
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  app.set_version_flag("--version", FCL_FIBERS_VERSION);
  app.set_help_all_flag("--help-all", "Print the help of all commands.");
  const auto add = [&](const char* name, const char* what) -> CLI::App& {
    return *app.add_subcommand(name, what);
  };

  if (parts.scenes.make) {
    CLI::App& generate = add("generate", "Write a generated scene to a file.");
    addScene(generate, arguments);
    addOutput(generate, "-o,--output", "FILE", arguments);
  }
  addConvert(add("convert", "Write the fibers of a file in another format."), arguments);
  CLI::App& info = add("info", "Count and measure a scene, and warn of oddities.");
  addScene(info, arguments);
  addRadius(info, arguments);
  addJson(info, arguments);
  addCheck(add("check", "List the segments that touch."), arguments);
  addDistance(add("distance", "Find the least distance between fibers, and its place."), arguments);
  if (parts.replay) {
    addReplay(add("replay", "Make the calls of a ShadowManager's record again."), arguments);
  }
  addView(add("view", "Write a page that shows scenes in 3D, offline."), arguments);

  const auto is_named = [&](const CLI::App* command) { return command->check_name(words.front()); };
  if (!words.empty() && words.front().substr(0, 1) != "-" &&
      app.get_subcommands(is_named).empty()) {
    throw std::invalid_argument("there is no command '" + words.front() + "'; " + parts.name +
                                " --help lists those that there are");
  }
  try {
    std::reverse(words.begin(), words.end());  // CLI11 takes the first word from the end
    app.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    std::ostringstream answer, problem;
    const int code = app.exit(error, answer, problem);
    print(answer.str());
    std::fputs(readable(problem.str()).c_str(), stderr);
    return code == 0 ? 0 : kExitError;
  }
  return runCommand(app.get_subcommands().front()->get_name(), arguments, parts);
}

}  // namespace

int runProgram(const std::vector<std::string>& arguments, const ProgramParts& parts) {
  setProgramName(parts.name);
  try {
    return parseAndRun(arguments, parts);
  } catch (const std::exception& error) {
    progress("");
    std::fprintf(stderr, "%s\n", readable(parts.name + ": " + error.what()).c_str());
    return kExitError;
  }
}

}  // namespace fcl_fibers::tools
