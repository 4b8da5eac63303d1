// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/mesh_cache.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <utility>

#include <fcl/geometry/bvh/BVH_model.h>

#include "geometry/same_mesh.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::MeshPoint;
using geometry::TriangleIndices;
using geometry::Vec3d;

template <class Bv>
auto read(const fcl::CollisionGeometry<typename Bv::S>& geometry) {
  const auto& model = static_cast<const fcl::BVHModel<Bv>&>(geometry);
  BvhTriangles<typename Bv::S> found;
  found.is_finished = model.build_state == fcl::BVH_BUILD_STATE_PROCESSED ||
                      model.build_state == fcl::BVH_BUILD_STATE_UPDATED;
  found.points = model.vertices;
  found.triangles = model.tri_indices;
  found.point_count = static_cast<std::size_t>(model.num_vertices);
  found.triangle_count =
      model.tri_indices == nullptr ? 0 : static_cast<std::size_t>(model.num_tris);
  return found;
}

/// The box of the points and the ball around its middle, as FCL bounds a model.
LocalBounds boundsOf(const std::vector<MeshPoint>& points) {
  LocalBounds bounds;
  if (points.empty()) return bounds;
  bounds.box = {toVec3d(points[0]), toVec3d(points[0])};
  for (const MeshPoint& point : points) {
    bounds.box.low = min(bounds.box.low, toVec3d(point));
    bounds.box.high = max(bounds.box.high, toVec3d(point));
  }
  bounds.center = bounds.box.middle();
  double squared = 0;
  for (const MeshPoint& point : points) {
    squared = std::max(squared, squaredNorm(toVec3d(point) - bounds.center));
  }
  // The center carries a rounding. Squares may overflow, and then there is no ball.
  constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
  bounds.radius = std::sqrt(squared) * (1 + kRounding) + kRounding * maxNorm(bounds.center);
  return bounds;
}

template <typename S>
MeshPoint toMeshPoint(const fcl::Vector3<S>& p) {
  return {{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2]), 0}};
}

template <typename S>
bool hasPoints(const Mesh& mesh, const BvhTriangles<S>& triangles) {
  const std::vector<MeshPoint>& points = mesh.index().points();
  // Three numbers without anything between them.
  static_assert(sizeof(fcl::Vector3<S>) == 3 * sizeof(S));
  return points.size() == triangles.point_count &&
         (points.empty() ||
          geometry::arePoints(points.data(), triangles.points->data(), points.size()));
}

template <typename S>
bool hasTriangles(const Mesh& mesh, const BvhTriangles<S>& triangles) {
  const std::vector<TriangleIndices>& known = mesh.index().triangles();
  return known.size() == triangles.triangle_count &&
         (known.empty() ||
          geometry::areTriangles(known.data(), indicesOf(*triangles.triangles), known.size()));
}

template <typename S>
std::vector<MeshPoint> pointsOf(const BvhTriangles<S>& triangles) {
  std::vector<MeshPoint> points(triangles.point_count);
  std::transform(triangles.points, triangles.points + triangles.point_count, points.begin(),
                 toMeshPoint<S>);
  return points;
}

/// Whether it is known by the model, and not by another one that has its address now.
bool isOf(const std::weak_ptr<const void>& known, const MeshCache::Model& model) {
  return !known.owner_before(model) && !model.owner_before(known);
}

template <typename S>
std::shared_ptr<Mesh> makeMesh(const BvhTriangles<S>& triangles) {
  std::vector<TriangleIndices> indices(triangles.triangle_count);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const std::size_t* from = indicesOf(triangles.triangles[i]);
    indices[i] = {static_cast<std::int32_t>(from[0]), static_cast<std::int32_t>(from[1]),
                  static_cast<std::int32_t>(from[2])};
  }
  return std::make_shared<Mesh>(pointsOf(triangles), std::move(indices));
}

}  // namespace

