// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/rod_equations.h"

#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace fcl_fibers::scenes {
namespace {

using Matrix = RodEquations::Matrix;
using Vector = RodEquations::Vector;
using Quaternion = RodEquations::Quaternion;

// The last correction of angles, in radians, and of moments. What it leaves is of the size of its
// square.
constexpr double kTolerance = 1e-6;
constexpr double kLargestResidual = 1e-10;
constexpr int kNewtonSteps = 40;  // for one load

// [v], with [v] x = v x x.
Matrix crossMatrix(const Vector& v) {
  Matrix m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// [v] m
Matrix crossTimes(const Vector& v, const Matrix& m) {
  Matrix product;
  for (int k = 0; k < 3; ++k) product.col(k) = v.cross(m.col(k));
  return product;
}

// m [v]
Matrix timesCross(const Matrix& m, const Vector& v) {
  Matrix product;
  product.col(0) = m.col(1) * v.z() - m.col(2) * v.y();
  product.col(1) = m.col(2) * v.x() - m.col(0) * v.z();
  product.col(2) = m.col(0) * v.y() - m.col(1) * v.x();
  return product;
}

Quaternion exponential(const Vector& turn) {
  const double square = turn.squaredNorm();
  const double half_angle = 0.5 * std::sqrt(square);
  // Where the angle is small, its sine over itself is 1 to rounding.
  const double factor = square < 1e-15 ? 0.5 : 0.5 * std::sin(half_angle) / half_angle;
  return {std::cos(half_angle), factor * turn.x(), factor * turn.y(), factor * turn.z()};
}

// J with exponential(t + dt) = exponential(t) exponential(J dt) for small dt; its series to what
// turns of at most one radian leave visible.
Matrix exponentialSlope(const Vector& t) {
  const double square = t.squaredNorm();
  const double b = 1.0 / 2 - square * (1.0 / 24 - square * (1.0 / 720 - square / 40320));
  const double c = 1.0 / 6 - square * (1.0 / 120 - square * (1.0 / 5040 - square / 362880));
  Matrix slope = c * t * t.transpose() - b * crossMatrix(t);
  slope.diagonal().array() += 1 - c * square;
  return slope;
}

}  // namespace

RodEquations::State RodEquations::unloaded(const Quaternion& base) const {
  State state;
  state.frames.reserve(nodes_.size());
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const double s = spacing_ * static_cast<double>(i);
    state.frames.push_back(base * exponential(s * reference_curvature_));
  }
  state.moments.assign(nodes_.size(), Vector::Zero());
  return state;
}

bool RodEquations::solve(State& state, const Admitted& admitted) {
  State current = state;
  double merit = evaluate(current);
  double turned = 0;
  for (int step = 0; step < kNewtonSteps && std::isfinite(merit); ++step) {
    ++iterations_;
    const double turn = correct(current);
    if (!std::isfinite(turn)) return false;
    if (turn < kTolerance && momentsSettle(current)) {
      move(current, 1, trial_);
      evaluate(trial_);
      if (residual_ <= kLargestResidual) {
        if (admitted.stable && !stable_) return false;
        std::swap(state, trial_);
        return true;
      }
    }
    double share = 1;
    double new_merit = 0;
    for (;; share /= 2) {
      if (share < 1e-3) return false;
      move(current, share, trial_);
      new_merit = evaluate(trial_);
      if (new_merit <= (1 - 0.1 * share) * merit) break;
      // At the end of the digits the merit no longer falls.
      if (turn < 1e-7 && new_merit < 1e-14) break;
    }
    turned += share * turn;
    if (turned > admitted.reach) return false;
    merit = new_merit;
    std::swap(current, trial_);
  }
  return false;
}

