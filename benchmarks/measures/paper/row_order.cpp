// SPDX-License-Identifier: BSD-3-Clause
#include "measures/paper/row_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace fcl_fibers::benchmarks {

std::vector<std::size_t> rowsOfRoots(const FiberPolylines& scene) {
  const std::size_t count = scene.fiberCount();
  const auto root = [&](std::size_t f) { return scene.points[scene.point_begin[f]]; };
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::array<double, 3> low = {kInfinity, kInfinity, kInfinity}, extent = {};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double high = -kInfinity;
    for (std::size_t f = 0; f < count; ++f) {
      low[axis] = std::min(low[axis], root(f)[axis]);
      high = std::max(high, root(f)[axis]);
    }
    extent[axis] = high - low[axis];
  }
  // Rows follow each other along the longest side of the box around all roots, and run along the
  // second.
  std::array<std::size_t, 3> axes = {0, 1, 2};
  std::sort(axes.begin(), axes.end(),
            [&](std::size_t a, std::size_t b) { return extent[a] > extent[b]; });
  const double rows = std::floor(std::sqrt(static_cast<double>(count)));
  std::vector<std::pair<double, double>> places(count);
  for (std::size_t f = 0; f < count; ++f) {
    const double across = (root(f)[axes[0]] - low[axes[0]]) / std::max(extent[axes[0]], 1e-300);
    const double row = std::min(std::floor(across * rows), rows - 1);
    const double along = root(f)[axes[1]];
    places[f] = {row, std::fmod(row, 2) == 0 ? along : -along};
  }
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return places[a] < places[b]; });
  return order;
}

FiberPolylines reordered(const FiberPolylines& scene, const std::vector<std::size_t>& order) {
  FiberPolylines result;
  result.radius = scene.radius;
  for (const std::size_t f : order) {
    for (std::size_t i = scene.point_begin[f]; i < scene.point_begin[f + 1]; ++i) {
      result.points.push_back(scene.points[i]);
      if (!scene.radii.empty()) result.radii.push_back(scene.radii[i]);
    }
    result.point_begin.push_back(result.points.size());
    if (!scene.closed.empty()) result.closed.push_back(scene.closed[f]);
  }
  return result;
}

}  // namespace fcl_fibers::benchmarks
