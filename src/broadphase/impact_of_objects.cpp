// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/impact_of_objects.h"

#include <string>

#include "broadphase/motion_bounds.h"
#include "broadphase/shape_reach.h"
#include "fibers/public_contact.h"
#include "geometry/impact.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::MovingSegment;
using geometry::Segment;
using geometry::Vec3d;

constexpr char kCall[] = "findImpact";

/// The segment at a time, in the world's unit but with the origin of the frame.
Segment at(double time, const MovingSegment& s, const geometry::Frame& frame) {
  const auto now = [&](const auto& start, const auto& end) {
    return (1 / frame.scale) * (start + time * (end - start));
  };
  return {now(s.start.a, s.end.a), now(s.start.b, s.end.b), now(s.start.radius, s.end.radius)};
}

/// Adds the time and, of two capsules, the contact.
bool findImpact(const MovingSegment& p, const MovingSegment& q, double margin, double error,
                const geometry::Frame& frame, TimedContact& contact) {
  geometry::Impact impact;
  if (!geometry::findImpact(p, q, margin, error, /*from=*/0, impact)) return false;
  contact.time = impact.time;
  const Segment i = at(impact.time, p, frame), j = at(impact.time, q, frame);
  contact.is_exact = !isBox(p) && !isBox(q) && geometry::contactProblem(i) == nullptr &&
                     geometry::contactProblem(j) == nullptr;
  if (!contact.is_exact) return true;
  static_cast<Contact&>(contact) =
      fibers::publicContact(geometry::capsuleContact(i, j, frame.origin), contact.a, contact.b);
  return true;
}

}  // namespace

template <typename S>
bool findImpact(const ManagerState<S>& state, const ManagerState<S>* other,
                const fcl::CollisionObject<S>* a, const fcl::CollisionObject<S>* b,
                TimedContact& contact) {
  if (!state.options().motion) {
    fibers::throwInvalidArgument(
        kCall, "the manager has no steps; construct it with FiberManagerOptions::motion");
  }
  if (b == nullptr) fibers::throwInvalidArgument(kCall, "object b is null; pass an object");
  const SegmentId id = state.managedId(kCall, a, "object a");
  const typename ManagerState<S>::QueryScope scope(state, kCall, /*sees_step=*/false);
  const geometry::Frame& frame = state.generations().frame();
  const SegmentId own_id = state.registry().find(b);
  const SegmentId its_id = own_id < 0 && other != nullptr ? other->registry().find(b) : own_id;
  contact = {};
  contact.a = state.registry().fibers().placeOf(id);
  if (state.obstacles().isMesh(id)) return false;
  const MovingSegment p = state.generations().moving(id);
  MovingSegment q;
  double error = 0;
  if (own_id >= 0) {
    contact.b = state.registry().fibers().placeOf(own_id);
    if (state.obstacles().isMesh(own_id)) return false;
    q = state.generations().moving(own_id);
    error = endPointError(q);
  } else if (its_id >= 0) {
    const typename ManagerState<S>::QueryScope its_scope(*other, kCall, /*sees_step=*/false);
    contact.b = other->registry().fibers().placeOf(its_id);
    if (other->obstacles().isMesh(its_id)) return false;
    const ReachOfOther<S> reach(state, *other, /*moves=*/true);
    if (!reach.find(its_id, q, error)) return false;
  } else {
    if (countsTriangles(state.options()) && isMesh(*b)) return false;
    q.end = readObject(kCall, *b, frame, state.options().bounds,
                       [] { return std::string("object b"); });
    q.start = q.end;
    error = endPointError(q);
  }
  return findImpact(p, q, state.generations().margin(), endPointError(p) + error, frame, contact);
}

template <typename S>
bool findImpact(const ContinuousState<S>& state, const ContinuousState<S>* other,
                const fcl::ContinuousCollisionObject<S>* a,
                const fcl::ContinuousCollisionObject<S>* b, TimedContact& contact) {
  using Scope = typename ContinuousState<S>::QueryScope;
  if (b == nullptr) fibers::throwInvalidArgument(kCall, "object b is null; pass an object");
  const SegmentId id = state.managedId(kCall, a, "object a");
  const Scope scope(state, kCall);
  contact = {};
  const auto moving = [](const ContinuousState<S>& owner, SegmentId of, FiberSegment& place) {
    place = owner.registry().fibers().placeOf(of);
    return owner.index().moving()[static_cast<std::size_t>(of)];
  };
  const MovingSegment p = state.index().inFrame(moving(state, id, contact.a));
  MovingSegment q;
  if (const SegmentId own_id = state.registry().find(b); own_id >= 0) {
    q = moving(state, own_id, contact.b);
  } else if (const SegmentId its_id = other == nullptr ? own_id : other->registry().find(b);
             its_id >= 0) {
    const Scope its_scope(*other, kCall);
    q = moving(*other, its_id, contact.b);
  } else {
    q = readMoving(kCall, *b, [] { return std::string("object b"); });
  }
  q = state.index().inFrame(q);
  const double margin = state.options().margin * state.frame().scale;
  return findImpact(p, q, margin, endPointError(p) + endPointError(q), state.frame(), contact);
}

#define FCL_FIBERS_INSTANTIATE(S)                                                          \
  template bool findImpact(const ManagerState<S>&, const ManagerState<S>*,                 \
                           const fcl::CollisionObject<S>*, const fcl::CollisionObject<S>*, \
                           TimedContact&);                                                 \
  template bool findImpact(const ContinuousState<S>&, const ContinuousState<S>*,           \
                           const fcl::ContinuousCollisionObject<S>*,                       \
                           const fcl::ContinuousCollisionObject<S>*, TimedContact&);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::broadphase
