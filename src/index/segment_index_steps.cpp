// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "index/segment_index.h"

namespace fcl_fibers::index {

using geometry::FrameChange;
using geometry::Segment;

bool SegmentIndex::fitStart(const SegmentSource& source) {
  step_ = Step::kNone;
  if (start_ == nullptr) start_ = std::make_unique<End>(fitted());
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
  fitted();
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
    for (SegmentId id = its.begin(); id < its.end(); ++id)
      own.set(id, change.around(its[id], FrameChange::Grows::kAll));
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
      if (has_moved) start = change.around(before, FrameChange::Grows::kAll);
    }
    segments.set(id, start);
  }
  start_->frame = frame();
  start_->tree = now_.tree;
  fitFromSegments(*start_, padding());
}

}  // namespace fcl_fibers::index
