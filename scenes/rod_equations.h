// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "scenes/cosserat_rod.h"

namespace fcl_fibers::scenes {

/// The equations at all points, and their solution by Newton's method.
///
/// From one point to the next, frame and moment are carried on by the rules of fourth order that
/// need the end points only: Hermite's quadrature for moment and centre line, and for the frame the
/// Magnus expansion, its integrals by the same quadrature (Iserles, Munthe-Kaas, Norsett and Zanna,
/// Lie-Group Methods, Acta Numerica, 2000, section 5.4).
///
/// A small turn t of the frame and a small change of the moment, dm, are in the world frame. They
/// change the internal force and moment along the directors by R^T [n] t and R^T (dm + [m] t), from
/// which all other derivatives follow.
class RodEquations {
 public:
  using Matrix = Eigen::Matrix3d;
  using Vector = Eigen::Vector3d;
  using Quaternion = Eigen::Quaterniond;

  struct State {
    std::vector<Quaternion> frames;
    std::vector<Vector> moments;  ///< world frame
  };
  struct Admitted {
    double reach;  ///< radians, from the state that the search starts with
    bool stable;
  };

  RodEquations(const CosseratRod& rod, const RodLoad& load, int segments)
      : bending_compliance_(rod.bending_stiffness.cwiseInverse()),
        shear_compliance_(rod.shear_stiffness.cwiseInverse()),
        reference_curvature_(rod.reference_curvature),
        load_(load),
        length_(rod.length),
        spacing_(rod.length / segments),
        moment_unit_(rod.bending_stiffness.minCoeff() / rod.length),
        nodes_(static_cast<std::size_t>(segments) + 1),
        intervals_(static_cast<std::size_t>(segments)) {}

  State unloaded(const Quaternion& base) const;
  void applyLoad(const RodLoad& load) { load_ = load; }

  /// Moves `state` to an equilibrium that is admitted. If none is found, `state` stays.
  bool solve(State& state, const Admitted& admitted);

  /// Fills nodes and jumps; the sum of the squared jumps.
  double evaluate(const State& state);

  /// Of the state that was evaluated last.
  double residual() const { return residual_; }
  int iterations() const { return iterations_; }
  double largestTurn() const;
  /// The least length along d3 that is left of a rod of length 1.
  double leastStretch() const;
  double largestForce() const {
    return std::max(load_.tip_force.norm(),
                    (load_.tip_force + length_ * load_.distributed_force).norm());
  }

  /// The shape in `state`, which was evaluated last.
  RodShape shape(const State& state, const Vector& base_point) const;

 private:
  struct Node {
    Matrix frame;
    Vector force;      /// n
    Vector curvature;  ///< u, along the directors
    Vector curvature_slope;
    Vector tangent;  ///< r'
    Vector bend;     /// r''
    Vector torque;   /// m'
    Vector torque_slope;

    /// m of the correction is riccati * turn + constant.
    Matrix riccati;
    Vector constant;
    Vector turn;    /// of the frame, in the world frame
    Vector moment;  ///< of the correction
  };
  struct Interval {
    Vector turn;  ///< from frame to frame, along the directors
    Vector turn_jump, moment_jump;
    /// The next point's turn is matrix * turn + constant.
    Matrix matrix;
    Vector constant;
  };

  /// The derivatives of a node's curvature, along the directors, and torque by a turn of its frame
  /// and a change of its moment, and those of their slopes.
  struct Derivatives {
    Matrix curvature_by_turn, curvature_by_moment;
    Matrix curvature_slope_by_turn, curvature_slope_by_moment;
    Matrix torque_by_turn;
    Matrix torque_slope_by_turn, torque_slope_by_moment;
  };

  Vector hermite(const Vector& f0, const Vector& f1, const Vector& df0, const Vector& df1) const {
    return 0.5 * spacing_ * (f0 + f1) - spacing_ * spacing_ / 12 * (df1 - df0);
  }

  double addJump(const Vector& jump);
  void differentiate(const State& state, std::size_t i, Derivatives& d) const;
  /// Fills turn and moment of the correction; the largest turn.
  ///
  /// Moments are given at the tip, turns at the base: the sweep from the tip expresses what the
  /// correction does to a moment by the turn of its frame (a discrete Riccati equation), the sweep
  /// from the base then finds the turns. Either runs in its stable direction.
  double correct(const State& state);
  /// Whether the rod beyond an interval resists a turn at its begin, where `response` is twice what
  /// the turn changes the moment by. What resists turns singular where the rod clamped at that
  /// point has a second equilibrium near by.
  bool holds(const Matrix& frame, const Matrix& response) const;
  bool momentsSettle(const State& state) const;
  void move(const State& from, double share, State& to) const;

  Vector bending_compliance_, shear_compliance_, reference_curvature_;
  RodLoad load_;
  double length_, spacing_, moment_unit_;
  std::vector<Node> nodes_;
  std::vector<Interval> intervals_;
  Vector tip_jump_;
  State trial_;
  double residual_ = 0;
  bool stable_ = true;
  int iterations_ = 0;
};

}  // namespace fcl_fibers::scenes
