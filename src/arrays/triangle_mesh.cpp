// SPDX-License-Identifier: BSD-3-Clause
#include "arrays/triangle_mesh.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "arrays/coordinates.h"
#include "fibers/options.h"

namespace fcl_fibers {
namespace {

using fibers::throwInvalidArgument;
using geometry::AffineMap;
using geometry::MeshPoint;
using geometry::TriangleIndices;
using geometry::Vec3d;
using index::MeshIndex;

constexpr double kLargest = 0x1p1000;

template <typename S>
void checkSizes(const char* call, const MeshArrays<S>& arrays) {
  constexpr std::size_t kMost = std::size_t{1} << 27;
  const auto check = [&](const char* name, const void* array, std::size_t count,
                         const char* content) {
    if (count > kMost) {
      throwInvalidArgument(
          call, std::to_string(count) + " " + name + " are more than 2^27; use several meshes");
    }
    if (array == nullptr && count > 0) {
      throwInvalidArgument(call, std::string(name) + " are null; give " + content + " of " +
                                     std::to_string(count) + " " + name);
    }
  };
  check("points", arrays.points, arrays.point_count, "x, y, z");
  arrays::checkStrides(arrays,
                       [call](const std::string& what) { throwInvalidArgument(call, what); });
  check("triangles", arrays.triangles, arrays.triangle_count, "three indices");
}

template <typename S>
void checkPoints(const char* call, const MeshArrays<S>& arrays) {
  if (arrays::largestCoordinate(call, arrays, 0, arrays.point_count) > kLargest) {
    throwInvalidArgument(
        call,
        "a coordinate is beyond 2^1000; bring the mesh nearer to the origin or change its unit");
  }
}

template <typename S>
void checkTriangles(const MeshArrays<S>& arrays) {
  const std::int32_t* const begin = arrays.triangles;
  const std::int32_t* const end = begin + 3 * arrays.triangle_count;
  const std::int32_t* const bad = std::find_if(begin, end, [&](std::int32_t i) {
    return i < 0 || static_cast<std::size_t>(i) >= arrays.point_count;
  });
  if (bad == end) return;
  throwInvalidArgument("TriangleMesh::TriangleMesh",
                       "triangle " + std::to_string((bad - begin) / 3) + " has point " +
                           std::to_string(*bad) + " of " + std::to_string(arrays.point_count) +
                           "; give indices of 0 or more and less than point_count");
}

constexpr const char* kInsideOut =
    "the solid mesh is inside out: its triangles are clockwise seen from outside; exchange two "
    "points of each";

/// Refuses points that turn a solid mesh inside out.
template <typename S>
void checkSolid(const char* call, const MeshArrays<S>& arrays, const MeshIndex& mesh) {
  const auto pointOf = [&](std::int32_t i) {
    return arrays::pointOf(arrays, static_cast<std::size_t>(i));
  };
  if (mesh.points().empty()) return;
  const geometry::Frame frame{pointOf(0), mesh.frame().scale};
  const bool is_inside_out = index::faceInward(
      mesh.triangles(), [&](std::int32_t i) { return frame.fromWorld(pointOf(i)); });
  if (is_inside_out) throwInvalidArgument(call, kInsideOut);
}

template <typename S>
void readPoints(const MeshArrays<S>& arrays, std::vector<MeshPoint>& points) {
  for (std::size_t i = 0; i < arrays.point_count; ++i) {
    const Vec3d p = arrays::pointOf(arrays, i);
    points[i] = {{p.x, p.y, p.z, 0}};
  }
}

template <typename S>
MeshIndex makeIndex(const MeshArrays<S>& arrays, TriangleMesh::Kind kind) {
  checkSizes("TriangleMesh::TriangleMesh", arrays);
  checkPoints("TriangleMesh::TriangleMesh", arrays);
  checkTriangles(arrays);
  std::vector<TriangleIndices> triangles(arrays.triangle_count);
  for (std::size_t i = 0; i < arrays.triangle_count; ++i) {
    const std::int32_t* corner = arrays.triangles + 3 * i;
    triangles[i] = {corner[0], corner[1], corner[2]};
  }
  std::vector<MeshPoint> points(arrays.point_count);
  readPoints(arrays, points);
  if (kind == TriangleMesh::Kind::kSolid && index::firstLeak(triangles) >= 0) {
    throwInvalidArgument("TriangleMesh::TriangleMesh", "the solid mesh is not watertight: " +
                                                           index::leakProblem(points, triangles) +
                                                           ", or make it a surface");
  }
  MeshIndex mesh(std::move(points), std::move(triangles));
  if (kind == TriangleMesh::Kind::kSolid && index::isInsideOut(mesh)) {
    throwInvalidArgument("TriangleMesh::TriangleMesh", kInsideOut);
  }
  return mesh;
}

/// Returns another number each time, never 0.
std::uint64_t newVersion() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace

AffineMap toAffineMap(const MeshPose& pose) {
  const auto& [r, t] = pose;
  return {{{r[0], r[3], r[6]}, {r[1], r[4], r[7]}, {r[2], r[5], r[8]}}, {t[0], t[1], t[2]}};
}

const char* poseProblem(const MeshPose& pose) {
  constexpr double kTolerance = 5e-3;
  const auto& [x, y, z] = toAffineMap(pose).column;
  if (!isRotation(x, y, z, kTolerance)) {
    return "the rotation is not orthonormal or is a reflection; give a proper rotation";
  }
  for (const double coordinate : pose.position) {
    if (!(std::fabs(coordinate) <= kLargest)) {
      return "the position is NaN or beyond 2^1000; give smaller, finite numbers";
    }
  }
  return nullptr;
}

struct TriangleMesh::Impl {
  MeshIndex index;
  MeshReader::Version version;

