// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/continuous_index.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "broadphase/shape_box.h"

namespace fcl_fibers::broadphase {

using geometry::Frame;
using geometry::MovingSegment;
using geometry::Segment;
using geometry::Vec3d;
using tree::SegmentId;
using tree::Visit;

namespace {

enum class Part { kStart, kEnd, kWhole };

Corners cornersOf(const Segment& segment) {
  const double r = segment.thickness();
  const Vec3d by{r, r, r};
  return {min(segment.a, segment.b) - by, max(segment.a, segment.b) + by};
}

Segment partOf(const MovingSegment& moving, Part part) {
  if (part != Part::kWhole) return part == Part::kStart ? moving.start : moving.end;
  if (moving.start == moving.end) return moving.start;
  const Corners p = cornersOf(moving.start), q = cornersOf(moving.end);
  return Segment::box(min(p.low, q.low), max(p.high, q.high));
}

/// Capsules that overflow in this frame become boxes.
MovingSegment inFrame(const MovingSegment& moving, const Frame& frame) {
  const auto capsule = [&](const Segment& s) {
    return Segment{frame.fromWorld(s.a), frame.fromWorld(s.b), frame.scale * s.radius};
  };
  const auto isFinite = [](const Segment& s) { return isBounded(s) && std::isfinite(s.radius); };
  if (!moving.start.isBox()) {
    const MovingSegment result{capsule(moving.start), capsule(moving.end)};
    if (isFinite(result.start) && isFinite(result.end)) return result;
  }
  const auto box = [&](const Segment& s) {
    const Corners corners = inFrame(cornersOf(s), frame);
    return Segment::box(corners.low, corners.high);
  };
  return {box(moving.start), box(moving.end)};
}

/// Restricts [from, to] to the times at which a line from `start` to `end` is at most 0.
void restrict(double start, double end, double& from, double& to) {
  if (start > 0 && end > 0) to = -1;
  constexpr double kRounding = 8 * std::numeric_limits<double>::epsilon();
  const double time = 0.5 * start / (0.5 * start - 0.5 * end);  // halves do not overflow
  if (start > 0 && end <= 0) from = std::max(from, time * (1 - kRounding));
  if (start <= 0 && end > 0) to = std::min(to, time * (1 + kRounding));
}

/// Whether the boxes of both are at one time no further apart than the limit on every axis.
bool mayComeWithin(const MovingSegment& p, const MovingSegment& q, double limit) {
  const Corners boxes[2][2] = {{cornersOf(p.start), cornersOf(p.end)},
                               {cornersOf(q.start), cornersOf(q.end)}};
  double from = 0, to = 1;
  for (const auto axis : {&Vec3d::x, &Vec3d::y, &Vec3d::z}) {
    for (const int first : {0, 1}) {
      const auto &a = boxes[first], &b = boxes[1 - first];
      double gap[2];
      for (const int end : {0, 1}) {
        const double low = a[end].low.*axis, high = b[end].high.*axis;
        const double rounding =
            64 * std::numeric_limits<double>::epsilon() * std::max(std::fabs(low), std::fabs(high));
        gap[end] = low - high - limit - rounding;
      }
      restrict(gap[0], gap[1], from, to);
    }
  }
  return from <= to;
}

}  // namespace

class ContinuousIndex::Source final : public index::SegmentSource {
 public:
  Source(const MovingSegments& moving, Part part) : moving_(moving), part_(part) {}

  bool read(const SegmentId* ids, int count, int /*ahead*/, const Frame& frame,
            index::SegmentBlock& out, index::BlockMask& present) const override {
    for (int i = 0; i < count; ++i) {
      out.set(i, partOf(inFrame(moving_[static_cast<std::size_t>(ids[i])], frame), part_));
    }
    present = geometry::firstOfBlock(count);
    return true;
  }
  bool staysFiniteIn(const Frame&) const override { return true; }
  bool isFasterInOrder() const override { return false; }
  [[noreturn]] void refuse(SegmentId, const Frame&) const override {
    std::abort();  // read() reads all
  }

