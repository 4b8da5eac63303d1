// SPDX-License-Identifier: BSD-3-Clause
#include "fibers/options.h"

#include <cmath>
#include <stdexcept>

#include "joined_text.h"

namespace fcl_fibers::fibers {

void throwInvalidArgument(const std::string& call, const std::string& what) {
  throw std::invalid_argument("fcl_fibers: " + call + ": " + what);
}

void throwQueryRuns(const std::string& call) {
  throwInvalidArgument(call, "a query is running; make the change after the query has ended");
}

void requireValid(const char* call, const FiberOptions& options) {
  const auto requireLength = [call](const char* name, double length) {
    if (length >= 0 && std::isfinite(length)) return;
    throwInvalidArgument(call,
                         joinedText(name, " is ", length, "; set a finite length of 0 or more"));
  };
  if (options.ignored_neighbors < 0) {
    throwInvalidArgument(call, "ignored_neighbors is " + std::to_string(options.ignored_neighbors) +
                                   "; set 0 or more");
  }
  requireLength("ignored_arc_length", options.ignored_arc_length);
  requireLength("margin", options.margin);
  if (options.threads < 1) {
    throwInvalidArgument(call, "threads is " + std::to_string(options.threads) + "; set 1 or more");
  }
}

NeighborRule neighborRule(const FiberOptions& options) {
  return {options.ignored_neighbors, options.ignored_arc_length};
}

index::IndexOptions indexOptions(const FiberOptions& options, bool wrapped_spheres) {
  index::IndexOptions result;
  result.wrapped_spheres = wrapped_spheres;
  result.super_thread = options.topology == Topology::kSuperThread;
  result.capsules = options.report == Report::kCapsules;
  result.margin = options.margin;
  result.threads = options.threads;
  return result;
}

}  // namespace fcl_fibers::fibers
