// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_manager_options.h>

#include "broadphase/beside_boxes.h"
#include "broadphase/by_id.h"
#include "broadphase/mesh_cache.h"
#include "broadphase/object_reader.h"
#include "broadphase/object_registry.h"
#include "geometry/obstacle.h"
#include "index/moving_mesh.h"

namespace fcl_fibers::broadphase {

/// An object beside the tree, as it was read.
struct BesideReading {
  /// Around it and its margin, in the frame of the indexes.
  geometry::Segment box = geometry::Segment::box({0, 0, 0}, {0, 0, 0});
  std::shared_ptr<const Mesh> mesh;  ///< null for a cloud of points and for another shape
  bool counts_triangles = false;     ///< if not, only the box and the shape count
  const void* model = nullptr;       ///< the geometry that the mesh was read from
  geometry::AffineMap pose;          ///< of a mesh
  double margin = 0;                 ///< that the program has added to a mesh, in the world's unit

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

/// Reads an object with a mesh. Throws RefusedObject, also if `is_solid` is set and the mesh leaks.
/// @pre isMesh(object)
template <typename S>
BesideReading readMesh(const fcl::CollisionObject<S>& object, bool is_solid,
                       const geometry::Frame& frame, Bounds bounds, MeshCache& cache,
                       SegmentId place = 0);

/// Reads the pose and margin of an object whose mesh has been read.
/// @pre reading.mesh is not null, and the pose is proper
template <typename S>
void placeMesh(const fcl::CollisionObject<S>& object, const geometry::Frame& frame, Bounds bounds,
               BesideReading& reading);

/// The objects of a manager that are beside its tree, and the shapes that are in the tree as boxes.
template <typename S>
class Obstacles {
 public:
  using Object = fcl::CollisionObject<S>;

  struct BesideEntry : BesideReading {
    Object* object = nullptr;
    SegmentId id = 0;
    tree::Categories categories = tree::kAllCategories;
    bool is_mesh = false;  ///< whether its triangles count if it has any
    bool is_solid = false;
    bool is_read = false;

    // If objects move:
    bool has_moved = false;      ///< whether it was read since the step began
    BesideReading start = {};    ///< at the start of the step, with the same triangles
    geometry::Frame frame = {};  ///< of both boxes
    /// Copies of the entry share it. Null for another shape than a mesh.
    std::shared_ptr<MovingMeshOnDemand> trees = nullptr;

    /// What was just read and is in no manager, or in one that counts it by its box.
    static BesideEntry resting(const BesideReading& reading, Object* object, SegmentId id,
                               bool is_solid, tree::Categories categories = tree::kAllCategories) {
      BesideEntry entry;
      static_cast<BesideReading&>(entry) = entry.start = reading;
      entry.object = object;
      entry.id = id;
      entry.categories = categories;
      entry.is_mesh = reading.mesh != nullptr;
      entry.is_solid = is_solid;
      entry.forgetTrees();
      return entry;
    }

    index::PosedMesh posed() const { return BesideReading::posed(categories, is_solid); }
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

  /// A shape that takes time to read, or one that moves.
  struct ShapeEntry {
    Object* object = nullptr;
    bool is_read = false;
    bool has_moved = false;         ///< as in BesideEntry
    geometry::Obstacle shape = {};  ///< in the frame of the indexes
    /// In the world's frame at the start and at the end of a step, if shapes move.
    geometry::Obstacle start = {}, end = {};
  };

  explicit Obstacles(const FiberManagerOptions& options);

  // --- Changing ---

  /// Makes room for those of some objects that it will add.
  void reserve(const std::vector<const Object*>& objects);
  /// Adds an object that is neither a capsule nor a sphere.
  /// @pre there is room; the ids ascend
  void add(Object* object, SegmentId id, tree::Categories categories, bool is_solid);
  void remove(SegmentId id);
  /// Takes new ids of the same objects. All have to be read then.
  void renumber(const ObjectRegistry<S>& registry);
  void clear();
  /// Begins a step at the objects as they were read last, or ends it.
  void setStep(bool has_step);
  /// Adds the object that replaces one of another manager. The cache has the triangles of that one,
  /// which both share if they are the same.
  void addCopy(const Obstacles& other, Object* object, SegmentId id, tree::Categories categories,
               bool is_solid);

  // --- Reading ---

  // These throw RefusedObject with the id.

  void readAll(const geometry::Frame& frame);
  /// Reads those that have not been read yet.
  void readNew(const geometry::Frame& frame);
  /// Reads those of these objects that have been read before.
  void readSome(const std::vector<SegmentId>& ids, const geometry::Frame& frame);

  /// Whether all are as they were read.
  bool isCurrent(const geometry::Frame& frame) const;

  // --- Asking ---

  /// Those beside the tree. Entries of removed objects, whose `object` is null, stand among them.
  const ById<BesideEntry>& beside() const { return beside_; }
  bool isBeside(SegmentId id) const { return beside(id) != nullptr; }
  /// Null if the object is in the tree.
  const BesideEntry* beside(SegmentId id) const { return beside_.get(id); }
  /// Null if the shape has to be read, or if only the box of the object counts.
  const ShapeEntry* shape(SegmentId id) const { return shapes_.get(id); }

  /// The boxes of those beside the tree, by their places.
  const BesideBoxes& boxes() const { return boxes_; }

  MeshCache& cache() const { return cache_; }
  std::size_t memoryUsage() const;

 private:
  using Place = BesideBoxes::Place;

  void readBeside(Place place, const geometry::Frame& frame);
  void readShape(std::size_t place, const geometry::Frame& frame);
  /// Lists those that have moved, or that are about to.
  void listMoved(bool all);
  Place besideCount() const { return static_cast<Place>(beside_.size()); }
  BesideBoxes::BoxOf boxOf() const {
    return [this](Place place) { return beside_[static_cast<std::size_t>(place)].movingBox(); };
  }

  const FiberManagerOptions options_;
  const bool moves_;       ///< whether there may be steps
  bool has_step_ = false;  ///< otherwise all rest
  ById<BesideEntry> beside_;
  ById<ShapeEntry> shapes_;
  BesideBoxes boxes_;
  /// Whether boxes_ has all that is read. It is not after a call that has thrown.
  bool has_boxes_ = true;
  /// The places of those that have moved.
  std::vector<std::size_t> moved_beside_, moved_shapes_;
  mutable MeshCache cache_;
};

extern template class Obstacles<float>;
extern template class Obstacles<double>;

}  // namespace fcl_fibers::broadphase
