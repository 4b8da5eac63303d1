// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/contact.h>

#include "arrays/located_segment.h"
#include "arrays/shapes.h"
#include "arrays/triangle_mesh.h"
#include "fibers/capsule_contact.h"
#include "fibers/mesh_contacts.h"
#include "fibers/options.h"
#include "geometry/moving_segment.h"

namespace fcl_fibers {
namespace {

using arrays::LocatedSegment;
using geometry::MovingSegment;
using geometry::Vec3d;

constexpr char kCall[] = "impactContact";

void checkTime(double time) {
  if (time >= 0 && time <= 1) return;
  fibers::throwInvalidArgument(kCall, "the time is not in [0, 1]; pass an impact that was found");
}

struct LocatedMotion {
  MovingSegment segment;
  FiberSegment place;
};

/// The capsule that starts at point `id`, during the step.
template <typename S>
LocatedMotion locate(const FiberArrays<S>& start, const FiberArrays<S>& end, std::int32_t id) {
  const LocatedSegment from = arrays::locate(kCall, start, id), to = arrays::locate(kCall, end, id);
  return {{from.segment, to.segment}, from.place};
}

/// Relative to a point near by, interpolation costs no digits far from the origin.
MovingSegment relativeTo(const Vec3d& origin, const MovingSegment& s) {
  const geometry::Frame frame{origin, 1};
  return {frame.fromWorld(s.start), frame.fromWorld(s.end)};
}

}  // namespace

template <typename S>
Contact impactContact(const FiberArrays<S>& start, const FiberArrays<S>& end,
                      const Impact& impact) {
  return impactContact(start, end, start, end, impact);
}

template <typename S>
Contact impactContact(const FiberArrays<S>& a_start, const FiberArrays<S>& a_end,
                      const FiberArrays<S>& b_start, const FiberArrays<S>& b_end,
                      const Impact& impact) {
  checkTime(impact.time);
  const LocatedMotion p = locate(a_start, a_end, impact.pair.a);
  const LocatedMotion q = locate(b_start, b_end, impact.pair.b);
  const Vec3d origin = p.segment.start.a;
  Contact contact =
      fibers::contactOf(at(relativeTo(origin, p.segment), impact.time),
                        at(relativeTo(origin, q.segment), impact.time), origin, p.place, q.place);
  contact.pair = impact.pair;
  return contact;
}

template <typename S>
MeshContact impactContact(const FiberArrays<S>& start, const FiberArrays<S>& end,
                          const MeshStep& mesh, const MeshImpact& impact) {
  checkTime(impact.time);
  requireTriangle(kCall, mesh.start, impact.pair.triangle);
  requireTriangle(kCall, mesh.end, impact.pair.triangle);
  const LocatedMotion capsule = locate(start, end, impact.pair.segment);
  const index::PlacedMesh from = MeshReader::placed(mesh.start);
  MeshContact contact = fibers::impactContact(relativeTo(from.pose.shift, capsule.segment),
                                              from.pose.shift, from, MeshReader::placed(mesh.end),
                                              impact.pair.triangle, impact.time, capsule.place);
  contact.segment = impact.pair.segment;
  return contact;
}

template <typename S>
ShapeContact impactContact(const FiberArrays<S>& start, const FiberArrays<S>& end,
                           const Shape& shape, const ShapeImpact& impact) {
  checkTime(impact.time);
  arrays::requireShape(kCall, shape);
  const LocatedMotion capsule = locate(start, end, impact.segment);
  const Vec3d origin = capsule.segment.start.a;
  ShapeContact contact = arrays::shapeContact(at(relativeTo(origin, capsule.segment), impact.time),
                                              origin, capsule.place, shape);
  contact.segment = impact.segment;
  return contact;
}

#define FCL_FIBERS_INSTANTIATE(S)                                                                 \
  template Contact impactContact(const FiberArrays<S>&, const FiberArrays<S>&, const Impact&);    \
  template Contact impactContact(const FiberArrays<S>&, const FiberArrays<S>&,                    \
                                 const FiberArrays<S>&, const FiberArrays<S>&, const Impact&);    \
  template MeshContact impactContact(const FiberArrays<S>&, const FiberArrays<S>&,                \
                                     const MeshStep&, const MeshImpact&);                         \
  template ShapeContact impactContact(const FiberArrays<S>&, const FiberArrays<S>&, const Shape&, \
                                      const ShapeImpact&);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers
