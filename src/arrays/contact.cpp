// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/contact.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "arrays/fiber_arrays.h"
#include "arrays/located_segment.h"
#include "arrays/shapes.h"
#include "arrays/triangle_mesh.h"
#include "fibers/capsule_contact.h"
#include "fibers/mesh_contacts.h"
#include "fibers/options.h"

namespace fcl_fibers {
namespace {

using geometry::Segment;

constexpr char kCall[] = "capsuleContact";

template <class Name>
const Segment& checked(const char* call, const Segment& segment, Name&& name) {
  if (const char* problem = fibers::contactProblem(segment)) {
    fibers::throwInvalidArgument(call, name() + ": " + problem);
  }
  return segment;
}

}  // namespace

template <typename S>
arrays::LocatedSegment arrays::locate(const char* call, const FiberArrays<S>& fibers,
                                      std::int32_t id) {
  const auto refuse = [call](const std::string& what) { fibers::throwInvalidArgument(call, what); };
  const auto name = [id] { return "the capsule at point " + std::to_string(id); };
  const auto point = static_cast<std::size_t>(id);
  checkEnds(fibers, refuse);
  if (id < 0 || point >= fibers.point_count) {
    refuse("no capsule starts at point " + std::to_string(id) + " of " +
           std::to_string(fibers.point_count) + "; pass the arrays that the tree was built from");
  }
  const bool is_in_fiber = point >= fibers.point_begin[0];
  const std::size_t fiber =
      is_in_fiber ? fiberOf(fibers.point_begin, fibers.fiber_count, point) : 0;
  // The last comparison stays inside the array if point_begin or point_end is wrong.
  if (!is_in_fiber || point + 1 >= pointEnd(fibers, fiber) || point + 1 == fibers.point_count) {
    refuse("point " + std::to_string(id) +
           " is the last of its fiber or of no fiber; pass the arrays that the tree was built "
           "from");
  }
  const double radius = radiusOf(fibers, point, fiber);
  const bool is_cone = fibers.radii_are == FiberArrays<S>::Radii::kPerPoint;
  const Segment segment = Segment::cone(pointOf(fibers, point), pointOf(fibers, point + 1), radius,
                                        is_cone ? radiusOf(fibers, point + 1, fiber) : radius);
  return {checked(call, segment, name), {fiber, point - fibers.point_begin[fiber]}};
}

Contact capsuleContact(const CapsuleShape& a, const CapsuleShape& b) {
  return fibers::contactOf(
      checked(kCall, arrays::toSegment(a), [] { return std::string("capsule a"); }),
      checked(kCall, arrays::toSegment(b), [] { return std::string("capsule b"); }), {0, 0, 0});
}

template <typename S>
Contact capsuleContact(const FiberArrays<S>& fibers, SegmentPair pair) {
  return capsuleContact(fibers, fibers, pair);
}

template <typename S>
Contact capsuleContact(const FiberArrays<S>& a, const FiberArrays<S>& b, SegmentPair pair) {
  const arrays::LocatedSegment p = arrays::locate(kCall, a, pair.a);
  const arrays::LocatedSegment q = arrays::locate(kCall, b, pair.b);
  Contact contact = fibers::contactOf(p.segment, q.segment, {0, 0, 0}, p.place, q.place);
  contact.pair = pair;
  return contact;
}

void requireTriangle(const char* call, const TriangleMesh& mesh, std::int32_t triangle) {
  if (triangle >= 0 && static_cast<std::size_t>(triangle) < mesh.triangleCount()) return;
  fibers::throwInvalidArgument(call, "there is no triangle " + std::to_string(triangle) + " of " +
                                         std::to_string(mesh.triangleCount()) +
                                         "; pass the mesh that the tree was asked about");
}

template <typename S>
MeshContact meshContact(const FiberArrays<S>& fibers, const TriangleMesh& mesh, TrianglePair pair) {
  const arrays::LocatedSegment capsule = arrays::locate("meshContact", fibers, pair.segment);
  requireTriangle("meshContact", mesh, pair.triangle);
  const fibers::MeshContacts contact(MeshReader::placed(mesh));
  MeshContact found =
      contact(contact.frame().fromWorld(capsule.segment), capsule.place, pair.triangle);
  found.segment = pair.segment;
  return found;
}

template <typename S>
ShapeContact shapeContact(const FiberArrays<S>& fibers, const Shape& shape, std::int32_t segment) {
  constexpr char kShape[] = "shapeContact";
  arrays::requireShape(kShape, shape);
  const arrays::LocatedSegment capsule = arrays::locate(kShape, fibers, segment);
  const geometry::Vec3d& origin = capsule.segment.a;
  const geometry::Frame near{origin, 1};
  ShapeContact contact =
      arrays::shapeContact(near.fromWorld(capsule.segment), origin, capsule.place, shape);
  contact.segment = segment;
  return contact;
}

#define FCL_FIBERS_INSTANTIATE(S)                                                             \
  template arrays::LocatedSegment arrays::locate(const char*, const FiberArrays<S>&,          \
                                                 std::int32_t);                               \
  template Contact capsuleContact(const FiberArrays<S>&, SegmentPair);                        \
  template Contact capsuleContact(const FiberArrays<S>&, const FiberArrays<S>&, SegmentPair); \
  template MeshContact meshContact(const FiberArrays<S>&, const TriangleMesh&, TrianglePair); \
  template ShapeContact shapeContact(const FiberArrays<S>&, const Shape&, std::int32_t);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers
