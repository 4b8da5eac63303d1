// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include <fcl/geometry/collision_geometry.h>
#include <fcl/math/triangle.h>

namespace fcl_fibers::test {

/// Points, and triangles between them by index.
struct MeshShape {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<std::size_t, 3>> triangles;
};

/// A closed surface around the origin whose radius goes up and down by `waves` of itself. Triangles
/// are counterclockwise seen from outside. There are 2 * around * (rows - 1) of them.
MeshShape blob(double radius, double waves, std::size_t around, std::size_t rows);

/// The bounding volumes with which a model of S can be made: all of doubles, two of floats, which
/// FCL's library does not have.
template <typename S>
std::vector<fcl::NODE_TYPE> modelTypes();

/// An `fcl::BVHModel`.
template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> makeModel(fcl::NODE_TYPE type, const MeshShape& shape);

/// A model as endModel() has not been called yet.
std::shared_ptr<fcl::CollisionGeometry<double>> makeUnfinishedModel(const MeshShape& shape);

/// A cloud of points.
std::shared_ptr<fcl::CollisionGeometry<double>> makeCloud(const MeshShape& shape);

/// Replaces the points of a model by move(point).
template <typename S>
void movePoints(fcl::CollisionGeometry<S>& model,
                const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& move);

/// The points and triangles of a model, to be read or broken.
template <typename S>
struct ModelArrays {
  fcl::Vector3<S>* points;
  fcl::Triangle* triangles;
  int triangle_count;
};
template <typename S>
ModelArrays<S> arraysOf(fcl::CollisionGeometry<S>& model);

}  // namespace fcl_fibers::test
