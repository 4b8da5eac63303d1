// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace fcl_fibers::test {

/// Numbers that depend on the seed alone: the standard's distributions differ between libraries.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// Takes two of these bytes for each number as long as there are two, so that a fuzzer chooses
  /// what else is random. They are borrowed.
  Random(std::uint64_t seed, const std::uint8_t* bytes, std::size_t size)
      : engine_(seed), bytes_(bytes), size_(size) {}

  /// In [0, 1).
  double unit() {
    return hasBytes() ? takeBytes() * 0x1p-16 : static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  double between(double low, double high) { return low + (high - low) * unit(); }
  std::size_t below(std::size_t count) {
    return static_cast<std::size_t>((hasBytes() ? takeBytes() : engine_()) % count);
  }

  Eigen::Vector3d inCube(double half_side) {
    const double x = between(-half_side, half_side);
    const double y = between(-half_side, half_side);
    const double z = between(-half_side, half_side);
    return {x, y, z};
  }

  Eigen::Vector3d direction() {
    for (;;) {
      const Eigen::Vector3d p = inCube(1);
      const double length = p.norm();
      if (length > 0.1 && length <= 1) return p / length;
    }
  }

  Eigen::Quaterniond rotation(double largest_angle = 3.14) {
    const Eigen::Vector3d axis = direction();
    return Eigen::Quaterniond(Eigen::AngleAxisd(between(-largest_angle, largest_angle), axis));
  }

  template <typename T>
  void shuffle(std::vector<T>& items) {
    for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[below(i)]);
  }

 private:
  bool hasBytes() const { return size_ > 1; }
  std::uint32_t takeBytes() {
    const std::uint32_t low = bytes_[0], high = bytes_[1];
    bytes_ += 2;
    size_ -= 2;
    return low + (high << 8);
  }

  std::mt19937_64 engine_;
  const std::uint8_t* bytes_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace fcl_fibers::test
