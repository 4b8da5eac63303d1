// SPDX-License-Identifier: BSD-3-Clause
#include "mesh_file.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/io/mesh_file.h>

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

}  // namespace fcl_fibers::tools
