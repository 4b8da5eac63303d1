// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "found_pairs.h"
#include "mesh_file.h"
#include "messages.h"
#include "scene_source.h"

namespace fcl_fibers::tools {

// The commands of fcl_fibers. Each returns the exit code; an exception is an error, code 2. Answers
// go to stdout, and progress to stderr if that is a terminal. openScene() has printed the warnings
// of a file; only info has them in its answer.

constexpr int kExitContacts = 1;
constexpr int kExitError = 2;

enum class Output { kText, kCsv, kJson };

/// Writes a generated scene to `path`, whose ending chooses the format: .vtp, .hair or .txt.
int generate(const SceneSource& source, const std::string& path);

/// Writes the fibers of a file in another format, likewise. No radius is needed.
int convert(const SceneSource& source, const std::string& path);

/// Counts, lengths, bounds, warnings, and the radius at which contact begins.
int info(const SceneSource& source, Output output);

struct CheckRequest {
  enum class Order { kDepth, kFiber };

  std::vector<SceneName> scenes;     ///< several are frames of one scene
  std::optional<SceneName> against;  ///< else each scene is checked against itself
  std::optional<SceneName> end;      ///< else there is no step
  FiberTreeOptions tree;
  MeshOptions meshes;
  bool meshes_only = false;        ///< leave out pairs of two segments
  std::size_t limit = kPairLimit;  ///< the search of a frame ends after so many pairs
  Output output = Output::kText;
  Order order = Order::kDepth;
  std::optional<std::size_t> top;  ///< so many rows; else text has ten, and other output all
  bool summary = false;            ///< a row for each two fibers, and each fiber and mesh
  bool exit_zero = false;
  std::string path;                                        ///< of the list; empty for stdout
  std::string segments_path, contacts_path, volumes_path;  ///< pictures to write; empty for none
  int depth = 2;                                           ///< of the volumes
};
/// The pairs of the scenes; returns 1 if there are any, unless exit_zero.
int check(const CheckRequest& request);
/// The same for the pairs that touch during a step from the scene to `end`.
int checkStep(const CheckRequest& request);

struct DistanceRequest {
  SceneName scene;
  std::optional<SceneName> other;  ///< else the distance is between fibers of the scene
  FiberTreeOptions tree;           ///< which neighbors count for none
  Output output = Output::kText;
};
/// The least distance between the surfaces of two fibers, and where it is.
int distance(const DistanceRequest& request);

struct ViewRequest {
  FiberTreeOptions tree;
  MeshOptions meshes;
  std::size_t limit = kPairLimit;  ///< the search of a frame ends after so many pairs
  std::string path;
  bool fragment = false;         ///< a part of another page, without a head
  int depth = 2;                 ///< deepest volumes
  std::size_t points = 1000000;  ///< drawn of each scene, in all frames together
  std::string up;                ///< axis that points up: x, y or z; empty to guess
  std::optional<SceneName> end;  ///< of a step that starts with the scene; else there is none
};
/// Writes a page that shows the scenes, or the one scene during a step.
int view(const std::vector<SceneSource>& sources, const ViewRequest& request);

/// The page that view() writes, as HTML, of fibers and meshes that are in memory: a whole page for
/// a file or the srcdoc of an iframe, as in a notebook; a fragment for a page that is written as a
/// whole, because no script runs that is inserted by innerHTML. Several fragments fit into one
/// page. The request's path, paths of meshes and end are not used. Throws std::runtime_error if
/// there is no segment, and std::invalid_argument as FiberTree does.
std::string pageOf(const std::string& title, const FiberPolylines& fibers,
                   const ViewRequest& request, const std::vector<MeshFile>& meshes = {});

}  // namespace fcl_fibers::tools
