// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_tree.h>
#include <CLI/CLI.hpp>

#include "mesh_file.h"

namespace fcl_fibers::tools {

// Options that several commands share. CLI11's own validators print their range, up to the largest
// double in 300 digits, so these have validators of their own.

CLI::Validator zeroOrMore();
CLI::Validator aboveZero();

/// `--radius-from`, which is given instead of `radius`.
void addRadiusFrom(CLI::App& command, std::string& name, CLI::Option* radius);

/// `--radius`, which may be repeated: a radius for each file; and `--radius-from`.
void addRadii(CLI::App& command, std::vector<double>& radii, std::string& radius_from);

/// Which pairs of one fiber are left out.
void addNeighbors(CLI::App& command, FiberTreeOptions& tree);

/// Neighbors, margin, topology and threads of a tree.
void addTree(CLI::App& command, FiberTreeOptions& tree);

/// `--mesh`, which may be repeated, and what belongs to it. Returns the option `--mesh`.
CLI::Option* addMeshes(CLI::App& command, MeshOptions& meshes);

void addLimit(CLI::App& command, std::size_t& limit);

/// A file of check to write, which has to end in .vtp.
void addPicture(CLI::App& command, const char* name, std::string& path, const char* what);

template <typename Value>
void addChoice(CLI::App& command, const char* name, Value& value,
               const std::map<std::string, Value>& choices, const char* type, const char* what) {
  command.add_option(name, value, what)
      ->transform(CLI::CheckedTransformer(choices).description(""))
      ->type_name(type);
}

}  // namespace fcl_fibers::tools
