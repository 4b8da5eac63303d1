// SPDX-License-Identifier: BSD-3-Clause
#include "tools/trade/coarser.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "tools/bounds.h"
#include "tools/trade/distances.h"

namespace fcl_fibers::tools::trade {
namespace {

double distance(const Point& p, const Point& q) {
  return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
}

Axis axisOf(const Point& p, const Point& q) { return {{p[0], p[1], p[2]}, {q[0], q[1], q[2]}, 0}; }

}  // namespace

CoarserFibers everyNth(const FiberPolylines& fibers, std::size_t n) {
  CoarserFibers coarser;
  coarser.error = 0;
  coarser.segment_of.resize(fibers.points.size());
  FiberPolylines& kept = coarser.fibers;
  kept.radius = fibers.radius;
  kept.radii_are = fibers.radii_are;
  kept.closed = fibers.closed;
  kept.starts_at = fibers.starts_at;
  kept.ends_at = fibers.ends_at;
  std::vector<bool> is_joint(fibers.points.size());
  for (const auto* at : {&fibers.starts_at, &fibers.ends_at}) {
    for (const std::int32_t i : *at) {
      if (i >= 0) is_joint[static_cast<std::size_t>(i)] = true;
    }
  }
  std::vector<std::int32_t> number_of(fibers.points.size());  // of those that are kept
  const auto keep = [&](std::size_t i, double radius) {
    number_of[i] = static_cast<std::int32_t>(kept.points.size());
    kept.points.push_back(fibers.points[i]);
    if (fibers.radii.empty()) return;
    kept.radii.push_back(fibers.hasRadiiOfPoints() ? fibers.radii[i] : radius);
  };
  for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
    const std::size_t begin = fibers.point_begin[f], end = fibers.point_begin[f + 1];
    double radius = 0;
    for (std::size_t from = begin; from + 1 < end;) {
      std::size_t to = from + 1;
      while (to < from + n && to + 1 < end && !is_joint[to]) ++to;
      radius = fibers.radiusAt(from);
      for (std::size_t i = from; i < to; ++i) radius = std::max(radius, fibers.radiusAt(i));
      keep(from, radius);
      Axis axis = axisOf(fibers.points[from], fibers.points[to]);
      if (fibers.hasRadiiOfPoints()) {
        axis.radius = fibers.radii[from];
        axis.taper = fibers.radii[to] - axis.radius;
      }
      for (std::size_t i = from; i < to; ++i) {
        coarser.segment_of[i] = number_of[from];
        const double own = fibers.hasRadiiOfPoints() ? fibers.radii[i] : 0;
        const Gap gap = gapOf(axis, axisOf(fibers.points[i], fibers.points[i]));
        coarser.error = std::max(coarser.error, static_cast<double>(gap.gap) + own);
      }
      from = to;
    }
    if (end > begin) keep(end - 1, radius);
    kept.point_begin.push_back(kept.points.size());
  }
  for (auto* at : {&kept.starts_at, &kept.ends_at}) {
    for (std::int32_t& i : *at) {
      if (i >= 0) i = number_of[static_cast<std::size_t>(i)];
    }
  }
  return coarser;
}

CoarserMesh clusterPoints(const MeshFile& mesh, double edges) {
  const auto at = [&](std::size_t corner) {
    return mesh.points[static_cast<std::size_t>(mesh.triangles[corner])];
  };
  double sum = 0;
  Bounds bounds;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      sum += distance(at(t + k), at(t + (k + 1) % 3));
      bounds.add(at(t + k));
    }
  }
  const double cell = edges * sum / static_cast<double>(mesh.triangles.size());

  // By cell: its number, and the sum of its points.
  struct Cluster {
    std::int32_t number;
    Point sum{};
    double count = 0;
  };
  std::map<std::array<std::int64_t, 3>, Cluster> clusters;
  std::vector<Cluster*> cluster_of(mesh.points.size(), nullptr);
  for (const std::int32_t corner : mesh.triangles) {
    const auto i = static_cast<std::size_t>(corner);
    if (cluster_of[i] != nullptr) continue;
    std::array<std::int64_t, 3> key{};
    for (std::size_t k = 0; k < 3 && cell > 0; ++k) {
      key[k] = static_cast<std::int64_t>((mesh.points[i][k] - bounds.low[k]) / cell);
    }
    Cluster& cluster =
        clusters.try_emplace(key, Cluster{static_cast<std::int32_t>(clusters.size())})
            .first->second;
    for (std::size_t k = 0; k < 3; ++k) cluster.sum[k] += mesh.points[i][k];
    ++cluster.count;
    cluster_of[i] = &cluster;
  }
  std::vector<Point> points(clusters.size());
  for (const auto& [key, cluster] : clusters) {
    for (std::size_t k = 0; k < 3; ++k) {
      points[static_cast<std::size_t>(cluster.number)][k] = cluster.sum[k] / cluster.count;
    }
  }
  double error = 0;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (cluster_of[i] == nullptr) continue;
    const auto number = static_cast<std::size_t>(cluster_of[i]->number);
    error = std::max(error, distance(mesh.points[i], points[number]));
  }

  // The corners of each triangle in order, so that those of equal ones are equal.
  std::set<std::array<std::int32_t, 3>> whole, collapsed;
  std::set<std::pair<std::int32_t, std::int32_t>> seen;
  std::vector<std::int32_t> triangles;
  const auto add = [&](const std::array<std::int32_t, 3>& corners) {
    triangles.insert(triangles.end(), corners.begin(), corners.end());
    for (std::size_t k = 0; k < 3; ++k) {
      seen.insert(std::minmax(corners[k], corners[(k + 1) % 3]));
      seen.emplace(corners[k], corners[k]);
    }
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    std::array<std::int32_t, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = cluster_of[static_cast<std::size_t>(mesh.triangles[t + k])]->number;
    }
    std::array<std::int32_t, 3> sorted = corners;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
      collapsed.insert(sorted);
    } else if (whole.insert(sorted).second) {
      add(corners);
    }
  }
  for (const auto& corners : collapsed) {
    if (seen.count({corners[0], corners[2]}) == 0) add(corners);
  }
  const MeshArrays<double> arrays{points.front().data(), points.size(), triangles.data(),
                                  triangles.size() / 3};
  return {{mesh.name, points, triangles, TriangleMesh(arrays)}, error};
}

}  // namespace fcl_fibers::tools::trade
