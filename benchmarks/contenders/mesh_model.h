// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl_fibers/fiber_polylines.h>

#include "judge/exact_triangle_test.h"

namespace fcl_fibers::benchmarks {

inline fcl::Vector3d toVector(const Point& p) { return {p[0], p[1], p[2]}; }

/// The triangles of three points each at a pose, for the judge.
inline std::vector<Corners> cornersOf(const std::vector<Point>& points,
                                      const std::vector<std::int32_t>& triangles,
                                      const fcl::Transform3d& pose) {
  std::vector<Corners> corners(triangles.size() / 3);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    corners[i / 3][i % 3] = pose * toVector(points[static_cast<std::size_t>(triangles[i])]);
  }
  return corners;
}

/// The triangles as FCL takes them, by the bounding volume that its examples use.
inline std::shared_ptr<fcl::BVHModel<fcl::OBBRSSd>> modelOf(
    const std::vector<Point>& points, const std::vector<std::int32_t>& triangles) {
  std::vector<fcl::Vector3d> vectors;
  std::vector<fcl::Triangle> indices;
  for (const Point& point : points) vectors.push_back(toVector(point));
  const auto corner = [&](std::size_t i) { return static_cast<std::size_t>(triangles[i]); };
  for (std::size_t i = 0; i < triangles.size(); i += 3) {
    indices.emplace_back(corner(i), corner(i + 1), corner(i + 2));
  }
  auto model = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  model->beginModel();
  model->addSubModel(vectors, indices);
  model->endModel();
  return model;
}

}  // namespace fcl_fibers::benchmarks
