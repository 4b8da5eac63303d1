// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <fcl_fibers/fiber_options.h>
#include <fcl_fibers/tree_export.h>

#include "fibers/fiber_of.h"
#include "fibers/joint_graph.h"
#include "fibers/neighbor_rule.h"
#include "parallel/executor.h"
#include "parallel/unwritten.h"
#include "tree/topology.h"

namespace fcl_fibers::fibers {

using tree::Group;
using tree::kNoGroup;
using tree::SegmentId;

/// Which ids form a fiber, which of them are neighbours, and which group each fiber has. A fiber
/// owns a run of ids, which ascend along it. The runs follow each other from 0 on, if there are no
/// gaps between them. Fibers may be joined at points, so that they form trees and loops.
///
/// Arrays that the rule, the groups and the fibers do not need stay empty.
class FiberTable {
 public:
  /// @param ids_behind  number of ids at the end of each fiber that are not segments: 1 if ids are
  ///                    points, because the last point starts no segment
  explicit FiberTable(const NeighborRule& rule, SegmentId ids_behind = 0)
      : rule_(rule), ids_behind_(ids_behind) {}

  // --- Growing ---

  /// Properties of a fiber.
  struct Kind {
    /// Whether the neighbour rule applies to it. If not, it is an obstacle.
    bool has_neighbors = true;
    bool closed = false;
    Group group = kNoGroup;
    /// Which obstacles it may meet, or which fibers if it is an obstacle.
    tree::Categories categories = tree::kAllCategories;
    SegmentId roots = 0;    ///< its first segments, which meet no obstacle
    bool is_solid = false;  ///< whether an obstacle's inside counts
    bool is_rigid = false;  ///< whether an obstacle's points stay the same
  };

  /// What at least one of several fibers has, so that reserve() knows which arrays need room.
  struct Kinds {
    bool are_closed = false;           ///< some are closed
    bool have_groups = false;          ///< some have a group
    bool have_obstacle_rules = false;  ///< some have categories or roots of their own
    bool are_obstacles = false;        ///< some are obstacles
    std::size_t joints = 0;            ///< how many times they will be joined

    static Kinds of(const Kind& kind) {
      return {kind.closed, kind.group != kNoGroup,
              kind.roots > 0 || kind.categories != tree::kAllCategories, !kind.has_neighbors};
    }
  };
  /// Makes room, so that adding these fibers and ids cannot throw.
  FCL_FIBERS_TREE_EXPORT void reserve(std::size_t fibers, std::size_t ids, const Kinds& kinds);

  /// Starts a fiber, to which addId() and addIds() add from now on.
  void startFiber(const Kind& kind);

  /// @param length  of the segment; used if the rule has an arc length
  void addId(double length);
  /// If the rule has an arc length, setLengths() has to follow for the fiber.
  void addIds(SegmentId count) {
    end_ += count;
    if (hasArcLengths()) arc_end_.resize(static_cast<std::size_t>(end_));
  }
  /// Sets the lengths of a fiber's segments: lengthOf(i) is that of its id number i. Several
  /// threads may set those of different fibers at the same time.
  template <class LengthOf>
  void setLengths(std::size_t fiber, LengthOf&& lengthOf) {
    double arc = 0;
    for (SegmentId id = begin_[fiber]; id < idsEnd(fiber); ++id) {
      arc += lengthOf(static_cast<std::size_t>(id - begin_[fiber]));
      arc_end_[static_cast<std::size_t>(id)] = arc;
    }
  }

  /// Adds ids that are no segments and of no fiber, before the first fiber or after the last one.
  void addGap(SegmentId count);

  /// Makes two points one. settleJoints() has to follow before neighbours are asked for.
  void join(const FiberPoint& p, const FiberPoint& q) {
    if (!rule_.ignoresAny()) return;
    joints_.emplace_back(p, q);
    joined_.reset();
  }
  /// Call this after a segment was removed. If its fiber has no segment left, the next
  /// settleJoints() leaves out the joints of that fiber.
  template <class IsThere>
  void unsettleJoints(SegmentId id, const IsThere& is_there) {
    if (!hasJoints()) return;
    const std::size_t fiber = fiberOf(id);
    const SegmentId end = fiberEnd(fiber);
    // If a fiber's segments are removed in their order, the next one is mostly still there.
    if (id + 1 < end && is_there(id + 1, id + 2)) return;
    if (!is_there(begin_[fiber], end)) joined_.reset();
  }
  /// Finds which segments are neighbours because of joints, unless that is known.
  /// @param is_there  whether ids [begin, end), which are a fiber, have a segment. If not, the
  ///                  fiber is not joined to any other.
  FCL_FIBERS_TREE_EXPORT void settleJoints(
      const std::function<bool(SegmentId begin, SegmentId end)>& is_there) const;

