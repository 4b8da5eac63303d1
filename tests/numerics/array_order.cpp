// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/array_order.h"

#include <algorithm>
#include <stdexcept>

#include <fcl_fibers/triangle_mesh.h>

#include "numerics/recorded_scenes.h"
#include "support/tree_kinds.h"

namespace fcl_fibers::test {
namespace {

template <typename S>
OrderHash arrayOrderHash(const std::string& name, int threads) {
  const Assembly<S> fibers = recordedScene<S>(name);
  Hash given, found;
  for (const GivenCapsule& capsule : fibers.capsules()) given.add(capsule);
  for (const Report report : {Report::kCapsules, Report::kVolumes}) {
    for (FiberTreeOptions options : allKinds(report)) {
      options.threads = threads;
      FiberTree tree(options);
      tree.build(fibers.view());
      std::vector<SegmentPair> pairs;
      tree.find(Pairs{}, pairs);
      if (pairs.empty()) throw std::logic_error("The scene has no pairs to put in order.");
      found.add(std::uint64_t{pairs.size()});
      for (const SegmentPair& pair : pairs) found.addPair(pair.a, pair.b);
    }
  }
  return {name + (sizeof(S) == 4 ? ", float" : ", double"), given.value(), found.value()};
}

/// Of fibers and a turned, uneven sheet of triangles through their middle.
OrderHash meshOrderHash(std::int32_t across, int threads) {
  const Assembly<double> fibers = recordedScene<double>("sparse");
  double low[3], high[3];
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = high[k] = fibers.points[k];
    for (std::size_t i = k; i < fibers.points.size(); i += 3) {
      low[k] = std::min(low[k], fibers.points[i]);
      high[k] = std::max(high[k], fibers.points[i]);
    }
  }
  std::vector<double> points;
  std::vector<std::int32_t> triangles;
  for (std::int32_t i = 0; i <= across; ++i) {
    for (std::int32_t j = 0; j <= across; ++j) {
      const double height = 0.5 + 0.02 * ((7 * i + 3 * j) % 5);
      const double place[3] = {double(i) / across, double(j) / across, height};
      for (std::size_t k = 0; k < 3; ++k) points.push_back(low[k] + place[k] * (high[k] - low[k]));
      const std::int32_t a = i * (across + 1) + j, b = a + across + 1;
      if (i < across && j < across)
        triangles.insert(triangles.end(), {a, b, b + 1, a, b + 1, a + 1});
    }
  }
  TriangleMesh mesh(
      MeshArrays<double>{points.data(), points.size() / 3, triangles.data(), triangles.size() / 3});
  MeshPose pose;
  pose.rotation = {0.6, 0, -0.8, 0, 1, 0, 0.8, 0, 0.6};
  const double x = 0.5 * (low[0] + high[0]), z = 0.5 * (low[2] + high[2]);
  pose.position = {x - (0.6 * x - 0.8 * z), 0, z - (0.8 * x + 0.6 * z)};
  mesh.setPose(pose);

  Hash given, found;
  for (const double number : fibers.points) given.add(number);
  for (const double number : points) given.add(number);
  for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
    options.threads = threads;
    FiberTree tree(options);
    tree.build(fibers.view());
    std::vector<TrianglePair> pairs;
    tree.visit(Pairs{}, mesh, [&](TrianglePair pair) { pairs.push_back(pair); });
    if (pairs.empty()) throw std::logic_error("No segment touches the mesh.");
    found.add(std::uint64_t{pairs.size()});
    for (const TrianglePair& pair : pairs) found.addPair(pair.segment, pair.triangle);
    std::vector<std::int32_t> touching;
    tree.find(TouchingSegments{}, mesh, touching);
    for (const std::int32_t segment : touching) found.add(std::uint64_t(segment));
  }
  return {"mesh of " + std::to_string(mesh.triangleCount()) + " triangles", given.value(),
          found.value()};
}

}  // namespace

std::vector<OrderHash> arrayOrderHashes(int threads) {
  std::vector<OrderHash> hashes;
  for (const std::string& name : recordedNames()) {
    hashes.push_back(arrayOrderHash<float>(name, threads));
    hashes.push_back(arrayOrderHash<double>(name, threads));
  }
  // A search with few tasks turns the boxes of the mesh, one with many poses its tree.
  for (const std::int32_t across : {6, 60}) hashes.push_back(meshOrderHash(across, threads));
  return hashes;
}

}  // namespace fcl_fibers::test
