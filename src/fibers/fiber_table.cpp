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

void FiberTable::forgetLostJoints() {
  const auto isLost = [this](const FiberPoint& p) { return positionOf(p.fiber) == begin_.size(); };
  joints_.erase(std::remove_if(joints_.begin(), joints_.end(),
                               [&](Joint& j) { return isLost(j.first) || isLost(j.second); }),
                joints_.end());
  joined_.reset();
}

void FiberTable::settleJoints(const std::function<bool(SegmentId, SegmentId)>& is_there) const {
  if (!hasUnsettledJoints()) return;
  using Place = JointGraph::Place;
  const auto placeAt = [this](std::size_t fiber, SegmentId number) -> Place {
    const bool has_arc = hasArcLengths() && number > 0;
    const auto last = static_cast<std::size_t>(begin_[fiber] + number - 1);
    return {fiber, {static_cast<double>(number), has_arc ? arc_end_[last] : 0}};
  };
  std::vector<Place> ends;
  for (const auto& [p, q] : joints_) {
    const std::size_t fibers[] = {positionOf(p.fiber), positionOf(q.fiber)};
    const auto isLeft = [&](std::size_t f) { return is_there(begin_[f], fiberEnd(f)); };
    if (!std::all_of(fibers, fibers + 2, isLeft)) continue;
    ends.push_back(placeAt(fibers[0], p.number));
    ends.push_back(placeAt(fibers[1], q.number));
    for (const std::size_t f : fibers) {
      // Paths also lead around a closed fiber.
      if (!has_closed_ || (flags_[f] & kIsClosed) == 0) continue;
      ends.push_back(placeAt(f, 0));
      ends.push_back(placeAt(f, segmentsEnd(f) - begin_[f]));
    }
  }
  auto joined = std::make_shared<JointGraph>(rule_, ends, end_);
  const std::vector<Place>& places = joined->places();
  for (std::size_t next = 0; next < places.size();) {
    const std::size_t f = places[next].fiber;
    const auto isNextAt = [&](const Place& p) {
      return next < places.size() && places[next].fiber == f && places[next].way[0] <= p.way[0];
    };
    Place from = placeAt(f, 0);
    for (SegmentId id = begin_[f]; id < segmentsEnd(f); ++id) {
      const Place to = placeAt(f, id + 1 - begin_[f]);
      if (isNextAt(from)) ++next;
      joined->add(id, from, to, next);
      from = to;
    }
    if (isNextAt(from)) ++next;
  }
  joined_ = std::move(joined);
}

}  // namespace fcl_fibers::fibers
