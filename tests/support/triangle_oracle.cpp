// SPDX-License-Identifier: BSD-3-Clause
#include "support/triangle_oracle.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/exact_within.h"
#include "support/touch_oracle.h"

namespace fcl_fibers::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Relative to the triangle's first corner: the segment from w to w + u, and the other corners.
template <typename T>
struct RelativePair {
  Vector<T> w, u, v1, v2;
};
template <typename T, class Number>
RelativePair<T> relativePair(const GivenSegment& segment, const GivenTriangle& triangle,
                             Number&& number) {
  const auto difference = [&](const Vector<double>& p, const Vector<double>& q) -> Vector<T> {
    return Vector<T>{number(p[0]), number(p[1]), number(p[2])} -
           Vector<T>{number(q[0]), number(q[1]), number(q[2])};
  };
  return {difference(segment.a, triangle.a), difference(segment.b, segment.a),
          difference(triangle.b, triangle.a), difference(triangle.c, triangle.a)};
}

// --- In integers ---

/// A power of two of which all these are multiples.
int commonUnit(const GivenSegment& segment, const GivenTriangle& triangle, double reach) {
  int unit = std::numeric_limits<int>::max();
  const auto see = [&unit](double x) {
    if (x != 0) unit = std::min(unit, std::max(std::ilogb(x) - 52, -1074));
  };
  see(reach);
  for (const auto* p : {&segment.a, &segment.b, &triangle.a, &triangle.b, &triangle.c}) {
    for (const double x : *p) see(x);
  }
  return unit == std::numeric_limits<int>::max() ? 0 : unit;
}

// --- In double ---

/// Bounds of the distance, each of which holds whatever points they were computed from.
/// `size` is the sum of the 1-norms of w, u, v1 and v2. What is computed of them carries an error
/// of at most 16 eps of it.
struct TriangleBounds {
  double low = 0, high = kInfinity;

  void see(const RelativePair<double>& pair, double size, double s, double x, double y) {
    const auto& [w, u, v1, v2] = pair;
    const Vector<double> r = w + s * u - x * v1 - y * v2;
    const double norm = std::sqrt(dot(r, r)), error = 32 * kEps * size;
    // The plane through one of the points, across the line to the other, parts the two by so much.
    const double support =
        dot(r, w) + std::min(dot(r, u), 0.0) - std::max({dot(r, v1), dot(r, v2), 0.0});
    // NaN loses every comparison. A vector of noise tells nothing.
    if (norm > kEps * size && support / norm - error > low) low = support / norm - error;
    if (norm * (1 + 4 * kEps) + error < high) high = norm * (1 + 4 * kEps) + error;
  }
};

TriangleBounds triangleBounds(const RelativePair<double>& pair, double size) {
  const auto& [w, u, v1, v2] = pair;
  TriangleBounds bounds;
  const Vector<double> edge = v2 - v1;
  for (int k = 0; k < 3; ++k) {
    const Vector<double>& v = k == 0 ? v1 : k == 1 ? v2 : edge;
    const Vector<double> from = k == 2 ? w - v1 : w;
    const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v);
    const Vector<double> normal = cross(u, v);
    double s = intoUnit(dot(cross(v, from), normal) / dot(normal, normal));
    const double t = intoUnit((uv * s + dot(v, from)) / vv);
    s = intoUnit((uv * t - dot(u, from)) / uu);
    bounds.see(pair, size, s, k == 0 ? t : k == 1 ? 0 : 1 - t, k == 0 ? 0 : t);
  }
  const Vector<double> normal = cross(v1, v2);
  const double area = dot(normal, normal), from = dot(normal, w), to = from + dot(normal, u);
  for (const double s : {0.0, 1.0, intoUnit(from / (from - to))}) {
    const Vector<double> p = w + s * u;
    const double x = intoUnit(dot(cross(p, v2), normal) / area);
    const double y = intoUnit(dot(cross(v1, p), normal) / area);
    bounds.see(pair, size, s, x, std::min(y, 1 - x));
  }
  return bounds;
}

}  // namespace

TriangleOracle::Verdict TriangleOracle::judge(const GivenSegment& segment,
                                              const GivenTriangle& triangle, double reach) {
  const auto pair = relativePair<double>(segment, triangle, [](double x) { return x; });
  double size = 0;
  for (const auto& vector : {pair.w, pair.u, pair.v1, pair.v2}) {
    for (const double x : vector) size += std::fabs(x);
  }
  // Where products of six lengths neither overflow nor vanish.
  if (size > 0x1p-150 && size < 0x1p150 && reach < 0x1p400) {
    const TriangleBounds bounds = triangleBounds(pair, size);
    if (bounds.high <= reach * (1 - 4 * kEps)) return {true, false};
    if (bounds.low > reach * (1 + 4 * kEps)) return {false, false};
  }
  return {withinExactly(segment, triangle, reach), true};
}

bool TriangleOracle::withinExactly(const GivenSegment& segment, const GivenTriangle& triangle,
                                   double reach) {
  const GivenCapsule axis{segment.a, segment.b};
  for (const GivenCapsule& edge :
       {GivenCapsule{triangle.a, triangle.b}, {triangle.b, triangle.c}, {triangle.c, triangle.a}}) {
    if (TouchOracle::touchExactly(axis, edge, reach)) return true;
  }
  const int unit = commonUnit(segment, triangle, reach);
  const auto number = [unit](double x) { return inUnits(x, unit); };
  const auto [w, u, v1, v2] = relativePair<Integer>(segment, triangle, number);
  return insideWithin(w, u, v1, v2, number(reach));
}

}  // namespace fcl_fibers::test
