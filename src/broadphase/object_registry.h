// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <new>
#include <optional>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include "broadphase/address_set.h"
#include "fibers/fiber_table.h"

namespace fcl_fibers::broadphase {

using tree::SegmentId;

/// Finds the position of a pointer in a vector. This is a hash table with linear probing that keeps
/// only positions, at about eight bytes a pointer. std::unordered_map takes forty bytes, and
/// filling it takes as long as building the tree.
///
/// To remove a pointer, set it to null in the vector. Searches then skip its slot.
template <typename T>
class PointerIndex {
 public:
  static constexpr std::int32_t kNotFound = -1;

  explicit PointerIndex(const std::vector<T*>& pointers) : pointers_(pointers) {}

  std::int32_t find(const T* pointer) const {
    if (slots_.empty() || pointer == nullptr) return kNotFound;
    return slots_[slotOf(pointer)];
  }

  /// Makes room for `count` positions, so that insertFrom() does not allocate.
  void reserve(std::size_t count) {
    std::size_t capacity = 16;
    while (capacity < count + count / 2) capacity *= 2;
    if (capacity <= slots_.size()) return;
    std::vector<std::int32_t> old(capacity, kNotFound);
    old.swap(slots_);
    for (const std::int32_t position : old) {
      if (position == kNotFound || at(position) == nullptr) continue;
      slots_[slotOf(at(position))] = position;
    }
  }

  /// Inserts the pointers from position `begin` on, except those that are null.
  /// @pre reserve() has made room, and none is known already or repeated
  void insertFrom(std::size_t begin) {
    for (std::size_t position = begin; position < pointers_.size(); ++position) {
      if (pointers_[position] == nullptr) continue;
      slots_[slotOf(pointers_[position])] = static_cast<std::int32_t>(position);
    }
  }

  /// Empties the table but keeps its memory.
  void forgetAll() { std::fill(slots_.begin(), slots_.end(), kNotFound); }

  void clear() { slots_.clear(); }

  std::size_t memoryUsage() const { return slots_.capacity() * sizeof(slots_[0]); }

 private:
  const T* at(std::int32_t position) const { return pointers_[static_cast<std::size_t>(position)]; }
  std::size_t next(std::size_t slot) const { return (slot + 1) & (slots_.size() - 1); }

  std::size_t homeOf(const T* pointer) const {
    // Objects registered together mostly lie together in memory, and their slots should, too.
    // Addresses in 64 kB share a window of slots, which Fibonacci hashing (Knuth, TAOCP 3, section
    // 6.4) places anywhere. No result depends on addresses.
    const auto key = static_cast<std::uint64_t>(reinterpret_cast<std::uintptr_t>(pointer));
    const std::uint64_t window = ((key >> 16) * 0x9E3779B97F4A7C15u) >> 32;
    return static_cast<std::size_t>(window + (key >> 5 & 0x7FF)) & (slots_.size() - 1);
  }

  /// The slot of the pointer, or the free slot where it would be inserted.
  std::size_t slotOf(const T* pointer) const {
    std::size_t slot = homeOf(pointer);
    while (slots_[slot] != kNotFound && at(slots_[slot]) != pointer) slot = next(slot);
    return slot;
  }

  const std::vector<T*>& pointers_;
  std::vector<std::int32_t> slots_;  ///< a power of two of slots, at most two thirds in use
};

/// The managed objects, their order and their fibers.
///
/// An object's id is its position in the order of registration. The id of a removed object stays
/// empty, so that segment numbers along its fiber do not change. Once many objects were removed,
/// fibers without objects are dropped. Then ids move up, but fiber and segment numbers do not
/// change.
///
/// Which objects are managed is known from their addresses. Their ids are put into a table when the
/// first one is looked up, because most programs never ask. Several threads may look up at the same
/// time.
template <typename S>
class ObjectRegistry {
 public:
  using Object = fcl::CollisionObject<S>;
  static constexpr SegmentId kNotFound = PointerIndex<Object>::kNotFound;

  explicit ObjectRegistry(const fibers::NeighborRule& rule) : fibers_(rule), index_(objects_) {}
  ObjectRegistry(const ObjectRegistry&) = delete;
  ObjectRegistry& operator=(const ObjectRegistry&) = delete;

