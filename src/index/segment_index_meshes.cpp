// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "geometry/moving_box.h"
#include "index/hull_filter.h"
#include "index/posed_mesh.h"
#include "index/segment_index.h"
#include "index/segment_marks.h"
#include "index/tree_search.h"

namespace fcl_fibers::index {
namespace {

using geometry::Impact;
using geometry::Segment;
using tree::Pair;
using tree::Visit;

constexpr TriangleId kNoTriangle = -1;

/// Remembers the segments of the pairs that it hands on. If `once` is set, it hands on only the
/// first pair of each segment.
class MarkingSink final : public PairSink {
 public:
  MarkingSink(bool once, SegmentMarks& marks, PairSink& sink)
      : once_(once), marks_(marks), sink_(sink) {}

  Delivery delivery() const override {
    // Which pair is the first is known when those before it are.
    const bool is_placed = sink_.delivery() == Delivery::kPlaced;
    return once_ && is_placed ? Delivery::kInOrder : sink_.delivery();
  }
  std::size_t sift(Pair* pairs, Impact* impacts, std::size_t count) const override {
    const std::size_t kept = sink_.sift(pairs, impacts, count);
    for (std::size_t i = 0; i < kept && !once_; ++i) marks_.add(pairs[i].a);
    return kept;
  }
  Visit take(const PairRun& found) override {
    if (!once_) return sink_.take(found);
    constexpr std::size_t kRun = 256;
    std::array<Pair, kRun> run;
    for (std::size_t i = 0; i < found.count;) {
      std::size_t size = 0;
      for (; i < found.count && size < kRun; ++i) {
        if (marks_.add(found.pairs[i].a)) run[size++] = found.pairs[i];
      }
      if (size > 0 && sink_.take({run.data(), nullptr, size, found.worker}) == Visit::kStop) {
        return Visit::kStop;
      }
    }
    return Visit::kContinue;
  }
  void requireRoom(std::size_t count) const override { sink_.requireRoom(count); }
  void makeRoom(std::size_t count) override { sink_.makeRoom(count); }
  void place(std::size_t begin, const PairRun& run) const override { sink_.place(begin, run); }

 private:
  const bool once_;
  SegmentMarks& marks_;
  PairSink& sink_;
};

/// Whether some segment below a slot may meet a mesh of these categories.
template <class Tree>
bool mayMeet(const Tree& tree, std::size_t slot, const tree::Categories& categories) {
  return tree.meets().empty() || tree.meets()[slot].meet(categories);
}

/// Calls visit(id) for the leaves of a tree that may meet the categories, in nodes [begin, end).
template <class Tree, class F>
void forMeetingLeaves(const Tree& tree, tree::Categories categories, std::size_t begin,
                      std::size_t end, F&& visit) {
  for (std::size_t i = begin; i < end; ++i) {
    const auto& node = tree.nodes()[i];
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(node.child_count); ++lane) {
      const std::size_t slot = static_cast<std::size_t>(Tree::kArity) * i + lane;
      if (node.children[lane].isLeaf() && mayMeet(tree, slot, categories)) {
        visit(node.children[lane].segment());
      }
    }
  }
}

/// Finds the segments that are wholly inside a solid mesh. All that is below a volume which
/// overlaps no triangle's box is on one side of the surface, so one point tells which.
template <class Tree, class F>
class InsideSearch {
 public:
  /// @param touching  segments that do not count; null for none
  InsideSearch(const Tree& tree, SegmentRange segments, const PosedTriangles& triangles,
               const SegmentMarks* touching, F& visit)
      : tree_(tree),
        segments_(segments),
        triangles_(triangles),
        mesh_(triangles.mesh().tree()),
        root_(mesh_.nodeVolume(0)),
        categories_(triangles.placed().categories),
        touching_(touching),
        visit_(visit) {}

  /// @param all_are_inside  whether nothing below the node has to be asked about
  Visit below(std::int32_t index, bool all_are_inside = false) {
    const auto& node = tree_.node(index);
    for (int lane = 0; lane < node.child_count; ++lane) {
      const auto child = tree::Child<Tree>::of(tree_, index, lane);
      if (!mayMeet(tree_, static_cast<std::size_t>(child.slot), categories_)) continue;
      const bool is_leaf = child.link.isLeaf();
      // A segment may touch within the margin although its volume overlaps no triangle's box.
      if (is_leaf && touching_ != nullptr && touching_->has(child.link.segment())) continue;
      bool is_inside = all_are_inside;
      if (!is_inside) {
        const geometry::Box box = triangles_.inTree(child.volume);
        if (!overlapsRoot(box)) continue;
        if (is_leaf || !overlapsSurface(box)) {
          if (!triangles_.isInside(segments_[firstBelow(child.link)])) continue;
          is_inside = true;
        }
      }
      const Visit visit =
          is_leaf ? visit_(child.link.segment()) : below(child.link.node(), is_inside);
      if (visit == Visit::kStop) return visit;
    }
    return Visit::kContinue;
  }