double RodEquations::evaluate(const State& state) {
  const Vector& weight = load_.distributed_force;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    Node& node = nodes_[i];
    const double s = spacing_ * static_cast<double>(i);
    node.frame = state.frames[i].toRotationMatrix();
    node.force = load_.tip_force + (length_ - s) * weight;
    const Vector m = node.frame.transpose() * state.moments[i];
    const Vector n = node.frame.transpose() * node.force;
    const Vector u = reference_curvature_ + bending_compliance_.cwiseProduct(m);
    const Vector v = Vector::UnitZ() + shear_compliance_.cwiseProduct(n);
    const Vector v_slope =
        -shear_compliance_.cwiseProduct(node.frame.transpose() * weight + u.cross(n));
    const Vector g = node.frame.transpose() * load_.distributed_torque;
    node.curvature = u;
    node.curvature_slope = bending_compliance_.cwiseProduct(n.cross(v) - g - u.cross(m));
    node.tangent = node.frame * v;
    node.bend = node.frame * (u.cross(v) + v_slope);
    node.torque = node.force.cross(node.tangent) - load_.distributed_torque;
    node.torque_slope = node.force.cross(node.bend) - weight.cross(node.tangent);
  }

  double merit = 0;
  residual_ = 0;
  for (std::size_t i = 0; i < intervals_.size(); ++i) {
    const Node& a = nodes_[i];
    const Node& b = nodes_[i + 1];
    Interval& interval = intervals_[i];
    interval.turn = hermite(a.curvature, b.curvature, a.curvature_slope, b.curvature_slope) +
                    spacing_ * spacing_ / 12 * a.curvature.cross(b.curvature);
    const Quaternion jump =
        state.frames[i] * exponential(interval.turn) * state.frames[i + 1].conjugate();
    interval.turn_jump = std::copysign(2.0, jump.w()) * jump.vec();
    interval.moment_jump = state.moments[i] - state.moments[i + 1] +
                           hermite(a.torque, b.torque, a.torque_slope, b.torque_slope);
    merit += addJump(interval.turn_jump) + addJump(interval.moment_jump / moment_unit_);
  }
  tip_jump_ = load_.tip_torque - state.moments.back();
  return merit + addJump(tip_jump_ / moment_unit_);
}

double RodEquations::largestTurn() const {
  double largest = 0;
  for (const Interval& interval : intervals_) largest = std::max(largest, interval.turn.norm());
  return largest;
}

double RodEquations::leastStretch() const {
  double least = std::numeric_limits<double>::infinity();
  for (const Node& node : nodes_) least = std::min(least, node.frame.col(2).dot(node.tangent));
  return least;
}

RodShape RodEquations::shape(const State& state, const Vector& base_point) const {
  RodShape shape;
  const std::size_t count = nodes_.size();
  shape.points.reserve(count);
  shape.tangents.reserve(count);
  shape.bends.reserve(count);
  shape.frames.reserve(count);
  shape.moments = state.moments;
  Vector offset = Vector::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    const Node& node = nodes_[i];
    if (i > 0) {
      const Node& last = nodes_[i - 1];
      offset += hermite(last.tangent, node.tangent, last.bend, node.bend);
    }
    shape.points.push_back(base_point + offset);
    shape.tangents.push_back(node.tangent);
    shape.bends.push_back(node.bend);
    shape.frames.emplace_back(state.frames[i]);
  }
  shape.spacing = spacing_;
  shape.residual = residual_;
  shape.iterations = iterations_;
  shape.is_stable = stable_;
  return shape;
}

void RodEquations::differentiate(const State& state, std::size_t i, Derivatives& d) const {
  const Node& node = nodes_[i];
  const Matrix& frame = node.frame;
  const Vector& n = node.force;
  const Vector& m = state.moments[i];
  const Vector n_slope = -load_.distributed_force;
  const Vector w = frame * node.curvature;

  d.curvature_by_moment = bending_compliance_.asDiagonal() * frame.transpose();
  d.curvature_by_turn = timesCross(d.curvature_by_moment, m);

  const Matrix bending = frame * d.curvature_by_moment;                             // R K^-1 R^T
  const Matrix shear = frame * shear_compliance_.asDiagonal() * frame.transpose();  // R I^-1 R^T
  const Matrix shear_n = timesCross(shear, n);
  const Matrix tangent_by_turn = shear_n - crossMatrix(node.tangent);
  d.torque_by_turn = crossTimes(n, tangent_by_turn);

  d.curvature_slope_by_moment.noalias() =
      d.curvature_by_moment * (crossTimes(m, bending) - crossMatrix(w));
  d.curvature_slope_by_turn.noalias() =
      d.curvature_by_moment * (d.torque_by_turn + crossMatrix(node.torque));
  d.curvature_slope_by_turn += timesCross(d.curvature_slope_by_moment, m);

  const Matrix bend_by_moment = tangent_by_turn * bending;
  const Matrix bend_by_turn = timesCross(bend_by_moment, m) + timesCross(shear, n_slope) -
                              timesCross(timesCross(shear, w), n) + crossTimes(w, shear_n) -
                              crossMatrix(node.bend);
  d.torque_slope_by_moment = crossTimes(n, bend_by_moment);
  d.torque_slope_by_turn = crossTimes(n, bend_by_turn) + crossTimes(n_slope, tangent_by_turn);
}

