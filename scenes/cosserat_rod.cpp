// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/cosserat_rod.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "arguments.h"
#include "scenes/rod_equations.h"

namespace fcl_fibers::scenes {
namespace {

using Vector = RodEquations::Vector;
using Quaternion = RodEquations::Quaternion;
using State = RodEquations::State;

constexpr double kReach = 1;  // radians that a load step may turn a frame by
constexpr double kLeastLoadStep = 0x1p-20;
constexpr double kLargestTurn = 1;     // radians between neighbouring points
constexpr double kLongestSpacing = 1;  // between points, in bending lengths

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
    if (!(rod.shear_stiffness[k] > 0)) {
      refuseArgument("solveRod", "a shear stiffness", rod.shear_stiffness[k],
                     "give stiffnesses above 0, or infinity for a rod without that strain");
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
  requireFinite("a component of the distributed torque", load.distributed_torque);
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

// Follows the equilibrium in `state` while load(t) goes from load(0) to load(1). False if it is
// lost, or turns unstable and `stable` is asked for.
template <typename Load>
bool follow(RodEquations& equations, const Load& load, bool stable, State& state) {
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
State solveFromUnloaded(RodEquations& equations, const RodLoad& load, double length,
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

RodLoad scaled(const RodLoad& load, double share) {
  return {share * load.tip_force, share * load.tip_torque, share * load.distributed_force,
          share * load.distributed_torque};
}

RodLoad turned(const RodLoad& load, const Quaternion& turn) {
  return {turn * load.tip_force, turn * load.tip_torque, turn * load.distributed_force,
          turn * load.distributed_torque};
}

RodShape solveRod(const CosseratRod& rod, const RodLoad& load, int segments,
                  const RodShape* guess) {
  requireRod(rod);
  requireLoad(load);
  if (segments < 1) refuseArgument("solveRod", "segments", segments, "ask for at least 1");

  RodEquations equations(rod, load, segments);
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
  const double stretch = equations.leastStretch();
  if (!(stretch > 0)) {
    throw std::runtime_error("solveRod: the load presses a piece of the rod to " +
                             std::to_string(stretch) +
                             " of its length; give a smaller load or a larger shear stiffness");
  }
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
