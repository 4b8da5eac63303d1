// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "fibers/fiber_table.h"
#include "parallel/executor.h"

namespace fcl_fibers::arrays {

/// Where the fibers of the last build start and end; each is empty if there is no such fiber.
struct Joints {
  std::vector<std::int32_t> starts_at, ends_at;

  std::size_t memoryUsage() const {
    return (starts_at.capacity() + ends_at.capacity()) * sizeof(std::int32_t);
  }
};

/// Returns where the fibers start and end. Throws std::invalid_argument if one of them cannot, or
/// has not the coordinates of the point that it names.
/// @pre the arrays have passed checkArrays()
template <typename S>
Joints checkedJoints(const char* call, const FiberArrays<S>& fibers, parallel::Executor* executor);

/// Throws std::invalid_argument if the arrays tell other joints than these, or if points of these
/// joints have come apart.
/// @pre the arrays have passed checkArrays(), and fibers have as many points as at that build
template <typename S>
void checkStillJoined(const char* call, const FiberArrays<S>& fibers, const Joints& joints,
                      parallel::Executor* executor);

/// Joins the fibers of a table.
void join(const Joints& joints, fibers::FiberTable& table);

}  // namespace fcl_fibers::arrays
