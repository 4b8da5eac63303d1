// SPDX-License-Identifier: BSD-3-Clause

// Reads fibers from a file and writes where they touch, as CSV:
//
//     hair_contacts FILE [RADIUS] > contacts.csv
//
// FILE is a .hair, .tfx, .bcc, .vtp, .tck, .trk or .swc file or a table of points. RADIUS is the
// radius of all fibers in the file's unit; it is needed if the file has none.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <string>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/io/fiber_file.h>

namespace {

void writeContacts(const std::string& path, const fcl_fibers::io::FiberFileOptions& how) {
  const auto file = fcl_fibers::io::readFibers(path, how);
  if (!file.has_radius) {
    throw std::invalid_argument(path + " holds no radius: give one, in the file's unit");
  }
  for (const std::string& warning : file.warnings) std::fprintf(stderr, "%s\n", warning.c_str());
  const auto fibers = fcl_fibers::fiberArrays(file.fibers);

  fcl_fibers::FiberTree tree;
  tree.build(fibers);

  std::puts("fiber_a,number_a,s,fiber_b,number_b,t,distance,x,y,z,normal_x,normal_y,normal_z");
  tree.visit(fcl_fibers::Pairs{}, [&](fcl_fibers::SegmentPair pair) {
    const fcl_fibers::Contact c = fcl_fibers::capsuleContact(fibers, pair);
    std::printf("%zu,%zu,%.9g,%zu,%zu,%.9g,%.9g,", c.a.fiber, c.a.number, c.s, c.b.fiber,
                c.b.number, c.t, c.distance);
    std::printf("%.9g,%.9g,%.9g,%.9g,%.9g,%.9g\n", (c.point_a[0] + c.point_b[0]) / 2,
                (c.point_a[1] + c.point_b[1]) / 2, (c.point_a[2] + c.point_b[2]) / 2, c.normal[0],
                c.normal[1], c.normal[2]);
  });
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: hair_contacts FILE [RADIUS]\n");
    return 2;
  }
  try {
    fcl_fibers::io::FiberFileOptions how;
    if (argc == 3) {
      char* end = nullptr;
      how.radius = std::strtod(argv[2], &end);
      if (*end != '\0') throw std::invalid_argument(std::string(argv[2]) + " is no radius");
    }
    writeContacts(argv[1], how);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
