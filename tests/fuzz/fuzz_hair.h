// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fuzzer/FuzzedDataProvider.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "fuzz_input.h"
#include "support/assembly.h"

namespace fcl_fibers::fuzz {

inline constexpr int kNumbers = 8;  // see readNumber()

inline FiberTreeOptions readOptions(FuzzedDataProvider& data) {
  FiberTreeOptions options;
  options.topology = data.ConsumeBool() ? Topology::kBundle : Topology::kSuperThread;
  options.volumes = data.ConsumeBool() ? FiberTreeOptions::Volumes::kLayeredBoxes
                                       : FiberTreeOptions::Volumes::kWrappedSpheres;
  options.report = data.ConsumeBool() ? Report::kCapsules : Report::kVolumes;
  options.ignored_neighbors = data.ConsumeIntegralInRange(0, 3);
  options.margin = data.ConsumeBool() ? 0 : data.ConsumeFloatingPointInRange(0.0, 10.0);
  return options;
}

template <typename S>
struct Hair : test::Assembly<S> {
  std::vector<std::int32_t> groups;  ///< empty if there are none

  explicit Hair(FuzzedDataProvider& data) {
    const int fibers = data.ConsumeIntegralInRange(0, 12);
    for (int f = 0; f < fibers; ++f) {
      this->point_begin.push_back(this->pointCount() +
                                  data.ConsumeIntegralInRange<std::size_t>(0, 12));
    }
    this->radii_are = data.PickValueInArray({Radii::kOne, Radii::kPerFiber, Radii::kPerSegment});
    if (data.ConsumeBool()) {
      for (int f = 0; f < fibers; ++f) groups.push_back(data.ConsumeIntegralInRange(0, 2));
    }
    readNumbers(data);
  }

  void readNumbers(FuzzedDataProvider& data) {
    this->points.resize(3 * this->pointCount());
    for (S& x : this->points) x = readNumber<S>(data, kNumbers);
    this->radii.resize(this->radii_are == Radii::kOne        ? 1
                       : this->radii_are == Radii::kPerFiber ? this->fiberCount()
                                                             : this->pointCount());
    for (S& radius : this->radii) radius = std::fabs(readNumber<S>(data, kNumbers)) / 4;
  }

  FiberArrays<S> arrays() const {
    FiberArrays<S> arrays = this->view();
    if (!groups.empty()) arrays.groups = groups.data();
    return arrays;
  }

  /// Whether a and b are of one group or neighbours.
  bool isLeftOut(SegmentPair pair, const FiberTreeOptions& options) const {
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    const std::size_t f = this->fiberOf(a), g = this->fiberOf(b);
    if (!groups.empty() && groups[f] != 0 && groups[f] == groups[g]) return true;
    return f == g && b - a <= static_cast<std::size_t>(options.ignored_neighbors);
  }

  /// The largest coordinate or radius.
  double size() const {
    double size = 0;
    for (const S x : this->points) size = std::max(size, std::fabs(static_cast<double>(x)));
    for (const S radius : this->radii) size = std::max(size, static_cast<double>(radius));
    return size;
  }

 private:
  using Radii = typename FiberArrays<S>::Radii;
};

}  // namespace fcl_fibers::fuzz
