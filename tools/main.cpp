// SPDX-License-Identifier: BSD-3-Clause
//
// fcl_fibers: the library as a program, for people who have a file of fibers.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "commands.h"
#include "harness/progress.h"

namespace fcl_fibers::tools {

void print(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw std::runtime_error("writing to stdout failed");
  }
}

void progress(const std::string& line) {
  if (line.empty()) return benchmarks::endProgress();
  benchmarks::showProgress(line);
}

std::string countText(std::size_t count) {
  std::string text = fmt::format("{}", count);
  for (int i = static_cast<int>(text.size()) - 3; i > 0; i -= 3) {
    text.insert(static_cast<std::size_t>(i), 1, ',');
  }
  return text;
}

std::string counted(std::size_t count, const char* one) {
  return fmt::format("{} {}{}", countText(count), one, count == 1 ? "" : "s");
}

namespace {

/// The parsed command line.
struct Arguments {
  std::string scene;
  std::vector<std::string> scenes;  ///< of view
  std::optional<double> radius;
  std::vector<double> radii;  ///< of view
  bool json = false, csv = false;
  std::string path;
  FiberTreeOptions tree;
  CheckRequest check;
  BenchRequest bench;
  ViewRequest view;

  SceneSource source() const { return openScene(scene, radius); }

  /// The scenes of view. One radius is for all files; several are for the files in order.
  std::vector<SceneSource> sources() const {
    const auto files =
        static_cast<std::size_t>(std::count_if(scenes.begin(), scenes.end(), isFile));
    if (radii.size() > 1 && radii.size() != files) {
      throw std::invalid_argument(
          fmt::format("--radius is given {} times for {}; give it once for all files, or once for "
                      "each",
                      radii.size(), counted(files, "file")));
    }
    std::vector<SceneSource> sources;
    std::size_t file = 0;
    for (const std::string& name : scenes) {
      std::optional<double> its_radius;
      // If no scene is a file, the first one refuses the radius.
      if (!radii.empty() && (files == 0 || isFile(name))) {
        its_radius = radii.size() == 1 ? radii[0] : radii[file++];
      }
      sources.push_back(openScene(name, its_radius));
    }
    return sources;
  }

