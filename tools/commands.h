// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
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
// go to stdout, and progress to stderr if that is a terminal. SceneName::open() has printed the
// warnings of a file; only info has them in its answer.

constexpr int kExitContacts = 1;
constexpr int kExitError = 2;

enum class Output { kText, kCsv, kJson };

namespace trade {

struct Scene;
struct Setting;

/// What a program can accept.
struct Wish {
  double missed = 0, wrong = 0;     ///< shares, of contacts and of the pairs reported
  std::optional<double> seconds{};  ///< of a frame
};

}  // namespace trade

/// What a command is asked for. It reads what it has options for.
struct Request {
  enum class Order { kDepth, kFiber };

  /// Several are for check the frames of one scene, and for view scenes beside each other.
  std::vector<SceneName> scenes{};
  bool groups = false;               ///< several are groups of one scene
  bool frames = false;               ///< several are for view, too, the frames of one scene
  bool within = false;               ///< pairs within a group count, too
  std::optional<SceneName> other{};  ///< to search or measure against; else a scene has only itself
  std::optional<SceneName> end{};    ///< of a step that starts with the scene
  FiberTreeOptions tree;
  MeshOptions meshes{};
  bool meshes_only = false;        ///< leave out pairs of two segments
  std::size_t limit = kPairLimit;  ///< the search of a frame ends after so many pairs
  Output output = Output::kText;
  std::string path{};  ///< to write to; empty for stdout

  Order order = Order::kDepth;
  std::optional<std::size_t> top{};  ///< so many rows; else text has ten, and other output all
  bool summary = false;              ///< a row for each two fibers, and each fiber and mesh
  bool exit_zero = false;
  std::string segments_path{}, contacts_path{}, volumes_path{};  ///< pictures; empty for none

  int depth = 2;                 ///< of the volumes of a picture, and of the deepest of a page
  bool fragment = false;         ///< a part of another page, without a head
  std::size_t points = 1000000;  ///< drawn of each scene, in all frames together
  std::string up{};              ///< axis that points up: x, y or z; empty to guess
  bool record = false;           ///< the page bends the guide filament and records its loads

  struct Trade {
    trade::Wish wish;
    double longest = 5;     ///< seconds of a frame
    bool again = false;     ///< nothing of a run that was stopped is used
    std::string picture{};  ///< of the front, as SVG; empty for none
  } trade{};
};

/// Writes a generated scene to the path, whose ending chooses the format: .vtp, .hair or .txt.
int generate(const Request& request);

/// Writes the fibers of a file in another format, which the ending of the path chooses. No radius
/// is needed.
int convert(const Request& request);

/// Counts, lengths, bounds, warnings, and the radius at which contact begins.
int info(const Request& request);

/// The pairs of the scenes, or those that touch during a step from the scene to `end`; returns 1 if
/// there are any, unless exit_zero.
int check(const Request& request);
int checkStep(const Request& request);

/// The least distance between the surfaces of two fibers, and where it is.
int distance(const Request& request);

/// Further settings of a scene, such as those of FCL's managers.
/// @param options  of the first setting
using PeerSettings = std::function<std::vector<trade::Setting>(const trade::Scene& scene,
                                                               const FiberTreeOptions& options)>;

/// What options and other ways cost on a scene, and what they miss, and the fastest that is wished
/// for.
/// @param peers  may be empty
int tradeOff(const Request& request, const PeerSettings& peers);

/// Writes a page that shows the scenes, or the one scene during a step.
int view(const Request& request);

/// The page that view() writes, as HTML, of fibers and meshes that are in memory: a whole page for
/// a file or the srcdoc of an iframe, as in a notebook; a fragment for a page that is written as a
/// whole, because no script runs that is inserted by innerHTML. Several fragments fit into one
/// page. The request's path, paths of meshes and end are not used. Throws std::runtime_error if
/// there is no segment, and std::invalid_argument as FiberTree does.
std::string pageOf(const std::string& title, const FiberPolylines& fibers, const Request& request,
                   const std::vector<MeshFile>& meshes = {});

}  // namespace fcl_fibers::tools
