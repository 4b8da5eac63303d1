// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iterator>
#include <memory>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "geometry/moving_box.h"
#include "index/moving_mesh.h"
#include "index/segment_index.h"
#include "index/segment_marks.h"
#include "index/tree_search.h"
#include "index/volume_around.h"
#include "tree/tree_pair.h"

namespace fcl_fibers::index {

using geometry::FrameChange;
using geometry::Impact;
using geometry::MovingSegment;
using geometry::Segment;
using geometry::TriangleImpact;
using tree::Pair;
using tree::Visit;

namespace {

/// A segment in another frame, with what it may be there by rounding.
Segment grown(const FrameChange& change, const Segment& segment) {
  if (change.isIdentity()) return segment;
  Segment moved = inFrame(change, segment);
  const double error = change.error(moved);
  if (moved.isBox()) return boxAround(moved, error);
  moved.radius += error;
  return isFinite(moved) ? moved : Segment::everywhere();
}

/// Keeps the pairs of a segment and a triangle that touch during a step, and finds when.
class MeshImpactFilter final : public PairFilter {
 public:
  /// @param inside  segments whose pairs are left out
  /// @param first   see Question
  MeshImpactFilter(MovingRange segments, const MovingMesh& mesh, double margin,
                   const SegmentMarks& inside, FirstTime* first)
      : segments_(segments), mesh_(mesh), margin_(margin), inside_(inside), first_(first) {}

  std::size_t keep(Pair* pairs, std::size_t count, std::vector<Impact>& impacts) const override {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Pair pair = pairs[i];
      if (inside_.has(pair.a)) continue;
      const MovingSegment segment = segments_[pair.a];
      const double error = endPointError(segment) + mesh_.error();
      if (Impact impact; first_ == nullptr) {
        if (!findImpact(segment, mesh_[pair.b], margin_, error, impact)) continue;
        impacts.push_back(impact);
        pairs[kept++] = pair;
      } else if (TriangleImpact found;
                 findApproach(segment, mesh_[pair.b], margin_, error, 0, found)) {
        first_->add(found.time);
      }
    }
    return kept;
  }

 private:
  const MovingRange segments_;
  const MovingMesh& mesh_;
  const double margin_;
  const SegmentMarks& inside_;
  FirstTime* const first_;
};

}  // namespace

bool SegmentIndex::fitStart(const SegmentSource& source) {
  step_ = Step::kNone;
  if (start_ == nullptr) start_ = std::make_unique<End>(now_);
  if (!read(*start_, source, frame())) return false;
  step_ = Step::kGiven;
  return true;
}

void SegmentIndex::endStep() {
  step_ = Step::kNone;
  start_.reset();
}

/// Segments are about to move.
/// @param moving  null if all may
void SegmentIndex::leaveStart(const std::vector<SegmentId>* moving) {
  if (step_ == Step::kGiven) step_ = Step::kNone;
  if (step_ == Step::kNone) return;
  if (step_ == Step::kBegins) {
    if (start_ == nullptr) {
      start_ = std::make_unique<End>(now_);
    } else if (moving == nullptr) {
      // All is read again, so that the end need not be kept.
      start_->frame = now_.frame;
      std::swap(start_->segments, now_.segments);
      std::swap(start_->tree, now_.tree);
    } else if (moved_all_) {
      *start_ = now_;
    } else {
      std::vector<Segment> segments;
      for (const SegmentId id : moved_) {
        segments.push_back(now_.segments[id]);
        start_->segments.set(id, segments.back());
      }
      std::visit([&](auto& tree) { tree.refitSome(moved_, segments); }, start_->tree);
    }
    moved_.clear();
    moved_all_ = false;
    step_ = Step::kMoves;
  }
  if (moving != nullptr && !moved_all_) {
    moved_.insert(moved_.end(), moving->begin(), moving->end());
    moved_all_ = moved_.size() > static_cast<std::size_t>(end_ - begin_) / 4;
  } else {
    moved_all_ = true;
  }
}

