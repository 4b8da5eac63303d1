// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <fcl/common/types.h>
#include <fcl_fibers/benchmark/export.h>

/// @file
/// Which capsules touch, as benchmarks and tests judge it. It shares no code with the library.
namespace fcl_fibers::benchmarks {

/// A capsule: all points within `radius` of the segment from `from` to `to`.
struct Capsule {
  fcl::Vector3d from;  ///< an end of its axis
  fcl::Vector3d to;    ///< the other end
  double radius;       ///< not negative
};

/// The point of a segment that is nearest to x.
inline fcl::Vector3d closestPoint(const fcl::Vector3d& from, const fcl::Vector3d& to,
                                  const fcl::Vector3d& x) {
  const fcl::Vector3d d = to - from;
  const double length2 = d.squaredNorm();
  if (length2 == 0) return from;
  return from + std::clamp(d.dot(x - from) / length2, 0.0, 1.0) * d;
}

/// Distance of the segments p and q. Shares no code with the library, which it judges.
///
/// Every candidate is the distance of two points of the segments, so that none is too small. The
/// minimum lies at one of the four ends, or else inside both, where the common perpendicular
/// meets them. Near-parallel segments make that foot inaccurate, by about eps / sin of their angle
/// across the segments, which enters the distance squared.
inline double segmentDistance(const fcl::Vector3d& p0, const fcl::Vector3d& p1,
                              const fcl::Vector3d& q0, const fcl::Vector3d& q1) {
  double d2 = (p0 - closestPoint(q0, q1, p0)).squaredNorm();
  d2 = std::min(d2, (p1 - closestPoint(q0, q1, p1)).squaredNorm());
  d2 = std::min(d2, (q0 - closestPoint(p0, p1, q0)).squaredNorm());
  d2 = std::min(d2, (q1 - closestPoint(p0, p1, q1)).squaredNorm());

  const fcl::Vector3d normal = (p1 - p0).cross(q1 - q0);
  const double normal2 = normal.squaredNorm();
  if (normal2 > 0) {
    const double s = (q0 - p0).cross(q1 - q0).dot(normal) / normal2;
    if (s > 0 && s < 1) {
      const fcl::Vector3d on_q = closestPoint(q0, q1, p0 + s * (p1 - p0));
      d2 = std::min(d2, (on_q - closestPoint(p0, p1, on_q)).squaredNorm());
    }
  }
  return std::sqrt(d2);
}

/// A lower bound of the distance of the axes of two capsules: the widest gap between them along x,
/// y or z. It is negative if the boxes around the axes overlap. Radii do not count.
inline double axisGap(const Capsule& a, const Capsule& b) {
  const Eigen::Array3d least = a.from.cwiseMin(a.to).array().max(b.from.cwiseMin(b.to).array());
  const Eigen::Array3d greatest = a.from.cwiseMax(a.to).array().min(b.from.cwiseMax(b.to).array());
  return (least - greatest).maxCoeff();
}

/// What two capsules are to each other.
enum class Contact {
  kTouching,  ///< they share a point
  kBoundary,  ///< rounding decides whether they do
  kApart,     ///< they share none
};

/// Returns what two capsules are to each other. They are kBoundary if their distance differs from
/// the sum of their radii by no more than 1e-9 of that sum plus `rounding`. Then the rounding of
/// their poses decides whether they touch, and a manager may report them or not. `rounding` is a
/// length, in the unit of the scene; 0 is right for double.
inline Contact contact(const Capsule& a, const Capsule& b, double rounding = 0) {
  const double sum = a.radius + b.radius;
  const double band = 1e-9 * sum + rounding;
  // Most pairs of loose boxes are far apart, and there may be hundreds of millions of them.
  if (axisGap(a, b) > sum + band) return Contact::kApart;
  const double distance = segmentDistance(a.from, a.to, b.from, b.to);
  if (distance < sum - band) return Contact::kTouching;
  return distance <= sum + band ? Contact::kBoundary : Contact::kApart;
}

/// Two capsules by their numbers, the lesser one first.
using CapsulePair = std::pair<std::uint32_t, std::uint32_t>;

/// All pairs whose contact() is `kind`, kTouching or kBoundary, in order, by a grid of cells that
/// share nothing with the library. Throws std::invalid_argument where a number is not finite, or a
/// radius or the rounding negative.
FCL_FIBERS_BENCHMARK_EXPORT std::vector<CapsulePair> touchingPairs(
    const std::vector<Capsule>& capsules, double rounding = 0, Contact kind = Contact::kTouching);

}  // namespace fcl_fibers::benchmarks
