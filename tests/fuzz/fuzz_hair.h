// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fuzzer/FuzzedDataProvider.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "fuzz_input.h"
#include "support/assembly.h"

namespace fcl_fibers::fuzz {

inline constexpr int kNumbers = 8;  // see readNumber()

inline FiberTreeOptions readOptions(FuzzedDataProvider& data) {
  FiberTreeOptions options;
  options.ignored_arc_length = readByte(data) / 8.0;
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
  // Empty if there are none.
  std::vector<std::int32_t> groups, roots;
  std::vector<std::uint8_t> closed;
  std::vector<std::uint32_t> meets;

  explicit Hair(FuzzedDataProvider& data) {
    const int fibers = data.ConsumeIntegralInRange(0, 12);
    for (int f = 0; f < fibers; ++f) {
      this->point_begin.push_back(this->pointCount() +
                                  data.ConsumeIntegralInRange<std::size_t>(0, 12));
    }
    this->radii_are = data.PickValueInArray({Radii::kOne, Radii::kPerFiber, Radii::kPerFirstPoint});
    if (data.ConsumeBool()) {
      for (int f = 0; f < fibers; ++f) groups.push_back(data.ConsumeIntegralInRange(0, 2));
    }
    const std::uint8_t features = readByte(data);
    for (const std::uint8_t rules : readBytes(data, this->fiberCount())) {
      if ((features & 1) != 0) closed.push_back(rules & 1);
      if ((features & 2) != 0) meets.push_back(rules >> 1 & 3);
      if ((features & 4) != 0) roots.push_back(rules >> 3 & 3);
    }
    readNumbers(data);
    measure();
  }

  /// Appends a copy, which is a little aside.
  void repeat() {
    const std::size_t points = this->pointCount(), fibers = this->fiberCount();
    for (std::size_t f = 1; f <= fibers; ++f) {
      this->point_begin.push_back(this->point_begin[f] + points);
    }
    const auto twice = [](auto& items) {
      const std::size_t count = items.size();
      for (std::size_t i = 0; i < count; ++i) items.push_back(items[i]);
    };
    twice(this->points);
    for (std::size_t i = 3 * points; i < 6 * points; ++i) this->points[i] += S(0.25);
    if (this->radii_are != Radii::kOne) twice(this->radii);
    twice(groups);
    twice(closed);
    twice(meets);
    twice(roots);
  }

  bool hasFibersOf(const Hair& other) const {
    return this->point_begin == other.point_begin && groups == other.groups &&
           closed == other.closed && meets == other.meets && roots == other.roots;
  }

  /// Takes the lengths along fibers of now, as a build does.
  void measure() {
    lengths_.clear();
    for (std::size_t i = 0; i < this->pointCount(); ++i) {
      lengths_.push_back(0);
      if (!this->startsCapsule(i)) continue;
      const auto a = this->point(i), b = this->point(i + 1);
      lengths_.back() = std::hypot(std::hypot(b[0] - a[0], b[1] - a[1]), b[2] - a[2]);
    }
  }
  void measureAs(const Hair& other) { lengths_ = other.lengths_; }

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
    if (!closed.empty()) arrays.closed = closed.data();
    if (!meets.empty()) arrays.meets = meets.data();
    if (!roots.empty()) arrays.root_segments = roots.data();
    return arrays;
  }

  /// Whether a and b are of one group or neighbours; nothing if rounding decides.
  std::optional<bool> isLeftOut(SegmentPair pair, const FiberTreeOptions& options) const {
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    const std::size_t f = this->fiberOf(a);
    if (f != this->fiberOf(b)) {
      return !groups.empty() && groups[f] != 0 && groups[f] == groups[this->fiberOf(b)];
    }
    if (!groups.empty() && groups[f] != 0) return true;
    const std::size_t first = this->point_begin[f], last = this->point_begin[f + 1] - 1;
    const bool is_closed = !closed.empty() && closed[f] != 0;
    const auto reach = static_cast<std::size_t>(options.ignored_neighbors);
    if (b - a <= reach || (is_closed && last - b + (a - first) <= reach)) return true;
    if (options.ignored_arc_length <= 0) return false;
    double least = arc(a + 1, b);
    if (is_closed) least = std::min(least, arc(first, a) + arc(b + 1, last));
    // Lengths are summed along the whole fiber.
    const double rounding = 1e-12 * (arc(first, last) + options.ignored_arc_length);
    if (least < options.ignored_arc_length - rounding || least == 0) return true;
    if (least > options.ignored_arc_length + rounding) return false;
    return std::nullopt;
  }

  /// Whether a mesh of these categories leaves the segment out.
  bool isLeftOut(std::size_t segment, std::uint32_t categories) const {
    const std::size_t f = this->fiberOf(segment);
    const std::size_t number = segment - this->point_begin[f];
    return (!roots.empty() && number < static_cast<std::size_t>(roots[f])) ||
           (!meets.empty() && (meets[f] & categories) == 0);
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

  /// The length of the capsules that start at the points [begin, end).
  double arc(std::size_t begin, std::size_t end) const {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) sum += lengths_[i];
    return sum;
  }

  std::vector<double> lengths_;  ///< by point, of the capsule that starts there
};

}  // namespace fcl_fibers::fuzz
