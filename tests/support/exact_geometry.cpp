// SPDX-License-Identifier: BSD-3-Clause
#include "support/exact_geometry.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <vector>

#include "support/exact_cones.h"

namespace fcl_fibers::test {
namespace {

Real clampToUnit(Real t) { return std::clamp(t, Real(0), Real(1)); }

// Of the segment from the origin to `direction`.
Real closestParameter(const Point& p, const Point& direction) {
  const Real length_squared = direction.squaredNorm();
  return length_squared > 0 ? clampToUnit(p.dot(direction) / length_squared) : 0;
}

Real pointBoxDistance(const Point& p, const ExactBox& box) {
  Point outside = Point::Zero();
  for (int i = 0; i < 3; ++i) {
    outside[i] = std::max({Real(0), box.min[i] - p[i], p[i] - box.max[i]});
  }
  return outside.norm();
}

}  // namespace

ExactCapsule roundedCapsule(const GivenCapsule& capsule) {
  const auto point = [](const std::array<double, 3>& p) { return Point(p[0], p[1], p[2]); };
  const Point half = Real(capsule.length) / 2 * point(capsule.axis);
  return {point(capsule.a) - half, point(capsule.b) + half,
          std::max(capsule.radius, capsule.radiusAtB()),
          Real(capsule.radiusAtB()) - Real(capsule.radius)};
}

Real pointSegmentDistance(const Point& p, const Point& a, const Point& b) {
  const Point from_a = p - a;
  const Point direction = b - a;
  const Real t = closestParameter(from_a, direction);
  // At the far end the end point itself is exact, a + (b - a) is not.
  return t == 1 ? (p - b).norm() : (from_a - t * direction).norm();
}

Real segmentDistance(const Point& a, const Point& b, const Point& c, const Point& d) {
  Real distance = std::min({pointSegmentDistance(a, c, d), pointSegmentDistance(b, c, d),
                            pointSegmentDistance(c, a, b), pointSegmentDistance(d, a, b)});

  // The lines' closest points, if the lines have any. Relative to `a`, so that a common offset of
  // both segments costs nothing. The cross product keeps its relative precision down to angles of
  // 2^-64; the usual a e - b^2 would lose it at 2^-32.
  const Point u = b - a;
  const Point v = d - c;
  const Point r = c - a;
  const Point normal = u.cross(v);
  const Real normal_squared = normal.squaredNorm();
  if (normal_squared > 0) {
    const Real s = clampToUnit(r.cross(v).dot(normal) / normal_squared);
    const Point on_first = s * u;
    const Real t = closestParameter(on_first - r, v);
    const Point on_second = r + t * v;
    distance = std::min(distance, (on_second - on_first).norm());
    distance = std::min(distance, (on_second - closestParameter(on_second, u) * u).norm());
  }
  return distance;
}

Real surfaceDistance(const ExactCapsule& p, const ExactCapsule& q) {
  if (p.taper == 0 && q.taper == 0) {
    return segmentDistance(p.a, p.b, q.a, q.b) - p.radius - q.radius;
  }
  const auto numbers = [](const Point& x) { return Vector<Real>{x[0], x[1], x[2]}; };
  const PairOf<Real> pair{numbers(p.a - q.a),
                          numbers(p.b - p.a),
                          numbers(q.b - q.a),
                          p.radiusAt(0) + q.radiusAt(0),
                          p.taper,
                          q.taper};
  const ConeBounds<Real> bounds(pair);
  if (bounds.high() - bounds.low() <= 0x1p-58L * bounds.size()) return bounds.high();
  const auto digits = [](const Vector<Real>& x) { return Vector<Digits100>{x[0], x[1], x[2]}; };
  const PairOf<Digits100> fine{digits(pair.w), digits(pair.u), digits(pair.v),
                               pair.reach,     pair.growth_u,  pair.growth_v};
  return static_cast<Real>(ConeBounds<Digits100>(fine).high());
}

Real segmentTriangleDistance(const Point& a, const Point& b, const ExactTriangle& triangle) {
  const Point corners[3] = {triangle.a, triangle.b, triangle.c};
  Real distance = std::min({segmentDistance(a, b, corners[0], corners[1]),
                            segmentDistance(a, b, corners[1], corners[2]),
                            segmentDistance(a, b, corners[2], corners[0])});
  const Point normal = (triangle.b - triangle.a).cross(triangle.c - triangle.a);
  const Real size = normal.norm();
  if (!(size > 0)) return distance;
  const auto isOver = [&](const Point& p) {
    for (int k = 0; k < 3; ++k) {
      const Point edge = corners[(k + 1) % 3] - corners[k];
      if (edge.cross(p - corners[k]).dot(normal) < 0) return false;
    }
    return true;
  };
  const Real from = (a - triangle.a).dot(normal) / size, to = (b - triangle.a).dot(normal) / size;
  if (isOver(a)) distance = std::min(distance, std::abs(from));
  if (isOver(b)) distance = std::min(distance, std::abs(to));
  if ((from < 0) != (to < 0) && isOver(a + from / (from - to) * (b - a))) distance = 0;
  return distance;
}

Real segmentBoxDistance(const Point& a, const Point& b, const ExactBox& box) {
  // Along the segment, the squared distance is a convex piecewise parabola that changes its piece
  // where the segment crosses a plane of the box.
  const Point direction = b - a;
  std::vector<Real> knots{0, 1};
  for (int i = 0; i < 3; ++i) {
    for (const Real plane : {box.min[i], box.max[i]}) {
      const Real t = (plane - a[i]) / direction[i];
      if (t > 0 && t < 1) knots.push_back(t);
    }
  }
  std::sort(knots.begin(), knots.end());

  Real distance = std::min(pointBoxDistance(a, box), pointBoxDistance(b, box));
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    distance = std::min(distance, pointBoxDistance(a + knots[k] * direction, box));
    const Point middle = a + (knots[k] + knots[k + 1]) / 2 * direction;
    Real quadratic = 0;
    Real linear = 0;
    for (int i = 0; i < 3; ++i) {
      if (middle[i] >= box.min[i] && middle[i] <= box.max[i]) continue;
      const Real side = middle[i] < box.min[i] ? box.min[i] : box.max[i];
      quadratic += direction[i] * direction[i];
      linear += direction[i] * (side - a[i]);
    }
    if (quadratic > 0) {
      const Real t = std::clamp(linear / quadratic, knots[k], knots[k + 1]);
      distance = std::min(distance, pointBoxDistance(a + t * direction, box));
    }
  }
  return distance;
}

Real boxDistance(const ExactBox& a, const ExactBox& b) {
  Point apart = Point::Zero();
  for (int i = 0; i < 3; ++i) {
    apart[i] = std::max({Real(0), a.min[i] - b.max[i], b.min[i] - a.max[i]});
  }
  return apart.norm();
}

Real boxGap(const ExactBox& a, const ExactBox& b) {
  return std::max((a.min - b.max).maxCoeff(), (b.min - a.max).maxCoeff());
}

Real sphereGap(const ExactSphere& a, const ExactSphere& b) {
  return (a.center - b.center).norm() - (a.radius + b.radius);
}

ExactBox boxOf(const ExactCapsule& capsule) {
  const Point radius = Point::Constant(capsule.radius);
  return {capsule.a.cwiseMin(capsule.b) - radius, capsule.a.cwiseMax(capsule.b) + radius};
}

ExactSphere sphereOf(const ExactCapsule& capsule) {
  return {(capsule.a + capsule.b) / 2, (capsule.b - capsule.a).norm() / 2 + capsule.radius};
}

}  // namespace fcl_fibers::test
