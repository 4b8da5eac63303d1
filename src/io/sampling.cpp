// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/io/sampling.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "arguments.h"
#include "io/vectors.h"

namespace fcl_fibers::io {
namespace {

void requireLength(const char* call, const char* name, double value) {
  if (value >= 0 && std::isfinite(value)) return;
  refuseArgument(call, name, value, "give a finite number of 0 or more");
}

/// The curvature of the circle through three points, 2 sin(angle at the middle one) / (its opposite
/// side). The sine comes from the turn, not from an area, so it is exact if the points almost form
/// a line.
/// @pre the middle point differs from both others
double curvatureAt(const Point& p, const Point& q, const Point& r) {
  const double before = distance(p, q), after = distance(q, r), across = distance(p, r);
  Point u, v;
  for (std::size_t k = 0; k < 3; ++k) {
    u[k] = (q[k] - p[k]) / before;
    v[k] = (r[k] - q[k]) / after;
  }
  const double sine = norm(cross(u, v));
  // The least circle through two points has them as its diameter.
  const double most = 2 / std::max(before, after);
  return across > 0 ? std::min(2 * sine / across, most) : most;
}

}  // namespace

double chordError(double curvature, double length) {
  requireLength("chordError", "curvature", curvature);
  requireLength("chordError", "length", length);
  return std::min(curvature * length / 8 * length, length / 2);
}

int segmentsForChordError(double curvature, double length, double tolerance) {
  constexpr const char* kCall = "segmentsForChordError";
  requireLength(kCall, "curvature", curvature);
  requireLength(kCall, "length", length);
  if (!(tolerance > 0) || !std::isfinite(tolerance)) {
    refuseArgument(kCall, "tolerance", tolerance, "give a finite number above 0");
  }
  constexpr double kMost = 1 << 27;
  const double wanted =
      std::ceil(std::min(length / tolerance / 2, std::sqrt(curvature / tolerance / 8) * length));
  if (!(wanted <= kMost)) {
    refuseArgument(kCall, "the number of segments", wanted,
                   "the most is 2^27; give a larger tolerance");
  }
  int count = std::max(1, static_cast<int>(wanted));
  // Rounding may have left the count one too small.
  while (chordError(curvature, length / count) > tolerance) ++count;
  return count;
}

double largestCurvature(const FiberPolylines& scene) {
  constexpr const char* kCall = "largestCurvature";
  requireFiberRanges(kCall, scene);
  for (const Point& point : scene.points) {
    for (const double x : point) {
      if (!std::isfinite(x)) refuseArgument(kCall, "a coordinate", x, "give finite coordinates");
    }
  }
  double largest = 0;
  std::vector<Point> places;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    places.clear();
    for (std::size_t i = scene.point_begin[f]; i < scene.point_begin[f + 1]; ++i) {
      if (places.empty() || places.back() != scene.points[i]) places.push_back(scene.points[i]);
    }
    for (std::size_t i = 0; i + 2 < places.size(); ++i) {
      largest = std::max(largest, curvatureAt(places[i], places[i + 1], places[i + 2]));
    }
    // At the seam of a closed fiber the last point is the first one.
    if (scene.isClosed(f) && places.size() > 3) {
      largest = std::max(largest, curvatureAt(places[places.size() - 2], places[0], places[1]));
    }
  }
  return largest;
}

}  // namespace fcl_fibers::io
