// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/contact.h>

#include "arrays/located_segment.h"
#include "arrays/triangle_mesh.h"
#include "fibers/mesh_contacts.h"
#include "fibers/options.h"
#include "fibers/public_contact.h"
#include "geometry/moving_segment.h"

namespace fcl_fibers {
namespace {

using arrays::LocatedSegment;
using geometry::MovingSegment;
using geometry::Segment;
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
  const auto moved = [&](const Segment& segment) {
    return Segment{frame.fromWorld(segment.a), frame.fromWorld(segment.b), segment.radius};
  };
  return {moved(s.start), moved(s.end)};
}

template <typename S>
Contact contactOf(const FiberArrays<S>& a_start, const FiberArrays<S>& a_end,
                  const FiberArrays<S>& b_start, const FiberArrays<S>& b_end,
                  const Impact& impact) {
  checkTime(impact.time);
  const LocatedMotion p = locate(a_start, a_end, impact.pair.a);
  const LocatedMotion q = locate(b_start, b_end, impact.pair.b);
  const Vec3d origin = p.segment.start.a;
  return fibers::publicContact(
      geometry::capsuleContact(at(relativeTo(origin, p.segment), impact.time),
                               at(relativeTo(origin, q.segment), impact.time), origin),
      p.place, q.place);
}

template <typename S>
MeshContact contactOf(const FiberArrays<S>& start, const FiberArrays<S>& end,
                      const TriangleMesh& mesh_start, const TriangleMesh& mesh_end,
                      const MeshImpact& impact) {
  checkTime(impact.time);
  requireTriangle(kCall, mesh_start, impact.pair.triangle);
  requireTriangle(kCall, mesh_end, impact.pair.triangle);
  const LocatedMotion capsule = locate(start, end, impact.pair.segment);
  const Vec3d origin = MeshReader::posed(mesh_start).pose.shift;
  return fibers::impactContact(relativeTo(origin, capsule.segment), origin,
                               MeshReader::posed(mesh_start), MeshReader::posed(mesh_end),
                               impact.pair.triangle, impact.time, capsule.place);
}

}  // namespace

Contact impactContact(const FiberArrays<float>& start, const FiberArrays<float>& end,
                      const Impact& impact) {
  return contactOf(start, end, start, end, impact);
}
Contact impactContact(const FiberArrays<float>& a_start, const FiberArrays<float>& a_end,
                      const FiberArrays<float>& b_start, const FiberArrays<float>& b_end,
                      const Impact& impact) {
  return contactOf(a_start, a_end, b_start, b_end, impact);
}
Contact impactContact(const FiberArrays<double>& start, const FiberArrays<double>& end,
                      const Impact& impact) {
  return contactOf(start, end, start, end, impact);
}
Contact impactContact(const FiberArrays<double>& a_start, const FiberArrays<double>& a_end,
                      const FiberArrays<double>& b_start, const FiberArrays<double>& b_end,
                      const Impact& impact) {
  return contactOf(a_start, a_end, b_start, b_end, impact);
}
MeshContact impactContact(const FiberArrays<float>& start, const FiberArrays<float>& end,
                          const TriangleMesh& mesh_start, const TriangleMesh& mesh_end,
                          const MeshImpact& impact) {
  return contactOf(start, end, mesh_start, mesh_end, impact);
}
MeshContact impactContact(const FiberArrays<double>& start, const FiberArrays<double>& end,
                          const TriangleMesh& mesh_start, const TriangleMesh& mesh_end,
                          const MeshImpact& impact) {
  return contactOf(start, end, mesh_start, mesh_end, impact);
}

}  // namespace fcl_fibers
