// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/OBB.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl/math/bv/RSS.h>
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

/// The triangles as FCL takes them. For fcl::collide OBBs are the fastest, because it fits one to a
/// capsule in closed form, and for fcl::distance RSSs, as it needs no others.
template <typename Volume = fcl::OBBRSSd>
std::shared_ptr<fcl::BVHModel<Volume>> modelOf(const scenes::Triangles& mesh) {
  std::vector<fcl::Vector3d> vectors;
  std::vector<fcl::Triangle> indices;
  for (const Point& point : mesh.points) vectors.push_back(toVector(point));
  const auto corner = [&](std::size_t i) { return static_cast<std::size_t>(mesh.corners[i]); };
  for (std::size_t i = 0; i < mesh.corners.size(); i += 3) {
    indices.emplace_back(corner(i), corner(i + 1), corner(i + 2));
  }
  auto model = std::make_shared<fcl::BVHModel<Volume>>();
  model->beginModel();
  model->addSubModel(vectors, indices);
  model->endModel();
  return model;
}

/// The triangles in pieces: of each cube of a grid those whose middles are in it.
inline std::vector<scenes::Triangles> piecesOf(const scenes::Triangles& mesh, double edge) {
  std::map<std::array<long, 3>, scenes::Triangles> pieces;
  for (std::size_t i = 0; i < mesh.corners.size(); i += 3) {
    const auto corner = [&](std::size_t k) -> const Point& {
      return mesh.points[static_cast<std::size_t>(mesh.corners[i + k])];
    };
    std::array<long, 3> cube;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double sum = corner(0)[axis] + corner(1)[axis] + corner(2)[axis];
      cube[axis] = std::lround(sum / (3 * edge));
    }
    scenes::Triangles& piece = pieces[cube];
    for (std::size_t k = 0; k < 3; ++k) {
      piece.corners.push_back(static_cast<std::int32_t>(piece.points.size()));
      piece.points.push_back(corner(k));
    }
  }
  std::vector<scenes::Triangles> all;
  for (auto& [cube, piece] : pieces) all.push_back(std::move(piece));
  return all;
}

}  // namespace fcl_fibers::benchmarks
