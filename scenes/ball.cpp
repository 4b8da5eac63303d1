// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/ball.h"

#include <cmath>

#include "arguments.h"

namespace fcl_fibers::scenes {
namespace {

constexpr double kPi = 3.141592653589793;

/// Of n sectors and n / 2 + 1 rings, n * n.
int sectorsOf(int triangles) {
  return 2 * static_cast<int>(std::lround(0.5 * std::sqrt(triangles)));
}

}  // namespace

Triangles makeBall(const Point& radii, int triangles) {
  if (triangles < 16 || triangles > 100000000) {
    refuseArgument("makeBall", "triangles", triangles, "ask for 16 to 100 million");
  }
  const int sectors = sectorsOf(triangles), rings = sectors / 2 + 1;
  Triangles ball;
  const auto add = [&](double across, double along, double turn) {
    ball.points.push_back(
        {radii[0] * across * std::sin(turn), radii[1] * along, radii[2] * across * std::cos(turn)});
  };
  add(0, 1, 0);
  for (int ring = 1; ring < rings; ++ring) {
    const double angle = kPi * ring / rings;
    for (int i = 0; i < sectors; ++i) add(std::sin(angle), std::cos(angle), 2 * kPi * i / sectors);
  }
  add(0, -1, 0);
  const auto last = static_cast<std::int32_t>(ball.points.size()) - 1;
  for (int i = 0; i < sectors; ++i) {
    const int next = (i + 1) % sectors;
    ball.corners.insert(ball.corners.end(), {0, 1 + i, 1 + next});
    ball.corners.insert(ball.corners.end(), {last, last - sectors + next, last - sectors + i});
    for (int begin = 1; begin + sectors < last; begin += sectors) {
      const int a = begin + i, b = begin + next, c = a + sectors, d = b + sectors;
      ball.corners.insert(ball.corners.end(), {a, c, b, b, c, d});
    }
  }
  return ball;
}

double depthOfTriangles(double radius, int triangles) {
  // A triangle is below a circle of half the longest diagonal of two rings and two sectors.
  const double half = kPi / sectorsOf(triangles) * std::sqrt(2.0);
  return radius * (1 - std::cos(half));
}

}  // namespace fcl_fibers::scenes
