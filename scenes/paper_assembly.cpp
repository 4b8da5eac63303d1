// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/paper_scenes.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "arguments.h"
#include "scenes/hair.h"

namespace fcl_fibers::scenes {
namespace {

// The assembly of cases 1 and 2.
constexpr double kAssemblyLength = 15;  // cm
constexpr int kAssemblyGrid = 50;
constexpr double kLoadDeviation = 0.02;  // of force and torque, and of their direction in radians
constexpr double kStaticSwing = 0.05;    // of the load
constexpr double kStaticSwingPerFrame = 0.1;  // rad
constexpr int kLoopSteps = 100;
constexpr double kGuideStiffness = 4.7;  // dyn cm2
constexpr double kLoopForce = 0.05;      // dyn

// So that the loads are the same on every platform, whatever its sine; never -0.
double rounded(double x) { return std::round(x * 1e6) / 1e6 + 0.0; }

struct AssemblyFiber {
  Vector root;
  double force_scale, torque_scale;
  double turn;  // of the load about z, rad
};

// The order of the draws is part of the scene.
AssemblyFiber drawAssemblyFiber(std::uint64_t seed, std::size_t fiber, double area) {
  Random random = fiberRandom(seed, fiber);
  AssemblyFiber drawn;
  drawn.root = drawRoot(random, area);
  drawn.force_scale = 1 + kLoadDeviation * random.normal();
  drawn.torque_scale = 1 + kLoadDeviation * random.normal();
  drawn.turn = kLoadDeviation * random.normal();
  return drawn;
}

RodLoad loadOf(const AssemblyFiber& fiber, const RodLoad& load) {
  const Eigen::AngleAxisd turn(fiber.turn, Vector::UnitZ());
  RodLoad own;
  own.tip_force = fiber.force_scale * (turn * load.tip_force);
  own.tip_torque = fiber.torque_scale * (turn * load.tip_torque);
  return own;
}

// Shapes of the guide filament in the states 0 to `last`.
std::vector<RodShape> guideShapes(const std::vector<RodLoad>& trajectory, std::size_t last,
                                  const RodGrid& grid) {
  std::vector<RodShape> shapes;
  shapes.reserve(last + 1);
  for (std::size_t i = 0; i <= last; ++i) {
    const RodShape* guess = shapes.empty() ? nullptr : &shapes.back();
    try {
      shapes.push_back(solveRod(guideFilament(), trajectory[i], grid.solved(), guess));
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("state " + std::to_string(i) + " of the loads: " + error.what());
    }
  }
  return shapes;
}

template <typename Parameters>
FiberPolylines assembly(const char* call, const Parameters& parameters, const RodLoad& load,
                        const Quaternion& turn, const RodShape& guess, const RodGrid& grid) {
  FiberPolylines scene = emptyScene(call, parameters);
  const double area = parameters.fibers / kRootsPerArea;
  CosseratRod rod = guideFilament();
  rod.base_frame = turn;
  for (std::size_t f = 0; f < static_cast<std::size_t>(parameters.fibers); ++f) {
    const AssemblyFiber fiber = drawAssemblyFiber(parameters.seed, f, area);
    rod.base_point = turn * fiber.root;
    const RodLoad rod_load = turned(loadOf(fiber, load), turn);
    grid.append(solveRod(rod, rod_load, grid.solved(), &guess), scene);
  }
  return scene;
}

}  // namespace

CosseratRod guideFilament() { return hair(kAssemblyLength); }

std::vector<RodLoad> loopTrajectory() {
  std::vector<RodLoad> trajectory;
  const double loop_torque = kGuideStiffness * 2 * kPi / kAssemblyLength;
  for (int step = 0; step <= kLoopSteps; ++step) {
    const double a = static_cast<double>(step) / kLoopSteps;
    const double b = a * a * (3 - 2 * a);
    const double wave = std::sin(kPi * a);
    const double double_wave = std::sin(2 * kPi * a);
    const Vector force = kLoopForce * Vector(b, -wave, double_wave);
    const Vector torque = loop_torque * Vector(b, 0.1 * wave, 0.2 * double_wave);
    RodLoad& load = trajectory.emplace_back();
    load.tip_force = force.unaryExpr(&rounded);
    load.tip_torque = torque.unaryExpr(&rounded);
  }
  return trajectory;
}

FiberPolylines makePaperStatic(const PaperStaticParameters& parameters) {
  const char* call = "makePaperStatic";
  requireCounts(call, parameters);
  const RodGrid grid(parameters.segments, kAssemblyGrid);
  const Quaternion turn = parameters.turned ? turnedAboutTwoAxes() : Quaternion::Identity();
  const std::vector<RodLoad> trajectory = loopTrajectory();
  if (parameters.state < 0 || static_cast<std::size_t>(parameters.state) >= trajectory.size()) {
    refuseArgument(call, "state", parameters.state, "ask for one from 0 to 100");
  }
  const auto state = static_cast<std::size_t>(parameters.state);
  const double swing = 1 + kStaticSwing * std::sin(kStaticSwingPerFrame * parameters.frame);
  const RodLoad load = scaled(trajectory[state], swing);
  const RodShape guess = guideShapes(trajectory, state, grid).back();
  return assembly(call, parameters, load, turn, guess, grid);
}

PaperDynamic::PaperDynamic(const PaperDynamicParameters& parameters) : parameters_(parameters) {
  if (parameters_.loads.empty()) parameters_.loads = loopTrajectory();
  requireCounts("PaperDynamic", parameters);
  requireRadius<double>("PaperDynamic", parameters.radius);
  const RodGrid grid(parameters.segments, kAssemblyGrid);
  guides_ = guideShapes(parameters_.loads, parameters_.loads.size() - 1, grid);
}

FiberPolylines PaperDynamic::scene(int step) const {
  if (step < 0 || step >= steps()) {
    refuseArgument("PaperDynamic::scene", "step", step, "ask for one from 0 to steps() - 1");
  }
  const auto i = static_cast<std::size_t>(step);
  const RodGrid grid(parameters_.segments, kAssemblyGrid);
  const Quaternion turn = parameters_.turned ? turnedAboutTwoAxes() : Quaternion::Identity();
  return assembly("PaperDynamic", parameters_, parameters_.loads[i], turn, guides_[i], grid);
}

}  // namespace fcl_fibers::scenes
