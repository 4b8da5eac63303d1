// SPDX-License-Identifier: BSD-3-Clause
#include "index/posed_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/double_double.h"
#include "geometry/impact.h"
#include "geometry/moving_box.h"
#include "geometry/touch.h"
#include "geometry/triangle_distance.h"
#include "tree/search.h"

namespace fcl_fibers::index {

using geometry::AffineMap;
using geometry::Box;
using geometry::DoubleDouble;
using geometry::exactSum;
using geometry::Frame;
using geometry::MeshPoint;
using geometry::MovingSegment;
using geometry::Segment;
using geometry::Vec3d;
using tree::SegmentId;
using tree::Visit;

namespace {

AffineMap scaled(AffineMap map, double scale) {
  for (Vec3d& column : map.column) column = scale * column;
  return map;
}

/// From the mesh's coordinates to a frame.
AffineMap posingOf(const PlacedMesh& placed, const Frame& frame) {
  AffineMap posing = scaled(placed.pose, frame.scale);
  posing.shift = frame.fromWorld(placed.pose.shift);
  return posing;
}

AffineMap fromTreeOf(const MeshIndex& mesh, const AffineMap& posing) {
  AffineMap from_tree = scaled(posing, 1 / mesh.frame().scale);
  from_tree.shift = posing(mesh.frame().origin);
  return from_tree;
}

/// A point carries three products, their sums and the shift, which is rounded twice.
double errorOf(const PlacedMesh& placed, const Frame& frame, const AffineMap& posing) {
  constexpr double kError = 16 * std::numeric_limits<double>::epsilon();
  return kError * (frame.scale * placed.mesh.reach() + maxNorm(posing.shift));
}

/// The inverse stretches nothing by twice as much as it stretches the first axis.
geometry::PosedChange<Box> changeTo(const AffineMap& to_tree, double error) {
  return {to_tree, error * 2 * safeNorm(to_tree.column[0])};
}

class NearestTriangle final : public tree::NearestVisitor {
 public:
  NearestTriangle(const Segment& capsule, const PosedTriangles& triangles, double to_tree)
      : capsule_(capsule), triangles_(triangles), to_tree_(to_tree) {}

  Visit visit(SegmentId triangle, SegmentId /*capsule*/, double& limit) override {
    const geometry::Triangle posed = triangles_[triangle];
    // This settles most triangles of which only the boxes are that near.
    if (!axisWithin(capsule_, posed, found.distance)) return Visit::kContinue;
    const geometry::ClosestOnTriangle closest = closestPoints(capsule_, posed);
    const double thinner = capsule_.radius - capsule_.radiusAt(closest.s);
    const double distance = safeNorm(closest.apart) + thinner;
    if (distance < found.distance) {
      found = {triangle, distance};
      limit = std::min(limit, distance * to_tree_);
    }
    return Visit::kContinue;
  }

  PosedTriangles::Nearest found{-1, std::numeric_limits<double>::infinity()};

 private:
  const Segment& capsule_;
  const PosedTriangles& triangles_;
  const double to_tree_;
};

/// A vertical line through a point, against the triangles of a mesh. Differences are taken into the
/// scale of the mesh's frame, or products of two and three of them would overflow or vanish.
class VerticalLine {
 public:
  VerticalLine(const MeshIndex& mesh, const Vec3d& point)
      : mesh_(mesh), point_(point), scale_(mesh.frame().scale) {}

  /// Whether the part above the point crosses a triangle.
  bool crosses(TriangleId id) const {
    const geometry::TriangleIndices& t = mesh_.triangles()[static_cast<std::size_t>(id)];
    const std::int32_t corners[3] = {t.a, t.b, t.c};
    int sides[3];
    for (int k = 0; k < 3; ++k) {
      // Both triangles at an edge must see it alike.
      const auto [low, high] = std::minmax(corners[k], corners[(k + 1) % 3]);
      const int side = sideOf(point(low), point(high));
      sides[k] = corners[k] == low ? side : -side;
      if (side == 0) return false;
    }
    return sides[0] == sides[1] && sides[1] == sides[2] && isAbove(id, sides[0]);
  }

