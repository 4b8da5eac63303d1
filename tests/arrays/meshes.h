// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include <fcl_fibers/triangle_mesh.h>

#include "support/exact_geometry.h"
#include "support/random.h"

namespace fcl_fibers::test {

/// A mesh as a program keeps it.
template <typename S>
struct Triangles {
  std::vector<S> points;
  std::vector<std::int32_t> indices;

  std::size_t pointCount() const { return points.size() / 3; }
  std::size_t count() const { return indices.size() / 3; }
  MeshArrays<S> view() const { return {points.data(), pointCount(), indices.data(), count()}; }

  std::int32_t addPoint(const Eigen::Vector3d& p) {
    for (int k = 0; k < 3; ++k) points.push_back(static_cast<S>(p[k]));
    return static_cast<std::int32_t>(pointCount() - 1);
  }
  void addTriangle(std::int32_t a, std::int32_t b, std::int32_t c) {
    indices.insert(indices.end(), {a, b, c});
  }
  test::Point point(std::int32_t i) const {
    const auto k = 3 * static_cast<std::size_t>(i);
    return {static_cast<Real>(points[k]), static_cast<Real>(points[k + 1]),
            static_cast<Real>(points[k + 2])};
  }

  /// A triangle at its place.
  ExactTriangle triangle(std::size_t i, const MeshPose& pose) const {
    Eigen::Matrix<Real, 3, 3> rotation;
    test::Point position;
    for (int row = 0; row < 3; ++row) {
      const auto k = static_cast<std::size_t>(row);
      for (int column = 0; column < 3; ++column) {
        rotation(row, column) = pose.rotation[3 * k + static_cast<std::size_t>(column)];
      }
      position[row] = pose.position[k];
    }
    const auto posed = [&](std::size_t corner) -> test::Point {
      return rotation * point(indices[3 * i + corner]) + position;
    };
    return {posed(0), posed(1), posed(2)};
  }
};

/// Triangles anywhere in a cube; some are needles, some points.
template <typename S>
Triangles<S> soup(std::uint64_t seed, int count, double half_side) {
  Random random(seed);
  Triangles<S> mesh;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d a = random.inCube(half_side);
    const Eigen::Vector3d b = i % 11 == 0 ? a : Eigen::Vector3d(a + random.inCube(0.1));
    const Eigen::Vector3d c =
        i % 13 == 0 ? Eigen::Vector3d(0.5 * a + 0.5 * b) : Eigen::Vector3d(a + random.inCube(0.1));
    const std::int32_t first = mesh.addPoint(a);
    mesh.addPoint(b);
    mesh.addPoint(c);
    mesh.addTriangle(first, first + 1, first + 2);
  }
  return mesh;
}

/// A closed ball about the origin, bumpy, with its normals outward: rings between two poles.
template <typename S>
Triangles<S> ball(double radius, int rings, int sectors) {
  constexpr double kPi = 3.141592653589793;
  Triangles<S> mesh;
  const auto at = [&](double polar, double turn) -> Eigen::Vector3d {
    const double r = radius * (1 + 0.05 * std::sin(5 * turn) * std::sin(polar));
    return r * Eigen::Vector3d(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn),
                               std::cos(polar));
  };
  const std::int32_t top = mesh.addPoint(at(0, 0)), bottom = mesh.addPoint(at(kPi, 0));
  for (int i = 1; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) mesh.addPoint(at(kPi * i / rings, 2 * kPi * j / sectors));
  }
  const auto id = [&](int ring, int sector) {
    return ring == 0 ? top : ring == rings ? bottom : 2 + (ring - 1) * sectors + sector % sectors;
  };
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      if (i > 0) mesh.addTriangle(id(i, j), id(i + 1, j), id(i, j + 1));
      if (i + 1 < rings) mesh.addTriangle(id(i, j + 1), id(i + 1, j), id(i + 1, j + 1));
    }
  }
  return mesh;
}

/// The closed box between two corners.
inline Triangles<double> boxMesh(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  Triangles<double> mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.addPoint({(i & 1 ? high : low).x(), (i & 2 ? high : low).y(), (i & 4 ? high : low).z()});
  }
  mesh.indices = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                  2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  return mesh;
}

inline MeshPose poseOf(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& position) {
  MeshPose pose;
  for (std::size_t row = 0; row < 3; ++row) {
    const auto r = static_cast<Eigen::Index>(row);
    for (std::size_t column = 0; column < 3; ++column) {
      pose.rotation[3 * row + column] = rotation(r, static_cast<Eigen::Index>(column));
    }
    pose.position[row] = position[r];
  }
  return pose;
}

inline MeshPose randomPose(std::uint64_t seed, double away) {
  Random random(seed);
  const Eigen::Matrix3d rotation = random.rotation().toRotationMatrix();
  return poseOf(rotation, random.inCube(away));
}

}  // namespace fcl_fibers::test
