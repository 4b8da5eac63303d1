// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/step.h"

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "arguments.h"
#include "scenes/random.h"

namespace fcl_fibers::scenes {
namespace {

/// Moves every point by `length` in a random direction.
void scatter(std::uint64_t seed, double length, FiberPolylines& scene) {
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    Random random = fiberRandom(seed, f);
    for (std::size_t i = scene.point_begin[f]; i < scene.point_begin[f + 1]; ++i) {
      // Normal deviates have no preferred direction.
      Eigen::Vector3d away;
      for (double& x : away) x = random.normal();
      away *= length / away.norm();
      for (int axis = 0; axis < 3; ++axis) {
        scene.points[i][static_cast<std::size_t>(axis)] += away[axis];
      }
    }
  }
}

}  // namespace

Step makeCapStep(const CapParameters& parameters, double radii) {
  if (!(radii > 1 && radii <= 1000)) {
    refuseArgument("makeCapStep", "radii", radii, "ask for a mean motion of 1 to 1000 radii");
  }
  Step step{makeCap(parameters), {}};
  const double wanted = radii * parameters.radius;
  // The motion grows a little slower than the number of frames, so this comes nearer each time.
  CapParameters later = parameters;
  for (double frames = 1, found = 0; std::abs(found - wanted) > 0.01 * wanted;
       frames *= wanted / found) {
    if (frames > 1000) {
      refuseArgument("makeCapStep", "radii", radii,
                     "the fibers are too short to move so far; ask for more segments or less");
    }
    later.frame = parameters.frame + frames;
    step.end = makeCap(later);
    scatter(~parameters.seed, parameters.radius, step.end);
    found = meanMotion(step);
  }
  return step;
}

double meanMotion(const Step& step) {
  double sum = 0;
  for (std::size_t i = 0; i < step.start.points.size(); ++i) {
    const Point &from = step.start.points[i], &to = step.end.points[i];
    sum += std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
  }
  return sum / static_cast<double>(step.start.points.size());
}

}  // namespace fcl_fibers::scenes