  /// Makes room, so that drop() cannot throw.
  void reserveForDrop() {
    if (numbers_.empty()) numbers_.reserve(begin_.size());
  }

  /// Removes all fibers. Their numbers start at 0 again.
  FCL_FIBERS_TREE_EXPORT void clear();

  /// Drops the fibers for which keep(begin, end) is false, and calls move(old_id, new_id) for the
  /// ids of the others, in order. Numbers of fibers do not change.
  /// @pre !hasGaps()
  template <class Keep, class Move>
  void drop(Keep&& keep, Move&& move);

  // --- Questions ---

  SegmentId beginOf(std::size_t fiber) const { return begin_[fiber]; }
  SegmentId idsEnd(std::size_t fiber) const {
    return fiberEnd(fiber) - (gaps_.empty() ? 0 : gaps_[fiber]);
  }
  /// Where a segment begins or ends.
  FiberPoint pointOf(SegmentId id, bool at_end) const {
    const std::size_t fiber = fiberOf(id);
    const std::size_t number = numbers_.empty() ? fiber : numbers_[fiber];
    return {static_cast<std::uint32_t>(number), id - begin_[fiber] + (at_end ? 1 : 0)};
  }
  /// The number that the next fiber will have.
  std::uint32_t nextNumber() const { return next_number_; }
  bool hasGaps() const { return !gaps_.empty(); }
  SegmentId idCount() const { return end_; }
  std::size_t fiberCount() const { return begin_.size(); }
  bool hasArcLengths() const { return rule_.arc_length > 0; }
  bool hasJoints() const { return !joints_.empty(); }
  bool hasUnsettledJoints() const { return hasJoints() && joined_ == nullptr; }
  /// Whether the neighbour rule applies to the fiber of a segment.
  bool hasNeighborsOf(SegmentId id) const {
    return flags_.empty() || (flags_[fiberOf(id)] & kHasNoNeighbors) == 0;
  }
  bool hasNeighbors() const { return rule_.ignoresAny(); }
  bool hasObstacleRules() const { return !obstacle_rules_.empty(); }

  /// @pre 0 <= id < idCount()
  FiberSegment placeOf(SegmentId id) const {
    const std::size_t fiber = fiberOf(id);
    return {numbers_.empty() ? fiber : numbers_[fiber],
            static_cast<std::size_t>(id - begin_[fiber])};
  }

  /// Whether the id is one of `ids_behind` or in a gap, and so not a segment.
  bool isBehind(SegmentId id) const {
    return begin_.empty() || id < begin_[0] || id >= segmentsEnd(fiberOf(id));
  }

  /// Whether the rule excludes this pair.
  /// @pre both ids are segments
  bool areNeighbors(SegmentId a, SegmentId b) const {
    const auto [first, last] = std::minmax(a, b);
    return NeighborTest(*this)(first, last);
  }

  /// areNeighbors() for many pairs, each with first <= last. Most are decided without a branch.
  class NeighborTest {
   public:
    explicit NeighborTest(const FiberTable& table)
        : table_(table),
          // If ids are points, a segment and the next id are of one fiber.
          sure_(table.rule_.reach > 0 && table.rule_.reach <= table.ids_behind_ &&
                        table.flags_.empty()
                    ? table.rule_.reach
                    : -1),
          most_in_fiber_(table.has_closed_ || table.rule_.arc_length > 0 ? table.end_
                                                                         : table.rule_.reach),
          joined_(table.joined_.get()),
          most_(joined_ != nullptr ? table.end_ : most_in_fiber_) {}

    bool operator()(SegmentId first, SegmentId last) const {
      const SegmentId apart = last - first;
      bool are_neighbors = apart <= sure_;
      const bool is_open = apart > sure_ && apart <= most_;
      if (is_open) {
        are_neighbors = (joined_ != nullptr && joined_->areNeighbors(first, last)) ||
                        (apart <= most_in_fiber_ && table_.areNeighborsInFiber(first, last));
      }
      return are_neighbors;
    }

   private:
    const FiberTable& table_;
    const SegmentId sure_;            ///< ids at most this far apart are neighbours
    const SegmentId most_in_fiber_;   ///< ids farther apart are not neighbours along a fiber
    const JointGraph* const joined_;  ///< null if there are no joints
    const SegmentId most_;            ///< ids farther apart are not neighbours
  };

  bool hasGroups() const { return !groups_.empty(); }
  Group groupOf(SegmentId id) const { return groups_.empty() ? kNoGroup : groups_[fiberOf(id)]; }
  bool shareGroup(SegmentId a, SegmentId b) const {
    const Group group = groupOf(a);
    return group != kNoGroup && group == groupOf(b);
  }

