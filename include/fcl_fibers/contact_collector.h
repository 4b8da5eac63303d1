// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <stdexcept>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/narrowphase/collision.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_collision_manager.h>

namespace fcl_fibers {

/// The contact of two capsules or spheres at their present poses, without fiber and segment
/// numbers. A sphere is a capsule of length zero.
///
/// Throws std::invalid_argument if one of them is of another shape, or of a pose, radius or length
/// that a fiber manager would refuse.
template <typename S>
FCL_FIBERS_EXPORT Contact capsuleContact(const fcl::CollisionObject<S>& a,
                                         const fcl::CollisionObject<S>& b);

/// @cond
extern template FCL_FIBERS_EXPORT Contact capsuleContact(const fcl::CollisionObject<float>&,
                                                         const fcl::CollisionObject<float>&);
extern template FCL_FIBERS_EXPORT Contact capsuleContact(const fcl::CollisionObject<double>&,
                                                         const fcl::CollisionObject<double>&);
/// @endcond

/// Whether capsuleContact() takes this object.
template <typename S>
bool isCapsule(const fcl::CollisionObject<S>& object) {
  const fcl::NODE_TYPE type = object.getNodeType();
  return type == fcl::GEOM_CAPSULE || type == fcl::GEOM_SPHERE;
}

/// A contact and whose it is.
template <typename S>
struct ObjectContact : Contact {
  fcl::CollisionObject<S>* object_a = nullptr;  ///< the callback's first argument
  fcl::CollisionObject<S>* object_b = nullptr;  ///< its second one
};

/// An FCL callback that keeps the contacts of all touching pairs:
///
///     ContactCollector<double> collector(manager);
///     manager.collide(&collector, collector.callback);
///     for (const auto& contact : collector.contacts()) ...
///
/// A pair of capsules or spheres has one contact if the two are no further apart than the manager's
/// margin and what the program has added to their boxes, see Bounds; under Report::kCapsules also
/// if the manager reports it for a box that counts in the place of a capsule. All other pairs go to
/// `fcl::collide`. They have the contacts that it finds, at most as many as the request admits, and
/// none if they do not touch. FCL's contact normals, positions and depths become those of Contact.
/// The arc parameter of a capsule is where the position is nearest to its axis; it is 0 for any
/// other shape. (With float scenes FCL's narrow phase is compiled into the user's program.)
template <typename S>
class ContactCollector {
 public:
  using Manager = FiberCollisionManager<S>;  ///< whose queries are collected
  using Object = fcl::CollisionObject<S>;    ///< what the manager holds

  /// For all collision queries of a manager, which has to live as long as this. Contact::b is that
  /// of an object of this manager, and 0, 0 of any other.
  explicit ContactCollector(const Manager& manager) : ContactCollector(manager, &manager) {}

  /// For `manager.collide(other, ...)`, with the numbers that `other` has for the second object in
  /// Contact::b. With null it is always 0, 0.
  ContactCollector(const Manager& manager, const Manager* other)
      : manager_(manager), other_(other) {
    request.enable_contact = true;
    request.num_max_contacts = 16;
  }

  /// What fcl::collide is asked for pairs with shapes other than capsules and spheres.
  fcl::CollisionRequest<S> request;

  /// Of all queries since clear(), in the order of their pairs.
  const std::vector<ObjectContact<S>>& contacts() const { return contacts_; }

  /// Forgets the contacts, and keeps their memory for the next query.
  void clear() { contacts_.clear(); }

  /// What `collide` calls; `cdata` is the collector. It never ends the query. Throws
  /// std::invalid_argument as capsuleContact() does, if a capsule has become invalid since the
  /// manager read it, and if the query is not one of the collector's manager.
  static bool callback(Object* a, Object* b, void* cdata) {
    static_cast<ContactCollector*>(cdata)->add(a, b);
    return false;
  }

 private:
  void add(Object* a, Object* b) {
    ObjectContact<S> contact;
    contact.object_a = a;
    contact.object_b = b;
    if (isCapsule(*a) && isCapsule(*b)) {
      static_cast<Contact&>(contact) = capsuleContact(*a, *b);
      if (isNear(contact)) keep(contact);
      return;
    }
    fcl::CollisionResult<S> result;
    fcl::collide(a, b, request, result);
    for (std::size_t i = 0; i < result.numContacts(); ++i) {
      const fcl::Contact<S>& found = result.getContact(i);
      // fcl::collide exchanges a shape and a mesh; a mesh may be a copy of its own.
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

  bool isNear(const ObjectContact<S>& contact) const {
    const FiberManagerOptions& options = manager_.options();
    if (contact.distance <= options.margin) return true;
    if (options.bounds == Bounds::kObjects) return false;
    // What the manager has decided to touch, rounding shall not part again.
    if (options.report == Report::kCapsules) return true;
    const Manager& of_b = other_ != nullptr ? *other_ : manager_;
    return contact.distance <=
           options.margin + manager_.margin(contact.object_a) + of_b.margin(contact.object_b);
  }

  void keep(ObjectContact<S>& contact) {
    if (!manager_.isRegistered(contact.object_a)) {
      throw std::invalid_argument(
          "fcl_fibers: ContactCollector: the first object is not one of the collector's manager; "
          "construct the collector with the manager that is asked");
    }
    contact.a = manager_.fiberSegment(contact.object_a);
    if (other_ != nullptr && other_->isRegistered(contact.object_b)) {
      contact.b = other_->fiberSegment(contact.object_b);
    }
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
};

}  // namespace fcl_fibers
