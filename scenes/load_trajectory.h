// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

namespace fcl_fibers::scenes {

/// Force and torque on the tip of a rod, in the frame of the rod's base.
struct TipLoad {
  Eigen::Vector3d force = {0, 0, 0};   ///< dyn
  Eigen::Vector3d torque = {0, 0, 0};  ///< dyn cm
};

/// The guide filament of the dynamic assembly test, from straight to a loop in 100 steps: 101
/// states. It is made, not recorded: with a = i / 100 and the smooth
/// step b = a^2 (3 - 2 a), in the base frame of a rod along z of 15 cm and bending stiffness 4.7
/// dyn cm2,
///
///     force  = 0.05 (b, -sin(pi a), sin(2 pi a)) dyn
///     torque = 4.7 (2 pi / 15) (b, 0.1 sin(pi a), 0.2 sin(2 pi a)) dyn cm,
///
/// rounded to 1e-6: the torque about x ends at that of a full circle in the plane of y and z; the
/// rest sways the filament on its way and, at the end, keeps the loop from closing.
std::vector<TipLoad> loopTrajectory();

}  // namespace fcl_fibers::scenes
