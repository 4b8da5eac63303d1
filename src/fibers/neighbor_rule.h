// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tree/topology.h"

namespace fcl_fibers::fibers {

using tree::SegmentId;

/// Which segments of one fiber are neighbours. Their pairs are ignored.
struct NeighborRule {
  // NOLINTNEXTLINE(google-explicit-constructor): a number of segments is a rule
  NeighborRule(SegmentId segments_apart, double arc_length_between = 0)
      : reach(segments_apart), arc_length(arc_length_between) {}

  SegmentId reach;    ///< largest difference of segment numbers
  double arc_length;  ///< largest arc length between the two; 0 if only numbers count

  bool ignoresAny() const { return reach > 0 || arc_length > 0; }
};

/// The ids of one fiber, [begin, end). If it is closed, its last segment ends where its first
/// begins.
struct FiberRange {
  SegmentId begin, end;
  bool closed;
};

/// @param arc_end  by id: arc length from the start of the fiber to the end of the segment; may be
///                 null if the rule has no arc length
/// @pre both ids are in the fiber, first <= last
inline bool areNeighbors(const NeighborRule& rule, const FiberRange& fiber, const double* arc_end,
                         SegmentId first, SegmentId last) {
  if (last - first <= rule.reach) return true;
  const SegmentId around = fiber.end - last + (first - fiber.begin);
  if (fiber.closed && around <= rule.reach) return true;
  if (rule.arc_length <= 0) return false;
  if (arc_end[last - 1] - arc_end[first] <= rule.arc_length) return true;
  const double before_first = first > fiber.begin ? arc_end[first - 1] : 0;
  return fiber.closed && arc_end[fiber.end - 1] - arc_end[last] + before_first <= rule.arc_length;
}

}  // namespace fcl_fibers::fibers
