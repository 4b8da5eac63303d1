// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/obstacles.h"

#include <utility>

#include "broadphase/frame_of_other.h"
#include "broadphase/object_source.h"
#include "broadphase/obstacle_shapes.h"
#include "index/posed_triangles.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Frame;
using geometry::Obstacle;
using geometry::Segment;
using index::SegmentId;

/// The boxes of meshes as segments. An id is a position.
class BoxSource final : public index::SegmentSource {
 public:
  explicit BoxSource(std::vector<Segment> boxes) : boxes_(std::move(boxes)) {}

  bool read(const SegmentId* ids, int count, int /*ahead*/, const Frame& /*frame*/,
            index::SegmentBlock& out, index::BlockMask& present) const override {
    for (int i = 0; i < count; ++i) out.set(i, boxes_[static_cast<std::size_t>(ids[i])]);
    present = geometry::firstOfBlock(count);
    return true;
  }
  bool staysFiniteIn(const Frame& /*frame*/) const override { return true; }
  bool isFasterInOrder() const override { return false; }
  [[noreturn]] void refuse(SegmentId /*id*/, const Frame& /*frame*/) const override {
    throw std::logic_error("fcl_fibers: every box can be read");
  }

 private:
  std::vector<Segment> boxes_;
};

index::IndexOptions boxOptions(const FiberManagerOptions& options) {
  index::IndexOptions of_boxes;
  of_boxes.capsules = true;  // then boxes are compared in double
  of_boxes.margin = options.margin;
  return of_boxes;
}

template <typename S>
geometry::AffineMap poseOf(const fcl::CollisionObject<S>& object) {
  const auto& matrix = ObjectMembers<S>::pose(object).matrix();
  return {{toVec3(matrix.col(0)), toVec3(matrix.col(1)), toVec3(matrix.col(2))},
          toVec3(matrix.col(3))};
}

bool operator==(const Obstacle& p, const Obstacle& q) {
  return p.kind == q.kind && p.point == q.point && p.vector[0] == q.vector[0] &&
         p.vector[1] == q.vector[1] && p.vector[2] == q.vector[2] && p.offset == q.offset &&
         p.margin == q.margin;
}

}  // namespace

template <typename S>
MeshReading readMesh(const char* call, const fcl::CollisionObject<S>& object, bool is_solid,
                     const Frame& frame, Bounds bounds, MeshCache& cache,
                     const NameOfObject& name) {
  MeshReading reading;
  // This checks the pose, and gives the box of a cloud of points.
  reading.box = readObject(call, object, frame, bounds, name);
  const BvhTriangles<S> triangles = trianglesOf(*ObjectMembers<S>::shape(object));
  if (triangles.isCloud()) return reading;
  if (const std::string problem = triangles.problem(); !problem.empty()) {
    fibers::throwInvalidArgument(call, name() + ": " + problem);
  }
  reading.mesh = cache.read(object.collisionGeometry(), triangles);
  if (is_solid && reading.mesh->firstLeak() >= 0) {
    fibers::throwInvalidArgument(call,
                                 name() + ": its mesh is not watertight at triangle " +
                                     std::to_string(reading.mesh->firstLeak()) +
                                     "; close it, or register it without ObstacleOptions::solid");
  }
  if (is_solid && reading.mesh->isInsideOut()) {
    fibers::throwInvalidArgument(
        call, name() +
                  ": its mesh is inside out: its triangles are clockwise seen from outside; "
                  "exchange two points of each");
  }
  placeMesh(object, frame, bounds, reading);
  if (!index::fitsIn(frame, reading.posed(tree::kAllCategories, is_solid))) {
    fibers::throwInvalidArgument(call, name() +
                                           ": its coordinates overflow in the unit of the fibers; "
                                           "bring it nearer to them or make it smaller");
  }
  return reading;
}

