// SPDX-License-Identifier: BSD-3-Clause

// Hair in a gust, which moves it by hundreds of radii in one step: what touches at the end, what
// touches on the way there, and how far the hair can go until it touches. Lengths are in cm.
//
//     gust [FOLDER]    also writes what tutorials.py draws to the folder
#include <cmath>
#include <cstdio>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/io/export_geometry.h>

namespace {

using namespace fcl_fibers;

constexpr int kRows = 20, kSegments = 20;

/// 400 hairs of 12 cm that hang from a grid, in a wind along x. No two of them have quite the same
/// shape or feel quite the same wind.
FiberPolylines hair(double wind) {
  FiberPolylines result;
  result.radius = 0.0035;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kRows; ++column) {
      Point point = {0.08 * column, 0.08 * row, 0};
      const double phase = 2.4 * (kRows * row + column);
      result.points.push_back(point);
      for (int i = 1; i <= kSegments; ++i) {
        const double turn = wind * (1 + 0.2 * std::sin(phase)) * i;
        point[0] += 0.6 * std::sin(turn);
        point[1] += 0.6 * 0.01 * std::sin(0.5 * i + phase);
        point[2] -= 0.6 * std::cos(turn);
        result.points.push_back(point);
      }
      result.point_begin.push_back(result.points.size());
    }
  }
  return result;
}

double meanMotion(const FiberPolylines& start, const FiberPolylines& end) {
  double sum = 0;
  for (std::size_t i = 0; i < start.points.size(); ++i) {
    const Point &p = start.points[i], &q = end.points[i];
    sum += std::hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
  }
  return sum / static_cast<double>(start.points.size());
}

void write(const std::string& folder, const std::string& name, const FiberPolylines& fibers,
           const std::vector<Contact>& contacts) {
  io::exportFibers(folder + "/gust_" + name + "_fibers.vtp", fibers);
  io::exportContacts(folder + "/gust_" + name + "_contacts.vtp", contacts);
}

}  // namespace

int main(int argc, char** argv) {
  const FiberPolylines start = hair(0), end = hair(0.0387);
  std::printf("the gust moves %zu hairs by %.0f radii\n", start.fiberCount(),
              meanMotion(start, end) / start.radius);

  FiberTree tree;
  tree.build(fiberArrays(start));
  std::vector<SegmentPair> at_start, at_end;
  tree.find(Pairs{}, at_start);
  tree.update(fiberArrays(end));
  tree.find(Pairs{}, at_end);
  std::printf("pairs that touch at the start: %zu, at the end: %zu\n", at_start.size(),
              at_end.size());

  // [impacts]
  tree.update(fiberArrays(start), fiberArrays(end));
  std::set<std::pair<int, int>> known;
  for (const SegmentPair& pair : at_end) known.insert({pair.a, pair.b});
  std::size_t missed = 0;
  std::vector<Contact> contacts;
  tree.visit(Impacts{}, [&](const Impact& impact) {
    contacts.push_back(impactContact(fiberArrays(start), fiberArrays(end), impact));
    missed += known.count({impact.pair.a, impact.pair.b}) == 0 ? 1 : 0;
  });
  std::printf("pairs that touch in the step: %zu; the end alone misses %.0f %%\n", contacts.size(),
              100.0 * static_cast<double>(missed) / static_cast<double>(contacts.size()));
  // [impacts]

  // [safe]
  const double safe = tree.safeStep();
  std::printf("safe part of the step: %.4f\n", safe);
  tree.visit(Impacts{}, [&](const Impact& impact) {
    if (impact.time > safe + 1e-6) return;
    const FiberSegment a = tree.fiberSegment(impact.pair.a), b = tree.fiberSegment(impact.pair.b);
    std::printf("then segment %zu of hair %zu touches segment %zu of hair %zu\n", a.number, a.fiber,
                b.number, b.fiber);
  });
  // [safe]

  if (argc > 1) {
    std::vector<Contact> contacts_at_end;
    for (const SegmentPair& pair : at_end) {
      contacts_at_end.push_back(capsuleContact(fiberArrays(end), pair));
    }
    write(argv[1], "start", start, {});
    write(argv[1], "end", end, contacts_at_end);
    write(argv[1], "step", end, contacts);
  }
  return 0;
}
