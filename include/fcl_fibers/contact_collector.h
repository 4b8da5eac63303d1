// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/narrowphase/collision.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_collision_manager.h>

namespace fcl_fibers {

/// Returns the contact of a capsule or sphere and another object, at their present poses and in
/// either order, without fiber and segment numbers. hasCapsuleContact() tells which objects it
/// takes. A sphere is a capsule of length zero. An object that is neither a capsule nor a sphere
/// has the arc parameter 0.
///
/// A box and a half-space are solid. If the axis is outside, the normal is along the way between
/// two closest points. If the axis reaches into them, or crosses a plane or triangle, the capsule
/// has to move against the normal until it is out, or on one side. `distance` is minus the length
/// of the shortest such way:
/// * from a box, across a face, or across an edge and the axis;
/// * from a half-space, that of the deeper end;
/// * from a plane or a triangle, to the nearer side.
///
/// The points are those that touch after that motion; if the axis is along a plane, they are at its
/// middle. The points with a triangle are explained at MeshContact. If several ways out of a box
/// are as short, up to 16 eps of the lengths, the first counts: across the faces of its x, y and z
/// axis, then across edges, to the side of the axis's middle.
///
/// The error of `distance` is at most 32 eps of a sum: the radius, the axis's length, the box's
/// sides and the ways from the box's middle to the axis's ends. With a plane or half-space these
/// ways begin at its position, and its offset is part of the sum. With a triangle the error is that
/// of MeshContact. The pose adds 16 eps of the object's size and of the way between the two
/// positions.
///
/// Throws std::invalid_argument if the objects have other shapes, if a fiber manager would refuse
/// the pose, radius or size of one, or if a number of one exceeds 2^1000.
template <typename S>
FCL_FIBERS_EXPORT Contact capsuleContact(const fcl::CollisionObject<S>& a,
                                         const fcl::CollisionObject<S>& b);

/// Returns whether this object is a capsule or a sphere.
template <typename S>
bool isCapsule(const fcl::CollisionObject<S>& object) {
  const fcl::NODE_TYPE type = object.getNodeType();
  return type == fcl::GEOM_CAPSULE || type == fcl::GEOM_SPHERE;
}

/// Returns whether capsuleContact() takes these two: whether one is a capsule or a sphere, and the
/// other is as well or an `fcl::Box`, `fcl::Plane`, `fcl::Halfspace` or `fcl::TriangleP`.
template <typename S>
bool hasCapsuleContact(const fcl::CollisionObject<S>& a, const fcl::CollisionObject<S>& b) {
  if (!isCapsule(a) && !isCapsule(b)) return false;
  const fcl::CollisionObject<S>& other = isCapsule(a) ? b : a;
  const fcl::NODE_TYPE type = other.getNodeType();
  return isCapsule(other) || type == fcl::GEOM_BOX || type == fcl::GEOM_PLANE ||
         type == fcl::GEOM_HALFSPACE || type == fcl::GEOM_TRIANGLE;
}

/// A contact and its two objects.
template <typename S>
struct ObjectContact : Contact {
  fcl::CollisionObject<S>* object_a = nullptr;  ///< the callback's first argument
  fcl::CollisionObject<S>* object_b = nullptr;  ///< the second argument

