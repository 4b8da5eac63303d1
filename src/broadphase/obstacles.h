// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_manager_options.h>

#include "broadphase/generations.h"
#include "broadphase/mesh_cache.h"
#include "broadphase/object_reader.h"
#include "broadphase/object_registry.h"
#include "geometry/obstacle.h"
#include "index/posed_mesh.h"

namespace fcl_fibers::broadphase {

/// What is known of some of a manager's objects, in the order of their ids. An `Entry` has the
/// object as `object`, which is null once it has been removed. Until compact() removed entries keep
/// their places, so that one removal does not move all entries behind it.
template <class Entry>
class ById {
 public:
  /// By id, one for each place.
  const std::vector<SegmentId>& ids() const { return ids_; }
  std::size_t size() const { return ids_.size(); }
  std::size_t removedCount() const { return removed_; }
  Entry& operator[](std::size_t place) { return entries_[place]; }
  const Entry& operator[](std::size_t place) const { return entries_[place]; }
  auto begin() { return entries_.begin(); }
  auto begin() const { return entries_.begin(); }
  auto end() { return entries_.end(); }
  auto end() const { return entries_.end(); }

  /// The place of an object's entry; size() if there is none.
  std::size_t find(SegmentId id) const {
    const auto found = std::lower_bound(ids_.begin(), ids_.end(), id);
    const auto place = static_cast<std::size_t>(found - ids_.begin());
    return found == ids_.end() || *found != id || entries_[place].object == nullptr ? size()
                                                                                    : place;
  }
  Entry* get(SegmentId id) {
    const std::size_t place = find(id);
    return place == size() ? nullptr : &entries_[place];
  }
  const Entry* get(SegmentId id) const { return const_cast<ById*>(this)->get(id); }

  /// Makes room for more entries, so that adding them cannot throw. It makes more room than that,
  /// so that entries that come one by one do not each move all entries before them.
  void reserve(std::size_t more) {
    if (size() + more <= ids_.capacity()) return;
    const std::size_t capacity = std::max(size() + more + more / 8, 2 * ids_.capacity());
    entries_.reserve(capacity);
    ids_.reserve(capacity);
  }
  /// @pre the ids ascend
  void add(SegmentId id, Entry entry) {
    ids_.push_back(id);
    entries_.push_back(std::move(entry));
  }
  void remove(std::size_t place) {
    entries_[place] = Entry();
    ++removed_;
  }
  /// Gives the places of removed entries to those behind them.
  void compact() {
    std::size_t kept = 0;
    for (std::size_t i = 0; removed_ > 0 && i < size(); ++i) {
      if (entries_[i].object == nullptr) continue;
      if (kept != i) entries_[kept] = std::move(entries_[i]);
      ids_[kept++] = ids_[i];
    }
    if (removed_ > 0) {
      entries_.resize(kept);
      ids_.resize(kept);
    }
    removed_ = 0;
  }
  /// Takes new ids, idOf(entry), of the same objects in the same order.
  /// @pre compact() was called last
  template <class IdOf>
  void renumber(IdOf&& idOf) {
    for (std::size_t i = 0; i < size(); ++i) ids_[i] = idOf(entries_[i]);
  }
  void clear() {
    entries_.clear();
    ids_.clear();
    removed_ = 0;
  }

  std::size_t memoryUsage() const {
    return entries_.capacity() * sizeof(Entry) + ids_.capacity() * sizeof(SegmentId);
  }

 private:
  std::vector<SegmentId> ids_;
  std::vector<Entry> entries_;
  std::size_t removed_ = 0;
};

/// An object beside the tree, as it was read.
struct BesideReading {
  /// Around it and its margin, in the frame of the indexes.
  geometry::Segment box = geometry::Segment::box({0, 0, 0}, {0, 0, 0});
  ReadObject object = {};
  std::shared_ptr<const Mesh> mesh = nullptr;  ///< null for points and for another shape
  const void* model = nullptr;                 ///< the geometry that the mesh was read from

