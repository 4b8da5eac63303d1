// SPDX-License-Identifier: BSD-3-Clause
//
// A tree over arrays of any bits, with groups or without: built, updated, moved, searched, met by
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
#include "fuzz_hair.h"
#include "fuzz_input.h"
#include "support/exact_geometry.h"
#include "support/touch_oracle.h"

namespace {

using fcl_fibers::FiberTree;
using fcl_fibers::FiberTreeOptions;
using fcl_fibers::Impact;
using fcl_fibers::MeshContact;
using fcl_fibers::MeshImpact;
using fcl_fibers::MeshPose;
using fcl_fibers::Report;
using fcl_fibers::SegmentPair;
using fcl_fibers::TriangleMesh;
using fcl_fibers::TrianglePair;
using fcl_fibers::fuzz::Hair;
using fcl_fibers::fuzz::isRefused;
using fcl_fibers::fuzz::kNumbers;
using fcl_fibers::fuzz::readNumber;
using fcl_fibers::fuzz::readOptions;
using fcl_fibers::fuzz::require;
using fcl_fibers::test::GivenCapsule;
using fcl_fibers::test::Real;
using fcl_fibers::test::TouchOracle;
using fcl_fibers::test::Triangles;
using Pairs = std::vector<std::pair<int, int>>;

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
      if (hair.isLeftOut({static_cast<int>(a), static_cast<int>(b)}, options)) {
        require(!is_found);
      } else {
        checkPair(hair, a, b, options, is_found);
      }
    }
  }
  require(counted == pairs.size());
}

/// The impacts of a tree, none if it refuses to tell them.
struct Impacts {
  std::set<std::pair<int, int>> pairs;
  std::vector<Impact> all;

  explicit Impacts(const FiberTree& tree) {
    isRefused([&] {
      tree.visitImpacts([&](const Impact& impact) {
        require(pairs.emplace(impact.pair.a, impact.pair.b).second);
        require(impact.time >= 0 && impact.time <= 1);
        all.push_back(impact);
      });
    });
  }
};

/// A pair that is apart at the start is no nearer than the margin until the end of the safe step.
/// This is a matter of distances: how much later a pair touches than an impact says has no bound.
template <typename S>
void checkSafeStep(const Hair<S>& start, const Hair<S>& end, const Impact& impact, double safe,
                   double least) {
  constexpr int kTimes = 4;
  for (int i = 1; i <= kTimes && impact.time < safe; ++i) {
    Impact later = impact;
    later.time += (safe - impact.time) * i / kTimes;
    isRefused([&] {
      const auto contact = impactContact(start.arrays(), end.arrays(), later);
      require(!(contact.distance < least));
    });
  }
}

template <typename S>
void checkStep(const FiberTree& tree, const Hair<S>& start, const Hair<S>& end) {
  const FiberTreeOptions& options = tree.options();
  std::set<std::pair<int, int>> moving;
  tree.visitMovingPairs([&](SegmentPair pair) {
    require(moving.emplace(pair.a, pair.b).second);
    require(!end.isLeftOut(pair, options));
  });
  const Impacts impacts(tree);
  if (options.report == Report::kVolumes) {
    require(impacts.all.empty() && isRefused([&] { (void)tree.safeStep(); }));
    return;
  }
  const double safe = tree.safeStep();
  require(safe >= 0 && safe <= 1);
  const double size = std::max(start.size(), end.size()) + options.margin;
  for (const Impact& impact : impacts.all) {
    require(moving.count({impact.pair.a, impact.pair.b}) > 0);
    // Twice what the time of an impact may be early by, see FiberTree::visitImpacts().
    if (impact.time > 0) {
      checkSafeStep(start, end, impact, safe, options.margin - 2 * 0x1p-36 * 4 * size);
    }
  }
  for (const auto& [a, b] : moving) {
    const auto p = static_cast<std::size_t>(a), q = static_cast<std::size_t>(b);
    for (const Hair<S>* hair : {&start, &end}) {
      if (impacts.pairs.count({a, b}) == 0) checkPair(*hair, p, q, options, /*found=*/false);
    }
  }
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
  const TriangleMesh at_start = *mesh;
  for (S& x : triangles.points) x = readNumber<S>(data, kNumbers);
  const bool refused = isRefused([&] { mesh->update(triangles.view()); });
  checkMesh(tree, hair, refused ? before : triangles, *mesh);
  std::set<std::pair<int, int>> impacts;
  isRefused([&] {
    tree.visitImpacts(at_start, *mesh, [&](const MeshImpact& impact) {
      require(impacts.emplace(impact.pair.segment, impact.pair.triangle).second);
      require(impact.time >= 0 && impact.time <= 1);
    });
    const double safe = tree.safeStep(at_start, *mesh);
    require(safe >= 0 && safe <= 1);
  });
  std::vector<MeshContact> contacts;
  isRefused([&] { tree.findContacts(hair.arrays(), *mesh, contacts); });
}

/// @param hair  becomes that at the end of the step if the tree takes it
template <typename S>
void fuzzStep(FuzzedDataProvider& data, FiberTree& tree, Hair<S>& hair) {
  Hair<S> start = hair, end = hair;
  if (data.ConsumeBool()) start.readNumbers(data);
  end.readNumbers(data);
  const Pairs before = pairsOf(tree);
  const std::set<std::pair<int, int>> impacts_before = Impacts(tree).pairs;
  if (isRefused([&] { tree.update(start.arrays(), end.arrays()); })) {
    require(pairsOf(tree) == before && Impacts(tree).pairs == impacts_before);
    return;
  }
  require(tree.options().volumes == FiberTreeOptions::Volumes::kLayeredBoxes);
  hair = end;
  checkAnswers(tree, hair);
  checkStep(tree, start, end);
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
          require(isRefused([&] { tree.visitMovingPairs([](SegmentPair) {}); }));
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
        if (hair && data.ConsumeBool()) {
          fuzzStep(data, tree, *hair);
          break;
        }
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
