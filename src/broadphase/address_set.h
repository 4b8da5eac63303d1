// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace fcl_fibers::broadphase {

/// A set of things by their addresses, at one or two bytes each if they are allocated one after the
/// other. It is for those that are in memory at the same time, no two of which overlap.
///
/// Memory is cut into cells that are no larger than a thing, so no two begin in one cell. A window
/// is 64 cells in a row, and a hash table with linear probing has a bit for each cell of a window
/// in which a thing has begun.
template <typename T>
class AddressSet {
 public:
  bool contains(const T* thing) const {
    return !windows_.empty() && (windows_[slotOf(windowOf(thing))].begun & bitOf(thing)) != 0;
  }

  /// Returns whether it was not in the set. If it throws, nothing has changed.
  bool insert(const T* thing) {
    if (8 * (used_ + 1) > 7 * windows_.size()) grow();
    Window& window = windows_[slotOf(windowOf(thing))];
    if (window.number == kFree) {
      window.number = windowOf(thing);
      ++used_;
    }
    const std::uint64_t before = window.begun;
    window.begun |= bitOf(thing);
    return window.begun != before;
  }

  /// @pre it is in the set
  void erase(const T* thing) { windows_[slotOf(windowOf(thing))].begun &= ~bitOf(thing); }

  void clear() {
    windows_.clear();
    used_ = 0;
  }

  std::size_t memoryUsage() const { return windows_.capacity() * sizeof(Window); }

 private:
  static constexpr std::uint64_t kFree = ~std::uint64_t{0};

  struct Window {
    std::uint64_t number = kFree;
    std::uint64_t begun = 0;
  };

  /// The largest power of two that is at most sizeof(T).
  static constexpr std::uint64_t cellSize() {
    std::uint64_t size = 1;
    while (2 * size <= sizeof(T)) size *= 2;
    return size;
  }
  static std::uint64_t cellOf(const T* thing) {
    return static_cast<std::uint64_t>(reinterpret_cast<std::uintptr_t>(thing)) / cellSize();
  }
  static std::uint64_t windowOf(const T* thing) { return cellOf(thing) / 64; }
  static std::uint64_t bitOf(const T* thing) { return std::uint64_t{1} << cellOf(thing) % 64; }

  /// The slot of a window, or the free one where it would be inserted.
  std::size_t slotOf(std::uint64_t window) const {
    // Fibonacci hashing: Knuth, TAOCP 3, section 6.4.
    const std::size_t last = windows_.size() - 1;
    std::size_t slot = static_cast<std::size_t>(window * 0x9E3779B97F4A7C15u >> 32) & last;
    while (windows_[slot].number != window && windows_[slot].number != kFree) {
      slot = (slot + 1) & last;
    }
    return slot;
  }

  void grow() {
    // Windows in which nothing is left are dropped, so the table may keep its size.
    std::size_t left = 0;
    for (const Window& window : windows_) left += window.begun != 0 ? 1 : 0;
    std::size_t size = 16;
    while (4 * (left + 1) > 3 * size) size *= 2;
    std::vector<Window> old(size);
    old.swap(windows_);
    used_ = left;
    for (const Window& window : old) {
      if (window.begun != 0) windows_[slotOf(window.number)] = window;
    }
  }

  std::vector<Window> windows_;  ///< a power of two of them, at most seven eighths in use
  std::size_t used_ = 0;         ///< those that have a number
};

}  // namespace fcl_fibers::broadphase
