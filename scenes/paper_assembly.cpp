// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/paper_scenes.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "arguments.h"
#include "scenes/cosserat_rod.h"
#include "scenes/fiber_random.h"
#include "scenes/paper_rods.h"

namespace fcl_fibers::scenes {
namespace {

// The assembly of cases 1 and 2.
constexpr double kAssemblyLength = 15;  // cm
constexpr int kAssemblyGrid = 50;
constexpr double kLoadDeviation = 0.02;  // of force and torque, and of their direction in radians
constexpr double kStaticSwing = 0.05;    // of the load
constexpr double kStaticSwingPerFrame = 0.1;  // rad

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

RodLoad tipLoad(const TipLoad& load) {
  RodLoad rod_load;
  rod_load.tip_force = load.force;
  rod_load.tip_torque = load.torque;
  return rod_load;
}

RodLoad tipLoad(const TipLoad& load, const AssemblyFiber& fiber) {
  const Eigen::AngleAxisd turn(fiber.turn, Vector::UnitZ());
  return tipLoad(
      {fiber.force_scale * (turn * load.force), fiber.torque_scale * (turn * load.torque)});
}

// Shapes of the guide filament in the states 0 to `last`.
std::vector<RodShape> guideShapes(const std::vector<TipLoad>& trajectory, std::size_t last,
                                  const RodGrid& grid) {
  std::vector<RodShape> shapes;
  shapes.reserve(last + 1);
  for (std::size_t i = 0; i <= last; ++i) {
    const RodShape* guess = shapes.empty() ? nullptr : &shapes.back();
    shapes.push_back(solveRod(hair(kAssemblyLength), tipLoad(trajectory[i]), grid.solved(), guess));
  }
  return shapes;
}

template <typename Parameters>
FiberPolylines assembly(const char* call, const Parameters& parameters, const TipLoad& load,
                        const Quaternion& turn, const RodShape& guess, const RodGrid& grid) {
  FiberPolylines scene = emptyScene(call, parameters);
  const double area = parameters.fibers / kRootsPerArea;
  CosseratRod rod = hair(kAssemblyLength);
  rod.base_frame = turn;
  for (std::size_t f = 0; f < static_cast<std::size_t>(parameters.fibers); ++f) {
    const AssemblyFiber fiber = drawAssemblyFiber(parameters.seed, f, area);
    rod.base_point = turn * fiber.root;
    RodLoad rod_load = tipLoad(load, fiber);
    rod_load.tip_force = turn * rod_load.tip_force;
    rod_load.tip_torque = turn * rod_load.tip_torque;
    grid.append(solveRod(rod, rod_load, grid.solved(), &guess), scene);
  }
  return scene;
}

}  // namespace

FiberPolylines makePaperStatic(const PaperStaticParameters& parameters) {
  const char* call = "makePaperStatic";
  requireCounts(call, parameters);
  const RodGrid grid(parameters.segments, kAssemblyGrid);
  const Quaternion turn = parameters.turned ? turnedAboutTwoAxes() : Quaternion::Identity();
  const std::vector<TipLoad> trajectory = loopTrajectory();
  if (parameters.state < 0 || static_cast<std::size_t>(parameters.state) >= trajectory.size()) {
    refuseArgument(call, "state", parameters.state, "ask for one from 0 to 100");
  }
  const auto state = static_cast<std::size_t>(parameters.state);
  TipLoad load = trajectory[state];
  const double swing = 1 + kStaticSwing * std::sin(kStaticSwingPerFrame * parameters.frame);
  load.force *= swing;
  load.torque *= swing;
  const RodShape guess = guideShapes(trajectory, state, grid).back();
  return assembly(call, parameters, load, turn, guess, grid);
}

class PaperDynamic::Impl {
 public:
  explicit Impl(const PaperDynamicParameters& parameters)
      : parameters_(parameters),
        grid_(parameters.segments, kAssemblyGrid),
        guides_(guideShapes(trajectory_, trajectory_.size() - 1, grid_)) {}

  int steps() const { return static_cast<int>(guides_.size()); }

  FiberPolylines scene(int step) const {
    const auto i = static_cast<std::size_t>(step);
    return assembly("PaperDynamic", parameters_, trajectory_[i], Quaternion::Identity(), guides_[i],
                    grid_);
  }

 private:
  PaperDynamicParameters parameters_;
  std::vector<TipLoad> trajectory_ = loopTrajectory();
  RodGrid grid_;
  std::vector<RodShape> guides_;
};

PaperDynamic::PaperDynamic(const PaperDynamicParameters& parameters) {
  requireCounts("PaperDynamic", parameters);
  requireRadius<double>("PaperDynamic", parameters.radius);
  impl_ = std::make_shared<Impl>(parameters);
}

int PaperDynamic::steps() const { return impl_->steps(); }

FiberPolylines PaperDynamic::scene(int step) const {
  if (step < 0 || step >= steps()) {
    refuseArgument("PaperDynamic::scene", "step", step, "ask for one from 0 to steps() - 1");
  }
  return impl_->scene(step);
}

}  // namespace fcl_fibers::scenes
