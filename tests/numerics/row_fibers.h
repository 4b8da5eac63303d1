// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "support/assembly.h"
#include "support/random.h"

/// Fibers that rows of capsules and those of cones are made of.
namespace fcl_fibers::test::row_fibers {

using Point = std::array<double, 3>;

inline Point operator+(const Point& p, const Point& q) {
  return {p[0] + q[0], p[1] + q[1], p[2] + q[2]};
}
inline Point operator*(double s, const Point& p) { return {s * p[0], s * p[1], s * p[2]}; }
inline Point toPoint(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

/// A lock of hair about 50 radii across, at `origin` and `scale` times as large: 20 fibers of 15
/// segments that wander side by side. Many segments touch others.
template <typename S>
Assembly<S> lock(const Point& origin, double scale, double radius, std::uint64_t seed) {
  Random random(seed);
  Assembly<S> fibers;
  for (int f = 0; f < 20; ++f) {
    Point p = 25 * radius * toPoint(random.inCube(1));
    Point along = {0, 0, 10 * radius};
    for (int i = 0; i <= 15; ++i) {
      fibers.addPoint(origin + scale * p, scale * radius);
      along = along + 4 * radius * toPoint(random.inCube(1));
      p = p + along;
    }
    fibers.endFiber();
  }
  return fibers;
}

/// Capsules of all directions in a cube.
template <typename S>
Assembly<S> soup(int count, double length, double radius, double side, std::uint64_t seed) {
  Random random(seed);
  Assembly<S> fibers;
  for (int i = 0; i < count; ++i) {
    const Point a = toPoint(random.inCube(side / 2));
    fibers.addCapsule(a, a + length * toPoint(random.direction()), radius);
  }
  return fibers;
}

/// A walk over points with whole coordinates, in units of `unit`; radii are whole as well. Contact
/// is often exact, and segments coincide.
template <typename S>
Assembly<S> lattice(double unit, std::uint64_t seed, const Point& origin = {0, 0, 0}) {
  Random random(seed);
  Assembly<S> fibers;
  for (int f = 0; f < 12; ++f) {
    Point p = {0, 0, 0};
    for (int i = 0; i <= 12; ++i) {
      fibers.addPoint(origin + unit * p, unit * static_cast<double>(random.below(3)));
      for (double& x : p) x += 4 * (static_cast<double>(random.below(5)) - 2);
    }
    fibers.endFiber();
  }
  return fibers;
}

/// The fibers of several assemblies.
template <typename S>
Assembly<S> together(const std::vector<Assembly<S>>& parts) {
  Assembly<S> all;
  all.radii_are = parts.front().radii_are;
  for (const Assembly<S>& part : parts) {
    const std::size_t first = all.pointCount();
    all.points.insert(all.points.end(), part.points.begin(), part.points.end());
    all.radii.insert(all.radii.end(), part.radii.begin(), part.radii.end());
    for (std::size_t f = 1; f <= part.fiberCount(); ++f) {
      all.point_begin.push_back(first + part.point_begin[f]);
    }
  }
  return all;
}

template <typename S>
S neighbor(S x, int ulps) {
  for (; ulps > 0; --ulps) x = std::nextafter(x, std::numeric_limits<S>::infinity());
  for (; ulps < 0; ++ulps) x = std::nextafter(x, -std::numeric_limits<S>::infinity());
  return x;
}

/// Pairs that cross at angles of 10^-k, at no distance, at that of contact, and beyond.
template <typename S>
Assembly<S> crossings() {
  Assembly<S> fibers;
  for (int k = 0; k <= 12; ++k) {
    const double tilt = std::pow(10.0, -k);
    for (int i = 0; i < 6; ++i) {
      // Small numbers along y, where they stay exact.
      const double z = 8.0 * (6 * k + i), radius = i < 3 ? 0 : 0x1p-8;
      const double gap = i % 3 == 0 ? 0 : i % 3 == 1 ? 2 * radius : 2.25 * radius + 0x1p-12;
      fibers.addCapsule({-1, -tilt / 2, z}, {1, tilt / 2, z}, radius);
      fibers.addCapsule({-1, tilt / 2, z + gap}, {1, -tilt / 2, z + gap}, radius);
    }
  }
  return fibers;
}

/// Capsules along one direction, `sense` +1 or -1 in turn where it is -1; `spread` apart across.
template <typename S>
Assembly<S> alongOneDirection(const Point& direction, int sense, double spread, double radius,
                              std::uint64_t seed) {
  Random random(seed);
  Assembly<S> fibers;
  for (int i = 0; i < 200; ++i) {
    // Whole numbers: parallel to the last bit in float as well.
    Point a = static_cast<double>(random.below(64)) * direction;
    a = a + Point{spread * static_cast<double>(random.below(8)),
                  spread * static_cast<double>(random.below(8)), 0};
    const double length = static_cast<double>(random.below(8));
    fibers.addCapsule(a, a + (i % 2 == 0 ? 1 : sense) * length * direction, radius);
  }
  return fibers;
}

template <typename S>
Assembly<S> identical(int count) {
  Assembly<S> fibers;
  for (int i = 0; i < count; ++i) {
    if (i % 2 == 0) {
      fibers.addCapsule({0.1, 0.2, 0.3}, {0.4, 0.6, 0.9}, i % 3 * 1e-3);
    } else {
      fibers.addCapsule({0.4, 0.6, 0.9}, {0.1, 0.2, 0.3}, i % 3 * 1e-3);
    }
  }
  return fibers;
}

}  // namespace fcl_fibers::test::row_fibers
