// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_collision_manager.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "broadphase/fcl_layout.h"
#include "broadphase/manager_query.h"
#include "broadphase/manager_state.h"

namespace fcl_fibers {

template <typename S>
class FiberCollisionManager<S>::Impl final : public broadphase::ManagerState<S> {
 public:
  using State = broadphase::ManagerState<S>;
  /// Fibers that are guessed from shared end points.
  static constexpr typename State::Kind kGuessed{/*has_neighbors=*/false, false, tree::kNoGroup};

  Impl(Hierarchy hierarchy, const FiberManagerOptions& options)
      : State(hierarchy == Hierarchy::kWrappedSpheres, options) {}
  Impl(const char* call, const Impl& original, const std::vector<Object*>& objects)
      : State(call, original, objects) {}

  static const FiberManagerOptions& checked(Hierarchy hierarchy,
                                            const FiberManagerOptions& options) {
    constexpr char kName[] = "FiberManagerOptions";
    broadphase::requireLayoutOfFcl();
    fibers::requireValid(kName, options);
    if (options.motion && hierarchy != Hierarchy::kLayeredBoxes) {
      fibers::throwInvalidArgument(kName,
                                   "motion is set, but wrapped spheres have no motion; use a "
                                   "LayeredAABBTreeCollisionManager");
    }
    if (options.motion && options.report != Report::kCapsules) {
      fibers::throwInvalidArgument(
          kName, "motion is set, but report is Report::kVolumes; set Report::kCapsules");
    }
    if (!std::isfinite(options.skin)) {
      fibers::throwInvalidArgument(kName,
                                   "skin is NaN or infinite; set a finite length, 0 for no list, "
                                   "or a negative number to have it chosen");
    }
    if (options.skin == 0) return options;
    if (hierarchy != Hierarchy::kLayeredBoxes) {
      fibers::throwInvalidArgument(kName,
                                   "skin is set, but wrapped spheres have no list; use a "
                                   "LayeredAABBTreeCollisionManager");
    }
    if (options.report != Report::kCapsules) {
      fibers::throwInvalidArgument(
          kName, "skin is set, but report is Report::kVolumes; set Report::kCapsules");
    }
    if (options.motion) {
      fibers::throwInvalidArgument(
          kName, "skin and motion are set, but a list has no steps; set one of the two");
    }
    return options;
  }

  /// Asks about the objects of another manager, of this class or of another one.
  void ask(const broadphase::ManagerQuery<S>& query,
           fcl::BroadPhaseCollisionManager<S>* other) const {
    if (other == nullptr) {
      fibers::throwInvalidArgument(query.name(), "the manager is null; pass a manager");
    }
    if (const auto* fiber_manager = dynamic_cast<const FiberCollisionManager*>(other)) {
      return broadphase::ask<S>(*this, query, *fiber_manager->impl());
    }
    std::vector<Object*> objects;
    other->getObjects(objects);
    broadphase::ask<S>(*this, query, objects);
  }

