// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include "geometry/triangle_distance.h"
#include "index/mesh_query.h"
#include "index/segment_index.h"
#include "index/segment_marks.h"
#include "index/tree_search.h"
#include "index/triangle_filter.h"

namespace fcl_fibers::index {
namespace {

using geometry::PairBlock;
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

  Visit take(const Pair* pairs, std::size_t count) override {
    constexpr std::size_t kRun = 256;
    std::array<Pair, kRun> run;
    for (const Pair* const end = pairs + count; pairs != end;) {
      std::size_t size = 0;
      for (; pairs != end && size < kRun; ++pairs) {
        if (marks_.add(pairs->a) || !once_) run[size++] = *pairs;
      }
      if (size > 0 && sink_.take(run.data(), size) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }

 private:
  const bool once_;
  SegmentMarks& marks_;
  PairSink& sink_;
};

/// Hands on pairs of segments and triangles that may be nearer than the limit.
class NearTriangles final : public tree::NearestVisitor {
 public:
  NearTriangles(SegmentRange segments, const PosedTriangles& triangles, double margin,
                NearestSink& sink)
      : segments_(segments), triangles_(triangles), margin_(margin), sink_(sink) {}

  Visit visit(SegmentId segment, SegmentId triangle, double& limit) override {
    const Segment s = segments_[segment];
    const bool is_tested = limit < std::numeric_limits<double>::infinity() && !s.isBox();
    const double error = endPointError(s) + triangles_.error;
    if (is_tested && !touch(s, triangles_[triangle], limit + margin_, error)) {
      return Visit::kContinue;
    }
    return sink_.visit(segment, triangle, limit);
  }

 private:
  SegmentRange segments_;
  const PosedTriangles& triangles_;
  const double margin_;
  NearestSink& sink_;
};

/// Whether some segment below a slot may meet a mesh of these categories.
template <class Tree>
bool mayMeet(const Tree& tree, std::size_t slot, tree::Categories categories) {
  return tree.meets().empty() || (tree.meets()[slot] & categories) != 0;
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
  InsideSearch(const Tree& tree, SegmentRange segments, const PosedTriangles& triangles,
               tree::Categories categories, const SegmentMarks& touching, F& visit)
      : tree_(tree),
        segments_(segments),
        query_(triangles),
        mesh_(triangles.mesh.tree()),
        root_(mesh_.nodeVolume(0)),
        categories_(categories),
        touching_(touching),
        visit_(visit) {}

  Visit below(std::int32_t index) {
    const auto& node = tree_.node(index);
    for (int lane = 0; lane < node.child_count; ++lane) {
      const auto child = tree::Child<Tree>::of(tree_, index, lane);
      const auto slot = static_cast<std::size_t>(child.slot);
      if (!mayMeet(tree_, slot, categories_)) continue;
      const geometry::Box box = query_.inTree(child.volume);
      if (!overlapsRoot(box)) continue;
      if (child.link.isLeaf()) {
        const SegmentId id = child.link.segment();
        if (!touching_.has(id) && isInside(id) && visit_(id) == Visit::kStop) return Visit::kStop;
      } else if (overlapsSurface(box)) {
        if (below(child.link.node()) == Visit::kStop) return Visit::kStop;
      } else if (isInside(tree_.leaves()[first(child.link)]) &&
                 takeAll(child.link.node()) == Visit::kStop) {
        return Visit::kStop;
      }
    }
    return Visit::kContinue;
  }

 private:
  struct Any final : tree::PairBuffer {
    Any() {
      next_ = found;
      end_ = found + 1;
    }
    Visit full() override { return Visit::kStop; }
    Pair found[1 + kRoom];
  };

  std::size_t first(tree::Link link) const {
    return static_cast<std::size_t>(tree_.node(link.node()).leaf_begin);
  }
  bool overlapsRoot(const geometry::Box& box) const {
    for (int axis = 0; axis < 3; ++axis) {
      if (box.low[axis] > root_.high[axis] || box.high[axis] < root_.low[axis]) return false;
    }
    return true;
  }
  bool overlapsSurface(const geometry::Box& box) const {
    Any any;
    return visitOverlaps(mesh_, box, 0, tree::kNoGroup, any) == Visit::kStop;
  }
  /// The middle of a box stands for the box.
  bool isInside(SegmentId id) const {
    const Segment s = segments_[id];
    return query_.isInside(s.isBox() ? midpoint(s) : s.a);
  }
  Visit takeAll(std::int32_t index) {
    const auto& node = tree_.node(index);
    for (int lane = 0; lane < node.child_count; ++lane) {
      const auto slot = static_cast<std::size_t>(Tree::kArity * index + lane);
      if (!mayMeet(tree_, slot, categories_)) continue;
      const tree::Link child = node.children[static_cast<std::size_t>(lane)];
      // A segment may touch within the margin although its volume overlaps no triangle's box.
      if (child.isLeaf() && touching_.has(child.segment())) continue;
      if ((child.isLeaf() ? visit_(child.segment()) : takeAll(child.node())) == Visit::kStop) {
        return Visit::kStop;
      }
    }
    return Visit::kContinue;
  }

  const Tree& tree_;
  SegmentRange segments_;
  const MeshQuery query_;
  const MeshTree& mesh_;
  const geometry::Box root_;
  const tree::Categories categories_;
  const SegmentMarks& touching_;
  F& visit_;
};

/// Whether the boxes of a turned mesh overlap so much that a tree of the posed triangles, whose
/// boxes are smaller, is worth its time. Then the search has a task for each 128 triangles.
bool isWorthPosing(const PairSearch& turned, const PosedTriangles& triangles) {
  if (!triangles.from_tree.turns() || !triangles.isFarFromOverflow()) return false;
  struct Count final : tree::TaskSink {
    Visit take(const tree::TraversalTask&) override {
      return --missing > 0 ? Visit::kContinue : Visit::kStop;
    }
    std::size_t missing;
  } count;
  count.missing = 16 + triangles.mesh.triangles().size() / 128;
  return turned.split(count) == Visit::kStop;
}

}  // namespace

SegmentIndex::MeshReach SegmentIndex::meshReach(double mesh_margin, double margin) const {
  const double reach = (margin + mesh_margin) * frame().scale;
  // A volume that is padded by more contains what counts. The factor covers the rounding of the
  // difference. If both are infinite, the volumes are unbounded.
  constexpr double kOutward = 1 + 4 * std::numeric_limits<double>::epsilon();
  return {reach, reach > padding() ? (reach - padding()) * kOutward : 0};
}

/// Hands on the pairs that touch, through `out`, and then each segment inside a solid, with its
/// nearest triangle unless `once` is set.
Visit SegmentIndex::search(const End& end, const PosedMesh& mesh, double margin, bool once,
                           PairSink& sink) const {
  if (mesh.mesh.tree().empty()) return Visit::kContinue;
  const PosedTriangles triangles(mesh, frame());
  const SegmentRange segments = rangeOf(end);
  const MeshReach reach = meshReach(mesh.margin, margin);
  const double growth = reach.growth + triangles.error;
  const TriangleFilter filter(segments, triangles, reach.margin, /*error=*/0, once, unit_);
  const bool marks_segments = once || mesh.is_solid;
  SegmentMarks marks(begin_, marks_segments ? end_ : begin_);
  MarkingSink marking(once, marks, sink);
  PairSink& out = marks_segments ? marking : sink;
  return std::visit(
      [&](const auto& tree) {
        if (tree.empty()) return Visit::kContinue;
        const auto findPosed = [&] {
          const MeshTree posed =
              triangles.mesh.posedTree(triangles.mesh.points(), triangles.posing, executor_.get());
          const geometry::AffineMap same;
          const auto pair = meshPair(tree, posed, same, growth, segments, mesh.categories);
          return find(TreeSearch(pair), &filter, out);
        };
        const auto pair = meshPair(tree, triangles.mesh.tree(), triangles.from_tree, growth,
                                   segments, mesh.categories);
        const TreeSearch search(pair);
        if ((isWorthPosing(search, triangles) ? findPosed() : find(search, &filter, out)) ==
            Visit::kStop) {
          return Visit::kStop;
        }
        if (!mesh.is_solid) return Visit::kContinue;
        constexpr std::size_t kRun = 4096;
        std::vector<Pair> inside;
        const auto handOn = [&] {
          if (!once) addNearest(end, triangles, inside);
          const Visit visit = sink.take(inside.data(), inside.size());
          inside.clear();
          return visit;
        };
        const auto take = [&](SegmentId id) {
          inside.push_back({id, kNoTriangle});
          return inside.size() < kRun ? Visit::kContinue : handOn();
        };
        InsideSearch search_inside(tree, segments, triangles, mesh.categories, marks, take);
        return search_inside.below(0) == Visit::kStop ? Visit::kStop : handOn();
      },
      end.tree);
}

/// Sets b of each pair to the triangle that is nearest to segment a.
void SegmentIndex::addNearest(const End& end, const PosedTriangles& triangles,
                              std::vector<Pair>& pairs) const {
  const MeshQuery query(triangles);
  const SegmentRange segments = end.segments.range();
  constexpr std::size_t kGrain = 64;
  forRanges(pairs.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      constexpr double kAny = std::numeric_limits<double>::max();
      pairs[i].b = query.nearest(segments[pairs[i].a], kAny).triangle;
    }
  });
}

