// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/obstacles.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "broadphase/object_source.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Frame;
using geometry::Segment;
using index::SegmentId;

/// The boxes of those beside the tree, at one end of a step.
template <class Entry>
class BoxSource final : public index::SegmentSource {
 public:
  BoxSource(const ById<Entry>& entries, BesideReading Entry::*end) : entries_(entries), end_(end) {}

  bool read(const SegmentId* ids, int count, int /*ahead*/, const Frame& /*frame*/,
            index::SegmentBlock& out, index::BlockMask& present) const override {
    for (int i = 0; i < count; ++i) {
      out.set(i, (entries_[static_cast<std::size_t>(ids[i])].*end_).box);
    }
    present = geometry::firstOfBlock(count);
    return true;
  }
  bool staysFiniteIn(const Frame& /*frame*/) const override { return true; }
  bool isFasterInOrder() const override { return false; }
  [[noreturn]] void refuse(SegmentId /*id*/, const Frame& /*frame*/) const override {
    throw std::logic_error("fcl_fibers: every box can be read");
  }

 private:
  const ById<Entry>& entries_;
  BesideReading Entry::*const end_;
};

template <class Entry>
MeshCache::IsSame isSameFor(const Entry& entry) {
  return entry.is_rigid ? MeshCache::IsSame::kAlways : MeshCache::IsSame::kInUpdate;
}

/// Of each entry from a place on that has an object.
template <class Entry>
tree::Fibers oneEach(const ById<Entry>& entries, SegmentId begin) {
  tree::Fibers fibers;
  for (auto place = static_cast<std::size_t>(begin); place < entries.size(); ++place) {
    if (entries[place].object == nullptr) continue;
    fibers.ids.push_back(static_cast<SegmentId>(place));
    fibers.endFiber();
  }
  return fibers;
}

}  // namespace

namespace {

constexpr const char* kOverflows =
    "its coordinates overflow in the unit of the fibers; bring it nearer to them or make it "
    "smaller";

/// Reads an object where it is, with the mesh of the reading if there is one.
/// @param mesh  the bounds of the mesh, or null for those that FCL has
template <typename S>
void place(const fcl::CollisionObject<S>& object, bool is_solid, const Frame& frame, Bounds bounds,
           SegmentId id, const LocalBounds* mesh, BesideReading& reading) {
  reading.object = readObject(object, bounds, mesh);
  if (const char* problem = segmentOf(reading.object, frame, reading.box)) refuse(problem, id);
  if (reading.mesh != nullptr &&
      !index::fitsIn(frame, reading.placed(tree::kAllCategories, is_solid))) {
    refuse(kOverflows, id);
  }
}

const LocalBounds* boundsOf(const BesideReading& reading) {
  return reading.mesh == nullptr ? nullptr : &reading.mesh->bounds();
}

/// The same for triangles that may have changed. They are in FCL's bounds of the model if it has
/// computed these since.
template <typename S>
void placeAwaited(const fcl::CollisionObject<S>& object, const Frame& frame, Bounds bounds,
                  SegmentId id, BesideReading& reading) {
  const Corners of_fcl = openCorners(ObjectMembers<S>::shape(object)->aabb_local);
  const Corners& known = reading.mesh->bounds().box;
  place(object, /*is_solid=*/false, frame, bounds, id, /*mesh=*/nullptr, reading);
  if (of_fcl.low == known.low && of_fcl.high == known.high) return;
  const Segment box = reading.box;
  place(object, /*is_solid=*/false, frame, bounds, id, boundsOf(reading), reading);
  reading.box = Segment::box(min(box.a, reading.box.a), max(box.b, reading.box.b));
}

}  // namespace

template <typename S>
BesideReading readBeside(const fcl::CollisionObject<S>& object, bool is_solid, const Frame& frame,
                         Bounds bounds, MeshCache* cache, SegmentId id, MeshCache::IsSame is_same) {
  BesideReading reading;
  const auto refuseMesh = [&](const std::string& problem) {
    requireSegment(object, frame, bounds, id);  // an improper pose is named first
    refuse(problem, id);
  };
  if (cache != nullptr && isMesh(object)) {
    const BvhTriangles<S> triangles = trianglesOf(*ObjectMembers<S>::shape(object));
    if (!triangles.isCloud()) {
      reading.mesh = cache->read(object.collisionGeometry(), triangles, is_same);
      if (reading.mesh == nullptr) refuseMesh(triangles.problem());
      reading.model = object.collisionGeometry().get();
    }
  }
  if (is_solid && reading.mesh != nullptr) {
    if (reading.mesh->firstLeak() >= 0) {
      const index::MeshIndex& mesh = reading.mesh->index();
      refuseMesh(
          "its mesh is not watertight: " + index::leakProblem(mesh.points(), mesh.triangles()) +
          ", or register it without ObstacleOptions::solid");
    }
    if (reading.mesh->isInsideOut()) {
      refuseMesh(
          "its mesh is inside out: its triangles are clockwise seen from outside; "
          "exchange two points of each");
    }
  }
  place(object, is_solid, frame, bounds, id, boundsOf(reading), reading);
  return reading;
}

