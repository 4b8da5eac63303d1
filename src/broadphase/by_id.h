// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "tree/topology.h"

namespace fcl_fibers::broadphase {

using tree::SegmentId;

/// What is known of some of a manager's objects, in the order of their ids. An `Entry` has the
/// object as `object`, which is null once it has been removed. Until compact() removed entries keep
/// their places, so that one removal does not move all entries behind it.
template <class Entry>
class ById {
 public:
  /// By id, one for each place.
  const std::vector<SegmentId>& ids() const { return ids_; }
  std::size_t size() const { return ids_.size(); }
  std::size_t removedCount() const { return removed_; }
  Entry& operator[](std::size_t place) { return entries_[place]; }
  const Entry& operator[](std::size_t place) const { return entries_[place]; }
  auto begin() { return entries_.begin(); }
  auto begin() const { return entries_.begin(); }
  auto end() { return entries_.end(); }
  auto end() const { return entries_.end(); }

  /// The place of an object's entry; size() if there is none.
  std::size_t find(SegmentId id) const {
    const auto found = std::lower_bound(ids_.begin(), ids_.end(), id);
    const auto place = static_cast<std::size_t>(found - ids_.begin());
    return found == ids_.end() || *found != id || entries_[place].object == nullptr ? size()
                                                                                    : place;
  }
  Entry* get(SegmentId id) {
    const std::size_t place = find(id);
    return place == size() ? nullptr : &entries_[place];
  }
  const Entry* get(SegmentId id) const { return const_cast<ById*>(this)->get(id); }

  /// Makes room for more entries, so that adding them cannot throw.
  void reserve(std::size_t more) {
    if (size() + more <= ids_.capacity()) return;
    const std::size_t capacity = std::max(size() + more, 2 * ids_.capacity());
    entries_.reserve(capacity);
    ids_.reserve(capacity);
  }
  /// @pre the ids ascend
  void add(SegmentId id, Entry entry) {
    ids_.push_back(id);
    entries_.push_back(std::move(entry));
  }
  void remove(std::size_t place) {
    entries_[place] = Entry();
    ++removed_;
  }
  /// Gives the places of removed entries to those behind them.
  void compact() {
    std::size_t kept = 0;
    for (std::size_t i = 0; removed_ > 0 && i < size(); ++i) {
      if (entries_[i].object == nullptr) continue;
      if (kept != i) entries_[kept] = std::move(entries_[i]);
      ids_[kept++] = ids_[i];
    }
    if (removed_ > 0) {
      entries_.resize(kept);
      ids_.resize(kept);
    }
    removed_ = 0;
  }
  /// Takes new ids, idOf(entry), of the same objects in the same order.
  /// @pre compact() was called last
  template <class IdOf>
  void renumber(IdOf&& idOf) {
    for (std::size_t i = 0; i < size(); ++i) ids_[i] = idOf(entries_[i]);
  }
  void clear() {
    entries_.clear();
    ids_.clear();
    removed_ = 0;
  }

  std::size_t memoryUsage() const {
    return entries_.capacity() * sizeof(Entry) + ids_.capacity() * sizeof(SegmentId);
  }

 private:
  std::vector<SegmentId> ids_;
  std::vector<Entry> entries_;
  std::size_t removed_ = 0;
};

}  // namespace fcl_fibers::broadphase
