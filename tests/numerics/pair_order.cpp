// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/pair_order.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <type_traits>

#include <fcl_fibers/triangle_mesh.h>

#include "numerics/random_scenes.h"

namespace fcl_fibers::test {
namespace {

/// FNV-1a (Fowler, Noll and Vo), over bytes of numbers.
class Hash {
 public:
  void add(std::uint64_t number) {
    for (int byte = 0; byte < 8; ++byte) {
      value_ = (value_ ^ (number >> (8 * byte) & 0xff)) * 0x100000001b3;
    }
  }
  void add(double number) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    add(bits);
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325;
};

std::uint64_t hashOf(const TouchOracle& capsules) {
  Hash hash;
  for (std::size_t i = 0; i < capsules.size(); ++i) {
    const GivenCapsule& capsule = capsules[i];
    for (const auto& vector : {capsule.a, capsule.b, capsule.axis}) {
      for (const double x : vector) hash.add(x);
    }
    hash.add(capsule.radius);
    hash.add(capsule.length);
  }
  return hash.value();
}

template <typename S>
OrderHash orderHash(RandomKind kind, Form form, int threads) {
  const Assembly<S> fibers = randomScene<S>(kind, 1200, 41, HairFiles::none());
  const Specimen<S> specimen(fibers, form);
  Hash hash;
  for (FiberTreeOptions options : allKinds()) {
    options.threads = threads;
    const std::vector<NumberPair> pairs = specimen.pairs(options);
    if (pairs.empty()) throw std::logic_error("The scene has no pairs to put in order.");
    hash.add(std::uint64_t{pairs.size()});
    for (const NumberPair& pair : pairs) {
      hash.add(std::uint64_t{static_cast<std::uint32_t>(pair.a)} << 32 |
               static_cast<std::uint32_t>(pair.b));
    }
  }
  const std::string scalar = std::is_same_v<S, float> ? "float" : "double";
  return {nameOf(kind) + ", " + scalar + (form == Form::kArrays ? ", arrays" : ", objects"),
          hashOf(specimen.truth()), hash.value()};
}

/// Of fibers and a turned, uneven sheet of triangles through their middle.
OrderHash meshOrderHash(std::int32_t across, int threads) {
  const Assembly<double> fibers =
      randomScene<double>(RandomKind::kSparse, 1200, 43, HairFiles::none());
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
  for (FiberTreeOptions options : allKinds()) {
    if (options.report != Report::kCapsules) continue;
    options.threads = threads;
    FiberTree tree(options);
    tree.build(fibers.view());
    std::uint64_t count = 0;
    tree.visitMesh(mesh, [&](TrianglePair pair) {
      ++count;
      found.add(std::uint64_t{static_cast<std::uint32_t>(pair.segment)} << 32 |
                static_cast<std::uint32_t>(pair.triangle));
    });
    if (count == 0) throw std::logic_error("No segment touches the mesh.");
    std::vector<std::int32_t> touching;
    tree.findTouching(mesh, touching);
    for (const std::int32_t segment : touching) found.add(std::uint64_t(segment));
  }
  return {"mesh of " + std::to_string(mesh.triangleCount()) + " triangles", given.value(),
          found.value()};
}

}  // namespace

std::vector<OrderHash> orderHashes(int threads) {
  std::vector<OrderHash> hashes;
  for (const RandomKind kind : kRandomKinds) {
    if (kind == RandomKind::kHair) continue;
    for (const Form form : {Form::kArrays, Form::kObjects}) {
      hashes.push_back(orderHash<float>(kind, form, threads));
      hashes.push_back(orderHash<double>(kind, form, threads));
    }
  }
  // A search with few tasks turns the boxes of the mesh, one with many poses its tree.
  for (const std::int32_t across : {6, 60}) hashes.push_back(meshOrderHash(across, threads));
  return hashes;
}

}  // namespace fcl_fibers::test