std::shared_ptr<const index::PosedMesh> MovingMeshOnDemand::get(const index::PlacedMesh& start,
                                                                const index::PlacedMesh& end,
                                                                const Frame& frame,
                                                                parallel::Executor* executor) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (mesh_ == nullptr || !(mesh_->frame() == frame)) {
    mesh_ = std::make_shared<const index::PosedMesh>(start, end, frame, executor);
  }
  return mesh_;
}

void MovingMeshOnDemand::forget() {
  const std::lock_guard<std::mutex> lock(mutex_);
  mesh_.reset();
}

std::size_t MovingMeshOnDemand::memoryUsage() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return mesh_ == nullptr ? 0 : mesh_->memoryUsage();
}

template <typename S>
Obstacles<S>::Obstacles(const FiberManagerOptions& options)
    : options_(options),
      // If capsules are tested, boxes are compared in double.
      boxes_({false, false, /*capsules=*/true, options.margin}, options.motion) {}

// --- Changing ---

template <typename S>
void Obstacles<S>::reserve(const std::vector<Object*>& objects,
                           const std::vector<std::size_t>& which) {
  std::size_t beside = 0, shapes = 0;
  for (const std::size_t i : which) {
    beside += isBesideTree(kindOf(*objects[i]), options_) ? 1 : 0;
    shapes += keepsShape(kindOf(*objects[i]), options_) ? 1 : 0;
  }
  beside_.reserve(beside);
  shapes_.reserve(shapes);
}

template <typename S>
void Obstacles<S>::add(Object* object, SegmentId id, tree::Categories categories, bool is_solid,
                       bool is_rigid) {
  const ObjectKind kind = kindOf(*object);
  if (isBesideTree(kind, options_)) {
    BesideEntry entry;
    entry.object = object;
    entry.id = id;
    entry.categories = categories;
    entry.is_mesh = kind == ObjectKind::kMesh && countsTriangles(options_);
    entry.is_solid = is_solid;
    entry.is_rigid = is_rigid;
    beside_.add(id, std::move(entry));
  }
  if (keepsShape(kind, options_)) shapes_.add(id, {object});
}

