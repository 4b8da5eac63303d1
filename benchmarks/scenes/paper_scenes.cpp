// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/paper_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "scenes/cosserat_rod.h"

#include "arguments.h"
#include "scenes/fiber_random.h"

namespace fcl_fibers::scenes {
namespace {

using Quaternion = Eigen::Quaterniond;
using Vector = Eigen::Vector3d;

constexpr double kPi = 3.141592653589793;
constexpr double kRootsPerArea = 325;      // 1 / cm2
constexpr double kEllipseAxesRatio = 1.5;  // longer to shorter
constexpr double kBending = 4.7;           // dyn cm2
constexpr double kTwisting = 3.5;          // dyn cm2

template <typename Parameters>
void requireCounts(const char* call, const Parameters& parameters) {
  if (parameters.fibers < 1) {
    refuseArgument(call, "fibers", parameters.fibers, "ask for at least 1 fiber");
  }
  if (parameters.segments < 1) {
    refuseArgument(call, "segments", parameters.segments, "ask for at least 1 segment per fiber");
  }
}

template <typename Parameters>
FiberPolylines emptyScene(const char* call, const Parameters& parameters) {
  const auto fibers = static_cast<std::size_t>(parameters.fibers);
  FiberPolylines scene;
  scene.radius = requireRadius<double>(call, parameters.radius);
  scene.points.reserve(fibers * (static_cast<std::size_t>(parameters.segments) + 1));
  scene.point_begin.reserve(fibers + 1);
  return scene;
}

// A hair; its own weight stretches it by a part in a million, which is left out.
CosseratRod hair(double length) {
  CosseratRod rod;
  rod.length = length;
  rod.bending_stiffness = {kBending, kBending, kTwisting};
  rod.shear_stiffness.setConstant(std::numeric_limits<double>::infinity());
  return rod;
}

// Uniform over an ellipse in the plane z = 0, the longer axis along x.
Vector drawRoot(Random& random, double area) {
  const double minor_axis = std::sqrt(area / (kPi * kEllipseAxesRatio));
  const double distance = minor_axis * std::sqrt(random.uniform());
  const double direction = 2 * kPi * random.uniform();
  return {kEllipseAxesRatio * distance * std::cos(direction), distance * std::sin(direction), 0};
}

// How a fiber of so many segments is solved: at least at `least` points of equal distance, some of
// them the fiber's own, or else the fiber's own points are some of them.
struct Grid {
  Grid(int segments, int least) {
    if (segments < least) {
      stride = (least + segments - 1) / segments;
      solved = segments * stride;
      return;
    }
    for (solved = least; segments % solved != 0;) ++solved;
    pieces = segments / solved;
  }

  void append(const RodShape& shape, FiberPolylines& scene) const {
    const std::vector<Vector> points = refinedPoints(shape, pieces);
    for (std::size_t i = 0; i < points.size(); i += static_cast<std::size_t>(stride)) {
      scene.points.push_back({points[i].x(), points[i].y(), points[i].z()});
    }
    scene.point_begin.push_back(scene.points.size());
  }

