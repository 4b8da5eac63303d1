// SPDX-License-Identifier: BSD-3-Clause
#include "index/moving_mesh.h"

#include <limits>
#include <vector>

#include "geometry/moving_box.h"
#include "index/mesh_query.h"
#include "index/pair_search.h"
#include "tree/search.h"

namespace fcl_fibers::index {

using geometry::Box;
using geometry::Impact;
using geometry::MovingSegment;
using geometry::MovingTriangle;
using geometry::Segment;
using geometry::Triangle;
using geometry::TriangleImpact;
using tree::Pair;
using tree::Visit;

namespace {

MeshTree treeOf(const MeshIndex& topology, const PosedTriangles& triangles,
                parallel::Executor* executor) {
  return topology.posedTree(triangles.mesh.points(), triangles.posing, executor);
}

bool rests(const PosedMesh& start, const PosedMesh& end) {
  return &start.mesh == &end.mesh && start.pose == end.pose;
}

Segment boxOf(const Triangle& t) {
  return Segment::box(min(min(t.a, t.b), t.c), max(max(t.a, t.b), t.c));
}

Box boxOf(const Segment& segment, double growth) {
  return segment.isBox() || isBounded(segment) ? Box::around(segment, growth) : Box::unbounded();
}

/// Collects the numbers of triangles.
struct Near final : PairSink {
  Visit take(const Pair* pairs, std::size_t count) override {
    for (std::size_t i = 0; i < count; ++i) found.push_back(pairs[i].a);
    return Visit::kContinue;
  }
  std::vector<TriangleId> found;
};

}  // namespace

MovingMesh::MovingMesh(const PosedMesh& start, const PosedMesh& end, const geometry::Frame& frame,
                       parallel::Executor* executor)
    : start_(start),
      end_(end),
      frame_(frame),
      at_start_(start_, frame),
      at_end_(end_, frame),
      start_tree_(treeOf(end_.mesh, at_start_, executor)),
      end_tree_(rests(start, end) ? std::nullopt
                                  : std::optional(treeOf(end_.mesh, at_end_, executor))) {}

std::size_t MovingMesh::memoryUsage() const {
  return sizeof(MovingMesh) + start_tree_.memoryUsage() +
         (end_tree_ ? end_tree_->memoryUsage() : 0);
}

bool findImpact(const MovingSegment& segment, const MovingTriangle& triangle, double margin,
                double error, Impact& impact) {
  if (isBox(segment)) {
    return geometry::findImpact(segment, {boxOf(triangle.start), boxOf(triangle.end)}, margin,
                                error, 0, impact);
  }
  TriangleImpact found;
  if (!geometry::findImpact(segment, triangle, margin, error, 0, found)) return false;
  impact = {found.time, found.s, 0};
  return true;
}

bool findImpact(const MovingMesh& mesh, const MovingSegment& segment, double margin, double error,
                MeshImpact& impact) {
  if (mesh.empty()) return false;
  margin += mesh.margin() * mesh.frame().scale;
  error += mesh.error();
  Near near;
  SerialBuffer buffer(nullptr, near);
  const double growth = std::max(margin, 0.0) + error;
  const geometry::MovingBox box{boxOf(segment.start, growth), boxOf(segment.end, growth)};
  visitOverlaps(mesh.tree(), box, 0, tree::kNoGroup, buffer);
  buffer.full();
  impact = {std::numeric_limits<double>::infinity(), -1};
  for (const TriangleId id : near.found) {
    Impact found;
    if (findImpact(segment, mesh[id], margin, error, found) &&
        (found.time < impact.time || (found.time == impact.time && id < impact.triangle))) {
      impact = {found.time, id};
    }
  }
  // What is inside a solid at the start touches it, although it may touch no triangle.
  const Segment& first = segment.start;
  if (mesh.end().is_solid && impact.time > 0 && isBounded(first)) {
    const geometry::Vec3d point = first.isBox() ? midpoint(first) : first.a;
    if (const MeshQuery query(mesh.trianglesAtStart()); query.isInside(point)) {
      constexpr double kAny = std::numeric_limits<double>::max();
      const Segment axis = first.isBox() ? Segment{point, point, 0} : first;
      impact = {0, query.nearest(axis, kAny).triangle};
    }
  }
  return impact.triangle >= 0;
}

}  // namespace fcl_fibers::index
