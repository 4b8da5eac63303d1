// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/narrowphase/collision_object.h>
#include <fcl_fibers/fiber_manager_options.h>

#include "support/random.h"

namespace fcl_fibers::test {

/// Objects for the managers to borrow. Positions are given in double and rounded to S; what counts
/// is the pose that the object stores.
template <typename S>
class Scene {
 public:
  using Object = fcl::CollisionObject<S>;
  using Geometry = fcl::CollisionGeometry<S>;
  using Pose = fcl::Transform3<S>;

  Scene() = default;
  Scene(Scene&&) = default;
  Scene& operator=(Scene&&) = default;

  /// In the order in which they were added.
  const std::vector<Object*>& objects() const { return objects_; }
  Object* operator[](std::size_t i) const { return objects_[i]; }
  std::size_t size() const { return objects_.size(); }

  /// What addFiber added, fiber by fiber; objects added otherwise are in none.
  const std::vector<std::vector<Object*>>& fibers() const { return fibers_; }
  /// Of each fiber.
  const std::vector<FiberEnds>& ends() const { return ends_; }
  /// What is in no fiber.
  std::vector<Object*> loose() const;

  Object* add(std::shared_ptr<Geometry> geometry, const Pose& pose);
  Object* addCapsule(const Pose& pose, double radius, double length);
  Object* addCapsule(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius);
  Object* addSphere(const Eigen::Vector3d& center, double radius);
  Object* addBox(const Eigen::Vector3d& center, const Eigen::Quaterniond& rotation,
                 const Eigen::Vector3d& sides);
  /// An octahedron of triangles; of floats a convex solid.
  Object* addMesh(const Eigen::Vector3d& center, double radius);
  /// The same octahedron as a convex solid.
  Object* addConvex(const Eigen::Vector3d& center, double radius);
  /// An occupancy tree in a cube.
  Object* addOctree(const Eigen::Vector3d& center, double half_side);
  /// normal . x <= offset.
  Object* addHalfspace(const Eigen::Vector3d& normal, double offset);
  Object* addPlane(const Eigen::Vector3d& normal, double offset);

  /// Capsules between consecutive points.
  std::vector<Object*> addFiber(const std::vector<Eigen::Vector3d>& points, double radius,
                                FiberEnds ends = FiberEnds::kOpen);

  /// The object's shape, to be changed; its object must be a capsule.
  fcl::Capsule<S>& capsule(std::size_t i);

  /// The same objects, poses and shapes, allocated in an order that the seed decides.
  Scene reallocated(std::uint64_t seed) const;

 private:
  std::vector<std::unique_ptr<Object>> owned_;
  std::vector<std::shared_ptr<Geometry>> geometries_;
  std::vector<Object*> objects_;
  std::vector<std::vector<Object*>> fibers_;
  std::vector<FiberEnds> ends_;
};

/// A pose rounded to S, its rotation as orthonormal as S allows.
template <typename S>
fcl::Transform3<S> makePose(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& position);

/// Sets the pose and does what FCL asks its users to do after that.
template <typename S>
void moveTo(fcl::CollisionObject<S>& object, const fcl::Transform3<S>& pose);

/// Moves one object by up to `distance` on each axis and turns it by up to `angle`.
template <typename S>
void jolt(fcl::CollisionObject<S>& object, Random& random, double distance, double angle);

template <typename S>
void jolt(const std::vector<fcl::CollisionObject<S>*>& objects, Random& random, double distance,
          double angle) {
  for (fcl::CollisionObject<S>* object : objects) jolt(*object, random, distance, angle);
}

template <typename S>
void translate(fcl::CollisionObject<S>& object, const Eigen::Vector3d& by);

/// A pose whose place is in a cube of this half side.
template <typename S>
fcl::Transform3<S> somePose(Random& random, double half_side) {
  const Eigen::Quaterniond rotation = random.rotation();
  return makePose<S>(rotation, random.inCube(half_side));
}

/// The box of an object, as a subclass of CollisionObject may write it.
template <typename S>
fcl::AABB<S>& aabbOf(fcl::CollisionObject<S>& object) {
  struct Subclass : fcl::CollisionObject<S> {
    using fcl::CollisionObject<S>::aabb;
  };
  return object.*(&Subclass::aabb);
}

/// Makes a box larger on all sides.
template <typename S>
void grow(fcl::AABB<S>& box, double by) {
  box.min_.array() -= static_cast<S>(by);
  box.max_.array() += static_cast<S>(by);
}

/// Drake's way to say from how far away an object is to be heard of: the box of its shape grows, so
/// that every computeAABB() of the object takes the margin along.
template <typename S>
void widenShape(fcl::CollisionObject<S>& object, double margin) {
  auto& shape = const_cast<fcl::CollisionGeometry<S>&>(*object.collisionGeometry());
  grow(shape.aabb_local, margin);
  shape.aabb_radius = (shape.aabb_local.max_ - shape.aabb_center).norm();
  object.computeAABB();
}

extern template class Scene<float>;
extern template class Scene<double>;

}  // namespace fcl_fibers::test