 private:
  SegmentId firstBelow(tree::Link link) const {
    if (link.isLeaf()) return link.segment();
    return tree_.leaves()[static_cast<std::size_t>(tree_.node(link.node()).leaf_begin)];
  }
  bool overlapsRoot(const geometry::Box& box) const {
    for (int axis = 0; axis < 3; ++axis) {
      if (box.low[axis] > root_.high[axis] || box.high[axis] < root_.low[axis]) return false;
    }
    return true;
  }
  bool overlapsSurface(const geometry::Box& box) const {
    return visitOverlapping(mesh_, box, [](TriangleId) { return Visit::kStop; }) == Visit::kStop;
  }

  const Tree& tree_;
  SegmentRange segments_;
  const PosedTriangles& triangles_;
  const MeshTree& mesh_;
  const geometry::Box root_;
  const tree::Categories categories_;
  const SegmentMarks* const touching_;
  F& visit_;
};

/// Whether the boxes of a turned mesh overlap so much that a tree of the posed triangles, whose
/// boxes are smaller, is worth its time. Then the search has a task for each 128 triangles.
bool isWorthPosing(const PairSearch& turned, const PosedTriangles& triangles) {
  if (!triangles.fromTree().turns() || !triangles.isFarFromOverflow()) return false;
  struct Count final : tree::TaskSink {
    Visit take(const tree::TraversalTask&) override {
      return --missing > 0 ? Visit::kContinue : Visit::kStop;
    }
    std::size_t missing;
  } count;
  count.missing = 16 + triangles.mesh().triangles().size() / 128;
  return turned.split(tree::kAllPairs, tree::kLeastGrain, count) == Visit::kStop;
}

}  // namespace

/// @param margin  of the search and the mesh together, in the world's unit
SegmentIndex::MeshReach SegmentIndex::meshReach(double margin) const {
  const double reach = margin * frame().scale;
  // A volume that is padded by more contains what counts. The factor covers the rounding of the
  // difference. If both are infinite, the volumes are unbounded.
  constexpr double kOutward = 1 + 4 * std::numeric_limits<double>::epsilon();
  return {reach, reach > padding() ? (reach - padding()) * kOutward : 0};
}

/// Hands on the pairs that touch at one end of the step, and then each segment inside a solid.
Visit SegmentIndex::searchAt(const End& end, const PosedTriangles& triangles, double margin,
                             const Question& question, PairSink& sink) const {
  const bool once = question.once, names_nearest = question.names_nearest && !once;
  const tree::Categories categories = triangles.placed().categories;
  const bool is_solid = triangles.placed().is_solid;
  const SegmentRange segments = rangeOf(end);
  const MeshReach reach = meshReach(margin);
  const double growth = reach.growth + triangles.error();
  const HullFilter filter(segments, TriangleHulls<PosedTriangles>{triangles, once}, reach.margin,
                          unit_);
  const bool marks_segments = once || is_solid;
  SegmentMarks marks(begin_, marks_segments ? end_ : begin_);
  MarkingSink marking(once, marks, sink);
  PairSink& out = marks_segments ? marking : sink;
  return std::visit(
      [&](const auto& tree) {
        const auto findPosed = [&] {
          const MeshTree posed = triangles.mesh().posedTree(triangles.mesh().points(),
                                                            triangles.posing(), executor_.get());
          const geometry::AffineMap same;
          const auto pair = meshPair(tree, posed, same, growth, segments, categories);
          return find(TreeSearch(pair), &filter, out);
        };
        const auto pair = meshPair(tree, triangles.mesh().tree(), triangles.fromTree(), growth,
                                   segments, categories);
        const TreeSearch search(pair);
        if ((isWorthPosing(search, triangles) ? findPosed() : find(search, &filter, out)) ==
            Visit::kStop) {
          return Visit::kStop;
        }
        if (!is_solid) return Visit::kContinue;
        constexpr std::size_t kRun = 4096;
        std::vector<Pair> inside;
        const auto handOn = [&] {
          if (names_nearest) addNearest(end, triangles, inside);
          const Visit visit = share({inside.data(), nullptr, inside.size()}, sink);
          inside.clear();
          return visit;
        };
        const auto take = [&](SegmentId id) {
          inside.push_back({id, kNoTriangle});
          return inside.size() < kRun ? Visit::kContinue : handOn();
        };
        InsideSearch search_inside(tree, segments, triangles, &marks, take);
        return search_inside.below(0) == Visit::kStop ? Visit::kStop : handOn();
      },
      end.tree);
}

/// Sets b of each pair to the triangle that is nearest to segment a.
void SegmentIndex::addNearest(const End& at, const PosedTriangles& triangles,
                              std::vector<Pair>& pairs) const {
  const SegmentRange segments = at.segments.range();
  constexpr std::size_t kGrain = 64;
  forRanges(pairs.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      constexpr double kAny = std::numeric_limits<double>::max();
      pairs[i].b = triangles.nearest(segments[pairs[i].a], kAny).triangle;
    }
  });
}

