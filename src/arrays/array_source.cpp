// SPDX-License-Identifier: BSD-3-Clause
#include "arrays/array_source.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "arrays/coordinates.h"
#include "arrays/fiber_arrays.h"
#include "fibers/options.h"

namespace fcl_fibers::arrays {

using fibers::throwInvalidArgument;
using geometry::Frame;
using index::SegmentId;

namespace {

/// The number of points or fibers that a task reads. It takes some hundredths of a millisecond.
constexpr std::size_t kRange = 8192;

/// Calls visit(fiber, begin, end) for the fibers of the points [begin, end) and those of their
/// points that are in the range.
template <typename S, class Visit>
void forFibers(const FiberArrays<S>& fibers, std::size_t begin, std::size_t end, Visit&& visit) {
  if (begin == end || fibers.fiber_count == 0) return;
  std::size_t f =
      begin < fibers.point_begin[0] ? 0 : fiberOf(fibers.point_begin, fibers.fiber_count, begin);
  for (; f < fibers.fiber_count && fibers.point_begin[f] < end; ++f) {
    visit(f, std::max(begin, fibers.point_begin[f]), std::min(end, pointEnd(fibers, f)));
  }
}

}  // namespace

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
  readRadii(ids, count, frame.scale, out);
  present = geometry::firstOfBlock(count);
  return true;
}

template <typename S>
double ArraySource<S>::readEnds(SegmentId begin, SegmentId end, const Frame& frame,
                                geometry::CapsuleEnd* out, bool& are_tapered) const {
  if (fibers_.point_end != nullptr) return -1;  // nothing may be read between fibers
  double reach = 0;
  const auto readRun = [&](std::size_t from, std::size_t to, const S* radii, std::size_t step) {
    withStrides(fibers_, [&](auto point, auto axis) {
      const double scale = frame.scale;
      const double origin[3] = {frame.origin.x, frame.origin.y, frame.origin.z};
      double largest = 0;
      for (std::size_t i = from; i < to; ++i) {
        const S* const p = fibers_.points + static_cast<std::ptrdiff_t>(i) * point;
        double* const numbers = out[i - static_cast<std::size_t>(begin)].numbers;
        for (int k = 0; k < 3; ++k) {
          numbers[k] = scale * (static_cast<double>(p[k * axis]) - origin[k]);
          largest = std::max(largest, std::fabs(numbers[k]));
        }
        numbers[3] = scale * static_cast<double>(radii[i * step]);
      }
      reach = std::max(reach, largest);
    });
  };
  const auto first = static_cast<std::size_t>(begin), last = static_cast<std::size_t>(end);
  if (fibers_.radii_are == FiberArrays<S>::Radii::kPerFiber) {
    forFibers(fibers_, first, last, [&](std::size_t f, std::size_t from, std::size_t to) {
      readRun(from, to, &fibers_.radii[f], 0);
    });
  } else {
    const bool is_one = fibers_.radii_are == FiberArrays<S>::Radii::kOne;
    readRun(first, last, fibers_.radii, is_one ? 0 : 1);
  }
  if (fibers_.radii_are == FiberArrays<S>::Radii::kPerPoint) {
    const S* const radii = fibers_.radii;
    bool differ = false;
    forFibers(fibers_, first, last, [&](std::size_t f, std::size_t from, std::size_t to) {
      for (std::size_t i = std::max(from, fibers_.point_begin[f] + 1); i < to; ++i) {
        differ |= radii[i] != radii[i - 1];
      }
    });
    are_tapered = are_tapered || differ;
  }
  return reach;
}

