// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>

#include <fcl/common/types.h>

namespace fcl_fibers::benchmarks {

using Exact = long double;
using ExactVector = Eigen::Matrix<Exact, 3, 1>;

/// A capsule as a pose gives it, each number taken as exact: all points within `radius` of the
/// segment between centre - (length / 2) axis and centre + (length / 2) axis.
struct PosedCapsule {
  fcl::Vector3d centre;
  fcl::Vector3d axis;
  double length;
  double radius;
};

/// What is true of two capsules that come near each other. It is computed with 300 binary digits
/// and rounded to long double once, and shares no code with the library.
class ExactContact {
 public:
  /// Nothing if the capsules are certainly further apart than a tenth of a percent of their radii.
  static std::optional<ExactContact> of(const PosedCapsule& a, const PosedCapsule& b);

  bool touching() const { return touching_; }
  /// Of the surfaces; negative if they overlap.
  Exact distance() const { return distance_; }
  /// Of the axes.
  Exact axisDistance() const { return axis_distance_; }
  /// The lengths that rounding is measured by: both axes and the way between them.
  Exact size() const { return u_.norm() + v_.norm() + axis_distance_; }

  /// Between a normal, which points from a to b, and the line between the closest points. That line
  /// is known if the axes do not meet.
  Exact angleTo(const fcl::Vector3d& normal) const;

  /// How far b has to move along `normal` until the pair is apart, beyond the least such way. Zero
  /// for every right normal, also where many are.
  Exact wayBeyond(const fcl::Vector3d& normal) const;

  /// From a point to the nearest one in the middle between the surfaces, at a place where the axes
  /// are as near as anywhere. Near-parallel axes have many such places: all that exceed the
  /// distance by no more than 64 eps of size(), with eps that of double.
  Exact distanceTo(const fcl::Vector3d& point) const;

 private:
  ExactVector middleAt(Exact s) const;
  Exact squaredGapAt(Exact s) const;
  Exact placeOnB(Exact s) const;

  // The axis of a begins at origin_ and has the direction u_, that of b begins at origin_ + w_.
  ExactVector origin_, w_, u_, v_;
  Exact radius_a_, radius_b_;
  ExactVector apart_;  ///< unit, or zero where the axes meet
  Exact s_;            ///< of a closest point of a's axis
  Exact distance_, axis_distance_;
  bool touching_;
};

}  // namespace fcl_fibers::benchmarks
