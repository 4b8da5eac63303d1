// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/continuous_index.h"

#include <algorithm>
#include <utility>

#include "broadphase/shape_box.h"
#include "geometry/impact.h"

namespace fcl_fibers::broadphase {

using geometry::Frame;
using geometry::MovingSegment;
using geometry::Segment;
using tree::SegmentId;
using tree::Visit;

namespace {

using Part = ContinuousIndex::Part;

Segment partOf(const MovingSegment& moving, Part part) {
  if (part != Part::kWhole) return part == Part::kStart ? moving.start : moving.end;
  if (moving.start == moving.end) return moving.start;
  const Segment p = boxAround(moving.start, 0), q = boxAround(moving.end, 0);
  return Segment::box(min(p.a, q.a), max(p.b, q.b));
}

/// Capsules that overflow in this frame become boxes.
MovingSegment movingIn(const Frame& frame, const MovingSegment& moving) {
  const auto capsule = [&](const Segment& s) {
    return Segment{frame.fromWorld(s.a), frame.fromWorld(s.b), frame.scale * s.radius};
  };
  if (!moving.start.isBox()) {
    const MovingSegment result{capsule(moving.start), capsule(moving.end)};
    if (isFinite(result.start) && isFinite(result.end)) return result;
  }
  const auto box = [&](const Segment& s) {
    const Segment around = boxAround(s, 0);
    const Corners corners = inFrame(Corners{around.a, around.b}, frame);
    return Segment::box(corners.low, corners.high);
  };
  return {box(moving.start), box(moving.end)};
}

}  // namespace

bool ContinuousIndex::Source::read(const SegmentId* ids, int count, int /*ahead*/,
                                   const Frame& frame, index::SegmentBlock& out,
                                   index::BlockMask& present) const {
  for (int i = 0; i < count; ++i) {
    out.set(i, partOf(movingIn(frame, moving_[static_cast<std::size_t>(ids[i])]), part_));
  }
  present = geometry::firstOfBlock(count);
  return true;
}

/// Hands on the pairs whose boxes come within the limit at one time.
class ContinuousIndex::NearSink final : public index::NearestSink {
 public:
  /// @param second  of each pair, from the id `second_begin` on
  NearSink(const ContinuousIndex& first, const MovingSegment* second, SegmentId second_begin,
           index::NearestSink& sink)
      : first_(first), second_(second), second_begin_(second_begin), sink_(sink) {}

  double limit() const override { return sink_.limit(); }
  const index::SegmentSource& source() const override { return sink_.source(); }
  Visit visit(SegmentId a, SegmentId b, double& limit) override {
    geometry::Impact impact;
    return findBoxImpact(first_.moving_[static_cast<std::size_t>(a)], second_[b - second_begin_],
                         limit / first_.frame().scale, /*from=*/0, impact)
               ? sink_.visit(a, b, limit)
               : Visit::kContinue;
  }

 private:
  const ContinuousIndex& first_;
  const MovingSegment* second_;
  const SegmentId second_begin_;
  index::NearestSink& sink_;
};

MovingSegment ContinuousIndex::inFrame(const MovingSegment& moving) const {
  return movingIn(frame(), moving);
}

void ContinuousIndex::build(MovingSegments moving, const tree::Fibers& fibers) {
  moving_ = std::move(moving);
  has_whole_ = false;
  const Source start(moving_, Part::kStart), end(moving_, Part::kEnd);
  start_.build(start, frameFor(whole(), fibers.ids), 0, static_cast<SegmentId>(moving_.size()),
               fibers);
  end_.copy(start_);
  end_.tryRefit(end, start_.frame());
}

bool ContinuousIndex::refit(MovingSegments moving) {
  moving_ = std::move(moving);
  has_whole_ = false;
  const bool is_tight = start_.refit(Source(moving_, Part::kStart));
  end_.tryRefit(Source(moving_, Part::kEnd), start_.frame());
  return is_tight;
}

bool ContinuousIndex::refitSome(const std::vector<SegmentId>& ids, const MovingSegments& moved) {
  has_whole_ = false;
  std::vector<Segment> segments(ids.size());
  const auto refitPart = [&](index::SegmentIndex& index, Part part) {
    for (std::size_t i = 0; i < ids.size(); ++i) {
      segments[i] = partOf(inFrame(moved[i]), part);
    }
    return index.refitSome(ids, segments);
  };
  // A build looks at the start, so it does not help where fibers part during their motions.
  const bool is_tight = refitPart(start_, Part::kStart);
  refitPart(end_, Part::kEnd);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    moving_[static_cast<std::size_t>(ids[i])] = moved[i];
  }
  return is_tight;
}

void ContinuousIndex::clear() {
  moving_.clear();
  for (index::SegmentIndex* index : {&start_, &end_, &whole_}) index->clear();
  has_whole_ = false;
}

const index::SegmentIndex& ContinuousIndex::wholeIndex() const {
  const std::lock_guard<std::mutex> lock(whole_mutex_);
  if (!has_whole_) {
    whole_.copy(start_);
    whole_.tryRefit(whole(), frame());
    has_whole_ = true;
  }
  return whole_;
}

Visit ContinuousIndex::search(index::PairSink& sink) const {
  return options().capsules ? step().searchImpacts(nullptr, sink)
                            : step().searchMoving(nullptr, sink);
}

Visit ContinuousIndex::search(index::NearestSink& sink) const {
  NearSink near(*this, moving_.data(), 0, sink);
  return wholeIndex().search(near);
}

Visit ContinuousIndex::search(const MovingSegment& moving, tree::Group group, SegmentId second,
                              index::PairSink& sink) const {
  const MovingSegment one = inFrame(moving);
  const double error = endPointError(one);
  return options().capsules ? step().searchImpacts(one, error, group, second, nullptr, sink)
                            : step().searchMoving(one, error, group, second, nullptr, sink);
}

Visit ContinuousIndex::search(const MovingSegment& moving, tree::Group group, SegmentId second,
                              index::NearestSink& sink) const {
  const Segment around = partOf(inFrame(moving), Part::kWhole);
  NearSink near(*this, &moving, second, sink);
  return wholeIndex().search(around, endPointError(around), group, second, near);
}

Visit ContinuousIndex::search(const ContinuousIndex& other, index::PairSink& sink) const {
  if (start_.matches(other.start_) && (!options().capsules || other.options().capsules)) {
    return options().capsules ? step().searchImpacts(other.step(), nullptr, sink)
                              : step().searchMoving(other.step(), nullptr, sink);
  }
  for (const SegmentId b : other.start_.leaves()) {
    const MovingSegment& moving = other.moving_[static_cast<std::size_t>(b)];
    if (search(moving, tree::kNoGroup, b, sink) == Visit::kStop) return Visit::kStop;
  }
  return Visit::kContinue;
}

Visit ContinuousIndex::search(const ContinuousIndex& other, index::NearestSink& sink) const {
  NearSink near(*this, other.moving_.data(), 0, sink);
  const Source its_source = other.whole();
  return wholeIndex().search(other.wholeIndex(), &its_source, near);
}

std::size_t ContinuousIndex::memoryUsage() const {
  const std::lock_guard<std::mutex> lock(whole_mutex_);  // a query may be building
  return moving_.capacity() * sizeof(MovingSegment) + start_.memoryUsage() + end_.memoryUsage() +
         whole_.memoryUsage();
}

}  // namespace fcl_fibers::broadphase
