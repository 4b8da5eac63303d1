// SPDX-License-Identifier: BSD-3-Clause
#include "options.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>

namespace fcl_fibers::tools {
namespace {

const std::map<std::string, Topology> kTopologies = {{"bundle", Topology::kBundle},
                                                     {"super-thread", Topology::kSuperThread}};

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

std::string nameProblem(const std::string& name) {
  return name.empty() ? "give the name of an array, or the number of a column" : "";
}

std::string pictureProblem(const std::string& path) {
  const bool is_vtp = std::filesystem::path(path).extension() == ".vtp";
  return is_vtp ? "" : "'" + path + "' does not end in .vtp";
}

}  // namespace

CLI::Validator zeroOrMore() { return numberFrom(true); }
CLI::Validator aboveZero() { return numberFrom(false); }

void addRadiusFrom(CLI::App& command, std::string& name, CLI::Option* radius) {
  command
      .add_option("--radius-from", name,
                  "Take the radii from the array NAME of a .vtp file, instead of\n"
                  "`radius`, or from column NAME of text, the fourth or a later\none.")
      ->check(CLI::Validator(nameProblem, ""))
      ->excludes(radius)
      ->type_name("NAME");
}

void addRadii(CLI::App& command, std::vector<double>& radii, std::string& radius_from) {
  CLI::Option* const radius =
      command
          .add_option("-r,--radius", radii,
                      "The radius of all files, in their unit. It replaces the\n"
                      "radii in a file. Repeat it for a radius of each file.")
          ->check(zeroOrMore())
          ->allow_extra_args(false)
          ->type_name("LENGTH");
  addRadiusFrom(command, radius_from, radius);
}

void addNeighbors(CLI::App& command, FiberTreeOptions& tree) {
  command
      .add_option("-n,--ignored-neighbors", tree.ignored_neighbors,
                  "Leave out pairs of one fiber that are at most N segments\n"
                  "apart. The default is 1, which leaves out adjacent segments.")
      ->check(zeroOrMore())
      ->type_name("N");
  command
      .add_option("-a,--ignored-arc-length", tree.ignored_arc_length,
                  "Leave out pairs of one fiber with at most LENGTH of it\n"
                  "between them. The default is 0.")
      ->check(zeroOrMore())
      ->type_name("LENGTH");
}

void addTree(CLI::App& command, FiberTreeOptions& tree) {
  addNeighbors(command, tree);
  command
      .add_option("-m,--margin", tree.margin,
                  "Report pairs up to LENGTH apart, too. The default is 0.")
      ->check(zeroOrMore())
      ->type_name("LENGTH");
  addChoice(command, "--topology", tree.topology, kTopologies, "bundle|super-thread",
            "The shape of the tree: `bundle`, which is the default, or\n"
            "`super-thread`, which is the paper's.");
  command.add_option("--threads", tree.threads, "Use N threads. The default is 1.")
      ->check(aboveZero())
      ->type_name("N");
}

CLI::Option* addMeshes(CLI::App& command, MeshOptions& meshes) {
  CLI::Option* const mesh =
      command
          .add_option("--mesh", meshes.paths,
                      "Triangles that fibers may touch, as a Wavefront OBJ file, in\n"
                      "the frame and unit of the fibers. Repeat it for more.")
          ->allow_extra_args(false)
          ->type_name("FILE");
  command
      .add_option("--root-length", meshes.root_length,
                  "Segments that begin at less than LENGTH along their fiber\n"
                  "meet no mesh, because they are in the scalp.")
      ->check(zeroOrMore())
      ->needs(mesh)
      ->type_name("LENGTH");
  command
      .add_option("--root-segments", meshes.root_segments,
                  "The first N segments of each fiber meet no mesh.")
      ->check(zeroOrMore())
      ->needs(mesh)
      ->type_name("N");
  command
      .add_flag("--solid", meshes.solid,
                "The inside of meshes counts, too. They have to be watertight.")
      ->needs(mesh);
  return mesh;
}

void addLimit(CLI::App& command, std::size_t& limit) {
  command
      .add_option("--limit", limit,
                  "End the search of a frame after N pairs, or with --end\n"
                  "keep the first N, and warn. The default is 10,000,000.")
      ->check(aboveZero())
      ->type_name("N");
}

void addPicture(CLI::App& command, const char* name, std::string& path, const char* what) {
  command.add_option(name, path, what)
      ->check(CLI::Validator(pictureProblem, ""))
      ->type_name("FILE")
      ->group("Pictures, .vtp");
}

}  // namespace fcl_fibers::tools
