// SPDX-License-Identifier: BSD-3-Clause
#include "support/scene_generators.h"

#include <cmath>
#include <initializer_list>
#include <utility>

namespace fcl_fibers::test {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Eigen::Vector3d placed(const Placement& placement, const Eigen::Vector3d& p) {
  return placement.origin + placement.scale * p;
}

// A walk that keeps its direction for a while and turns back at the unit sphere.
Points wander(Random& random, std::size_t segments, double step, const Placement& placement) {
  Eigen::Vector3d p = random.inCube(0.5);
  Eigen::Vector3d direction = random.direction();
  Points points{placed(placement, p)};
  for (std::size_t i = 0; i < segments; ++i) {
    direction = (direction + 0.6 * random.direction() - 0.3 * p).normalized();
    p += step * direction;
    points.push_back(placed(placement, p));
  }
  return points;
}

// Turns z to the axis (0, 1, 2), or to its opposite; all entries are 0 and +-1.
template <typename S>
fcl::Transform3<S> axisPose(int axis, bool reversed, const Eigen::Vector3d& position) {
  fcl::Matrix3<S> rotation = fcl::Matrix3<S>::Zero();
  rotation(axis, 2) = reversed ? S(-1) : S(1);
  rotation((axis + 1) % 3, 0) = 1;
  rotation((axis + 2) % 3, 1) = reversed ? S(-1) : S(1);
  fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
  pose.linear() = rotation;
  pose.translation() = position.cast<S>();
  return pose;
}

}  // namespace

template <typename S>
Scene<S> strandScene(std::size_t fibers, std::size_t segments, std::uint64_t seed,
                     const Placement& placement) {
  constexpr double kTurns = 4;
  constexpr double kTwoPi = 6.283185307179586;
  Random random(seed);
  Scene<S> scene;
  // Cross-sections of all fibers fill about half of the strand's disc.
  const double strand_radius = 0.3;
  const double radius = strand_radius * std::sqrt(0.5 / static_cast<double>(fibers));
  for (std::size_t f = 0; f < fibers; ++f) {
    const double from_axis = strand_radius * std::sqrt(random.unit());
    const double start = kTwoPi * random.unit();
    Points points;
    for (std::size_t i = 0; i <= segments; ++i) {
      const double t = static_cast<double>(i) / static_cast<double>(segments);
      const double angle = start + kTurns * kTwoPi * t;
      const Eigen::Vector3d p(from_axis * std::cos(angle), from_axis * std::sin(angle), 2 * t - 1);
      points.push_back(placed(placement, p + random.inCube(0.1 * radius)));
    }
    scene.addFiber(points, radius * placement.scale);
  }
  return scene;
}

template <typename S>
Scene<S> soupScene(std::size_t capsules, double size, std::uint64_t seed,
                   const Placement& placement) {
  Random random(seed);
  Scene<S> scene;
  for (std::size_t i = 0; i < capsules; ++i) {
    const Eigen::Vector3d center = random.inCube(1);
    // One number after the other: in one expression, compilers choose the order.
    const Eigen::Vector3d direction = random.direction();
    const Eigen::Vector3d half = random.between(0, size) / 2 * direction;
    const double radius = random.between(0, size) / 4;
    scene.addCapsule(placed(placement, center - half), placed(placement, center + half),
                     radius * placement.scale);
  }
  return scene;
}

template <typename S>
Scene<S> curledScene(std::size_t segments, std::uint64_t seed, const Placement& placement) {
  Random random(seed);
  Scene<S> scene;
  scene.addFiber(wander(random, segments, 0.2, placement), 0.05 * placement.scale);
  return scene;
}

template <typename S>
Scene<S> unequalScene(std::uint64_t seed, const Placement& placement) {
  Random random(seed);
  Scene<S> scene;
  for (const std::size_t segments : std::initializer_list<std::size_t>{
           1, 60, 1, 2, 3, 17, 1, 1, 8, 9, 33, 2, 64, 1, 5, 7, 16, 1}) {
    scene.addFiber(wander(random, segments, 0.15, placement), 0.04 * placement.scale);
  }
  return scene;
}

