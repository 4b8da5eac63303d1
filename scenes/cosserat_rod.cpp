// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/cosserat_rod.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "arguments.h"

namespace fcl_fibers::scenes {
namespace {

using Matrix = Eigen::Matrix3d;
using Vector = Eigen::Vector3d;
using Quaternion = Eigen::Quaterniond;

// The last correction, in radians; moments likewise. What it leaves is of the size of its square.
constexpr double kTolerance = 1e-6;
constexpr double kLargestResidual = 1e-10;
constexpr int kNewtonSteps = 40;  // for one load
constexpr double kReach = 1;      // radians that a load step may turn a frame by
constexpr double kLeastLoadStep = 0x1p-20;
constexpr double kLargestTurn = 1;     // radians between neighbouring points
constexpr double kLongestSpacing = 1;  // between points, in bending lengths

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

struct State {
  std::vector<Quaternion> frames;
  std::vector<Vector> moments;  // world frame
};

// The equations at all points, and their solution by Newton's method.
//
// From one point to the next, frame and moment are carried on by the rules of fourth order that
// need the end points only: Hermite's quadrature for moment and centre line, and for the frame the
// Magnus expansion, its integrals by the same quadrature (Iserles, Munthe-Kaas, Norsett and Zanna,
// Lie-Group Methods, Acta Numerica, 2000, section 5.4).
//
// A small turn t of the frame and a small change of the moment, dm, are in the world frame. They
// change the internal force and moment along the directors by R^T [n] t and R^T (dm + [m] t), from
// which all other derivatives follow.
class Equations {
 public:
  struct Admitted {
    double reach;  // radians, from the state that the search starts with
    bool stable;
  };

  Equations(const CosseratRod& rod, const RodLoad& load, int segments)
      : bending_compliance_(rod.bending_stiffness.cwiseInverse()),
        reference_curvature_(rod.reference_curvature),
        load_(load),
        length_(rod.length),
        spacing_(rod.length / segments),
        moment_unit_(rod.bending_stiffness.minCoeff() / rod.length),
        nodes_(static_cast<std::size_t>(segments) + 1),
        intervals_(static_cast<std::size_t>(segments)) {}

  State unloaded(const Quaternion& base) const {
    State state;
    state.frames.reserve(nodes_.size());
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const double s = spacing_ * static_cast<double>(i);
      state.frames.push_back(base * exponential(s * reference_curvature_));
    }
    state.moments.assign(nodes_.size(), Vector::Zero());
    return state;
  }

  void applyLoad(const RodLoad& load) { load_ = load; }

