// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/obstacle_shapes.h"

#include <cmath>
#include <limits>

#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/triangle_p.h>

#include "broadphase/object_members.h"
#include "broadphase/object_segments.h"
#include "broadphase/program_margin.h"
#include "broadphase/shape_box.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Frame;
using geometry::Obstacle;
using geometry::Vec3d;

/// The columns of a rotation, which may have drifted. It is used as it is.
struct Columns {
  Vec3d x, y, z;

  template <typename S>
  explicit Columns(const fcl::Transform3<S>& pose)
      : x(toVec3(pose.matrix().col(0))),
        y(toVec3(pose.matrix().col(1))),
        z(toVec3(pose.matrix().col(2))) {}
};

bool isFinite(const Obstacle& obstacle) {
  double sum = obstacle.offset + obstacle.margin + obstacle.error + maxNorm(obstacle.point);
  for (const Vec3d& v : obstacle.vector) sum += std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z);
  return std::isfinite(sum);
}

/// Whether neither box of a plane or half-space reaches beyond the one that FCL gives it. If one
/// does, the program has widened it, or it is of an earlier pose.
template <typename S, class Shape>
bool hasStockBoxes(const fcl::CollisionObject<S>& object, const Shape& shape) {
  Shape fresh(shape);
  fresh.computeLocalAABB();
  const auto isWithin = [](const fcl::AABB<S>& inner, const fcl::AABB<S>& outer) {
    return (inner.min_.array() >= outer.min_.array()).all() &&
           (inner.max_.array() <= outer.max_.array()).all();
  };
  if (!isWithin(shape.aabb_local, fresh.aabb_local)) return false;
  const fcl::Transform3<S>& pose = ObjectMembers<S>::pose(object);
  // FCL's box of a turned plane is open on all sides.
  return !pose.linear().isIdentity() ||
         isWithin(ObjectMembers<S>::box(object),
                  fcl::translate(fresh.aabb_local, fcl::Vector3<S>(pose.translation())));
}

/// A plane or half-space. Its normal may have any length.
template <typename S, class Shape>
bool readPlane(const fcl::CollisionObject<S>& object, const Shape& shape, Obstacle::Kind kind,
               const Frame& frame, Bounds bounds, Obstacle& obstacle) {
  if (bounds == Bounds::kShapesAndMargins && !hasStockBoxes(object, shape)) return false;
  const Columns turned(ObjectMembers<S>::pose(object));
  const Vec3d given = toVec3(shape.n), x_row = cross(turned.y, turned.z);
  const double size = maxNorm(given);
  if (!(size > 0)) return false;
  // The normal of the image of a plane, also if the rotation has drifted.
  const Vec3d normal = (given.x / size) * x_row + (given.y / size) * cross(turned.z, turned.x) +
                       (given.z / size) * cross(turned.x, turned.y);
  const double length = norm(normal);
  obstacle.kind = kind;
  obstacle.vector[0] = (1 / length) * normal;
  obstacle.offset =
      frame.scale * (static_cast<double>(shape.d) / size * (dot(turned.x, x_row) / length));
  return true;
}

/// A capsule or sphere, of which a part of the margin is the radius.
template <typename S>
bool readAxis(const fcl::CollisionObject<S>& object, fcl::NODE_TYPE type, const Frame& frame,
              Bounds bounds, Obstacle& obstacle) {
  double radius, length;
  if (bounds != Bounds::kShapesAndMargins ||
      !readSize(*ObjectMembers<S>::shape(object), type, radius, length)) {
    return false;
  }
  const Widening added = wideningOf(object, radius, length);
  if (!added.is_uneven) return false;
  obstacle.kind = Obstacle::Kind::kAxis;
  obstacle.vector[0] =
      (frame.scale / 2 * length) * toVec3(ObjectMembers<S>::pose(object).matrix().col(2));
  obstacle.margin = frame.scale * (radius + added.margin);
  obstacle.error = endPointError(obstacle.capsule());
  return true;
}

template <typename S>
bool readBounded(const fcl::CollisionObject<S>& object, fcl::NODE_TYPE type, const Frame& frame,
                 Bounds bounds, Obstacle& obstacle) {
  ShapeBox box;
  double margin = 0;
  if (!readLocalBox(object, type, bounds, box, margin)) return false;
  const Columns turned(ObjectMembers<S>::pose(object));
  const auto turn = [&](const Vec3d& p) {
    return frame.scale * (p.x * turned.x + p.y * turned.y + p.z * turned.z);
  };
  obstacle.margin = frame.scale * margin;
  obstacle.error = 16 * std::numeric_limits<double>::epsilon() * frame.scale *
                   (maxNorm(box.local.low) + maxNorm(box.local.high));
  if (type == fcl::GEOM_TRIANGLE) {
    const auto& triangle = static_cast<const fcl::TriangleP<S>&>(*ObjectMembers<S>::shape(object));
    obstacle.kind = Obstacle::Kind::kTriangle;
    const Vec3d corners[] = {toVec3(triangle.a), toVec3(triangle.b), toVec3(triangle.c)};
    for (int i = 0; i < 3; ++i) obstacle.vector[i] = obstacle.point + turn(corners[i]);
    return true;
  }
  obstacle.kind = Obstacle::Kind::kBox;
  obstacle.point = obstacle.point + turn(box.local.middle());
  const Vec3d half = box.local.half();
  obstacle.vector[0] = turn({half.x, 0, 0});
  obstacle.vector[1] = turn({0, half.y, 0});
  obstacle.vector[2] = turn({0, 0, half.z});
  return true;
}

}  // namespace

template <typename S>
bool readObstacle(const fcl::CollisionObject<S>& object, const Frame& frame, Bounds bounds,
                  Obstacle& obstacle) {
  obstacle = {};
  if (bounds == Bounds::kObjects) return false;
  const fcl::CollisionGeometry<S>& shape = *ObjectMembers<S>::shape(object);
  const fcl::NODE_TYPE type = shape.getNodeType();
  Obstacle found;
  found.point = frame.fromWorld(toVec3(ObjectMembers<S>::pose(object).matrix().col(3)));
  const double position_error = geometry::endPointError(maxNorm(found.point));
  bool is_read = false;
  switch (type) {
    case fcl::GEOM_CAPSULE:
    case fcl::GEOM_SPHERE:
      is_read = readAxis(object, type, frame, bounds, found);
      break;
    case fcl::GEOM_PLANE:
      is_read = readPlane(object, static_cast<const fcl::Plane<S>&>(shape), Obstacle::Kind::kPlane,
                          frame, bounds, found);
      break;
    case fcl::GEOM_HALFSPACE:
      is_read = readPlane(object, static_cast<const fcl::Halfspace<S>&>(shape),
                          Obstacle::Kind::kHalfspace, frame, bounds, found);
      break;
    default:
      is_read = readBounded(object, type, frame, bounds, found);
  }
  // The smallest normal number covers the loss if subnormals are flushed to zero.
  found.error += position_error + 8 * (frame.scale + 1) * std::numeric_limits<double>::min();
  if (!is_read || !isFinite(found)) return false;
  obstacle = found;
  return true;
}

template bool readObstacle(const fcl::CollisionObject<float>&, const Frame&, Bounds, Obstacle&);
template bool readObstacle(const fcl::CollisionObject<double>&, const Frame&, Bounds, Obstacle&);

}  // namespace fcl_fibers::broadphase