  int solved;
  int pieces = 1;  // of each solved segment
  int stride = 1;  // of the fiber's points among the refined ones
};

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
std::vector<RodShape> guideShapes(const LoadTrajectory& trajectory, std::size_t last,
                                  const Grid& grid) {
  std::vector<RodShape> shapes;
  shapes.reserve(last + 1);
  for (std::size_t i = 0; i <= last; ++i) {
    const RodShape* guess = shapes.empty() ? nullptr : &shapes.back();
    shapes.push_back(
        solveRod(hair(kAssemblyLength), tipLoad(trajectory.states[i]), grid.solved, guess));
  }
  return shapes;
}

template <typename Parameters>
FiberPolylines assembly(const char* call, const Parameters& parameters, const TipLoad& load,
                        const Quaternion& turn, const RodShape& guess, const Grid& grid) {
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
    grid.append(solveRod(rod, rod_load, grid.solved, &guess), scene);
  }
  return scene;
}

// Case 3. The head is a spheroid about y, which points to the back; x points to its left, z up.
constexpr double kHeadWidth = 7.75;  // cm, half of it, as is its height
constexpr double kHeadLength = 9.5;  // cm, half of it
constexpr int kHalfScalpFibers = 50000;
constexpr double kScalpFront = -0.62;  // y of the area's ends, of half the head's length
constexpr double kScalpBack = 0.72;
constexpr double kParting = 0.02;        // rad, from the top
constexpr double kHalfScalpLength = 15;  // cm
constexpr int kHalfScalpGrid = 25;
constexpr double kLift = 0.3;  // rad, of the root's direction from the skin
constexpr double kLiftDeviation = 0.02;
constexpr double kComb = 0.25;  // rad, towards the back
constexpr double kCombDeviation = 0.02;
constexpr double kTopCurvature = 1 / 9.5;    // 1 / cm, at the parting
constexpr double kSideCurvature = 1 / 20.0;  // and at the lower end of the area
constexpr double kCurvatureDeviation = 0.02;
constexpr double kTipPull = 0.002;         // dyn
constexpr double kTipSway = 0.003;         // dyn
constexpr double kTipSwayPerFrame = 0.05;  // rad
constexpr int kGuideCurvatures = 17;
constexpr double kLiftStep = 0.05;  // rad
constexpr int kLiftSteps = 20;

// Area of the head between y = 0 and y = length * t, over 2 pi.
double zone(double t) {
  const double y = kHeadLength * t;
  const double e = std::sqrt(1 - kHeadWidth * kHeadWidth / (kHeadLength * kHeadLength));
  const double x = e * y / kHeadLength;
  return kHeadWidth * (0.5 * y * std::sqrt(1 - x * x) + 0.5 * kHeadLength / e * std::asin(x));
}

// The t with that zone, by Newton's method.
double zoneInverse(double area) {
  const double e2 = 1 - kHeadWidth * kHeadWidth / (kHeadLength * kHeadLength);
  double t = area / (kHeadWidth * kHeadLength);
  for (int i = 0; i < 20; ++i) {
    t -= (zone(t) - area) / (kHeadWidth * kHeadLength * std::sqrt(1 - e2 * t * t));
  }
  return t;
}

bool isOutsideHead(const Point& p) {
  const double x = p[0] / kHeadWidth;
  const double y = p[1] / kHeadLength;
  const double z = p[2] / kHeadWidth;
  return x * x + y * y + z * z >= 1;
}

// Case 4.
constexpr double kStrandLength = 30;  // cm
constexpr int kStrandGrid = 200;
constexpr double kStrandArea = 2000 / kRootsPerArea;  // cm2
constexpr double kRootDistance = 0.01;                // cm, at least
constexpr int kStrandMostFibers = 6000;
constexpr double kHelixTurns = 4;
constexpr double kHelixRadius = 1;  // cm
constexpr double kWeight = 0.05;    // dyn / cm
constexpr double kStrandDeviation = 0.00024;
constexpr double kStrandSway = 0.01;          // dyn
constexpr double kStrandSwayPerFrame = 0.05;  // rad

}  // namespace

FiberPolylines makePaperStatic(const PaperStaticParameters& parameters) {
  const char* call = "makePaperStatic";
  requireCounts(call, parameters);
  const Grid grid(parameters.segments, kAssemblyGrid);
  const Quaternion turn = parameters.turned
                              ? Quaternion(Eigen::AngleAxisd(kPi / 4, Vector::UnitX()) *
                                           Eigen::AngleAxisd(kPi / 4, Vector::UnitY()))
                              : Quaternion::Identity();
  const LoadTrajectory trajectory = loopTrajectory();
  if (parameters.state < 0 ||
      static_cast<std::size_t>(parameters.state) >= trajectory.states.size()) {
    refuseArgument(call, "state", parameters.state, "ask for one from 0 to 100");
  }
  const auto state = static_cast<std::size_t>(parameters.state);
  TipLoad load = trajectory.states[state];
  const double swing = 1 + kStaticSwing * std::sin(kStaticSwingPerFrame * parameters.frame);
  load.force *= swing;
  load.torque *= swing;
  const RodShape guess = guideShapes(trajectory, state, grid).back();
  return assembly(call, parameters, load, turn, guess, grid);
}