  /// Whether the id is an obstacle whose inside counts.
  bool isSolid(SegmentId id) const {
    return !flags_.empty() && (flags_[fiberOf(id)] & kIsSolid) != 0;
  }
  /// Whether the id is an obstacle whose points stay the same.
  bool isRigid(SegmentId id) const {
    return !flags_.empty() && (flags_[fiberOf(id)] & kIsRigid) != 0;
  }

  /// Which obstacles a segment may meet. An obstacle meets all others.
  tree::Categories meets(SegmentId id) const { return meets(id, fiberOf(id)); }
  tree::Categories meets(SegmentId id, std::size_t fiber) const {
    const Party party = partyOf(id, fiber);
    return party.is_obstacle ? tree::kAllCategories : party.categories;
  }

  /// A segment of a fiber, or an obstacle.
  struct Party {
    bool is_obstacle;
    tree::Categories categories;

    /// Only a fiber and an obstacle may be kept from meeting.
    bool meets(const Party& other) const {
      return is_obstacle == other.is_obstacle || categories.meet(other.categories);
    }
  };
  Party partyOf(SegmentId id) const { return partyOf(id, fiberOf(id)); }
  Party partyOf(SegmentId id, std::size_t fiber) const {
    const bool is_obstacle = !flags_.empty() && (flags_[fiber] & kHasNoNeighbors) != 0;
    if (obstacle_rules_.empty()) return {is_obstacle, tree::kAllCategories};
    const ObstacleRule& rule = obstacle_rules_[fiber];
    return {is_obstacle, id - begin_[fiber] < rule.roots ? tree::kNoCategories : rule.categories};
  }

  /// The fibers from the one with id `begin` on, with the segments for which is_there(id) is true.
  template <class IsThere>
  tree::Fibers segmentsFrom(SegmentId begin, IsThere&& is_there) const;
  /// All fibers with all their segments.
  /// @param executor  null for one thread
  FCL_FIBERS_TREE_EXPORT tree::Fibers segments(parallel::Executor* executor) const;

  std::size_t memoryUsage() const {
    return joints_.capacity() * sizeof(Joint) + (joined_ != nullptr ? joined_->memoryUsage() : 0) +
           begin_.capacity() * sizeof(SegmentId) + flags_.capacity() +
           numbers_.capacity() * sizeof(std::uint32_t) + groups_.capacity() * sizeof(Group) +
           obstacle_rules_.capacity() * sizeof(ObstacleRule) +
           arc_end_.capacity() * sizeof(double) + gaps_.capacity() * sizeof(SegmentId);
  }

 private:
  static constexpr std::uint8_t kHasNoNeighbors = 1, kIsClosed = 2, kIsSolid = 4, kIsRigid = 8;

  /// Of a fiber or an obstacle. The first segments of a fiber meet no obstacle.
  struct ObstacleRule {
    tree::Categories categories = tree::kAllCategories;
    SegmentId roots = 0;
  };

  bool needsFlags(bool is_closed, bool is_obstacle) const {
    return is_obstacle || (rule_.ignoresAny() && is_closed) || !flags_.empty();
  }
  FCL_FIBERS_TREE_EXPORT bool areNeighborsInFiber(SegmentId first, SegmentId last) const;
  FCL_FIBERS_TREE_EXPORT void forgetLostJoints();
  /// The position of the fiber with this number, or fiberCount() if it was dropped.
  std::size_t positionOf(std::uint32_t number) const {
    if (numbers_.empty()) return std::min<std::size_t>(number, begin_.size());
    const auto place = std::lower_bound(numbers_.begin(), numbers_.end(), number);
    return place != numbers_.end() && *place == number
               ? static_cast<std::size_t>(place - numbers_.begin())
               : numbers_.size();
  }

  std::size_t fiberOf(SegmentId id) const {
    return fibers::fiberOf(begin_.data(), begin_.size(), end_, id);
  }
  SegmentId fiberEnd(std::size_t fiber) const {
    return fiber + 1 < begin_.size() ? begin_[fiber + 1] : end_;
  }
  /// At most the fiber's begin if the fiber has no segment.
  SegmentId segmentsEnd(std::size_t fiber) const { return idsEnd(fiber) - ids_behind_; }