template <typename S>
void Obstacles<S>::remove(SegmentId id) {
  if (const std::size_t place = beside_.find(id); place < beside_.size()) {
    // The object may be dead.
    const void* model = beside_[place].end.model;
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
}

template <typename S>
void Obstacles<S>::clear() {
  has_step_ = false;
  beside_.clear();
  shapes_.clear();
  boxes_.clear();
  cache_.clear();
}

template <typename S>
void Obstacles<S>::setStep(bool has_step) {
  for (ShapeEntry& entry : shapes_) {
    if (entry.has_moved) entry.start = entry.end;
    entry.has_moved = false;
  }
  for (BesideEntry& entry : beside_) {
    if (!entry.has_moved) continue;
    entry.start = entry.end;
    entry.has_moved = false;
    if (entry.is_mesh) entry.trees->forget();
  }
  boxes_.endStep();  // the next reading begins it where these are
  has_step_ = has_step;
}

template <typename S>
void Obstacles<S>::addCopy(const Obstacles& other, Object* object, SegmentId id,
                           tree::Categories categories, bool is_solid, bool is_rigid) {
  reserve({object}, {0});
  add(object, id, categories, is_solid, is_rigid);
  const std::lock_guard<std::mutex> lock(other.on_demand_);
  const BesideEntry* original = other.beside(id);
  if (original != nullptr && original->end.mesh != nullptr && isMesh(*object)) {
    cache_.keep(object->collisionGeometry(), original->end.mesh);
  }
}

// --- Reading ---

template <typename S>
void Obstacles<S>::readBesideAt(std::size_t place, const Frame& frame, bool all) {
  BesideEntry& entry = beside_[place];
  if (entry.is_mesh != (isMesh(*entry.object) && countsTriangles(options_))) {
    refuse(entry.is_mesh ? kIsNoMeshNow : kIsMeshNow, entry.id);
  }
  if (entry.comparesOnDemand(options_)) return readMesh(entry, frame, all);
  // Meshes that nobody holds are refitted in place. A step holds them.
  if (!options_.motion) entry.end.mesh.reset();
  BesideReading now = readBeside(*entry.object, entry.is_solid, frame, options_.bounds,
                                 entry.is_mesh ? &cache_ : nullptr, entry.id, isSameFor(entry));
  if (options_.motion) {
    // Other triangles have no way from those before. They rest where they are now.
    const bool is_same =
        has_step_ && entry.is_read && (entry.start.mesh == nullptr) == (now.mesh == nullptr) &&
        (now.mesh == nullptr || entry.start.mesh->index().hasTrianglesOf(now.mesh->index()));
    if (is_same) {
      const geometry::FrameChange change(entry.frame, frame);
      entry.start.box = change.around(entry.start.box, geometry::FrameChange::Grows::kAll);
    } else {
      entry.start = now;
    }
    entry.frame = frame;
    entry.has_moved = has_step_;
  }
  entry.end = std::move(now);
  entry.awaits_triangles = false;
  if (!entry.is_mesh && countsTriangles(options_)) {
    entry.shape = obstacleOf(entry.end.object, frame, entry.shape.vertices);
  }
  if (entry.is_mesh) entry.forgetTrees();
  entry.is_read = true;
}

/// Reads a mesh whose triangles are compared on demand.
/// @param all  whether all are read now
template <typename S>
void Obstacles<S>::readMesh(BesideEntry& entry, const Frame& frame, bool all) {
  const auto& model = entry.object->collisionGeometry();
  const BvhTriangles<S> triangles = trianglesOf(*model);
  BesideReading& end = entry.end;
  if (end.mesh == nullptr || end.model != model.get()) end.mesh = cache_.find(model);
  end.model = model.get();
  const bool is_known = end.mesh != nullptr && (entry.is_rigid || looksSame(*end.mesh, triangles));
  if (!is_known) {
    // All objects of the model let go of it before the first of them reads it again.
    for (BesideEntry& other : beside_) {
      if (!all || other.end.model != model.get() || other.is_rigid) continue;
      if (!other.comparesOnDemand(options_)) continue;
      other.end.mesh.reset();
      other.awaits_triangles = other.is_read;
    }
    end = readBeside(*entry.object, /*is_solid=*/false, frame, options_.bounds, &cache_, entry.id,
                     isSameFor(entry));
  }
  if (end.mesh != nullptr) placeAwaited(*entry.object, frame, options_.bounds, entry.id, end);
  entry.forgetTrees();
  entry.awaits_triangles = is_known && !entry.is_rigid;
  entry.is_read = true;
}

template <typename S>
auto Obstacles<S>::withTriangles(const BesideEntry& entry, const Frame& frame) const
    -> const BesideEntry& {
  const std::lock_guard<std::mutex> lock(on_demand_);
  if (!entry.awaits_triangles) return entry;
  BesideEntry& own = *beside_.get(entry.id);
  const MeshCache::Model model = own.object->collisionGeometry();
  // What has become another object since counts as it was.
  if (model.get() == own.end.model && isMesh(*own.object)) {
    const BvhTriangles<S> triangles = trianglesOf(*ObjectMembers<S>::shape(*own.object));
    const Mesh* const known = own.end.mesh.get();
    const Corners before = known == nullptr ? Corners() : known->bounds().box;
    own.end.mesh.reset();  // meshes that nobody holds are refitted in place
    auto mesh = cache_.read(model, triangles, MeshCache::IsSame::kInUpdate);
    if (mesh == nullptr) refuse(triangles.problem(), own.id);
    own.end.mesh = std::move(mesh);
    const Corners& box = own.end.mesh->bounds().box;
    if (known == nullptr || !(box.low == before.low && box.high == before.high)) {
      const ReadObject now = readObject(*own.object, options_.bounds, &own.end.mesh->bounds());
      if (now.problem == nullptr && now.pose == own.end.object.pose) own.end.object = now;
      if (!index::fitsIn(frame, own.placed())) {
        own.end.mesh.reset();  // the next query refuses it, too
        refuse(kOverflows, own.id);
      }
    }
  }
  own.awaits_triangles = false;
  return own;
}

template <typename S>
void Obstacles<S>::readShape(std::size_t place, const Frame& frame) {
  ShapeEntry& entry = shapes_[place];
  const bool was_read = std::exchange(entry.is_read, options_.motion);
  if (!options_.motion) return;  // the first query that needs it reads it
  const ReadObject now = readObject(*entry.object, options_.bounds);
  entry.shape = obstacleOf(now, frame, entry.shape.vertices);
  entry.end = obstacleOf(now, Frame{}, entry.shape.vertices);
  if (!has_step_ || !was_read) entry.start = entry.end;
  entry.has_moved = has_step_;
}

template <typename S>
void Obstacles<S>::read(const Frame& frame, bool all, SegmentId young_begin) {
  all |= !has_boxes_;
  const bool keeps_places = has_boxes_ && beside_.removedCount() == 0;
  if (all) {
    has_boxes_ = false;
    beside_.compact();
    shapes_.compact();
    // Objects of one mesh let go of it before the first of them reads it again.
    for (BesideEntry& entry : beside_) {
      if (!options_.motion && !entry.comparesOnDemand(options_)) entry.end.mesh.reset();
    }
  }
  // New entries are the last, and some of them may have been removed again.
  const auto firstOf = [all](const auto& entries) {
    std::size_t first = all ? 0 : entries.size();
    while (first > 0 && !entries[first - 1].is_read) --first;
    return first;
  };
  const auto first_young =
      std::lower_bound(shapes_.ids().begin(), shapes_.ids().end(), young_begin);
  auto first_shape = static_cast<std::size_t>(first_young - shapes_.ids().begin());
  if (all || options_.motion) first_shape = std::min(first_shape, firstOf(shapes_));
  for (std::size_t place = first_shape; place < shapes_.size(); ++place) {
    if (shapes_[place].object != nullptr) readShape(place, frame);
  }
  cache_.beginUpdate();
  std::size_t place = firstOf(beside_);
  if (place == beside_.size() && (!all || boxes_.end() == 0)) {
    if (all) forgetUnusedMeshes();
    has_boxes_ = true;
    return;
  }
  has_boxes_ = false;
  const auto objectAt = [&](std::size_t i) { return beside_[i].object; };
  for (; place < beside_.size(); ++place) {
    prefetchObject<S>(objectAt, place, beside_.size());
    if (beside_[place].object != nullptr) readBesideAt(place, frame, all);
  }
  if (all) forgetUnusedMeshes();
  const BoxSource source(beside_, &BesideEntry::end);
  const auto count = static_cast<SegmentId>(beside_.size());
  const SegmentId young = boxes_.youngBegin();
  if (all) {
    const bool may_refit = keeps_places && boxes_.end() == count;
    return finishBoxes(frame, may_refit && boxes_.refit(source, frame));
  }
  const tree::Fibers fibers = oneEach(beside_, young);
  const auto places = static_cast<std::size_t>(count - young);
  const bool are_many = Generations::areTooMany(places, places - fibers.ids.size(), beside_.size());
  finishBoxes(frame, !are_many && boxes_.buildYoung(source, count, fibers));
}

/// Forgets the meshes that no object has. To find them takes time, so as many as there are objects
/// may stay for a while.
template <typename S>
void Obstacles<S>::forgetUnusedMeshes() {
  constexpr std::size_t kOften = 16;
  if (read_count_++ % kOften != 0 && cache_.size() <= beside_.size()) return;
  for (const BesideEntry& entry : beside_) {
    if (entry.end.mesh != nullptr) cache_.retain(entry.end.model);
  }
  cache_.forgetUnused();
}

/// Builds the boxes unless they fit what is read, and takes those at the start of the step.
template <typename S>
void Obstacles<S>::finishBoxes(const Frame& frame, bool are_fitted) {
  if (!are_fitted) {
    const auto count = static_cast<SegmentId>(beside_.size());
    boxes_.clear();
    boxes_.build(BoxSource(beside_, &BesideEntry::end), frame, count, oneEach(beside_, 0));
  }
  if (has_step_) boxes_.fitStart(BoxSource(beside_, &BesideEntry::start));
  has_boxes_ = true;
}

template <typename S>
void Obstacles<S>::readSome(const std::vector<SegmentId>& ids, const Frame& frame) {
  // After a call that has thrown all are read next.
  if (!has_boxes_ || beside_.size() + shapes_.size() == 0) return;
  std::vector<SegmentId> places;
  cache_.beginUpdate();
  for (const SegmentId id : ids) {
    const std::size_t place = beside_.find(id), shape = shapes_.find(id);
    if (place < beside_.size() && beside_[place].is_read) {
      has_boxes_ = false;
      readBesideAt(place, frame, /*all=*/false);
      places.push_back(static_cast<SegmentId>(place));
    }
    if (shape < shapes_.size() && shapes_[shape].is_read) readShape(shape, frame);
  }
  if (places.empty()) return;
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  std::vector<Segment> boxes;
  for (const SegmentId place : places) {
    boxes.push_back(beside_[static_cast<std::size_t>(place)].end.box);
  }
  finishBoxes(frame, boxes_.refitSome(places, boxes));
}

template <typename S>
bool Obstacles<S>::isCurrent(const Frame& frame) const {
  const std::lock_guard<std::mutex> lock(on_demand_);
  for (const BesideEntry& entry : beside_) {
    if (entry.object == nullptr || !entry.is_read) continue;
    if (entry.is_mesh != (isMesh(*entry.object) && countsTriangles(options_))) return false;
    // One that throws does not count as current.
    BesideReading now;
    now.mesh = entry.end.mesh;
    const bool is_on_demand = entry.comparesOnDemand(options_) && now.mesh != nullptr;
    try {
      is_on_demand ? placeAwaited(*entry.object, frame, options_.bounds, entry.id, now)
                   : place(*entry.object, entry.is_solid, frame, options_.bounds, entry.id,
                           boundsOf(now), now);
    } catch (const RefusedObject&) {
      return false;
    }
    // What was compared since the update may need less than the box that was read then.
    const Segment& box = entry.end.box;
    const bool may_be_less = is_on_demand && !entry.awaits_triangles;
    if (may_be_less ? !(min(box.a, now.box.a) == box.a && max(box.b, now.box.b) == box.b)
                    : !(now.box == box)) {
      return false;
    }
    if (!entry.is_mesh) {
      // Boxes without end are the same for many poses.
      const bool counts = countsTriangles(options_);
      if (counts && !(obstacleOf(now.object, frame, entry.shape.vertices) == entry.shape)) {
        return false;
      }
      continue;
    }
    const BvhTriangles<S> triangles = trianglesOf(*ObjectMembers<S>::shape(*entry.object));
    if (!triangles.is_finished || !(now.object.pose == entry.end.object.pose)) return false;
    if (entry.awaits_triangles && now.mesh != nullptr) {
      if (!looksSame(*now.mesh, triangles)) return false;
      continue;
    }
    if (triangles.isCloud() != (now.mesh == nullptr)) return false;
    if (now.mesh == nullptr) continue;
    const ReadObject& before = entry.end.object;
    if (!isSame(*now.mesh, triangles) || now.object.isAllOfShape() != before.isAllOfShape() ||
        now.object.added.margin != before.added.margin) {
      return false;
    }
  }
  for (const ShapeEntry& entry : shapes_) {
    if (entry.object == nullptr || !entry.is_read) continue;
    const ReadObject now = readObject(*entry.object, options_.bounds);
    if (!(obstacleOf(now, frame, entry.shape.vertices) == entry.shape)) return false;
  }
  return true;
}

template <typename S>
std::size_t Obstacles<S>::memoryUsage() const {
  const std::lock_guard<std::mutex> lock(on_demand_);
  std::size_t steps = 0;
  for (const BesideEntry& entry : beside_) {
    steps += entry.trees != nullptr ? entry.trees->memoryUsage() : 0;
    if (entry.start.mesh != nullptr && entry.start.mesh != entry.end.mesh) {
      steps += entry.start.mesh->memoryUsage();
    }
  }
  for (const ShapeEntry& entry : shapes_) {
    if (entry.shape.vertices != nullptr) steps += entry.shape.vertices->memoryUsage();
  }
  return steps + beside_.memoryUsage() + shapes_.memoryUsage() + boxes_.memoryUsage() +
         cache_.memoryUsage();
}

#define FCL_FIBERS_INSTANTIATE(S)                                                               \
  template BesideReading readBeside(const fcl::CollisionObject<S>&, bool, const Frame&, Bounds, \
                                    MeshCache*, SegmentId, MeshCache::IsSame);                  \
  template class Obstacles<S>;
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::broadphase
