// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_segments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>

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
  // Zero times infinity or NaN is NaN.
  return 0 * v.x + 0 * v.y + 0 * v.z == 0;
}

/// Rotations drift when they are multiplied for long without being normalised; this much, in sum,
/// is harmless, as the end points are taken from the matrix as it is.
template <typename S>
constexpr double kRotationTolerance = std::is_same_v<S, float> ? 5e-3 : 5e-6;

template <typename S>
const char* poseProblem(const fcl::Transform3<S>& pose) {
  const auto& matrix = pose.matrix();
  const Vec3d x = toVec3(matrix.col(0)), y = toVec3(matrix.col(1)), z = toVec3(matrix.col(2));
  const Vec3d t = toVec3(matrix.col(3));
  // Two columns are perpendicular and of length one, and the third is their cross product. Added
  // up by hand: packed loads from an array that has just been written would wait for it.
  const Vec3d off = cross(x, y) - z;
  const double deviation = (std::fabs(dot(x, x) - 1) + std::fabs(dot(y, y) - 1)) +
                           (std::fabs(dot(x, y)) + std::fabs(off.x)) +
                           (std::fabs(off.y) + std::fabs(off.z));
  // NaN and infinity fail the comparison.
  if (deviation <= kRotationTolerance<S> && allFinite(t)) return nullptr;
  if (!allFinite(x) || !allFinite(y) || !allFinite(z) || !allFinite(t)) {
    return "its pose is NaN or infinite; give it a finite pose";
  }
  return "its rotation is not orthonormal or is a reflection; give it a proper rotation";
}

constexpr const char* kBadRadius =
    "its radius is negative, NaN or infinite; give it a finite radius of 0 or more";
constexpr const char* kBadLength =
    "its length is negative, NaN or infinite; give it a finite length of 0 or more";

const char* rangeProblem(const Segment& segment) {
  return isBounded(segment) && std::isfinite(segment.radius)
             ? nullptr
             : "its coordinates overflow; bring the scene nearer to the origin or change its unit";
}

template <typename S>
const char* readBox(const fcl::AABB<S>& box, const Frame& frame, Segment& segment) {
  // FCL's planes reach to max(), or to infinity when they are turned.
  constexpr S kUnbounded = std::numeric_limits<S>::max() / 4;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kLargest = std::numeric_limits<double>::max();
  // Only the outward side of a box may be open: a box far out has two finite corners.
  const auto low = [&](S world, double local) {
    return world < -kUnbounded ? -kInfinity : std::min(local, kLargest);
  };
  const auto high = [&](S world, double local) {
    return world > kUnbounded ? kInfinity : std::max(local, -kLargest);
  };
  for (int axis = 0; axis < 3; ++axis) {
    if (!(box.min_[axis] <= box.max_[axis])) {
      return "its box is empty or NaN; give it a non-empty shape and call computeAABB()";
    }
  }
  const Vec3d p = frame.fromWorld(toVec3(box.min_)), q = frame.fromWorld(toVec3(box.max_));
  segment = Segment::box({low(box.min_[0], p.x), low(box.min_[1], p.y), low(box.min_[2], p.z)},
                         {high(box.max_[0], q.x), high(box.max_[1], q.y), high(box.max_[2], q.z)});
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
      if (!(radius >= 0 && std::isfinite(radius))) return kBadRadius;
      if (!(length >= 0 && std::isfinite(length))) return kBadLength;
      const Vec3d center = frame.fromWorld(toVec3(pose.matrix().col(3)));
      // The scale is halved and not the length, which may be subnormal and have an odd last bit.
      const Vec3d half = (frame.scale / 2 * length) * toVec3(pose.matrix().col(2));
      segment = {center - half, center + half, frame.scale * radius};
      return rangeProblem(segment);
    }
    case fcl::GEOM_SPHERE: {
      const double radius = static_cast<double>(static_cast<const fcl::Sphere<S>&>(*shape).radius);
      if (!(radius >= 0 && std::isfinite(radius))) return kBadRadius;
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
  std::array<Segment, kSamples> samples;
  // Where so many objects have left that few samples are found, the steps become smaller.
  std::size_t found = 0, step = objects.size() / kSamples + 1;
  for (; found < kSamples / 4; step /= 2) {
    found = 0;
    for (std::size_t i = 0; i < objects.size() && found < kSamples; i += step) {
      Segment& segment = samples[found];
      found += objects[i] != nullptr && readSegment(*objects[i], Frame{}, segment) == nullptr &&
               isBounded(segment);
    }
    if (step == 1) break;
  }
  return geometry::frameFor(samples.data(), found);
}

template const char* readSegment(const fcl::CollisionObject<float>&, const Frame&, Segment&);
template const char* readSegment(const fcl::CollisionObject<double>&, const Frame&, Segment&);
template Frame sceneFrame(const std::vector<fcl::CollisionObject<float>*>&);
template Frame sceneFrame(const std::vector<fcl::CollisionObject<double>*>&);

}  // namespace fcl_fibers::broadphase