  /// By id; null if the id is empty.
  const std::vector<Object*>& objects() const { return objects_; }
  Object* operator[](SegmentId id) const { return objects_[static_cast<std::size_t>(id)]; }
  /// Replaces the content of `objects` by those that are left.
  void list(std::vector<Object*>& objects) const {
    objects.assign(objects_.begin(), objects_.end());
    objects.erase(std::remove(objects.begin(), objects.end(), nullptr), objects.end());
  }
  std::size_t size() const { return size_; }
  bool hasEveryId() const { return size_ == objects_.size(); }
  SegmentId idCount() const { return static_cast<SegmentId>(objects_.size()); }
  SegmentId find(const Object* object) const {
    if (!managed_.contains(object)) return kNotFound;
    return isIndexed() || fillIndex() ? index_.find(object) : placeOf(object);
  }
  const fibers::FiberTable& fibers() const { return fibers_; }
  /// Whether the object's fiber has other segments, or had.
  /// @pre the object is managed
  bool isOfSeveral(const Object* object) const {
    const SegmentId id = find(object), next = id + 1;
    return fibers_.placeOf(id).number > 0 || (next < idCount() && fibers_.placeOf(next).number > 0);
  }

  /// Properties of the fibers of one add(). Guessed fibers have no neighbours.
  using Kind = fibers::FiberTable::Kind;
  using Kinds = fibers::FiberTable::Kinds;

  /// Appends objects. An object starts a fiber if its `starts_fiber` is set; else it continues the
  /// fiber of the object before.
  /// @param starts_fiber  1 or 0; bytes, because several threads write them
  /// @param lengths  of the segments, if the table has arc lengths
  /// @param joints   of the fiber
  /// @return the position in `added` of an object that is repeated or managed already; then nothing
  ///         has changed
  std::optional<std::size_t> add(const std::vector<Object*>& added,
                                 const std::vector<std::uint8_t>& starts_fiber, const Kind& kind,
                                 const std::vector<double>& lengths = {},
                                 const std::vector<fibers::Joint>& joints = {});

  /// Finds which segments are neighbours because of joints. It has to be called before a query, and
  /// by one thread alone.
  void settleJoints() const { fibers_.settleJoints(Left{objects_}); }

  /// Copies another registry, with objects[i] in place of its i-th object.
  /// @pre this registry is new, and `objects` has as many as the other one and no null
  /// @return the position of a repeated object; then this registry is unusable
  std::optional<std::size_t> copy(const ObjectRegistry& other, const std::vector<Object*>& objects);

  /// Returns whether the ids of all other objects are unchanged.
  /// @pre the object is managed
  bool remove(const Object* object);
  /// Whether the next remove() will return false.
  /// @pre there is an object
  bool nextRemovalRenumbers() const {
    // Renumbering each time the number of objects has halved takes linear time in total, however
    // many ids stay empty within fibers.
    constexpr std::size_t kFewIds = 64;
    return removed_since_renumbering_ + 1 > size_ - 1 + kFewIds;
  }

  void clear();

  /// The fibers of the objects from an id on for which is_segment(id) is true, in order. The fiber
  /// that has the id starts there.
  template <class IsSegment>
  tree::Fibers fibersFrom(SegmentId begin, IsSegment&& is_segment) const {
    return fibers_.segmentsFrom(
        begin, [&](SegmentId id) { return (*this)[id] != nullptr && is_segment(id); });
  }

  std::size_t memoryUsage() const {
    return objects_.capacity() * sizeof(Object*) + managed_.memoryUsage() +
           (isIndexed() ? index_.memoryUsage() : 0) + fibers_.memoryUsage();
  }

 private:
  /// Whether a fiber has objects left.
  struct Left {
    const std::vector<Object*>& objects;

    bool operator()(SegmentId begin, SegmentId end) const {
      return std::any_of(objects.begin() + begin, objects.begin() + end,
                         [](const Object* object) { return object != nullptr; });
    }
  };
  bool isIndexed() const { return is_indexed_.load(std::memory_order_acquire); }
  bool fillIndex() const noexcept;
  /// @pre the object is managed
  SegmentId placeOf(const Object* object) const {
    const auto found = std::find(objects_.begin(), objects_.end(), object);
    return found == objects_.end() ? kNotFound : static_cast<SegmentId>(found - objects_.begin());
  }
  std::optional<std::size_t> insert(const std::vector<Object*>& added);
  void renumber();