template <typename S>
BvhTriangles<S> trianglesOf(const fcl::CollisionGeometry<S>& model) {
  switch (model.getNodeType()) {
    case fcl::BV_AABB:
      return read<fcl::AABB<S>>(model);
    case fcl::BV_OBB:
      return read<fcl::OBB<S>>(model);
    case fcl::BV_RSS:
      return read<fcl::RSS<S>>(model);
    case fcl::BV_kIOS:
      return read<fcl::kIOS<S>>(model);
    case fcl::BV_OBBRSS:
      return read<fcl::OBBRSS<S>>(model);
    case fcl::BV_KDOP16:
      return read<fcl::KDOP<S, 16>>(model);
    case fcl::BV_KDOP18:
      return read<fcl::KDOP<S, 18>>(model);
    default:
      return read<fcl::KDOP<S, 24>>(model);
  }
}

template <typename S>
std::string BvhTriangles<S>::problem() const {
  constexpr std::size_t kMost = std::size_t{1} << 27;
  if (!is_finished) {
    return "its mesh is empty or unfinished; add triangles and call endModel(), endReplaceModel() "
           "or endUpdateModel()";
  }
  if (point_count > kMost || triangle_count > kMost) {
    return "its mesh has more than 2^27 points or triangles; split it";
  }
  for (std::size_t i = 0; i < point_count; ++i) {
    if (points[i].allFinite()) continue;
    return "point " + std::to_string(i) +
           " of its mesh is NaN or infinite; give it finite coordinates";
  }
  for (std::size_t t = 0; t < triangle_count; ++t) {
    const std::size_t* indices = indicesOf(triangles[t]);
    for (int corner = 0; corner < 3; ++corner) {
      if (indices[corner] < point_count) continue;
      return "triangle " + std::to_string(t) + " of its mesh has the point " +
             std::to_string(indices[corner]) + " of " + std::to_string(point_count) +
             "; give it indices of its points";
    }
  }
  return {};
}

Mesh::Mesh(std::vector<MeshPoint> points, std::vector<TriangleIndices> triangles)
    : index_(std::move(points), std::move(triangles)), bounds_(boundsOf(index_.points())) {}

Mesh::Mesh(const Mesh& other, const std::vector<MeshPoint>& points)
    : index_(other.index_), leak_(other.leak_.load()) {
  refit(points);
}

void Mesh::refit(const std::vector<MeshPoint>& points) {
  index_.refit(points);
  bounds_ = boundsOf(points);
  is_inside_out_ = kUnknown;
}

index::TriangleId Mesh::firstLeak() const {
  if (leak_ == kUnknown) leak_ = index::firstLeak(index_.triangles());
  return leak_;
}

bool Mesh::isInsideOut() const {
  if (is_inside_out_ == kUnknown) is_inside_out_ = index::isInsideOut(index_) ? 1 : 0;
  return is_inside_out_ == 1;
}

template <typename S>
bool isSame(const Mesh& mesh, const BvhTriangles<S>& triangles) {
  return hasPoints(mesh, triangles) && hasTriangles(mesh, triangles);
}

template <typename S>
bool looksSame(const Mesh& mesh, const BvhTriangles<S>& triangles) {
  const std::vector<MeshPoint>& points = mesh.index().points();
  if (!triangles.is_finished || points.size() != triangles.point_count ||
      mesh.index().triangles().size() != triangles.triangle_count) {
    return false;
  }
  // They are spread over all points, because a program may move a part of a body alone.
  constexpr std::size_t kFew = 5;
  bool are_same = true;
  for (std::size_t i = 0; i < kFew && !points.empty(); ++i) {
    const std::size_t at = i * (points.size() - 1) / (kFew - 1);
    are_same &= toVec3d(points[at]) == toVec3d(toMeshPoint(triangles.points[at]));
  }
  return are_same;
}

