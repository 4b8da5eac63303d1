// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace fcl_fibers::tools {

/// Keeps the first of many items by an order, in memory for twice as many as it keeps.
template <typename Item>
class FirstOf {
 public:
  using IsEarlier = bool (*)(const Item&, const Item&);

  FirstOf(std::size_t most, IsEarlier is_earlier) : most_(most), is_earlier_(is_earlier) {}

  void add(const Item& item) {
    items_.push_back(item);
    if (items_.size() / 2 > most_) cut();
  }

  /// In their order, once all are added.
  std::vector<Item> take() {
    cut();
    std::sort(items_.begin(), items_.end(), is_earlier_);
    return std::move(items_);
  }

 private:
  void cut() {
    if (items_.size() <= most_) return;
    const auto end = items_.begin() + static_cast<std::ptrdiff_t>(most_);
    std::nth_element(items_.begin(), end, items_.end(), is_earlier_);
    items_.erase(end, items_.end());
  }

  std::size_t most_;
  IsEarlier is_earlier_;
  std::vector<Item> items_;
};

}  // namespace fcl_fibers::tools
