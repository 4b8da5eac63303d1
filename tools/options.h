// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "commands.h"

namespace fcl_fibers::tools {

/// The parsed command line: a request, and the texts that name its scenes.
struct Arguments {
  const GeneratedScenes& generated;
  Request request{};
  std::vector<std::string> scenes{};
  std::string other{}, end{};
  std::vector<double> radii{};
  std::string radius_from{};

  /// Names the scenes of the request: `scenes`, and `other` and `end` if they are given. One radius
  /// is for all files; several are for the files in order.
  void nameScenes();
};

// Options of commands, in the order of their help.

/// What a scene may be.
std::string sceneText(const Arguments& arguments);

/// The positional that is a scene, or that are several.
void addScene(CLI::App& command, const char* name, const std::string& what, Arguments& arguments);
void addScenes(CLI::App& command, const std::string& what, Arguments& arguments);

/// The file that `convert` and `generate` write.
void addFile(CLI::App& command, const char* name, const char* type, Arguments& arguments);

/// `--radius` of one file, or of each file if there may be several, and `--radius-from`.
void addRadius(CLI::App& command, Arguments& arguments);
void addRadii(CLI::App& command, Arguments& arguments);

/// Which pairs of one fiber are left out.
void addNeighbors(CLI::App& command, FiberTreeOptions& tree);

/// Neighbors, margin, topology and threads of a tree, and the limit of a search.
void addSearch(CLI::App& command, Request& request);

/// `--mesh`, which may be repeated, and what belongs to it. Returns the option `--mesh`.
CLI::Option* addMeshes(CLI::App& command, MeshOptions& meshes);

void addEnd(CLI::App& command, Arguments& arguments, const char* what);

/// What `check` looks for, and how and where to it writes that.
void addReport(CLI::App& command, FiberTreeOptions& tree);
void addList(CLI::App& command, Request& request);
void addPictures(CLI::App& command, Request& request);

/// What `view` draws.
void addDrawing(CLI::App& command, Request& request);

CLI::Option* addJson(CLI::App& command, Request& request);

}  // namespace fcl_fibers::tools
