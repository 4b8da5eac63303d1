// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_manager_options.h>

#include "broadphase/fcl_layout.h"
#include "broadphase/shape_box.h"
#include "fibers/options.h"
#include "geometry/affine_map.h"
#include "geometry/frame.h"
#include "geometry/obstacle.h"
#include "geometry/polytope_vertices.h"
#include "geometry/segment.h"
#include "simd/always_inline.h"
#include "tree/topology.h"

namespace fcl_fibers::broadphase {

using tree::SegmentId;

/// What an object is by its geometry.
enum class ObjectKind : std::uint8_t {
  kNothing,  ///< it has no geometry
  kCapsule,
  kSphere,
  kBar,        ///< a box or cylinder, which may be a segment of a fiber
  kBounded,    ///< any other shape with an end
  kUnbounded,  ///< a plane or half-space
  kMesh,       ///< an `fcl::BVHModel`: triangles or a cloud of points
};

inline ObjectKind kindOf(fcl::NODE_TYPE type) {
  if (type == fcl::GEOM_CAPSULE) return ObjectKind::kCapsule;  // Most are.
  switch (type) {
    case fcl::GEOM_SPHERE:
      return ObjectKind::kSphere;
    case fcl::GEOM_BOX:
    case fcl::GEOM_CYLINDER:
      return ObjectKind::kBar;
    case fcl::GEOM_PLANE:
    case fcl::GEOM_HALFSPACE:
      return ObjectKind::kUnbounded;
    default:
      return type >= fcl::BV_AABB && type <= fcl::BV_KDOP24 ? ObjectKind::kMesh
                                                            : ObjectKind::kBounded;
  }
}

template <typename S>
FCL_FIBERS_ALWAYS_INLINE ObjectKind kindOf(const fcl::CollisionObject<S>& object) {
  const fcl::CollisionGeometry<S>* shape = ObjectMembers<S>::shape(object);
  return shape == nullptr ? ObjectKind::kNothing : kindOf(shape->getNodeType());
}

template <typename S>
bool isMesh(const fcl::CollisionObject<S>& object) {
  return kindOf(object) == ObjectKind::kMesh;
}

/// Whether an object is a segment by itself. Any other one is a box, at least in the tree.
inline bool isRound(ObjectKind kind) {
  return kind == ObjectKind::kCapsule || kind == ObjectKind::kSphere;
}

/// Whether objects count by more than their boxes, so that capsules touch them or not.
inline bool countsTriangles(const FiberManagerOptions& options) {
  return options.report == Report::kCapsules && options.bounds != Bounds::kObjects;
}

/// Whether objects are beside the tree: a mesh whose triangles count, and a shape without end,
/// whose box would overlap most others.
inline bool isBesideTree(ObjectKind kind, const FiberManagerOptions& options) {
  return kind == ObjectKind::kUnbounded || (kind == ObjectKind::kMesh && countsTriangles(options));
}

/// Whether the shape within an object's box in the tree is kept, or that of what moves. A box or a
/// cylinder, of which there are many if they form fibers, is read again when it is asked for.
/// Others may have many vertices.
inline bool keepsShape(ObjectKind kind, const FiberManagerOptions& options) {
  return countsTriangles(options) && kind != ObjectKind::kMesh && !isRound(kind) &&
         (options.motion || kind == ObjectKind::kBounded);
}

/// Reads the size of a capsule or sphere. Returns false for any other kind.
template <typename S>
FCL_FIBERS_ALWAYS_INLINE bool readSize(const fcl::CollisionObject<S>& object, ObjectKind kind,
                                       double& radius, double& length) {
  const fcl::CollisionGeometry<S>* shape = ObjectMembers<S>::shape(object);
  if (kind == ObjectKind::kCapsule) {
    const auto& capsule = static_cast<const fcl::Capsule<S>&>(*shape);
    radius = static_cast<double>(capsule.radius);
    length = static_cast<double>(capsule.lz);
  } else if (kind == ObjectKind::kSphere) {
    radius = static_cast<double>(static_cast<const fcl::Sphere<S>&>(*shape).radius);
    length = 0;
  }
  return isRound(kind);
}

template <typename S>
FCL_FIBERS_ALWAYS_INLINE geometry::AffineMap poseOf(const fcl::CollisionObject<S>& object) {
  const auto& pose = ObjectMembers<S>::pose(object).matrix();
  return {{toVec3(pose.col(0)), toVec3(pose.col(1)), toVec3(pose.col(2))}, toVec3(pose.col(3))};
}

/// A number from 1 to 2 that tells poses and sizes apart. Others have other numbers, except for one
/// in 2^52.
double markOf(const geometry::AffineMap& pose, const geometry::Vec3d& size);

/// Whether an object may be a segment of a fiber that is registered as one.
inline bool mayBeInFiber(ObjectKind kind) {
  return kind == ObjectKind::kCapsule || kind == ObjectKind::kBar;
}

/// The length of such an object along its z axis, and 0 for any other.
template <typename S>
double lengthInFiber(const fcl::CollisionObject<S>& object);

/// An FCL object as it is at present, understood in the world's frame.
struct ReadObject {
  const char* problem = nullptr;  ///< why it is refused and the remedy; then nothing else is set
  ObjectKind kind = ObjectKind::kNothing;
  bool is_own_box = false;  ///< whether only the box counts that FCL or the program gave it
  /// What is known of the shape within its box. It is kBox for any shape that fills some of its
  /// local box, and kAxis for a capsule or sphere whose box the program has widened unevenly.
  geometry::Obstacle::Kind shape = geometry::Obstacle::Kind::kNone;
  geometry::AffineMap pose;
  geometry::Vec3d size{0, 0, 0};  ///< sides of a box; else radius and length
  ShapeBox box;                   ///< of the shape, unless it is a capsule or sphere
  Widening added;                 ///< by the program
  Corners own;                    ///< the object's box, if boxes count
  /// If it is not negative, `own` counts as well where it is within `box`, up to this rounding.
  double open_rounding = -1;
  geometry::Vec3d vector[3];           ///< the corners of a triangle, or the normal of a plane
  double offset = 0;                   ///< of the plane
  geometry::PointsOfProgram vertices;  ///< of a convex polytope; the object has them

