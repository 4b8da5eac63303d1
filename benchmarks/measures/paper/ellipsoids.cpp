// SPDX-License-Identifier: BSD-3-Clause
#include "measures/paper/ellipsoids.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace fcl_fibers::benchmarks {
namespace {

using Points = std::vector<Eigen::Vector3d>;

/// The longest semi-axis is at most about this many times the shortest one, so that roundings stay
/// small; see kRounding.
constexpr double kLongest = 1e4;

/// An ellipsoid around one with the shape `inner` that is thickened by `radius`.
///
/// To add the radius to the semi-axes would not do: the support of that ellipsoid in a direction u,
/// |(a_i + r) u_i|, is at most |a_i u_i| + r by the triangle inequality, and less in general, while
/// the thickened one's support is |a_i u_i| + r. But for every b > 0
///
///   (s + r)^2 <= (1 + 1/b) s^2 + (1 + b) r^2
///
/// and with s = |a_i u_i| the right side is the squared support of the ellipsoid of the shape
/// (1 + 1/b) inner + (1 + b) r^2 I (Kurzhanski and Valyi, Ellipsoidal calculus for estimation
/// and control, 1997). The iteration finds the b of the least volume (Halder, 2018); it may stop
/// anywhere.
Symmetric thickenedShape(const Eigen::Matrix3d& inner, double radius) {
  const double r2 = std::max(radius * radius, inner.trace() / (kLongest * kLongest));
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(inner, Eigen::EigenvaluesOnly);
  const Eigen::Array3d a2 = solver.eigenvalues().array().max(0);
  double b = std::sqrt(a2.sum() / (3 * r2));
  for (int step = 0; step < 8 && b > 0; ++step) {
    const Eigen::Array3d sum = a2 + b * r2;
    b = std::sqrt((a2 / sum).sum() / (r2 / sum).sum());
  }
  b = std::max(b, 1e-6);
  const Eigen::Matrix3d q = (1 + 1 / b) * inner + (1 + b) * r2 * Eigen::Matrix3d::Identity();
  return {q(0, 0), q(1, 1), q(2, 2), q(0, 1), q(0, 2), q(1, 2)};
}

/// The centre and the shape of about the least ellipsoid around points, up to a factor: the shape
/// still has to be scaled. Points have to span the space.
///
/// This is Khachiyan's algorithm (1996) with the steps away from points (Todd and Yildirim, 2007),
/// which make it converge fast: the weight of the point farthest outside grows, or that of the
/// point farthest inside shrinks, until all points with a weight are nearly on the surface.
void leastEllipsoid(const Points& points, Eigen::Vector3d& center, Eigen::Matrix3d& shape) {
  constexpr double kDimension = 4;  // of the points lifted to (x, y, z, 1)
  constexpr double kTolerance = 0.02;
  constexpr int kMostSteps = 400;
  const std::size_t count = points.size();
  std::vector<double> weights(count, 1 / static_cast<double>(count));
  const auto lifted = [&](std::size_t i) -> Eigen::Vector4d { return points[i].homogeneous(); };
  Eigen::Matrix4d moment = Eigen::Matrix4d::Zero();
  for (std::size_t i = 0; i < count; ++i) moment += weights[i] * lifted(i) * lifted(i).transpose();
  for (int step = 0; step < kMostSteps; ++step) {
    const Eigen::Matrix4d inverse = moment.inverse();
    std::size_t farthest = 0, nearest = 0;
    double most = -1, least = kDimension;
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector4d q = lifted(i);
      const double distance = q.dot(inverse * q);
      if (distance > most) most = distance, farthest = i;
      if (weights[i] > 0 && distance < least) least = distance, nearest = i;
    }
    const double outside = most - kDimension, inside = kDimension - least;
    if (!(std::max(outside, inside) > kTolerance * kDimension)) break;
    // A negative change takes weight from the point.
    std::size_t point = farthest;
    double change = outside / (kDimension * (most - 1));
    if (inside > outside) {
      point = nearest;
      double taken = weights[point] / (1 - weights[point]);
      if (least > 1) taken = std::min(taken, inside / (kDimension * (least - 1)));
      change = -taken;
    }
    for (double& weight : weights) weight *= 1 - change;
    weights[point] = std::max(0.0, weights[point] + change);
    moment = (1 - change) * moment + change * lifted(point) * lifted(point).transpose();
  }
  center.setZero();
  shape.setZero();
  for (std::size_t i = 0; i < count; ++i) center += weights[i] * points[i];
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d offset = points[i] - center;
    shape += weights[i] * offset * offset.transpose();
  }
}

/// The end points, or about kMost of them at equal steps along the chain.
Points someEndPoints(CapsuleRange capsules) {
  constexpr std::size_t kMost = 128;
  const std::size_t step = (2 * capsules.size() + kMost - 1) / kMost;
  Points points;
  for (std::size_t i = 0; i < 2 * capsules.size(); i += step) {
    const Capsule& c = capsules.first[i / 2];
    points.push_back(i % 2 == 0 ? c.from : c.to);
  }
  return points;
}

/// L D L^T, the factors of a symmetric positive definite matrix. Unlike the formula of the inverse,
/// which cancels, solving by them is stable.
struct Factors {
  explicit Factors(const Symmetric& m) {
    x = 1 / m.xx;
    yx = m.xy * x;
    zx = m.xz * x;
    y = 1 / (m.yy - yx * m.xy);
    const double rest = m.yz - zx * m.xy;
    zy = rest * y;
    z = 1 / (m.zz - zx * m.xz - zy * rest);
  }

