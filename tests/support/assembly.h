// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "support/touch_oracle.h"

namespace fcl_fibers::test {

/// Fibers as plain arrays, and their owner. Capsules are counted along the fibers, from 0.
template <typename S>
struct Assembly {
  using Point = std::array<double, 3>;
  using Radii = typename FiberArrays<S>::Radii;

  std::vector<S> points;  ///< x, y, z
  std::vector<std::size_t> point_begin = {0};
  std::vector<S> radii;
  Radii radii_are = Radii::kPerFirstPoint;

  void addPoint(const Point& p, double radius) {
    for (const double x : p) points.push_back(static_cast<S>(x));
    radii.push_back(static_cast<S>(radius));
  }
  void endFiber() { point_begin.push_back(points.size() / 3); }
  void addFiber(const std::vector<Point>& fiber, double radius) {
    for (const Point& p : fiber) addPoint(p, radius);
    endFiber();
  }
  void addCapsule(const Point& a, const Point& b, double radius) { addFiber({a, b}, radius); }
  /// @pre radii are those of points
  void addCone(const Point& a, const Point& b, double at_a, double at_b) {
    addPoint(a, at_a);
    addPoint(b, at_b);
    endFiber();
  }
  void addBall(const Point& center, double radius) { addCapsule(center, center, radius); }

  std::size_t pointCount() const { return point_begin.back(); }
  std::size_t fiberCount() const { return point_begin.size() - 1; }
  std::size_t fiberOf(std::size_t point) const {
    return static_cast<std::size_t>(
        std::upper_bound(point_begin.begin(), point_begin.end(), point) - point_begin.begin() - 1);
  }
  Point point(std::size_t i) const {
    return {static_cast<double>(points[3 * i]), static_cast<double>(points[3 * i + 1]),
            static_cast<double>(points[3 * i + 2])};
  }
  bool startsCapsule(std::size_t point) const {
    return point < pointCount() && point + 1 < point_begin[fiberOf(point) + 1];
  }
  /// That starts at this point.
  GivenCapsule capsule(std::size_t point) const {
    const std::size_t i = radii_are == Radii::kOne        ? 0
                          : radii_are == Radii::kPerFiber ? fiberOf(point)
                                                          : point;
    GivenCapsule capsule{this->point(point), this->point(point + 1), static_cast<double>(radii[i])};
    if (radii_are == Radii::kPerPoint) {
      capsule.radius_of_second = static_cast<double>(radii[point + 1]);
    }
    return capsule;
  }

  FiberArrays<S> view() const {
    return {points.data(), pointCount(), point_begin.data(), fiberCount(), radii.data(), radii_are};
  }

  /// Calls visit(fiber, first point) for every capsule.
  template <class Visit>
  void visitCapsules(Visit&& visit) const {
    for (std::size_t f = 0; f < fiberCount(); ++f) {
      for (std::size_t i = point_begin[f]; i + 1 < point_begin[f + 1]; ++i) visit(f, i);
    }
  }
  std::vector<GivenCapsule> capsules() const {
    std::vector<GivenCapsule> capsules;
    visitCapsules([&](std::size_t, std::size_t i) { capsules.push_back(capsule(i)); });
    return capsules;
  }
};

/// Two capsules by their numbers.
struct NumberPair {
  std::int32_t a, b;
  bool operator==(const NumberPair& other) const { return a == other.a && b == other.b; }
  bool operator<(const NumberPair& other) const { return a != other.a ? a < other.a : b < other.b; }
};

}  // namespace fcl_fibers::test
