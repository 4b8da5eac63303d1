// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include <fcl_fibers/tree_export.h>

#include "geometry/vec3.h"

namespace fcl_fibers::geometry {

/// Points of either scalar where a program has them: x, y and z of each, one after the other.
struct PointsOfProgram {
  const double* doubles = nullptr;
  const float* floats = nullptr;  ///< if `doubles` is null
  std::size_t count = 0;

  Vec3d operator[](std::size_t i) const {
    if (doubles != nullptr) return {doubles[3 * i], doubles[3 * i + 1], doubles[3 * i + 2]};
    return {double{floats[3 * i]}, double{floats[3 * i + 1]}, double{floats[3 * i + 2]}};
  }
};

/// A copy of points whose hull is a convex polytope, in its own axes. Points within the hull and
/// points that are equal do no harm, and all may be in one plane, on one line or in one place.
class PolytopeVertices {
 public:
  /// @pre there are points, all of them finite
  FCL_FIBERS_TREE_EXPORT explicit PolytopeVertices(const PointsOfProgram& points);

  /// Whether it is a copy of just these points.
  FCL_FIBERS_TREE_EXPORT bool isCopyOf(const PointsOfProgram& points) const;

  /// The largest magnitude on each axis.
  const Vec3d& largest() const { return largest_; }
  Vec3d operator[](std::size_t i) const {
    const Block& block = blocks_[i / kLanes];
    return {block.x[i % kLanes], block.y[i % kLanes], block.z[i % kLanes]};
  }
  std::size_t count() const { return count_; }
  std::size_t memoryUsage() const { return sizeof(*this) + blocks_.capacity() * sizeof(Block); }

  struct Extreme {
    double product;  ///< with the direction, as dot() rounds it
    std::size_t vertex;
  };
  /// The vertex that is furthest along a direction.
  Extreme furthest(const Vec3d& direction) const;

  static constexpr int kLanes = 8;
  struct alignas(64) Block {
    double x[kLanes], y[kLanes], z[kLanes];
  };

 private:
  std::vector<Block> blocks_;  ///< the last one is filled with its last point
  std::size_t count_;
  Vec3d largest_;
};

}  // namespace fcl_fibers::geometry
