// SPDX-License-Identifier: BSD-3-Clause
#include "arrays/array_source.h"

#include <algorithm>
#include <cmath>

#include "arrays/coordinates.h"
#include "arrays/fiber_arrays.h"
#include "fibers/options.h"

namespace fcl_fibers::arrays {

using fibers::throwInvalidArgument;
using geometry::Frame;
using index::SegmentId;

template <typename S>
bool ArraySource<S>::read(const SegmentId* ids, int count, int ahead, const Frame& frame,
                          index::SegmentBlock& out, index::BlockMask& present) const {
  withStrides(fibers_, [&](auto point, auto axis) {
    // Copies, which what is written cannot change, stay in registers.
    const S* const points = fibers_.points;
    const double scale = frame.scale;
    const double origin[3] = {frame.origin.x, frame.origin.y, frame.origin.z};
    const int read = count, in_all = count + ahead;
    for (int i = read; i < in_all; ++i) {
      const S* const first = points + std::ptrdiff_t{ids[i]} * point;
      __builtin_prefetch(first);
      __builtin_prefetch(first + point + 2 * axis);
    }
    for (int i = 0; i < read; ++i) {
      const S* const first = points + std::ptrdiff_t{ids[i]} * point;
      for (int k = 0; k < 3; ++k) {
        out.a[k][i] = scale * (static_cast<double>(first[k * axis]) - origin[k]);
        out.b[k][i] = scale * (static_cast<double>(first[k * axis + point]) - origin[k]);
      }
    }
  });
  readRadii(ids, count, frame.scale, out.radius);
  present = geometry::firstOfBlock(count);
  return true;
}

template <typename S>
void ArraySource<S>::readRadii(const SegmentId* ids, int count, double scale, double* out) const {
  const auto index = [ids](int i) { return static_cast<std::size_t>(ids[i]); };
  switch (fibers_.radii_are) {
    case FiberArrays<S>::Radii::kPerFiber: {
      std::size_t fiber = 0, begin = 0, end = 0;
      for (int i = 0; i < count; ++i) {
        if (index(i) < begin || index(i) >= end) {
          fiber = fiberOf(fibers_.point_begin, fibers_.fiber_count, index(i));
          begin = fibers_.point_begin[fiber];
          end = fibers_.point_begin[fiber + 1];
        }
        out[i] = scale * static_cast<double>(fibers_.radii[fiber]);
      }
      break;
    }
    case FiberArrays<S>::Radii::kPerFirstPoint:
      for (int i = 0; i < count; ++i) out[i] = scale * static_cast<double>(fibers_.radii[index(i)]);
      break;
    default:
      std::fill_n(out, count, scale * static_cast<double>(fibers_.radii[0]));
  }
}

template <typename S>
void ArraySource<S>::refuse(SegmentId id, const Frame&) const {
  throwInvalidArgument("FiberTree",
                       "the capsule at point " + std::to_string(id) +
                           " cannot be read; do not change the arrays during the call");
}

namespace {

template <typename S>
double largestRadius(const char* call, const FiberArrays<S>& fibers) {
  using Radii = typename FiberArrays<S>::Radii;
  double largest = 0;
  const auto take = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double radius = static_cast<double>(fibers.radii[i]);
      if (!(radius >= 0 && std::isfinite(radius))) {
        const bool is_one = fibers.radii_are == Radii::kOne;
        throwInvalidArgument(
            call, (is_one ? std::string("the radius") : "radius " + std::to_string(i)) +
                      " is negative, NaN or infinite; give a finite radius of 0 or more");
      }
      largest = std::max(largest, radius);
    }
  };
  if (fibers.radii_are != Radii::kPerFirstPoint) {
    take(0, radiusCount(fibers));
    return largest;
  }
  for (std::size_t f = 0; f < fibers.fiber_count; ++f) {
    if (const std::size_t end = pointEnd(fibers, f); end > 0) take(fibers.point_begin[f], end - 1);
  }
  return largest;
}

}  // namespace

