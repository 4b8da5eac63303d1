// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_options.h>

#include "broadphase/pointer_index.h"
#include "tree/fiber_of.h"
#include "tree/neighbor_rule.h"
#include "tree/topology.h"

namespace fcl_fibers::broadphase {

using tree::SegmentId;

/// Which objects are managed, in which order, and which of them form a fiber.
///
/// An object's id is its position in the order of registration. The id of an unregistered object
/// stays empty, so that the numbers of its fiber's other segments stay as they are. Fibers of which
/// nothing is left are dropped when they are many; ids move up then, fiber and segment numbers do
/// not.
template <typename S>
class FiberRegistry {
 public:
  using Object = fcl::CollisionObject<S>;
  static constexpr SegmentId kNotFound = PointerIndex<Object>::kNotFound;

  /// What areNeighbors() may be asked of it later.
  enum class Keep { kNothing, kLinks, kLinksAndArcs };

  explicit FiberRegistry(Keep keep) : keep_(keep), index_(objects_) {}
  FiberRegistry(const FiberRegistry&) = delete;
  FiberRegistry& operator=(const FiberRegistry&) = delete;

  /// By id; null where the id is empty.
  const std::vector<Object*>& objects() const { return objects_; }
  std::size_t size() const { return size_; }
  SegmentId find(const Object* object) const { return index_.find(object); }

  enum class Kind : std::uint8_t {
    kGuessed,  ///< from where objects are; no pair of them is ignored
    kOpen,     ///< given by the user
    kClosed,   ///< likewise
  };

  /// Appends objects. Where `starts_fiber` is set a new fiber starts, elsewhere the object
  /// continues the fiber of the one before it.
  /// @param lengths  of the objects along their fiber, if arcs are kept
  /// @param group    of the fibers that start
  /// @return the position in `added` of an object that is there twice or managed already, in which
  ///         case nothing has changed
  std::optional<std::size_t> add(const std::vector<Object*>& added,
                                 const std::vector<bool>& starts_fiber, Kind kind,
                                 const std::vector<double>& lengths = {},
                                 tree::Group group = tree::kNoGroup);

  /// Takes over all of another registry but its objects: the i-th one's place is objects[i]'s.
  /// @pre this registry is as constructed, `objects` are as many as the other's and none is null
  /// @return the position of an object that is there twice, in which case the registry is of no use
  std::optional<std::size_t> copy(const FiberRegistry& other, const std::vector<Object*>& objects);

  /// Says whether the ids of the others are what they were.
  /// @pre the object is managed
  bool remove(const Object* object);

  void clear();

  /// Whether two objects belong to one fiber given by the user, and are neighbours there.
  /// @pre the registry keeps what the rule asks for
  bool areNeighbors(SegmentId a, SegmentId b, const tree::NeighborRule& rule) const {
    const auto [first, last] = std::minmax(a, b);
    // Most pairs end here.
    if (last - first > rule.reach && !has_closed_ && rule.arc_length <= 0) return false;
    const std::size_t fiber = fiberOf(first);
    if (last >= fiberEnd(fiber)) return false;
    if (first != last && fiber_kind_[fiber].kind == Kind::kGuessed) return false;
    const tree::FiberRange range{fiber_begin_[fiber], fiberEnd(fiber),
                                 fiber_kind_[fiber].kind == Kind::kClosed};
    return tree::areNeighbors(rule, range, arc_end_.data(), first, last);
  }

  bool hasGroups() const { return !fiber_group_.empty(); }
  tree::Group groupOf(SegmentId id) const {
    return fiber_group_.empty() ? tree::kNoGroup : fiber_group_[fiberOf(id)];
  }
  bool areOfOneGroup(SegmentId a, SegmentId b) const {
    const tree::Group group = groupOf(a);
    return group != tree::kNoGroup && group == groupOf(b);
  }

  FiberSegment fiberSegment(SegmentId id) const {
    const std::size_t fiber = fiberOf(id);
    return {fiber_number_[fiber], static_cast<std::size_t>(id - fiber_begin_[fiber])};
  }

  /// The fibers of all objects for which admit(id) holds, in order.
  template <class Predicate>
  tree::Fibers fibers(Predicate&& admit) const;

