// SPDX-License-Identifier: BSD-3-Clause
#include "contenders/swept_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "contenders/foreign_tree.h"
#include "index/hull_filter.h"

namespace fcl_fibers::benchmarks {
namespace {

tree::Fibers fibersOf(const FiberPolylines& scene) {
  tree::Fibers fibers;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i) {
      fibers.ids.push_back(static_cast<index::SegmentId>(i));
    }
    fibers.endFiber();
  }
  return fibers;
}

/// Tests candidates, a thousand at a time, as our own search does.
class CandidateBuffer final : public index::PairSink {
 public:
  CandidateBuffer(const index::PairFilter& filter, index::PairSink& sink)
      : filter_(filter), sink_(sink) {}

  tree::Visit take(const index::PairRun& run) override {
    for (std::size_t i = 0; i < run.count; ++i) {
      // Segments of two fibers are never next to each other: no segment starts at a last point.
      if (std::abs(run.pairs[i].a - run.pairs[i].b) == 1) continue;
      pairs_[size_++] = run.pairs[i];
      if (size_ == pairs_.size()) flush();
    }
    return tree::Visit::kContinue;
  }
  /// Must be called at the end of a search, too.
  void flush() {
    candidates_ += size_;
    impacts_.clear();
    const std::size_t kept = filter_.keep(pairs_.data(), size_, impacts_);
    if (kept > 0) sink_.take({pairs_.data(), impacts_.data(), kept});
    size_ = 0;
  }
  std::size_t candidates() const { return candidates_; }

 private:
  const index::PairFilter& filter_;
  index::PairSink& sink_;
  std::array<tree::Pair, 1024> pairs_;
  std::size_t size_ = 0, candidates_ = 0;
  std::vector<geometry::Impact> impacts_;
};

class OurSweptTree final : public SweptTree {
 public:
  OurSweptTree() : index_(index::IndexOptions{}) {}
  void searchCandidates(index::PairSink& sink) const override { index_.search(sink); }

 private:
  void fit(const scenes::Step& step) override {
    const SweptBoxes boxes(step);
    if (index_.end() > 0 && index_.refit(boxes)) return;
    index_.build(boxes, index::frameFor(boxes, fibers().ids), 0,
                 static_cast<index::SegmentId>(step.start.points.size()), fibers());
  }

  index::SegmentIndex index_;
};

#ifdef FCL_FIBERS_WITH_EMBREE
class EmbreeSweptTree final : public SweptTree {
 public:
  explicit EmbreeSweptTree(bool morton) : tree_(makeEmbreeBoxes(morton)) {}
  void searchCandidates(index::PairSink& sink) const override {
    std::vector<tree::Pair> pairs;
    tree_->visitPairs([&](const BoxTree::Pairs& found) {
      pairs.clear();
      for (const auto& [a, b] : found) pairs.push_back({fibers().ids[a], fibers().ids[b]});
      sink.take({pairs.data(), nullptr, pairs.size()});
    });
  }

 private:
  void fit(const scenes::Step& step) override {
    const SweptBoxes boxes(step);
    boxes_.clear();
    boxes_.reserve(fibers().ids.size());
    for (const index::SegmentId id : fibers().ids) {
      const geometry::Segment box = boxes.box(id, {});
      boxes_.push_back(floatBox({{box.a.x, box.a.y, box.a.z}, {box.b.x, box.b.y, box.b.z}}));
    }
    tree_->update(boxes_);
  }
  std::vector<FloatBox> boxes_;  // outlive the tree, which borrows them
  std::unique_ptr<BoxTree> tree_;
};
#endif

}  // namespace

geometry::Segment SweptBoxes::box(index::SegmentId id, const geometry::Frame& frame) const {
  const auto i = static_cast<std::size_t>(id);
  double low[3], high[3];
  const double radius = std::max(step_->start.radiusAt(i), step_->end.radiusAt(i));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [least, most] =
        std::minmax({step_->start.points[i][axis], step_->start.points[i + 1][axis],
                     step_->end.points[i][axis], step_->end.points[i + 1][axis]});
    const double outward = radius + 4 * std::numeric_limits<double>::epsilon() *
                                        std::max({std::abs(least), std::abs(most), radius});
    low[axis] = least - outward;
    high[axis] = most + outward;
  }
  return geometry::Segment::box(frame.fromWorld(geometry::Vec3d{low[0], low[1], low[2]}),
                                frame.fromWorld(geometry::Vec3d{high[0], high[1], high[2]}));
}

bool SweptBoxes::read(const index::SegmentId* ids, int count, int ahead,
                      const geometry::Frame& frame, index::SegmentBlock& out,
                      index::BlockMask& present) const {
  for (int i = count; i < count + ahead; ++i) {
    for (const FiberPolylines* scene : {&step_->start, &step_->end}) {
      const double* const point = scene->points[static_cast<std::size_t>(ids[i])].data();
      __builtin_prefetch(point);
      __builtin_prefetch(point + 5);
    }
  }
  for (int i = 0; i < count; ++i) out.set(i, box(ids[i], frame));
  present = geometry::firstOfBlock(count);
  return true;
}

bool SweptBoxes::staysFiniteIn(const geometry::Frame& frame) const {
  return std::isfinite(frame.scale);
}

void SweptBoxes::refuse(index::SegmentId id, const geometry::Frame&) const {
  throw std::logic_error("SweptBoxes: segment " + std::to_string(id) + " cannot be read");
}

void SweptTree::update(const scenes::Step& step) {
  if (fibers_.ids.empty()) {
    fibers_ = fibersOf(step.start);
    const auto end = static_cast<index::SegmentId>(step.start.points.size());
    start_.reset(0, end, fibers_.ids);
    end_.reset(0, end, fibers_.ids);
  }
  error_ = 0;
  const auto keep = [&](const FiberPolylines& scene, index::SegmentId id,
                        index::KeptSegments& segments) {
    const auto i = static_cast<std::size_t>(id);
    const Point &a = scene.points[i], &b = scene.points[i + 1];
    const geometry::Segment segment{{a[0], a[1], a[2]}, {b[0], b[1], b[2]}, scene.radiusAt(i)};
    segments.set(id, segment);
    error_ = std::max(error_, endPointError(segment));
  };
  for (const index::SegmentId id : fibers_.ids) {
    keep(step.start, id, start_);
    keep(step.end, id, end_);
  }
  fit(step);
}

std::size_t SweptTree::searchImpacts(index::PairSink& sink) const {
  index::MovingRange range{start_.range(), end_.range()};
  range.start.setMostError(error_);
  range.end.setMostError(error_);
  const index::HullFilter filter(range, index::SegmentHulls<index::MovingRange>{range},
                                 /*margin=*/0, start_.usualUnit());
  CandidateBuffer buffer(filter, sink);
  searchCandidates(buffer);
  buffer.flush();
  return buffer.candidates();
}

std::unique_ptr<SweptTree> ourSweptTree() { return std::make_unique<OurSweptTree>(); }
#ifdef FCL_FIBERS_WITH_EMBREE
std::unique_ptr<SweptTree> embreeSweptTree(bool morton) {
  return std::make_unique<EmbreeSweptTree>(morton);
}
#endif

}  // namespace fcl_fibers::benchmarks
