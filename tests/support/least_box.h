// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision_object.h>

#include "support/exact_geometry.h"

namespace fcl_fibers::test {

/// The box by which an object counts that nobody has widened, from its farthest points. A mesh or
/// an octree counts by the box of its own axes and the ball around it, and what is unbounded by
/// getAABB(). Shares nothing with the library.
template <typename S>
ExactBox leastBox(const fcl::CollisionObject<S>& object);

/// A capsule or a sphere where its pose puts it.
template <typename S>
ExactCapsule exactCapsule(const fcl::CollisionObject<S>& object) {
  const Point center = object.getTranslation().template cast<Real>();
  if (object.getNodeType() == fcl::GEOM_SPHERE) {
    const auto& sphere = static_cast<const fcl::Sphere<S>&>(*object.collisionGeometry());
    return {center, center, Real(sphere.radius)};
  }
  const auto& capsule = dynamic_cast<const fcl::Capsule<S>&>(*object.collisionGeometry());
  const Point half = Real(capsule.lz) / 2 * object.getRotation().col(2).template cast<Real>();
  return {center - half, center + half, Real(capsule.radius)};
}

/// The distance of the surfaces of two capsules or spheres; negative if they overlap.
template <typename S>
Real exactGap(const fcl::CollisionObject<S>& p, const fcl::CollisionObject<S>& q) {
  const ExactCapsule a = exactCapsule(p), b = exactCapsule(q);
  return segmentDistance(a.a, a.b, b.a, b.b) - a.radius - b.radius;
}

/// The triangles of a mesh, posed; none of any other shape.
template <typename S>
std::vector<ExactTriangle> trianglesOf(const fcl::CollisionObject<S>& object);

/// The distance of a segment from an object that is neither a capsule nor a sphere, 0 if they meet:
/// from the triangles of a mesh, from a box, plane, half-space, triangle or convex polytope, and
/// from the local box of any other shape, each posed by the matrix as it is. Not of a cloud of
/// points.
template <typename S>
std::function<Real(const Point&, const Point&)> distanceFrom(const fcl::CollisionObject<S>& object);

extern template ExactBox leastBox(const fcl::CollisionObject<float>&);
extern template ExactBox leastBox(const fcl::CollisionObject<double>&);

}  // namespace fcl_fibers::test
