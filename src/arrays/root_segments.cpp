// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "arrays/array_source.h"
#include "arrays/fiber_arrays.h"
#include "fibers/options.h"
#include "joined_text.h"

namespace fcl_fibers {

template <typename S>
std::vector<std::int32_t> rootSegments(const FiberArrays<S>& fibers, double length) {
  arrays::checkArrays("rootSegments", fibers);
  if (!(length >= 0 && std::isfinite(length))) {
    fibers::throwInvalidArgument(
        "rootSegments", joinedText("length is ", length, "; give a finite length of 0 or more"));
  }
  std::vector<std::int32_t> counts(fibers.fiber_count, 0);
  for (std::size_t f = 0; f < fibers.fiber_count; ++f) {
    double along = 0;
    const std::size_t end = arrays::pointEnd(fibers, f);
    for (std::size_t i = fibers.point_begin[f]; i + 1 < end && along < length; ++i) {
      ++counts[f];
      along += geometry::safeNorm(arrays::pointOf(fibers, i + 1) - arrays::pointOf(fibers, i));
    }
  }
  return counts;
}

template std::vector<std::int32_t> rootSegments(const FiberArrays<float>&, double);
template std::vector<std::int32_t> rootSegments(const FiberArrays<double>&, double);

}  // namespace fcl_fibers
