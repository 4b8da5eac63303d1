// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_manager_options.h>

#include "broadphase/mesh_cache.h"
#include "broadphase/object_members.h"
#include "broadphase/object_registry.h"
#include "geometry/obstacle.h"
#include "index/moving_mesh.h"
#include "index/segment_index.h"
#include "index/step.h"

namespace fcl_fibers::broadphase {

/// Whether objects count by more than their boxes, so that capsules touch them or not.
inline bool countsTriangles(const FiberManagerOptions& options) {
  return options.report == Report::kCapsules && options.bounds != Bounds::kObjects;
}

/// An object with a mesh, as it was read.
struct MeshReading {
  geometry::Segment box;             ///< around it and its margin, in the frame of the indexes
  std::shared_ptr<const Mesh> mesh;  ///< null for a cloud of points
  bool counts_triangles = false;     ///< if not, only the box counts
  geometry::AffineMap pose;
  double margin = 0;  ///< that the program has added, in the world's unit

  /// @pre counts_triangles
  index::PosedMesh posed(tree::Categories categories, bool is_solid) const {
    // A mesh without categories meets other obstacles, and the rules leave out the fibers.
    const tree::Categories searched = categories != 0 ? categories : tree::kAllCategories;
    return {mesh->index(), pose, searched, is_solid, margin};
  }
};

/// The trees of a mesh during a step, which are made for the first query that needs them. Several
/// threads may ask.
class MovingMeshOnDemand {
 public:
  /// All calls have the same start and end. It keeps the mesh for the frame of the last call.
  std::shared_ptr<const index::MovingMesh> get(const index::PosedMesh& start,
                                               const index::PosedMesh& end,
                                               const geometry::Frame& frame,
                                               parallel::Executor* executor);
  std::size_t memoryUsage() const;

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const index::MovingMesh> mesh_;
};

/// Returns the name of an object, for an error text.
using NameOfObject = std::function<std::string()>;

/// Reads an object with a mesh. Throws std::invalid_argument with name() if it is refused, which it
/// also is if `is_solid` is set and the mesh leaks.
/// @pre isMesh(object)
template <typename S>
MeshReading readMesh(const char* call, const fcl::CollisionObject<S>& object, bool is_solid,
                     const geometry::Frame& frame, Bounds bounds, MeshCache& cache,
                     const NameOfObject& name);

/// Reads the pose and margin of an object whose mesh has been read.
/// @pre reading.mesh is not null, and the pose is proper
template <typename S>
void placeMesh(const fcl::CollisionObject<S>& object, const geometry::Frame& frame, Bounds bounds,
               MeshReading& reading);

/// The objects of a manager that count by more than a segment or a box: meshes, which are in no
/// tree of segments, and other shapes, which are in it as boxes. Both are in the order of their
/// ids.
template <typename S>
class Obstacles {
 public:
  using Object = fcl::CollisionObject<S>;

  struct MeshEntry : MeshReading {
    Object* object;
    SegmentId id;
    tree::Categories categories;
    bool is_solid;
    bool is_read = false;

    // If meshes move:
    MeshReading start = {};      ///< at the start of the step, with the same triangles
    geometry::Frame frame = {};  ///< of both boxes
    /// Copies of the entry share it.
    std::shared_ptr<MovingMeshOnDemand> trees = std::make_shared<MovingMeshOnDemand>();

    index::PosedMesh posed() const { return MeshReading::posed(categories, is_solid); }
    /// @pre countsMovingTriangles(); the entry lives as long as the result
    std::shared_ptr<const index::MovingMesh> moving(const geometry::Frame& its_frame,
                                                    parallel::Executor* executor) const {
      return trees->get(start.posed(categories, is_solid), posed(), its_frame, executor);
    }
    /// Gives up the trees, because the start or the end will change.
    void forgetTrees() { trees = std::make_shared<MovingMeshOnDemand>(); }
    /// Whether triangles count during the whole step.
    bool countsMovingTriangles() const { return counts_triangles && start.counts_triangles; }
    geometry::MovingSegment movingBox() const { return {start.box, box}; }
  };

  struct ShapeEntry {
    Object* object;
    SegmentId id;
    bool is_read = false;
    geometry::Obstacle shape;  ///< in the frame of the indexes
    /// In the world's frame at the start and at the end of a step, if shapes move.
    geometry::Obstacle start, end;
  };

  explicit Obstacles(const FiberManagerOptions& options);

  // --- Changing ---

  void reserve(std::size_t count);
  /// @pre there is room; the ids ascend
  void add(Object* object, SegmentId id, tree::Categories categories, bool is_solid);
  void remove(SegmentId id);
  /// Takes new ids of the same objects.
  void renumber(const ObjectRegistry<S>& registry);
  void clear();
  /// Begins a step where the present one ends.
  void beginStep() {
    for (ShapeEntry& entry : shapes_) entry.start = entry.end;
    for (MeshEntry& entry : meshes_) {
      entry.start = entry;
      entry.forgetTrees();
    }
    start_boxes_ = nullptr;
  }
  /// Adds the object that replaces one of another manager. The cache has the triangles of that one,
  /// which both share if they are the same.
  void addCopy(const Obstacles& other, Object* object, SegmentId id, tree::Categories categories);

