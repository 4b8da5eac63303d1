// SPDX-License-Identifier: BSD-3-Clause
#include "fibers/mesh_contacts.h"

#include <algorithm>
#include <array>
#include <limits>

#include "geometry/touch.h"
#include "geometry/triangle_contact.h"
#include "geometry/triangle_distance.h"
#include "tree/search.h"

namespace fcl_fibers::fibers {
namespace {

using geometry::Segment;
using geometry::Triangle;
using geometry::TriangleContact;
using geometry::Vec3d;

/// Turns the contact of a capsule that is inside a solid into one that moves it out.
void moveOut(const Segment& capsule, const Triangle& triangle, TriangleContact& contact) {
  // A triangle without area has no normal. Then the way to its closest point leads outward.
  const Vec3d outward = geometry::unitNormal(triangle, contact.normal);
  const double radius = capsule.radiusAt(contact.s);
  // By how much each end is thicker than the ball at the contact, which is 0 for capsules.
  const double more_a = capsule.radiusAtA() - radius, more_b = capsule.radiusAtB() - radius;
  const double depth = std::max({0.0, dot(outward, triangle.a - capsule.a) + more_a,
                                 dot(outward, triangle.a - capsule.b) + more_b});
  contact.point_a = contact.point_a - radius * (contact.normal + outward);
  contact.distance = -depth - radius;
  contact.normal = -1.0 * outward;
}

}  // namespace

MeshContacts::MeshContacts(const index::PlacedMesh& mesh)
    : is_solid_(mesh.is_solid), frame_{mesh.pose.shift, 1}, triangles_(mesh, frame_) {}

void MeshContacts::compute(const Pair* pairs, std::size_t count, MeshContact* contacts) const {
  std::array<Segment, kAtOnce> capsules{};
  std::array<Triangle, kAtOnce> triangles{};
  std::array<geometry::ClosestOnTriangle, kAtOnce> closest;
  for (std::size_t i = 0; i < count; ++i) {
    capsules[i] = pairs[i].capsule;
    triangles[i] = triangles_[pairs[i].triangle];
  }
  geometry::closestPoints(capsules.data(), triangles.data(), count, closest.data());
  for (std::size_t i = 0; i < count; ++i) {
    const Segment& capsule = capsules[i];
    TriangleContact contact =
        geometry::triangleContact(capsule, triangles[i], closest[i], frame_.origin);
    const bool is_inside =
        is_solid_ &&
        (contact.crosses || triangles_.isInside(capsule.a + contact.s * (capsule.b - capsule.a)));
    if (is_inside) moveOut(capsule, triangles[i], contact);
    contacts[i] = publicContact(contact, pairs[i].place, pairs[i].triangle, is_inside);
  }
}

MeshContact publicContact(const TriangleContact& contact, FiberSegment place, index::TriangleId id,
                          bool is_inside) {
  MeshContact found;
  found.place = place;
  setContact(contact, found);
  found.triangle = id;
  found.solid = is_inside;
  found.weights = {contact.weight[0], contact.weight[1], contact.weight[2]};
  return found;
}

void MeshContacts::findTriangles(const Segment& capsule, double reach,
                                 std::vector<index::TriangleId>& triangles) const {
  triangles.clear();
  const double error = endPointError(capsule) + triangles_.error();
  visitOverlapping(triangles_.mesh().tree(), triangles_.boxOf(capsule, reach + error),
                   [&](index::TriangleId id) {
                     if (touch(capsule, triangles_[id], reach, error)) triangles.push_back(id);
                     return tree::Visit::kContinue;
                   });
  std::sort(triangles.begin(), triangles.end());
  if (!triangles.empty()) return;
  triangles.push_back(triangles_.nearest(capsule, std::numeric_limits<double>::max()).triangle);
}

MeshContact impactContact(const geometry::MovingSegment& capsule, const Vec3d& origin,
                          const index::PlacedMesh& start, const index::PlacedMesh& end,
                          index::TriangleId triangle, double time, FiberSegment place) {
  // What touches at the start may be inside a solid. What touches later comes from outside.
  if (time == 0) {
    const MeshContacts contact(start);
    const Vec3d shift = origin - contact.frame().origin;
    const Segment& first = capsule.start;
    return contact({first.a + shift, first.b + shift, first.radius, first.taper}, place, triangle);
  }
  const geometry::Frame frame{origin, 1};
  const geometry::MovingTriangle moving{index::PosedTriangles(start, frame)[triangle],
                                        index::PosedTriangles(end, frame)[triangle]};
  return publicContact(geometry::triangleContact(at(capsule, time), at(moving, time), origin),
                       place, triangle, /*is_inside=*/false);
}

}  // namespace fcl_fibers::fibers
