// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstring>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

#include "arrays.h"

namespace fcl_fibers::python {

template <typename T>
std::vector<T> numbersOf(const char* name, const py::object& array) {
  if (array.is_none()) return {};
  const py::array numbers = py::reinterpret_borrow<py::array>(array);
  const T* const begin = requireArray<T>(name, numbers);
  return std::vector<T>(begin, begin + numbers.size());
}

/// Returns a copy of fibers as polylines.
inline FiberPolylines polylinesOf(const FiberNumbers& given, const FiberLayout& layout) {
  const FiberNumbers numbers = given.asDouble();
  const FiberArrays<double> arrays = numbers.view<double>(layout);
  using Radii = FiberArrays<double>::Radii;
  FiberPolylines fibers;
  fibers.points.resize(arrays.point_count);
  if (arrays.point_count > 0) {
    std::memcpy(fibers.points.data(), arrays.points, arrays.point_count * sizeof(Point));
  }
  if (arrays.radii_are == Radii::kOne) {
    fibers.radius = arrays.radii[0];
  } else {
    fibers.radii.reserve(arrays.point_count);
    if (arrays.radii_are == Radii::kPerPoint) fibers.radii_are = Radii::kPerPoint;
  }
  for (std::size_t f = 0; f < arrays.fiber_count; ++f) {
    const std::size_t begin = arrays.point_begin[f], end = arrays.point_begin[f + 1];
    fibers.point_begin.push_back(end);
    if (arrays.closed != nullptr) fibers.closed.push_back(arrays.closed[f]);
    for (std::size_t i = begin; i < end && arrays.radii_are != Radii::kOne; ++i) {
      fibers.radii.push_back(arrays.radii[arrays.radii_are == Radii::kPerFiber ? f : i]);
    }
  }
  return fibers;
}

}  // namespace fcl_fibers::python