  std::size_t memoryUsage() const {
    return objects_.capacity() * sizeof(Object*) + index_.memoryUsage() +
           fiber_begin_.capacity() * sizeof(SegmentId) +
           fiber_number_.capacity() * sizeof(std::uint32_t) +
           fiber_kind_.capacity() * sizeof(FiberKind) +
           fiber_group_.capacity() * sizeof(tree::Group) + arc_end_.capacity() * sizeof(double);
  }

 private:
  /// Room for more at the end, growing by factors so that adding one by one stays linear.
  template <class Vector>
  static void reserveFor(Vector& vector, std::size_t more) {
    const std::size_t needed = vector.size() + more;
    if (needed <= vector.capacity()) return;
    vector.reserve(std::max(needed, vector.capacity() + vector.capacity() / 2));
  }
  SegmentId nextId() const { return static_cast<SegmentId>(objects_.size()); }
  std::size_t fiberOf(SegmentId id) const {
    return tree::fiberOf(fiber_begin_.data(), fiber_begin_.size(), nextId(), id);
  }
  SegmentId fiberEnd(std::size_t fiber) const {
    return fiber + 1 < fiber_begin_.size() ? fiber_begin_[fiber + 1] : nextId();
  }
  void renumber();

  /// Vectors of an enumeration would be exported: visibility hides class types only.
  struct FiberKind {
    Kind kind;
  };

