// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "support/assembly.h"
#include "support/exact_geometry.h"
#include "support/touch_oracle.h"

namespace fcl_fibers::test {

/// The smallest box around all capsules.
template <typename S>
ExactBox boxAround(const Assembly<S>& fibers) {
  const std::vector<GivenCapsule> capsules = fibers.capsules();
  ExactBox all = boxOf(roundedCapsule(capsules.front()));
  for (const GivenCapsule& capsule : capsules) {
    const ExactBox box = boxOf(roundedCapsule(capsule));
    all = {all.min.cwiseMin(box.min), all.max.cwiseMax(box.max)};
  }
  return all;
}

/// Copies of a row on a grid of side^3 places, which do not touch each other. First the row's
/// points lose the digits that the farthest copy cannot hold, so all copies are the same.
template <typename S>
class Copies {
 public:
  Copies(const Assembly<S>& fibers, double margin, int side) : one(fibers) {
    const ExactBox box = boxAround(fibers);
    const Real half = ((box.max - box.min) / 2).maxCoeff();
    const Real size = 4 * half + margin;
    const double apart = std::ldexp(1.0, size > 0 ? std::ilogb(size) + 1 : 0);
    const auto way = static_cast<S>(apart), farthest = static_cast<S>((side - 1) * apart);
    all.radii_are = fibers.radii_are;
    is_possible = std::isfinite(way) && (side - 1) * apart < 0x1p1010;
    for (S& x : one.points) x = (x + farthest) - farthest;
    for (int copy = 0; copy < side * side * side; ++copy) {
      const S shift[] = {way * S(copy % side), way * S(copy / side % side),
                         way * S(copy / side / side)};
      const std::size_t first = all.pointCount();
      for (std::size_t i = 0; i < one.points.size(); ++i) {
        const S x = one.points[i] + shift[i % 3];
        is_possible = is_possible && x - shift[i % 3] == one.points[i];
        all.points.push_back(x);
      }
      all.radii.insert(all.radii.end(), one.radii.begin(), one.radii.end());
      for (std::size_t f = 1; f <= one.fiberCount(); ++f) {
        all.point_begin.push_back(first + one.point_begin[f]);
      }
    }
  }

  Assembly<S> one, all;
  bool is_possible;
};

}  // namespace fcl_fibers::test
