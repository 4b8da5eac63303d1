// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/load_trajectory.h"

#include <cmath>

namespace fcl_fibers::scenes {
namespace {

constexpr double kPi = 3.141592653589793;
constexpr int kLoopSteps = 100;
constexpr double kGuideLength = 15;      // cm
constexpr double kGuideStiffness = 4.7;  // dyn cm2
constexpr double kLoopForce = 0.05;      // dyn

// So that the loads are the same on every platform, whatever its sine; never -0.
double rounded(double x) { return std::round(x * 1e6) / 1e6 + 0.0; }

}  // namespace

std::vector<TipLoad> loopTrajectory() {
  std::vector<TipLoad> trajectory;
  const double loop_torque = kGuideStiffness * 2 * kPi / kGuideLength;
  for (int step = 0; step <= kLoopSteps; ++step) {
    const double a = static_cast<double>(step) / kLoopSteps;
    const double b = a * a * (3 - 2 * a);
    const double wave = std::sin(kPi * a);
    const double double_wave = std::sin(2 * kPi * a);
    TipLoad state;
    state.force = kLoopForce * Eigen::Vector3d(b, -wave, double_wave);
    state.torque = loop_torque * Eigen::Vector3d(b, 0.1 * wave, 0.2 * double_wave);
    trajectory.push_back({state.force.unaryExpr(&rounded), state.torque.unaryExpr(&rounded)});
  }
  return trajectory;
}

}  // namespace fcl_fibers::scenes
