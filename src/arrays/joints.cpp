// SPDX-License-Identifier: BSD-3-Clause
#include "arrays/joints.h"

#include <algorithm>
#include <cstddef>
#include <iomanip>
#include <limits>
#include <string>

#include "arrays/coordinates.h"
#include "arrays/fiber_arrays.h"
#include "fibers/options.h"
#include "joined_text.h"

namespace fcl_fibers::arrays {

using fibers::throwInvalidArgument;

namespace {

/// Where all fibers start, or where all end.
template <typename S>
struct Ends {
  const FiberArrays<S>& fibers;
  const std::int32_t* at;
  bool are_starts;
  const char* otherwise;  ///< what to do if the two points differ for a reason

  /// What is wrong with that of a fiber; empty if nothing is.
  std::string problem(std::size_t f) const {
    if (at[f] == -1) return {};
    const std::size_t begin = fibers.point_begin[f], end = pointEnd(fibers, f);
    const std::size_t own = are_starts ? begin : end - 1;
    const auto point = static_cast<std::size_t>(at[f]);
    if (at[f] < 0 || point >= fibers.point_count) {
      return joinedText("; give a point from 0 to ", fibers.point_count - 1, ", or -1 for none");
    }
    if (begin == end) return ", but the fiber has no point; give -1";
    if (point == own) return ", the same point; give another one, or -1 for none";
    if (point < fibers.point_begin[0] ||
        point >= pointEnd(fibers, fiberOf(fibers.point_begin, fibers.fiber_count, point))) {
      return ", a point of no fiber; give a point of a fiber, or -1 for none";
    }
    if (pointOf(fibers, point) == pointOf(fibers, own)) return {};
    return " at " + placeOf(point) + ", but the fiber " + (are_starts ? "starts" : "ends") +
           " with point " + std::to_string(own) + " at " + placeOf(own) +
           "; give both the same coordinates, or " + otherwise;
  }
  std::string placeOf(std::size_t point) const {
    const geometry::Vec3d p = pointOf(fibers, point);
    const auto digits = std::setprecision(std::numeric_limits<S>::max_digits10);
    return joinedText(digits, '(', p.x, ", ", p.y, ", ", p.z, ')');
  }
};

const char* nameOf(bool are_starts) { return are_starts ? "starts_at" : "ends_at"; }

template <typename S>
void requireProper(const char* call, const Ends<S>& ends, parallel::Executor* executor) {
  const auto isProper = [&](std::size_t f) { return ends.problem(f).empty(); };
  const std::size_t count = ends.fibers.fiber_count;
  if (ends.at == nullptr || areAll(executor, count, isProper)) return;
  std::size_t f = 0;
  while (isProper(f)) ++f;
  throwInvalidArgument(call, joinedText(nameOf(ends.are_starts), " of fiber ", f, " is ",
                                        ends.at[f], ends.problem(f)));
}

std::vector<std::int32_t> copyOf(const std::int32_t* at, std::size_t count) {
  const bool has_any = at != nullptr && std::any_of(at, at + count, [](auto p) { return p != -1; });
  return has_any ? std::vector<std::int32_t>(at, at + count) : std::vector<std::int32_t>();
}

}  // namespace

template <typename S>
Joints checkedJoints(const char* call, const FiberArrays<S>& fibers, parallel::Executor* executor) {
  requireProper<S>(call, {fibers, fibers.starts_at, true, "-1 for none"}, executor);
  requireProper<S>(call, {fibers, fibers.ends_at, false, "-1 for none"}, executor);
  return {copyOf(fibers.starts_at, fibers.fiber_count), copyOf(fibers.ends_at, fibers.fiber_count)};
}

template <typename S>
void checkStillJoined(const char* call, const FiberArrays<S>& fibers, const Joints& joints,
                      parallel::Executor* executor) {
  const auto check = [&](const std::int32_t* given, const std::vector<std::int32_t>& kept,
                         bool are_starts) {
    const auto keptAt = [&](std::size_t f) { return kept.empty() ? -1 : kept[f]; };
    for (std::size_t f = 0; given != nullptr && f < fibers.fiber_count; ++f) {
      if (given[f] == keptAt(f)) continue;
      throwInvalidArgument(
          call, joinedText(nameOf(are_starts), " of fiber ", f, " is ", given[f], ", but was ",
                           keptAt(f), " at the last build(); call build() instead"));
    }
    const std::int32_t* const at = kept.empty() ? nullptr : kept.data();
    requireProper<S>(call, {fibers, at, are_starts, "call build() with -1"}, executor);
  };
  check(fibers.starts_at, joints.starts_at, true);
  check(fibers.ends_at, joints.ends_at, false);
}

void join(const Joints& joints, fibers::FiberTable& table) {
  const auto joinAll = [&](const std::vector<std::int32_t>& at, bool are_starts) {
    for (std::size_t f = 0; f < at.size(); ++f) {
      if (at[f] < 0) continue;
      const tree::SegmentId own = are_starts ? table.beginOf(f) : table.idsEnd(f) - 1;
      table.join(table.pointOf(own, false), table.pointOf(at[f], false));
    }
  };
  joinAll(joints.starts_at, true);
  joinAll(joints.ends_at, false);
  table.settleJoints([](tree::SegmentId, tree::SegmentId) { return true; });
}

#define FCL_FIBERS_INSTANTIATE(S)                                                         \
  template Joints checkedJoints(const char*, const FiberArrays<S>&, parallel::Executor*); \
  template void checkStillJoined(const char*, const FiberArrays<S>&, const Joints&,       \
                                 parallel::Executor*);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::arrays
