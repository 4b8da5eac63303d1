// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/cap.h"

#include <cmath>
#include <cstddef>

#include <Eigen/Core>

#include "arguments.h"
#include "scenes/fiber_random.h"

namespace fcl_fibers::scenes {
namespace {

using Vector = Eigen::Vector3d;

constexpr double kPi = 3.141592653589793;
constexpr double kHeadRadius = 9;       // cm
constexpr double kSegmentLength = 0.3;  // cm
constexpr double kRootsPerArea = 325;   // 1 / cm2
constexpr double kTurn = 0.35;          // of the direction, per cm
constexpr double kSideways = 0.3;       // pull along the root's horizontal direction
constexpr double kSidewaysDeviation = 0.02;
constexpr double kSidewaysPerFrame = 0.01;
constexpr double kWave = 0.05;
constexpr double kWavePerSegment = 0.6;  // rad
constexpr double kWavePerRoot = 8;       // rad per unit of the root's normal
constexpr double kDeviation = 0.01;

}  // namespace

FiberPolylines makeCap(const CapParameters& parameters) {
  const double cap_height = parameters.fibers / (kRootsPerArea * 2 * kPi * kHeadRadius);
  constexpr int kMostFibers = 330809;
  if (parameters.fibers < 1 || parameters.fibers > kMostFibers) {
    refuseArgument("makeCap", "fibers", parameters.fibers,
                   "ask for at least 1 fiber and for no more than the head has room for, 330809");
  }
  if (parameters.segments < 1) {
    refuseArgument("makeCap", "segments", parameters.segments,
                   "ask for at least 1 segment per fiber");
  }

  const auto fibers = static_cast<std::size_t>(parameters.fibers);
  FiberPolylines scene;
  scene.radius = requireRadius<double>("makeCap", parameters.radius);
  scene.points.reserve(fibers * (static_cast<std::size_t>(parameters.segments) + 1));
  scene.point_begin.reserve(fibers + 1);
  for (std::size_t f = 0; f < fibers; ++f) {
    Random random = fiberRandom(parameters.seed, f);
    const double z = 1 - cap_height / kHeadRadius * random.uniform();
    const double direction = 2 * kPi * random.uniform();
    const double across = std::sqrt((1 - z) * (1 + z));
    const Vector normal(across * std::cos(direction), across * std::sin(direction), z);
    Vector pull = kSideways * Vector(normal.x(), normal.y(), 0);
    pull.x() += kSidewaysDeviation * random.normal() + kSidewaysPerFrame * parameters.frame;
    pull.y() += kSidewaysDeviation * random.normal();
    pull.z() = -1;

    Vector point = kHeadRadius * normal;
    Vector tangent = normal;
    scene.points.push_back({point.x(), point.y(), point.z()});
    for (int i = 0; i < parameters.segments; ++i) {
      const double angle = kWavePerSegment * i;
      tangent += kTurn * kSegmentLength * pull;
      tangent.x() += kWave * std::sin(angle + kWavePerRoot * normal.x());
      tangent.y() += kWave * std::cos(angle + kWavePerRoot * normal.y());
      for (int k = 0; k < 3; ++k) tangent[k] += kDeviation * random.normal();
      tangent.normalize();
      point += kSegmentLength * tangent;
      const double distance = point.norm();
      if (distance < kHeadRadius) point *= kHeadRadius / distance;
      scene.points.push_back({point.x(), point.y(), point.z()});
    }
    scene.point_begin.push_back(scene.points.size());
  }
  return scene;
}

}  // namespace fcl_fibers::scenes
