// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace fcl_fibers::broadphase {

/// Finds the position of a pointer in a vector: a hash table with linear probing that keeps
/// positions only, eight bytes a pointer. std::unordered_map takes forty and as long to fill as the
/// tree takes to build.
///
/// A pointer is forgotten by setting it to null in the vector: its slot is passed over from then
/// on, and its position is never entered again.
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

  /// Enters the pointer at `position`, unless it is known already; says whether it was new.
  /// @pre reserve() has made room
  bool insert(std::int32_t position) {
    std::int32_t& slot = slots_[slotOf(at(position))];
    if (slot != kNotFound) return false;
    slot = position;
    return true;
  }

  /// Takes back the last insert() that has not been taken back. No other was probed past it.
  void takeBack(std::int32_t position) { slots_[slotOf(at(position))] = kNotFound; }

  /// Empties the table and keeps its room.
  void forgetAll() { std::fill(slots_.begin(), slots_.end(), kNotFound); }

  void clear() { slots_.clear(); }

  std::size_t memoryUsage() const { return slots_.capacity() * sizeof(slots_[0]); }

 private:
  const T* at(std::int32_t position) const { return pointers_[static_cast<std::size_t>(position)]; }
  std::size_t next(std::size_t slot) const { return (slot + 1) & (slots_.size() - 1); }

  std::size_t homeOf(const T* pointer) const {
    // Objects registered together mostly lie together, and then so do their slots: 64 kB of
    // addresses go to one window of slots, that window to anywhere by Fibonacci hashing (Knuth,
    // TAOCP 3, section 6.4). The order of addresses shows nowhere outside.
    const auto key = static_cast<std::uint64_t>(reinterpret_cast<std::uintptr_t>(pointer));
    const std::uint64_t window = ((key >> 16) * 0x9E3779B97F4A7C15u) >> 32;
    return static_cast<std::size_t>(window + (key >> 5 & 0x7FF)) & (slots_.size() - 1);
  }

  /// Where the pointer is, or would be entered.
  std::size_t slotOf(const T* pointer) const {
    std::size_t slot = homeOf(pointer);
    while (slots_[slot] != kNotFound && at(slots_[slot]) != pointer) slot = next(slot);
    return slot;
  }

  const std::vector<T*>& pointers_;
  std::vector<std::int32_t> slots_;  ///< a power of two, at most two thirds of it in use
};

}  // namespace fcl_fibers::broadphase