class PaperDynamic::Impl {
 public:
  Impl(const PaperDynamicParameters& parameters, LoadTrajectory trajectory)
      : parameters_(parameters),
        trajectory_(std::move(trajectory)),
        grid_(parameters.segments, kAssemblyGrid),
        guides_(guideShapes(trajectory_, trajectory_.states.size() - 1, grid_)) {}

  int steps() const { return static_cast<int>(guides_.size()); }

  FiberPolylines scene(int step) const {
    const auto i = static_cast<std::size_t>(step);
    return assembly("PaperDynamic", parameters_, trajectory_.states[i], Quaternion::Identity(),
                    guides_[i], grid_);
  }

 private:
  PaperDynamicParameters parameters_;
  LoadTrajectory trajectory_;
  Grid grid_;
  std::vector<RodShape> guides_;
};

PaperDynamic::PaperDynamic(const PaperDynamicParameters& parameters, LoadTrajectory trajectory) {
  requireCounts("PaperDynamic", parameters);
  requireRadius<double>("PaperDynamic", parameters.radius);
  if (trajectory.states.empty()) {
    refuseArgument("PaperDynamic", "the number of states", 0, "give at least the start");
  }
  impl_ = std::make_unique<Impl>(parameters, std::move(trajectory));
}

PaperDynamic::PaperDynamic(PaperDynamic&&) noexcept = default;
PaperDynamic& PaperDynamic::operator=(PaperDynamic&&) noexcept = default;
PaperDynamic::~PaperDynamic() = default;

int PaperDynamic::steps() const { return impl_->steps(); }

FiberPolylines PaperDynamic::scene(int step) const {
  if (step < 0 || step >= steps()) {
    refuseArgument("PaperDynamic::scene", "step", step, "ask for one from 0 to steps() - 1");
  }
  return impl_->scene(step);
}

FiberPolylines makePaperHalfScalp(const PaperHalfScalpParameters& parameters) {
  const char* call = "makePaperHalfScalp";
  requireCounts(call, parameters);
  if (parameters.fibers > kHalfScalpFibers) {
    refuseArgument(call, "fibers", parameters.fibers,
                   "ask for no more than the half of the head has room for, 50000");
  }
  FiberPolylines scene = emptyScene(call, parameters);
  const Grid grid(parameters.segments, kHalfScalpGrid);

  // A smaller area lies in the middle of the whole one.
  const double zone_front = zone(kScalpFront);
  const double zone_back = zone(kScalpBack);
  const double widest = kHalfScalpFibers / kRootsPerArea / (zone_back - zone_front);  // rad
  const double share = std::sqrt(parameters.fibers / static_cast<double>(kHalfScalpFibers));
  const double sway = kTipSway * std::sin(kTipSwayPerFrame * parameters.frame);

  // Outward is d1, along the hair d3.
  CosseratRod rod = hair(kHalfScalpLength);
  const RodLoad load = {{kTipPull, sway, 0}, {0, 0, 0}, {0, 0, 0}};
  std::vector<RodShape> guesses;
  for (int i = 0; i < kGuideCurvatures; ++i) {
    const double k = static_cast<double>(i) / (kGuideCurvatures - 1);
    rod.reference_curvature = {0, -(kTopCurvature + k * (kSideCurvature - kTopCurvature)), 0};
    guesses.push_back(
        solveRod(rod, load, grid.solved, guesses.empty() ? nullptr : &guesses.back()));
  }

  for (std::size_t f = 0; f < static_cast<std::size_t>(parameters.fibers); ++f) {
    Random random = fiberRandom(parameters.seed, f);
    const double across = 0.5 + share * (random.uniform() - 0.5);
    const double down = 0.5 + share * (random.uniform() - 0.5);
    const double t = zoneInverse(zone_front + across * (zone_back - zone_front));
    const double angle = kParting + down * widest;
    double lift = kLift + kLiftDeviation * random.normal();
    const double comb = kComb + kCombDeviation * random.normal();
    const double curvature = (kTopCurvature + down * (kSideCurvature - kTopCurvature)) *
                             (1 + kCurvatureDeviation * random.normal());

    const Vector up(std::sin(angle), 0, std::cos(angle));
    const Vector along(std::cos(angle), 0, -std::sin(angle));
    const double ring = std::sqrt((1 - t) * (1 + t));
    rod.base_point = kHeadWidth * ring * up + kHeadLength * t * Vector::UnitY();
    const Vector normal = (ring / kHeadWidth * up + t / kHeadLength * Vector::UnitY()).normalized();
    const Vector back = along.cross(-normal);
    const Vector combed = std::cos(comb) * along + std::sin(comb) * back;
    rod.reference_curvature = {0, -curvature, 0};
    const RodShape& guess =
        guesses[static_cast<std::size_t>(std::lround(down * (kGuideCurvatures - 1)))];

    const std::size_t begin = scene.points.size();
    for (int attempt = 0;; ++attempt, lift += kLiftStep) {
      Eigen::Matrix3d frame;
      frame.col(2) = std::cos(lift) * combed + std::sin(lift) * normal;
      frame.col(0) = std::cos(lift) * normal - std::sin(lift) * combed;
      frame.col(1) = frame.col(2).cross(frame.col(0));
      rod.base_frame = Quaternion(frame).normalized();
      RodLoad turned;
      turned.tip_force = rod.base_frame * load.tip_force;
      grid.append(solveRod(rod, turned, grid.solved, &guess), scene);
      const auto first = scene.points.begin() + static_cast<std::ptrdiff_t>(begin) + 1;
      if (std::all_of(first, scene.points.end(), isOutsideHead)) break;
      if (attempt == kLiftSteps) {
        throw std::runtime_error(std::string(call) + ": fiber " + std::to_string(f) +
                                 " does not leave the head; take another seed");
      }
      scene.points.resize(begin);
      scene.point_begin.pop_back();
    }
  }
  return scene;
}

