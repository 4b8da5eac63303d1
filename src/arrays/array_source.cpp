// SPDX-License-Identifier: BSD-3-Clause
#include "arrays/array_source.h"

#include <algorithm>
#include <cmath>

#include "arrays/fiber_arrays.h"
#include "fibers/options.h"

namespace fcl_fibers::arrays {

using fibers::throwInvalidArgument;
using geometry::Frame;
using geometry::Segment;
using index::SegmentId;

template <typename S>
SegmentId ArraySource<S>::read(SegmentId begin, SegmentId end, const Frame& frame, Segment* out,
                               std::uint64_t& present) const {
  const auto first = static_cast<std::size_t>(begin), last = static_cast<std::size_t>(end);
  std::size_t fiber = fiberOf(fibers_.point_begin, fibers_.fiber_count, first);
  std::uint64_t read = 0;
  for (std::size_t i = first; i < last; ++fiber) {
    const std::size_t fiber_end = fibers_.point_begin[fiber + 1];
    for (const std::size_t stop = std::min(fiber_end, last); i < stop; ++i) {
      if (i + 1 == fiber_end) continue;
      out[i - first] = {frame.fromWorld(pointOf(fibers_, i)),
                        frame.fromWorld(pointOf(fibers_, i + 1)),
                        frame.scale * radiusOf(fibers_, i, fiber)};
      read |= std::uint64_t{1} << (i - first);
    }
  }
  present = read;
  return end;
}

template <typename S>
void ArraySource<S>::refuse(SegmentId id, const Frame&) const {
  throwInvalidArgument("FiberTree",
                       "the capsule at point " + std::to_string(id) +
                           " cannot be read; do not change the arrays during the call");
}

namespace {

template <typename S>
double largestCoordinate(const char* call, const FiberArrays<S>& fibers) {
  double largest = 0;
  for (std::size_t i = 0; i < 3 * fibers.point_count; ++i) {
    const double coordinate = std::fabs(static_cast<double>(fibers.points[i]));
    if (!std::isfinite(coordinate)) {
      throwInvalidArgument(call, "point " + std::to_string(i / 3) +
                                     " is NaN or infinite; give it finite coordinates");
    }
    largest = std::max(largest, coordinate);
  }
  return largest;
}

/// Checks the radius at the last point of a fiber too, although no capsule starts there.
template <typename S>
double largestRadius(const char* call, const FiberArrays<S>& fibers) {
  double largest = 0;
  for (std::size_t i = 0; i < radiusCount(fibers); ++i) {
    const double radius = static_cast<double>(fibers.radii[i]);
    if (!(radius >= 0 && std::isfinite(radius))) {
      throwInvalidArgument(call,
                           "radius " + std::to_string(i) +
                               " is negative, NaN or infinite; give a finite one of 0 or more");
    }
    largest = std::max(largest, radius);
  }
  return largest;
}

}  // namespace

template <typename S>
Frame checkArrays(const char* call, const FiberArrays<S>& fibers) {
  checkEnds(fibers, [call](const std::string& what) { throwInvalidArgument(call, what); });
  const std::size_t* begin = fibers.point_begin;
  for (std::size_t f = 0; f < fibers.fiber_count; ++f) {
    if (begin[f + 1] < begin[f]) {
      throwInvalidArgument(call, "point_begin descends at fiber " + std::to_string(f) + "; fix it");
    }
  }
  const double largest = std::max(largestCoordinate(call, fibers), largestRadius(call, fibers));
  const Frame frame =
      frameFor(ArraySource<S>(fibers), 0, static_cast<SegmentId>(fibers.point_count));
  // The factor leaves room for sums of a few coordinates.
  if (!std::isfinite(16 * frame.scale * (largest + maxNorm(frame.origin)))) {
    throwInvalidArgument(
        call, "coordinates overflow; bring the fibers nearer to the origin or change their unit");
  }
  return frame;
}

template <typename S>
void addFibers(const FiberArrays<S>& fibers, fibers::FiberTable& table) {
  const auto hasAny = [&](const auto* values) {
    return values != nullptr &&
           std::any_of(values, values + fibers.fiber_count, [](auto value) { return value != 0; });
  };
  const bool has_closed = hasAny(fibers.closed), has_groups = hasAny(fibers.groups);
  table.reserve(fibers.fiber_count, fibers.point_count, has_closed, has_groups);
  for (std::size_t f = 0; f < fibers.fiber_count; ++f) {
    table.startFiber({/*has_neighbors=*/true, has_closed && fibers.closed[f] != 0,
                      has_groups ? fibers.groups[f] : tree::kNoGroup});
    const std::size_t end = fibers.point_begin[f + 1];
    for (std::size_t i = fibers.point_begin[f]; i < end; ++i) {
      const bool needs_length = table.hasArcLengths() && i + 1 < end;
      table.addId(needs_length ? norm(pointOf(fibers, i + 1) - pointOf(fibers, i)) : 0);
    }
  }
}

template class ArraySource<float>;
template class ArraySource<double>;
template Frame checkArrays(const char*, const FiberArrays<float>&);
template Frame checkArrays(const char*, const FiberArrays<double>&);
template void addFibers(const FiberArrays<float>&, fibers::FiberTable&);
template void addFibers(const FiberArrays<double>&, fibers::FiberTable&);

}  // namespace fcl_fibers::arrays