  // --- Reading ---
  // `name(id)` returns the name of an object.

  template <class Name>
  void readAll(const char* call, const geometry::Frame& frame, Name&& name) {
    letGoOfMeshes();
    for (MeshEntry& entry : meshes_) readNamed(call, entry, frame, name, entry.id);
    for (ShapeEntry& entry : shapes_) read(entry, frame);
    finishReading(frame);
  }
  /// Reads those that have not been read yet.
  template <class Name>
  void readNew(const char* call, const geometry::Frame& frame, Name&& name) {
    for (MeshEntry& entry : meshes_) {
      if (!entry.is_read) readNamed(call, entry, frame, name, entry.id);
    }
    for (ShapeEntry& entry : shapes_) {
      if (!entry.is_read) read(entry, frame);
    }
    finishReading(frame);
  }
  /// Reads those of these objects that have been read before.
  /// @param ids    of objects
  /// @param name   name(i) names the object with the i-th id
  template <class Name>
  void readSome(const char* call, const std::vector<SegmentId>& ids, const geometry::Frame& frame,
                Name&& name) {
    if (empty()) return;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (MeshEntry* mesh = find(meshes_, ids[i]); mesh != nullptr && mesh->is_read) {
        if (!moves_) mesh->mesh.reset();
        readNamed(call, *mesh, frame, name, i);
      }
      ShapeEntry* shape = find(shapes_, ids[i]);
      if (shape != nullptr && shape->is_read) read(*shape, frame);
    }
    finishReading(frame);
  }

  /// Whether meshes are as they were read.
  bool isCurrent(const geometry::Frame& frame) const;

  // --- Asking ---

  bool empty() const { return meshes_.empty() && shapes_.empty(); }
  bool hasShapes() const { return !shapes_.empty(); }
  const std::vector<MeshEntry>& meshes() const { return meshes_; }
  bool isMesh(SegmentId id) const { return find(meshes_, id) != nullptr; }
  const MeshEntry* mesh(SegmentId id) const { return find(meshes_, id); }
  /// Null if only the box of the object counts.
  const ShapeEntry* shape(SegmentId id) const { return find(shapes_, id); }

  /// Searches among the boxes of the meshes, as MovingIndex does. Ids are positions in meshes()
  /// when they were read last.
  ///@{
  tree::Visit searchBoxes(index::PairSink& sink) const {
    return moves_ ? boxStep().searchImpacts(nullptr, sink) : boxes_.search(sink);
  }
  tree::Visit searchBoxes(index::NearestSink& sink) const { return boxes_.search(sink); }
  tree::Visit searchBoxes(const geometry::MovingSegment& segment, double error,
                          index::PairSink& sink) const {
    return moves_ ? boxStep().searchImpacts(segment, error, tree::kNoGroup, 0, nullptr, sink)
                  : boxes_.search(segment.end, error, tree::kNoGroup, 0, sink);
  }
  tree::Visit searchBoxes(const geometry::MovingSegment& segment, double error,
                          index::NearestSink& sink) const {
    return boxes_.search(segment.end, error, tree::kNoGroup, 0, sink);
  }
  ///@}
  /// The mesh of an id in boxes(), or null if it was removed.
  const MeshEntry* ofBox(SegmentId id) const { return find(meshes_, box_ids_[boxIndex(id)]); }

  MeshCache& cache() const { return cache_; }
  std::size_t memoryUsage() const;

 private:
  template <class Entries>
  static auto find(Entries& entries, SegmentId id) -> decltype(entries.data()) {
    const auto found =
        std::lower_bound(entries.begin(), entries.end(), id,
                         [](const auto& entry, SegmentId other) { return entry.id < other; });
    return found == entries.end() || found->id != id ? nullptr : &*found;
  }
  static std::size_t boxIndex(SegmentId id) { return static_cast<std::size_t>(id); }

  template <class Name, class Number>
  void readNamed(const char* call, MeshEntry& entry, const geometry::Frame& frame, const Name& name,
                 Number number) {
    read(call, entry, frame, [&name, number] { return name(number); });
  }
  void read(const char* call, MeshEntry& entry, const geometry::Frame& frame,
            const NameOfObject& name);
  void read(ShapeEntry& entry, const geometry::Frame& frame);
  void finishReading(const geometry::Frame& frame);
  /// Meshes that nobody holds are refitted in place. A step holds them.
  void letGoOfMeshes() {
    if (moves_) return;
    for (MeshEntry& entry : meshes_) entry.mesh.reset();
  }
  index::Step boxStep() const { return {start_boxes_ ? *start_boxes_ : boxes_, boxes_}; }

  const Bounds bounds_;
  const bool moves_;
  std::vector<MeshEntry> meshes_;
  std::vector<ShapeEntry> shapes_;
  index::SegmentIndex boxes_;
  std::unique_ptr<index::SegmentIndex> start_boxes_;  ///< null if all rest
  std::vector<SegmentId> box_ids_;                    ///< by id in boxes_: that of the object
  mutable MeshCache cache_;
};

extern template class Obstacles<float>;
extern template class Obstacles<double>;

}  // namespace fcl_fibers::broadphase