/// The tree and the segments at the end are about to leave.
void SegmentIndex::keepStarts() {
  if (step_ == Step::kNone || step_ == Step::kGiven) return endStep();
  if (step_ == Step::kBegins) {
    if (start_ == nullptr) start_ = std::make_unique<End>();
    start_->frame = now_.frame;
    start_->segments = std::move(now_.segments);
    step_ = Step::kMoves;
  }
  start_->tree = Tree();
  moved_all_ = true;
}

void SegmentIndex::takeStarts(SegmentIndex& other) {
  if (step_ == Step::kNone) return other.clear();
  keepStarts();
  other.keepStarts();
  KeptSegments& own = start_->segments;
  const KeptSegments& its = other.start_->segments;
  if (its.begin() < its.end()) {
    own.resize(own.begin(), its.end());
    const FrameChange change(other.start_->frame, start_->frame);
    for (SegmentId id = its.begin(); id < its.end(); ++id) own.set(id, grown(change, its[id]));
  }
  other.clear();
  other.beginStep();
}

/// Takes the start into the topology and the frame of the end, which has just been read.
void SegmentIndex::bringStart(const SegmentSource& source) {
  if (step_ != Step::kMoves) return;
  const bool has_tree = std::visit([](const auto& tree) { return !tree.empty(); }, start_->tree);
  const FrameChange change(start_->frame, frame());
  if (has_tree && change.isIdentity()) return;
  KeptSegments& segments = start_->segments;
  const SegmentId begin = segments.begin(), end = segments.end();
  segments.resize(begin_, end_);
  for (const SegmentId id : leaves()) {
    Segment start = now_.segments[id], now;
    if (id >= begin && id < end) {
      // What has not moved must rest in the new frame, too, whatever the rounding.
      const Segment before = segments[id];
      const bool has_moved =
          change.isIdentity() || !source.readNow(id, start_->frame, now) || !(now == before);
      if (has_moved) start = grown(change, before);
    }
    segments.set(id, start);
  }
  start_->frame = frame();
  start_->tree = now_.tree;
  fitFromSegments(*start_);
}

// --- Meshes ---

/// Finds and marks the segments that are wholly inside a solid at the start. b is not set.
std::vector<Pair> SegmentIndex::findInside(const MovingMesh& mesh, double margin,
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
  PosedMesh posed = mesh.start();
  posed.margin = mesh.margin();
  if (posed.is_solid) search(start(), posed, margin, /*once=*/true, collect);
  for (const Pair& pair : collect.found) inside.add(pair.a);
  return std::move(collect.found);
}

Visit SegmentIndex::search(const MovingMesh& mesh, double margin, PairSink& sink,
                           const Question& question) const {
  if (mesh.empty() || leaves().empty()) return Visit::kContinue;
  SegmentMarks marks(begin_, end_);
  std::vector<Pair> inside = findInside(mesh, margin, marks);
  if (question.first == nullptr && !inside.empty()) {
    addNearest(start(), mesh.trianglesAtStart(), inside);
    const std::vector<Impact> at_start(inside.size(), Impact{0, 0, 0});
    if (sink.takeImpacts(inside.data(), at_start.data(), inside.size()) == Visit::kStop) {
      return Visit::kStop;
    }
  }
  const MeshReach reach = meshReach(mesh.margin(), margin);
  const double growth = reach.growth + mesh.error();
  const MeshImpactFilter filter(movingRange(), mesh, reach.margin, marks, question.first);
  return visitTree(question, /*moves=*/true, [&](const auto& tree) {
    using Volume = typename std::decay_t<decltype(tree)>::Volume;
    if constexpr (std::is_same_v<Volume, geometry::MovingBox>) {
      const MovingMesh::Tree triangles = mesh.tree(lastTime(question));
      const auto pair = movingMeshPair(tree, triangles, growth, mesh.end().categories);
      return find(TreeSearch(pair), &filter, sink);
    } else {
      return Visit::kContinue;
    }
  });
}

}  // namespace fcl_fibers::index