  std::vector<Object*> objects_;
  fibers::FiberTable fibers_;
  AddressSet<Object> managed_;
  mutable PointerIndex<Object> index_;  ///< a search may fill it
  mutable std::atomic<bool> is_indexed_{false};
  mutable std::mutex index_mutex_;
  std::size_t size_ = 0;
  std::size_t removed_since_renumbering_ = 0;
};

/// Puts the ids of all objects into the table. Returns false if there is no memory for it, because
/// an object can be unregistered even then.
template <typename S>
bool ObjectRegistry<S>::fillIndex() const noexcept {
  const std::lock_guard<std::mutex> lock(index_mutex_);
  if (isIndexed()) return true;
  try {
    index_.reserve(objects_.size());
  } catch (const std::bad_alloc&) {
    return false;
  }
  index_.insertFrom(0);
  is_indexed_.store(true, std::memory_order_release);
  return true;
}

/// Makes objects managed. Returns the position of one that is repeated or managed already; then
/// none is, and neither if this throws.
template <typename S>
std::optional<std::size_t> ObjectRegistry<S>::insert(const std::vector<Object*>& added) {
  std::size_t count = 0;
  const auto takeBack = [&] {
    for (std::size_t i = 0; i < count; ++i) managed_.erase(added[i]);
  };
  try {
    while (count < added.size() && managed_.insert(added[count])) ++count;
  } catch (...) {
    takeBack();
    throw;
  }
  if (count == added.size()) return std::nullopt;
  takeBack();
  return count;
}

template <typename S>
std::optional<std::size_t> ObjectRegistry<S>::add(const std::vector<Object*>& added,
                                                  const std::vector<std::uint8_t>& starts_fiber,
                                                  const Kind& kind,
                                                  const std::vector<double>& lengths,
                                                  const std::vector<fibers::Joint>& joints) {
  // Calls that may throw come first.
  const std::size_t first = objects_.size(), count = first + added.size();
  if (count > objects_.capacity()) {
    // This leaves room for single objects, so that the first of them does not copy all.
    constexpr std::size_t kFew = 64;
    objects_.reserve(std::max(count + count / 128 + kFew, first + first / 2));
  }
  const auto starts = std::count(starts_fiber.begin(), starts_fiber.end(), 1);
  Kinds kinds = Kinds::of(kind);
  kinds.joints = joints.size();
  fibers_.reserve(static_cast<std::size_t>(starts), added.size(), kinds);
  if (isIndexed()) index_.reserve(count);
  if (const auto known = insert(added)) return known;

  objects_.insert(objects_.end(), added.begin(), added.end());
  if (isIndexed()) index_.insertFrom(first);
  for (std::size_t i = 0; i < added.size();) {
    if (starts_fiber[i] != 0) fibers_.startFiber(kind);
    const auto next =
        std::find(starts_fiber.begin() + static_cast<std::ptrdiff_t>(i) + 1, starts_fiber.end(), 1);
    const auto end = static_cast<std::size_t>(next - starts_fiber.begin());
    if (lengths.empty()) fibers_.addIds(static_cast<SegmentId>(end - i));
    for (; !lengths.empty() && i < end; ++i) fibers_.addId(lengths[i]);
    i = end;
  }
  for (const auto& [own, other] : joints) fibers_.join(own, other);
  size_ += added.size();
  return std::nullopt;
}

template <typename S>
std::optional<std::size_t> ObjectRegistry<S>::copy(const ObjectRegistry& other,
                                                   const std::vector<Object*>& objects) {
  if (const auto repeated = insert(objects)) return repeated;
  objects_.reserve(other.objects_.size());
  for (const Object* original : other.objects_) {
    objects_.push_back(original == nullptr ? nullptr : objects[size_]);
    if (original != nullptr) ++size_;
  }
  removed_since_renumbering_ = other.removed_since_renumbering_;
  fibers_ = other.fibers_;
  return std::nullopt;
}

template <typename S>
bool ObjectRegistry<S>::remove(const Object* object) {
  const bool keeps_ids = !nextRemovalRenumbers();
  if (!keeps_ids) fibers_.reserveForDrop();
  const SegmentId id = find(object);
  objects_[static_cast<std::size_t>(id)] = nullptr;
  fibers_.unsettleJoints(id, Left{objects_});
  managed_.erase(object);
  --size_;
  ++removed_since_renumbering_;
  if (!keeps_ids) renumber();
  return keeps_ids;
}

template <typename S>
void ObjectRegistry<S>::clear() {
  objects_.clear();
  fibers_.clear();
  managed_.clear();
  index_.clear();
  is_indexed_ = false;
  size_ = removed_since_renumbering_ = 0;
}

template <typename S>
void ObjectRegistry<S>::renumber() {
  removed_since_renumbering_ = 0;
  fibers_.drop(Left{objects_}, [this](SegmentId from, SegmentId to) {
    objects_[static_cast<std::size_t>(to)] = objects_[static_cast<std::size_t>(from)];
  });
  objects_.resize(static_cast<std::size_t>(fibers_.idCount()));
  if (!isIndexed()) return;
  index_.forgetAll();
  index_.insertFrom(0);
}

}  // namespace fcl_fibers::broadphase
