// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <string>

#include "arrays/located_segment.h"
#include "arrays/triangle_mesh.h"
#include "fibers/mesh_contacts.h"
#include "fibers/options.h"

namespace fcl_fibers {
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
  return contact(contact.frame().fromWorld(capsule.segment), capsule.place, pair.triangle);
}
template MeshContact meshContact(const FiberArrays<float>&, const TriangleMesh&, TrianglePair);
template MeshContact meshContact(const FiberArrays<double>&, const TriangleMesh&, TrianglePair);

}  // namespace fcl_fibers
