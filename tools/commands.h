// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "scene_source.h"

namespace fcl_fibers::tools {

// The commands of fcl_fibers. Each returns the exit code; an exception is an error, code 2. Answers
// go to stdout, and progress to stderr if that is a terminal. openScene() has printed the warnings
// of a file; only info has them in its answer.

constexpr int kExitContacts = 1;
constexpr int kExitError = 2;

enum class Output { kText, kCsv, kJson };

/// Writes the scene to `path`, whose ending chooses the format: .vtp, .hair or .txt.
int generate(const SceneSource& source, const std::string& path);

/// Counts, lengths, bounds and warnings.
int info(const SceneSource& source, Output output);

struct CheckRequest {
  FiberTreeOptions tree;
  Output output = Output::kText;
  std::string path;                                        ///< of the list; empty for stdout
  std::string segments_path, contacts_path, volumes_path;  ///< pictures to write; empty for none
  int depth = 2;                                           ///< of the volumes
};
/// The pairs of the scene; returns 1 if there are any.
int check(const SceneSource& source, const CheckRequest& request);

struct BenchRequest {
  Output output = Output::kText;
  bool all = false;  ///< else FCL's slow managers and the paper's trees are left out
  int repetitions = 9;
  double limit = 10;  ///< seconds that a phase may take
};
/// Returns 1 if a manager misses a touching pair.
int bench(const SceneSource& source, const BenchRequest& request);

struct ViewRequest {
  FiberTreeOptions tree;
  std::string path;
  bool fragment = false;         ///< write a part of another page
  int depth = 2;                 ///< deepest volumes
  std::size_t points = 1000000;  ///< drawn of each scene, in all frames together
};
/// Writes a page that shows the scenes.
int view(const std::vector<SceneSource>& sources, const ViewRequest& request);

/// Puts an answer on stdout, or throws std::runtime_error if that fails.
void print(const std::string& text);

/// One line on stderr that overwrites itself, if that is a terminal; empty clears it.
void progress(const std::string& line);

/// `1,234,567`
std::string countText(std::size_t count);

/// `1 fiber`, `1,234 fibers`
std::string counted(std::size_t count, const char* one);

}  // namespace fcl_fibers::tools