FiberPolylines makePaperStrand(const PaperStrandParameters& parameters) {
  const char* call = "makePaperStrand";
  requireCounts(call, parameters);
  if (parameters.fibers > kStrandMostFibers) {
    refuseArgument(call, "fibers", parameters.fibers,
                   "ask for no more than the root area has room for, 6000");
  }
  FiberPolylines scene = emptyScene(call, parameters);
  const Grid grid(parameters.segments, kStrandGrid);

  const double rate = 2 * kPi * kHelixTurns / kStrandLength;
  const double slope = kHelixRadius * rate;
  const Vector helix(0, slope * rate, std::sqrt(1 - slope * slope) * rate);
  const Quaternion hanging(Eigen::AngleAxisd(std::atan2(helix.y(), -helix.z()), -Vector::UnitX()));

  CosseratRod rod = hair(kStrandLength);
  rod.reference_curvature = helix;
  rod.base_frame = hanging;
  RodLoad load;
  load.distributed_force = {0, 0, -kWeight};
  load.tip_force = {kStrandSway * std::sin(kStrandSwayPerFrame * parameters.frame), 0, 0};
  const RodShape guess = solveRod(rod, load, grid.solved);
  std::vector<Vector> roots;
  for (std::size_t f = 0; f < static_cast<std::size_t>(parameters.fibers); ++f) {
    Random random = fiberRandom(parameters.seed, f);
    rod.reference_curvature.y() = helix.y() * (1 + kStrandDeviation * random.normal());
    rod.reference_curvature.z() = helix.z() * (1 + kStrandDeviation * random.normal());
    rod.base_frame = Quaternion(
        Eigen::AngleAxisd(kStrandDeviation * random.normal(), Vector::UnitZ()) * hanging);
    // Last, as the number of draws depends on the roots before.
    do {
      rod.base_point = drawRoot(random, kStrandArea);
    } while (std::any_of(roots.begin(), roots.end(), [&](const Vector& root) {
      return (root - rod.base_point).squaredNorm() < kRootDistance * kRootDistance;
    }));
    roots.push_back(rod.base_point);
    grid.append(solveRod(rod, load, grid.solved, &guess), scene);
  }
  return scene;
}

}  // namespace fcl_fibers::scenes
