// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/scene.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "broadphase/object_reader.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::MovingSegment;
using geometry::Obstacle;
using geometry::Segment;

bool capsuleTouches(const MovingSegment& capsule, double error, const MovingShape& shape,
                    double reach) {
  // The boxes of both overlap at some time, and that is all that counts if a shape turns.
  if (isBox(capsule) || !shape.is_moved_only) return true;
  // The capsule as seen from the shape.
  MovingSegment seen = capsule;
  seen.start.a = seen.start.a + shape.way;
  seen.start.b = seen.start.b + shape.way;
  return touch(seen, shape.end, reach, error + shape.way_error);
}

/// A capsule in a box and another shape.
bool axisTouches(const MovingShape& axis, const MovingShape& shape, double reach) {
  if (axis.end.kind != Obstacle::Kind::kAxis || !axis.is_moved_only) return true;
  MovingSegment capsule{axis.end.capsule(), axis.end.capsule()};
  capsule.start.a = capsule.start.a - axis.way;
  capsule.start.b = capsule.start.b - axis.way;
  return capsuleTouches(capsule, axis.end.error + axis.way_error, shape, reach);
}

bool isMovedOnly(const Obstacle& p, const Obstacle& q) {
  return p.kind == q.kind && p.vector[0] == q.vector[0] && p.vector[1] == q.vector[1] &&
         p.vector[2] == q.vector[2] && p.offset == q.offset && p.margin == q.margin &&
         p.vertices == q.vertices;
}

}  // namespace

template <typename S>
Scene<S>::Scene(const char* call, const State& state, const State& asked, bool moves)
    : call_(call),
      state_(state),
      asked_(asked),
      source_(state.source(call)),
      change_(state.frame(), asked.frame()),
      is_own_(&state == &asked),
      moves_(moves),
      counts_shapes_(countsTriangles(asked.options())),
      has_shapes_in_tree_(counts_shapes_ &&
                          (!countsTriangles(state.options()) || state.generations().hasBoxes())),
      has_capsules_in_tree_(!countsTriangles(state.options()) || state.generations().hasCapsules()),
      has_meshes_in_tree_(counts_shapes_ && state.options().report == Report::kVolumes &&
                          state.options().bounds != Bounds::kObjects) {}

template <typename S>
bool Scene<S>::find(SegmentId id, Partner<S>& partner) const {
  const Object& object = *state_.registry()[id];
  const BesideEntry* entry = state_.obstacles().beside(id);
  if (entry != nullptr || isMeshInTree(object)) {
    partner = entry != nullptr ? partnerOf(*entry) : readNow(object, id);
    return true;
  }
  partner.id = id;
  MovingSegment& segment = partner.segment;
  if (!state_.generations().keepsSegments()) {
    if (!source_.readNow(id, frame(), segment.end)) return false;
    segment.start = segment.end;
    partner.error = endPointError(segment);
    return true;
  }
  segment = state_.generations().moving(id);
  if (!moves_) segment.start = segment.end;
  if (is_own_) {
    partner.error = endPointError(segment);
  } else {
    segment = {inThisFrame(segment.start), inThisFrame(segment.end)};
    partner.error = std::max(change_.error(segment.start), change_.error(segment.end));
  }
  return true;
}

template <typename S>
Partner<S> Scene<S>::partnerOf(const BesideEntry& entry) const {
  Partner<S> partner;
  partner.id = entry.id;
  const auto here = [&](const Segment& box) { return is_own_ ? box : inThisFrame(box); };
  partner.segment.end = here(entry.end.box);
  partner.segment.start = hasSteps() ? here(entry.start.box) : partner.segment.end;
  partner.error = endPointError(partner.segment);
  if (!entry.is_mesh) return partner;
  partner.shape.emplace();
  const std::shared_ptr<const BesideEntry> borrowed(std::shared_ptr<void>(), &entry);
  if (!counts_shapes_) return partner;
  if (hasSteps()) {
    if (withTriangles(entry).hasMovingTriangles()) partner.mesh = borrowed;
  } else if (moves_) {
    BesideEntry resting = withTriangles(entry);
    resting.start = resting.end;
    if (resting.end.hasTriangles()) {
      partner.mesh = std::make_shared<const BesideEntry>(std::move(resting));
    }
  } else if (entry.comparesOnDemand(state_.options()) || entry.end.hasTriangles()) {
    partner.mesh = borrowed;
  }
  return partner;
}

template <typename S>
auto Scene<S>::withTriangles(const BesideEntry& mesh) const -> const BesideEntry& {
  if (mesh.object == nullptr) return mesh;  // it was read for this query
  const BesideEntry& read = *named(
      call_, [&](SegmentId id) { return source_.nameOf(id); },
      [&] { return &state_.obstacles().withTriangles(mesh, state_.frame()); });
  // A contact of this pair is asked for by the means of the manager that is asked.
  if (!is_own_ && read.end.mesh != nullptr) {
    asked_.obstacles().cache().keep(read.object->collisionGeometry(), read.end.mesh);
  }
  return read;
}

template <typename S>
const index::PosedMesh* Scene<S>::posed(const Partner<S>& mesh) const {
  if (!mesh.triangles) {
    const BesideEntry& read = withTriangles(*mesh.mesh);
    mesh.triangles.emplace();
    if (read.end.hasTriangles()) {
      *mesh.triangles = std::make_shared<const index::PosedMesh>(read.placed(), frame());
    }
  }
  return mesh.triangles->get();
}