  /// Whether triangles count. If not, only the box and the shape do.
  bool hasTriangles() const { return mesh != nullptr && object.isAllOfShape(); }
  /// @pre hasTriangles()
  index::PlacedMesh placed(tree::Categories categories, bool is_solid) const {
    // A mesh that meets no fiber meets other obstacles, and the rules leave out the fibers.
    const bool meets_some = categories.meet(tree::kAllCategories);
    const tree::Categories searched = meets_some ? categories : tree::kAllCategories;
    return {mesh->index(), object.pose, searched, is_solid, object.added.margin};
  }
};

/// The trees of a mesh during a step, which are made for the first query that needs them. Several
/// threads may ask.
class MovingMeshOnDemand {
 public:
  /// All calls have the same start and end. It keeps the mesh for the frame of the last call.
  std::shared_ptr<const index::PosedMesh> get(const index::PlacedMesh& start,
                                              const index::PlacedMesh& end,
                                              const geometry::Frame& frame,
                                              parallel::Executor* executor);
  /// Gives up what was made for the start and the end that there were.
  void forget();
  /// @pre no query runs
  bool isEmpty() const { return mesh_ == nullptr; }
  std::size_t memoryUsage() const;

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const index::PosedMesh> mesh_;
};

/// Reads any object as one beside the tree. Throws RefusedObject, also if `is_solid` is set and a
/// mesh leaks.
/// @param cache  for triangles; null if they do not count
template <typename S>
BesideReading readBeside(const fcl::CollisionObject<S>& object, bool is_solid,
                         const geometry::Frame& frame, Bounds bounds, MeshCache* cache,
                         SegmentId id = 0, MeshCache::IsSame is_same = MeshCache::IsSame::kIfEqual);

/// The objects of a manager that are beside its tree, and the shapes that are in the tree as boxes.
template <typename S>
class Obstacles {
 public:
  using Object = fcl::CollisionObject<S>;

  struct BesideEntry {
    Object* object = nullptr;
    SegmentId id = 0;
    tree::Categories categories = tree::kAllCategories;
    bool is_mesh = false;  ///< whether its triangles count if it has any
    bool is_solid = false;
    bool is_rigid = false;  ///< whether its triangles stay the same in the model
    bool is_read = false;
    bool has_moved = false;  ///< whether it was read since the step began
    /// Whether the triangles of the end may have changed before the last update. See
    /// Obstacles::withTriangles().
    bool awaits_triangles = false;
    /// At both ends of the step, with the same triangles. Without a step the end counts.
    BesideReading start = {}, end = {};
    geometry::Frame frame = {};  ///< of both boxes
    /// Of what is no mesh, at the end and in the frame of the indexes, if shapes count.
    geometry::Obstacle shape = {};
    /// Copies of the entry share it. Null for another shape than a mesh.
    std::shared_ptr<MovingMeshOnDemand> trees = nullptr;

    /// @pre no triangles are awaited
    index::PlacedMesh placed() const { return end.placed(categories, is_solid); }
    /// @pre hasMovingTriangles(); the entry lives as long as the result
    std::shared_ptr<const index::PosedMesh> moving(const geometry::Frame& its_frame,
                                                   parallel::Executor* executor) const {
      return trees->get(start.placed(categories, is_solid), placed(), its_frame, executor);
    }
    /// Whether an update leaves it to the first query that needs the triangles to compare them. A
    /// step needs them at both of its ends, and an update refuses a solid that is none.
    bool comparesOnDemand(const FiberManagerOptions& options) const {
      return is_mesh && !is_solid && !options.motion;
    }
    /// Gives up the trees, because the start or the end will change.
    void forgetTrees() {
      if (trees.use_count() == 1 && trees->isEmpty()) return;
      trees = std::make_shared<MovingMeshOnDemand>();
    }
    /// Whether triangles count during the whole step.
    bool hasMovingTriangles() const { return start.hasTriangles() && end.hasTriangles(); }
  };

