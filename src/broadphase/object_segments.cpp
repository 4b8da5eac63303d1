// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_segments.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>

#include "geometry/touch.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Frame;
using geometry::Segment;
using geometry::Vec3d;

template <class Vector>
Vec3d toVec3(const Vector& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

bool allFinite(const Vec3d& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Rotations drift when they are multiplied for long without being normalised; this much is
/// harmless, as the end points are taken from the matrix as it is.
template <typename S>
constexpr double kRotationTolerance = std::is_same_v<S, float> ? 1e-3 : 1e-6;

template <typename S>
const char* poseProblem(const fcl::Transform3<S>& pose) {
  const auto& matrix = pose.matrix();
  const Vec3d x = toVec3(matrix.col(0)), y = toVec3(matrix.col(1)), z = toVec3(matrix.col(2));
  const Vec3d t = toVec3(matrix.col(3));
  const double determinant =
      x.x * (y.y * z.z - y.z * z.y) + x.y * (y.z * z.x - y.x * z.z) + x.z * (y.x * z.y - y.y * z.x);
  // NaN and infinity fail these comparisons.
  constexpr double kTolerance = kRotationTolerance<S>;
  const bool is_rotation =
      std::fabs(dot(x, x) - 1) <= kTolerance && std::fabs(dot(y, y) - 1) <= kTolerance &&
      std::fabs(dot(z, z) - 1) <= kTolerance && std::fabs(dot(x, y)) <= kTolerance &&
      std::fabs(dot(y, z)) <= kTolerance && std::fabs(dot(z, x)) <= kTolerance && determinant > 0;
  if (is_rotation && allFinite(t)) return nullptr;
  if (!allFinite(x) || !allFinite(y) || !allFinite(z) || !allFinite(t)) {
    return "its pose is NaN or infinite; give it a finite pose";
  }
  return "its rotation is not orthonormal or is a reflection; give it a proper rotation";
}

const char* rangeProblem(const Segment& segment) {
  return isBounded(segment) && std::isfinite(segment.radius)
             ? nullptr
             : "its coordinates overflow; bring the scene nearer to the origin or change its unit";
}

template <typename S>
const char* readBox(const fcl::AABB<S>& box, const Frame& frame, Segment& segment) {
  constexpr S kUnbounded = std::numeric_limits<S>::max() / 4;
  const auto corner = [&](const fcl::Vector3<S>& p) {
    const Vec3d q = frame.fromWorld(toVec3(p));
    const auto sided = [](S world, double local) {
      return std::fabs(world) > kUnbounded ? std::copysign(std::numeric_limits<double>::infinity(),
                                                           static_cast<double>(world))
                                           : local;
    };
    return Vec3d{sided(p[0], q.x), sided(p[1], q.y), sided(p[2], q.z)};
  };
  for (int axis = 0; axis < 3; ++axis) {
    if (!(box.min_[axis] <= box.max_[axis])) {
      return "its box is empty or NaN; give it a non-empty shape and call computeAABB()";
    }
  }
  segment = Segment::box(corner(box.min_), corner(box.max_));
  return nullptr;
}

}  // namespace

template <typename S>
const char* readSegment(const fcl::CollisionObject<S>& object, const Frame& frame,
                        Segment& segment) {
  const fcl::CollisionGeometry<S>* shape = object.collisionGeometry().get();
  if (shape == nullptr) return "it has no geometry; construct it with a shape";
  const fcl::Transform3<S>& pose = object.getTransform();
  if (const char* problem = poseProblem(pose)) return problem;

  switch (shape->getNodeType()) {
    case fcl::GEOM_CAPSULE: {
      const auto& capsule = static_cast<const fcl::Capsule<S>&>(*shape);
      const double radius = static_cast<double>(capsule.radius);
      const double length = static_cast<double>(capsule.lz);
      if (!(radius >= 0)) return "its radius is negative or NaN; give it a radius of 0 or more";
      if (!(length >= 0)) return "its length is negative or NaN; give it a length of 0 or more";
      const Vec3d center = frame.fromWorld(toVec3(pose.matrix().col(3)));
      const Vec3d half = (frame.scale * (length / 2)) * toVec3(pose.matrix().col(2));
      segment = {center - half, center + half, frame.scale * radius};
      return rangeProblem(segment);
    }
    case fcl::GEOM_SPHERE: {
      const double radius = static_cast<double>(static_cast<const fcl::Sphere<S>&>(*shape).radius);
      if (!(radius >= 0)) return "its radius is negative or NaN; give it a radius of 0 or more";
      const Vec3d center = frame.fromWorld(toVec3(pose.matrix().col(3)));
      segment = {center, center, frame.scale * radius};
      return rangeProblem(segment);
    }
    default:
      return readBox(object.getAABB(), frame, segment);
  }
}

template <typename S>
Frame sceneFrame(const std::vector<fcl::CollisionObject<S>*>& objects) {
  constexpr std::size_t kSamples = 255;
  std::vector<Vec3d> middles;
  middles.reserve(kSamples);
  double extent = 0;
  const std::size_t step = objects.size() / kSamples + 1;
  for (std::size_t i = 0; i < objects.size(); i += step) {
    Segment segment;
    if (objects[i] == nullptr || readSegment(*objects[i], Frame{}, segment) != nullptr ||
        !isBounded(segment)) {
      continue;
    }
    middles.push_back(midpoint(segment));
    extent = std::max({extent, segment.thickness(), maxNorm(segment.b - segment.a)});
  }
  Frame frame;
  if (middles.empty()) return frame;

  for (const auto axis : {&Vec3d::x, &Vec3d::y, &Vec3d::z}) {
    const auto median = middles.begin() + static_cast<std::ptrdiff_t>(middles.size() / 2);
    std::nth_element(middles.begin(), median, middles.end(),
                     [axis](const Vec3d& p, const Vec3d& q) { return p.*axis < q.*axis; });
    frame.origin.*axis = (*median).*axis;
  }
  for (const Vec3d& p : middles) extent = std::max(extent, maxNorm(p - frame.origin));
  if (extent > 0 && std::isfinite(extent)) {
    // Away from the ends of the range, where the scale itself would not be a normal number.
    frame.scale = std::ldexp(1.0, -std::clamp(std::ilogb(extent), -1000, 1000));
  }
  return frame;
}

template const char* readSegment(const fcl::CollisionObject<float>&, const Frame&, Segment&);
template const char* readSegment(const fcl::CollisionObject<double>&, const Frame&, Segment&);
template Frame sceneFrame(const std::vector<fcl::CollisionObject<float>*>&);
template Frame sceneFrame(const std::vector<fcl::CollisionObject<double>*>&);

}  // namespace fcl_fibers::broadphase
