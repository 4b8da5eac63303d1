// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/paper_scenes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "arguments.h"
#include "scenes/cosserat_rod.h"
#include "scenes/hair.h"

namespace fcl_fibers::scenes {
namespace {

constexpr double kLength = 30;  // cm
constexpr int kGrid = 200;
constexpr double kRootDistance = 0.01;     // cm, at least
constexpr double kMostRootsPerArea = 975;  // 1 / cm2, for which places are found quickly
constexpr double kWeight = 0.05;           // dyn / cm
constexpr double kSway = 0.01;             // dyn
constexpr double kSwayPerFrame = 0.05;     // rad

void requireShape(const char* call, const PaperStrandParameters& parameters) {
  if (!(parameters.area > 0 && parameters.area < 1e6)) {
    refuseArgument(call, "area", parameters.area, "give one above 0, in cm2");
  }
  const auto most = static_cast<int>(std::lround(kMostRootsPerArea * parameters.area));
  if (parameters.fibers > most) {
    const std::string remedy =
        "ask for no more than the root area has room for, " + std::to_string(most);
    refuseArgument(call, "fibers", parameters.fibers, remedy.c_str());
  }
  const double around = 2 * kPi * parameters.turns * parameters.helix_radius;
  if (!(parameters.turns > 0 && parameters.helix_radius > 0 && around < kLength)) {
    refuseArgument(call, "helix_radius", parameters.helix_radius,
                   "give turns and a radius above 0, so that 2 pi turns * radius is below 30");
  }
  if (!(parameters.deviation >= 0 && parameters.deviation <= 1)) {
    refuseArgument(call, "deviation", parameters.deviation, "give one from 0 to 1");
  }
}

/// The torque that makes a straight rod a helix about the z axis, downwards, of so many radians of
/// arc for each unit of length: Kirchhoff's helix without force (Love, A Treatise on the
/// Mathematical Theory of Elasticity, 1927, chapter XIX).
Vector coupleOf(const CosseratRod& rod, double rate) {
  return -rod.bending_stiffness.x() * rate * Vector::UnitZ();
}

void turn(const Quaternion& rotation, FiberPolylines& scene) {
  for (Point& p : scene.points) {
    const Vector turned = rotation * Vector(p[0], p[1], p[2]);
    p = {turned.x(), turned.y(), turned.z()};
  }
}

}  // namespace

FiberPolylines makePaperStrand(const PaperStrandParameters& parameters) {
  const char* call = "makePaperStrand";
  FiberPolylines scene = emptyScene(call, parameters);
  requireShape(call, parameters);
  const RodGrid grid(parameters.segments, kGrid);

  const double rate = 2 * kPi * parameters.turns / kLength;
  const double slope = parameters.helix_radius * rate;
  const Vector helix(0, slope * rate, std::sqrt(1 - slope * slope) * rate);
  const Quaternion hanging(Eigen::AngleAxisd(std::atan2(helix.y(), -helix.z()), -Vector::UnitX()));

  CosseratRod rod = hair(kLength);
  rod.base_frame = hanging;
  RodLoad load;
  load.tip_force = {kSway * std::sin(kSwayPerFrame * parameters.frame), 0, 0};
  if (parameters.straight) {
    load.tip_torque = coupleOf(rod, rate);
  } else {
    rod.reference_curvature = helix;
    load.distributed_force = {0, 0, -kWeight};
  }
  const RodShape guess = solveRod(rod, load, grid.solved());
  std::vector<Vector> roots;
  for (std::size_t f = 0; f < static_cast<std::size_t>(parameters.fibers); ++f) {
    Random random = fiberRandom(parameters.seed, f);
    const double of_size = parameters.deviation * random.normal();
    const double of_slope = parameters.deviation * random.normal();
    const double of_turn = parameters.deviation * random.normal();
    const Quaternion turn(Eigen::AngleAxisd(of_turn, Vector::UnitZ()));
    rod.base_frame = turn * hanging;
    if (parameters.straight) {
      const Eigen::AngleAxisd tilt(of_slope, Vector::UnitX());
      load.tip_torque = turn * (tilt * coupleOf(rod, rate * (1 + of_size)));
    } else {
      rod.reference_curvature.y() = helix.y() * (1 + of_size);
      rod.reference_curvature.z() = helix.z() * (1 + of_slope);
    }
    // Last, as the number of draws depends on the roots before.
    do {
      rod.base_point = drawRoot(random, parameters.area);
    } while (std::any_of(roots.begin(), roots.end(), [&](const Vector& root) {
      return (root - rod.base_point).squaredNorm() < kRootDistance * kRootDistance;
    }));
    roots.push_back(rod.base_point);
    grid.append(solveRod(rod, load, grid.solved(), &guess), scene);
  }
  if (parameters.turned) turn(turnedAboutTwoAxes(), scene);
  return scene;
}

}  // namespace fcl_fibers::scenes
