// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/geometry/shape/utility.h>

#include "contenders/contender.h"

namespace fcl_fibers::benchmarks {

/// An object whose box can be tight, which FCL's own computeAABB() makes only of an object that is
/// not turned.
class BoxedObject : public Object {
 public:
  using Object::Object;

  /// The box that the contender reads. Ours reads none.
  void computeBox(const Contender& contender) {
    if (contender.boxes == Boxes::kStock) computeAABB();
    if (contender.boxes == Boxes::kTight) computeTightAABB();
  }

  /// Of capsules and spheres by fcl::computeBV(). Of others around the shape's own box, as it is
  /// turned: fcl::computeBV() of boxes and cylinders is that.
  void computeTightAABB() {
    const fcl::Transform3d& pose = getTransform();
    const fcl::CollisionGeometryd& shape = *collisionGeometry();
    if (shape.getNodeType() == fcl::GEOM_CAPSULE) {
      fcl::computeBV(static_cast<const fcl::Capsuled&>(shape), pose, aabb);
      return;
    }
    if (shape.getNodeType() == fcl::GEOM_SPHERE) {
      fcl::computeBV(static_cast<const fcl::Sphered&>(shape), pose, aabb);
      return;
    }
    const fcl::AABBd& own = shape.aabb_local;
    const fcl::Vector3d middle = pose * own.center();
    const fcl::Vector3d half = pose.linear().cwiseAbs() * ((own.max_ - own.min_) / 2);
    aabb.min_ = middle - half;
    aabb.max_ = middle + half;
  }
};

}  // namespace fcl_fibers::benchmarks
