// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/contact.h>

#include "arrays/located_segment.h"
#include "arrays/triangle_mesh.h"
#include "fibers/mesh_contacts.h"
#include "fibers/options.h"
#include "fibers/public_contact.h"
#include "geometry/triangle_contact.h"
#include "index/posed_triangles.h"

namespace fcl_fibers {
namespace {

using arrays::LocatedSegment;
using geometry::Segment;
using geometry::Triangle;
using geometry::Vec3d;

constexpr char kCall[] = "impactContact";

void checkTime(double time) {
  if (time >= 0 && time <= 1) return;
  fibers::throwInvalidArgument(kCall, "the time is not in [0, 1]; pass an impact that was found");
}

Vec3d between(const Vec3d& start, const Vec3d& end, double time) {
  return (1 - time) * start + time * end;
}

/// The capsule that starts at point `id`, at a time of the step.
template <typename S>
LocatedSegment locate(const FiberArrays<S>& start, const FiberArrays<S>& end, std::int32_t id,
                      double time) {
  const LocatedSegment from = arrays::locate(kCall, start, id), to = arrays::locate(kCall, end, id);
  const Segment &p = from.segment, &q = to.segment;
  return {
      {between(p.a, q.a, time), between(p.b, q.b, time), (1 - time) * p.radius + time * q.radius},
      from.place};
}

template <typename S>
Contact contactOf(const FiberArrays<S>& a_start, const FiberArrays<S>& a_end,
                  const FiberArrays<S>& b_start, const FiberArrays<S>& b_end,
                  const Impact& impact) {
  checkTime(impact.time);
  const LocatedSegment p = locate(a_start, a_end, impact.pair.a, impact.time);
  const LocatedSegment q = locate(b_start, b_end, impact.pair.b, impact.time);
  return fibers::publicContact(geometry::capsuleContact(p.segment, q.segment, {0, 0, 0}), p.place,
                               q.place);
}

template <typename S>
MeshContact contactOf(const FiberArrays<S>& start, const FiberArrays<S>& end,
                      const TriangleMesh& mesh_start, const TriangleMesh& mesh_end,
                      const MeshImpact& impact) {
  checkTime(impact.time);
  requireTriangle(kCall, mesh_start, impact.pair.triangle);
  requireTriangle(kCall, mesh_end, impact.pair.triangle);
  // What touches at the start may be inside a solid. What touches later comes from outside.
  if (impact.time == 0) return meshContact(start, mesh_start, impact.pair);
  const geometry::Frame frame{MeshReader::posed(mesh_end).pose.shift, 1};
  const LocatedSegment capsule = locate(start, end, impact.pair.segment, impact.time);
  const auto triangleOf = [&](const TriangleMesh& mesh) {
    return index::PosedTriangles(MeshReader::posed(mesh), frame)[impact.pair.triangle];
  };
  const Triangle from = triangleOf(mesh_start), to = triangleOf(mesh_end);
  const Triangle triangle{between(from.a, to.a, impact.time), between(from.b, to.b, impact.time),
                          between(from.c, to.c, impact.time)};
  const Segment local{frame.fromWorld(capsule.segment.a), frame.fromWorld(capsule.segment.b),
                      capsule.segment.radius};
  return fibers::publicContact(geometry::triangleContact(local, triangle, frame.origin),
                               capsule.place, impact.pair.triangle, /*is_inside=*/false);
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