template <typename S>
std::shared_ptr<const Mesh> MeshCache::read(const Model& model, const BvhTriangles<S>& triangles,
                                            IsSame is_same) {
  if (!triangles.is_finished) return nullptr;
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto accepted = [&](Slot& slot) -> std::shared_ptr<const Mesh> {
    if (!isOf(slot.model, model)) slot.model = model;
    slot.points = triangles.points;
    slot.triangles = triangles.triangles;
    slot.is_compared = true;
    return slot.mesh;
  };
  const auto found = slots_.find(model.get());
  if (found == slots_.end()) {
    return triangles.problem().empty() ? accepted(newSlot(model, makeMesh(triangles))) : nullptr;
  }
  Slot& slot = found->second;
  slot.is_recent = true;
  const bool is_in_place = isOf(slot.model, model) && slot.points == triangles.points &&
                           slot.triangles == triangles.triangles &&
                           slot.mesh->index().points().size() == triangles.point_count &&
                           slot.mesh->index().triangles().size() == triangles.triangle_count;
  const bool is_known =
      is_same == IsSame::kAlways || (is_same == IsSame::kInUpdate && slot.is_compared);
  if (is_in_place && is_known) return slot.mesh;
  // What was found to be proper still is.
  if (isSame(*slot.mesh, triangles)) return accepted(slot);
  slot.points = nullptr;  // in case it is refused
  if (!triangles.problem().empty()) return nullptr;
  if (!hasTriangles(*slot.mesh, triangles) ||
      slot.mesh->index().points().size() != triangles.point_count) {
    slot.mesh = makeMesh(triangles);
  } else if (slot.mesh.use_count() > 1) {
    // Nobody else can take hold of it meanwhile.
    slot.mesh = std::make_shared<Mesh>(*slot.mesh, pointsOf(triangles));
  } else {
    // Another thread may have let go of it a moment ago, after reading it. To copy the pointer
    // and let go of it orders those reads before what is written here.
    std::shared_ptr<Mesh>(slot.mesh).reset();
    // If the refit runs out of memory, the mesh is gone.
    Slot moved = std::move(slot);
    slots_.erase(found);
    moved.mesh->refit(pointsOf(triangles));
    return accepted(slots_.emplace(model.get(), std::move(moved)).first->second);
  }
  return accepted(slot);
}

std::shared_ptr<const Mesh> MeshCache::find(const Model& model) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = slots_.find(model.get());
  if (found == slots_.end()) return nullptr;
  return isOf(found->second.model, model) ? found->second.mesh : nullptr;
}

void MeshCache::keep(const Model& model, const std::shared_ptr<const Mesh>& mesh) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = slots_.find(model.get());
  if (found != slots_.end() && found->second.mesh == mesh && isOf(found->second.model, model)) {
    return;
  }
  // Only the sole owner changes it, and `mesh` remains another owner.
  newSlot(model, std::const_pointer_cast<Mesh>(mesh));
}

/// A query with another object or manager puts its meshes here, and no update may follow that tells
/// which are still asked for.
MeshCache::Slot& MeshCache::newSlot(const Model& model, std::shared_ptr<Mesh> mesh) {
  if (slots_.size() >= most_) {
    for (auto slot = slots_.begin(); slot != slots_.end();) {
      slot = slot->second.model.expired() ? slots_.erase(slot) : std::next(slot);
    }
    most_ = 2 * slots_.size() + 16;
  }
  return slots_[model.get()] = {std::move(mesh), model};
}

void MeshCache::beginUpdate() {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (auto& slot : slots_) slot.second.is_compared = false;
}

void MeshCache::retain(const void* model) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = slots_.find(model);
  if (found != slots_.end()) found->second.is_recent = true;
}

void MeshCache::forgetUnused() {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (auto slot = slots_.begin(); slot != slots_.end();) {
    const bool is_used = slot->second.is_recent && !slot->second.model.expired();
    slot->second.is_recent = false;
    slot = is_used ? std::next(slot) : slots_.erase(slot);
  }
}

void MeshCache::forget(const void* model) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto slot = slots_.find(model);
  if (slot != slots_.end() && slot->second.mesh.use_count() == 1) slots_.erase(slot);
}

void MeshCache::clear() {
  const std::lock_guard<std::mutex> lock(mutex_);
  slots_.clear();
}

std::size_t MeshCache::size() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return slots_.size();
}

std::size_t MeshCache::memoryUsage() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::size_t bytes = 0;
  for (const auto& slot : slots_) bytes += sizeof(slot) + slot.second.mesh->memoryUsage();
  return bytes;
}

#define FCL_FIBERS_INSTANTIATE(S)                                                            \
  template struct BvhTriangles<S>;                                                           \
  template BvhTriangles<S> trianglesOf(const fcl::CollisionGeometry<S>&);                    \
  template std::shared_ptr<const Mesh> MeshCache::read(const Model&, const BvhTriangles<S>&, \
                                                       IsSame);                              \
  template bool isSame(const Mesh&, const BvhTriangles<S>&);                                 \
  template bool looksSame(const Mesh&, const BvhTriangles<S>&);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::broadphase
