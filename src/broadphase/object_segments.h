// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_manager_options.h>

#include "geometry/frame.h"
#include "geometry/segment.h"
#include "simd/always_inline.h"

namespace fcl_fibers::broadphase {

/// Reads an object as a segment in `frame`. A sphere is a capsule of length zero. Other shapes, and
/// under Bounds::kObjects all shapes, are boxes, whose unbounded sides are at infinity. A margin
/// that the program has added to the box of a capsule or sphere is part of the radius.
/// @return nullptr, or why the object is refused and the remedy
template <typename S>
const char* readSegment(const fcl::CollisionObject<S>& object, const geometry::Frame& frame,
                        Bounds bounds, geometry::Segment& segment);

/// How far the entries of R^T R - I may be from 0 for the linear part R of a pose. Quaternions of
/// four digits and long products of matrices stay below it. R is never made orthonormal, so what
/// counts is the image of the shape under R as it is. R lengthens an axis of the shape by at most
/// 5e-4 of its length, and any vector by at most 1.5e-3 (Gershgorin).
constexpr double kRotationTolerance = 1e-3;

/// Whether a box, which readSegment() has read, is that of a capsule or sphere. numberBox() does
/// not change that.
inline bool holdsCapsule(const geometry::Segment& box) { return box.radius <= -2; }

/// Marks the box that readSegment() has read of an object by its pose and shape, if that is a
/// capsule, sphere, box or cylinder: other poses and shapes have other boxes then, except for one
/// in 2^52. Does nothing to a segment that is no box.
template <typename S>
void numberBox(const fcl::CollisionObject<S>& object, geometry::Segment& segment);

/// Why a pose is refused, and the remedy; nullptr if it is proper.
/// @param tolerance  as kRotationTolerance
template <typename S>
const char* poseProblem(const fcl::Transform3<S>& pose, double tolerance = kRotationTolerance);

/// Reads the size of a capsule or sphere. Returns false for any other shape.
template <typename S>
FCL_FIBERS_ALWAYS_INLINE bool readSize(const fcl::CollisionGeometry<S>& shape, fcl::NODE_TYPE type,
                                       double& radius, double& length) {
  switch (type) {
    case fcl::GEOM_CAPSULE: {
      const auto& capsule = static_cast<const fcl::Capsule<S>&>(shape);
      radius = static_cast<double>(capsule.radius);
      length = static_cast<double>(capsule.lz);
      return true;
    }
    case fcl::GEOM_SPHERE:
      radius = static_cast<double>(static_cast<const fcl::Sphere<S>&>(shape).radius);
      length = 0;
      return true;
    default:
      return false;
  }
}

}  // namespace fcl_fibers::broadphase
