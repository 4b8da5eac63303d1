// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace fcl_fibers::test {

/// Memory that runs out. Linked into a program, this takes the place of `operator new` in it and in
/// the libraries that it loads.
///
/// While an object of this class lives, the allocation of this number fails, counted from 0 from
/// its construction on, over all threads; all later ones as well if it is to last.
class AllocationFault {
 public:
  enum class Lasts { kOnce, kForever };

  AllocationFault(std::size_t number, Lasts lasts);
  ~AllocationFault();
  AllocationFault(const AllocationFault&) = delete;
  AllocationFault& operator=(const AllocationFault&) = delete;

  /// Whether an allocation has failed.
  bool struck() const;
};

/// Allocations by `operator new` that have not been freed.
std::size_t liveAllocations();
/// The bytes of them, as malloc rounds them.
std::size_t liveBytes();

}  // namespace fcl_fibers::test