Visit SegmentIndex::search(const PosedMesh& mesh, double margin, PairSink& sink,
                           const Question& question) const {
  return search(now_, mesh, margin, question.once, sink);
}

Visit SegmentIndex::search(const PosedMesh& mesh, double /*margin*/, NearestSink& sink) const {
  const PosedTriangles triangles(mesh, frame());
  const double margin_of_mesh = mesh.margin * frame().scale;
  NearTriangles visitor(keptRange(), triangles, margin_of_mesh, sink);
  return std::visit(
      [&](const auto& tree) {
        const auto visitInside = [&](SegmentId id) {
          double limit = sink.limit();
          return limit > 0 ? sink.visit(id, kNoTriangle, limit) : Visit::kContinue;
        };
        const SegmentMarks none(begin_, mesh.is_solid ? end_ : begin_);
        if (mesh.is_solid &&
            InsideSearch(tree, keptRange(), triangles, mesh.categories, none, visitInside)
                    .below(0) == Visit::kStop) {
          return Visit::kStop;
        }
        const auto pair = meshPair(tree, triangles.mesh.tree(), triangles.from_tree,
                                   margin_of_mesh + triangles.error, keptRange(), mesh.categories);
        return visitNearest(pair, sink.limit(), visitor);
      },
      now_.tree);
}

