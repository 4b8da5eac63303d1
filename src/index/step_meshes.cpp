// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <atomic>
#include <iterator>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "index/moving_mesh.h"
#include "index/segment_marks.h"
#include "index/step.h"
#include "index/tree_search.h"
#include "tree/tree_pair.h"

namespace fcl_fibers::index {

using geometry::Impact;
using geometry::MovingSegment;
using geometry::TriangleImpact;
using tree::Pair;
using tree::Visit;

namespace {

/// Segments and triangles during a step.
struct MeshMotions {
  MovingRange segments;
  const MovingMesh& mesh;
  double margin;
  const SegmentMarks& inside;  ///< segments whose pairs are left out

  /// Bounds the error of all points of a pair.
  double error(const MovingSegment& segment) const { return endPointError(segment) + mesh.error(); }
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
    return findImpact(segment, motions_.mesh[pair.b], motions_.margin, motions_.error(segment),
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
      if (findApproach(segment, motions_.mesh[pair->b], motions_.margin, motions_.error(segment), 0,
                       found)) {
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
std::vector<Pair> Step::findInside(const MovingMesh& mesh, double margin,
                                   SegmentMarks& inside) const {
  struct Collect final : PairSink {
    Visit take(const Pair* pairs, std::size_t count) override {
      std::copy_if(pairs, pairs + count, std::back_inserter(found),
                   [](const Pair& pair) { return pair.b < 0; });
      return Visit::kContinue;
    }
    std::vector<Pair> found;
  } collect;
  // The margins are those of the search for triangles, or what is between the two would be lost.
  PosedMesh start = mesh.start();
  start.margin = mesh.margin();
  if (start.is_solid) start_.searchMesh(start, margin, collect);
  for (const Pair& pair : collect.found) inside.add(pair.a);
  return std::move(collect.found);
}

/// Calls visit(motions, search) with the search of the segments against the mesh.
template <class F>
Visit Step::visitMesh(const MovingMesh& mesh, double margin, const SegmentMarks& inside,
                      const std::atomic<float>& until, F&& visit) const {
  const SegmentIndex::MeshReach reach = end_.meshReach(mesh.margin(), margin);
  const MeshMotions motions{segments(), mesh, reach.margin, inside};
  const MovingMesh::Tree triangles = mesh.tree(until);
  const double growth = reach.growth + mesh.error();
  return visitTree(
      [&](const auto& tree) {
        if (tree.empty()) return Visit::kContinue;
        const auto pair = movingMeshPair(tree, triangles, growth, mesh.end().categories);
        return visit(motions, TreeSearch(pair));
      },
      until);
}

Visit Step::searchImpacts(const MovingMesh& mesh, double margin, PairSink& sink) const {
  if (mesh.empty()) return Visit::kContinue;
  SegmentMarks marks(end_.begin(), end_.end());
  std::vector<Pair> inside = findInside(mesh, margin, marks);
  start_.addNearest(mesh.trianglesAtStart(), inside);
  const std::vector<Impact> at_start(inside.size(), Impact{0, 0, 0});
  if (!inside.empty() &&
      sink.takeImpacts(inside.data(), at_start.data(), inside.size()) == Visit::kStop) {
    return Visit::kStop;
  }
  return visitMesh(mesh, margin, marks, tree::kWholeStep,
                   [&](const auto& motions, const auto& search) {
                     const MeshImpactFilter filter(motions);
                     return findPairs(search, &filter, end_.executor_.get(), *end_.scratch_, sink);
                   });
}

double Step::safeTime(const MovingMesh& mesh) const {
  if (mesh.empty()) return 1;
  SegmentMarks inside(end_.begin(), end_.end());
  const double margin = end_.options_.margin;
  findInside(mesh, margin, inside);
  FirstTime first;
  NoSink nothing;
  visitMesh(mesh, margin, inside, first.until(), [&](const auto& motions, const auto& search) {
    const FirstMeshImpact filter(motions, first);
    return findPairs(search, &filter, end_.executor_.get(), *end_.scratch_, nothing);
  });
  return first.get();
}

}  // namespace fcl_fibers::index
