// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/narrowphase/collision_object.h>

namespace fcl_fibers::benchmarks {

/// The axis of a capsule: all points center + s half with s from -1 to 1.
template <typename S>
struct CapsuleAxis {
  fcl::Vector3<S> center, half;
  S radius;
};

template <typename S>
CapsuleAxis<S> axisOf(const fcl::CollisionObject<S>& object) {
  const auto& capsule = static_cast<const fcl::Capsule<S>&>(*object.collisionGeometry());
  const fcl::Transform3<S>& pose = object.getTransform();
  return {pose.translation(), capsule.lz / 2 * pose.linear().col(2), capsule.radius};
}

/// Axes of `count` objects, of which axis(i) reads one, in memory that is kept for the next query,
/// as a program keeps it. They hold until it is called again; one thread calls it.
template <typename S, typename Axis>
const std::vector<CapsuleAxis<S>>& readAxes(std::size_t count, Axis&& axis) {
  static std::vector<CapsuleAxis<S>> axes;
  axes.clear();
  axes.reserve(count);
  for (std::size_t i = 0; i < count; ++i) axes.push_back(axis(i));
  return axes;
}

/// Points of two axes.
template <typename S>
struct AxisPoints {
  fcl::Vector3<S> p, q;
};

/// The points of two axes that are nearest to each other, as a careful user finds them: after
/// Ericson, Real-Time Collision Detection, 2005, section 5.1.9. The squared distance is a convex
/// parabola in (s, t). Its least value lies where both derivatives vanish, or if that is outside of
/// the square, on its border, where the parameter that is cut off gives the other.
template <typename S>
AxisPoints<S> nearestPoints(const CapsuleAxis<S>& p, const CapsuleAxis<S>& q) {
  const fcl::Vector3<S> apart = q.center - p.center;
  const S pp = p.half.squaredNorm(), qq = q.half.squaredNorm(), pq = p.half.dot(q.half);
  const S along_p = apart.dot(p.half), along_q = apart.dot(q.half);
  const auto cut = [](S x) { return std::clamp(x, S(-1), S(1)); };
  const S determinant = pp * qq - pq * pq;
  S s = determinant > 0 ? cut((along_p * qq - along_q * pq) / determinant) : S(0);
  const S t = qq > 0 ? cut((s * pq - along_q) / qq) : S(0);
  s = pp > 0 ? cut((t * pq + along_p) / pp) : S(0);
  return {p.center + s * p.half, q.center + t * q.half};
}

/// Whether two capsules touch.
///@{
template <typename S>
bool capsulesTouch(const CapsuleAxis<S>& p, const CapsuleAxis<S>& q) {
  const AxisPoints<S> nearest = nearestPoints(p, q);
  const S sum = p.radius + q.radius;
  return (nearest.q - nearest.p).squaredNorm() <= sum * sum;
}

template <typename S>
bool capsulesTouch(const fcl::CollisionObject<S>& a, const fcl::CollisionObject<S>& b) {
  return capsulesTouch(axisOf(a), axisOf(b));
}
///@}

}  // namespace fcl_fibers::benchmarks
