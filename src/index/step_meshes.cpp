// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iterator>
#include <limits>
#include <type_traits>
#include <variant>
#include <vector>

#include "geometry/triangle_impact.h"
#include "index/mesh_query.h"
#include "index/posed_triangles.h"
#include "index/segment_marks.h"
#include "index/step.h"
#include "index/tree_search.h"
#include "tree/moving_search.h"

namespace fcl_fibers::index {

using geometry::Impact;
using geometry::MovingSegment;
using geometry::MovingTriangle;
using geometry::Segment;
using geometry::Triangle;
using geometry::TriangleImpact;
using tree::MovingTree;
using tree::Pair;
using tree::Visit;

namespace {

Segment boxOf(const Triangle& t) {
  return Segment::box(min(min(t.a, t.b), t.c), max(max(t.a, t.b), t.c));
}

bool findFirst(const MovingSegment& segment, const MovingTriangle& triangle, double margin,
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

/// A margin that is less at the start or at the end counts as the larger one.
double marginOf(const PosedMesh& start, const PosedMesh& end) {
  return std::max(start.margin, end.margin);
}

bool rests(const PosedMesh& start, const PosedMesh& end) {
  return &start.mesh == &end.mesh && start.pose == end.pose;
}

/// Keeps the pairs of a segment and a triangle that touch during a step, and finds when.
class MeshImpactFilter final : public PairFilter {
 public:
  /// @param inside  segments whose pairs are left out
  MeshImpactFilter(const MovingRange& segments, const PosedTriangles& start,
                   const PosedTriangles& end, double margin, const SegmentMarks& inside)
      : segments_(segments), start_(start), end_(end), margin_(margin), inside_(inside) {}

  std::size_t keep(Pair* pairs, std::size_t count, std::vector<Impact>& impacts) const override {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      Impact impact;
      if (inside_.has(pairs[i].a) || !find(pairs[i], impact)) continue;
      impacts.push_back(impact);
      pairs[kept++] = pairs[i];
    }
    return kept;
  }

 private:
  bool find(const Pair& pair, Impact& impact) const {
    const MovingSegment segment = segments_[pair.a];
    const MovingTriangle triangle{start_[pair.b], end_[pair.b]};
    const double error = endPointError(segment) + std::max(start_.error, end_.error);
    return findFirst(segment, triangle, margin_, error, impact);
  }

  const MovingRange segments_;
  const PosedTriangles &start_, &end_;
  const double margin_;
  const SegmentMarks& inside_;
};

}  // namespace

/// Hands on each segment that is wholly inside a solid at the start, with its nearest triangle.
Visit Step::searchInside(const PosedMesh& start, SegmentMarks& inside, PairSink& sink) const {
  struct Collect final : PairSink {
    Visit take(const Pair* pairs, std::size_t count) override {
      std::copy_if(pairs, pairs + count, std::back_inserter(found),
                   [](const Pair& pair) { return pair.b < 0; });
      return Visit::kContinue;
    }
    std::vector<Pair> found;
  } collect;
  start_.searchMesh(start, collect);
  for (const Pair& pair : collect.found) inside.add(pair.a);
  start_.addNearest(PosedTriangles(start, start_.frame_), collect.found);
  const std::vector<Impact> at_start(collect.found.size(), Impact{0, 0, 0});
  return collect.found.empty()
             ? Visit::kContinue
             : sink.takeImpacts(collect.found.data(), at_start.data(), collect.found.size());
}

Visit Step::searchImpacts(const PosedMesh& start, const PosedMesh& end, PairSink& sink) const {
  if (end.mesh.tree().empty()) return Visit::kContinue;
  SegmentMarks inside(end_.begin(), end_.end());
  if (end.is_solid && searchInside(start, inside, sink) == Visit::kStop) return Visit::kStop;

  const PosedTriangles at_start(start, end_.frame_), at_end(end, end_.frame_);
  const double margin_of_mesh = marginOf(start, end) * end_.frame_.scale;
  const MeshImpactFilter filter(segments(), at_start, at_end, end_.margin() + margin_of_mesh,
                                inside);
  parallel::Executor* const executor = end_.executor_.get();
  const MeshTree start_tree = end.mesh.posedTree(start.mesh.points(), at_start.posing, executor);
  const MeshTree end_tree = end.mesh.posedTree(end.mesh.points(), at_end.posing, executor);
  const MovingTree<MeshTree::kArity> triangles(start_tree, end_tree);
  const double growth =
      std::max(end_.padding() + margin_of_mesh, 0.0) + std::max(at_start.error, at_end.error);
  return visitTree([&](const auto& tree) {
    if (tree.empty()) return Visit::kContinue;
    constexpr int kArity = std::decay_t<decltype(tree)>::kArity;
    const tree::MovingMeshPair<kArity> pair{tree, triangles, growth, end.categories};
    return findPairs(TreeSearch(pair), &filter, executor, *end_.scratch_, sink);
  });
}

bool findImpact(const PosedMesh& start, const PosedMesh& end, const MovingSegment& segment,
                const geometry::Frame& frame, double margin, double error, MeshImpact& impact) {
  if (end.mesh.tree().empty()) return false;
  const PosedTriangles at_start(start, frame), at_end(end, frame);
  margin += marginOf(start, end) * frame.scale;
  error += std::max(at_start.error, at_end.error);
  const MeshQuery query(at_start);
  const Segment& first = segment.start;
  if (end.is_solid && isBounded(first)) {
    const geometry::Vec3d point = first.isBox() ? midpoint(first) : first.a;
    if (query.isInside(point)) {
      constexpr double kAny = std::numeric_limits<double>::max();
      impact = {0, query.nearest({point, point, 0}, kAny).triangle};
      return true;
    }
  }
  impact = {std::numeric_limits<double>::infinity(), -1};
  const auto take = [&](TriangleId id) {
    const MovingTriangle triangle{at_start[id], at_end[id]};
    Impact found;
    // Boxes settle most pairs.
    if (!geometry::findImpact(segment, {boxOf(triangle.start), boxOf(triangle.end)}, margin, error,
                              0, found) ||
        found.time > impact.time || !findFirst(segment, triangle, margin, error, found)) {
      return;
    }
    if (found.time < impact.time || (found.time == impact.time && id < impact.triangle)) {
      impact = {found.time, id};
    }
  };
  if (rests(start, end)) {
    struct Near final : PairSink {
      Visit take(const Pair* pairs, std::size_t count) override {
        found.insert(found.end(), pairs, pairs + count);
        return Visit::kContinue;
      }
      std::vector<Pair> found;
    } near;
    SerialBuffer buffer(nullptr, near);
    const auto& tree = end.mesh.tree();
    const MovingTree<MeshTree::kArity> triangles(tree, tree);
    const double growth = margin + error;
    const geometry::MovingBox box{query.boxOf(segment.start, growth),
                                  query.boxOf(segment.end, growth)};
    tree::kernels<MovingTree<MeshTree::kArity>>().overlapsVolume(triangles, box, 0, tree::kNoGroup,
                                                                 buffer);
    buffer.full();
    for (const Pair& pair : near.found) take(pair.a);
  } else {
    const auto count = static_cast<TriangleId>(end.mesh.triangles().size());
    for (TriangleId id = 0; id < count; ++id) take(id);
  }
  return impact.triangle >= 0;
}

}  // namespace fcl_fibers::index
