// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "contenders/moving_fibers.h"
#include "scenes/generated_scenes.h"

namespace fcl_fibers::benchmarks {

using scenes::generatedScenes, scenes::openScene, tools::SceneSource;

/// A scene as the program fcl_fibers names it, or a file of fibers.
struct SceneRequest {
  std::string text = "helix";    ///< `helix:fibers=1000,segments=100`, or a path
  std::optional<double> radius;  ///< of a file's fibers, in its unit
  int steps = 100;               ///< of the paper's dynamic assembly, or of fibers whose pairs live
  bool rows = false;             ///< fibers in the order of rowsOfRoots()
};

/// Two frames that take turns: the one that the scene asks for, and the next one.
std::array<FiberPolylines, 2> twoFrames(const SceneRequest& request);
template <typename S = double>
BasicMovingFibers<S> movingFibers(const tools::SceneSource& source, bool rows = false);

/// A scene and how its motion is gone through.
template <typename S>
struct BasicMotion {
  BasicMovingFibers<S> fibers;
  bool summed = false;  ///< over all frames in their order; else two frames take turns

  /// Where contenders are checked, two frames each; those of `fibers` if there are none.
  std::vector<BasicMovingFibers<S>> checked;
  /// Where they are tried: one step in the middle of the motion, if it is summed.
  std::optional<BasicMovingFibers<S>> tried = {};
};
using Motion = BasicMotion<double>;

/// The paper's dynamic assembly through its steps, unless one frame of it is asked for; any other
/// scene in two frames. Throws std::invalid_argument where there is no such scene, or no radius.
/// @param part  one out of so many fibers: of a scene that is made, as dense as all, except of
/// paper-strand, which has one area for any number of fibers
template <typename S = double>
BasicMotion<S> makeMotion(const SceneRequest& request, int part = 1);

}  // namespace fcl_fibers::benchmarks
