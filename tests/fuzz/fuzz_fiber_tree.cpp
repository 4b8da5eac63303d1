// SPDX-License-Identifier: BSD-3-Clause
//
// A tree over arrays of any bits, with groups or without: built, updated, searched, met by
// another one and by meshes. What is refused must leave the tree as it was; what is answered must
// have each pair once, all pairs that surely touch, and under Report::kCapsules none that are
// surely apart.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/meshes.h"
#include "fuzz_input.h"
#include "support/assembly.h"
#include "support/exact_geometry.h"
#include "support/touch_oracle.h"

namespace {

using fcl_fibers::FiberArrays;
using fcl_fibers::FiberTree;
using fcl_fibers::FiberTreeOptions;
using fcl_fibers::MeshContact;
using fcl_fibers::MeshPose;
using fcl_fibers::Report;
using fcl_fibers::SegmentPair;
using fcl_fibers::TriangleMesh;
using fcl_fibers::TrianglePair;
using fcl_fibers::fuzz::isRefused;
using fcl_fibers::fuzz::readNumber;
using fcl_fibers::fuzz::require;
using fcl_fibers::test::Assembly;
using fcl_fibers::test::GivenCapsule;
using fcl_fibers::test::Real;
using fcl_fibers::test::TouchOracle;
using fcl_fibers::test::Triangles;
using Pairs = std::vector<std::pair<int, int>>;

constexpr int kNumbers = 8;  // see readNumber()

FiberTreeOptions readOptions(FuzzedDataProvider& data) {
  FiberTreeOptions options;
  options.topology =
      data.ConsumeBool() ? fcl_fibers::Topology::kBundle : fcl_fibers::Topology::kSuperThread;
  options.volumes = data.ConsumeBool() ? FiberTreeOptions::Volumes::kLayeredBoxes
                                       : FiberTreeOptions::Volumes::kWrappedSpheres;
  options.report = data.ConsumeBool() ? Report::kCapsules : Report::kVolumes;
  options.ignored_neighbors = data.ConsumeIntegralInRange(0, 3);
  options.margin = data.ConsumeBool() ? 0 : data.ConsumeFloatingPointInRange(0.0, 10.0);
  return options;
}

template <typename S>
struct Hair : Assembly<S> {
  std::vector<std::int32_t> groups;  ///< empty if there are none

  explicit Hair(FuzzedDataProvider& data) {
    const int fibers = data.ConsumeIntegralInRange(0, 12);
    for (int f = 0; f < fibers; ++f) {
      this->point_begin.push_back(this->pointCount() +
                                  data.ConsumeIntegralInRange<std::size_t>(0, 12));
    }
    this->radii_are = data.PickValueInArray({Radii::kOne, Radii::kPerFiber, Radii::kPerSegment});
    if (data.ConsumeBool()) {
      for (int f = 0; f < fibers; ++f) groups.push_back(data.ConsumeIntegralInRange(0, 2));
    }
    readNumbers(data);
  }

  void readNumbers(FuzzedDataProvider& data) {
    this->points.resize(3 * this->pointCount());
    for (S& x : this->points) x = readNumber<S>(data, kNumbers);
    this->radii.resize(this->radii_are == Radii::kOne        ? 1
                       : this->radii_are == Radii::kPerFiber ? this->fiberCount()
                                                             : this->pointCount());
    for (S& radius : this->radii) radius = std::fabs(readNumber<S>(data, kNumbers)) / 4;
  }

  FiberArrays<S> arrays() const {
    FiberArrays<S> arrays = this->view();
    if (!groups.empty()) arrays.groups = groups.data();
    return arrays;
  }

  bool areOfOneGroup(std::size_t a, std::size_t b) const {
    if (groups.empty()) return false;
    const std::int32_t group = groups[this->fiberOf(a)];
    return group != 0 && group == groups[this->fiberOf(b)];
  }

  /// The largest coordinate or radius.
  double size() const {
    double size = 0;
    for (const S x : this->points) size = std::max(size, std::fabs(static_cast<double>(x)));
    for (const S radius : this->radii) size = std::max(size, static_cast<double>(radius));
    return size;
  }

