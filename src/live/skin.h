// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

namespace fcl_fibers::live {

/// Chooses how far beyond what touches pairs are listed. A wide skin lasts long, and each update
/// tests more pairs. It decides by counts alone, so equal calls lead to equal choices.
class Skin {
 public:
  /// @param fixed  in the world's unit; negative if it is chosen
  explicit Skin(double fixed) : fixed_(fixed) {}

  /// What a listing has found.
  struct Listing {
    std::size_t segments, listed, touching;
  };

  /// Returns the skin of the listing that comes next, or 0 to search without a list.
  /// @param size  the usual distance of two axes that touch, in the world's unit
  double next(double size);

  /// Tells what the last listing has found, and how many updates it has served before it was of no
  /// more use. If it was made for another reason than that, it is not told.
  void observe(const Listing& listing, std::int64_t life);

  double get() const { return last_; }  ///< what next() returned last

 private:
  double fixed_;
  double last_ = 0;
  double size_ = 0;
  int exponent_ = -1;      ///< the skin is 2^exponent_ times the size
  std::int64_t rest_ = 0;  ///< how many updates search before a list is tried again
  std::int64_t next_rest_ = 4;
};

}  // namespace fcl_fibers::live
