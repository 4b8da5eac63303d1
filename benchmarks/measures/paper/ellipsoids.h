// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "measures/paper/chain_tree.h"

namespace fcl_fibers::benchmarks {

/// A symmetric matrix.
struct Symmetric {
  double xx, yy, zz, xy, xz, yz;

  double trace() const { return xx + yy + zz; }
  fcl::Vector3d operator*(const fcl::Vector3d& v) const {
    return {xx * v.x() + xy * v.y() + xz * v.z(), xy * v.x() + yy * v.y() + yz * v.z(),
            xz * v.x() + yz * v.y() + zz * v.z()};
  }
};

/// An ellipsoid: all x with (x - center)^T shape^-1 (x - center) <= 1. The semi-axes squared are
/// the eigenvalues of the shape.
struct Ellipsoid {
  static constexpr bool kLayered = false;

  fcl::Vector3d center;
  Symmetric shape;

  static Ellipsoid around(const Capsule& capsule);

  /// Nearly the least ellipsoid around all end points, and then one around that thickened by the
  /// radius. Of many end points only some decide on its shape, but none is outside.
  static Ellipsoid around(CapsuleRange capsules);

  double size() const { return shape.trace(); }

  friend bool overlaps(const Ellipsoid& p, const Ellipsoid& q);
};

}  // namespace fcl_fibers::benchmarks