 private:
  using Radii = typename FiberArrays<S>::Radii;
};

Pairs pairsOf(const FiberTree& tree) {
  Pairs pairs;
  tree.visitPairs([&](SegmentPair pair) { pairs.emplace_back(pair.a, pair.b); });
  return pairs;
}

/// The band about contact in which either answer is right, see docs/numerics.md, is smaller than
/// this part of the scene's size.
constexpr double kBand = 1e-12;

template <typename S>
void checkPair(const Hair<S>& hair, std::size_t a, std::size_t b, const FiberTreeOptions& options,
               bool found) {
  const GivenCapsule p = hair.capsule(a), q = hair.capsule(b);
  const bool touch = TouchOracle::judge(p, q, options.margin).touching;
  const double band = kBand * (hair.size() + options.margin);
  if (!found) {
    require(!touch || !TouchOracle::touchExactly(p, q, options.margin - band));
  } else if (options.report == Report::kCapsules) {
    require(touch || TouchOracle::judge(p, q, options.margin + band).touching);
  }
}

template <typename S>
void checkAnswers(const FiberTree& tree, const Hair<S>& hair) {
  const FiberTreeOptions& options = tree.options();
  const Pairs pairs = pairsOf(tree);
  const std::set<std::pair<int, int>> found(pairs.begin(), pairs.end());
  require(found.size() == pairs.size());
  std::size_t counted = 0;
  for (std::size_t a = 0; a < hair.pointCount(); ++a) {
    if (!hair.startsCapsule(a)) continue;
    for (std::size_t b = a + 1; b < hair.pointCount(); ++b) {
      if (!hair.startsCapsule(b)) continue;
      const bool is_found = found.count({static_cast<int>(a), static_cast<int>(b)}) > 0;
      counted += is_found;
      if (hair.areOfOneGroup(a, b) ||
          (hair.fiberOf(a) == hair.fiberOf(b) &&
           b - a <= static_cast<std::size_t>(options.ignored_neighbors))) {
        require(!is_found);
      } else {
        checkPair(hair, a, b, options, is_found);
      }
    }
  }
  require(counted == pairs.size());
}

template <typename S>
Triangles<S> readMesh(FuzzedDataProvider& data) {
  Triangles<S> mesh;
  const int points = data.ConsumeIntegralInRange(0, 8), any = data.ConsumeIntegralInRange(0, 9);
  for (int i = 0; i < 3 * points; ++i) mesh.points.push_back(readNumber<S>(data, kNumbers));
  if (any == 0) {  // any indices
    for (int i = data.ConsumeIntegralInRange(0, 4); i > 0; --i) {
      mesh.addTriangle(data.ConsumeIntegralInRange(-1, 8), data.ConsumeIntegralInRange(-1, 8),
                       data.ConsumeIntegralInRange(-1, 8));
    }
  } else if (points == 4 && any < 4) {  // closed, its normals outward or inward
    mesh.indices = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
  } else if (points > 0) {
    for (int i = data.ConsumeIntegralInRange(0, 12); i > 0; --i) {
      mesh.addTriangle(data.ConsumeIntegralInRange(0, points - 1),
                       data.ConsumeIntegralInRange(0, points - 1),
                       data.ConsumeIntegralInRange(0, points - 1));
    }
  }
  return mesh;
}

MeshPose readPose(FuzzedDataProvider& data) {
  MeshPose pose;
  const int turn = data.ConsumeIntegralInRange(0, 4);
  if (turn == 1) pose.rotation = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  if (turn == 2) pose.rotation = {0.8, -0.6, 0, 0.6, 0.8, 0, 0, 0, 1};
  if (turn == 3) pose.rotation = {0.36, 0.48, -0.8, -0.8, 0.6, 0, 0.48, 0.64, 0.6};
  if (turn == 4) pose.rotation[data.ConsumeIntegralInRange<std::size_t>(0, 8)] = 0.5;
  for (double& x : pose.position) x = readNumber<double>(data, kNumbers);
  return pose;
}

/// The triangles of a surface that each segment touches are known; in a solid those inside come
/// with one more, and what is inside is not judged here.
template <typename S>
void checkMesh(const FiberTree& tree, const Hair<S>& hair, const Triangles<S>& triangles,
               const TriangleMesh& mesh) {
  double size = hair.size() + tree.options().margin;
  for (const S x : triangles.points) size = std::max(size, std::fabs(static_cast<double>(x)));
  for (const double x : mesh.pose().position) size = std::max(size, std::fabs(x));
  const Real band = 4 * kBand * size, margin = tree.options().margin;
  std::set<std::pair<int, int>> found;
  std::set<int> touching;
  const auto take = [&](TrianglePair pair) {
    require(found.emplace(pair.segment, pair.triangle).second);
    touching.insert(pair.segment);
  };
  if (isRefused([&] { tree.visitMesh(mesh, take); })) {
    return require(size > 1e100 || tree.options().report == Report::kVolumes);
  }
  std::vector<std::int32_t> segments;
  tree.findTouching(mesh, segments);
  require(std::set<int>(segments.begin(), segments.end()) == touching &&
          segments.size() == touching.size());
  std::vector<TrianglePair> nearest;
  const double distance = 1.5;
  tree.findNearest(mesh, distance, nearest);
  std::vector<std::int32_t> nearest_of(hair.pointCount(), -1);
  for (const TrianglePair& pair : nearest) {
    std::int32_t& triangle = nearest_of[static_cast<std::size_t>(pair.segment)];
    require(triangle == -1);
    triangle = pair.triangle;
  }
  std::size_t counted = 0;
  for (std::size_t a = 0; a < hair.pointCount(); ++a) {
    if (!hair.startsCapsule(a)) continue;
    const auto capsule = fcl_fibers::test::roundedCapsule(hair.capsule(a));
    const auto near = static_cast<std::size_t>(nearest_of[a]);
    Real least = INFINITY, of_nearest = INFINITY;
    for (std::size_t t = 0; t < triangles.count(); ++t) {
      const Real gap = fcl_fibers::test::segmentTriangleDistance(
                           capsule.a, capsule.b, triangles.triangle(t, mesh.pose())) -
                       capsule.radius;
      const bool is_found = found.count({static_cast<int>(a), static_cast<int>(t)}) > 0;
      counted += is_found;
      require(is_found || gap > margin - band);
      require(!is_found || gap <= margin + band || mesh.kind() == TriangleMesh::Kind::kSolid);
      least = std::min(least, gap);
      if (nearest_of[a] >= 0 && t == near) of_nearest = gap;
    }
    require(nearest_of[a] >= 0 ? of_nearest <= least + band && least <= distance + band
                               : least > distance - band);
  }
  require(counted == found.size());
}

template <typename S>
void fuzzMesh(FuzzedDataProvider& data, const FiberTree& tree, const Hair<S>& hair) {
  Triangles<S> triangles = readMesh<S>(data);
  const auto kind = data.ConsumeBool() ? TriangleMesh::Kind::kSurface : TriangleMesh::Kind::kSolid;
  std::optional<TriangleMesh> mesh;
  if (isRefused([&] { mesh.emplace(triangles.view(), kind); })) return;
  const MeshPose pose = readPose(data);
  isRefused([&] { mesh->setPose(pose); });
  checkMesh(tree, hair, triangles, *mesh);
  const Triangles<S> before = triangles;
  for (S& x : triangles.points) x = readNumber<S>(data, kNumbers);
  const bool refused = isRefused([&] { mesh->update(triangles.view()); });
  checkMesh(tree, hair, refused ? before : triangles, *mesh);
  std::vector<MeshContact> contacts;
  isRefused([&] { tree.findContacts(hair.arrays(), *mesh, contacts); });
}

template <typename S>
void fuzz(FuzzedDataProvider& data) {
  const FiberTreeOptions options = readOptions(data);
  FiberTree tree(options), other(options);
  std::optional<Hair<S>> hair;
  while (data.remaining_bytes() > 0) {
    switch (data.ConsumeIntegralInRange(0, 5)) {
      case 0:
      case 1: {
        Hair<S> next = hair && data.ConsumeBool() ? *hair : Hair<S>(data);
        const bool same_fibers =
            hair && next.point_begin == hair->point_begin && next.groups == hair->groups;
        if (same_fibers) next.readNumbers(data);
        const Pairs before = pairsOf(tree);
        const bool updates = same_fibers && data.ConsumeBool();
        if (isRefused([&] { updates ? tree.update(next.arrays()) : tree.build(next.arrays()); })) {
          require(pairsOf(tree) == before);
        } else {
          hair = next;
          checkAnswers(tree, *hair);
        }
        break;
      }
      case 2: {
        const Hair<S> next(data);
        if (isRefused([&] { other.build(next.arrays()); })) break;
        std::set<std::pair<int, int>> seen;
        tree.visitPairs(other, [&](SegmentPair pair) {
          require(hair->startsCapsule(static_cast<std::size_t>(pair.a)));
          require(next.startsCapsule(static_cast<std::size_t>(pair.b)));
          require(seen.emplace(pair.a, pair.b).second);
        });
        break;
      }
      case 3: {
        const int most = data.ConsumeIntegralInRange(1, 40);
        int calls = 0;
        const bool stopped = tree.visitPairs([&](SegmentPair) { return ++calls == most; });
        require(calls <= most && stopped == (calls == most));
        break;
      }
      case 4:
        if (hair) fuzzMesh(data, tree, *hair);
        break;
      default: {
        const int segment = data.ConsumeIntegral<int>();
        isRefused([&] { tree.fiberSegment(segment); });
      }
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  FuzzedDataProvider data(bytes, size);
  if (data.ConsumeBool()) {
    fuzz<float>(data);
  } else {
    fuzz<double>(data);
  }
  return 0;
}
