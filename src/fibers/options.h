// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <fcl_fibers/fiber_options.h>
#include <fcl_fibers/tree_export.h>

#include "fibers/neighbor_rule.h"
#include "index/segment_index.h"

namespace fcl_fibers::fibers {

/// Throws std::invalid_argument with "fcl_fibers: call: what". `what` ends with the remedy.
[[noreturn]] FCL_FIBERS_TREE_EXPORT void throwInvalidArgument(const std::string& call,
                                                              const std::string& what);

/// Refuses a call that changes what a running query reads.
[[noreturn]] FCL_FIBERS_TREE_EXPORT void throwQueryRuns(const std::string& call);

/// Throws std::invalid_argument if an option is out of its range.
FCL_FIBERS_TREE_EXPORT void requireValid(const char* call, const FiberOptions& options);

FCL_FIBERS_TREE_EXPORT NeighborRule neighborRule(const FiberOptions& options);
FCL_FIBERS_TREE_EXPORT index::IndexOptions indexOptions(const FiberOptions& options,
                                                        bool wrapped_spheres);

}  // namespace fcl_fibers::fibers
