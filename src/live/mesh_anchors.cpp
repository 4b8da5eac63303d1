// SPDX-License-Identifier: BSD-3-Clause
#include "live/mesh_anchors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geometry/rounding.h"
#include "tree/extent.h"

namespace fcl_fibers::live {
namespace {

using geometry::AffineMap;
using geometry::Box;
using geometry::nearestFloat;
using geometry::roundedDown;
using geometry::roundedUp;
using geometry::TriangleIndices;
using geometry::Vec3d;
using tree::SegmentId;

/// Boxes a few points. Sums find out NaN and infinity, which minima may pass over.
class Bounds {
 public:
  void add(const Vec3d& p) {
    low_ = min(low_, p);
    high_ = max(high_, p);
    sum_ += p.x + p.y + p.z;
  }
  /// @param larger  by how much the box is larger on all sides
  Box box(double larger) const {
    if (!std::isfinite(sum_ + larger)) return Box::unbounded();
    return {
        {roundedDown(low_.x - larger), roundedDown(low_.y - larger), roundedDown(low_.z - larger)},
        {roundedUp(high_.x + larger), roundedUp(high_.y + larger), roundedUp(high_.z + larger)}};
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3d low_{kInfinity, kInfinity, kInfinity}, high_{-kInfinity, -kInfinity, -kInfinity};
  double sum_ = 0;
};

/// The numbers of the points of a triangle.
std::array<std::size_t, 3> cornersOf(const TrianglesNow& now, Leaf leaf) {
  const SegmentId id = now.order()[static_cast<std::size_t>(leaf)];
  const TriangleIndices& t = now.triangles->mesh().triangles()[static_cast<std::size_t>(id)];
  return {static_cast<std::size_t>(t.a), static_cast<std::size_t>(t.b),
          static_cast<std::size_t>(t.c)};
}

/// Calls visit(i) for all numbers below `count`.
template <class Visit>
void forAll(parallel::Executor* executor, std::size_t count, const Visit& visit) {
  constexpr std::size_t kAtOnce = 4096;
  parallel::forRanges(executor, count, kAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) visit(i);
  });
}

}  // namespace

void MeshAnchors::set(const TrianglesNow& now, parallel::Executor* executor) {
  const index::MeshIndex& mesh = now.triangles->mesh();
  posing_ = now.triangles->posing();
  error_ = now.triangles->error();
  resize(mesh.triangles().size());
  anchors_.resize(mesh.points().size());
  forAll(executor, anchors_.size(), [&](std::size_t i) {
    const Vec3d p = posing_(toVec3d(mesh.points()[i]));
    anchors_[i] = {{nearestFloat(p.x), nearestFloat(p.y), nearestFloat(p.z), 0}};
  });
  forBlocks(executor, [&](std::int32_t i) {
    Bounds where;
    for (Leaf leaf = i * kBlock; leaf < blockEnd(i); ++leaf) {
      for (const std::size_t point : cornersOf(now, leaf)) where.add(at(point));
    }
    setBlock(i, {where.box(0), Box::unbounded(), 0});
  });
  motion_ = {};
  measurePoints(now, executor);
  joinAbove();
  version_ = now.version;
  rounding_ = 0;
  if (blockCount() == 0) return;
  const Box moved = root().moved;
  for (int axis = 0; axis < 3; ++axis) {
    rounding_ += std::max(-double{moved.low[axis]}, double{moved.high[axis]});
  }
}

void MeshAnchors::measure(const TrianglesNow& now, const AffineMap& motion,
                          parallel::Executor* executor) {
  motion_ = motion;
  if (now.version == version_) {
    measureWhole(now);
  } else {
    measurePoints(now, executor);
  }
  joinAbove();
}

Vec3d MeshAnchors::displacementOf(const TrianglesNow& now, std::size_t point) const {
  return now.triangles->posing()(toVec3d(now.triangles->mesh().points()[point])) -
         motion_(at(point));
}

/// Bounds the error of a displacement, and by how much the test of a pair errs on the side of
/// touching. The errors of points are those of three products and sums of numbers of their size.
double MeshAnchors::errorOf(const TrianglesNow& now) const {
  return 16 * (error_ + now.triangles->error()) +
         64 * std::numeric_limits<double>::epsilon() * maxNorm(motion_.shift);
}

void MeshAnchors::measurePoints(const TrianglesNow& now, parallel::Executor* executor) {
  parallel::UnwrittenVector<Vec3d> displacements(anchors_.size());
  forAll(executor, anchors_.size(),
         [&](std::size_t i) { displacements[i] = displacementOf(now, i); });
  const double error = errorOf(now);
  forBlocks(executor, [&](std::int32_t i) {
    Bounds moved;
    for (Leaf leaf = i * kBlock; leaf < blockEnd(i); ++leaf) {
      for (const std::size_t point : cornersOf(now, leaf)) moved.add(displacements[point]);
    }
    setBlock(i, {block(i).where, moved.box(error), 0});
  });
}

/// Bounds the displacements if the mesh's own points are those that were anchored. Its pose now
/// after the inverse of its pose then takes an anchor to where the point is, up to the rounding
/// of the anchor. So a displacement depends on the anchor alone, by a map that takes boxes to
/// boxes.
void MeshAnchors::measureWhole(const TrianglesNow& now) {
  const AffineMap back = posing_.inverse(), &posing = now.triangles->posing();
  AffineMap map;
  for (int k = 0; k < 3; ++k) map.column[k] = posing.linear(back.column[k]) - motion_.column[k];
  map.shift = posing(back.shift) - motion_.shift;
  // A pose is a rotation up to 5e-3, so it takes a point and its anchor hardly further apart.
  const double error = 2 * rounding_ + errorOf(now);
  for (std::int32_t i = 0; i < blockCount(); ++i) {
    Node node = block(i);
    const Vec3d middle = map(tree::centerOfVolume(node.where));
    Vec3d half{0, 0, 0};
    for (int k = 0; k < 3; ++k) {
      half = half +
             0.5 * (double{node.where.high[k]} - double{node.where.low[k]}) * abs(map.column[k]);
    }
    Bounds moved;
    moved.add(middle - half);
    moved.add(middle + half);
    node.moved = moved.box(error);
    setBlock(i, node);
  }
}

void MeshAnchors::writeNodes(const TrianglesNow& now, std::int32_t block, BlockNodes& nodes) const {
  const double error = errorOf(now);
  for (Leaf leaf = block * kBlock; leaf < blockEnd(block); ++leaf) {
    Bounds where, moved;
    for (const std::size_t point : cornersOf(now, leaf)) {
      where.add(at(point));
      moved.add(displacementOf(now, point));
    }
    nodes.set(leaf, {where.box(0), moved.box(error), 0});
  }
}

void MeshAnchors::sample(const TrianglesNow& now, std::vector<geometry::MovedPoint>& points) const {
  constexpr std::size_t kMost = 256;
  const std::vector<geometry::MeshPoint>& all = now.triangles->mesh().points();
  for (std::size_t i = 0; i < all.size(); i += all.size() / kMost + 1) {
    points.push_back({at(i), now.triangles->posing()(toVec3d(all[i]))});
  }
}

geometry::Triangle MeshAnchors::triangle(const TrianglesNow& now, Leaf leaf) const {
  const auto [a, b, c] = cornersOf(now, leaf);
  return {at(a), at(b), at(c)};
}

}  // namespace fcl_fibers::live