  Output output() const { return json ? Output::kJson : csv ? Output::kCsv : Output::kText; }
};

const std::map<std::string, Report> kReports = {{"capsules", Report::kCapsules},
                                                {"volumes", Report::kVolumes}};
const std::map<std::string, FiberTreeOptions::Volumes> kVolumes = {
    {"boxes", FiberTreeOptions::Volumes::kLayeredBoxes},
    {"spheres", FiberTreeOptions::Volumes::kWrappedSpheres}};
const std::map<std::string, Topology> kTopologies = {{"bundle", Topology::kBundle},
                                                     {"super-thread", Topology::kSuperThread}};

/// CLI11's own validators print their range, up to the largest double in 300 digits.
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
CLI::Validator zeroOrMore() { return numberFrom(true); }
CLI::Validator aboveZero() { return numberFrom(false); }

std::string pictureProblem(const std::string& path) {
  const bool is_vtp = std::filesystem::path(path).extension() == ".vtp";
  return is_vtp ? "" : "'" + path + "' does not end in .vtp";
}

void addPicture(CLI::App& command, const char* name, std::string& path, const char* what) {
  command.add_option(name, path, what)
      ->check(CLI::Validator(pictureProblem, ""))
      ->type_name("FILE")
      ->group("Pictures, .vtp");
}

void addScene(CLI::App& command, Arguments& arguments) {
  command.add_option("SCENE", arguments.scene, "A file or a generated scene")
      ->required()
      ->type_name("");
  command
      .add_option("-r,--radius", arguments.radius,
                  "Radius of all fibers, in the file's unit (overrides the file)")
      ->check(zeroOrMore())
      ->type_name("LENGTH");
}

template <typename Value>
void addChoice(CLI::App& command, const char* name, Value& value,
               const std::map<std::string, Value>& choices, const char* type, const char* what) {
  command.add_option(name, value, what)
      ->transform(CLI::CheckedTransformer(choices).description(""))
      ->type_name(type);
}

void addTree(CLI::App& command, FiberTreeOptions& tree) {
  command
      .add_option("-n,--ignored-neighbors", tree.ignored_neighbors,
                  "Ignore pairs up to N segments apart on the same fiber (default 1)")
      ->check(zeroOrMore())
      ->type_name("N");
  command
      .add_option("-a,--ignored-arc-length", tree.ignored_arc_length,
                  "Ignore pairs closer than LENGTH along the same fiber (default 0)")
      ->check(zeroOrMore())
      ->type_name("LENGTH");
  command.add_option("-m,--margin", tree.margin, "Report pairs up to LENGTH apart (default 0)")
      ->check(zeroOrMore())
      ->type_name("LENGTH");
  addChoice(command, "--topology", tree.topology, kTopologies, "bundle|super-thread",
            "Shape of the tree; super-thread is the paper's (default bundle)");
  command.add_option("--threads", tree.threads, "Threads to use (default 1)")
      ->check(aboveZero())
      ->type_name("N");
}

int run(int argc, char** argv) {
  Arguments arguments;
  arguments.tree.report = Report::kCapsules;
  arguments.tree.ignored_neighbors = 1;
  CLI::App app("Finds collisions among fibers: hair, cables, ropes, yarn.", "fcl_fibers");
  app.footer(
      sceneHelp() +
      "\nExit code 2 is an error, with its message on stderr. `check` returns 1 if it finds "
      "contacts,\n`bench` if a manager misses a pair. Files are written whole or not at all.\n"
      "`fcl_fibers COMMAND --help` lists the options of a command.");
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  app.set_version_flag("--version", FCL_FIBERS_VERSION);

  CLI::App& generate = *app.add_subcommand("generate", "Write a scene to a file.");
  addScene(generate, arguments);
  generate
      .add_option("-o,--output", arguments.path,
                  "File to write: .vtp (ParaView), .hair, or .txt of polylines")
      ->required()
      ->type_name("FILE");

  CLI::App& info = *app.add_subcommand("info", "Count and measure a scene, and warn.");
  addScene(info, arguments);
  info.add_flag("--json", arguments.json, "Print JSON, for programs");

  CLI::App& check = *app.add_subcommand("check", "List the segments that touch.");
  addScene(check, arguments);
  addTree(check, arguments.tree);
  addChoice(check, "--report", arguments.tree.report, kReports, "capsules|volumes",
            "Capsules that touch, or volumes that overlap (default capsules)");
  addChoice(check, "--volumes", arguments.tree.volumes, kVolumes, "boxes|spheres",
            "Volumes of the tree (default boxes)");
  CLI::Option* const json = check.add_flag("--json", arguments.json, "List all contacts as JSON");
  check.add_flag("--csv", arguments.csv, "List all contacts as comma-separated values")
      ->excludes(json);
  check.add_option("-o,--output", arguments.check.path, "Write the list to FILE instead of stdout")
      ->type_name("FILE");
  addPicture(check, "--write-segments", arguments.check.segments_path,
             "Write the segments, with `fiber`, `segment` and `touching`");
  addPicture(check, "--write-contacts", arguments.check.contacts_path,
             "Write a point between the two segments of each pair");
  addPicture(check, "--write-volumes", arguments.check.volumes_path,
             "Write the volumes of one level of the tree");
  check
      .add_option("--depth", arguments.check.depth,
                  "Depth of that level; the root is 0 (default 2)")
      ->check(zeroOrMore())
      ->type_name("N")
      ->group("Pictures, .vtp");
  check.footer(
      "The exit code is 0 without contacts, 1 with contacts, 2 after an error.\n"
      "CSV has a line for each contact. JSON has the same names, with points and normals as "
      "lists:\n"
      "  fiber_a, segment_a, s   one segment, counted from 0, and where along it: 0 to 1\n"
      "  fiber_b, segment_b, t   the other one\n"
      "  distance                from surface to surface, negative if they overlap\n"
      "  point_a_x, ...          on a's surface, nearest to b, or deepest in it\n"
      "  point_b_x, ...          on b's\n"
      "  normal_x, ...           of length one, from a to b");

  CLI::App& bench = *app.add_subcommand("bench", "Compare the times of our managers and FCL's.");
  addScene(bench, arguments);
  bench.add_flag("--all", arguments.bench.all, "Time all of FCL's managers, and the paper's trees");
  bench.add_option("--repetitions", arguments.bench.repetitions, "Repetitions (default 9)")
      ->check(aboveZero())
      ->type_name("N");
  bench
      .add_option("--limit", arguments.bench.limit,
                  "Leave out managers with a phase longer than this (default 10)")
      ->check(aboveZero())
      ->type_name("SECONDS");
  bench.add_flag("--json", arguments.json, "Print JSON, for programs");
  bench.footer(
      "Fibers of a file swing about their first points; generated scenes move to their next "
      "frame.");

  CLI::App& view = *app.add_subcommand("view", "Write a page that shows scenes in 3D, offline.");
  view.add_option("SCENES", arguments.scenes, "Files or generated scenes")
      ->required()
      ->type_name("");
  view.add_option("-r,--radius", arguments.radii, "Radius of all files, or of each file in order")
      ->check(zeroOrMore())
      ->allow_extra_args(false)
      ->type_name("LENGTH");
  view.add_option("-o,--output", arguments.view.path, "Page to write, .html")
      ->required()
      ->type_name("FILE");
  addTree(view, arguments.tree);
  view.add_option("--depth", arguments.view.depth, "Depth of the deepest volumes (default 2)")
      ->check(CLI::Range(0, 8).description(""))
      ->type_name("N");
  view.add_option("--points", arguments.view.points,
                  "Points drawn of a scene, all frames together (default 1,000,000)")
      ->check(CLI::Range(std::size_t{1000}, std::size_t{100000000}).description(""))
      ->type_name("N");
  view.add_flag("--fragment", arguments.view.fragment,
                "Write a fragment without a head, for another page");
  view.footer(
      "Generated scenes have a radius of their own, or the key `radius`.\n"
      "Scenes with frames are played: `paper-dynamic`, or `helix:frames=0:100:5`.\n"
      "If a scene has more points than --points, every nth fiber and point is drawn.\n"
      "Contacts are searched among all points.");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kExitError;
  }
  if (generate.parsed()) return tools::generate(arguments.source(), arguments.path);
  if (info.parsed()) {
    return tools::info(findScene(arguments.scene, arguments.radius), arguments.output());
  }
  if (check.parsed()) {
    arguments.check.tree = arguments.tree;
    arguments.check.output = arguments.output();
    return tools::check(arguments.source(), arguments.check);
  }
  if (bench.parsed()) {
    arguments.bench.output = arguments.output();
    return tools::bench(arguments.source(), arguments.bench);
  }
  arguments.view.tree = arguments.tree;
  return tools::view(arguments.sources(), arguments.view);
}

}  // namespace
}  // namespace fcl_fibers::tools

int main(int argc, char** argv) {
  using namespace fcl_fibers;
  benchmarks::keepProgressToTerminals();
  try {
    return tools::run(argc, argv);
  } catch (const std::exception& error) {
    tools::progress("");
    std::fprintf(stderr, "fcl_fibers: %s\n", error.what());
    return tools::kExitError;
  }
}
