// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "geometry/affine_map.h"
#include "geometry/capsule_test.h"
#include "geometry/pair_block.h"
#include "geometry/triangle.h"
#include "simd/always_inline.h"

namespace fcl_fibers::geometry {

/// A block of pairs of a capsule and a triangle of a mesh.
class TrianglePairs : public PairBlock {
 public:
  /// @param posing  takes the points of the mesh to the frame of the capsules
  /// @param margin  pairs this close count as touching
  TrianglePairs(const AffineMap& posing, double margin, double unit);

  /// @pre size() < kCapacity
  /// @param capsule  borrowed until decide() has been called; a box leaves the pair undecided
  /// @param a, b, c  the corners, likewise
  /// @param error    bounds the error of all five points together, after posing
  FCL_FIBERS_ALWAYS_INLINE void add(const CapsuleEnd* capsule, const MeshPoint* a,
                                    const MeshPoint* b, const MeshPoint* c, double error) {
    pairs_[index()] = {capsule, a, b, c};
    error_[index()] = toFloat(error);
    ++size_;
  }

  Verdict decide();

  struct Corners {
    const CapsuleEnd* capsule;
    const MeshPoint *a, *b, *c;
  };
  using Row = std::array<float, kCapacity>;
  const Corners& pair(int i) const { return pairs_[static_cast<std::size_t>(i)]; }
  const Row& error() const { return error_; }
  float margin() const { return margin_; }
  /// The columns of the map and its shift, with a fourth number of 0.
  const MeshPoint (&posing() const)[4] { return posing_; }

 private:
  MeshPoint posing_[4];
  float margin_;
  std::array<Corners, kCapacity> pairs_;
  alignas(64) Row error_;
};

}  // namespace fcl_fibers::geometry