template <typename S>
void placeMesh(const fcl::CollisionObject<S>& object, const Frame& frame, Bounds bounds,
               MeshReading& reading) {
  reading.pose = poseOf(object);
  reading.counts_triangles =
      readMeshBox(object, reading.mesh->bounds(), frame, bounds, reading.box, reading.margin);
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
    : bounds_(options.bounds), moves_(options.motion), boxes_(boxOptions(options)) {}

// --- Changing ---

template <typename S>
void Obstacles<S>::reserve(std::size_t count) {
  const auto reserveFor = [](auto& entries, std::size_t size) {
    if (size > entries.capacity()) entries.reserve(std::max(size, 2 * entries.capacity()));
  };
  reserveFor(meshes_, meshes_.size() + count);
  reserveFor(shapes_, shapes_.size() + count);
}

template <typename S>
void Obstacles<S>::add(Object* object, SegmentId id, tree::Categories categories, bool is_solid) {
  if (broadphase::isMesh(*object)) {
    meshes_.push_back({{}, object, id, categories, is_solid});
  } else {
    shapes_.push_back({object, id, false, {}, {}, {}});
  }
}

template <typename S>
void Obstacles<S>::remove(SegmentId id) {
  if (const MeshEntry* mesh = find(meshes_, id)) {
    meshes_.erase(meshes_.begin() + (mesh - meshes_.data()));
    cache_.forgetUnused();
  } else if (const ShapeEntry* shape = find(shapes_, id)) {
    shapes_.erase(shapes_.begin() + (shape - shapes_.data()));
  }
}

template <typename S>
void Obstacles<S>::renumber(const ObjectRegistry<S>& registry) {
  for (MeshEntry& entry : meshes_) entry.id = registry.find(entry.object);
  for (ShapeEntry& entry : shapes_) entry.id = registry.find(entry.object);
}

template <typename S>
void Obstacles<S>::clear() {
  meshes_.clear();
  shapes_.clear();
  boxes_.clear();
  start_boxes_ = nullptr;
  box_ids_.clear();
  cache_.clear();
}

template <typename S>
void Obstacles<S>::addCopy(const Obstacles& other, Object* object, SegmentId id,
                           tree::Categories categories) {
  const MeshEntry* original = other.mesh(id);
  reserve(1);
  add(object, id, categories, original != nullptr && original->is_solid);
  if (original != nullptr && original->mesh != nullptr && broadphase::isMesh(*object)) {
    cache_.keep(object->collisionGeometry(), original->mesh);
  }
}

// --- Reading ---

template <typename S>
void Obstacles<S>::read(const char* call, MeshEntry& entry, const Frame& frame,
                        const NameOfObject& name) {
  if (!broadphase::isMesh(*entry.object)) {
    fibers::throwInvalidArgument(
        call, name() + ": it is no mesh any more; unregister it and register it again");
  }
  MeshReading now = readMesh(call, *entry.object, entry.is_solid, frame, bounds_, cache_, name);
  if (moves_) {
    // Other triangles have no way from those before. They rest where they are now.
    const bool is_same =
        entry.is_read && (entry.start.mesh == nullptr) == (now.mesh == nullptr) &&
        (now.mesh == nullptr || entry.start.mesh->index().hasTrianglesOf(now.mesh->index()));
    if (is_same) {
      const FrameOfOther change(entry.frame, frame);
      if (!change.isIdentity()) entry.start.box = change.grown(entry.start.box);
    } else {
      entry.start = now;
    }
    entry.frame = frame;
  }
  static_cast<MeshReading&>(entry) = std::move(now);
  entry.forgetTrees();
  entry.is_read = true;
}

template <typename S>
void Obstacles<S>::read(ShapeEntry& entry, const Frame& frame) {
  readObstacle(*entry.object, frame, bounds_, entry.shape);
  if (moves_) {
    readObstacle(*entry.object, Frame{}, bounds_, entry.end);
    if (!entry.is_read) entry.start = entry.end;
  }
  entry.is_read = true;
}

template <typename S>
void Obstacles<S>::finishReading(const Frame& frame) {
  if (meshes_.empty() && box_ids_.empty()) return;
  cache_.forgetUnused();
  std::vector<Segment> boxes;
  tree::Fibers one_each;
  box_ids_.clear();
  for (const MeshEntry& entry : meshes_) {
    one_each.ids.push_back(static_cast<SegmentId>(boxes.size()));
    one_each.endFiber();
    boxes.push_back(entry.box);
    box_ids_.push_back(entry.id);
  }
  const auto count = static_cast<SegmentId>(boxes.size());
  boxes_.build(BoxSource(std::move(boxes)), frame, 0, count, one_each);
  if (!moves_) return;
  std::vector<Segment> starts;
  for (const MeshEntry& entry : meshes_) starts.push_back(entry.start.box);
  start_boxes_ = std::make_unique<index::SegmentIndex>(boxes_.options());
  start_boxes_->copy(boxes_);
  start_boxes_->tryRefit(BoxSource(std::move(starts)), frame);
}

template <typename S>
bool Obstacles<S>::isCurrent(const Frame& frame) const {
  for (const MeshEntry& entry : meshes_) {
    if (!entry.is_read) continue;
    if (!broadphase::isMesh(*entry.object)) return false;
    MeshReading now;
    if (readSegment(*entry.object, frame, bounds_, now.box) != nullptr) return false;
    const BvhTriangles<S> triangles = trianglesOf(*ObjectMembers<S>::shape(*entry.object));
    if (!triangles.is_finished || triangles.isCloud() != (entry.mesh == nullptr)) return false;
    if (entry.mesh != nullptr) {
      if (!isSame(*entry.mesh, triangles)) return false;
      now.mesh = entry.mesh;
      placeMesh(*entry.object, frame, bounds_, now);
    }
    if (!(now.box == entry.box) || now.counts_triangles != entry.counts_triangles ||
        now.margin != entry.margin || !(now.pose == entry.pose)) {
      return false;
    }
  }
  for (const ShapeEntry& entry : shapes_) {
    Obstacle shape;
    readObstacle(*entry.object, frame, bounds_, shape);
    if (entry.is_read && !(shape == entry.shape)) return false;
  }
  return true;
}

template <typename S>
std::size_t Obstacles<S>::memoryUsage() const {
  std::size_t steps = 0;
  for (const MeshEntry& entry : meshes_) {
    steps += entry.trees->memoryUsage();
    if (entry.start.mesh != nullptr && entry.start.mesh != entry.mesh) {
      steps += entry.start.mesh->memoryUsage();
    }
  }
  return steps + meshes_.capacity() * sizeof(MeshEntry) + shapes_.capacity() * sizeof(ShapeEntry) +
         boxes_.memoryUsage() + (start_boxes_ ? start_boxes_->memoryUsage() : 0) +
         box_ids_.capacity() * sizeof(SegmentId) + cache_.memoryUsage();
}

#define FCL_FIBERS_INSTANTIATE(S)                                                                \
  template MeshReading readMesh(const char*, const fcl::CollisionObject<S>&, bool, const Frame&, \
                                Bounds, MeshCache&, const NameOfObject&);                        \
  template void placeMesh(const fcl::CollisionObject<S>&, const Frame&, Bounds, MeshReading&);   \
  template class Obstacles<S>;
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::broadphase