template <typename S>
void ArraySource<S>::readRadii(const SegmentId* ids, int count, double scale,
                               index::SegmentBlock& block) const {
  double* const out = block.radius;
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
    case FiberArrays<S>::Radii::kPerPoint:
      block.are_tapered = true;
      for (int i = 0; i < count; ++i) {
        const S* const radii = fibers_.radii + index(i);
        for (int end = 0; end < 2; ++end) {
          block.end_radius[end][i] = scale * static_cast<double>(radii[end]);
        }
        out[i] = std::max(block.end_radius[0][i], block.end_radius[1][i]);
      }
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

/// Throws if a fiber ends before it begins or after the next one begins.
template <typename S>
void requireOrder(const char* call, const FiberArrays<S>& fibers, parallel::Executor* executor) {
  const std::size_t* const begin = fibers.point_begin;
  const std::size_t* const ends = fibers.point_end;
  const auto isOrdered = [&](std::size_t f) {
    return begin[f] <= begin[f + 1] &&
           (ends == nullptr || (begin[f] <= ends[f] && ends[f] <= begin[f + 1]));
  };
  if (areAll(executor, fibers.fiber_count, isOrdered)) return;
  std::size_t f = 0;
  while (isOrdered(f)) ++f;
  if (begin[f + 1] < begin[f]) {
    throwInvalidArgument(call, "point_begin descends at fiber " + std::to_string(f) + " from " +
                                   std::to_string(begin[f]) + " to " +
                                   std::to_string(begin[f + 1]) +
                                   "; each number must be at least the one before");
  }
  throwInvalidArgument(call, "point_end of fiber " + std::to_string(f) + " is " +
                                 std::to_string(ends[f]) + "; give a number from " +
                                 std::to_string(begin[f]) + ", where the fiber begins, to " +
                                 std::to_string(begin[f + 1]) + ", where the next one does");
}

/// The larger of two numbers. NaN is larger than all.
double larger(double p, double q) { return p >= q || std::isnan(p) ? p : q; }

/// Returns the largest of the numbers that largestIn(begin, end) returns for ranges of [0, count).
/// It is not finite if one of them is not.
template <class LargestIn>
double largestOf(parallel::Executor* executor, std::size_t count, LargestIn&& largestIn) {
  std::atomic<double> largest{0};
  parallel::forRanges(executor, count, kRange, [&](std::size_t begin, std::size_t end) {
    const double in_range = largestIn(begin, end);
    double before = largest.load(std::memory_order_relaxed);
    while (!largest.compare_exchange_weak(before, larger(before, in_range),
                                          std::memory_order_relaxed)) {
    }
  });
  return largest;
}

template <typename S>
void requireRadius(const char* call, const FiberArrays<S>& fibers, std::size_t i) {
  const double radius = static_cast<double>(fibers.radii[i]);
  if (radius >= 0 && std::isfinite(radius)) return;
  const bool is_one = fibers.radii_are == FiberArrays<S>::Radii::kOne;
  throwInvalidArgument(call,
                       (is_one ? std::string("the radius") : "radius " + std::to_string(i)) +
                           " is negative, NaN or infinite; give a finite radius of 0 or more");
}

template <typename S>
double largestRadius(const char* call, const FiberArrays<S>& fibers, parallel::Executor* executor) {
  const auto largestIn = [&](std::size_t begin, std::size_t end) {
    double largest = 0;
    bool are_proper = true;
    for (std::size_t i = begin; i < end; ++i) {
      const double radius = static_cast<double>(fibers.radii[i]);
      are_proper &= radius >= 0;
      largest = std::max(largest, radius);
    }
    return are_proper ? largest : std::numeric_limits<double>::quiet_NaN();
  };
  // Between fibers and, of capsules, at the last point of each no number is read.
  const bool are_cones = fibers.radii_are == FiberArrays<S>::Radii::kPerPoint;
  const bool are_by_point = are_cones || fibers.radii_are == FiberArrays<S>::Radii::kPerFirstPoint;
  const std::size_t count = radiusCount(fibers);
  const double largest = largestOf(executor, count, [&](std::size_t begin, std::size_t end) {
    if (!are_by_point) return largestIn(begin, end);
    double most = 0;
    forFibers(fibers, begin, end, [&](std::size_t f, std::size_t first, std::size_t last) {
      if (!are_cones && last == pointEnd(fibers, f) && last > 0) --last;
      most = larger(most, largestIn(first, last));
    });
    return most;
  });
  if (std::isfinite(largest)) return largest;
  if (are_by_point) {
    for (std::size_t f = 0; f < fibers.fiber_count; ++f) {
      const std::size_t end = pointEnd(fibers, f) + (are_cones ? 1 : 0);
      for (std::size_t i = fibers.point_begin[f]; i + 1 < end; ++i) {
        requireRadius(call, fibers, i);
      }
    }
  } else {
    for (std::size_t i = 0; i < count; ++i) requireRadius(call, fibers, i);
  }
  return largest;
}

}  // namespace

