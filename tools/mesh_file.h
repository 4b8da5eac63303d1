// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/triangle_mesh.h>

namespace fcl_fibers::tools {

/// A mesh from a file.
struct MeshFile {
  std::string name;  ///< of the file, without its folders
  std::vector<Point> points;
  std::vector<std::int32_t> triangles;  ///< three points each
  TriangleMesh mesh;
};

/// The meshes that the command line names, and which segments meet none.
struct MeshOptions {
  std::vector<std::string> paths;
  bool solid = false;
  double root_length = 0;
  std::int32_t root_segments = 0;

  /// Throws std::invalid_argument, with the path, if a file is not what it should be.
  std::vector<MeshFile> read() const;

  /// By fiber, the segments at its start that are roots by one of the two options. Empty if
  /// there is neither a path nor a root.
  std::vector<std::int32_t> roots(const FiberPolylines& scene) const;
};

/// Reads a Wavefront OBJ file. Faces of more than three points are cut into triangles, which count
/// in the order of the faces. Throws std::invalid_argument, as above.
MeshFile readMesh(const std::string& path, TriangleMesh::Kind kind);

}  // namespace fcl_fibers::tools