  /// Whether nothing but the shape and `added.margin` around it counts. Then a mesh counts by its
  /// triangles.
  bool isAllOfShape() const { return isBounded(box) && !added.is_uneven; }
};

/// Reads an object. A margin that the program has added to its box counts under
/// Bounds::kShapesAndMargins.
/// @param mesh  the bounds of a mesh that was read, or null for those that FCL has
template <typename S>
ReadObject readObject(const fcl::CollisionObject<S>& object, Bounds bounds,
                      const LocalBounds* mesh = nullptr);

/// The object as a segment in `frame`. A sphere is a capsule of length zero. Other shapes, and
/// under Bounds::kObjects all shapes, are boxes, whose unbounded sides are at infinity. A margin
/// that the program has added to the box of a capsule or sphere is part of the radius.
/// @param marks_boxes  whether a box is marked by the object's pose and size: other poses and
///                     sizes have other segments then, except for one in 2^52
/// @return nullptr, or why the object is refused and the remedy
const char* segmentOf(const ReadObject& object, const geometry::Frame& frame,
                      geometry::Segment& segment, bool marks_boxes = false);

/// Reads an object as a segment.
template <typename S>
const char* readSegment(const fcl::CollisionObject<S>& object, const geometry::Frame& frame,
                        Bounds bounds, geometry::Segment& segment, bool marks_boxes = false);

/// The shape of an object that counts by its box, as an obstacle in `frame`. A box, plane,
/// half-space, triangle or convex polytope is exact, and so is a capsule or sphere whose box the
/// program has widened unevenly. Any other bounded shape is inside its obstacle, which is the local
/// box in the object's pose. A margin that the program has added to the object's box is part of the
/// obstacle's margin.
/// @param known  vertices of a polytope that are shared if the object still has them
/// @return of Kind::kNone if only the box counts
geometry::Obstacle obstacleOf(
    const ReadObject& object, const geometry::Frame& frame,
    const std::shared_ptr<const geometry::PolytopeVertices>& known = nullptr);

/// How far the entries of R^T R - I may be from 0 for the linear part R of a pose. Quaternions of
/// four digits and long products of matrices stay below it. R is never made orthonormal, so what
/// counts is the image of the shape under R as it is. R lengthens an axis of the shape by at most
/// 5e-4 of its length, and any vector by at most 1.5e-3 (Gershgorin).
constexpr double kRotationTolerance = 1e-3;

/// What segmentsOf() takes without a second look: the six numbers of its sum bound the entries of
/// R^T R - I, of which that of the third column by twice the sum and a little.
constexpr double kUsualRotation = kRotationTolerance / 2.05;

/// An object that cannot be read. Whoever knows its name catches it: see named().
struct RefusedObject {
  std::string reason;  ///< and the remedy
  SegmentId place;     ///< of the object among those of a call
};

/// Throws it, and stays out of the loops over objects, which never call it.
[[noreturn, gnu::cold]] void refuse(std::string_view reason, SegmentId place);

/// Returns read(). Throws std::invalid_argument if it refuses an object, with name(place).
template <class Name, class Read>
auto named(const char* call, Name&& name, Read&& read) {
  try {
    return read();
  } catch (const RefusedObject& refused) {
    fibers::throwInvalidArgument(call, name(refused.place) + ": " + refused.reason);
  }
}
/// The same where there is one object.
template <class Read>
auto named(const char* call, const char* name, Read&& read) {
  return named(
      call, [name](SegmentId) { return std::string(name); }, read);
}

/// Reads one object in `frame`, or throws RefusedObject.
template <typename S>
geometry::Segment requireSegment(const fcl::CollisionObject<S>& object,
                                 const geometry::Frame& frame, Bounds bounds, SegmentId place = 0) {
  geometry::Segment segment;
  if (const char* problem = readSegment(object, frame, bounds, segment)) refuse(problem, place);
  return segment;
}

}  // namespace fcl_fibers::broadphase
