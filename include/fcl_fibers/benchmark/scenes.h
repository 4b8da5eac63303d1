// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>

#include <fcl_fibers/benchmark/export.h>
#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::benchmarks {

/// A scene of fibers and its motion. Lengths are in the unit of the scene: cm where it is
/// generated.
struct Scene {
  std::string name;     ///< as it was asked for
  int frame = 0;        ///< the one that was asked for
  int frame_count = 1;  ///< frames are 0, ..., frame_count - 1
  /// The fibers in a frame, the same ones in all. Throws std::invalid_argument if there is no such
  /// frame.
  std::function<FiberPolylines(int frame)> at;
};

/// Returns the scene that `text` names. The text is `NAME` or `NAME:key=value,...`, such as
/// `paper-dynamic:frame=85`, or the path of a file of fibers, which swing about their roots. The
/// radius is that of a file's fibers, in the file's unit. Warnings of a file go to stderr. Throws
/// std::invalid_argument if there is no such scene or file, if a key is unknown or its value out of
/// range, if a generated scene is given a radius, or if neither the file nor the caller gives one.
/// Throws std::runtime_error if the file cannot be read.
FCL_FIBERS_BENCHMARK_EXPORT Scene namedScene(const std::string& text,
                                             std::optional<double> radius = std::nullopt);

/// Names of scenes and their keys.
FCL_FIBERS_BENCHMARK_EXPORT std::string sceneHelp();

}  // namespace fcl_fibers::benchmarks
