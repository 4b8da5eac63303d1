// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <vector>

#include <fcl/geometry/collision_geometry.h>
#include <fcl/math/triangle.h>

#include "broadphase/shape_box.h"
#include "index/mesh_index.h"

namespace fcl_fibers::broadphase {

/// What an `fcl::BVHModel` consists of, whatever its bounding volume. It borrows from the model.
template <typename S>
struct BvhTriangles {
  /// Whether it is a cloud of points.
  bool isCloud() const { return is_finished && triangle_count == 0; }

  /// Why the triangles are refused and the remedy; empty if they are not.
  std::string problem() const;

  const fcl::Vector3<S>* points = nullptr;
  const fcl::Triangle* triangles = nullptr;
  std::size_t point_count = 0, triangle_count = 0;
  bool is_finished = false;
};

/// @pre the model is of ObjectKind::kMesh
template <typename S>
BvhTriangles<S> trianglesOf(const fcl::CollisionGeometry<S>& model);

/// The indices of the points of one of FCL's triangles. FCL's accessor is compiled in libfcl only,
/// so it would cost a call for each index.
inline const std::size_t* indicesOf(const fcl::Triangle& triangle) {
  // Then a triangle and its only member have one address.
  static_assert(std::is_standard_layout_v<fcl::Triangle> &&
                sizeof(fcl::Triangle) == 3 * sizeof(std::size_t));
  return reinterpret_cast<const std::size_t*>(&triangle);
}

/// The triangles of a geometry as they were read, with their index. Objects, managers and clones
/// share it.
class Mesh {
 public:
  Mesh(std::vector<geometry::MeshPoint> points, std::vector<geometry::TriangleIndices> triangles);
  /// The same triangles between other points.
  Mesh(const Mesh& other, const std::vector<geometry::MeshPoint>& points);

  const index::MeshIndex& index() const { return index_; }
  const LocalBounds& bounds() const { return bounds_; }
  /// See index::firstLeak(). It is found once.
  index::TriangleId firstLeak() const;
  /// See index::isInsideOut(). It is found once for the same points.
  bool isInsideOut() const;
  void refit(const std::vector<geometry::MeshPoint>& points);
  std::size_t memoryUsage() const { return index_.memoryUsage(); }

 private:
  static constexpr index::TriangleId kUnknown = -2;

  index::MeshIndex index_;
  LocalBounds bounds_;
  mutable std::atomic<index::TriangleId> leak_{kUnknown};
  mutable std::atomic<int> is_inside_out_{kUnknown};
};

/// The meshes of a manager's objects and of its queries. Several threads may use it.
class MeshCache {
 public:
  /// The geometry of an object.
  using Model = std::shared_ptr<const void>;

  /// When a model that has its points and triangles where it had them has the same ones.
  enum class IsSame {
    kIfEqual,   ///< if a comparison finds no difference
    kInUpdate,  ///< if a comparison since the last beginUpdate() has found none
    kAlways,
  };

  /// Begins an update, after which models may differ from what was read.
  void beginUpdate();

  /// Returns the triangles of a model, or null if triangles.problem() tells why not. They are those
  /// that were read last if these are the same, and are read again if not.
  /// @pre there are triangles
  template <typename S>
  std::shared_ptr<const Mesh> read(const Model& model, const BvhTriangles<S>& triangles,
                                   IsSame is_same = IsSame::kIfEqual);

  /// Returns what was read last, or null.
  std::shared_ptr<const Mesh> find(const Model& model) const;
  /// Keeps what another manager has read.
  void keep(const Model& model, const std::shared_ptr<const Mesh>& mesh);

  /// Keeps what was read of a model, as if it had been asked for.
  void retain(const void* model);
  /// Forgets the meshes that nobody has asked for since the last call.
  void forgetUnused();
  /// Forgets a model that may be gone, unless its mesh is in use.
  void forget(const void* model);
  void clear();
  std::size_t size() const;  ///< number of models
  std::size_t memoryUsage() const;

 private:
  struct Slot {
    std::shared_ptr<Mesh> mesh;
    std::weak_ptr<const void> model;  ///< because another model may have its address later
    bool is_recent = true;
    /// Where the model had them when they were read last; null if they were not read from it.
    ///@{
    const void* points = nullptr;
    const void* triangles = nullptr;
    ///@}
    bool is_compared = false;  ///< since the last beginUpdate()
  };
  Slot& newSlot(const Model& model, std::shared_ptr<Mesh> mesh);

  mutable std::mutex mutex_;
  std::unordered_map<const void*, Slot> slots_;  ///< by the model's address
  std::size_t most_ = 16;  ///< with more slots those of models that are gone are looked for
};

/// Whether a mesh has just these points and triangles.
template <typename S>
bool isSame(const Mesh& mesh, const BvhTriangles<S>& triangles);
/// Whether it may: they are as many, and a few of the points are the same. Few programs change a
/// model without changing one of these.
template <typename S>
bool looksSame(const Mesh& mesh, const BvhTriangles<S>& triangles);

}  // namespace fcl_fibers::broadphase