  double marginOf(const char* call, const Object* object,
                  const FiberManagerOptions& options) const {
    if (object == nullptr) {
      fibers::throwInvalidArgument(call, "the object is null; pass an object");
    }
    if (options.bounds != Bounds::kShapesAndMargins) return 0;
    auto* cache = broadphase::countsTriangles(options) ? &this->obstacles().cache() : nullptr;
    const broadphase::BesideReading read = broadphase::named(call, "the given object", [&] {
      return broadphase::readBeside(*object, false, geometry::Frame{}, options.bounds, cache);
    });
    if (read.hasTriangles()) return read.object.added.margin;
    broadphase::ReadObject bare = read.object;
    bare.added = {};
    bare.open_rounding = -1;
    geometry::Segment shape;
    broadphase::segmentOf(bare, geometry::Frame{}, shape);
    const geometry::Segment& counted = read.box;
    if (!shape.isBox() && !counted.isBox()) return counted.radius - shape.radius;
    // An open side stays at infinity.
    const auto beyond = [](double outer, double inner) {
      return outer > inner ? outer - inner : 0;
    };
    const geometry::Segment box = boxAround(shape, 0);
    return std::max({beyond(box.a.x, counted.a.x), beyond(box.a.y, counted.a.y),
                     beyond(box.a.z, counted.a.z), beyond(counted.b.x, box.b.x),
                     beyond(counted.b.y, box.b.y), beyond(counted.b.z, box.b.z)});
  }
};

template <typename S>
FiberCollisionManager<S>::FiberCollisionManager(Hierarchy hierarchy,
                                                const FiberManagerOptions& options)
    : hierarchy_(hierarchy), options_(Impl::checked(hierarchy, options)) {
  impl();
}

template <typename S>
FiberCollisionManager<S>::FiberCollisionManager(const FiberCollisionManager& original,
                                                const std::vector<Object*>& objects)
    : hierarchy_(original.hierarchy_),
      options_(original.options_),
      impl_(std::make_unique<Impl>("clone", *original.impl(), objects)) {}

// FCL's base class is not moved, because ours use none of its members.
template <typename S>
FiberCollisionManager<S>::FiberCollisionManager(FiberCollisionManager&& other) noexcept
    : hierarchy_(other.hierarchy_), options_(other.options_), impl_(std::move(other.impl_)) {}

template <typename S>
FiberCollisionManager<S>& FiberCollisionManager<S>::operator=(
    FiberCollisionManager&& other) noexcept {
  hierarchy_ = other.hierarchy_;
  options_ = other.options_;
  impl_ = std::move(other.impl_);
  return *this;
}

template <typename S>
typename FiberCollisionManager<S>::Impl& FiberCollisionManager<S>::impl() {
  if (impl_ == nullptr) impl_ = std::make_unique<Impl>(hierarchy_, options_);
  return *impl_;
}

template <typename S>
std::shared_ptr<const typename FiberCollisionManager<S>::Impl> FiberCollisionManager<S>::impl()
    const {
  // Several threads may ask a moved-from manager, so each call has an empty state of its own.
  if (impl_ == nullptr) return std::make_shared<Impl>(hierarchy_, options_);
  return {std::shared_ptr<void>(), impl_.get()};
}

template <typename S>
FiberCollisionManager<S>::~FiberCollisionManager() = default;

template <typename S>
void FiberCollisionManager<S>::registerFiber(const std::vector<Object*>& fiber, FiberEnds ends,
                                             FiberGroup group, const FiberObstacles& obstacles,
                                             const std::vector<FiberJoint<Object>>& joints) {
  typename Impl::Kind kind{
      true, ends == FiberEnds::kClosed, group.number, {obstacles.categories, obstacles.meets}};
  kind.roots = broadphase::rootsOf<S>("registerFiber", fiber, obstacles);
  impl().add("registerFiber", fiber, kind, joints);
}

template <typename S>
void FiberCollisionManager<S>::registerObstacle(Object* object, const ObstacleOptions& options) {
  typename Impl::Kind kind = Impl::kGuessed;
  kind.categories = {options.categories, options.meets};
  kind.is_solid = options.solid;
  kind.is_rigid = options.rigid;
  impl().add("registerObstacle", {object}, kind);
}

template <typename S>
void FiberCollisionManager<S>::registerObjects(const std::vector<Object*>& objects) {
  impl().add("registerObjects", objects, Impl::kGuessed);
}

template <typename S>
void FiberCollisionManager<S>::registerObject(Object* object) {
  impl().add("registerObject", {object}, Impl::kGuessed);
}

template <typename S>
void FiberCollisionManager<S>::unregisterObject(Object* object) {
  impl().remove("unregisterObject", object);
}

template <typename S>
void FiberCollisionManager<S>::setup() {
  impl().setup("setup");
}

template <typename S>
void FiberCollisionManager<S>::update() {
  impl().update("update");
}

template <typename S>
void FiberCollisionManager<S>::update(Object* object) {
  impl().update("update", {object});
}

template <typename S>
void FiberCollisionManager<S>::update(const std::vector<Object*>& objects) {
  impl().update("update", objects);
}

template <typename S>
void FiberCollisionManager<S>::beginStep() {
  impl().setStep("beginStep", true);
}

template <typename S>
void FiberCollisionManager<S>::endStep() {
  impl().setStep("endStep", false);
}

template <typename S>
void FiberCollisionManager<S>::clear() {
  impl().clear("clear");
}

template <typename S>
void FiberCollisionManager<S>::getObjects(std::vector<Object*>& objects) const {
  impl()->registry().list(objects);
}

template <typename S>
void FiberCollisionManager<S>::collide(Object* object, void* cdata,
                                       fcl::CollisionCallBack<S> callback) const {
  broadphase::ask<S>(*impl(), {cdata, callback}, object);
}

template <typename S>
void FiberCollisionManager<S>::collide(void* cdata, fcl::CollisionCallBack<S> callback) const {
  broadphase::ask<S>(*impl(), {cdata, callback});
}

template <typename S>
void FiberCollisionManager<S>::collide(fcl::BroadPhaseCollisionManager<S>* other, void* cdata,
                                       fcl::CollisionCallBack<S> callback) const {
  impl()->ask({cdata, callback}, other);
}

template <typename S>
void FiberCollisionManager<S>::distance(Object* object, void* cdata,
                                        fcl::DistanceCallBack<S> callback) const {
  broadphase::ask<S>(*impl(), {cdata, callback}, object);
}

template <typename S>
void FiberCollisionManager<S>::distance(void* cdata, fcl::DistanceCallBack<S> callback) const {
  broadphase::ask<S>(*impl(), {cdata, callback});
}

template <typename S>
void FiberCollisionManager<S>::distance(fcl::BroadPhaseCollisionManager<S>* other, void* cdata,
                                        fcl::DistanceCallBack<S> callback) const {
  impl()->ask({cdata, callback}, other);
}

template <typename S>
void FiberCollisionManager<S>::findLivePairs(std::vector<LiveObjectPair<S>>& pairs) const {
  const auto impl = this->impl();
  impl->name(impl->live("findLivePairs").entries(), pairs);
}

template <typename S>
std::vector<LiveObjectPair<S>> FiberCollisionManager<S>::begunPairs() const {
  const auto impl = this->impl();
  std::vector<LiveObjectPair<S>> pairs;
  impl->name(impl->live("begunPairs").begun(), pairs);
  return pairs;
}

template <typename S>
std::vector<LiveObjectPair<S>> FiberCollisionManager<S>::endedPairs() const {
  const auto impl = this->impl();
  std::vector<LiveObjectPair<S>> pairs;
  impl->name(impl->live("endedPairs").ended(), pairs);
  return pairs;
}

template <typename S>
std::int32_t FiberCollisionManager<S>::liveSlotCount() const {
  return impl()->live("liveSlotCount").slotCount();
}

template <typename S>
bool FiberCollisionManager<S>::empty() const {
  return size() == 0;
}

template <typename S>
std::size_t FiberCollisionManager<S>::size() const {
  return impl()->registry().size();
}

template <typename S>
const FiberManagerOptions& FiberCollisionManager<S>::options() const {
  return options_;
}

template <typename S>
bool FiberCollisionManager<S>::isRegistered(const Object* object) const {
  return object != nullptr && impl()->registry().find(object) != Impl::Registry::kNotFound;
}

template <typename S>
FiberSegment FiberCollisionManager<S>::fiberSegment(const Object* object) const {
  const tree::SegmentId id = impl()->managedId("fiberSegment", object, "the given object");
  return impl()->registry().fibers().placeOf(id);
}

template <typename S>
bool FiberCollisionManager<S>::movedSinceUpdate() const {
  return impl()->movedSinceUpdate();
}

template <typename S>
double FiberCollisionManager<S>::margin(const Object* object) const {
  return impl()->marginOf("margin", object, options_);
}

template <typename S>
bool FiberCollisionManager<S>::findMeshContacts(const Object* capsule, const Object* mesh,
                                                double margin,
                                                std::vector<MeshContact>& contacts) const {
  return broadphase::findMeshContacts<S>(*impl(), capsule, mesh, margin, contacts);
}

template <typename S>
bool FiberCollisionManager<S>::findImpact(const Object* a, const Object* b,
                                          const FiberCollisionManager* other,
                                          TimedContact& contact) const {
  return broadphase::findImpact<S>(*impl(), other == nullptr ? nullptr : other->impl().get(), a, b,
                                   contact);
}

template <typename S>
std::size_t FiberCollisionManager<S>::memoryUsage() const {
  return impl()->memoryUsage();
}

template <typename S>
LayeredAABBTreeCollisionManager<S>::LayeredAABBTreeCollisionManager(
    const FiberManagerOptions& options)
    : FiberCollisionManager<S>(FiberCollisionManager<S>::Hierarchy::kLayeredBoxes, options) {}

template <typename S>
LayeredAABBTreeCollisionManager<S>::LayeredAABBTreeCollisionManager(
    const LayeredAABBTreeCollisionManager& original, const std::vector<Object*>& objects)
    : FiberCollisionManager<S>(original, objects) {}

template <typename S>
std::unique_ptr<LayeredAABBTreeCollisionManager<S>> LayeredAABBTreeCollisionManager<S>::clone(
    const std::vector<Object*>& objects) const {
  return std::unique_ptr<LayeredAABBTreeCollisionManager>(
      new LayeredAABBTreeCollisionManager(*this, objects));
}

template <typename S>
WrappedSphereTreeCollisionManager<S>::WrappedSphereTreeCollisionManager(
    const FiberManagerOptions& options)
    : FiberCollisionManager<S>(FiberCollisionManager<S>::Hierarchy::kWrappedSpheres, options) {}

template <typename S>
WrappedSphereTreeCollisionManager<S>::WrappedSphereTreeCollisionManager(
    const WrappedSphereTreeCollisionManager& original, const std::vector<Object*>& objects)
    : FiberCollisionManager<S>(original, objects) {}

template <typename S>
std::size_t WrappedSphereTreeCollisionManager<S>::cageCount() const {
  const auto impl = this->impl();
  const typename WrappedSphereTreeCollisionManager::Impl::QueryScope scope(*impl, "cageCount");
  return impl->generations().main().cages().all;
}

template <typename S>
std::size_t WrappedSphereTreeCollisionManager<S>::cagesRecomputed() const {
  const auto impl = this->impl();
  const typename WrappedSphereTreeCollisionManager::Impl::QueryScope scope(*impl,
                                                                           "cagesRecomputed");
  return impl->generations().main().cages().recomputed;
}

template <typename S>
std::unique_ptr<WrappedSphereTreeCollisionManager<S>> WrappedSphereTreeCollisionManager<S>::clone(
    const std::vector<Object*>& objects) const {
  return std::unique_ptr<WrappedSphereTreeCollisionManager>(
      new WrappedSphereTreeCollisionManager(*this, objects));
}

template class FiberCollisionManager<float>;
template class FiberCollisionManager<double>;
template class LayeredAABBTreeCollisionManager<float>;
template class LayeredAABBTreeCollisionManager<double>;
template class WrappedSphereTreeCollisionManager<float>;
template class WrappedSphereTreeCollisionManager<double>;

}  // namespace fcl_fibers