 private:
  /// The exact difference, scaled.
  DoubleDouble difference(double to, double from) const {
    const DoubleDouble exact = exactSum(to, -from);
    return {scale_ * exact.high, scale_ * exact.low};
  }

  /// The sign of the area that two points of a mesh span with the line: 1 or -1, or 0 if both are
  /// on one vertical line.
  int sideOf(const MeshPoint& a, const MeshPoint& b) const {
    const auto *const m = a.numbers, *const n = b.numbers;
    const DoubleDouble area = difference(m[0], point_.x) * difference(n[1], point_.y) -
                              difference(m[1], point_.y) * difference(n[0], point_.x);
    if (area.high != 0) return area.high > 0 ? 1 : -1;
    if (m[1] != n[1]) return m[1] > n[1] ? 1 : -1;
    return m[0] == n[0] ? 0 : n[0] > m[0] ? 1 : -1;
  }

  /// Whether a triangle that the line crosses is above the point.
  bool isAbove(TriangleId id, int side) const {
    const geometry::Triangle t = mesh_.triangle(id);
    // The point may be so far out that a scaled difference overflows.
    if (point_.z < std::min({t.a.z, t.b.z, t.c.z})) return true;
    if (point_.z > std::max({t.a.z, t.b.z, t.c.z})) return false;
    const auto toPoint = [this](const Vec3d& q) {
      return geometry::Vec3<DoubleDouble>{difference(q.x, point_.x), difference(q.y, point_.y),
                                          difference(q.z, point_.z)};
    };
    const auto volume = dot(toPoint(t.a), cross(toPoint(t.b), toPoint(t.c)));
    return (volume.high > 0) == (side > 0);
  }

  const MeshPoint& point(std::int32_t i) const {
    return mesh_.points()[static_cast<std::size_t>(i)];
  }

