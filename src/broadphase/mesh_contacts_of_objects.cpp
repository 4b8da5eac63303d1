// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/mesh_contacts_of_objects.h"

#include <memory>
#include <string>

#include "broadphase/object_reader.h"
#include "fibers/mesh_contacts.h"
#include "geometry/contact.h"
#include "joined_text.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Frame;
using geometry::Segment;

constexpr const char* kCall = "findMeshContacts";

template <typename S>
Segment readCapsule(const fcl::CollisionObject<S>& capsule, const Frame& frame, Bounds bounds) {
  return named(kCall, "the capsule", [&] { return requireSegment(capsule, frame, bounds); });
}

}  // namespace

template <typename S>
bool findMeshContacts(const ManagerState<S>& state, const fcl::CollisionObject<S>* capsule,
                      const fcl::CollisionObject<S>* mesh, double margin,
                      std::vector<MeshContact>& contacts) {
  if (capsule == nullptr || mesh == nullptr) {
    fibers::throwInvalidArgument(kCall, "an object is null; pass a capsule and a mesh");
  }
  if (!isMesh(*mesh)) {
    fibers::throwInvalidArgument(kCall, "the second object is no mesh; pass an fcl::BVHModel");
  }
  if (!(margin >= 0)) {
    fibers::throwInvalidArgument(kCall, joinedText("margin is ", margin, "; give 0 or more"));
  }
  const auto entry = state.readMeshOf(mesh);
  BesideReading reading;
  if (entry) reading.mesh = entry->mesh;
  MeshCache& cache = state.obstacles().cache();
  if (reading.mesh == nullptr) reading.mesh = cache.find(mesh->collisionGeometry());
  named(kCall, "the mesh", [&] {
    requireSegment(*mesh, Frame{}, Bounds::kShapes);  // it may have become invalid
    if (reading.mesh == nullptr) reading = readMesh(*mesh, false, Frame{}, Bounds::kShapes, cache);
  });
  if (reading.mesh == nullptr) {
    contacts.clear();
    return false;
  }
  placeMesh(*mesh, Frame{}, state.options().bounds, reading);
  const SegmentId mesh_id = state.registry().find(mesh);
  const bool is_solid =
      mesh_id != ObjectRegistry<S>::kNotFound && state.registry().fibers().isSolid(mesh_id);
  const fibers::MeshContacts contact_of(reading.posed(tree::kAllCategories, is_solid));
  const Segment segment = readCapsule(*capsule, contact_of.frame(), Bounds::kShapes),
                counted = readCapsule(*capsule, contact_of.frame(), state.options().bounds);
  const char* problem = segment.isBox() ? "it is neither a capsule nor a sphere; pass one"
                                        : geometry::contactProblem(segment);
  if (problem != nullptr) {
    fibers::throwInvalidArgument(kCall, std::string("the capsule: ") + problem);
  }
  if (!counted.isBox()) {
    margin += counted.radius - segment.radius;
  } else if (const geometry::Obstacle in_box =
                 obstacleOf(readObject(*capsule, state.options().bounds), contact_of.frame());
             in_box.kind != geometry::Obstacle::Kind::kNone) {
    margin += in_box.margin - segment.radius;
  }
  std::vector<index::TriangleId> triangles;
  contact_of.findTriangles(segment, margin + reading.margin, triangles);
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

template bool findMeshContacts(const ManagerState<float>&, const fcl::CollisionObject<float>*,
                               const fcl::CollisionObject<float>*, double,
                               std::vector<MeshContact>&);
template bool findMeshContacts(const ManagerState<double>&, const fcl::CollisionObject<double>*,
                               const fcl::CollisionObject<double>*, double,
                               std::vector<MeshContact>&);

}  // namespace fcl_fibers::broadphase
