// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/obstacles.h"

#include <algorithm>
#include <utility>

#include "broadphase/frame_of_other.h"
#include "broadphase/object_source.h"
#include "index/posed_triangles.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Frame;
using geometry::Segment;
using index::SegmentId;

}  // namespace

template <typename S>
BesideReading readMesh(const fcl::CollisionObject<S>& object, bool is_solid, const Frame& frame,
                       Bounds bounds, MeshCache& cache, SegmentId place) {
  BesideReading reading;
  // This checks the pose, and gives the box of a cloud of points.
  reading.box = requireSegment(object, frame, bounds, place);
  const BvhTriangles<S> triangles = trianglesOf(*ObjectMembers<S>::shape(object));
  if (triangles.isCloud()) return reading;
  if (const std::string problem = triangles.problem(); !problem.empty()) refuse(problem, place);
  reading.mesh = cache.read(object.collisionGeometry(), triangles);
  reading.model = object.collisionGeometry().get();
  if (is_solid && reading.mesh->firstLeak() >= 0) {
    const index::MeshIndex& mesh = reading.mesh->index();
    refuse("its mesh is not watertight: " + index::leakProblem(mesh.points(), mesh.triangles()) +
               ", or register it without ObstacleOptions::solid",
           place);
  }
  if (is_solid && reading.mesh->isInsideOut()) {
    refuse(
        "its mesh is inside out: its triangles are clockwise seen from outside; "
        "exchange two points of each",
        place);
  }
  placeMesh(object, frame, bounds, reading);
  if (!index::fitsIn(frame, reading.posed(tree::kAllCategories, is_solid))) {
    refuse(
        "its coordinates overflow in the unit of the fibers; "
        "bring it nearer to them or make it smaller",
        place);
  }
  return reading;
}

template <typename S>
void placeMesh(const fcl::CollisionObject<S>& object, const Frame& frame, Bounds bounds,
               BesideReading& reading) {
  const ReadObject now = readObject(object, bounds, &reading.mesh->bounds());
  segmentOf(now, frame, reading.box);
  reading.pose = now.pose;
  reading.margin = now.added.margin;
  reading.counts_triangles = now.isAllOfShape();
}

std::shared_ptr<const index::MovingMesh> MovingMeshOnDemand::get(const index::PosedMesh& start,
                                                                 const index::PosedMesh& end,
                                                                 const Frame& frame,
                                                                 parallel::Executor* executor) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (mesh_ == nullptr || !(mesh_->frame() == frame)) {
    mesh_ = std::make_shared<const index::MovingMesh>(start, end, frame, executor);
  }
  return mesh_;
}

std::size_t MovingMeshOnDemand::memoryUsage() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return mesh_ == nullptr ? 0 : mesh_->memoryUsage();
}

template <typename S>
Obstacles<S>::Obstacles(const FiberManagerOptions& options)
    : options_(options), moves_(options.motion), boxes_(options.margin) {}

// --- Changing ---

template <typename S>
void Obstacles<S>::reserve(const std::vector<const Object*>& objects) {
  std::size_t beside = 0, shapes = 0;
  for (const Object* object : objects) {
    beside += isBesideTree(kindOf(*object), options_) ? 1 : 0;
    shapes += keepsShape(kindOf(*object), options_) ? 1 : 0;
  }
  beside_.reserve(beside);
  shapes_.reserve(shapes);
}

template <typename S>
void Obstacles<S>::add(Object* object, SegmentId id, tree::Categories categories, bool is_solid) {
  const ObjectKind kind = kindOf(*object);
  if (isBesideTree(kind, options_)) {
    BesideEntry entry;
    entry.object = object;
    entry.id = id;
    entry.categories = categories;
    entry.is_mesh = kind == ObjectKind::kMesh && countsTriangles(options_);
    entry.is_solid = is_solid;
    beside_.add(id, std::move(entry));
  }
  if (keepsShape(kind, options_)) shapes_.add(id, {object});
}

template <typename S>
void Obstacles<S>::remove(SegmentId id) {
  if (const std::size_t place = beside_.find(id); place < beside_.size()) {
    // The object may be dead.
    const void* model = beside_[place].model;
    beside_.remove(place);
    cache_.forget(model);
  }
  if (const std::size_t place = shapes_.find(id); place < shapes_.size()) shapes_.remove(place);
}

