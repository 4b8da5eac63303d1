// SPDX-License-Identifier: BSD-3-Clause
#include "paper_scene.h"

#include <stdexcept>

#include <fcl_fibers/scenes/paper_scenes.h>

#include "moving_fibers.h"

namespace fcl_fibers::benchmarks {
namespace {

/// Of the load trajectory: bent by less than 0.1 rad.
constexpr int kAllButStraight = 1;

template <typename Parameters>
Parameters parametersOf(const PaperSceneRequest& request, int frame) {
  Parameters parameters;
  if (request.fibers > 0) parameters.fibers = request.fibers;
  if (request.segments > 0) parameters.segments = request.segments;
  parameters.seed = request.seed;
  parameters.frame = frame;
  return parameters;
}

}  // namespace

scenes::FiberScene makePaperScene(const PaperSceneRequest& request, int frame) {
  if (!request.hair.path.empty()) return readHair(request.hair, frame);
  if (request.name == "static" || request.name == "axis_parallel" ||
      request.name == "axis_turned") {
    auto parameters = parametersOf<scenes::PaperStaticParameters>(request, frame);
    parameters.turned = request.name != "axis_parallel";
    if (request.name != "static") parameters.state = kAllButStraight;
    return scenes::makePaperStatic(parameters);
  }
  if (request.name == "half_scalp") {
    return scenes::makePaperHalfScalp(
        parametersOf<scenes::PaperHalfScalpParameters>(request, frame));
  }
  if (request.name == "strand") {
    return scenes::makePaperStrand(parametersOf<scenes::PaperStrandParameters>(request, frame));
  }
  throw std::invalid_argument(
      "--scene=" + request.name +
      ": there are static, axis_parallel, axis_turned, half_scalp and strand");
}

}  // namespace fcl_fibers::benchmarks
