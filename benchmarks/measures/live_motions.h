// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

#include "scenes.h"

namespace fcl_fibers::benchmarks {

inline double distance(const Point& p, const Point& q) {
  return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
}

/// Writes the points of the next step.
using Mover = std::function<void(std::vector<Point>& points)>;

/// A motion of the scene by its name, as the head of main.cpp tells: slow, fast, weather, creeping
/// or frames. Each one made has the same steps.
Mover makeMover(const std::string& motion, const SceneSource& source);

}  // namespace fcl_fibers::benchmarks
