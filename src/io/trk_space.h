// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::io {

/// Where a voxel axis points to: right, front or up (0, 1, 2), or the opposite if the sign is -1.
struct VoxelAxis {
  std::size_t direction;
  int sign;
};
using VoxelAxes = std::array<VoxelAxis, 3>;
using Matrix3 = std::array<std::array<double, 3>, 3>;  ///< rows

/// Returns the axes that are named by three letters, for example LPS, unless two of them are along
/// the same line.
inline std::optional<VoxelAxes> namedAxes(std::string_view letters) {
  constexpr std::string_view kPositive = "RAS", kNegative = "LPI";
  if (letters.size() != 3) return std::nullopt;
  VoxelAxes axes{};
  std::array<bool, 3> is_taken{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t positive = kPositive.find(letters[i]);
    const std::size_t direction = std::min(positive, kNegative.find(letters[i]));
    if (direction >= 3 || is_taken[direction]) return std::nullopt;
    is_taken[direction] = true;
    axes[i] = {direction, positive == direction ? 1 : -1};
  }
  return axes;
}

inline Matrix3 cofactors(const Matrix3& m) {
  Matrix3 result;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto &next = m[(i + 1) % 3], &last = m[(i + 2) % 3];
    for (std::size_t k = 0; k < 3; ++k) {
      result[i][k] = next[(k + 1) % 3] * last[(k + 2) % 3] - next[(k + 2) % 3] * last[(k + 1) % 3];
    }
  }
  return result;
}

/// Returns the axes of a matrix, whose columns are the voxel axes in the world, unless they are
/// nearly in one plane. The nearest rotation or reflection decides, as in nibabel, so that a
/// sheared matrix has three different axes too.
inline std::optional<VoxelAxes> nearestAxes(Matrix3 m) {
  constexpr double kFlat = 1e-6;  // Entries are floats, which are exact to 6e-8.
  for (std::size_t k = 0; k < 3; ++k) {
    const double length = std::hypot(m[0][k], m[1][k], m[2][k]);
    if (length == 0) return std::nullopt;
    for (auto& row : m) row[k] /= length;
  }
  // Newton's iteration m = (m + inverse transpose of m) / 2 halves the singular values until they
  // are near 1, which takes 20 steps at most, and then squares their distance to 1.
  for (int step = 0; step < 30; ++step) {
    const Matrix3 c = cofactors(m);
    const double det = m[0][0] * c[0][0] + m[0][1] * c[0][1] + m[0][2] * c[0][2];
    if (!(std::abs(det) > kFlat)) return std::nullopt;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) m[i][k] = (m[i][k] + c[i][k] / det) / 2;
    }
  }
  VoxelAxes axes{};
  std::array<bool, 3> is_taken{};
  for (std::size_t k = 0; k < 3; ++k) {
    std::size_t direction = 3;
    for (std::size_t i = 0; i < 3; ++i) {
      if (is_taken[i]) continue;
      if (direction == 3 || std::abs(m[i][k]) > std::abs(m[direction][k])) direction = i;
    }
    is_taken[direction] = true;
    axes[k] = {direction, m[direction][k] < 0 ? -1 : 1};
  }
  return axes;
}

/// From a track's points, which are millimetres along the voxel axes from the corner of the first
/// voxel on, to the world's right, front and up.
struct TrkSpace {
  std::array<double, 3> voxel_size;
  std::array<double, 3> dimensions;  ///< in voxels
  Matrix3 to_world;                  ///< from voxels, of which whole numbers are centres
  std::array<double, 3> origin;

  // Voxel axis k of `to_world` is axis from[k] of the points, reversed if sign[k] is -1.
  std::array<std::size_t, 3> from = {0, 1, 2};
  std::array<int, 3> sign = {1, 1, 1};

  /// This is nibabel's rule, also where axes are exchanged: what another program would make of such
  /// a file is not known, and nibabel wrote most of them.
  void setAxes(const VoxelAxes& points, const VoxelAxes& world) {
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t other = 0; other < 3; ++other) {
        if (points[k].direction != world[other].direction) continue;
        from[k] = other;
        sign[k] = points[k].sign * world[other].sign;
      }
    }
  }

  Point toWorld(const Point& point) const {
    Point voxel{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double along = point[from[k]] / voxel_size[from[k]] - 0.5;
      voxel[k] = sign[k] < 0 ? dimensions[k] - 1 - along : along;
    }
    Point world{};
    for (std::size_t i = 0; i < 3; ++i) {
      world[i] = to_world[i][0] * voxel[0] + to_world[i][1] * voxel[1] + to_world[i][2] * voxel[2] +
                 origin[i];
    }
    return world;
  }
};

}  // namespace fcl_fibers::io
