// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <utility>
#include <vector>

namespace fcl_fibers::parallel {

/// An allocator that leaves new elements as the memory is.
template <class T>
struct LeavesUnwritten : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = LeavesUnwritten<U>;
  };

  LeavesUnwritten() = default;
  template <class U>
  LeavesUnwritten(const LeavesUnwritten<U>& /*other*/) {}  // NOLINT: as allocators are

  template <class U>
  void construct(U* /*place*/) {}
  template <class U, class... Args>
  void construct(U* place, Args&&... args) {
    ::new (static_cast<void*>(place)) U(std::forward<Args>(args)...);
  }
};

/// A vector whose resize(count) leaves new elements unwritten, so that the threads that fill them
/// are the first to touch their memory. A std::vector would have one thread write them all before.
template <class T>
using UnwrittenVector = std::vector<T, LeavesUnwritten<T>>;

}  // namespace fcl_fibers::parallel
