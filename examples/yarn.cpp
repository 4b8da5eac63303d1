// SPDX-License-Identifier: BSD-3-Clause

// A knitted tube of closed yarns: where do they touch? Lengths are in millimetres.
//
//     yarn [FILE.vtp]    also writes the yarns there, for `fcl_fibers view`, and FILE_contacts.vtp
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/io/export_geometry.h>

namespace {

using namespace fcl_fibers;

constexpr double kPi = 3.14159265358979323846;
constexpr int kCourses = 8, kStitches = 24, kSegments = 40;  // segments of a stitch
constexpr double kRadius = 0.6;                              // of the yarn

/// Stockinette, rolled to a tube: a course is the closed curve x = t + a sin 2t, y = b cos t,
/// z = c cos 2t, with x around the tube, y along it and z outward.
FiberPolylines knit() {
  FiberPolylines tube;
  tube.radius = kRadius;
  const double stitch = 5, tube_radius = kStitches * stitch / (2 * kPi);
  for (int course = 0; course < kCourses; ++course) {
    const std::size_t first = tube.points.size();
    for (int i = 0; i < kStitches * kSegments; ++i) {
      const double t = 2 * kPi * i / kSegments;
      const double angle = (stitch * t / (2 * kPi) + 1.2 * std::sin(2 * t)) / tube_radius;
      const double outward = tube_radius + 0.75 * std::cos(2 * t);
      tube.points.push_back(
          {outward * std::cos(angle), outward * std::sin(angle), 3.5 * course + 3.0 * std::cos(t)});
    }
    // [closed]
    tube.points.push_back(tube.points[first]);  // closed: the last point repeats the first
    tube.point_begin.push_back(tube.points.size());
    tube.closed.push_back(1);
    // [closed]
  }
  return tube;
}

// [contacts]
std::vector<Contact> contacts(const FiberPolylines& yarns, int neighbors, double arc_length) {
  FiberTreeOptions options;
  options.ignored_neighbors = neighbors;
  options.ignored_arc_length = arc_length;
  FiberTree tree(options);
  const FiberArrays<double> arrays = fiberArrays(yarns);  // with `closed`
  tree.build(arrays);
  std::vector<Contact> found;
  tree.visit(Pairs{}, [&](SegmentPair pair) { found.push_back(capsuleContact(arrays, pair)); });
  return found;
}
// [contacts]

}  // namespace

int main(int argc, char** argv) {
  // [counts]
  const FiberPolylines yarns = knit();
  FiberPolylines open = yarns;
  open.closed.clear();
  std::printf("%zu closed yarns, %zu segments\n", yarns.fiberCount(), yarns.segmentCount());
  std::printf("%5zu pairs touch\n", contacts(yarns, 0, 0).size());
  std::printf("%5zu without adjacent segments\n", contacts(yarns, 1, 0).size());
  std::printf("%5zu without pairs within pi * radius along the yarn\n",
              contacts(yarns, 0, kPi * kRadius).size());
  std::printf("%5zu if the yarns count as open\n", contacts(open, 0, kPi * kRadius).size());

  const std::vector<Contact> found = contacts(yarns, 0, kPi * kRadius);
  double deepest = 0;
  for (const Contact& contact : found) deepest = std::min(deepest, contact.distance);
  std::printf("the deepest overlap is %.3f mm\n", -deepest);
  // [counts]

  if (argc > 1) {
    const std::string path = argv[1];
    io::exportFibers(path, yarns);
    io::exportContacts(path.substr(0, path.rfind('.')) + "_contacts.vtp", found);
  }
  return 0;
}
