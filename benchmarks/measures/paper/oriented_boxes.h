// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

#include "measures/paper/chain_tree.h"

namespace fcl_fibers::benchmarks {

/// A box along axes of its own.
struct OrientedBox {
  fcl::Vector3d center;
  Eigen::Matrix3d axes;  ///< as columns, of length 1
  fcl::Vector3d half;    ///< half of the lengths

  double size() const { return half.sum(); }

  /// The principal axes of points with this scatter.
  static Eigen::Matrix3d principalAxes(const Eigen::Matrix3d& scatter) {
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors();
  }

  /// @param low, high  extents along the axes
  static OrientedBox between(const Eigen::Matrix3d& axes, const fcl::Vector3d& low,
                             const fcl::Vector3d& high) {
    return {axes * (0.5 * (low + high)), axes, 0.5 * (high - low)};
  }

  /// Around all capsules, along the principal axes of their end points.
  static OrientedBox fitted(CapsuleRange capsules) {
    fcl::Vector3d mean = fcl::Vector3d::Zero();
    for (const Capsule& c : capsules) mean += c.from + c.to;
    mean /= 2 * static_cast<double>(capsules.size());
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const Capsule& c : capsules) {
      for (const fcl::Vector3d* point : {&c.from, &c.to}) {
        const fcl::Vector3d offset = *point - mean;
        scatter += offset * offset.transpose();
      }
    }
    const Eigen::Matrix3d axes = principalAxes(scatter);
    const fcl::Vector3d far = fcl::Vector3d::Constant(std::numeric_limits<double>::infinity());
    fcl::Vector3d low = far, high = -far;
    for (const Capsule& c : capsules) {
      const fcl::Vector3d from = axes.transpose() * c.from, to = axes.transpose() * c.to;
      low = low.cwiseMin((from.cwiseMin(to).array() - c.radius).matrix());
      high = high.cwiseMax((from.cwiseMax(to).array() + c.radius).matrix());
    }
    return between(axes, low, high);
  }

  /// Around two boxes, along the principal axes of their 16 corners. The scatter of a box's corners
  /// around its centre is 8 times the sum of half_i^2 axis_i axis_i^T.
  static OrientedBox layered(const OrientedBox& p, const OrientedBox& q) {
    const fcl::Vector3d apart = 0.5 * (q.center - p.center);
    Eigen::Matrix3d scatter = 2 * apart * apart.transpose();
    for (const OrientedBox* box : {&p, &q}) {
      const Eigen::Matrix3d edges = box->axes * box->half.asDiagonal();
      scatter += edges * edges.transpose();
    }
    const Eigen::Matrix3d axes = principalAxes(scatter);
    const auto reach = [&](const OrientedBox& box) -> fcl::Vector3d {
      return (axes.transpose() * box.axes).cwiseAbs() * box.half;
    };
    const fcl::Vector3d p_center = axes.transpose() * p.center, p_reach = reach(p);
    const fcl::Vector3d q_center = axes.transpose() * q.center, q_reach = reach(q);
    return between(axes, (p_center - p_reach).cwiseMin(q_center - q_reach),
                   (p_center + p_reach).cwiseMax(q_center + q_reach));
  }

  /// The 15 axes that may separate two boxes: the normals of their faces, then the cross products
  /// of their edges (Gottschalk, Lin and Manocha, 1996, section 5).
  friend bool overlaps(const OrientedBox& p, const OrientedBox& q) {
    const fcl::Vector3d t = p.axes.transpose() * (q.center - p.center);
    const Eigen::Matrix3d r = p.axes.transpose() * q.axes;
    const Eigen::Matrix3d size = r.cwiseAbs();
    for (int i = 0; i < 3; ++i) {
      if (std::fabs(t[i]) > p.half[i] + size.row(i).dot(q.half)) return false;
    }
    for (int j = 0; j < 3; ++j) {
      if (std::fabs(t.dot(r.col(j))) > q.half[j] + size.col(j).dot(p.half)) return false;
    }
    // The cross product of nearly parallel edges is nearly zero, and so are all lengths along it,
    // of which only roundings are left. These are of the boxes' size: the centres are no farther
    // apart, now that no face separates them.
    const double roundings =
        64 * std::numeric_limits<double>::epsilon() * (p.half.sum() + q.half.sum());
    for (int i = 0; i < 3; ++i) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
      for (int j = 0; j < 3; ++j) {
        const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
        const double reach = p.half[i1] * size(i2, j) + p.half[i2] * size(i1, j) +
                             q.half[j1] * size(i, j2) + q.half[j2] * size(i, j1);
        if (std::fabs(t[i2] * r(i1, j) - t[i1] * r(i2, j)) > reach + roundings) return false;
      }
    }
    return true;
  }
};

/// Fitted to all that is below.
struct FittedOrientedBox : OrientedBox {
  static constexpr bool kLayered = false;

  static FittedOrientedBox around(const Capsule& c) { return {fitted({&c, &c + 1})}; }
  static FittedOrientedBox around(CapsuleRange capsules) { return {fitted(capsules)}; }
};

/// Around the boxes of both children, in constant time (Lotan, Schwarzer, Halperin and Latombe,
/// 2002, of protein chains).
struct LayeredOrientedBox : OrientedBox {
  static constexpr bool kLayered = true;

  static LayeredOrientedBox around(const Capsule& c) { return {fitted({&c, &c + 1})}; }
  static LayeredOrientedBox around(const LayeredOrientedBox& p, const LayeredOrientedBox& q) {
    return {layered(p, q)};
  }
};

}  // namespace fcl_fibers::benchmarks