template <typename S>
void Obstacles<S>::renumber(const ObjectRegistry<S>& registry) {
  const auto new_id = [&](const auto& entry) { return registry.find(entry.object); };
  beside_.compact();
  beside_.renumber(new_id);
  for (BesideEntry& entry : beside_) entry.id = registry.find(entry.object);
  shapes_.compact();
  shapes_.renumber(new_id);
  has_boxes_ = false;
  listMoved(/*all=*/false);
}

template <typename S>
void Obstacles<S>::listMoved(bool all) {
  if (!has_step_) return;
  // If memory runs out, no list has places of before.
  moved_beside_.clear();
  moved_shapes_.clear();
  const auto list = [all](auto& entries, std::vector<std::size_t>& moved) {
    for (std::size_t place = 0; place < entries.size(); ++place) {
      if (all) entries[place].has_moved = true;
      if (entries[place].has_moved) moved.push_back(place);
    }
  };
  list(beside_, moved_beside_);
  list(shapes_, moved_shapes_);
}

template <typename S>
void Obstacles<S>::clear() {
  setStep(false);  // while the entries that have moved exist
  beside_.clear();
  shapes_.clear();
  boxes_.clear();
  cache_.clear();
}

template <typename S>
void Obstacles<S>::setStep(bool has_step) {
  for (const std::size_t place : moved_shapes_) {
    shapes_[place].start = shapes_[place].end;
    shapes_[place].has_moved = false;
  }
  for (const std::size_t place : moved_beside_) {
    BesideEntry& entry = beside_[place];
    entry.start = entry;
    entry.has_moved = false;
    if (entry.is_mesh) entry.forgetTrees();
  }
  moved_shapes_.clear();
  moved_beside_.clear();
  boxes_.setStep(has_step);
  has_step_ = has_step;
}

template <typename S>
void Obstacles<S>::addCopy(const Obstacles& other, Object* object, SegmentId id,
                           tree::Categories categories, bool is_solid) {
  reserve({object});
  add(object, id, categories, is_solid);
  const BesideEntry* original = other.beside(id);
  if (original != nullptr && original->mesh != nullptr && isMesh(*object)) {
    cache_.keep(object->collisionGeometry(), original->mesh);
  }
}

// --- Reading ---

template <typename S>
void Obstacles<S>::readBeside(Place place, const Frame& frame) {
  BesideEntry& entry = beside_[static_cast<std::size_t>(place)];
  if (entry.is_mesh != (isMesh(*entry.object) && countsTriangles(options_))) {
    refuse(entry.is_mesh ? kIsNoMeshNow : kIsMeshNow, entry.id);
  }
  BesideReading now;
  if (entry.is_mesh) {
    now = readMesh(*entry.object, entry.is_solid, frame, options_.bounds, cache_, entry.id);
  } else {
    now.box = requireSegment(*entry.object, frame, options_.bounds, entry.id);
  }
  if (moves_) {
    // Other triangles have no way from those before. They rest where they are now.
    const bool is_same =
        has_step_ && entry.is_read && (entry.start.mesh == nullptr) == (now.mesh == nullptr) &&
        (now.mesh == nullptr || entry.start.mesh->index().hasTrianglesOf(now.mesh->index()));
    if (is_same) {
      const FrameOfOther change(entry.frame, frame);
      if (!change.isIdentity()) entry.start.box = change.grown(entry.start.box);
    } else {
      entry.start = now;
    }
    entry.frame = frame;
    if (has_step_ && !entry.has_moved) moved_beside_.push_back(static_cast<std::size_t>(place));
    entry.has_moved = has_step_;
  }
  static_cast<BesideReading&>(entry) = std::move(now);
  if (entry.is_mesh) entry.forgetTrees();
  entry.is_read = true;
}

template <typename S>
void Obstacles<S>::readShape(std::size_t place, const Frame& frame) {
  ShapeEntry& entry = shapes_[place];
  const ReadObject now = readObject(*entry.object, options_.bounds);
  entry.shape = obstacleOf(now, frame);
  if (moves_) {
    entry.end = obstacleOf(now, Frame{});
    if (!has_step_ || !entry.is_read) entry.start = entry.end;
    if (has_step_ && !entry.has_moved) moved_shapes_.push_back(place);
    entry.has_moved = has_step_;
  }
  entry.is_read = true;
}