  /// Sets `solution` to M^-1 v, and returns v^T M^-1 v.
  double solve(const fcl::Vector3d& v, fcl::Vector3d& solution) const {
    const double v1 = v.y() - yx * v.x();
    const double v2 = v.z() - zx * v.x() - zy * v1;
    solution.z() = z * v2;
    solution.y() = y * v1 - zy * solution.z();
    solution.x() = x * v.x() - yx * solution.y() - zx * solution.z();
    return x * v.x() * v.x() + y * v1 * v1 + z * v2 * v2;
  }

  double yx, zx, zy;  ///< of L
  double x, y, z;     ///< of D^-1
};

Symmetric between(const Symmetric& p, const Symmetric& q, double l) {
  const double k = 1 - l;
  return {k * p.xx + l * q.xx, k * p.yy + l * q.yy, k * p.zz + l * q.zz,
          k * p.xy + l * q.xy, k * p.xz + l * q.xz, k * p.yz + l * q.yz};
}

}  // namespace

Ellipsoid Ellipsoid::around(const Capsule& capsule) {
  const fcl::Vector3d half = 0.5 * (capsule.to - capsule.from);
  return {0.5 * (capsule.from + capsule.to),
          thickenedShape(half * half.transpose(), capsule.radius)};
}

Ellipsoid Ellipsoid::around(CapsuleRange capsules) {
  double radius = 0;
  for (const Capsule& c : capsules) radius = std::max(radius, c.radius);

  // In the coordinates in which the scatter is a ball, Khachiyan's matrices are well conditioned.
  // Points in a plane or on a line get a little cross in their middle, much smaller than the radius
  // that thickens them anyway.
  Points points = someEndPoints(capsules);
  const auto count = static_cast<double>(points.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) mean += p / count;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& p : points) scatter += (p - mean) * (p - mean).transpose() / count;
  const double arm = std::max(radius / 16, std::sqrt(scatter.trace()) / kLongest / 16);
  scatter += arm * arm * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d to_space = scatter.llt().matrixL();
  const auto toBall = [&](const Eigen::Vector3d& offset) -> Eigen::Vector3d {
    return to_space.triangularView<Eigen::Lower>().solve(offset);
  };
  for (auto& p : points) p = toBall(p - mean);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-arm, arm})
      points.push_back(toBall(sign * Eigen::Vector3d::Unit(axis)));
  }
  Eigen::Vector3d center;
  Eigen::Matrix3d shape;
  leastEllipsoid(points, center, shape);

  // The algorithm stops early and did not see every point, so the ellipsoid is scaled to reach all.
  const Eigen::LLT<Eigen::Matrix3d> factors(shape);
  double scale = 0;
  for (const Capsule& c : capsules) {
    for (const fcl::Vector3d* point : {&c.from, &c.to}) {
      const Eigen::Vector3d offset = toBall(*point - mean) - center;
      scale = std::max(scale, factors.matrixL().solve(offset).squaredNorm());
    }
  }
  return {mean + to_space * center,
          thickenedShape(scale * to_space * shape * to_space.transpose(), radius)};
}

/// Two ellipsoids of shapes A and B whose centres are d apart have no common point if and only if
///
///   f(l) = l (1 - l) d^T [(1 - l) A + l B]^-1 d
///
/// exceeds 1 for some l in [0, 1] (Perram and Wertheim, 1985). f is concave, so Newton's method
/// finds its maximum. It mostly ends earlier: one value above 1 separates, and a tangent that stays
/// below 1 up to the end of the bracket shows an overlap. What is undecided after the last step
/// counts as an overlap.
bool overlaps(const Ellipsoid& p, const Ellipsoid& q) {
  // The condition of the matrix is at most about 10 kLongest^2 = 1e9, and so the relative error of
  // f at most some 100 roundings times 1e9.
  constexpr double kRounding = 1e-4;
  constexpr int kMostSteps = 10;
  const fcl::Vector3d d = q.center - p.center;
  double low = 0, high = 1;
  // The maximum of two balls.
  const double p_size = std::sqrt(p.size()), q_size = std::sqrt(q.size());
  double l = p_size / (p_size + q_size);
  for (int step = 0; step < kMostSteps; ++step) {
    const Factors factors(between(p.shape, q.shape, l));
    fcl::Vector3d x;
    const double f = l * (1 - l) * factors.solve(d, x);
    if (f > 1 + kRounding) return false;
    const fcl::Vector3d ax = p.shape * x, bx = q.shape * x;
    const double a = x.dot(ax), b = x.dot(bx);
    const double slope = (1 - l) * (1 - l) * a - l * l * b;
    if (f + slope * ((slope > 0 ? high : low) - l) <= 1) return true;
    (slope > 0 ? low : high) = l;
    const fcl::Vector3d y = (1 - l) * (1 - l) * ax - l * l * bx;
    fcl::Vector3d z;
    factors.solve(bx - ax, z);
    const double curvature = -2 * ((1 - l) * a + l * b) - 2 * y.dot(z);
    const double next = l - slope / curvature;
    l = next > low && next < high ? next : 0.5 * (low + high);
  }
  return true;
}

}  // namespace fcl_fibers::benchmarks