  template <typename S>
  static std::shared_ptr<Impl> make(const MeshArrays<S>& arrays, Kind kind) {
    const std::uint64_t number = newVersion();
    return std::make_shared<Impl>(Impl{makeIndex(arrays, kind), {number, number}});
  }

  template <typename S>
  static void update(std::shared_ptr<Impl>& impl, const MeshArrays<S>& arrays, Kind kind) {
    checkSizes("TriangleMesh::update", arrays);
    const std::vector<TriangleIndices>& triangles = impl->index.triangles();
    if (arrays.point_count != impl->index.points().size() ||
        arrays.triangle_count != triangles.size() ||
        (!triangles.empty() && std::memcmp(arrays.triangles, triangles.data(),
                                           triangles.size() * sizeof(triangles[0])) != 0)) {
      throwInvalidArgument(
          "TriangleMesh::update",
          "the arrays have other triangles or another number of points than at the "
          "construction; construct a new mesh");
    }
    checkPoints("TriangleMesh::update", arrays);
    if (kind == Kind::kSolid) checkSolid("TriangleMesh::update", arrays, impl->index);
    if (impl.use_count() > 1) {
      impl = std::make_shared<Impl>(*impl);
    } else {
      // Another thread may have let go of the last copy a moment ago, after reading it. To copy
      // the pointer and let go of it orders those reads before what is written here.
      std::shared_ptr<Impl>(impl).reset();
    }
    impl->version.points = newVersion();
    impl->index.refitAfter([&](std::vector<MeshPoint>& points) { readPoints(arrays, points); });
  }
};

TriangleMesh::TriangleMesh(const MeshArrays<float>& arrays, Kind kind)
    : kind_(kind), impl_(Impl::make(arrays, kind)) {}
TriangleMesh::TriangleMesh(const MeshArrays<double>& arrays, Kind kind)
    : kind_(kind), impl_(Impl::make(arrays, kind)) {}
void TriangleMesh::update(const MeshArrays<float>& arrays) {
  impl_ = impl();
  Impl::update(impl_, arrays, kind_);
}
void TriangleMesh::update(const MeshArrays<double>& arrays) {
  impl_ = impl();
  Impl::update(impl_, arrays, kind_);
}

void TriangleMesh::setPose(const MeshPose& pose) {
  if (const char* problem = poseProblem(pose)) {
    throwInvalidArgument("TriangleMesh::setPose", problem);
  }
  pose_ = pose;
}

const std::shared_ptr<TriangleMesh::Impl>& TriangleMesh::impl() const {
  static const auto empty = std::make_shared<Impl>(Impl{MeshIndex({}, {}), {}});
  return impl_ != nullptr ? impl_ : empty;
}

std::size_t TriangleMesh::pointCount() const { return impl()->index.points().size(); }
std::size_t TriangleMesh::triangleCount() const { return impl()->index.triangles().size(); }
std::array<std::int32_t, 3> TriangleMesh::corners(std::int32_t triangle) const {
  requireTriangle("TriangleMesh::corners", *this, triangle);
  const TriangleIndices& points = impl()->index.triangles()[static_cast<std::size_t>(triangle)];
  return {points.a, points.b, points.c};
}
std::size_t TriangleMesh::memoryUsage() const { return impl()->index.memoryUsage(); }

index::PlacedMesh MeshReader::placed(const TriangleMesh& mesh) {
  return {mesh.impl()->index,
          toAffineMap(mesh.pose_),
          {mesh.categories_, mesh.meets_},
          mesh.kind() == TriangleMesh::Kind::kSolid};
}

MeshReader::Version MeshReader::version(const TriangleMesh& mesh) { return mesh.impl()->version; }

}  // namespace fcl_fibers
