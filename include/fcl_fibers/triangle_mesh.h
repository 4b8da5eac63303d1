// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include <fcl_fibers/tree_export.h>

namespace fcl_fibers {

/// Triangles as plain arrays, which TriangleMesh reads. The arrays are borrowed for the length of a
/// call. S is float or double.
///
///     const double points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};  // x, y, z of three points
///     const std::int32_t triangles[] = {0, 1, 2};           // one triangle
///     const MeshArrays<double> mesh = {points, 3, triangles, 1};
template <typename S>
struct MeshArrays {
  /// x, y, z of each point: 3 * point_count numbers of magnitudes up to 2^1000.
  const S* points = nullptr;
  std::size_t point_count = 0;  ///< at most 2^27
  /// Indices of the three points of each triangle: 3 * triangle_count numbers of 0 to
  /// point_count - 1. A triangle may be a needle or a point.
  const std::int32_t* triangles = nullptr;
  std::size_t triangle_count = 0;   ///< at most 2^27
  std::ptrdiff_t point_stride = 0;  ///< bytes between points, 0 if packed; as in FiberArrays
  std::ptrdiff_t axis_stride = 0;   ///< bytes from x to y, 0 if packed; as in FiberArrays
};

/// Where a mesh is: a point p of the mesh is at rotation * p + position in the frame of the fibers.
struct MeshPose {
  std::array<double, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< 3 x 3, row by row
  std::array<double, 3> position = {0, 0, 0};                    ///< x, y, z
};

/// A triangle mesh that fibers may touch, such as a head or a part of a machine: triangles, a tree
/// of boxes over them, and a pose. FiberTree::visit() finds its `Pairs`. This header needs neither
/// FCL nor Eigen.
///
///     TriangleMesh head(arrays);
///     head.setPose({rotation, position});  // the tree is in the mesh's own frame
///     tree.visit(Pairs{}, head, [&](TrianglePair pair) { ... });
///
/// Copies share triangles and tree, so one mesh may be at many places. Different copies may be
/// changed and queried from several threads. A visitor may change or destroy the mesh that its
/// query reads, which goes on with the mesh as it was. A mesh that was moved from has no triangles
/// and keeps its kind, pose and categories.
class FCL_FIBERS_TREE_EXPORT TriangleMesh {
 public:
  /// What a mesh is.
  enum class Kind {
    kSurface,  ///< its triangles alone; a capsule wholly inside does not touch it
    kSolid,    ///< also what they enclose; a capsule inside touches it
  };

  /// Reads the arrays and builds the tree. A mesh without triangles touches nothing.
  ///
  /// Throws std::invalid_argument if an array of a count above 0 is null, if a count or a number is
  /// out of range, or if a solid mesh is not watertight. If a point is NaN, or a triangle names a
  /// point that is not there or has an open edge, the text tells which. A mesh is watertight if
  /// each edge of a triangle is that of exactly one other triangle, which names its two points in
  /// the opposite order. Seen from outside, the points of its triangles are counterclockwise. A
  /// solid whose volume is negative is refused; of several bodies, the sum of the volumes counts.
  ///@{
  explicit TriangleMesh(const MeshArrays<float>& arrays, Kind kind = Kind::kSurface);
  explicit TriangleMesh(const MeshArrays<double>& arrays, Kind kind = Kind::kSurface);
  ///@}

  /// Reads the points again after they have moved, and refits the tree. S may differ from that of
  /// the construction. Copies keep the points that they had. Throws std::invalid_argument and
  /// changes nothing if the arrays have other triangles or another number of points than at the
  /// construction, if a coordinate is NaN or out of range, or if a solid mesh is turned inside out.
  ///@{
  void update(const MeshArrays<float>& arrays);
  void update(const MeshArrays<double>& arrays);
  ///@}

  /// Places the mesh in the frame of the fibers. Throws std::invalid_argument and changes nothing
  /// if the rotation is a reflection, if a product of two of its columns differs from that of an
  /// orthonormal matrix by more than 5e-3, or if a number is NaN or its magnitude exceeds 2^1000.
  void setPose(const MeshPose& pose);
  const MeshPose& pose() const { return pose_; }  ///< the pose that was set last

  /// Sets the categories of this mesh, and those of the fibers that it meets, as bits. A fiber and
  /// the mesh meet only if each has a category that the other one meets: (fiber.categories &
  /// mesh.meets) != 0 && (mesh.categories & fiber.meets) != 0. All bits are set at first.
  ///@{
  void setCategories(std::uint32_t bits) { categories_ = bits; }
  void setMeets(std::uint32_t bits) { meets_ = bits; }
  ///@}
  std::uint32_t categories() const { return categories_; }  ///< as set last
  std::uint32_t meets() const { return meets_; }            ///< as set last

  Kind kind() const { return kind_; }  ///< as given at construction
  std::size_t pointCount() const;      ///< number of points
  std::size_t triangleCount() const;   ///< number of triangles

  /// Returns the indices of a triangle's three points, in their order. Throws std::invalid_argument
  /// if there is no such triangle.
  std::array<std::int32_t, 3> corners(std::int32_t triangle) const;

  /// Returns the bytes of triangles and tree, which copies share.
  std::size_t memoryUsage() const;

 private:
  friend struct MeshReader;
  struct FCL_FIBERS_TREE_NO_EXPORT Impl;
  FCL_FIBERS_TREE_NO_EXPORT const std::shared_ptr<Impl>& impl() const;

  Kind kind_;
  std::shared_ptr<Impl> impl_;  ///< shared by copies; null after a move
  MeshPose pose_;
  std::uint32_t categories_ = ~std::uint32_t{0}, meets_ = ~std::uint32_t{0};
};

}  // namespace fcl_fibers