template <typename S>
Scene<S> ringScene(std::size_t rings, std::size_t segments, std::uint64_t seed) {
  constexpr double kTwoPi = 6.283185307179586;
  Random random(seed);
  Scene<S> scene;
  for (std::size_t ring = 0; ring < rings; ++ring) {
    const Eigen::Quaterniond turn = random.rotation();
    const Eigen::Vector3d center = random.inCube(0.3);
    Points points;
    for (std::size_t i = 0; i < segments; ++i) {
      const double angle = kTwoPi * static_cast<double>(i) / static_cast<double>(segments);
      const Eigen::Vector3d p(0.6 * std::cos(angle), 0.4 * std::sin(angle), 0);
      points.push_back(center + turn * p + random.inCube(0.02));
    }
    points.push_back(points.front());
    scene.addFiber(points, 0.05, FiberEnds::kClosed);
  }
  return scene;
}

template <typename S>
Scene<S> degenerateScene() {
  Scene<S> scene;
  // Each group has a place of its own, and there touches nothing but itself.
  int groups = 0;
  const auto next_place = [&groups] {
    const int i = groups++;
    return Eigen::Vector3d(8.0 * (i % 4), 8.0 * (i / 4 % 4), 8.0 * (i / 16));
  };
  const auto add = [&scene](const Eigen::Vector3d& place, int axis, bool reversed, double x,
                            double y, double z, double radius, double length) {
    scene.addCapsule(axisPose<S>(axis, reversed, place + Eigen::Vector3d(x, y, z)), radius, length);
  };

  Eigen::Vector3d place = next_place();  // Coincident, one of them reversed.
  for (int i = 0; i < 3; ++i) add(place, 2, i == 1, 0, 0, 0, 0.25, 1);
  place = next_place();  // Coincident points.
  for (int i = 0; i < 3; ++i) add(place, i, false, 0, 0, 0, 0, 0);
  place = next_place();  // A point on a line, one at its end, and one beside it.
  add(place, 0, false, 0, 0, 0, 0, 2);
  add(place, 1, false, 0.5, 0, 0, 0, 0);
  add(place, 1, false, 1, 0, 0, 0, 0);
  add(place, 1, false, 0, 0, 0.0625, 0, 0);
  place = next_place();  // Collinear: sharing an end, overlapping, apart.
  add(place, 1, false, 0, 0, 0, 0, 1);
  add(place, 1, false, 0, 1, 0, 0, 1);
  add(place, 1, true, 0, 1.25, 0, 0, 1);
  add(place, 1, false, 0, 3, 0, 0, 1);
  place = next_place();  // Collinear, end to end at exactly the sum of the radii.
  add(place, 0, false, 0, 0, 0, 0.25, 1);
  add(place, 0, true, 1.5, 0, 0, 0.25, 1);
  add(place, 0, false, -1.5, 0, 0, 0.25, 1);
  place = next_place();  // Parallel and antiparallel at exactly the sum of the radii.
  add(place, 2, false, 0, 0, 0, 0.25, 1);
  add(place, 2, false, 0.5, 0, 0, 0.25, 1);
  add(place, 2, true, 0, 0.5, 0.25, 0.25, 1);
  add(place, 2, true, 0, -0.5, -1, 0.25, 1);
  place = next_place();  // Crossing lines without thickness.
  add(place, 0, false, 0, 0, 0, 0, 2);
  add(place, 1, false, 0.25, 0.25, 0, 0, 2);
  add(place, 2, true, 0.25, 0, -0.5, 0, 2);
  place = next_place();  // Skew lines, exactly touching, and one with the ends only.
  add(place, 0, false, 0, 0, 0, 0.125, 2);
  add(place, 1, false, 0.5, 0, 0.25, 0.125, 2);
  add(place, 1, true, -1, 1, 0.25, 0.125, 2);
  place = next_place();  // Boxes and spheres overlap, capsules do not.
  scene.addCapsule(place + Eigen::Vector3d(-1, -1, 0), place + Eigen::Vector3d(1, 1, 0), 0.0625);
  scene.addCapsule(place + Eigen::Vector3d(-0.5, 0.5, 0.5), place + Eigen::Vector3d(-0.5, 1, 0.5),
                   0.0625);
  place = next_place();  // Balls: three coincident, two touching.
  for (int i = 0; i < 3; ++i) add(place, i, false, 0, 0, 0, 0.5, 0);
  add(place, 0, false, 0, 1, 0, 0.5, 0);
  add(place, 0, false, 1.25, 0, 0, 0.5, 0);
  for (const double tilt : {1e-3, 1e-6, 1e-9, 1e-12}) {  // Almost parallel, crossing.
    place = next_place();
    scene.addCapsule(place - Eigen::Vector3d(0, 0, 1), place + Eigen::Vector3d(0, 0, 1), 0);
    scene.addCapsule(place - Eigen::Vector3d(tilt, 0, 1), place + Eigen::Vector3d(tilt, 0, 1), 0);
  }
  return scene;
}

