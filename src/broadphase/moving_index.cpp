// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/moving_index.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "broadphase/frame_of_other.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Frame;
using geometry::Segment;
using index::SegmentIndex;
using index::SegmentSource;
using tree::Visit;

/// A segment at the start and in one frame with the end of the step.
class StartInFrame {
 public:
  StartInFrame(const Frame& from, const Frame& to) : from_(from), change_(from, to) {}

  Segment operator()(const Segment& start, SegmentId id, const Segment& end,
                     const SegmentSource& objects) const {
    return ofKind(end, change_.isIdentity() ? start : moved(start, id, end, objects));
  }

 private:
  /// What has not moved must rest in the new frame, too, whatever the rounding.
  Segment moved(const Segment& start, SegmentId id, const Segment& end,
                const SegmentSource& objects) const {
    Segment now;
    if (objects.readNow(id, from_, now) && now == start) return end;
    return change_.grown(start);
  }

  /// If an object counts by its box at the end, it does so at the start.
  static Segment ofKind(const Segment& end, const Segment& start) {
    if (!end.isBox() || start.isBox()) return start;
    return boxAround(start, endPointError(start));
  }

  const Frame from_;
  const FrameOfOther change_;
};

/// Reads segments at the start by startOf(id, segment at the end). What the end index has can be
/// read.
template <class StartOf>
class StartSource final : public SegmentSource {
 public:
  StartSource(const SegmentIndex& end, const StartOf& startOf) : end_(end), start_of_(startOf) {}

  bool read(const SegmentId* ids, int count, int /*ahead*/, const Frame& /*frame*/,
            index::SegmentBlock& out, index::BlockMask& present) const override {
    for (int i = 0; i < count; ++i) out.set(i, start_of_(ids[i], end_.segment(ids[i])));
    present = geometry::firstOfBlock(count);
    return true;
  }
  bool staysFiniteIn(const Frame& /*frame*/) const override { return true; }
  bool isFasterInOrder() const override { return false; }
  [[noreturn]] void refuse(SegmentId /*id*/, const Frame& /*frame*/) const override {
    throw std::logic_error("fcl_fibers: every segment at the start can be read");
  }

 private:
  const SegmentIndex& end_;
  const StartOf& start_of_;
};

}  // namespace

RememberedSegments::RememberedSegments(const SegmentIndex& index) : frame_(index.frame()) {
  std::vector<SegmentId> ids = index.leaves();
  std::sort(ids.begin(), ids.end());
  segments_.reserve(ids.size());
  for (const SegmentId id : ids) segments_.push_back({id, index.segment(id)});
}

const Segment* RememberedSegments::find(SegmentId id) const {
  const auto found =
      std::lower_bound(segments_.begin(), segments_.end(), id,
                       [](const Entry& entry, SegmentId other) { return entry.id < other; });
  return found == segments_.end() || found->id != id ? nullptr : &found->segment;
}

void MovingIndex::copy(const MovingIndex& other) {
  clear();
  end_.copy(other.end_);
  is_read_ = false;
}

void MovingIndex::clear() {
  end_.clear();
  start_ = nullptr;
  moved_all_ = is_read_ = true;
  moved_.clear();
  before_.reset();
}

std::unique_ptr<SegmentIndex> MovingIndex::copyOfEnd() const {
  auto copy = std::make_unique<SegmentIndex>(end_.options());
  copy->copy(end_);
  return copy;
}

void MovingIndex::makeStart() {
  if (!moves_ || start_ != nullptr || before_ || !is_read_ || empty()) return;
  start_ = copyOfEnd();
  moved_.clear();
  moved_all_ = false;
}

void MovingIndex::beginStep(bool all) {
  if (before_) {
    before_->start = before_->end;
    return;
  }
  makeStart();
  if (start_ == nullptr) return;
  if (all) {
    std::swap(*start_, end_);
  } else if (moved_all_) {
    start_ = copyOfEnd();
  } else {
    std::vector<Segment> segments;
    for (const SegmentId id : moved_) segments.push_back(end_.segment(id));
    start_->refitSome(moved_, segments);
  }
  moved_.clear();
  moved_all_ = all;
}

void MovingIndex::remember() {
  if (!moves_ || before_ || !is_read_ || empty()) return;
  const RememberedSegments end(end_);
  before_ = Before{start_ ? RememberedSegments(*start_) : end, end};
}

