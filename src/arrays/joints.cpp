// SPDX-License-Identifier: BSD-3-Clause
#include "arrays/joints.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <sstream>
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

  /// The point of fiber f that repeats another.
  std::size_t ownPoint(std::size_t f) const {
    return are_starts ? fibers.point_begin[f] : pointEnd(fibers, f) - 1;
  }
  bool isInFiber(std::size_t point, std::size_t f) const {
    return point >= fibers.point_begin[f] && point < pointEnd(fibers, f);
  }
  bool isOfFiber(std::size_t point) const {
    return point >= fibers.point_begin[0] &&
           isInFiber(point, fiberOf(fibers.point_begin, fibers.fiber_count, point));
  }
  bool isProper(std::size_t f) const {
    if (at[f] == -1) return true;
    const auto point = static_cast<std::size_t>(at[f]);
    if (at[f] < 0 || point >= fibers.point_count || fibers.point_begin[f] == pointEnd(fibers, f) ||
        (are_starts ? isInFiber(point, f) : point == ownPoint(f))) {
      return false;
    }
    return (fibers.point_end == nullptr || isOfFiber(point)) &&
           pointOf(fibers, point) == pointOf(fibers, ownPoint(f));
  }

  /// @pre the fiber is not proper
  [[noreturn]] void refuse(const char* call, std::size_t f) const {
    const std::string name = are_starts ? "starts_at" : "ends_at";
    const auto refuse = [&](const std::string& what) {
      throwInvalidArgument(
          call, name + " of fiber " + std::to_string(f) + " is " + std::to_string(at[f]) + what);
    };
    const auto point = static_cast<std::size_t>(at[f]);
    if (at[f] < 0 || point >= fibers.point_count) {
      refuse("; give a point from 0 to " + std::to_string(fibers.point_count - 1) +
             ", or -1 for none");
    }
    if (fibers.point_begin[f] == pointEnd(fibers, f)) {
      refuse(", but the fiber has no point; give -1");
    }
    if (are_starts && isInFiber(point, f)) {
      refuse(", a point of the fiber itself; give a point of another fiber, or -1 for none");
    }
    if (point == ownPoint(f)) refuse(", its own last point; give another one, or -1 for none");
    if (!isOfFiber(point)) {
      refuse(", a point of no fiber; give a point of a fiber, or -1 for none");
    }
    const auto textOf = [&](std::size_t i) {
      const geometry::Vec3d p = pointOf(fibers, i);
      std::ostringstream text;
      text.imbue(std::locale::classic());
      text.precision(std::numeric_limits<S>::max_digits10);
      text << "point " << i << " at (" << p.x << ", " << p.y << ", " << p.z << ")";
      return text.str();
    };
    throwInvalidArgument(call, "fiber " + std::to_string(f) +
                                   (are_starts ? " starts with " : " ends with ") +
                                   textOf(ownPoint(f)) + ", but " + name + " is " + textOf(point) +
                                   "; give both the same coordinates, or -1 for none");
  }
};

template <typename S>
void requireProper(const char* call, const Ends<S>& ends, parallel::Executor* executor) {
  const auto isProper = [&](std::size_t f) { return ends.isProper(f); };
  const std::size_t count = ends.fibers.fiber_count;
  if (ends.at == nullptr || areAll(executor, count, isProper)) return;
  std::size_t f = 0;
  while (isProper(f)) ++f;
  ends.refuse(call, f);
}

/// Throws if fibers start at each other in a circle, so that none of them is the first.
/// @pre all are proper
template <typename S>
void requireTrees(const char* call, const FiberArrays<S>& fibers) {
  // By fiber: one more than the fiber from which the way to its start was first gone.
  std::vector<std::uint32_t> seen_from(fibers.fiber_count);
  for (std::size_t f = 0; f < fibers.fiber_count; ++f) {
    const auto mark = static_cast<std::uint32_t>(f + 1);
    for (std::size_t on = f; seen_from[on] == 0 && fibers.starts_at[on] >= 0;) {
      seen_from[on] = mark;
      const auto point = static_cast<std::size_t>(fibers.starts_at[on]);
      const std::size_t next = fiberOf(fibers.point_begin, fibers.fiber_count, point);
      if (seen_from[next] == mark) {
        throwInvalidArgument(
            call, "starts_at of fiber " + std::to_string(on) + " is " + std::to_string(point) +
                      ", a point of fiber " + std::to_string(next) +
                      ", which starts, at the end of a circle, at fiber " + std::to_string(on) +
                      "; give one of the circle -1, and tell a loop by ends_at");
      }
      on = next;
    }
  }
}

std::vector<std::int32_t> copyOf(const std::int32_t* at, std::size_t count) {
  const bool has_any = at != nullptr && std::any_of(at, at + count, [](auto p) { return p != -1; });
  return has_any ? std::vector<std::int32_t>(at, at + count) : std::vector<std::int32_t>();
}

}  // namespace

template <typename S>
Joints checkedJoints(const char* call, const FiberArrays<S>& fibers, parallel::Executor* executor) {
  requireProper<S>(call, {fibers, fibers.starts_at, true}, executor);
  if (fibers.starts_at != nullptr) requireTrees(call, fibers);
  requireProper<S>(call, {fibers, fibers.ends_at, false}, executor);
  return {copyOf(fibers.starts_at, fibers.fiber_count), copyOf(fibers.ends_at, fibers.fiber_count)};
}

template <typename S>
void checkStillJoined(const char* call, const FiberArrays<S>& fibers, const Joints& joints,
                      parallel::Executor* executor) {
  const auto check = [&](const char* name, const std::int32_t* given,
                         const std::vector<std::int32_t>& kept, bool are_starts) {
    const auto keptAt = [&](std::size_t f) { return kept.empty() ? -1 : kept[f]; };
    for (std::size_t f = 0; given != nullptr && f < fibers.fiber_count; ++f) {
      if (given[f] == keptAt(f)) continue;
      throwInvalidArgument(
          call, joinedText(name, " of fiber ", f, " is ", given[f], ", but was ", keptAt(f),
                           " at the last build(); call build() "
                           "instead"));
    }
    requireProper<S>(call, {fibers, kept.empty() ? nullptr : kept.data(), are_starts}, executor);
  };
  check("starts_at", fibers.starts_at, joints.starts_at, true);
  check("ends_at", fibers.ends_at, joints.ends_at, false);
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
