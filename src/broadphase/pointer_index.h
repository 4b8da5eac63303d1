// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace fcl_fibers::broadphase {

/// Finds the position of a pointer in a vector. This is a hash table with linear probing that keeps
/// only positions, at about eight bytes a pointer. std::unordered_map takes forty bytes, and
/// filling it takes as long as building the tree.
///
/// To remove a pointer, set it to null in the vector. Searches then skip its slot, and its position
/// must not be inserted again.
template <typename T>
class PointerIndex {
 public:
  static constexpr std::int32_t kNotFound = -1;

  explicit PointerIndex(const std::vector<T*>& pointers) : pointers_(pointers) {}

  std::int32_t find(const T* pointer) const {
    if (slots_.empty() || pointer == nullptr) return kNotFound;
    return slots_[slotOf(pointer)];
  }

  /// Makes room for `count` positions, so that insert() does not allocate.
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

  /// Inserts the pointer at `position` unless it is known already. Returns whether it was new.
  /// @pre reserve() has made room
  bool insert(std::int32_t position) {
    std::int32_t& slot = slots_[slotOf(at(position))];
    if (slot != kNotFound) return false;
    slot = position;
    return true;
  }

  /// Undoes the last insert() that was not undone. No other pointer has been probed past it.
  void takeBack(std::int32_t position) { slots_[slotOf(at(position))] = kNotFound; }

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

}  // namespace fcl_fibers::broadphase