 private:
  const MovingSegments& moving_;
  const Part part_;
};

class ContinuousIndex::NearSink final : public index::NearestSink {
 public:
  /// @param second  the index of the second segment of each pair
  NearSink(const ContinuousIndex& first, const ContinuousIndex& second, double limit,
           const VisitNear& visit)
      : first_(first.moving_),
        second_(second.moving_),
        source_(first.moving_, Part::kWhole),
        scale_(first.frame().scale),
        limit_(limit),
        visit_(visit) {}

  double limit() const override { return limit_ * scale_; }
  const index::SegmentSource& source() const override { return source_; }
  Visit visit(SegmentId a, SegmentId b, double& nearer_than) override {
    Visit next = Visit::kContinue;
    if (mayComeWithin(first_[static_cast<std::size_t>(a)], second_[static_cast<std::size_t>(b)],
                      limit_)) {
      next = visit_(a, b, limit_);
    }
    nearer_than = limit();
    return next;
  }

 private:
  const MovingSegments &first_, &second_;
  const Source source_;
  const double scale_;
  double limit_;
  const VisitNear& visit_;
};

void ContinuousIndex::build(MovingSegments moving, const tree::Fibers& fibers,
                            std::optional<Frame> frame) {
  moving_ = std::move(moving);
  has_whole_ = false;
  const Source start(moving_, Part::kStart), end(moving_, Part::kEnd);
  const auto count = static_cast<SegmentId>(moving_.size());
  if (!frame || !start_.tryBuild(start, *frame, 0, count, fibers)) {
    start_.build(start, frameFor(Source(moving_, Part::kWhole), fibers.ids), 0, count, fibers);
  }
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
  bool is_tight = true;
  std::vector<Segment> segments(ids.size());
  for (const Part part : {Part::kStart, Part::kEnd}) {
    for (std::size_t i = 0; i < ids.size(); ++i) {
      segments[i] = partOf(inFrame(moved[i], frame()), part);
    }
    is_tight &= (part == Part::kStart ? start_ : end_).refitSome(ids, segments);
  }
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

const index::SegmentIndex& ContinuousIndex::whole() const {
  const std::lock_guard<std::mutex> lock(whole_mutex_);
  if (!has_whole_) {
    whole_.copy(start_);
    whole_.tryRefit(Source(moving_, Part::kWhole), frame());
    has_whole_ = true;
  }
  return whole_;
}

Visit ContinuousIndex::search(index::PairSink& sink) const {
  return options().capsules ? step().searchImpacts(nullptr, sink)
                            : step().searchMoving(nullptr, sink);
}

Visit ContinuousIndex::search(const ContinuousIndex& other, index::PairSink& sink) const {
  const bool tests_capsules = options().capsules;
  if (start_.matches(other.start_) && (!tests_capsules || other.options().capsules)) {
    return tests_capsules ? step().searchImpacts(other.step(), nullptr, sink)
                          : step().searchMoving(other.step(), nullptr, sink);
  }
  for (const SegmentId b : other.start_.leaves()) {
    const MovingSegment moving = inFrame(other.moving_[static_cast<std::size_t>(b)], frame());
    const double error = endPointError(moving);
    const Visit next = tests_capsules
                           ? step().searchImpacts(moving, error, tree::kNoGroup, b, nullptr, sink)
                           : step().searchMoving(moving, error, tree::kNoGroup, b, nullptr, sink);
    if (next == Visit::kStop) return next;
  }
  return Visit::kContinue;
}

Visit ContinuousIndex::searchNear(double limit, const VisitNear& visit) const {
  NearSink sink(*this, *this, limit, visit);
  return whole().search(sink);
}

Visit ContinuousIndex::searchNear(const ContinuousIndex& other, double limit,
                                  const VisitNear& visit) const {
  NearSink sink(*this, other, limit, visit);
  const Source source(other.moving_, Part::kWhole);
  return whole().search(other.whole(), &source, sink);
}

}  // namespace fcl_fibers::broadphase