template <typename S>
double checkArrays(const char* call, const FiberArrays<S>& fibers) {
  checkEnds(fibers, [call](const std::string& what) { throwInvalidArgument(call, what); });
  const std::size_t* begin = fibers.point_begin;
  for (std::size_t f = 0; f < fibers.fiber_count; ++f) {
    if (begin[f + 1] < begin[f]) {
      throwInvalidArgument(call, "point_begin descends at fiber " + std::to_string(f) + " from " +
                                     std::to_string(begin[f]) + " to " +
                                     std::to_string(begin[f + 1]) +
                                     "; each number must be at least the one before");
    }
    if (fibers.point_end == nullptr) continue;
    if (const std::size_t end = fibers.point_end[f]; end < begin[f] || end > begin[f + 1]) {
      throwInvalidArgument(call, "point_end of fiber " + std::to_string(f) + " is " +
                                     std::to_string(end) + "; give a number from " +
                                     std::to_string(begin[f]) + ", where the fiber begins, to " +
                                     std::to_string(begin[f + 1]) + ", where the next one does");
    }
  }
  double largest = largestRadius(call, fibers);
  if (fibers.point_end == nullptr) {
    return std::max(largest, largestCoordinate(call, fibers, 0, fibers.point_count));
  }
  for (std::size_t f = 0; f < fibers.fiber_count; ++f) {
    largest = std::max(largest, largestCoordinate(call, fibers, begin[f], fibers.point_end[f]));
  }
  return largest;
}

template <typename S>
bool ArraySource<S>::staysFiniteIn(const Frame& frame) const {
  // The factor leaves room for sums of a few coordinates, in the frame and in the world.
  const double most = 16 * (largest_ + maxNorm(frame.origin));
  return std::isfinite(most) && std::isfinite(frame.scale * most);
}

template <typename S>
Frame frameFor(const char* call, const ArraySource<S>& source, const std::vector<SegmentId>& ids) {
  const Frame frame = index::frameFor(source, ids);
  if (!source.staysFiniteIn(frame)) {
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
  const bool has_roots = hasAny(fibers.root_segments);
  constexpr std::uint32_t kAll = ~std::uint32_t{0};
  for (std::size_t f = 0; has_roots && f < fibers.fiber_count; ++f) {
    if (fibers.root_segments[f] < 0) {
      throwInvalidArgument("FiberTree::build",
                           "root_segments of fiber " + std::to_string(f) + " is " +
                               std::to_string(fibers.root_segments[f]) + "; give 0 or more");
    }
  }
  table.reserve(fibers.fiber_count, fibers.point_count,
                {has_closed, has_groups,
                 has_roots || fibers.meets != nullptr || fibers.categories != nullptr});
  table.addGap(static_cast<SegmentId>(fibers.point_begin[0]));
  for (std::size_t f = 0; f < fibers.fiber_count; ++f) {
    table.startFiber({/*has_neighbors=*/true,
                      has_closed && fibers.closed[f] != 0,
                      has_groups ? fibers.groups[f] : tree::kNoGroup,
                      {fibers.categories != nullptr ? fibers.categories[f] : kAll,
                       fibers.meets != nullptr ? fibers.meets[f] : kAll},
                      has_roots ? fibers.root_segments[f] : 0});
    const std::size_t end = pointEnd(fibers, f);
    for (std::size_t i = fibers.point_begin[f]; i < end; ++i) {
      const bool needs_length = table.hasArcLengths() && i + 1 < end;
      table.addId(needs_length ? norm(pointOf(fibers, i + 1) - pointOf(fibers, i)) : 0);
    }
    table.addGap(static_cast<SegmentId>(fibers.point_begin[f + 1] - end));
  }
}

template class ArraySource<float>;
template class ArraySource<double>;
template double checkArrays(const char*, const FiberArrays<float>&);
template double checkArrays(const char*, const FiberArrays<double>&);
template Frame frameFor(const char*, const ArraySource<float>&, const std::vector<SegmentId>&);
template Frame frameFor(const char*, const ArraySource<double>&, const std::vector<SegmentId>&);
template void addFibers(const FiberArrays<float>&, fibers::FiberTable&);
template void addFibers(const FiberArrays<double>&, fibers::FiberTable&);

}  // namespace fcl_fibers::arrays
