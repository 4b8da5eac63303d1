// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <atomic>
#include <iterator>
#include <limits>
#include <type_traits>
#include <utility>
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

/// Segments and triangles during a step.
struct MeshMotions {
  MovingRange segments;
  const PosedTriangles &start, &end;
  double margin;
  const SegmentMarks& inside;  ///< segments whose pairs are left out

  MovingTriangle triangle(const Pair& pair) const { return {start[pair.b], end[pair.b]}; }
  /// Bounds the error of all points of a pair.
  double error(const MovingSegment& segment) const {
    return endPointError(segment) + std::max(start.error, end.error);
  }
};

/// Keeps the pairs of a segment and a triangle that touch during a step, and finds when.
class MeshImpactFilter final : public PairFilter {
 public:
  explicit MeshImpactFilter(const MeshMotions& motions) : motions_(motions) {}

  std::size_t keep(Pair* pairs, std::size_t count, std::vector<Impact>& impacts) const override {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      Impact impact;
      if (motions_.inside.has(pairs[i].a) || !find(pairs[i], impact)) continue;
      impacts.push_back(impact);
      pairs[kept++] = pairs[i];
    }
    return kept;
  }

 private:
  bool find(const Pair& pair, Impact& impact) const {
    const MovingSegment segment = motions_.segments[pair.a];
    return findFirst(segment, motions_.triangle(pair), motions_.margin, motions_.error(segment),
                     impact);
  }

  const MeshMotions& motions_;
};

/// As FirstImpact, of segments and triangles.
class FirstMeshImpact final : public PairFilter {
 public:
  FirstMeshImpact(const MeshMotions& motions, FirstTime& first)
      : motions_(motions), first_(first) {}

  std::size_t keep(Pair* pairs, std::size_t count, std::vector<Impact>&) const override {
    for (const Pair* pair = pairs; pair != pairs + count; ++pair) {
      if (motions_.inside.has(pair->a)) continue;
      const MovingSegment segment = motions_.segments[pair->a];
      TriangleImpact found;
      if (findApproach(segment, motions_.triangle(*pair), motions_.margin, motions_.error(segment),
                       0, found)) {
        first_.add(found.time);
      }
    }
    return 0;
  }

 private:
  const MeshMotions& motions_;
  FirstTime& first_;
};

}  // namespace

/// Finds and marks the segments that are wholly inside a solid at the start. b is not set.
std::vector<Pair> Step::findInside(const PosedMesh& start, SegmentMarks& inside) const {
  struct Collect final : PairSink {
    Visit take(const Pair* pairs, std::size_t count) override {
      std::copy_if(pairs, pairs + count, std::back_inserter(found),
                   [](const Pair& pair) { return pair.b < 0; });
      return Visit::kContinue;
    }
    std::vector<Pair> found;
  } collect;
  if (start.is_solid) start_.searchMesh(start, collect);
  for (const Pair& pair : collect.found) inside.add(pair.a);
  return std::move(collect.found);
}

/// Calls visit(motions, search) with the search of the segments against the mesh.
template <class F>
Visit Step::visitMesh(const PosedMesh& start, const PosedMesh& end, const SegmentMarks& inside,
                      const std::atomic<float>& until, F&& visit) const {
  const PosedTriangles at_start(start, end_.frame_), at_end(end, end_.frame_);
  const double margin_of_mesh = marginOf(start, end) * end_.frame_.scale;
  const MeshMotions motions{segments(), at_start, at_end, end_.margin() + margin_of_mesh, inside};
  parallel::Executor* const executor = end_.executor_.get();
  const MeshTree start_tree = end.mesh.posedTree(start.mesh.points(), at_start.posing, executor);
  const MeshTree end_tree = end.mesh.posedTree(end.mesh.points(), at_end.posing, executor);
  const MovingTree<MeshTree::kArity> triangles(start_tree, end_tree, until);
  const double growth =
      std::max(end_.padding() + margin_of_mesh, 0.0) + std::max(at_start.error, at_end.error);
  return visitTree(
      [&](const auto& tree) {
        if (tree.empty()) return Visit::kContinue;
        constexpr int kArity = std::decay_t<decltype(tree)>::kArity;
        const tree::MovingMeshPair<kArity> pair{tree, triangles, growth, end.categories};
        return visit(motions, TreeSearch(pair));
      },
      until);
}

Visit Step::searchImpacts(const PosedMesh& start, const PosedMesh& end, PairSink& sink) const {
  if (end.mesh.tree().empty()) return Visit::kContinue;
  SegmentMarks marks(end_.begin(), end_.end());
  std::vector<Pair> inside = findInside(start, marks);
  start_.addNearest(PosedTriangles(start, start_.frame_), inside);
  const std::vector<Impact> at_start(inside.size(), Impact{0, 0, 0});
  if (!inside.empty() &&
      sink.takeImpacts(inside.data(), at_start.data(), inside.size()) == Visit::kStop) {
    return Visit::kStop;
  }
  return visitMesh(start, end, marks, tree::kWholeStep,
                   [&](const auto& motions, const auto& search) {
                     const MeshImpactFilter filter(motions);
                     return findPairs(search, &filter, end_.executor_.get(), *end_.scratch_, sink);
                   });
}

double Step::safeTime(const PosedMesh& start, const PosedMesh& end) const {
  if (end.mesh.tree().empty()) return 1;
  SegmentMarks inside(end_.begin(), end_.end());
  findInside(start, inside);
  FirstTime first;
  NoSink nothing;
  visitMesh(start, end, inside, first.until(), [&](const auto& motions, const auto& search) {
    const FirstMeshImpact filter(motions, first);
    return findPairs(search, &filter, end_.executor_.get(), *end_.scratch_, nothing);
  });
  return first.get();
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
