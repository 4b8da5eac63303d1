// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl_fibers/triangle_mesh.h>

#include "judge/triangle_judge.h"
#include "scenes/ball.h"

namespace fcl_fibers::benchmarks {

inline fcl::Vector3d toVector(const Point& p) { return {p[0], p[1], p[2]}; }

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

/// The triangles at a pose, for the judge.
inline std::vector<Corners> cornersOf(const scenes::Triangles& mesh, const fcl::Transform3d& pose) {
  std::vector<Corners> corners(mesh.corners.size() / 3);
  for (std::size_t i = 0; i < mesh.corners.size(); ++i) {
    const auto point = static_cast<std::size_t>(mesh.corners[i]);
    corners[i / 3][i % 3] = pose * toVector(mesh.points[point]);
  }
  return corners;
}

/// The triangles as FCL takes them, by the bounding volume that its examples use.
inline std::shared_ptr<fcl::BVHModel<fcl::OBBRSSd>> modelOf(const scenes::Triangles& mesh) {
  std::vector<fcl::Vector3d> vectors;
  std::vector<fcl::Triangle> indices;
  for (const Point& point : mesh.points) vectors.push_back(toVector(point));
  const auto corner = [&](std::size_t i) { return static_cast<std::size_t>(mesh.corners[i]); };
  for (std::size_t i = 0; i < mesh.corners.size(); i += 3) {
    indices.emplace_back(corner(i), corner(i + 1), corner(i + 2));
  }
  auto model = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  model->beginModel();
  model->addSubModel(vectors, indices);
  model->endModel();
  return model;
}

}  // namespace fcl_fibers::benchmarks