  // Moves `state` to an equilibrium that is admitted. If none is found, `state` stays.
  bool solve(State& state, const Admitted& admitted) {
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

  // Fills nodes and jumps; the sum of the squared jumps.
  double evaluate(const State& state) {
    const Vector& weight = load_.distributed_force;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      Node& node = nodes_[i];
      const double s = spacing_ * static_cast<double>(i);
      node.frame = state.frames[i].toRotationMatrix();
      node.force = load_.tip_force + (length_ - s) * weight;
      const Vector m = node.frame.transpose() * state.moments[i];
      const Vector n = node.frame.transpose() * node.force;
      const Vector u = reference_curvature_ + bending_compliance_.cwiseProduct(m);
      const Vector v = Vector::UnitZ();
      node.curvature = u;
      node.curvature_slope = bending_compliance_.cwiseProduct(n.cross(v) - u.cross(m));
      node.tangent = node.frame * v;
      node.bend = node.frame * u.cross(v);
      node.torque = node.force.cross(node.tangent);
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

  // Of the state that was evaluated last.
  double residual() const { return residual_; }
  int iterations() const { return iterations_; }

  double largestTurn() const {
    double largest = 0;
    for (const Interval& interval : intervals_) largest = std::max(largest, interval.turn.norm());
    return largest;
  }

  double largestForce() const {
    return std::max(load_.tip_force.norm(),
                    (load_.tip_force + length_ * load_.distributed_force).norm());
  }

  // The shape in `state`, which was evaluated last.
  RodShape shape(const State& state, const Vector& base_point) const {
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

 private:
  struct Node {
    Matrix frame;
    Vector force;      // n
    Vector curvature;  // u, along the directors
    Vector curvature_slope;
    Vector tangent;  // r'
    Vector bend;     // r''
    Vector torque;   // m'
    Vector torque_slope;

    // m of the correction is riccati * turn + constant.
    Matrix riccati;
    Vector constant;
    Vector turn;    // of the frame, in the world frame
    Vector moment;  // of the correction
  };
  struct Interval {
    Vector turn;  // from frame to frame, along the directors
    Vector turn_jump, moment_jump;
    // The next point's turn is matrix * turn + constant.
    Matrix matrix;
    Vector constant;
  };

  Vector hermite(const Vector& f0, const Vector& f1, const Vector& df0, const Vector& df1) const {
    return 0.5 * spacing_ * (f0 + f1) - spacing_ * spacing_ / 12 * (df1 - df0);
  }

  double addJump(const Vector& jump) {
    const double square = jump.squaredNorm();
    residual_ = std::max(residual_, std::sqrt(square));
    return square;
  }

  // The derivatives of a node's curvature, along the directors, and torque by a turn of its frame
  // and a change of its moment, and those of their slopes.
  struct Derivatives {
    Matrix curvature_by_turn, curvature_by_moment;
    Matrix curvature_slope_by_turn, curvature_slope_by_moment;
    Matrix torque_by_turn;
    Matrix torque_slope_by_turn, torque_slope_by_moment;
  };

  void differentiate(const State& state, std::size_t i, Derivatives& d) const {
    const Node& node = nodes_[i];
    const Matrix& frame = node.frame;
    const Vector& n = node.force;
    const Vector& m = state.moments[i];
    const Vector n_slope = -load_.distributed_force;
    const Vector w = frame * node.curvature;

    d.curvature_by_moment = bending_compliance_.asDiagonal() * frame.transpose();
    d.curvature_by_turn = timesCross(d.curvature_by_moment, m);

    const Matrix bending = frame * d.curvature_by_moment;  // R K^-1 R^T
    const Matrix tangent_by_turn = -crossMatrix(node.tangent);
    d.torque_by_turn = crossTimes(n, tangent_by_turn);

    d.curvature_slope_by_moment.noalias() =
        d.curvature_by_moment * (crossTimes(m, bending) - crossMatrix(w));
    d.curvature_slope_by_turn.noalias() =
        d.curvature_by_moment * (d.torque_by_turn + crossMatrix(node.torque));
    d.curvature_slope_by_turn += timesCross(d.curvature_slope_by_moment, m);

    const Matrix bend_by_moment = tangent_by_turn * bending;
    const Matrix bend_by_turn = timesCross(bend_by_moment, m) - crossMatrix(node.bend);
    d.torque_slope_by_moment = crossTimes(n, bend_by_moment);
    d.torque_slope_by_turn = crossTimes(n, bend_by_turn) + crossTimes(n_slope, tangent_by_turn);
  }

  // Fills turn and moment of the correction; the largest turn.
  //
  // Moments are given at the tip, turns at the base: the sweep from the tip expresses what the
  // correction does to a moment by the turn of its frame (a discrete Riccati equation), the sweep
  // from the base then finds the turns. Either runs in its stable direction.
  double correct(const State& state) {
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
      interval.constant.noalias() =
          inverse * (interval.turn_jump + ua * k + ub * b.constant).eval();
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

  // Whether the rod beyond an interval resists a turn at its begin, where `response` is twice what
  // the turn changes the moment by. What resists turns singular where the rod clamped at that point
  // has a second equilibrium near by.
  bool holds(const Matrix& frame, const Matrix& response) const {
    const Matrix stiffness =
        frame * bending_compliance_.cwiseInverse().asDiagonal() * frame.transpose() -
        0.25 * spacing_ * (response + response.transpose());
    return stiffness(0, 0) > 0 &&
           stiffness(0, 0) * stiffness(1, 1) > stiffness(0, 1) * stiffness(1, 0) &&
           stiffness.determinant() > 0;
  }

  bool momentsSettle(const State& state) const {
    double largest = 0, change = 0;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      largest = std::max(largest, state.moments[i].squaredNorm());
      change = std::max(change, nodes_[i].moment.squaredNorm());
    }
    return std::sqrt(change) <= kTolerance * (moment_unit_ + std::sqrt(largest));
  }

  void move(const State& from, double share, State& to) const {
    to.frames.resize(nodes_.size());
    to.moments.resize(nodes_.size());
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      to.frames[i] = (exponential(share * nodes_[i].turn) * from.frames[i]).normalized();
      to.moments[i] = from.moments[i] + share * nodes_[i].moment;
    }
  }

  Vector bending_compliance_, reference_curvature_;
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

void requireFinite(const char* name, const Vector& v) {
  for (int k = 0; k < 3; ++k) {
    if (!std::isfinite(v[k])) refuseArgument("solveRod", name, v[k], "give finite components");
  }
}

void requireRod(const CosseratRod& rod) {
  if (!(rod.length > 0 && std::isfinite(rod.length))) {
    refuseArgument("solveRod", "length", rod.length, "give a finite length above 0");
  }
  for (int k = 0; k < 3; ++k) {
    if (!(rod.bending_stiffness[k] > 0 && std::isfinite(rod.bending_stiffness[k]))) {
      refuseArgument("solveRod", "a bending stiffness", rod.bending_stiffness[k],
                     "give finite stiffnesses above 0");
    }
  }
  requireFinite("a reference curvature", rod.reference_curvature);
  requireFinite("a coordinate of the base", rod.base_point);
  const double norm = rod.base_frame.norm();
  if (!(std::abs(norm - 1) <= 1e-9)) {
    refuseArgument("solveRod", "the norm of the base frame", norm, "give a quaternion of norm 1");
  }
}

void requireLoad(const RodLoad& load) {
  requireFinite("a component of the tip force", load.tip_force);
  requireFinite("a component of the tip torque", load.tip_torque);
  requireFinite("a component of the distributed force", load.distributed_force);
}

void requireResolution(double turn_or_spacing, double limit, int segments, const char* what) {
  if (turn_or_spacing <= limit) return;
  std::ostringstream message;
  message << "solveRod: " << segments << " segments are too few: " << what << " is "
          << turn_or_spacing << "; give at least " << std::ceil(segments * turn_or_spacing / limit);
  throw std::runtime_error(message.str());
}

State stateFrom(const RodShape& guess, const Quaternion& base, std::size_t points) {
  if (guess.frames.size() != points || guess.moments.size() != points) {
    refuseArgument("solveRod", "the number of the guess's points", guess.frames.size(),
                   "give a shape of as many segments as are asked for");
  }
  State state;
  const Quaternion turn = base * Quaternion(guess.frames.front()).conjugate();
  state.frames.reserve(points);
  state.moments.reserve(points);
  for (std::size_t i = 0; i < points; ++i) {
    state.frames.push_back((turn * Quaternion(guess.frames[i])).normalized());
    state.moments.push_back(turn * guess.moments[i]);
  }
  state.frames.front() = base;
  return state;
}

RodLoad scaled(const RodLoad& load, double share) {
  return {share * load.tip_force, share * load.tip_torque, share * load.distributed_force};
}

RodLoad turned(const RodLoad& load, const Quaternion& turn) {
  return {turn * load.tip_force, turn * load.tip_torque, turn * load.distributed_force};
}

// Follows the equilibrium in `state` while load(t) goes from load(0) to load(1). False if it is
// lost, or turns unstable and `stable` is asked for.
template <typename Load>
bool follow(Equations& equations, const Load& load, bool stable, State& state) {
  double reached = 0;
  for (double step = 1; reached < 1;) {
    const double next = std::min(1.0, reached + step);
    equations.applyLoad(load(next));
    if (equations.solve(state, {kReach, stable})) {
      reached = next;
      step *= 2;
    } else {
      step /= 2;
      if (step < kLeastLoadStep) return false;
    }
  }
  return true;
}

/// The least turn. Eigen's FromTwoVectors() compiles a singular value decomposition, which takes
/// more than half of the time to compile this file.
Quaternion turnBetween(const Vector& from, const Vector& to) {
  const Vector across = from.cross(to);
  const double sine = across.norm();
  const Vector axis = sine > 0 ? Vector(across / sine) : to.unitOrthogonal();
  return Quaternion(Eigen::AngleAxisd(std::atan2(sine, from.dot(to)), axis));
}

// Where one way to the load ends at a point at which the rod snaps, another may not.
State solveFromUnloaded(Equations& equations, const RodLoad& load, double length,
                        const Quaternion& base) {
  const auto growing = [&](double t) { return scaled(load, t); };
  State state = equations.unloaded(base);
  if (follow(equations, growing, true, state)) return state;

  // A load that first pulls along the base and then turns to where it belongs.
  const Vector force = load.tip_force + length * load.distributed_force;
  const Quaternion pull = turnBetween(force, base * Vector::UnitZ());
  State pulled = equations.unloaded(base);
  const RodLoad pulling = turned(load, pull);
  if (follow(
          equations, [&](double t) { return scaled(pulling, t); }, true, pulled) &&
      follow(
          equations, [&](double t) { return turned(load, pull.slerp(t, Quaternion::Identity())); },
          true, pulled)) {
    return pulled;
  }

  equations.applyLoad(load);
  const double anywhere = std::numeric_limits<double>::infinity();
  for (State* start : {&state, &pulled}) {
    if (equations.solve(*start, {anywhere, true})) return *start;
  }
  state = equations.unloaded(base);
  if (follow(equations, growing, false, state)) return state;

  equations.applyLoad(load);
  equations.evaluate(state);
  std::ostringstream message;
  message << "solveRod: no equilibrium found; the residual is " << equations.residual() << " after "
          << equations.iterations()
          << " Newton steps; give more segments, a smaller load or the shape of a similar rod";
  throw std::runtime_error(message.str());
}

}  // namespace

RodShape solveRod(const CosseratRod& rod, const RodLoad& load, int segments,
                  const RodShape* guess) {
  requireRod(rod);
  requireLoad(load);
  if (segments < 1) refuseArgument("solveRod", "segments", segments, "ask for at least 1");

  Equations equations(rod, load, segments);
  const double stiffness = rod.bending_stiffness.minCoeff();
  requireResolution(rod.length / segments * std::sqrt(equations.largestForce() / stiffness),
                    kLongestSpacing, segments, "their length in bending lengths");

  const Quaternion base = Quaternion(rod.base_frame).normalized();
  State state;
  bool solved = false;
  if (guess != nullptr) {
    state = stateFrom(*guess, base, static_cast<std::size_t>(segments) + 1);
    solved = equations.solve(state, {kReach, true});
  }
  if (!solved) state = solveFromUnloaded(equations, load, rod.length, base);
  requireResolution(equations.largestTurn(), kLargestTurn, segments,
                    "the angle from one to the next");
  return equations.shape(state, rod.base_point);
}

std::vector<Eigen::Vector3d> refinedPoints(const RodShape& shape, int pieces) {
  if (pieces < 1) refuseArgument("refinedPoints", "pieces", pieces, "ask for at least 1");
  const std::size_t count = shape.points.size();
  if (count < 2 || shape.tangents.size() != count || shape.bends.size() != count) {
    refuseArgument("refinedPoints", "the number of points", count,
                   "give a shape that solveRod returned");
  }
  const double h = shape.spacing;
  std::vector<Vector> points;
  points.reserve((count - 1) * static_cast<std::size_t>(pieces) + 1);
  points.push_back(shape.points.front());
  for (std::size_t i = 0; i + 1 < count; ++i) {
    // In x from 0 to 1, about the first of the two points.
    const Vector slope = h * shape.tangents[i];
    const Vector bend = h * h * shape.bends[i];
    const Vector d = shape.points[i + 1] - shape.points[i] - slope - 0.5 * bend;
    const Vector d_slope = h * shape.tangents[i + 1] - slope - bend;
    const Vector d_bend = h * h * shape.bends[i + 1] - bend;
    const Vector c3 = 10 * d - 4 * d_slope + 0.5 * d_bend;
    const Vector c4 = -15 * d + 7 * d_slope - d_bend;
    const Vector c5 = 6 * d - 3 * d_slope + 0.5 * d_bend;
    for (int k = 1; k < pieces; ++k) {
      const double x = static_cast<double>(k) / pieces;
      points.push_back(shape.points[i] +
                       x * (slope + x * (0.5 * bend + x * (c3 + x * (c4 + x * c5)))));
    }
    points.push_back(shape.points[i + 1]);
  }
  return points;
}

}  // namespace fcl_fibers::scenes