  /// If one object is a capsule and the other a mesh that counts by its triangles: the index of the
  /// touched triangle in `fcl::BVHModel::tri_indices`. Otherwise -1.
  std::int32_t triangle = -1;
  std::array<double, 3> weights{};  ///< its barycentric coordinates; see MeshContact
  /// Whether the depth is that of the capsule in a solid mesh, not that at one triangle.
  bool solid = false;
};

/// An FCL callback that collects where the pairs of a query touch, with fiber and segment numbers:
///
///     ContactCollector<double> collector(manager);
///     manager.collide(&collector, collector.callback);
///     for (const auto& contact : collector.contacts()) ...
///
/// Two capsules or spheres, or one of them and a box, plane, half-space or single triangle, have
/// one contact, which is that of capsuleContact(). They have it if they are no further apart than
/// the manager's margin and their own margins together; Bounds explains an object's own margin.
/// Under Report::kCapsules a pair may also be reported because a box counts in place of an object.
/// Then it has one contact too, except with Bounds::kObjects.
///
/// If the manager has Report::kCapsules, but not Bounds::kObjects, a capsule or sphere and a mesh
/// of triangles have a contact for each triangle that they touch within these margins, however many
/// there are. If a pair is reported although no triangle touches, as inside a solid mesh, the
/// contact is that with the nearest triangle. See FiberCollisionManager::findMeshContacts().
///
/// All other pairs go to `fcl::collide`: those of two objects that are neither capsules nor
/// spheres, those of a cylinder, cone, ellipsoid, convex or octree, even if cylinders or boxes form
/// a fiber, and those of a mesh under Report::kVolumes or Bounds::kObjects. They have the contacts
/// that FCL finds, at most as many as the request admits, and none within a margin. FCL's points
/// may be off the surfaces, and its depth need not be the least.
/// Its normals, positions and depths are converted to those of Contact. The arc parameter of a
/// capsule is where its axis is nearest to FCL's position; that of any other shape is 0. For a
/// scene of floats the user's program compiles FCL's narrow phase.
template <typename S>
class ContactCollector {
 public:
  using Manager = FiberCollisionManager<S>;  ///< a manager whose queries are collected
  using Object = fcl::CollisionObject<S>;    ///< an object of the manager

  /// Collects the contacts of collision queries.
  /// @param manager  the manager that is queried; it has to outlive the collector
  /// @param other    a fiber manager with second objects, as in `manager.collide(other, ...)`. It
  ///                 has to outlive the collector, too. Null if there is none. A second object that
  ///                 it does not have is looked for in `manager`. What is in neither has no fiber.
  explicit ContactCollector(const Manager& manager, const Manager* other = nullptr)
      : manager_(manager), other_(other) {
    request.enable_contact = true;
    request.num_max_contacts = 16;
  }

  /// The request that fcl::collide gets. It has no effect on pairs that do not go there.
  fcl::CollisionRequest<S> request;

  /// Returns the contacts of all queries since clear(), in the order of their pairs.
  const std::vector<ObjectContact<S>>& contacts() const { return contacts_; }

  /// Forgets the contacts but keeps their memory for the next query.
  void clear() { contacts_.clear(); }

  /// The callback to pass to `collide`, with the collector as `cdata`. It never ends the query. It
  /// throws std::invalid_argument if it finds a contact whose first object is not registered in the
  /// collector's manager, and as capsuleContact() does if a capsule has become invalid since the
  /// manager read it.
  static bool callback(Object* a, Object* b, void* cdata) {
    static_cast<ContactCollector*>(cdata)->add(a, b);
    return false;
  }

 private:
  /// Where a second object is looked for.
  const Manager& managerOf(const Object* object) const {
    return other_ != nullptr && other_->isRegistered(object) ? *other_ : manager_;
  }

  void add(Object* a, Object* b) {
    ObjectContact<S> contact;
    contact.object_a = a;
    contact.object_b = b;
    if (hasCapsuleContact(*a, *b)) {
      static_cast<Contact&>(contact) = capsuleContact(*a, *b);
      if (isNear(contact)) keep(contact);
      return;
    }
    if (addMesh(contact)) return;
    fcl::CollisionResult<S> result;
    fcl::collide(a, b, request, result);
    for (std::size_t i = 0; i < result.numContacts(); ++i) {
      const fcl::Contact<S>& found = result.getContact(i);
      // fcl::collide may exchange a shape and a mesh, and copy the mesh.
      const auto* shape_a = a->collisionGeometry().get();
      const bool is_exchanged = found.o2 == shape_a && found.o1 != shape_a;
      const S sign = is_exchanged ? S(-1) : S(1);
      contact.distance = -static_cast<double>(found.penetration_depth);
      const fcl::Vector3<S> normal = sign * found.normal;
      setVector(contact.normal, normal);
      setVector(contact.point_a, found.pos + found.penetration_depth / 2 * normal);
      setVector(contact.point_b, found.pos - found.penetration_depth / 2 * normal);
      contact.s = arcParameter(*a, found.pos);
      contact.t = arcParameter(*b, found.pos);
      keep(contact);
    }
  }

