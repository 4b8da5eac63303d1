// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/io/export.h>
#include <fcl_fibers/triangle_mesh.h>

namespace fcl_fibers::io {

/// The triangles of a file, in the file's unit of length and frame.
struct MeshFile {
  std::vector<Point> points;  ///< all of the file, in its order
  /// Indices of the three points of each triangle, in the order of the faces. They run around a
  /// triangle in the direction in which the file runs around its face.
  std::vector<std::int32_t> triangles;
};

/// Returns the arrays that TriangleMesh reads. They are those of `mesh`. Keep it until its points
/// are no longer read.
inline MeshArrays<double> meshArrays(const MeshFile& mesh) {
  return {mesh.points.empty() ? nullptr : mesh.points.front().data(), mesh.points.size(),
          mesh.triangles.data(), mesh.triangles.size() / 3};
}

/// Reads the points and faces of a Wavefront OBJ file, also packed by gzip, and passes over all
/// else.
///
///     const MeshFile file = readMesh("head.obj");
///     const TriangleMesh head(meshArrays(file), TriangleMesh::Kind::kSolid);
///
/// A face of n points becomes n - 2 triangles, which cover once what the face surrounds. The face
/// need not be convex. Its outline may touch itself. It may also pass an edge to and fro, as in
/// faces with holes. If it goes round several times, one round counts.
///
/// Triangles have no area where points are repeated, and where the outline goes back on its own
/// line. If all points of a face are on one line, or at one place, its triangles are there, too.
///
/// A face that is not flat is cut as it looks along the axis that is nearest to its normal. If a
/// quadrangle seems to cross itself from there, but does not in space, it is cut along its shorter
/// diagonal.
///
/// On which side of a line a point lies is decided exactly, whatever the coordinates are. Files
/// round coordinates, so a face may cross itself a little: up to 2^-20 of its coordinates, and at
/// most 2^-10 of its size, it counts as one that touches itself.
///
/// Throws std::runtime_error with the file's name and the reason if the file cannot be read, has no
/// face, or is malformed. If it is malformed, the text also has the line. A file is malformed if a
/// face crosses itself, has fewer than three points or names a point that is not in the file, or if
/// a coordinate is no finite number.
///
/// The time for a face of n points grows with n^2 at most. Reading takes memory of at most 100
/// times the size of the file. Only a file of a single face needs so much; others need 12 times
/// their size.
FCL_FIBERS_IO_EXPORT MeshFile readMesh(const std::string& path);

/// Reads the bytes of a file that is already in memory. `name` stands for the path in messages.
FCL_FIBERS_IO_EXPORT MeshFile parseMesh(std::string_view bytes, const std::string& name);

}  // namespace fcl_fibers::io