  Keep keep_;
  std::vector<Object*> objects_;
  PointerIndex<Object> index_;
  std::size_t size_ = 0;
  std::size_t removed_since_renumbering_ = 0;
  /// Fiber f owns the ids [fiber_begin_[f], fiber_begin_[f + 1]).
  std::vector<SegmentId> fiber_begin_;
  std::vector<std::uint32_t> fiber_number_;  ///< as counted when they were registered
  std::uint32_t next_fiber_number_ = 0;
  std::vector<FiberKind> fiber_kind_;     ///< empty unless links are kept
  std::vector<tree::Group> fiber_group_;  ///< empty unless some fiber had a group
  std::vector<double> arc_end_;           ///< by id, see areNeighbors(); empty unless arcs are kept
  bool has_closed_ = false;
};

template <typename S>
std::optional<std::size_t> FiberRegistry<S>::add(const std::vector<Object*>& added,
                                                 const std::vector<bool>& starts_fiber, Kind kind,
                                                 const std::vector<double>& lengths,
                                                 tree::Group group) {
  // What may throw comes first.
  const std::size_t first = objects_.size();
  const auto starts =
      static_cast<std::size_t>(std::count(starts_fiber.begin(), starts_fiber.end(), true));
  reserveFor(objects_, added.size());
  reserveFor(fiber_begin_, starts);
  reserveFor(fiber_number_, starts);
  if (keep_ != Keep::kNothing) reserveFor(fiber_kind_, starts);
  const bool keeps_groups = group != tree::kNoGroup || !fiber_group_.empty();
  if (keeps_groups) reserveFor(fiber_group_, fiber_begin_.size() - fiber_group_.size() + starts);
  if (keep_ == Keep::kLinksAndArcs) reserveFor(arc_end_, added.size());
  index_.reserve(first + added.size());

  objects_.insert(objects_.end(), added.begin(), added.end());
  for (std::size_t i = 0; i < added.size(); ++i) {
    if (index_.insert(static_cast<SegmentId>(first + i))) continue;
    for (std::size_t j = i; j-- > 0;) index_.takeBack(static_cast<SegmentId>(first + j));
    objects_.resize(first);
    return i;
  }
  if (keeps_groups && !added.empty()) {
    fiber_group_.resize(fiber_begin_.size(), tree::kNoGroup);
    fiber_group_.resize(fiber_begin_.size() + starts, group);
  }
  for (std::size_t i = 0; i < added.size(); ++i) {
    if (starts_fiber[i]) {
      fiber_begin_.push_back(static_cast<SegmentId>(first + i));
      fiber_number_.push_back(next_fiber_number_++);
      if (keep_ != Keep::kNothing) fiber_kind_.push_back({kind});
    }
    if (keep_ == Keep::kLinksAndArcs) {
      arc_end_.push_back((starts_fiber[i] ? 0 : arc_end_.back()) + lengths[i]);
    }
  }
  has_closed_ = has_closed_ || kind == Kind::kClosed;
  size_ += added.size();
  return std::nullopt;
}

template <typename S>
std::optional<std::size_t> FiberRegistry<S>::copy(const FiberRegistry& other,
                                                  const std::vector<Object*>& objects) {
  index_.reserve(other.objects_.size());
  objects_.reserve(other.objects_.size());
  for (const Object* original : other.objects_) {
    objects_.push_back(original == nullptr ? nullptr : objects[size_]);
    if (original == nullptr) continue;
    if (!index_.insert(static_cast<SegmentId>(objects_.size() - 1))) return size_;
    ++size_;
  }
  removed_since_renumbering_ = other.removed_since_renumbering_;
  fiber_begin_ = other.fiber_begin_;
  fiber_number_ = other.fiber_number_;
  next_fiber_number_ = other.next_fiber_number_;
  fiber_kind_ = other.fiber_kind_;
  fiber_group_ = other.fiber_group_;
  arc_end_ = other.arc_end_;
  has_closed_ = other.has_closed_;
  return std::nullopt;
}

template <typename S>
bool FiberRegistry<S>::remove(const Object* object) {
  const SegmentId id = index_.find(object);
  objects_[static_cast<std::size_t>(id)] = nullptr;
  --size_;
  // Each time the number of objects halves: linear in all, whatever stays empty within fibers.
  constexpr std::size_t kFewIds = 64;
  if (++removed_since_renumbering_ <= size_ + kFewIds) return true;
  renumber();
  return false;
}

template <typename S>
void FiberRegistry<S>::clear() {
  objects_.clear();
  index_.clear();
  size_ = removed_since_renumbering_ = 0;
  fiber_begin_.clear();
  fiber_number_.clear();
  next_fiber_number_ = 0;
  fiber_kind_.clear();
  fiber_group_.clear();
  arc_end_.clear();
  has_closed_ = false;
}

/// Drops fibers of which nothing is left. The numbers of the others stay as they are.
template <typename S>
void FiberRegistry<S>::renumber() {
  removed_since_renumbering_ = 0;
  std::size_t kept_ids = 0, kept_fibers = 0;
  for (std::size_t f = 0; f < fiber_begin_.size(); ++f) {
    const SegmentId begin = fiber_begin_[f], end = fiberEnd(f);
    if (std::all_of(objects_.begin() + begin, objects_.begin() + end,
                    [](const Object* object) { return object == nullptr; })) {
      continue;
    }
    fiber_begin_[kept_fibers] = static_cast<SegmentId>(kept_ids);
    fiber_number_[kept_fibers] = fiber_number_[f];
    if (keep_ != Keep::kNothing) fiber_kind_[kept_fibers] = fiber_kind_[f];
    if (!fiber_group_.empty()) fiber_group_[kept_fibers] = fiber_group_[f];
    ++kept_fibers;
    for (auto id = static_cast<std::size_t>(begin); id < static_cast<std::size_t>(end); ++id) {
      if (keep_ == Keep::kLinksAndArcs) arc_end_[kept_ids] = arc_end_[id];
      objects_[kept_ids++] = objects_[id];
    }
  }
  objects_.resize(kept_ids);
  fiber_begin_.resize(kept_fibers);
  fiber_number_.resize(kept_fibers);
  if (keep_ != Keep::kNothing) fiber_kind_.resize(kept_fibers);
  if (!fiber_group_.empty()) fiber_group_.resize(kept_fibers);
  if (keep_ == Keep::kLinksAndArcs) arc_end_.resize(kept_ids);

  index_.forgetAll();
  for (std::size_t id = 0; id < kept_ids; ++id) {
    if (objects_[id] != nullptr) index_.insert(static_cast<SegmentId>(id));
  }
}

template <typename S>
template <class Predicate>
tree::Fibers FiberRegistry<S>::fibers(Predicate&& admit) const {
  tree::Fibers fibers;
  fibers.groups = fiber_group_;
  fibers.ids.reserve(size_);
  fibers.begin.reserve(fiber_begin_.size() + 1);
  for (std::size_t f = 0; f < fiber_begin_.size(); ++f) {
    for (SegmentId id = fiber_begin_[f]; id < fiberEnd(f); ++id) {
      if (objects_[static_cast<std::size_t>(id)] != nullptr && admit(id)) fibers.ids.push_back(id);
    }
    fibers.endFiber();
  }
  return fibers;
}

}  // namespace fcl_fibers::broadphase
