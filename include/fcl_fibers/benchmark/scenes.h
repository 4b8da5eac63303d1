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

/// The scene of `NAME` or `NAME:key=value,...`, such as `paper-dynamic:frame=85`, or of the path of
/// a file of fibers, which swing about their roots. Throws std::invalid_argument if there is
/// neither, if a key is unknown or its value out of range, if a generated scene is given a radius,
/// or if a file has none and none is given; std::runtime_error if it cannot be read. Warnings of a
/// file go to stderr. The radius is that of a file's fibers, in its unit.
FCL_FIBERS_BENCHMARK_EXPORT Scene namedScene(const std::string& text,
                                             std::optional<double> radius = std::nullopt);

/// Names of scenes and their keys.
FCL_FIBERS_BENCHMARK_EXPORT std::string sceneHelp();

}  // namespace fcl_fibers::benchmarks