template <typename S>
double checkArrays(const char* call, const FiberArrays<S>& fibers, parallel::Executor* executor) {
  checkEnds(fibers, [call](const std::string& what) { throwInvalidArgument(call, what); });
  requireOrder(call, fibers, executor);
  const double radius = largestRadius(call, fibers, executor);
  const std::size_t count = fibers.point_count;
  const double coordinate = largestOf(executor, count, [&](std::size_t first, std::size_t last) {
    if (fibers.point_end == nullptr) return largestCoordinate(fibers, first, last);
    double most = 0;
    forFibers(fibers, first, last, [&](std::size_t, std::size_t from, std::size_t to) {
      most = larger(most, largestCoordinate(fibers, from, to));
    });
    return most;
  });
  if (!std::isfinite(coordinate)) {
    for (std::size_t f = 0; f < fibers.fiber_count; ++f) {
      requireFinite(call, fibers, fibers.point_begin[f], pointEnd(fibers, f));
    }
  }
  return larger(radius, coordinate);
}

template <typename S>
bool ArraySource<S>::staysFiniteIn(const Frame& frame) const {
  // The factor leaves room for sums of a few coordinates, in the frame and in the world.
  const double most = 16 * (largest_ + maxNorm(frame.origin));
  return std::isfinite(most) && std::isfinite(frame.scale * most);
}

template <typename S>
Frame frameFor(const char* call, const ArraySource<S>& source, const tree::SegmentIds& ids) {
  const Frame frame = index::frameFor(source, ids);
  if (!source.staysFiniteIn(frame)) {
    throwInvalidArgument(
        call, "coordinates overflow; bring the fibers nearer to the origin or change their unit");
  }
  return frame;
}

template <typename S>
void addFibers(const FiberArrays<S>& fibers, fibers::FiberTable& table,
               parallel::Executor* executor) {
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
    table.addIds(static_cast<SegmentId>(end - fibers.point_begin[f]));
    table.addGap(static_cast<SegmentId>(fibers.point_begin[f + 1] - end));
  }
  if (!table.hasArcLengths()) return;
  const std::size_t grain = std::max<std::size_t>(
      1, kRange * fibers.fiber_count / std::max<std::size_t>(1, fibers.point_count));
  parallel::forRanges(executor, fibers.fiber_count, grain, [&](std::size_t from, std::size_t to) {
    for (std::size_t f = from; f < to; ++f) {
      const std::size_t begin = fibers.point_begin[f], end = pointEnd(fibers, f);
      table.setLengths(f, [&](std::size_t i) {
        return i + 1 < end - begin
                   ? norm(pointOf(fibers, begin + i + 1) - pointOf(fibers, begin + i))
                   : 0;
      });
    }
  });
}

template class ArraySource<float>;
template class ArraySource<double>;
template double checkArrays(const char*, const FiberArrays<float>&, parallel::Executor*);
template double checkArrays(const char*, const FiberArrays<double>&, parallel::Executor*);
template Frame frameFor(const char*, const ArraySource<float>&, const tree::SegmentIds&);
template Frame frameFor(const char*, const ArraySource<double>&, const tree::SegmentIds&);
template void addFibers(const FiberArrays<float>&, fibers::FiberTable&, parallel::Executor*);
template void addFibers(const FiberArrays<double>&, fibers::FiberTable&, parallel::Executor*);

}  // namespace fcl_fibers::arrays
