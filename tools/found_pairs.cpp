// SPDX-License-Identifier: BSD-3-Clause
#include "found_pairs.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <tuple>

#include "messages.h"

namespace fcl_fibers::tools {
namespace {

/// Pairs a segment, on average, that no sensible radius gives.
constexpr std::size_t kManyPairs = 20;

void findSegmentPairs(const PairSearch& search, FoundPairs& found) {
  const auto keep = [&](const SegmentPair& pair) {
    if (found.pairs.size() == search.limit) return true;
    found.pairs.push_back({pair.a, pair.b});
    return false;
  };
  found.complete = !(search.other == nullptr ? search.tree.visit(Pairs{}, keep)
                                             : search.tree.visit(Pairs{}, *search.other, keep));
}

/// A segment that touches the mesh is in one pair, with the triangle into which it is deepest.
void findMeshPairs(const PairSearch& search, std::int32_t number, FoundPairs& found) {
  struct Deepest {
    double distance = std::numeric_limits<double>::infinity();
    std::int32_t triangle = -1;
  };
  const MeshFile& mesh = (*search.meshes)[static_cast<std::size_t>(number)];
  std::vector<Deepest> of_segment(search.scene.points.size());
  const FiberArrays<double> arrays = fiberArrays(search.scene);
  std::size_t visited = 0;
  try {
    const bool ended = search.tree.visit(Pairs{}, mesh.mesh, [&](TrianglePair pair) {
      if (visited++ == search.limit) return true;
      const double distance = meshContact(arrays, mesh.mesh, pair).distance;
      Deepest& deepest = of_segment[static_cast<std::size_t>(pair.segment)];
      if (std::tie(distance, pair.triangle) < std::tie(deepest.distance, deepest.triangle)) {
        deepest = {distance, pair.triangle};
      }
      return false;
    });
    found.complete = found.complete && !ended;
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("'" + mesh.name + "': " + error.what());
  }
  for (std::size_t i = 0; i < of_segment.size(); ++i) {
    if (of_segment[i].triangle < 0) continue;
    found.pairs.push_back({static_cast<std::int32_t>(i), of_segment[i].triangle, number});
  }
}

void countTouching(const PairSearch& search, FoundPairs& found) {
  found.touching.resize(search.scene.points.size());
  std::vector<unsigned char> fibers(search.scene.fiberCount());
  const auto mark = [&](std::int32_t point) {
    found.touching[static_cast<std::size_t>(point)] = 1;
    fibers[search.tree.fiberSegment(point).fiber] = 1;
  };
  for (const FoundPair& pair : found.pairs) {
    mark(pair.a);
    if (pair.mesh == kNoMesh && search.other == nullptr) mark(pair.b);
  }
  const auto count = [](const std::vector<unsigned char>& flags) {
    return static_cast<std::size_t>(std::count(flags.begin(), flags.end(), 1));
  };
  found.touching_segments = count(found.touching);
  found.touching_fibers = count(fibers);
}

}  // namespace

FoundPairs findPairs(const PairSearch& search) {
  FoundPairs found;
  if (search.fibers) findSegmentPairs(search, found);
  const std::size_t meshes = search.meshes == nullptr ? 0 : search.meshes->size();
  for (std::size_t m = 0; m < meshes; ++m) {
    findMeshPairs(search, static_cast<std::int32_t>(m), found);
  }
  std::sort(found.pairs.begin(), found.pairs.end(), [](const FoundPair& p, const FoundPair& q) {
    return std::tie(p.a, p.mesh, p.b) < std::tie(q.a, q.mesh, q.b);
  });
  countTouching(search, found);
  return found;
}

FoundContact::FoundContact(const MeshContact& contact, std::int32_t its_mesh)
    : mesh(its_mesh), triangle(contact.triangle), weights(contact.weights), solid(contact.solid) {
  pair = {contact.segment, -1};
  a = contact.place;
  s = contact.s;
  distance = contact.distance;
  point_a = contact.point_a;
  point_b = contact.point_b;
  normal = contact.normal;
}

FoundContact contactOf(const FoundPair& pair, const FiberPolylines& scene,
                       const FiberPolylines* other, const std::vector<MeshFile>& meshes) {
  const FiberArrays<double> arrays = fiberArrays(scene);
  if (pair.mesh != kNoMesh) {
    const TriangleMesh& mesh = meshes[static_cast<std::size_t>(pair.mesh)].mesh;
    return {meshContact(arrays, mesh, {pair.a, pair.b}), pair.mesh};
  }
  return FoundContact(other == nullptr
                          ? capsuleContact(arrays, {pair.a, pair.b})
                          : capsuleContact(arrays, fiberArrays(*other), {pair.a, pair.b}));
}

void warnOfMany(const FoundPairs& found, const PairSearch& search, const std::string& scene) {
  const std::string too_large = "The radius is probably too large; `" + programName() +
                                " info` tells the radius at which contact begins.";
  if (!found.complete) {
    warn(scene, "the search ended after " + std::to_string(search.limit) +
                    " pairs, of which each triangle that a segment touches is one. So the answer "
                    "is incomplete. " +
                    too_large + " --limit N allows N pairs.");
  } else if (search.tree.options().report == Report::kCapsules &&
             found.pairs.size() > kManyPairs * search.tree.segmentCount()) {
    warn(scene, "there are more than " + std::to_string(kManyPairs) + " pairs for each segment. " +
                    too_large);
  }
}

}  // namespace fcl_fibers::tools
