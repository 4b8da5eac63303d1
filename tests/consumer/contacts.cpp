// SPDX-License-Identifier: BSD-3-Clause

// Plain arrays, a mesh and contacts, for a program that has neither FCL's nor Eigen's headers in
// sight, nor the library's flags. Prints the version of the headers and the number of contacts.
#include <cstdint>
#include <cstdio>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/triangle_mesh.h>
#include <fcl_fibers/version.h>

#ifdef EIGEN_WORLD_VERSION
#error "fcl_fibers/contact.h includes Eigen"
#endif

int main() {
  const double points[] = {-1, 0, 0, 1, 0, 0, 0, -1, 0.1, 0, 1, 0.1};
  const std::size_t point_begin[] = {0, 2, 4};
  const double radius = 0.06;
  const fcl_fibers::FiberArrays<double> fibers{points, 4, point_begin, 2, &radius};
  fcl_fibers::FiberTree tree(fcl_fibers::FiberOptions{});  // of volumes that overlap
  tree.build(fibers);
  int contacts = 0;
  tree.visit(fcl_fibers::Pairs{}, [&](fcl_fibers::SegmentPair pair) {
    const fcl_fibers::Contact contact = fcl_fibers::capsuleContact(fibers, pair);
    contacts += contact.distance < 0 && contact.normal[2] > 0.999;
  });

  const double corners[] = {-1, -1, 0, 1, -1, 0, 0, 1, 0};
  const std::int32_t triangle[] = {0, 1, 2};
  fcl_fibers::TriangleMesh mesh(fcl_fibers::MeshArrays<double>{corners, 3, triangle, 1});
  mesh.setPose({{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0.15}});
  fcl_fibers::FiberTree capsules;
  capsules.build(fibers);
  std::vector<fcl_fibers::MeshContact> with_mesh;
  capsules.find(fcl_fibers::Contacts{fibers}, mesh, with_mesh);
  if (with_mesh.size() != 1 || with_mesh[0].place.fiber != 1) return 1;

  std::printf("fcl_fibers %s: contacts %d\n", FCL_FIBERS_VERSION, contacts);
  return contacts == 1 ? 0 : 1;
}
