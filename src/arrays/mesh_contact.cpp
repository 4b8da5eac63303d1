// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <string>

#include "arrays/mesh_contacts.h"
#include "arrays/triangle_mesh.h"
#include "fibers/options.h"
#include "geometry/triangle_contact.h"

namespace fcl_fibers {
namespace {

using geometry::Segment;
using geometry::Triangle;
using geometry::TriangleContact;
using geometry::Vec3d;

/// Turns the contact of a capsule that is inside a solid into one that moves it out.
void moveOut(const Segment& capsule, const Triangle& triangle, TriangleContact& contact) {
  // A triangle without area has no normal. Then the way to its closest point leads outward.
  const Vec3d outward = geometry::unitNormal(triangle, contact.normal);
  const double depth =
      std::max({0.0, dot(outward, triangle.a - capsule.a), dot(outward, triangle.a - capsule.b)});
  contact.point_a = contact.point_a - capsule.radius * (contact.normal + outward);
  contact.distance = -depth - capsule.radius;
  contact.normal = -1.0 * outward;
}

template <typename S>
MeshContact contactOf(const FiberArrays<S>& fibers, const TriangleMesh& mesh, TrianglePair pair) {
  const arrays::LocatedSegment capsule = arrays::locate("meshContact", fibers, pair.segment);
  if (pair.triangle < 0 || static_cast<std::size_t>(pair.triangle) >= mesh.triangleCount()) {
    fibers::throwInvalidArgument("meshContact",
                                 "there is no triangle " + std::to_string(pair.triangle) + " of " +
                                     std::to_string(mesh.triangleCount()) +
                                     "; pass the mesh that the tree was asked about");
  }
  return arrays::MeshContacts(MeshReader::posed(mesh))(capsule, pair.triangle);
}

}  // namespace

namespace arrays {

MeshContacts::MeshContacts(const index::PosedMesh& mesh)
    : is_solid_(mesh.is_solid),
      frame_{mesh.pose.shift, 1},
      triangles_(mesh, frame_),
      query_(triangles_) {}

MeshContact MeshContacts::operator()(const LocatedSegment& located, index::TriangleId id) const {
  const Segment capsule{frame_.fromWorld(located.segment.a), frame_.fromWorld(located.segment.b),
                        located.segment.radius};
  const Triangle triangle = triangles_[id];
  TriangleContact contact = geometry::triangleContact(capsule, triangle, frame_.origin);
  const bool is_inside =
      is_solid_ &&
      (contact.crosses || query_.isInside(capsule.a + contact.s * (capsule.b - capsule.a)));
  if (is_inside) moveOut(capsule, triangle, contact);
  const auto toArray = [](const Vec3d& v) { return std::array{v.x, v.y, v.z}; };
  return {located.place,
          id,
          contact.s,
          {contact.weight[0], contact.weight[1], contact.weight[2]},
          contact.distance,
          is_inside,
          toArray(contact.point_a),
          toArray(contact.point_b),
          toArray(contact.normal)};
}

}  // namespace arrays

MeshContact meshContact(const FiberArrays<float>& fibers, const TriangleMesh& mesh,
                        TrianglePair pair) {
  return contactOf(fibers, mesh, pair);
}
MeshContact meshContact(const FiberArrays<double>& fibers, const TriangleMesh& mesh,
                        TrianglePair pair) {
  return contactOf(fibers, mesh, pair);
}

}  // namespace fcl_fibers