Visit SegmentIndex::search(const PosedMesh& mesh, double margin, PairSink& sink,
                           const Question& question) const {
  if (mesh.empty() || leaves().empty()) return Visit::kContinue;
  // What is inside is found within the margins of the search for triangles, or what is between the
  // two would be lost.
  const double both_margins = margin + mesh.margin();
  if (!mesh.hasStep()) return searchAt(fitted(), mesh.end(), both_margins, question, sink);
  struct Inside final : PairSink {
    explicit Inside(SegmentMarks& m) : marks(m) {}
    Visit take(const PairRun& run) override {
      for (const Pair* pair = run.pairs; pair != run.pairs + run.count; ++pair) {
        if (pair->b == kNoTriangle && marks.add(pair->a)) found.push_back(*pair);
      }
      return Visit::kContinue;
    }
    SegmentMarks& marks;
    std::vector<Pair> found;
  };
  SegmentMarks marks(begin_, end_);
  Inside inside(marks);
  if (mesh.isSolid()) {
    Question at_start;
    at_start.once = true;
    searchAt(start(), mesh.start(), both_margins, at_start, inside);
  }
  if (question.first == nullptr && !inside.found.empty()) {
    addNearest(start(), mesh.start(), inside.found);
    const std::vector<Impact> at_start(inside.found.size(), Impact{0, 0, 0});
    if (share({inside.found.data(), at_start.data(), at_start.size()}, sink) == Visit::kStop) {
      return Visit::kStop;
    }
  }
  const MeshReach reach = meshReach(both_margins);
  const HullFilter filter(movingRange(), TriangleHulls<PosedMesh>{mesh, /*once=*/false, &marks},
                          reach.margin, unit_, question);
  return visitTree(question, /*moves=*/true, [&](const auto& tree) {
    using Volume = typename std::decay_t<decltype(tree)>::Volume;
    if constexpr (std::is_same_v<Volume, geometry::MovingBox>) {
      const PosedMesh::Tree triangles = mesh.tree(lastTime(question));
      const auto pair =
          movingMeshPair(tree, triangles, reach.growth + mesh.error(), mesh.categories());
      return find(TreeSearch(pair), &filter, sink);
    } else {
      return Visit::kContinue;
    }
  });
}

Visit SegmentIndex::search(const PosedMesh& mesh, double /*margin*/, NearestSink& sink) const {
  const PosedTriangles& triangles = mesh.end();
  const double margin_of_mesh = triangles.placed().margin * frame().scale;
  const SegmentRange segments = keptRange();
  const auto find_segment = [&](SegmentId id) {
    const Segment s = segments[id];
    return FoundSegment{s, endPointError(s), !s.isBox()};
  };
  const auto find_triangle = [&](TriangleId id) {
    return Found<geometry::Triangle>{triangles[id], triangles.error(), true};
  };
  NearestFilter visitor(find_segment, find_triangle, /*tests_all=*/true, sink, margin_of_mesh);
  return std::visit(
      [&](const auto& tree) {
        const auto visitInside = [&](SegmentId id) {
          double limit = sink.limit();
          return limit > 0 ? sink.visit(id, kNoTriangle, limit) : Visit::kContinue;
        };
        if (mesh.isSolid() &&
            InsideSearch(tree, segments, triangles, nullptr, visitInside).below(0) ==
                Visit::kStop) {
          return Visit::kStop;
        }
        const auto pair = meshPair(tree, triangles.mesh().tree(), triangles.fromTree(),
                                   margin_of_mesh + triangles.error(), segments, mesh.categories());
        return visitNearest(pair, sink.limit(), visitor);
      },
      fitted().tree);
}

Visit SegmentIndex::findNearest(const PosedMesh& mesh, double distance, PairSink& sink) const {
  const PosedTriangles& triangles = mesh.end();
  const SegmentRange segments = keptRange();
  const double most = distance * frame().scale;
  return std::visit(
      [&](const auto& tree) {
        constexpr std::size_t kGrain = 256;
        const auto findBelow = [&](std::size_t begin, std::size_t end, std::vector<Pair>& found) {
          forMeetingLeaves(tree, mesh.categories(), begin, end, [&](SegmentId id) {
            const Segment s = segments[id];
            // The search finds what is nearer than this, so even at distance 0 it is not 0.
            const double limit = (s.thickness() + most) * (1 + 0x1p-40) + endPointError(s) +
                                 triangles.error() + 0x1p-900;
            const TriangleId nearest = triangles.nearest(s, limit).triangle;
            if (nearest >= 0) found.push_back({id, nearest});
          });
        };
        return findInRanges(tree.nodes().size(), kGrain, sink, findBelow);
      },
      fitted().tree);
}

void SegmentIndex::forRanges(std::size_t count, std::size_t grain,
                             parallel::FunctionRef<std::size_t, std::size_t> visit) const {
  parallel::forRanges(executor_.get(), count, grain, visit);
}

}  // namespace fcl_fibers::index
