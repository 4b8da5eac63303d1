// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <type_traits>
#include <variant>
#include <vector>

#include <fcl_fibers/shapes.h>

#include "support/exact_geometry.h"
#include "support/random.h"

// Shapes for tests of FiberTree, and how far they are from a segment.
namespace fcl_fibers::test {

inline test::Point toPoint(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
inline std::array<double, 3> coordinatesOf(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

inline MeshPose poseOf(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& position) {
  MeshPose pose;
  const Eigen::Matrix3d r = rotation.toRotationMatrix();
  for (Eigen::Index k = 0; k < 9; ++k) pose.rotation[static_cast<std::size_t>(k)] = r(k / 3, k % 3);
  pose.position = coordinatesOf(position);
  return pose;
}

/// The distance of an axis and a shape, less the radius of the shape; 0 if the axis is in it.
inline Real axisDistance(const test::Point& a, const test::Point& b, const Shape& shape) {
  const auto capsule = [&](const auto& from, const auto& to, double radius) -> Real {
    return segmentDistance(a, b, toPoint(from), toPoint(to)) - Real(radius);
  };
  const auto heights = [&](const auto& flat) {
    const test::Point n = toPoint(flat.normal);
    return std::minmax(
        {(n.dot(a) - Real(flat.offset)) / n.norm(), (n.dot(b) - Real(flat.offset)) / n.norm()});
  };
  return std::visit(
      [&](const auto& s) -> Real {
        using T = std::decay_t<decltype(s)>;
        if constexpr (std::is_same_v<T, CapsuleShape>) {
          return capsule(s.start, s.end, s.radius);
        } else if constexpr (std::is_same_v<T, SphereShape>) {
          return capsule(s.center, s.center, s.radius);
        } else if constexpr (std::is_same_v<T, BoxShape>) {
          Eigen::Matrix<Real, 3, 3> r;
          for (Eigen::Index k = 0; k < 9; ++k) {
            r(k / 3, k % 3) = s.pose.rotation[static_cast<std::size_t>(k)];
          }
          const Eigen::Matrix<Real, 3, 3> back = r.inverse();
          const test::Point p = back * (a - toPoint(s.pose.position)),
                            q = back * (b - toPoint(s.pose.position));
          return segmentBoxDistance(p, q, {toPoint(s.low), toPoint(s.high)});
        } else if constexpr (std::is_same_v<T, HalfSpaceShape>) {
          const auto [low, high] = heights(s);
          return std::max(low, Real(0));
        } else {
          const auto [low, high] = heights(s);
          return std::max({low, -high, Real(0)});
        }
      },
      shape);
}

/// A shape of each type about the origin, the box flat at times and turned at others.
inline std::vector<Shape> randomShapes(Random& random) {
  const Eigen::Vector3d p = random.inCube(0.5), q = random.inCube(0.5), n = random.direction();
  Eigen::Vector3d low = p.cwiseMin(q), high = p.cwiseMax(q);
  if (random.below(3) == 0) low.y() = high.y();
  BoxShape box{coordinatesOf(low), coordinatesOf(high)};
  if (random.below(3) != 0) box.pose = poseOf(random.rotation(), random.inCube(0.2));
  const double radius = 0.2 * random.unit(), height = random.between(-0.4, 0.4);
  return {CapsuleShape{coordinatesOf(p), coordinatesOf(q), radius},
          SphereShape{coordinatesOf(p), radius}, box, HalfSpaceShape{coordinatesOf(n), height},
          PlaneShape{coordinatesOf(-3 * n), 3 * height}};
}

}  // namespace fcl_fibers::test