  /// A shape that takes time to read, or one that moves.
  struct ShapeEntry {
    Object* object = nullptr;
    bool is_read = false;           ///< if shapes rest, since the last update
    bool has_moved = false;         ///< as in BesideEntry
    geometry::Obstacle shape = {};  ///< in the frame of the indexes
    /// In the world's frame at the start and at the end of a step, if shapes move.
    geometry::Obstacle start = {}, end = {};
  };

  explicit Obstacles(const FiberManagerOptions& options);

  // --- Changing ---

  /// Makes room for those of some objects, given by their places, that it will add.
  void reserve(const std::vector<Object*>& objects, const std::vector<std::size_t>& which);
  /// Adds an object that is neither a capsule nor a sphere.
  /// @pre there is room; the ids ascend
  void add(Object* object, SegmentId id, tree::Categories categories, bool is_solid, bool is_rigid);
  void remove(SegmentId id);
  /// Takes new ids of the same objects. All have to be read then.
  void renumber(const ObjectRegistry<S>& registry);
  void clear();
  /// Begins a step at the objects as they were read last, or ends it. It needs no memory, because
  /// the indexes follow.
  void setStep(bool has_step);
  /// Adds the object that replaces one of another manager. The cache has the triangles of that one,
  /// which both share if they are the same.
  void addCopy(const Obstacles& other, Object* object, SegmentId id, tree::Categories categories,
               bool is_solid, bool is_rigid);

  // --- Reading ---

  // These throw RefusedObject with the id.

  /// @param all          whether those that have been read before are read, too
  /// @param young_begin  from this id on, the boxes in the tree have been read anew; so the shapes
  ///        in them are read too, even if `all` is false
  void read(const geometry::Frame& frame, bool all, SegmentId young_begin);
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
  /// The same entry once its triangles are up to date. The first query after an update that needs
  /// them compares them with those of the model, because most updates precede none that does. The
  /// object counts where the update has read it. Several threads may ask. Throws RefusedObject with
  /// the id.
  /// @param entry  of beside()
  /// @param frame  of the indexes
  const BesideEntry& withTriangles(const BesideEntry& entry, const geometry::Frame& frame) const;

  /// If shapes move: how one does. Null if only the box of the object counts.
  const ShapeEntry* shape(SegmentId id) const { return shapes_.get(id); }
  /// If they rest: the shape of an object in the tree as read(known) returned it for the first
  /// query after an update that needs it. `known` is the shape before that if there was one.
  /// Several threads may ask.
  template <class Read>
  geometry::Obstacle shapeOnDemand(SegmentId id, Read&& read) const {
    ShapeEntry* const entry = shapes_.get(id);
    if (entry == nullptr) return read(geometry::Obstacle());
    const std::lock_guard<std::mutex> lock(on_demand_);
    if (!entry->is_read) entry->shape = read(entry->shape);
    entry->is_read = true;
    return entry->shape;
  }

  /// The boxes of those beside the tree, by their places.
  const Generations& boxes() const { return boxes_; }

  MeshCache& cache() const { return cache_; }
  std::size_t memoryUsage() const;

 private:
  void readBesideAt(std::size_t place, const geometry::Frame& frame, bool all);
  void readMesh(BesideEntry& entry, const geometry::Frame& frame, bool all);
  void forgetUnusedMeshes();
  void readShape(std::size_t place, const geometry::Frame& frame);
  void finishBoxes(const geometry::Frame& frame, bool are_fitted);

  const FiberManagerOptions options_;
  bool has_step_ = false;  ///< otherwise all rest
  // Queries complete the entries.
  mutable std::mutex on_demand_;
  mutable ById<BesideEntry> beside_;
  mutable ById<ShapeEntry> shapes_;
  Generations boxes_;  ///< of those beside the tree, by their places
  /// Whether boxes_ has all that is read. It is not after a call that has thrown.
  bool has_boxes_ = true;
  mutable MeshCache cache_;
  std::size_t read_count_ = 0;  ///< how often all were read
};

extern template class Obstacles<float>;
extern template class Obstacles<double>;

}  // namespace fcl_fibers::broadphase
