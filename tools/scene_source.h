// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/io/fiber_file.h>

namespace fcl_fibers::tools {

/// A straight rod of equal stiffness in all directions, clamped in the origin along z, whose loads
/// an assembly follows.
struct GuideFilament {
  double length, stiffness;  ///< cm, dyn cm2
};

/// Fibers of a scene that belong together: those of a file among several, or those for which a file
/// has a number.
struct SceneGroup {
  double number;                ///< of the file, counted from 0; or that in the file
  std::string name{};           ///< of the file; empty if a number in it tells the group
  std::size_t first_fiber = 0;  ///< of the file, in the scene

  /// `group 1, a.tck`
  std::string text() const;
};

/// The input of a command: a file of fibers or a generated scene, with its motion if it has one.
struct SceneSource {
  std::string name;   ///< short: the file's name, or the scene's
  std::string title;  ///< as it was asked for
  bool is_file = false;
  bool has_radius = true;             ///< false if the file holds none and none was given
  bool has_samples = false;           ///< see FiberPolylines::samples
  std::string problem;                ///< why no command but `convert` takes the fibers, or empty
  std::vector<std::string> warnings;  ///< of the file
  std::vector<std::string> passed_over;  ///< see io::FiberFile
  int frame = 0;                         ///< the one that was asked for
  int frame_count = 1;                   ///< frames are 0, ..., frame_count - 1
  std::vector<int> playable;             ///< frames that a page plays; a scene at rest has one
  std::vector<int> asked = {0};          ///< frames of `frames=`, or else the one
  std::vector<SceneGroup> groups;        ///< that of FiberPolylines::groups, less 1
  std::optional<GuideFilament> guide;    ///< of an assembly that follows one

  /// A frame of the motion. Fibers of a file swing about their roots, 0.01 rad a frame.
  std::function<FiberPolylines(int frame)> make;

  FiberPolylines scene() const { return make(frame); }
};

struct SceneName;

/// The scenes that a program generates by name, if it does.
struct GeneratedScenes {
  /// Makes the scene of `NAME` or `NAME:key=value,...`. Throws std::invalid_argument if there is
  /// none of that name, if a key is unknown or its value out of range, if there is a radius, for
  /// which scenes have a key, or if there are loads and the scene has none; and std::runtime_error
  /// if the loads cannot be read. Empty if the program generates none.
  std::function<SceneSource(const SceneName& name)> make;
  std::string help;  ///< names, keys and defaults
};

/// Whether `text` names an existing file, or is `-`, which is standard input. Files come before
/// generated scenes of the same name.
bool isFile(const std::string& text);

/// Throws std::invalid_argument if the scene has a problem.
void requireNoProblem(const SceneSource& source);

/// Prints the file's warnings to stderr.
void printWarnings(const SceneSource& source);

/// A scene as the command line names it: the path of a file, `-` for standard input, or a generated
/// scene.
struct SceneName {
  std::string text;
  io::FiberFileOptions options;        ///< of a file
  const GeneratedScenes* generated;    ///< outlive it
  std::optional<std::string> loads{};  ///< file of the loads of a generated scene

  /// Throws std::invalid_argument if there is no such file or scene.
  SceneSource find() const;

  /// find() for commands that look for pairs: prints the warnings, and throws std::invalid_argument
  /// if there is no radius or the scene has a problem.
  SceneSource open() const;
};

/// What a scene is, for --help.
std::string sceneHelp(const GeneratedScenes& generated);

}  // namespace fcl_fibers::tools
