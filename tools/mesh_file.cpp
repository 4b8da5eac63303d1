// SPDX-License-Identifier: BSD-3-Clause
#include "mesh_file.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/io/mesh_file.h>
#include <fmt/format.h>

#include "bounds.h"
#include "messages.h"

namespace fcl_fibers::tools {
namespace {

MeshFile readMesh(const std::string& path, TriangleMesh::Kind kind) {
  io::MeshFile file = io::readMesh(path);
  try {
    TriangleMesh mesh(meshArrays(file), kind);
    return {readable(std::filesystem::path(path).filename().string()), std::move(file.points),
            std::move(file.triangles), std::move(mesh)};
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("'" + path + "': " + error.what());
  }
}

constexpr double kOtherUnit = 100;  ///< in sizes

double sizeOf(const Bounds& box) {
  return std::hypot(box.high[0] - box.low[0], box.high[1] - box.low[1], box.high[2] - box.low[2]);
}

bool meet(const Bounds& a, const Bounds& b, double distance) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (a.low[k] - distance > b.high[k] || b.low[k] - distance > a.high[k]) return false;
  }
  return true;
}

}  // namespace

std::vector<MeshFile> MeshOptions::read() const {
  std::vector<MeshFile> meshes;
  for (const std::string& path : paths) {
    meshes.push_back(
        readMesh(path, solid ? TriangleMesh::Kind::kSolid : TriangleMesh::Kind::kSurface));
  }
  return meshes;
}

std::vector<std::int32_t> MeshOptions::roots(const FiberPolylines& scene) const {
  if (paths.empty() && root_length == 0 && root_segments == 0) return {};
  std::vector<std::int32_t> counts = rootSegments(fiberArrays(scene), root_length);
  for (std::int32_t& count : counts) count = std::max(count, root_segments);
  return counts;
}

void warnOfMeshSize(const FiberPolylines& fibers, const std::vector<MeshFile>& meshes,
                    double margin, const std::string& name) {
  if (meshes.empty() || fibers.points.empty()) return;
  Bounds of_fibers, of_meshes;
  for (const Point& point : fibers.points) of_fibers.add(point);
  for (const MeshFile& mesh : meshes) {
    // Files may have points that no triangle has.
    for (const std::int32_t i : mesh.triangles) {
      of_meshes.add(mesh.points[static_cast<std::size_t>(i)]);
    }
  }
  const double ratio = sizeOf(of_meshes) / sizeOf(of_fibers);
  const bool have_sizes = ratio > 0 && std::isfinite(ratio);
  if (have_sizes && (ratio >= kOtherUnit || ratio <= 1 / kOtherUnit)) {
    warn(name, fmt::format("the {} about {:.3g} times as large as the {}; they have to be in the "
                           "same unit",
                           ratio > 1 ? "meshes are" : "fibers are", ratio > 1 ? ratio : 1 / ratio,
                           ratio > 1 ? "fibers" : "meshes"));
    return;
  }
  double radius = fibers.radius;
  for (const double r : fibers.radii) radius = std::max(radius, r);
  if (meet(of_fibers, of_meshes, radius + margin)) return;
  warn(
      name,
      "the fibers and the meshes are apart, because boxes around them do not meet; they have to be "
      "in the same frame and unit");
}

}  // namespace fcl_fibers::tools
