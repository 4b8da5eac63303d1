// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include <fcl_fibers/triangle_mesh.h>

#include "numerics/row_judge.h"
#include "support/least_of_convex.h"
#include "support/mesh_models.h"

namespace fcl_fibers::test {

/// A mesh about the middle of a row, by parts of half the row's extent. Its numbers are those of
/// the fibers, so that what is flushed to zero of the one is of the other.
template <typename S>
class MeshInRow {
 public:
  MeshInRow(const Judge<S>& judge, const std::vector<Point>& parts,
            std::vector<std::int32_t> triangles)
      : triangles_(std::move(triangles)) {
    for (const Point& part : parts) {
      const Point p = judge.middle + judge.half.maxCoeff() * part;
      for (int axis = 0; axis < 3; ++axis) {
        numbers_.push_back(static_cast<S>(p[axis]));
        largest_ = std::max(largest_, std::fabs(p[axis]));
      }
    }
  }

  std::size_t count() const { return triangles_.size() / 3; }
  /// For a model of FCL.
  MeshShape shape() const {
    MeshShape shape;
    for (std::size_t i = 0; i < numbers_.size(); i += 3) {
      shape.points.emplace_back(numbers_[i], numbers_[i + 1], numbers_[i + 2]);
    }
    for (std::size_t i = 0; i < triangles_.size(); i += 3) {
      const auto at = [&](std::size_t k) { return static_cast<std::size_t>(triangles_[i + k]); };
      shape.triangles.push_back({at(0), at(1), at(2)});
    }
    return shape;
  }
  TriangleMesh mesh(TriangleMesh::Kind kind) const {
    return TriangleMesh(
        MeshArrays<S>{numbers_.data(), numbers_.size() / 3, triangles_.data(), count()}, kind);
  }
  Point corner(std::size_t triangle, std::size_t k) const {
    const S* const p = &numbers_[3 * static_cast<std::size_t>(triangles_[3 * triangle + k])];
    return {p[0], p[1], p[2]};
  }
  ExactTriangle operator[](std::size_t i) const {
    return {corner(i, 0), corner(i, 1), corner(i, 2)};
  }
  /// By which a distance to a triangle may be beyond contact: 1e-14 of the sizes, 1e-11 at a
  /// needle, and the coordinates, which posing rounds.
  Real excess(std::size_t i, Real sizes, Real least) const {
    return (isNeedle(i) ? 1e-11L : 1e-14L) * (sizes + lengthsOf(i)) + 64 * kEps * largest_ + least;
  }
  /// The error of the judge, which has to be far less.
  Real judging(std::size_t i, Real sizes) const { return excess(i, sizes, 0) * 0x1p-12L; }

 private:
  Real lengthsOf(std::size_t i) const {
    return (corner(i, 1) - corner(i, 0)).norm() + (corner(i, 2) - corner(i, 0)).norm();
  }
  bool isNeedle(std::size_t i) const {
    return (corner(i, 2) - corner(i, 1)).norm() < 0x1p-10L * lengthsOf(i);
  }

  std::vector<S> numbers_;
  std::vector<std::int32_t> triangles_;
  Real largest_ = 0;
};

/// Three triangles through the middle of a row, of which the last one is a needle.
template <typename S>
MeshInRow<S> trianglesIn(const Judge<S>& judge) {
  return {judge,
          {{-1, -0.5L, 0.1L},
           {1, -0.4L, -0.1L},
           {0.1L, 0.9L, 0.2L},
           {-0.3L, 0, -1},
           {0.2L, -0.1L, 1},
           {0, 0.5L, 0.1L},
           {-1, -1, -1},
           {1, 1, 1},
           {1 + 0x1p-20L, 1 - 0x1p-20L, 1}},
          {0, 1, 2, 3, 4, 5, 6, 7, 8}};
}

/// A solid around the middle of a row.
template <typename S>
MeshInRow<S> tetrahedronIn(const Judge<S>& judge) {
  return {judge,
          {{0.5L, 0.5L, 0.5L}, {-0.5L, -0.5L, 0.5L}, {-0.5L, 0.5L, -0.5L}, {0.5L, -0.5L, -0.5L}},
          {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}};
}

/// Distance of the axis and a triangle; of a cone that of its surface, and the larger radius.
inline Real axisDistance(const ExactCapsule& capsule, const ExactTriangle& triangle) {
  if (capsule.taper == 0) return segmentTriangleDistance(capsule.a, capsule.b, triangle);
  const Real distance = leastOfConvex([&](Real s) {
    const Point center = capsule.a + s * (capsule.b - capsule.a);
    return segmentTriangleDistance(center, center, triangle) - capsule.radiusAt(s);
  });
  return distance + capsule.radius;
}

/// That these are the triangles that a segment touches, up to what is too near to contact to tell.
/// A segment inside a solid is found with the nearest one.
template <typename S>
void expectTouching(const Judge<S>& judge, std::size_t i, const MeshInRow<S>& shape, bool is_solid,
                    const std::set<std::pair<std::size_t, std::size_t>>& found) {
  const ExactCapsule& capsule = judge.exact[i];
  const Real reach = capsule.radius + judge.row.margin;
  bool is_inside = is_solid, is_met = false;
  for (std::size_t t = 0; t < shape.count(); ++t) {
    const ExactTriangle triangle = shape[t];
    const Point normal = (triangle.b - triangle.a).cross(triangle.c - triangle.a);
    is_inside = is_inside && normal.dot(capsule.a - triangle.a) <= 0;
  }
  for (std::size_t t = 0; t < shape.count(); ++t) {
    const Real distance = axisDistance(capsule, shape[t]);
    // Radii at the ends of a cone are rounded as lengths are.
    const Real sizes = distance + judge.lengthOf(i) + (capsule.taper == 0 ? 0 : capsule.radius);
    const bool is_found = found.count({i, t}) != 0;
    is_met = is_met || is_found;
    if (distance + shape.judging(t, sizes) <= reach || distance == 0) {
      EXPECT_TRUE(is_found) << "missed " << i << ", " << t;
    }
    if (is_found && !is_inside && !judge.vanishes()) {
      EXPECT_LE(distance, reach + shape.excess(t, sizes, judge.least)) << i << ", " << t;
    }
  }
  EXPECT_TRUE(is_met || !is_inside) << "missed inside " << i;
}

}  // namespace fcl_fibers::test