  const MeshIndex& mesh_;
  const Vec3d point_;
  const double scale_;
};

bool rests(const PlacedMesh& start, const PlacedMesh& end) {
  return &start.mesh == &end.mesh && start.pose == end.pose;
}

}  // namespace

bool fitsIn(const Frame& frame, const PlacedMesh& placed) {
  const double most = placed.mesh.reach() + maxNorm(placed.pose.shift) + maxNorm(frame.origin);
  return std::isfinite(frame.scale * (16 * most));
}

PosedTriangles::PosedTriangles(const PlacedMesh& placed, const Frame& frame)
    : placed_(placed),
      posing_(posingOf(placed, frame)),
      from_tree_(fromTreeOf(placed.mesh, posing_)),
      to_mesh_(posing_.inverse()),
      error_(errorOf(placed, frame, posing_)),
      to_tree_(changeTo(from_tree_.inverse(), error_)) {}

bool PosedTriangles::isFarFromOverflow() const { return std::isfinite(error_ * 0x1p60); }

bool PosedTriangles::touches(const Segment& segment, double its_error, TriangleId id,
                             double margin) const {
  const geometry::Triangle triangle = (*this)[id];
  if (segment.isBox()) {
    return boxesTouch(segment, boxAround(triangle), margin + its_error + error_);
  }
  return touch(segment, triangle, margin, std::max(endPointError(segment), its_error) + error_);
}

PosedTriangles::Nearest PosedTriangles::nearest(const Segment& capsule, double limit) const {
  const Segment axis{capsule.a, capsule.b, 0};
  // Distances are measured up to rounding, so the search goes a little farther.
  const double unit = to_tree_.mostScale() * (1 + 0x1p-20);
  const double in_tree = limit * unit;
  NearestTriangle visitor(capsule, *this, unit);
  visitNearest(mesh().tree(), to_tree_.ofCapsule(axis, 0), 0, tree::kNoGroup,
               std::isfinite(in_tree) ? in_tree : std::numeric_limits<double>::infinity(), visitor);
  if (!(visitor.found.distance <= limit)) visitor.found.triangle = -1;
  return visitor.found;
}

bool PosedTriangles::isInside(const Vec3d& point) const {
  const VerticalLine line(mesh(), to_mesh_(point));
  Box ray = inTree(Box::around(Segment{point, point, 0}, 0));
  ray.high[2] = std::numeric_limits<float>::infinity();
  bool is_inside = false;
  visitOverlapping(mesh().tree(), ray, [&](TriangleId id) {
    is_inside ^= line.crosses(id);
    return Visit::kContinue;
  });
  return is_inside;
}

Box PosedTriangles::boxOf(const Segment& segment, double padding) const {
  return segment.isBox() || !isBounded(segment)
             ? to_tree_(geometry::volumeAround<Box>(segment, padding))
             : to_tree_.ofCapsule(segment, padding);
}

PosedMesh::PosedMesh(const PlacedMesh& start, const PlacedMesh& end, const Frame& frame,
                     parallel::Executor* executor)
    : frame_(frame), start_(start, frame), end_(end, frame) {
  const auto treeOf = [&](const PosedTriangles& triangles) {
    return end.mesh.posedTree(triangles.mesh().points(), triangles.posing(), executor);
  };
  start_tree_ = treeOf(start_);
  if (!rests(start, end)) end_tree_ = treeOf(end_);
}

std::size_t PosedMesh::memoryUsage() const {
  std::size_t bytes = sizeof(*this);
  for (const auto* tree : {&start_tree_, &end_tree_}) bytes += *tree ? (*tree)->memoryUsage() : 0;
  return bytes;
}

bool touches(const PosedMesh& mesh, const Segment& segment, double margin, double error) {
  if (mesh.empty()) return false;
  const PosedTriangles& triangles = mesh.end();
  margin += triangles.placed().margin * mesh.frame().scale;
  const Box box = triangles.boxOf(segment, margin + error + triangles.error());
  const auto stopIfTouching = [&](TriangleId id) {
    return triangles.touches(segment, error, id, margin) ? Visit::kStop : Visit::kContinue;
  };
  return visitOverlapping(triangles.mesh().tree(), box, stopIfTouching) == Visit::kStop ||
         (mesh.isSolid() && isBounded(segment) && triangles.isInside(segment));
}

bool findImpact(const PosedMesh& mesh, const MovingSegment& segment, double margin, double error,
                MeshImpact& impact) {
  if (mesh.empty()) return false;
  margin += mesh.margin() * mesh.frame().scale;
  error += mesh.error();
  const double growth = std::max(margin, 0.0) + error;
  const geometry::MovingBox box{geometry::volumeAround<Box>(segment.start, growth),
                                geometry::volumeAround<Box>(segment.end, growth)};
  impact = {std::numeric_limits<double>::infinity(), -1};
  visitOverlapping(mesh.tree(), box, [&](TriangleId id) {
    geometry::TriangleImpact found;
    if (findImpact(segment, mesh[id], margin, error, 0, found) &&
        (found.time < impact.time || (found.time == impact.time && id < impact.triangle))) {
      impact = {found.time, id};
    }
    return Visit::kContinue;
  });
  // What is inside a solid at the start touches it, although it may touch no triangle.
  const Segment& first = segment.start;
  if (mesh.isSolid() && impact.time > 0 && isBounded(first) && mesh.start().isInside(first)) {
    constexpr double kAny = std::numeric_limits<double>::max();
    const Vec3d middle = midpoint(first);
    const Segment axis = first.isBox() ? Segment{middle, middle, 0} : first;
    impact = {0, mesh.start().nearest(axis, kAny).triangle};
  }
  return impact.triangle >= 0;
}

}  // namespace fcl_fibers::index
