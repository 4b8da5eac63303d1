// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/impact_of_objects.h"

#include <optional>
#include <string>
#include <utility>

#include "broadphase/shape_reach.h"
#include "fibers/mesh_contacts.h"
#include "fibers/public_contact.h"
#include "geometry/impact.h"
#include "geometry/triangle_contact.h"
#include "index/moving_mesh.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::MovingSegment;
using geometry::Segment;
using geometry::Vec3d;

constexpr char kFindImpact[] = "findImpact";

/// In the world's unit, but with the origin of the frame.
MovingSegment inWorldUnit(const MovingSegment& s, const geometry::Frame& frame) {
  const double unit = 1 / frame.scale;
  const auto scaled = [unit](const Segment& segment) {
    return Segment{unit * segment.a, unit * segment.b, unit * segment.radius};
  };
  return {scaled(s.start), scaled(s.end)};
}

/// Adds the time and, of two capsules, the contact.
bool findImpact(const MovingSegment& p, const MovingSegment& q, double margin, double error,
                const geometry::Frame& frame, TimedContact& contact) {
  geometry::Impact impact;
  if (!geometry::findImpact(p, q, margin, error, /*from=*/0, impact)) return false;
  contact.time = impact.time;
  const Segment i = at(inWorldUnit(p, frame), impact.time),
                j = at(inWorldUnit(q, frame), impact.time);
  contact.is_exact = !isBox(p) && !isBox(q) && geometry::contactProblem(i) == nullptr &&
                     geometry::contactProblem(j) == nullptr;
  if (!contact.is_exact) return true;
  static_cast<Contact&>(contact) =
      fibers::publicContact(geometry::capsuleContact(i, j, frame.origin), contact.a, contact.b);
  return true;
}

/// An object of a pair in the manager's frame, during a step.
template <typename S>
struct Partner {
  using Entry = typename Obstacles<S>::BesideEntry;

  MovingSegment segment;  ///< the box of a mesh
  double error = 0;
  std::optional<Entry> mesh;  ///< if its triangles count

  static Partner of(const ManagerState<S>& state, SegmentId id) {
    Partner found;
    if (const Entry* entry = state.obstacles().beside(id)) {
      found.setMesh(*entry);
    } else {
      found.segment = state.generations().moving(id);
    }
    found.error = endPointError(found.segment);
    return found;
  }

  bool findOfOther(const ManagerState<S>& state, const ManagerState<S>& other, SegmentId id,
                   const fcl::CollisionObject<S>& object) {
    const typename ManagerState<S>::QueryScope scope(other, kFindImpact);
    if (const Entry* entry = other.obstacles().beside(id)) {
      const FrameOfOther change(other.generations().frame(), state.generations().frame());
      Entry moved = *entry;
      moved.box = change(entry->box);
      if (other.options().motion) {
        moved.start.box = change(entry->start.box);
      } else {
        moved.start = moved;
      }
      setMesh(moved);
      if (!countsTriangles(state.options())) mesh.reset();
      error = endPointError(segment);
      return true;
    }
    if (other.options().report == Report::kVolumes && isMesh(object)) {
      read(state, object, other.registry().fibers().isSolid(id));
      return true;
    }
    return ReachOfOther<S>(state, other, /*moves=*/true).find(id, segment, error);
  }

  /// Reads an object that rests where it is.
  void read(const ManagerState<S>& state, const fcl::CollisionObject<S>& object,
            bool is_solid = false) {
    const geometry::Frame& frame = state.generations().frame();
    named(kFindImpact, "object b", [&] {
      if (countsTriangles(state.options()) && isMesh(object)) {
        const BesideReading reading =
            readMesh(object, is_solid, frame, state.options().bounds, state.obstacles().cache());
        setMesh(Entry::resting(reading, nullptr, 0, is_solid));
      } else {
        segment.end = requireSegment(object, frame, state.options().bounds);
        segment.start = segment.end;
      }
    });
    error = endPointError(segment);
  }

 private:
  void setMesh(const Entry& entry) {
    segment = entry.movingBox();
    if (entry.countsMovingTriangles()) mesh = entry;
  }
};

/// Sets all of the contact except its places, which stay.
template <typename S>
bool findMeshImpact(const index::MovingMesh& mesh, const Partner<S>& capsule, double margin,
                    TimedContact& contact) {
  const geometry::Frame& frame = mesh.frame();
  index::MeshImpact impact;
  if (!findImpact(mesh, capsule.segment, margin, capsule.error, impact)) return false;
  contact.time = impact.time;
  contact.triangle = impact.triangle;
  const MovingSegment segment = inWorldUnit(capsule.segment, frame);
  contact.is_exact =
      !isBox(segment) && geometry::contactProblem(at(segment, impact.time)) == nullptr;
  if (!contact.is_exact) return true;
  const MeshContact found = fibers::impactContact(segment, frame.origin, mesh.start(), mesh.end(),
                                                  impact.triangle, impact.time, {});
  contact.s = found.s;
  contact.distance = found.distance;
  contact.point_a = found.point_a;
  contact.point_b = found.point_b;
  contact.normal = found.normal;
  return true;
}

/// Makes the contact one of the mesh and the capsule.
void exchange(TimedContact& contact) {
  std::swap(contact.s, contact.t);
  std::swap(contact.point_a, contact.point_b);
  for (double& x : contact.normal) x = -x;
}

}  // namespace

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
  const geometry::Frame& frame = state.generations().frame();
  contact = {};
  contact.a = state.registry().fibers().placeOf(id);
  const Partner<S> p = Partner<S>::of(state, id);
  Partner<S> q;
  const SegmentId its_id = other != nullptr ? other->registry().find(b) : -1;
  const SegmentId own_id = its_id < 0 ? state.registry().find(b) : -1;
  if (own_id >= 0) {
    contact.b = state.registry().fibers().placeOf(own_id);
    q = Partner<S>::of(state, own_id);
  } else if (its_id >= 0) {
    contact.b = other->registry().fibers().placeOf(its_id);
    if (!q.findOfOther(state, *other, its_id, *b)) return false;
  } else {
    q.read(state, *b);
  }
  const double margin = state.generations().margin();
  if (p.mesh.has_value() != q.mesh.has_value()) {
    const bool is_first = p.mesh.has_value();
    const auto mesh = state.movingMesh(is_first ? *p.mesh : *q.mesh);
    if (!findMeshImpact(*mesh, is_first ? q : p, margin, contact)) return false;
    if (is_first && contact.is_exact) exchange(contact);
    return true;
  }
  return findImpact(p.segment, q.segment, margin, p.error + q.error, frame, contact);
}

template bool findImpact(const ManagerState<float>&, const ManagerState<float>*,
                         const fcl::CollisionObject<float>*, const fcl::CollisionObject<float>*,
                         TimedContact&);
template bool findImpact(const ManagerState<double>&, const ManagerState<double>*,
                         const fcl::CollisionObject<double>*, const fcl::CollisionObject<double>*,
                         TimedContact&);

}  // namespace fcl_fibers::broadphase