template <typename S>
void Obstacles<S>::readAll(const Frame& frame) {
  const bool keeps_places = has_boxes_ && beside_.removedCount() == 0;
  has_boxes_ = false;
  beside_.compact();
  shapes_.compact();
  listMoved(/*all=*/true);
  // Meshes that nobody holds are refitted in place. A step holds them.
  for (BesideEntry& entry : beside_) {
    if (!moves_) entry.mesh.reset();
  }
  for (Place place = 0; place < besideCount(); ++place) readBeside(place, frame);
  for (std::size_t place = 0; place < shapes_.size(); ++place) readShape(place, frame);
  cache_.forgetUnused();
  if (!keeps_places) boxes_.clear();
  boxes_.readAll(frame, besideCount(), boxOf());
  has_boxes_ = true;
}

template <typename S>
void Obstacles<S>::readNew(const Frame& frame) {
  if (!has_boxes_) return readAll(frame);
  // New entries are the last, and some of them may have been removed again.
  const auto firstNew = [](const auto& entries) {
    std::size_t first = entries.size();
    while (first > 0 && !entries[first - 1].is_read) --first;
    return first;
  };
  for (std::size_t place = firstNew(shapes_); place < shapes_.size(); ++place) {
    if (shapes_[place].object != nullptr) readShape(place, frame);
  }
  std::size_t first = firstNew(beside_);
  if (first == beside_.size()) return;
  has_boxes_ = false;
  for (; first < beside_.size(); ++first) {
    if (beside_[first].object != nullptr) readBeside(static_cast<Place>(first), frame);
  }
  boxes_.readNew(besideCount(), boxOf());
  has_boxes_ = true;
}

template <typename S>
void Obstacles<S>::readSome(const std::vector<SegmentId>& ids, const Frame& frame) {
  // After a call that has thrown all are read next.
  if (!has_boxes_ || beside_.size() + shapes_.size() == 0) return;
  std::vector<Place> places;
  for (const SegmentId id : ids) {
    const std::size_t place = beside_.find(id), shape = shapes_.find(id);
    if (place < beside_.size() && beside_[place].is_read) {
      has_boxes_ = false;
      if (!moves_) beside_[place].mesh.reset();
      readBeside(static_cast<Place>(place), frame);
      places.push_back(static_cast<Place>(place));
    }
    if (shape < shapes_.size() && shapes_[shape].is_read) readShape(shape, frame);
  }
  if (places.empty()) return;
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  boxes_.readSome(places, boxOf());
  has_boxes_ = true;
}

template <typename S>
bool Obstacles<S>::isCurrent(const Frame& frame) const {
  for (const BesideEntry& entry : beside_) {
    if (entry.object == nullptr || !entry.is_read) continue;
    if (entry.is_mesh != (isMesh(*entry.object) && countsTriangles(options_))) return false;
    BesideReading now;
    if (readSegment(*entry.object, frame, options_.bounds, now.box) != nullptr) return false;
    if (entry.is_mesh) {
      const BvhTriangles<S> triangles = trianglesOf(*ObjectMembers<S>::shape(*entry.object));
      if (!triangles.is_finished || triangles.isCloud() != (entry.mesh == nullptr)) return false;
      if (entry.mesh != nullptr) {
        if (!isSame(*entry.mesh, triangles)) return false;
        now.mesh = entry.mesh;
        placeMesh(*entry.object, frame, options_.bounds, now);
      }
    }
    if (!(now.box == entry.box) || now.counts_triangles != entry.counts_triangles ||
        now.margin != entry.margin || !(now.pose == entry.pose)) {
      return false;
    }
  }
  for (const ShapeEntry& entry : shapes_) {
    if (entry.object == nullptr || !entry.is_read) continue;
    const ReadObject now = readObject(*entry.object, options_.bounds);
    if (!(obstacleOf(now, frame) == entry.shape)) return false;
  }
  return true;
}

template <typename S>
std::size_t Obstacles<S>::memoryUsage() const {
  std::size_t steps = 0;
  for (const BesideEntry& entry : beside_) {
    steps += entry.trees != nullptr ? entry.trees->memoryUsage() : 0;
    if (entry.start.mesh != nullptr && entry.start.mesh != entry.mesh) {
      steps += entry.start.mesh->memoryUsage();
    }
  }
  return steps + beside_.memoryUsage() + shapes_.memoryUsage() + boxes_.memoryUsage() +
         cache_.memoryUsage();
}

#define FCL_FIBERS_INSTANTIATE(S)                                                                \
  template BesideReading readMesh(const fcl::CollisionObject<S>&, bool, const Frame&, Bounds,    \
                                  MeshCache&, SegmentId);                                        \
  template void placeMesh(const fcl::CollisionObject<S>&, const Frame&, Bounds, BesideReading&); \
  template class Obstacles<S>;
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::broadphase