template <typename S>
std::vector<NamedScene<S>> standardScenes() {
  std::vector<NamedScene<S>> scenes;
  const Placement far{Eigen::Vector3d(1e3, -2e3, 5e2), 1};
  const Placement very_far{Eigen::Vector3d(-1e6, 3e5, 1e6), 1};
  const Placement tiny{Eigen::Vector3d::Zero(), 1e-6};
  const Placement huge{Eigen::Vector3d(1e7, 0, 0), 1e6};
  scenes.push_back({"strand", strandScene<S>(12, 20, 1), 0.02});
  scenes.push_back({"dense soup", soupScene<S>(150, 0.8, 2), 0.05});
  scenes.push_back({"sparse soup", soupScene<S>(150, 0.3, 3), 0.1});
  scenes.push_back({"curled fiber", curledScene<S>(200, 4), 0.02});
  scenes.push_back({"unequal fibers", unequalScene<S>(5), 0.03});
  scenes.push_back({"closed fibers", ringScene<S>(5, 24, 11), 0.02});
  scenes.push_back({"degenerate", degenerateScene<S>(), 0.0625});
  scenes.push_back({"far strand", strandScene<S>(8, 16, 6, far), 0.02});
  scenes.push_back({"far soup", soupScene<S>(100, 0.4, 7, far), 0.02});
  scenes.push_back({"very far soup", soupScene<S>(100, 0.4, 8, very_far), 0.02});
  scenes.push_back({"tiny strand", strandScene<S>(6, 12, 9, tiny), 0.02e-6});
  scenes.push_back({"huge fibers", unequalScene<S>(10, huge), 0.03e6});
  return scenes;
}

template <typename S>
void addShapes(Scene<S>& scene, std::size_t count, double size, std::uint64_t seed,
               const Placement& placement) {
  Random random(seed);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d center = placed(placement, random.inCube(1));
    const double x = random.between(0.2, 1) * size * placement.scale;
    const double y = random.between(0.2, 1) * size * placement.scale;
    const Eigen::Quaterniond turn = random.rotation();
    switch (i % 6) {
      case 0:
        scene.addSphere(center, x / 2);
        break;
      case 1:
        scene.addBox(center, Eigen::Quaterniond::Identity(), {x, y, size * placement.scale});
        break;
      case 2:
        scene.addBox(center, turn, {x, y, size * placement.scale});
        break;
      case 3:
        scene.addMesh(center, x / 2);
        break;
      case 4:
        scene.addConvex(center, x / 2);
        break;
      default:
        scene.addOctree(center, x / 2);
    }
  }
}

#define FCL_FIBERS_INSTANTIATE(S)                                                              \
  template Scene<S> strandScene<S>(std::size_t, std::size_t, std::uint64_t, const Placement&); \
  template Scene<S> soupScene<S>(std::size_t, double, std::uint64_t, const Placement&);        \
  template Scene<S> curledScene<S>(std::size_t, std::uint64_t, const Placement&);              \
  template Scene<S> unequalScene<S>(std::uint64_t, const Placement&);                          \
  template Scene<S> ringScene<S>(std::size_t, std::size_t, std::uint64_t);                     \
  template Scene<S> degenerateScene<S>();                                                      \
  template std::vector<NamedScene<S>> standardScenes<S>();                                     \
  template void addShapes<S>(Scene<S>&, std::size_t, double, std::uint64_t, const Placement&);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::test