  /// Adds the contacts of a capsule and the triangles of a mesh. Returns false if the pair is
  /// another one.
  bool addMesh(ObjectContact<S>& contact) {
    const FiberManagerOptions& options = manager_.options();
    if (options.report != Report::kCapsules || options.bounds == Bounds::kObjects) return false;
    const bool is_turned = isCapsule(*contact.object_b);
    const Object *capsule = contact.object_a, *mesh = contact.object_b;
    if (is_turned) std::swap(capsule, mesh);
    if (!isCapsule(*capsule) || mesh->getObjectType() != fcl::OT_BVH) return false;
    const Manager& its = is_turned ? manager_ : managerOf(mesh);
    const Manager& owner = its.options().report == Report::kCapsules ? its : manager_;
    if (!owner.findMeshContacts(capsule, mesh, options.margin, mesh_contacts_)) return false;
    for (const MeshContact& found : mesh_contacts_) {
      contact.s = is_turned ? 0 : found.s;
      contact.t = is_turned ? found.s : 0;
      contact.distance = found.distance;
      contact.point_a = is_turned ? found.point_b : found.point_a;
      contact.point_b = is_turned ? found.point_a : found.point_b;
      contact.normal = found.normal;
      if (is_turned) {
        for (double& component : contact.normal) component = -component;
      }
      contact.triangle = found.triangle;
      contact.weights = found.weights;
      contact.solid = found.solid;
      keep(contact);
    }
    return true;
  }

  bool isNear(const ObjectContact<S>& contact) const {
    const FiberManagerOptions& options = manager_.options();
    if (contact.distance <= options.margin) return true;
    if (options.bounds == Bounds::kObjects) return false;
    // Rounding must not drop a pair that the manager has reported.
    if (options.report == Report::kCapsules) return true;
    return contact.distance <= options.margin + manager_.margin(contact.object_a) +
                                   managerOf(contact.object_b).margin(contact.object_b);
  }

  void keep(ObjectContact<S>& contact) {
    if (!manager_.isRegistered(contact.object_a)) {
      throw std::invalid_argument(
          "fcl_fibers: ContactCollector: the first object is not in the collector's manager; "
          "construct the collector with the manager that you query");
    }
    contact.a = manager_.fiberSegment(contact.object_a);
    const Manager& of_b = managerOf(contact.object_b);
    if (of_b.isRegistered(contact.object_b)) contact.b = of_b.fiberSegment(contact.object_b);
    contacts_.push_back(contact);
  }

  static void setVector(std::array<double, 3>& to, const fcl::Vector3<S>& from) {
    for (int axis = 0; axis < 3; ++axis) {
      to[static_cast<std::size_t>(axis)] = static_cast<double>(from[axis]);
    }
  }

  static double arcParameter(const Object& object, const fcl::Vector3<S>& position) {
    if (object.getNodeType() != fcl::GEOM_CAPSULE) return 0;
    const auto& capsule = static_cast<const fcl::Capsule<S>&>(*object.collisionGeometry());
    if (!(capsule.lz > 0)) return 0;
    const S z = (object.getTransform().inverse(Eigen::Isometry) * position)[2];
    return std::clamp(static_cast<double>(z / capsule.lz) + 0.5, 0.0, 1.0);
  }

  const Manager& manager_;
  const Manager* other_;
  std::vector<ObjectContact<S>> contacts_;
  std::vector<MeshContact> mesh_contacts_;
};

}  // namespace fcl_fibers
