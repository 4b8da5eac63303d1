// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "geometry/box.h"
#include "geometry/sphere.h"
#include "geometry/vec3.h"
#include "tree/volumes.h"

namespace fcl_fibers::tree {

inline geometry::Vec3d centerOfVolume(const geometry::Box& box) {
  return {0.5 * (double{box.low[0]} + double{box.high[0]}),
          0.5 * (double{box.low[1]} + double{box.high[1]}),
          0.5 * (double{box.low[2]} + double{box.high[2]})};
}
inline geometry::Vec3d centerOfVolume(const geometry::Sphere& sphere) {
  return {sphere.center[0], sphere.center[1], sphere.center[2]};
}

/// A bound of the coordinates in the volume. It is not finite if the volume is not.
template <class Volume>
double reachOfVolume(const Volume& volume) {
  return maxNorm(centerOfVolume(volume)) + double{volume.size()};
}
/// A bound of the coordinates in all volumes of a tree.
template <class Tree>
double reachOf(const Tree& tree) {
  return tree.empty() ? 0 : reachOfVolume(tree.nodeVolume(0));
}

/// Whether the origin is among the volumes of a tree, or within so many times their size of them.
template <class Tree>
bool isNearOrigin(const Tree& tree, double times) {
  return tree.empty() || reachOf(tree) <= times * double{tree.nodeVolume(0).size()};
}

/// Where the segments of a tree are, estimated from the volumes some levels below the root.
struct Extent {
  geometry::Vec3d middle{0, 0, 0};  ///< middle of the segments
  double spread = 0;                ///< distance of half of them from it, the largest of three axes
  double reach = 0;                 ///< largest distance of one from the origin
  bool is_finite = false;  ///< whether all these volumes are; if not, the rest has no meaning
};

/// Estimates an extent from a sample of places.
class ExtentSample {
 public:
  static constexpr std::size_t kMost = 64;

  /// @param reach  bounds the coordinates of what is there
  /// @pre at most kMost have been added
  void add(const geometry::Vec3d& center, double reach) {
    if (!std::isfinite(reach)) {
      is_finite_ = false;
      return;
    }
    reach_ = std::max(reach_, reach);
    centers_[0][count_] = center.x;
    centers_[1][count_] = center.y;
    centers_[2][count_++] = center.z;
  }

  Extent extent() {
    Extent extent;
    extent.reach = reach_;
    extent.is_finite = is_finite_ && count_ > 0;
    if (!extent.is_finite) return extent;
    double* const middle[3] = {&extent.middle.x, &extent.middle.y, &extent.middle.z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      *middle[axis] = median(centers_[axis]);
      std::array<double, kMost> distances;
      for (std::size_t i = 0; i < count_; ++i) {
        distances[i] = std::fabs(centers_[axis][i] - *middle[axis]);
      }
      extent.spread = std::max(extent.spread, median(distances));
    }
    return extent;
  }

 private:
  double median(std::array<double, kMost>& numbers) const {
    const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(count_ / 2);
    std::nth_element(numbers.begin(), middle,
                     numbers.begin() + static_cast<std::ptrdiff_t>(count_));
    return *middle;
  }

  std::array<double, kMost> centers_[3];
  std::size_t count_ = 0;
  double reach_ = 0;
  bool is_finite_ = true;
};

template <class Tree>
Extent extentOf(const Tree& tree) {
  ExtentSample sample;
  visitVolumes(tree, Tree::kArity == 8 ? 2 : 6,
               [&](const auto& volume, std::int32_t, std::int32_t) {
                 sample.add(centerOfVolume(volume), reachOfVolume(volume));
               });
  return sample.extent();
}

/// Whether a frame that was chosen for one extent is good for another. Bounds are floats, so they
/// are wider for segments that are farther from the origin. The unit has to leave room for squares
/// of lengths.
/// @param drift  how far the middle may have moved, times the spread
inline bool staysWithin(const Extent& then, const Extent& now, double drift) {
  constexpr double kGrowth = 64;
  return now.is_finite && maxNorm(now.middle - then.middle) <= drift * now.spread &&
         now.reach <= kGrowth * then.reach && then.reach <= kGrowth * now.reach;
}

}  // namespace fcl_fibers::tree
