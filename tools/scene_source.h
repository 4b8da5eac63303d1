// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <fcl_fibers/scenes/fiber_scene.h>

namespace fcl_fibers::tools {

/// What a command works on: a file of fibers, or a scene that is made, with its motion if it has
/// one.
struct SceneSource {
  std::string name;   ///< short: the file's name, or the scene's
  std::string title;  ///< as it was asked for
  bool is_file = false;
  bool has_radius = true;             ///< false: the file holds none, and none was given
  std::vector<std::string> warnings;  ///< of the file
  int frame = 0;                      ///< the one that was asked for
  int frame_count = 1;                ///< frames are 0, ..., frame_count - 1
  std::vector<int> playable;          ///< frames that a page plays; one of a scene at rest

  /// A frame of the motion. Fibers of a file swing about their roots, 0.01 rad a frame.
  std::function<scenes::FiberScene(int frame)> make;

  scenes::FiberScene scene() const { return make(frame); }
};

/// Whether `text` names a file that is there, and so no scene that is made.
bool isFile(const std::string& text);

/// Reads `text`: the path of a file, else `NAME` or `NAME:key=value,...` of a scene.
/// @param radius  of a file's fibers, instead of its own; a scene that is made has a key for it
/// @param part  of a scene that is made, one out of so many fibers, as dense as all
///
/// Throws std::invalid_argument for what is neither, or a key or value that is none, or a radius
/// beside a scene that is made.
SceneSource findScene(const std::string& text, std::optional<double> radius, int part = 1);

/// The same for all commands but info, whose answer tells both: throws std::invalid_argument where
/// there is no radius, and puts the file's warnings on stderr.
SceneSource openScene(const std::string& text, std::optional<double> radius, int part = 1);

/// Names, keys and defaults, for --help.
std::string sceneHelp();

}  // namespace fcl_fibers::tools
