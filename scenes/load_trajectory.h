// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace fcl_fibers::scenes {

/// Force and torque on the tip of a rod, in the frame of the rod's base.
struct TipLoad {
  Eigen::Vector3d force = {0, 0, 0};   ///< dyn
  Eigen::Vector3d torque = {0, 0, 0};  ///< dyn cm
};

/// What was done to the tip of a guide filament, step by step; states[0] is the start.
struct LoadTrajectory {
  std::vector<TipLoad> states;  ///< one a step
};

/// The guide filament of the dynamic assembly test, from straight to a loop in 100 steps: 101
/// states, the rows of loop.csv. It is made, not recorded: with a = i / 100 and the smooth
/// step b = a^2 (3 - 2 a), in the base frame of a rod along z of 15 cm and bending stiffness 4.7
/// dyn cm2,
///
///     force  = 0.05 (b, -sin(pi a), sin(2 pi a)) dyn
///     torque = 4.7 (2 pi / 15) (b, 0.1 sin(pi a), 0.2 sin(2 pi a)) dyn cm,
///
/// rounded to 1e-6: the torque about x ends at that of a full circle in the plane of y and z; the
/// rest sways the filament on its way and, at the end, keeps the loop from closing.
LoadTrajectory loopTrajectory();

/// Reads comma-separated values: lines that are empty or start with '#' are skipped, the first
/// other one is the header `step,fx,fy,fz,tx,ty,tz`, each further one a state. Steps count from 0;
/// forces are in dyn, torques in dyn cm. Throws std::runtime_error with file, line and reason where
/// the file is malformed or cannot be read.
LoadTrajectory readLoadTrajectory(const std::string& path);

/// Writes what readLoadTrajectory reads back bit by bit. Throws std::invalid_argument where a
/// number is not finite, and std::runtime_error with the file where it cannot be written.
void writeLoadTrajectory(const std::string& path, const LoadTrajectory& trajectory);

}  // namespace fcl_fibers::scenes