double RodEquations::correct(const State& state) {
  const double h1 = 0.5 * spacing_;
  const double h2 = spacing_ * spacing_ / 12;
  std::array<Derivatives, 2> derivatives;  // of even and odd points
  differentiate(state, nodes_.size() - 1, derivatives[(nodes_.size() - 1) % 2]);
  nodes_.back().riccati.setZero();
  nodes_.back().constant = tip_jump_;
  stable_ = true;
  for (std::size_t i = intervals_.size(); i-- > 0;) {
    Derivatives& da = derivatives[i % 2];
    const Derivatives& db = derivatives[(i + 1) % 2];
    differentiate(state, i, da);
    Node& a = nodes_[i];
    const Node& b = nodes_[i + 1];
    Interval& interval = intervals_[i];

    // turn_b - turn_a = turn_jump + ta turn_a + ua moment_a + tb turn_b + ub moment_b
    const Matrix slope = b.frame * exponentialSlope(interval.turn);
    const Matrix ta =
        slope * (h1 * da.curvature_by_turn - h2 * crossTimes(b.curvature, da.curvature_by_turn) +
                 h2 * da.curvature_slope_by_turn);
    const Matrix ua = slope * (h1 * da.curvature_by_moment -
                               h2 * crossTimes(b.curvature, da.curvature_by_moment) +
                               h2 * da.curvature_slope_by_moment);
    const Matrix tb =
        slope * (h1 * db.curvature_by_turn + h2 * crossTimes(a.curvature, db.curvature_by_turn) -
                 h2 * db.curvature_slope_by_turn);
    const Matrix ub = slope * (h1 * db.curvature_by_moment +
                               h2 * crossTimes(a.curvature, db.curvature_by_moment) -
                               h2 * db.curvature_slope_by_moment);
    // moment_b - moment_a = moment_jump + va turn_a + wa moment_a + vb turn_b + wb moment_b,
    // hence moment_a = q turn_b - z turn_a + k
    const Matrix wa_inverse = (Matrix::Identity() + h2 * da.torque_slope_by_moment).inverse();
    const Matrix wb = Matrix::Identity() + h2 * db.torque_slope_by_moment;
    const Matrix q =
        wa_inverse * (wb * b.riccati - h1 * db.torque_by_turn + h2 * db.torque_slope_by_turn);
    const Matrix z = wa_inverse * (h1 * da.torque_by_turn + h2 * da.torque_slope_by_turn);
    const Vector k = wa_inverse * (wb * b.constant - interval.moment_jump);

    const Matrix inverse = (Matrix::Identity() - tb - ub * b.riccati - ua * q).inverse();
    interval.matrix.noalias() = inverse * (Matrix::Identity() + ta - ua * z);
    interval.constant.noalias() = inverse * (interval.turn_jump + ua * k + ub * b.constant).eval();
    a.riccati.noalias() = q * interval.matrix;
    a.riccati -= z;
    a.constant.noalias() = q * interval.constant;
    a.constant += k;
    stable_ = stable_ && holds(b.frame, b.riccati + q);
  }

  double largest = 0;
  nodes_[0].turn.setZero();
  nodes_[0].moment = nodes_[0].constant;
  for (std::size_t i = 0; i < intervals_.size(); ++i) {
    Node& b = nodes_[i + 1];
    b.turn = intervals_[i].matrix * nodes_[i].turn + intervals_[i].constant;
    b.moment = b.riccati * b.turn + b.constant;
    const double square = b.turn.squaredNorm();
    if (!std::isfinite(square)) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, square);
  }
  return std::sqrt(largest);
}

bool RodEquations::holds(const Matrix& frame, const Matrix& response) const {
  const Matrix stiffness =
      frame * bending_compliance_.cwiseInverse().asDiagonal() * frame.transpose() -
      0.25 * spacing_ * (response + response.transpose());
  return stiffness(0, 0) > 0 &&
         stiffness(0, 0) * stiffness(1, 1) > stiffness(0, 1) * stiffness(1, 0) &&
         stiffness.determinant() > 0;
}

bool RodEquations::momentsSettle(const State& state) const {
  double largest = 0, change = 0;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    largest = std::max(largest, state.moments[i].squaredNorm());
    change = std::max(change, nodes_[i].moment.squaredNorm());
  }
  return std::sqrt(change) <= kTolerance * (moment_unit_ + std::sqrt(largest));
}

void RodEquations::move(const State& from, double share, State& to) const {
  to.frames.resize(nodes_.size());
  to.moments.resize(nodes_.size());
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    to.frames[i] = (exponential(share * nodes_[i].turn) * from.frames[i]).normalized();
    to.moments[i] = from.moments[i] + share * nodes_[i].moment;
  }
}

double RodEquations::addJump(const Vector& jump) {
  const double square = jump.squaredNorm();
  residual_ = std::max(residual_, std::sqrt(square));
  return square;
}

}  // namespace fcl_fibers::scenes
