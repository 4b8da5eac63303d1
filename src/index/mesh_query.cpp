// SPDX-License-Identifier: BSD-3-Clause
#include "index/mesh_query.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/double_double.h"
#include "geometry/triangle_distance.h"
#include "tree/search.h"

namespace fcl_fibers::index {
namespace {

using geometry::Box;
using geometry::DoubleDouble;
using geometry::exactSum;
using geometry::MeshPoint;
using geometry::Segment;
using geometry::Vec3d;
using tree::SegmentId;
using tree::Visit;

class NearestTriangle final : public tree::NearestVisitor {
 public:
  NearestTriangle(const Segment& capsule, const PosedTriangles& triangles, double to_tree)
      : capsule_(capsule), triangles_(triangles), to_tree_(to_tree) {}

  Visit visit(SegmentId triangle, SegmentId /*capsule*/, double& limit) override {
    const geometry::Triangle posed = triangles_[triangle];
    // This settles most triangles of which only the boxes are that near.
    if (!axisWithin(capsule_, posed, found.distance)) return Visit::kContinue;
    const double distance = safeNorm(closestPoints(capsule_, posed).apart);
    if (distance < found.distance) {
      found = {triangle, distance};
      limit = std::min(limit, distance * to_tree_);
    }
    return Visit::kContinue;
  }

  MeshQuery::Nearest found{-1, std::numeric_limits<double>::infinity()};

 private:
  const Segment& capsule_;
  const PosedTriangles& triangles_;
  const double to_tree_;
};

/// The sign of the area that two points of a mesh span with the vertical line through p: 1 or -1,
/// or 0 if both are on one vertical line.
int sideOf(const Vec3d& p, const MeshPoint& a, const MeshPoint& b) {
  const auto *const m = a.numbers, *const n = b.numbers;
  const DoubleDouble area =
      exactSum(m[0], -p.x) * exactSum(n[1], -p.y) - exactSum(m[1], -p.y) * exactSum(n[0], -p.x);
  if (area.high != 0) return area.high > 0 ? 1 : -1;
  if (m[1] != n[1]) return m[1] > n[1] ? 1 : -1;
  return m[0] == n[0] ? 0 : n[0] > m[0] ? 1 : -1;
}

/// Counts the triangles that a ray upward from a point crosses.
class Crossings final : public tree::PairBuffer {
 public:
  Crossings(const MeshIndex& mesh, const Vec3d& point) : mesh_(mesh), point_(point) {
    next_ = found_;
    end_ = found_ + kCapacity;
  }

  int count() {
    full();
    return count_;
  }

 private:
  static constexpr std::size_t kCapacity = 64;

  Visit full() override {
    for (const tree::Pair* pair = found_; pair != next_; ++pair) count_ += crosses(pair->a) ? 1 : 0;
    next_ = found_;
    return Visit::kContinue;
  }

  bool crosses(TriangleId id) const {
    const geometry::TriangleIndices& t = mesh_.triangles()[static_cast<std::size_t>(id)];
    const std::int32_t corners[3] = {t.a, t.b, t.c};
    int sides[3];
    for (int k = 0; k < 3; ++k) {
      // Both triangles at an edge must see it alike.
      const auto [low, high] = std::minmax(corners[k], corners[(k + 1) % 3]);
      const int side = sideOf(point_, point(low), point(high));
      sides[k] = corners[k] == low ? side : -side;
      if (side == 0) return false;
    }
    return sides[0] == sides[1] && sides[1] == sides[2] && isAbove(id, sides[0]);
  }

  /// Whether a triangle that the vertical line through the point crosses is above the point.
  bool isAbove(TriangleId id, int side) const {
    const geometry::Triangle t = mesh_.triangle(id);
    const auto from = [](const Vec3d& p, const Vec3d& q) {
      return geometry::Vec3<DoubleDouble>{exactSum(q.x, -p.x), exactSum(q.y, -p.y),
                                          exactSum(q.z, -p.z)};
    };
    const auto volume = dot(from(point_, t.a), cross(from(point_, t.b), from(point_, t.c)));
    return (volume.high > 0) == (side > 0);
  }

  const MeshPoint& point(std::int32_t i) const {
    return mesh_.points()[static_cast<std::size_t>(i)];
  }

  const MeshIndex& mesh_;
  const Vec3d point_;
  int count_ = 0;
  tree::Pair found_[kCapacity + kRoom];
};

}  // namespace

MeshQuery::Nearest MeshQuery::nearest(const Segment& capsule, double limit) const {
  const MeshTree& tree = triangles_.mesh.tree();
  const Segment axis{capsule.a, capsule.b, 0};
  // Distances are measured up to rounding, so the search goes a little farther.
  const double unit = change_.mostScale() * (1 + 0x1p-20);
  const double in_tree = limit * unit;
  NearestTriangle visitor(axis, triangles_, unit);
  visitNearest(tree, change_.ofCapsule(axis, 0), 0, tree::kNoGroup,
               std::isfinite(in_tree) ? in_tree : std::numeric_limits<double>::infinity(), visitor);
  if (!(visitor.found.distance <= limit)) visitor.found.triangle = -1;
  return visitor.found;
}

bool MeshQuery::isInside(const Vec3d& point) const {
  const Vec3d start = to_mesh_(point);
  Box ray = inTree(Box::around(Segment{point, point, 0}, 0));
  ray.high[2] = std::numeric_limits<float>::infinity();
  Crossings crossings(triangles_.mesh, start);
  visitOverlaps(triangles_.mesh.tree(), ray, 0, tree::kNoGroup, crossings);
  return crossings.count() % 2 == 1;
}

}  // namespace fcl_fibers::index