/// Another index takes the segments.
void MovingIndex::leave() {
  remember();
  end_.clear();
  start_ = nullptr;
}

void MovingIndex::fitStart(const SegmentSource& source, const MovingIndex* others) {
  struct Known {
    const RememberedSegments& segments;
    StartInFrame in_frame;
  };
  std::vector<Known> all;
  for (const MovingIndex* index : {static_cast<const MovingIndex*>(this), others}) {
    if (index == nullptr || !index->before_) continue;
    const RememberedSegments& start = index->before_->start;
    all.push_back({start, {start.frame(), end_.frame()}});
  }
  if (all.empty()) return;
  const auto startOf = [&](SegmentId id, const Segment& end) {
    for (const Known& known : all) {
      const Segment* start = known.segments.find(id);
      if (start != nullptr) return known.in_frame(*start, id, end, source);
    }
    return end;
  };
  start_ = copyOfEnd();
  start_->tryRefit(StartSource(end_, startOf), end_.frame());
}

/// Takes the start into the frame of the end.
void MovingIndex::followFrame(const SegmentSource& source) {
  if (start_ == nullptr) return;
  if (geometry::FrameChange(start_->frame(), end_.frame()).isIdentity()) return;
  const StartInFrame in_frame(start_->frame(), end_.frame());
  // Each segment is read before it is replaced.
  const auto startOf = [&](SegmentId id, const Segment& end) {
    return in_frame(start_->segment(id), id, end, source);
  };
  start_->tryRefit(StartSource(end_, startOf), end_.frame());
}

/// The end is about to be read again.
void MovingIndex::moveAll() {
  makeStart();
  moved_all_ = true;
}

bool MovingIndex::refit(const SegmentSource& source) {
  moveAll();
  const bool is_good = end_.refit(source);
  is_read_ = true;
  followFrame(source);
  return is_good;
}

bool MovingIndex::tryRefit(const SegmentSource& source, const Frame& frame) {
  moveAll();
  if (!end_.tryRefit(source, frame)) return false;
  is_read_ = true;
  followFrame(source);
  return true;
}

bool MovingIndex::refitSome(const std::vector<SegmentId>& ids, const std::vector<Segment>& moved) {
  makeStart();
  if (moves_ && !moved_all_) {
    moved_.insert(moved_.end(), ids.begin(), ids.end());
    moved_all_ = moved_.size() > static_cast<std::size_t>(end_.end() - end_.begin()) / 4;
  }
  return end_.refitSome(ids, moved);
}

Visit MovingIndex::search(index::PairSink& sink) const {
  return moves_ ? step().searchImpacts(nullptr, sink) : end_.search(sink);
}

Visit MovingIndex::search(const MovingSegment& segment, double error, tree::Group group,
                          SegmentId second, index::PairSink& sink) const {
  return moves_ ? step().searchImpacts(segment, error, group, second, nullptr, sink)
                : end_.search(segment.end, error, group, second, sink);
}

Visit MovingIndex::search(const MovingIndex& other, const SegmentSource* source,
                          index::PairSink& sink) const {
  if (!moves_) return end_.search(other.end_, source, sink);
  const index::SegmentIndex& theirs = *other;
  if (end_.matches(theirs) && theirs.keepsSegments()) {
    return step().searchImpacts(other.step(), nullptr, sink);
  }
  const FrameOfOther change(theirs.frame(), end_.frame());
  for (const SegmentId b : theirs.leaves()) {
    MovingSegment segment;
    if (theirs.keepsSegments()) {
      segment = other.segment(b);
    } else if (readOne(*source, b, theirs.frame(), segment.end)) {
      segment.start = segment.end;
    } else {
      continue;
    }
    segment = {change(segment.start), change(segment.end)};
    const double error = std::max(change.error(segment.start), change.error(segment.end));
    if (search(segment, error, tree::kNoGroup, b, sink) == Visit::kStop) return Visit::kStop;
  }
  return Visit::kContinue;
}

std::size_t MovingIndex::memoryUsage() const {
  return end_.memoryUsage() + (start_ ? sizeof(*start_) + start_->memoryUsage() : 0) +
         moved_.capacity() * sizeof(SegmentId);
}

}  // namespace fcl_fibers::broadphase
