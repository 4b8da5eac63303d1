// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "contenders/mesh_model.h"
#include "scenes/ball.h"

namespace fcl_fibers::benchmarks {

inline MeshPose toMeshPose(const fcl::Transform3d& pose) {
  MeshPose result;
  for (int row = 0; row < 3; ++row) {
    const auto r = static_cast<std::size_t>(row);
    for (int c = 0; c < 3; ++c) {
      result.rotation[3 * r + static_cast<std::size_t>(c)] = pose.linear()(row, c);
    }
    result.position[r] = pose.translation()[row];
  }
  return result;
}

inline std::vector<Corners> cornersOf(const scenes::Triangles& mesh, const fcl::Transform3d& pose) {
  return cornersOf(mesh.points, mesh.corners, pose);
}
inline std::shared_ptr<fcl::BVHModel<fcl::OBBRSSd>> modelOf(const scenes::Triangles& mesh) {
  return modelOf(mesh.points, mesh.corners);
}

}  // namespace fcl_fibers::benchmarks