template <typename S>
Partner<S> Scene<S>::readNow(const Object& object, SegmentId id) const {
  const Bounds bounds = state_.options().bounds;
  Partner<S> partner;
  partner.id = id;
  Segment& now = partner.segment.end;
  // Capsules have code of their own, which is quick. A refused one is refused below.
  const bool is_capsule = isRound(kindOf(object)) &&
                          readSegment(object, frame(), bounds, now) == nullptr && !now.isBox();
  if (!is_capsule) {
    BesideEntry entry;
    if (id != ObjectRegistry<S>::kNotFound) {
      const auto party = state_.registry().fibers().partyOf(id);
      entry.is_solid = state_.registry().fibers().isSolid(id);
      entry.is_rigid = state_.registry().fibers().isRigid(id);
      if (party.is_obstacle) entry.categories = party.categories;
    }
    entry.end =
        readBeside(object, entry.is_solid, frame(), bounds,
                   counts_shapes_ ? &asked_.obstacles().cache() : nullptr, /*place=*/0,
                   entry.is_rigid ? MeshCache::IsSame::kAlways : MeshCache::IsSame::kIfEqual);
    now = entry.end.box;
    MovingShape& shape = partner.shape.emplace();
    if (counts_shapes_ && entry.end.hasTriangles()) {
      entry.start = entry.end;
      entry.forgetTrees();
      partner.mesh = std::make_shared<const BesideEntry>(std::move(entry));
    } else if (counts_shapes_ && !isMesh(object)) {
      shape.end = obstacleOf(entry.end.object, frame());
    }
  }
  partner.segment.start = now;
  partner.error = endPointError(partner.segment);
  return partner;
}

template <typename S>
Partner<S> Scene<S>::ofProgram(const Object& object) const {
  const SegmentId id = state_.registry().find(&object);
  const bool is_managed = id != ObjectRegistry<S>::kNotFound;
  const BesideEntry* entry = is_managed ? state_.obstacles().beside(id) : nullptr;
  const bool was_mesh = entry != nullptr && entry->is_mesh;
  if (!is_managed || !moves_ || was_mesh != (counts_shapes_ && isMesh(object))) {
    return readNow(object, id);
  }
  Partner<S> partner;
  find(id, partner);
  return partner;
}

template <typename S>
void Scene<S>::readShape(const Partner<S>& partner, MovingShape& shape) const {
  if (!counts_shapes_ || !partner.segment.end.isBox()) return;
  const FiberManagerOptions& options = state_.options();
  const Object& object = *state_.registry()[partner.id];
  if (!countsTriangles(options)) {
    // What counts by its volume there is read again.
    if (options.bounds != Bounds::kObjects) {
      shape.end = obstacleOf(readObject(object, options.bounds), frame());
    }
  } else if (options.motion) {
    const auto* entry = state_.obstacles().shape(partner.id);
    // What has become another kind of shape counts by its box.
    if (entry == nullptr) return;
    shape.end = inFrame(change_, entry->shape);
    if (hasSteps()) {
      shape.way = frame().scale * (entry->end.point - entry->start.point);
      shape.way_error = frame().scale * (entry->start.error + entry->end.error);
      shape.is_moved_only = isMovedOnly(entry->start, entry->end);
    }
  } else if (const auto* entry = state_.obstacles().beside(partner.id)) {
    shape.end = inFrame(change_, entry->shape);
  } else {
    const auto readNow = [&](const Obstacle& before) {
      const ReadObject read = readObject(object, options.bounds);
      Segment now;
      const bool is_proper = segmentOf(read, state_.frame(), now, /*marks_boxes=*/true) == nullptr;
      // If it has moved since the update, it is not known where its shape was. A plane that is here
      // because it was another shape may have moved without a trace in its box.
      return is_proper && read.kind != ObjectKind::kUnbounded &&
                     now == state_.generations().segment(partner.id)
                 ? obstacleOf(read, state_.frame(), before.vertices)
                 : Obstacle();
    };
    shape.end = inFrame(change_, state_.obstacles().shapeOnDemand(partner.id, readNow));
  }
}

template <typename S>
bool Scene<S>::mayTouch(const Partner<S>& p, const Partner<S>& q, const Scene& others,
                        double reach) const {
  // Lengths this large are as good as infinite; sums with them do not overflow.
  if (!counts_shapes_ || !(reach < 0x1p500)) return true;
  if (p.mesh != nullptr || q.mesh != nullptr) {
    if (p.mesh != nullptr && q.mesh != nullptr) return true;
    const auto& [mesh, other] = p.mesh != nullptr ? std::tie(p, q) : std::tie(q, p);
    if (!moves_) {
      const index::PosedMesh* posed = (p.mesh != nullptr ? *this : others).posed(mesh);
      return posed == nullptr || touches(*posed, other.segment.end, reach, other.error);
    }
    index::MeshImpact impact;
    return findImpact(*asked_.movingMesh(*mesh.mesh), other.segment, reach, other.error, impact);
  }
  const Segment &i = p.segment.end, &j = q.segment.end;
  if (!i.isBox() && !j.isBox()) return true;
  if (!j.isBox()) return capsuleTouches(q.segment, q.error, shapeOf(p), reach);
  if (!i.isBox()) return capsuleTouches(p.segment, p.error, others.shapeOf(q), reach);
  if (!i.isOtherBox()) return axisTouches(shapeOf(p), others.shapeOf(q), reach);
  return j.isOtherBox() || axisTouches(others.shapeOf(q), shapeOf(p), reach);
}

template class Scene<float>;
template class Scene<double>;

}  // namespace fcl_fibers::broadphase