void SegmentIndex::findNearest(const PosedMesh& mesh, double distance,
                               std::vector<Pair>& pairs) const {
  pairs.clear();
  const PosedTriangles triangles(mesh, frame());
  const MeshQuery query(triangles);
  const SegmentRange segments = keptRange();
  const double most = distance * frame().scale;
  std::visit(
      [&](const auto& tree) {
        constexpr std::size_t kGrain = 256;
        std::vector<std::vector<Pair>> found((tree.nodes().size() + kGrain - 1) / kGrain);
        parallel::forRanges(
            executor_.get(), found.size(), 1, [&](std::size_t begin, std::size_t end) {
              for (std::size_t part = begin; part < end; ++part) {
                const std::size_t last = std::min((part + 1) * kGrain, tree.nodes().size());
                forMeetingLeaves(tree, mesh.categories, part * kGrain, last, [&](SegmentId id) {
                  const Segment s = segments[id];
                  // The search finds what is nearer than this, so even at distance 0 it is not 0.
                  const double limit = (s.thickness() + most) * (1 + 0x1p-40) + endPointError(s) +
                                       triangles.error + 0x1p-900;
                  const TriangleId nearest = query.nearest(s, limit).triangle;
                  if (nearest >= 0) found[part].push_back({id, nearest});
                });
              }
            });
        for (const auto& part : found) pairs.insert(pairs.end(), part.begin(), part.end());
      },
      now_.tree);
}

void SegmentIndex::forRanges(std::size_t count, std::size_t grain,
                             parallel::FunctionRef<std::size_t, std::size_t> visit) const {
  parallel::forRanges(executor_.get(), count, grain, visit);
}

bool touches(const PosedMesh& mesh, const Segment& segment, const geometry::Frame& frame,
             double margin, double error) {
  if (mesh.mesh.tree().empty()) return false;
  margin += mesh.margin * frame.scale;
  const PosedTriangles triangles(mesh, frame);
  const geometry::CapsuleEnd ends[] = {geometry::firstEndOf(segment),
                                       geometry::secondEndOf(segment)};
  const TriangleFilter filter(
      SegmentRange(ends, 2, 0), triangles, margin, error,
      /*once=*/true, PairBlock::unitFor(maxNorm(segment.b - segment.a) + segment.thickness()));
  struct Stop final : PairSink {
    Visit take(const Pair*, std::size_t) override { return Visit::kStop; }
  } stop;
  /// Exchanges the two, because the tree's leaves are triangles.
  struct Exchange final : PairFilter {
    explicit Exchange(const TriangleFilter& f) : filter(f) {}
    std::size_t keep(Pair* pairs, std::size_t count,
                     std::vector<geometry::Impact>& impacts) const override {
      for (Pair* pair = pairs; pair != pairs + count; ++pair) std::swap(pair->a, pair->b);
      return filter.keep(pairs, count, impacts);
    }
    const TriangleFilter& filter;
  } const exchange(filter);
  SerialBuffer buffer(&exchange, stop);
  const MeshQuery query(triangles);
  const geometry::Box box = query.boxOf(segment, margin + error + triangles.error);
  if (visitOverlaps(mesh.mesh.tree(), box, 0, tree::kNoGroup, buffer) == Visit::kStop ||
      buffer.full() == Visit::kStop) {
    return true;
  }
  return mesh.is_solid && isBounded(segment) &&
         query.isInside(segment.isBox() ? midpoint(segment) : segment.a);
}

}  // namespace fcl_fibers::index
