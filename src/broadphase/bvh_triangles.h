// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <type_traits>

#include <fcl/geometry/collision_geometry.h>
#include <fcl/math/triangle.h>

#include "broadphase/object_members.h"

namespace fcl_fibers::broadphase {

/// Whether a geometry of this type is an `fcl::BVHModel`: triangles or a cloud of points.
inline bool isBvhModel(fcl::NODE_TYPE type) {
  return type >= fcl::BV_AABB && type <= fcl::BV_KDOP24;
}

template <typename S>
bool isMesh(const fcl::CollisionObject<S>& object) {
  const fcl::CollisionGeometry<S>* shape = ObjectMembers<S>::shape(object);
  return shape != nullptr && isBvhModel(shape->getNodeType());
}

/// What an `fcl::BVHModel` consists of, whatever its bounding volume. It borrows from the model.
template <typename S>
struct BvhTriangles {
  /// Whether it is a cloud of points.
  bool isCloud() const { return is_finished && triangle_count == 0; }

  /// Why the triangles are refused and the remedy; empty if they are not.
  std::string problem() const;

  const fcl::Vector3<S>* points = nullptr;
  const fcl::Triangle* triangles = nullptr;
  std::size_t point_count = 0, triangle_count = 0;
  bool is_finished = false;
};

/// @pre isBvhModel(model.getNodeType())
template <typename S>
BvhTriangles<S> trianglesOf(const fcl::CollisionGeometry<S>& model);

/// The indices of the points of one of FCL's triangles. FCL's accessor is compiled in libfcl only,
/// so it would cost a call for each index.
inline const std::size_t* indicesOf(const fcl::Triangle& triangle) {
  // Then a triangle and its only member have one address.
  static_assert(std::is_standard_layout_v<fcl::Triangle> &&
                sizeof(fcl::Triangle) == 3 * sizeof(std::size_t));
  return reinterpret_cast<const std::size_t*>(&triangle);
}

}  // namespace fcl_fibers::broadphase
