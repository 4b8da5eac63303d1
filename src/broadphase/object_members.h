// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl/narrowphase/collision_object.h>

#include "geometry/vec3.h"

namespace fcl_fibers::broadphase {

template <class Vector>
geometry::Vec3d toVec3(const Vector& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

/// Reads members of FCL's objects where they are. FCL compiles their accessors in libfcl alone, so
/// that each would be a call. requireLayoutOfFcl() has made sure of the layout.
template <typename S>
class ObjectMembers : fcl::CollisionObject<S> {
  using Object = fcl::CollisionObject<S>;

 public:
  static const fcl::CollisionGeometry<S>* shape(const Object& object) {
    return (object.*(&ObjectMembers::cgeom)).get();
  }
  static const fcl::Transform3<S>& pose(const Object& object) {
    return object.*(&ObjectMembers::t);
  }
  static const fcl::AABB<S>& box(const Object& object) { return object.*(&ObjectMembers::aabb); }
};

}  // namespace fcl_fibers::broadphase
