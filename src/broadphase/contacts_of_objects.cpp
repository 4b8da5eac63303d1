// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/contact_collector.h>

#include "broadphase/manager_query.h"
#include "broadphase/object_reader.h"
#include "broadphase/scene.h"
#include "fibers/capsule_contact.h"
#include "fibers/mesh_contacts.h"
#include "geometry/impact.h"
#include "geometry/obstacle_contact.h"
#include "geometry/triangle_contact.h"
#include "index/posed_mesh.h"
#include "joined_text.h"

namespace fcl_fibers {
namespace broadphase {
namespace {

using geometry::Frame;
using geometry::MovingSegment;
using geometry::Segment;

constexpr char kMeshContacts[] = "findMeshContacts";
constexpr char kFindImpact[] = "findImpact";

/// Reads a capsule or sphere as it is now. Throws std::invalid_argument if it has no contact.
template <typename S>
Segment readCapsule(const char* call, const fcl::CollisionObject<S>& object, const Frame& frame,
                    const char* name, const char* remedy) {
  const Segment segment =
      named(call, name, [&] { return requireSegment(object, frame, Bounds::kShapes); });
  if (segment.isBox()) {
    fibers::throwInvalidArgument(
        call, joinedText(name, ": it is neither a capsule nor a sphere; ", remedy));
  }
  if (const char* problem = fibers::contactProblem(segment)) {
    fibers::throwInvalidArgument(call, joinedText(name, ": ", problem));
  }
  return segment;
}

/// Reads a box, plane, half-space or triangle as it is now.
template <typename S>
geometry::Obstacle readObstacle(const char* call, const fcl::CollisionObject<S>& object,
                                const Frame& frame, const char* name) {
  const ReadObject read = readObject(object, Bounds::kShapes);
  const char* problem = read.problem;
  const geometry::Obstacle obstacle = obstacleOf(read, frame);
  double largest = std::max(maxNorm(obstacle.point), std::fabs(obstacle.offset));
  for (const geometry::Vec3d& v : obstacle.vector) largest = std::max(largest, maxNorm(v));
  constexpr double kLargest = 0x1p1000;
  if (problem == nullptr &&
      !(obstacle.kind != geometry::Obstacle::Kind::kNone && largest <= kLargest)) {
    problem =
        "a coordinate or size is NaN or beyond 2^1000, or its normal is 0; give it smaller, "
        "finite numbers and a normal";
  }
  if (problem != nullptr) fibers::throwInvalidArgument(call, joinedText(name, ": ", problem));
  return obstacle;
}

/// The same contact with the shapes in the other order.
void swapShapes(Contact& contact) {
  std::swap(contact.s, contact.t);
  std::swap(contact.point_a, contact.point_b);
  for (double& x : contact.normal) x = -x;
}

/// In the world's unit, but with the origin of the frame.
MovingSegment inWorldUnit(const MovingSegment& s, const Frame& frame) {
  const double unit = 1 / frame.scale;
  const auto scaled = [unit](const Segment& segment) {
    return Segment{unit * segment.a, unit * segment.b, unit * segment.radius};
  };
  return {scaled(s.start), scaled(s.end)};
}

}  // namespace

template <typename S>
bool findMeshContacts(const ManagerState<S>& state, const fcl::CollisionObject<S>* capsule,
                      const fcl::CollisionObject<S>* mesh, double margin,
                      std::vector<MeshContact>& contacts) {
  if (capsule == nullptr || mesh == nullptr) {
    fibers::throwInvalidArgument(kMeshContacts, "an object is null; pass a capsule and a mesh");
  }
  if (!isMesh(*mesh)) {
    fibers::throwInvalidArgument(kMeshContacts,
                                 "the second object is no mesh; pass an fcl::BVHModel");
  }
  if (!(margin >= 0)) {
    fibers::throwInvalidArgument(kMeshContacts,
                                 joinedText("margin is ", margin, "; give 0 or more"));
  }
  BesideReading reading;
  named(kMeshContacts, "the mesh", [&] {
    reading.mesh = state.knownMesh(*mesh);
    requireSegment(*mesh, Frame{}, Bounds::kShapes);  // it may have become invalid
    if (reading.mesh == nullptr) {
      reading = readBeside(*mesh, false, Frame{}, Bounds::kShapes, &state.obstacles().cache());
    }
  });
  if (reading.mesh == nullptr) {
    contacts.clear();
    return false;
  }
  reading.object = readObject(*mesh, state.options().bounds, &reading.mesh->bounds());
  const SegmentId mesh_id = state.registry().find(mesh);
  const bool is_solid =
      mesh_id != ObjectRegistry<S>::kNotFound && state.registry().fibers().isSolid(mesh_id);
  const fibers::MeshContacts contact_of(reading.placed(tree::kAllCategories, is_solid));
  const Segment segment =
      readCapsule(kMeshContacts, *capsule, contact_of.frame(), "the capsule", "pass one");
  const ReadObject read = readObject(*capsule, state.options().bounds);
  Segment counted;
  if (const char* problem = segmentOf(read, contact_of.frame(), counted)) {
    fibers::throwInvalidArgument(kMeshContacts, joinedText("the capsule: ", problem));
  }
  if (!counted.isBox()) {
    margin += counted.radius - segment.radius;
  } else if (const geometry::Obstacle in_box = obstacleOf(read, contact_of.frame());
             in_box.kind != geometry::Obstacle::Kind::kNone) {
    margin += in_box.margin - segment.radius;
  }
  std::vector<index::TriangleId> triangles;
  contact_of.findTriangles(segment, margin + reading.object.added.margin, triangles);
  const SegmentId capsule_id = state.registry().find(capsule);
  FiberSegment place;
  if (capsule_id != ObjectRegistry<S>::kNotFound) {
    place = state.registry().fibers().placeOf(capsule_id);
  }
  contacts.clear();
  for (const index::TriangleId triangle : triangles) {
    contacts.push_back(contact_of(segment, place, triangle));
  }
  return true;
}

template <typename S>
bool findImpact(const ManagerState<S>& state, const ManagerState<S>* other,
                const fcl::CollisionObject<S>* a, const fcl::CollisionObject<S>* b,
                TimedContact& contact) {
  if (!state.options().motion) {
    fibers::throwInvalidArgument(
        kFindImpact, "the manager has no steps; construct it with FiberManagerOptions::motion");
  }
  if (b == nullptr) fibers::throwInvalidArgument(kFindImpact, "object b is null; pass an object");
  const SegmentId id = state.managedId(kFindImpact, a, "object a");
  const typename ManagerState<S>::QueryScope scope(state, kFindImpact);
  const Frame& frame = state.generations().frame();
  contact = {};
  contact.a = state.registry().fibers().placeOf(id);
  const Scene<S> own(kFindImpact, state, state, /*moves=*/true);
  constexpr SegmentId kNone = ObjectRegistry<S>::kNotFound;
  // An object of both managers is the other one's.
  const bool is_others = other != nullptr && other->registry().find(b) != kNone;
  const ManagerState<S>& its = is_others ? *other : state;
  const typename ManagerState<S>::QueryScope its_scope(its, kFindImpact);
  const Scene<S> theirs(kFindImpact, its, state, /*moves=*/true);
  const SegmentId its_id = its.registry().find(b);
  if (its_id != kNone) contact.b = its.registry().fibers().placeOf(its_id);
  Partner<S> p, q;
  const bool are_found = named(kFindImpact, "object b", [&] {
    if (its_id == kNone) q = own.readNow(*b, its_id);
    return own.find(id, p) && (its_id == kNone || theirs.find(its_id, q));
  });
  if (!are_found) return false;
  const double margin = state.generations().margin();
  // A mesh is the second.
  const bool swaps = p.mesh != nullptr && q.mesh == nullptr;
  if (swaps) std::swap(p, q);
  const bool has_mesh = p.mesh == nullptr && q.mesh != nullptr;
  if (has_mesh) {
    index::MeshImpact impact;
    if (!findImpact(*state.movingMesh(*q.mesh), p.segment, margin, p.error, impact)) return false;
    contact.time = impact.time;
    contact.triangle = impact.triangle;
  } else {
    geometry::Impact impact;
    const double error = p.error + q.error;
    if (!findImpact(p.segment, q.segment, margin, error, /*from=*/0, impact)) return false;
    contact.time = impact.time;
  }
  const MovingSegment i = inWorldUnit(p.segment, frame), j = inWorldUnit(q.segment, frame);
  const auto isExact = [&](const MovingSegment& s) {
    return !isBox(s) && fibers::contactProblem(at(s, contact.time)) == nullptr;
  };
  contact.is_exact = isExact(i) && (has_mesh || isExact(j));
  if (!contact.is_exact) return true;
  if (has_mesh) {
    const auto mesh = state.movingMesh(*q.mesh);
    const MeshContact found =
        fibers::impactContact(i, frame.origin, mesh->start().placed(), mesh->end().placed(),
                              contact.triangle, contact.time, {});
    contact.s = found.s;
    contact.distance = found.distance;
    contact.point_a = found.point_a;
    contact.point_b = found.point_b;
    contact.normal = found.normal;
  } else {
    static_cast<Contact&>(contact) = fibers::contactOf(at(i, contact.time), at(j, contact.time),
                                                       frame.origin, contact.a, contact.b);
  }
  if (swaps) swapShapes(contact);
  return true;
}

}  // namespace broadphase

template <typename S>
Contact capsuleContact(const fcl::CollisionObject<S>& a, const fcl::CollisionObject<S>& b) {
  constexpr char kCall[] = "capsuleContact", kOther[] = "pass it to fcl::collide";
  // The capsule is the first.
  const bool swaps = !isCapsule(a) && isCapsule(b);
  const fcl::CollisionObject<S>&first = swaps ? b : a, &second = swaps ? a : b;
  const char *first_name = swaps ? "object b" : "object a", *name = swaps ? "object a" : "object b";
  // Its position is the origin, so no digits are lost far from the world's origin.
  geometry::Frame frame;
  frame.origin = broadphase::toVec3(first.getTransform().matrix().col(3));
  const auto p = broadphase::readCapsule(kCall, first, frame, first_name, kOther);
  if (isCapsule(second) || !hasCapsuleContact(first, second)) {
    const auto q = broadphase::readCapsule(kCall, second, frame, name, kOther);
    return fibers::contactOf(p, q, frame.origin);
  }
  const geometry::ObstacleContact found = geometry::obstacleContact(
      p, broadphase::readObstacle(kCall, second, frame, name), frame.origin);
  const auto toArray = [](const geometry::Vec3d& v) { return std::array{v.x, v.y, v.z}; };
  Contact contact;
  contact.s = found.s;
  contact.distance = found.distance;
  contact.point_a = toArray(found.point_a);
  contact.point_b = toArray(found.point_b);
  contact.normal = toArray(found.normal);
  if (swaps) broadphase::swapShapes(contact);
  return contact;
}

#define FCL_FIBERS_INSTANTIATE(S)                                                                  \
  template Contact capsuleContact(const fcl::CollisionObject<S>&, const fcl::CollisionObject<S>&); \
  template bool broadphase::findMeshContacts(                                                      \
      const broadphase::ManagerState<S>&, const fcl::CollisionObject<S>*,                          \
      const fcl::CollisionObject<S>*, double, std::vector<MeshContact>&);                          \
  template bool broadphase::findImpact(                                                            \
      const broadphase::ManagerState<S>&, const broadphase::ManagerState<S>*,                      \
      const fcl::CollisionObject<S>*, const fcl::CollisionObject<S>*, TimedContact&);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers
