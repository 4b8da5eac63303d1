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

  /// Reads Wavefront OBJ files. Throws an exception, with the path, if one is not what it should
  /// be.
  std::vector<MeshFile> read() const;

  /// By fiber, the segments at its start that are roots by one of the two options. Empty if
  /// there is neither a path nor a root.
  std::vector<std::int32_t> roots(const FiberPolylines& scene) const;
};

/// Warns, in one line, if fibers and meshes are probably not in the same unit or frame: one is a
/// hundred times as large as the other, or a box around the fibers does not meet one around the
/// meshes. Does nothing if there is no mesh.
/// @param margin  within which they would touch
/// @param name    of the fibers
void warnOfMeshSize(const FiberPolylines& fibers, const std::vector<MeshFile>& meshes,
                    double margin, const std::string& name);

}  // namespace fcl_fibers::tools
