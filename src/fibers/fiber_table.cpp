// SPDX-License-Identifier: BSD-3-Clause
#include "fibers/fiber_table.h"

#include <algorithm>
#include <utility>

namespace fcl_fibers::fibers {
namespace {

/// Makes room for `count` elements. It grows by factors, so that adding one by one stays linear.
template <class Vector>
void reserveFor(Vector& vector, std::size_t count) {
  if (count <= vector.capacity()) return;
  vector.reserve(std::max(count, vector.capacity() + vector.capacity() / 2));
}

}  // namespace

void FiberTable::reserve(std::size_t fibers, std::size_t ids, const Kinds& kinds) {
  const std::size_t count = begin_.size() + fibers;
  reserveFor(begin_, count);
  if (!numbers_.empty() || next_number_ != begin_.size()) reserveFor(numbers_, count);
  if (needsFlags(kinds.are_closed, kinds.are_obstacles)) reserveFor(flags_, count);
  if (kinds.have_groups || !groups_.empty()) reserveFor(groups_, count);
  if (kinds.have_obstacle_rules || !obstacle_rules_.empty()) reserveFor(obstacle_rules_, count);
  if (hasArcLengths()) reserveFor(arc_end_, static_cast<std::size_t>(end_) + ids);
  if (rule_.ignoresAny()) reserveFor(joints_, joints_.size() + kinds.joints);
}

void FiberTable::clear() {
  end_ = 0;
  begin_.clear();
  gaps_.clear();
  numbers_.clear();
  next_number_ = 0;
  flags_.clear();
  groups_.clear();
  obstacle_rules_.clear();
  arc_end_.clear();
  has_closed_ = false;
  joints_.clear();
  joined_.reset();
}

tree::Fibers FiberTable::segments(parallel::Executor* executor) const {
  constexpr std::size_t kRange = 16384;
  tree::Fibers fibers;
  fibers.begin.reserve(begin_.size() + 1);
  std::int32_t count = 0;
  for (std::size_t f = 0; f < begin_.size(); ++f) {
    count += std::max(0, segmentsEnd(f) - begin_[f]);
    fibers.begin.push_back(count);
  }
  fibers.groups = groups_;
  fibers.ids.resize(static_cast<std::size_t>(count));
  if (!obstacle_rules_.empty()) fibers.meets.resize(fibers.ids.size());
  parallel::forRanges(executor, fibers.ids.size(), kRange, [&](std::size_t from, std::size_t to) {
    const auto begin = fibers.begin.begin();
    auto next = std::upper_bound(begin, fibers.begin.end(), static_cast<std::int32_t>(from));
    for (std::size_t i = from; i < to; ++next) {
      const auto f = static_cast<std::size_t>(next - begin) - 1;
      const std::size_t end = std::min(to, static_cast<std::size_t>(*next));
      SegmentId id = begin_[f] + static_cast<SegmentId>(i) - fibers.begin[f];
      for (; i < end; ++i, ++id) {
        fibers.ids[i] = id;
        if (!fibers.meets.empty()) fibers.meets[i] = meets(id, f);
      }
    }
  });
  return fibers;
}

bool FiberTable::areNeighborsInFiber(SegmentId first, SegmentId last) const {
  if (!rule_.ignoresAny()) return false;
  const std::size_t fiber = fiberOf(first);
  const std::uint8_t flags = flags_.empty() ? 0 : flags_[fiber];
  if (last >= fiberEnd(fiber) || (flags & kHasNoNeighbors) != 0) return false;
  const FiberRange range{begin_[fiber], segmentsEnd(fiber), (flags & kIsClosed) != 0};
  return fibers::areNeighbors(rule_, range, arc_end_.data(), first, last);
}

// Numbers of fibers tell after a drop which fibers were joined, and need no memory.
void FiberTable::nameJointsByNumber() {
  for (auto& [p, q] : joints_) {
    p.fiber = numbers_[p.fiber];
    q.fiber = numbers_[q.fiber];
  }
  joined_.reset();
}

/// After nameJointsByNumber(), which has a fiber named by its position again.
void FiberTable::forgetLostJoints() {
  const auto isLost = [this](FiberPoint& point) {
    const auto place = std::lower_bound(numbers_.begin(), numbers_.end(), point.fiber);
    const bool is_lost = place == numbers_.end() || *place != point.fiber;
    point.fiber = static_cast<std::uint32_t>(place - numbers_.begin());
    return is_lost;
  };
  joints_.erase(std::remove_if(joints_.begin(), joints_.end(),
                               [&](Joint& j) { return isLost(j.first) || isLost(j.second); }),
                joints_.end());
}

void FiberTable::settleJoints(const std::function<bool(SegmentId, SegmentId)>& is_there) const {
  if (!hasUnsettledJoints()) return;
  const auto isLeft = [&](const FiberPoint& point) {
    return is_there(begin_[point.fiber], fiberEnd(point.fiber));
  };
  using Place = JointGraph::Place;
  std::vector<Place> ends;
  for (const auto& [p, q] : joints_) {
    if (!isLeft(p) || !isLeft(q)) continue;
    ends.push_back(placeAt(p));
    ends.push_back(placeAt(q));
  }
  // Paths also lead around a closed fiber.
  const std::size_t joined_ends = ends.size();
  for (std::size_t i = 0; has_closed_ && i < joined_ends; ++i) {
    const std::uint32_t fiber = ends[i].point.fiber;
    if ((flags_[fiber] & kIsClosed) == 0) continue;
    ends.push_back(placeAt({fiber, 0}));
    ends.push_back(placeAt({fiber, segmentsEnd(fiber) - begin_[fiber]}));
  }
  auto joined = std::make_shared<JointGraph>(rule_, ends, end_);
  const std::vector<Place>& places = joined->places();
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto [fiber, number] = places[i].point;
    const auto placeBeside = [&, f = fiber](std::size_t k) {
      return k < places.size() && places[k].point.fiber == f ? &places[k] : nullptr;
    };
    const Place *const here = &places[i], *const before = placeBeside(i - 1),
                       *const after = placeBeside(i + 1);
    // Beyond the next place of the fiber that one is nearer.
    const SegmentId begin = begin_[fiber];
    const SegmentId first = before != nullptr ? before->point.number : 0;
    const SegmentId last = after != nullptr ? after->point.number : segmentsEnd(fiber) - begin;
    const auto areNear = [&](const Place& p, const Place& q) {
      return q.point.number - p.point.number < rule_.reach ||
             (rule_.arc_length > 0 && q.arc - p.arc <= rule_.arc_length);
    };
    for (SegmentId n = number; n < last; ++n) {
      const Place from = placeAt({fiber, n});
      if (!areNear(*here, from)) break;
      joined->addNear(begin + n, from, placeAt({fiber, n + 1}), here, after);
    }
    for (SegmentId n = number; n > first; --n) {
      const Place to = placeAt({fiber, n});
      if (!areNear(to, *here)) break;
      joined->addNear(begin + n - 1, placeAt({fiber, n - 1}), to, before, here);
    }
  }
  joined_ = std::move(joined);
}

}  // namespace fcl_fibers::fibers