  NeighborRule rule_;
  SegmentId ids_behind_;
  SegmentId end_ = 0;
  std::vector<SegmentId> begin_;        ///< by fiber: its first id
  std::vector<std::uint32_t> numbers_;  ///< by fiber; empty while each is the fiber's position
  std::uint32_t next_number_ = 0;
  std::vector<SegmentId> gaps_;  ///< by fiber: ids of no fiber behind it; empty if there are none
  std::vector<std::uint8_t> flags_;           ///< by fiber; empty while none matters
  std::vector<Group> groups_;                 ///< by fiber; empty unless some fiber has one
  std::vector<ObstacleRule> obstacle_rules_;  ///< by fiber; empty if all may meet
  /// By id: the length of the fiber from its start to the end of the segment. Empty unless arc
  /// lengths matter.
  parallel::UnwrittenVector<double> arc_end_;
  bool has_closed_ = false;
  std::vector<Joint> joints_;
  mutable std::shared_ptr<const JointGraph>
      joined_;  ///< null if there are no joints, or they are not settled
};

inline void FiberTable::startFiber(const Kind& kind) {
  if (kind.group != kNoGroup || !groups_.empty()) {
    groups_.resize(begin_.size(), kNoGroup);
    groups_.push_back(kind.group);
  }
  if (Kinds::of(kind).have_obstacle_rules || !obstacle_rules_.empty()) {
    obstacle_rules_.resize(begin_.size());
    obstacle_rules_.push_back({kind.categories, kind.roots});
  }
  const auto flags = static_cast<std::uint8_t>(
      (kind.has_neighbors ? 0 : kHasNoNeighbors) | (kind.closed ? kIsClosed : 0) |
      (kind.is_solid ? kIsSolid : 0) | (kind.is_rigid ? kIsRigid : 0));
  if (needsFlags(kind.closed, !kind.has_neighbors)) {
    flags_.resize(begin_.size(), 0);
    flags_.push_back(flags);
    has_closed_ = has_closed_ || (kind.closed && rule_.ignoresAny());
  }
  if (!gaps_.empty()) gaps_.push_back(0);
  begin_.push_back(end_);
  if (!numbers_.empty() || next_number_ + 1 != begin_.size()) numbers_.push_back(next_number_);
  ++next_number_;
}

inline void FiberTable::addId(double length) {
  if (hasArcLengths()) {
    const bool is_first = begin_.back() == end_;
    arc_end_.push_back((is_first ? 0 : arc_end_.back()) + length);
  }
  ++end_;
}

inline void FiberTable::addGap(SegmentId count) {
  if (count == 0) return;
  end_ += count;
  if (hasArcLengths()) arc_end_.resize(static_cast<std::size_t>(end_), 0);
  if (begin_.empty()) return;
  gaps_.resize(begin_.size());
  gaps_.back() += count;
}

template <class Keep, class Move>
void FiberTable::drop(Keep&& keep, Move&& move) {
  if (numbers_.empty()) {
    numbers_.resize(begin_.size());
    for (std::size_t f = 0; f < begin_.size(); ++f) numbers_[f] = static_cast<std::uint32_t>(f);
  }
  std::size_t kept = 0;
  SegmentId next = 0;
  for (std::size_t f = 0; f < begin_.size(); ++f) {
    const SegmentId begin = begin_[f], end = fiberEnd(f);
    if (!keep(begin, end)) continue;
    begin_[kept] = next;
    numbers_[kept] = numbers_[f];
    if (!flags_.empty()) flags_[kept] = flags_[f];
    if (!groups_.empty()) groups_[kept] = groups_[f];
    if (!obstacle_rules_.empty()) obstacle_rules_[kept] = obstacle_rules_[f];
    ++kept;
    for (SegmentId id = begin; id < end; ++id, ++next) {
      if (!arc_end_.empty()) {
        arc_end_[static_cast<std::size_t>(next)] = arc_end_[static_cast<std::size_t>(id)];
      }
      move(id, next);
    }
  }
  end_ = next;
  begin_.resize(kept);
  numbers_.resize(kept);
  if (!flags_.empty()) flags_.resize(kept);
  if (!groups_.empty()) groups_.resize(kept);
  if (!obstacle_rules_.empty()) obstacle_rules_.resize(kept);
  if (!arc_end_.empty()) arc_end_.resize(static_cast<std::size_t>(next));
  forgetLostJoints();
}

template <class IsThere>
tree::Fibers FiberTable::segmentsFrom(SegmentId first, IsThere&& is_there) const {
  tree::Fibers fibers;
  const bool is_before_all = begin_.empty() || first <= begin_[0];
  std::size_t f = is_before_all ? 0 : first < end_ ? fiberOf(first) : begin_.size();
  fibers.ids.reserve(static_cast<std::size_t>(end_ - first));
  fibers.begin.reserve(begin_.size() - f + 1);
  if (!groups_.empty()) {
    fibers.groups.assign(groups_.begin() + static_cast<std::ptrdiff_t>(f), groups_.end());
  }
  for (; f < begin_.size(); ++f) {
    for (SegmentId id = std::max(begin_[f], first); id < segmentsEnd(f); ++id) {
      if (!is_there(id)) continue;
      fibers.ids.push_back(id);
      if (!obstacle_rules_.empty()) fibers.meets.push_back(meets(id, f));
    }
    fibers.endFiber();
  }
  return fibers;
}

}  // namespace fcl_fibers::fibers
