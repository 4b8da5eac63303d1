// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl/narrowphase/collision_object.h>

#include "geometry/vec3.h"

namespace fcl_fibers::broadphase {

template <class Vector>
geometry::Vec3d toVec3(const Vector& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

/// Reads members of FCL's objects directly. Their accessors are compiled in libfcl only, so each
/// would cost a call.
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

/// Throws std::runtime_error with the remedy if an object made by libfcl does not read back its
/// pose here. Then FCL's objects have another layout in this library than in libfcl, because it was
/// compiled for other instructions. The comparison in the public header does not find that, because
/// it knows only this library.
void requireLayoutOfFcl();

}  // namespace fcl_fibers::broadphase
