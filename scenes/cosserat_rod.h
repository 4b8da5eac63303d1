// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace fcl_fibers::scenes {

/// Without alignment, so that the layout does not depend on the caller's instruction set.
using Rotation = Eigen::Quaternion<double, Eigen::DontAlign>;

/// A rod clamped at arc length s = 0, uniform along s, in any consistent units. The frame R(s) has
/// the directors d1, d2, d3 as columns, in world coordinates; r(s) is the centre line. Strains are
/// components along the directors:
///
///     R' = R [u]x,  r' = R v,  m = R K (u - u^),  n = R I (v - e3)
///
/// with the diagonal stiffnesses K and I, and the strains u^ and e3 = (0, 0, 1) of the rod without
/// load. Antman, Nonlinear Problems of Elasticity, 2005, chapter 8.
struct CosseratRod {
  double length = 1;  ///< in s; positive

  /// K: bending about d1 and d2, twist about d3; force times length squared. Positive.
  Eigen::Vector3d bending_stiffness = {1, 1, 1};

  /// I: shear along d1 and d2, stretch along d3; force. Positive; infinite for a rod that neither
  /// shears nor stretches.
  Eigen::Vector3d shear_stiffness =
      Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());

  /// u^: curvatures and twist per length. Zero for a straight rod.
  Eigen::Vector3d reference_curvature = {0, 0, 0};

  Eigen::Vector3d base_point = {0, 0, 0};  ///< r(0)
  Rotation base_frame{1, 0, 0, 0};         ///< R(0), of unit length to 1e-9
};

/// What acts on a rod, in the world frame, whatever the rod does.
struct RodLoad {
  Eigen::Vector3d tip_force = {0, 0, 0};           ///< at s = length
  Eigen::Vector3d tip_torque = {0, 0, 0};          ///< at s = length
  Eigen::Vector3d distributed_force = {0, 0, 0};   ///< f, per length, such as weight
  Eigen::Vector3d distributed_torque = {0, 0, 0};  ///< g, per length
};

/// A load of which all is so many times as large, or turned.
///@{
RodLoad scaled(const RodLoad& load, double share);
RodLoad turned(const RodLoad& load, const Eigen::Quaterniond& turn);
///@}

/// A rod in equilibrium at segments + 1 points of equal distance in s, base first.
struct RodShape {
  double spacing = 0;                     ///< of the points, in s
  std::vector<Eigen::Vector3d> points;    ///< r
  std::vector<Eigen::Vector3d> tangents;  ///< r', of length 1 without shear and stretch
  std::vector<Eigen::Vector3d> bends;     ///< r''
  std::vector<Rotation> frames;           ///< R, of unit length to rounding
  std::vector<Eigen::Vector3d> moments;   ///< m, in the world frame

  /// What is left of the equations: the largest jump of the frame (radians) or of the moment (times
  /// length over the least bending stiffness) from one point to the next.
  double residual = 0;

  /// Newton steps, those of all load steps together.
  int iterations = 0;

  /// Whether the rod would come back to this shape when pushed: no part of it, clamped where it
  /// begins, has a second equilibrium near by. Exact, up to the distance of points, for a rod
  /// without torques; a torque that keeps its direction has no potential to decide by. Shear and
  /// stretch add -n . R (v + e3) / 2 to the potential: as n is given, it is one of frames alone.
  bool is_stable = false;
};

/// The equilibrium of the rod under the load. Error of fourth order in the distance of points.
///
/// The internal force n(s) = tip_force + (length - s) distributed_force is known, and with it v as
/// a function of the frame. So frame and moment alone are unknown, with R(0) and m(length) given.
/// They are solved for at all points at once, which stays well-conditioned however long and soft
/// the rod is, where shooting from the base loses a digit for every 2.3 bending lengths sqrt(K /
/// |n|). Where there are several equilibria, it is a stable one near the guess; without a guess,
/// one that the rod without load leads to as the load grows, stable if such a one is found.
///
/// `guess` is the shape of a similar rod of the same number of segments, for instance under a
/// load that differs a little; it is turned to this rod's base. A poor one costs time only.
///
/// Throws std::invalid_argument where a parameter is none, and std::runtime_error where the points
/// are too few for the shape, no equilibrium is found, or a rod is pressed to nothing.
RodShape solveRod(const CosseratRod& rod, const RodLoad& load, int segments,
                  const RodShape* guess = nullptr);

/// The centre line at `pieces` times as many segments: between two points the quintic through r, r'
/// and r'' of both, whose error is of sixth order in the distance of points. Throws
/// std::invalid_argument if pieces is below 1 or the shape has no points.
std::vector<Eigen::Vector3d> refinedPoints(const RodShape& shape, int pieces);

}  // namespace fcl_fibers::scenes
