// SPDX-License-Identifier: BSD-3-Clause
#include "support/managers_under_test.h"

#include <fcl/broadphase/broadphase_SSaP.h>
#include <fcl/broadphase/broadphase_SaP.h>
#include <fcl/broadphase/broadphase_bruteforce.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree_array.h>
#include <fcl/broadphase/broadphase_interval_tree.h>
#include <fcl/broadphase/broadphase_spatialhash.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define FCL_FIBERS_FINDS_LEAKS
#endif
#endif
#ifdef FCL_FIBERS_FINDS_LEAKS
#include <sanitizer/lsan_interface.h>
#endif

namespace fcl_fibers::test {
namespace {

/// FCL 0.7 does not free the leaves that its array tree is built from.
template <typename S>
class ArrayTree : public fcl::DynamicAABBTreeCollisionManager_Array<S> {
  using Base = fcl::DynamicAABBTreeCollisionManager_Array<S>;

 public:
  void registerObjects(const std::vector<fcl::CollisionObject<S>*>& objects) override {
#ifdef FCL_FIBERS_FINDS_LEAKS
    const __lsan::ScopedDisabler leaks_are_fcls;
#endif
    Base::registerObjects(objects);
  }
};

}  // namespace

template <typename S>
std::unique_ptr<FiberCollisionManager<S>> makeLayeredAabbTree(const FiberManagerOptions& options) {
  return std::make_unique<LayeredAABBTreeCollisionManager<S>>(options);
}

template <typename S>
std::unique_ptr<WrappedSphereTreeCollisionManager<S>> makeWrappedSphereTree(
    const FiberManagerOptions& options) {
  return std::make_unique<WrappedSphereTreeCollisionManager<S>>(options);
}

template <typename S>
std::unique_ptr<fcl::BroadPhaseCollisionManager<S>> makeFclTree() {
  return std::make_unique<fcl::DynamicAABBTreeCollisionManager<S>>();
}

template <typename S>
std::unique_ptr<fcl::BroadPhaseCollisionManager<S>> makeFclNaive() {
  return std::make_unique<fcl::NaiveCollisionManager<S>>();
}

template <typename S>
std::vector<std::pair<std::string, std::unique_ptr<fcl::BroadPhaseCollisionManager<S>>>>
makeFclManagers() {
  std::vector<std::pair<std::string, std::unique_ptr<fcl::BroadPhaseCollisionManager<S>>>> all;
  all.emplace_back("Naive", makeFclNaive<S>());
  all.emplace_back("SaP", std::make_unique<fcl::SaPCollisionManager<S>>());
  all.emplace_back("SSaP", std::make_unique<fcl::SSaPCollisionManager<S>>());
  all.emplace_back("IntervalTree", std::make_unique<fcl::IntervalTreeCollisionManager<S>>());
  const fcl::Vector3<S> corner = fcl::Vector3<S>::Constant(8);
  all.emplace_back("SpatialHashing", std::make_unique<fcl::SpatialHashingCollisionManager<S>>(
                                         S(0.5), -corner, corner));
  all.emplace_back("DynamicAABBTree", makeFclTree<S>());
  all.emplace_back("DynamicAABBTree_Array", std::make_unique<ArrayTree<S>>());
  return all;
}

template <typename S>
std::vector<std::pair<std::string, std::unique_ptr<fcl::BroadPhaseCollisionManager<S>>>>
makeEachManager(FiberManagerOptions options) {
  auto all = makeFclManagers<S>();
  for (const Topology topology : {Topology::kBundle, Topology::kSuperThread}) {
    options.topology = topology;
    all.emplace_back("boxes, " + topologyName(topology), makeLayeredAabbTree<S>(options));
    all.emplace_back("spheres, " + topologyName(topology), makeWrappedSphereTree<S>(options));
  }
  all.emplace_back("foreign", std::make_unique<ForeignManager<S>>());
  return all;
}

template <typename S>
void registerFibers(FiberCollisionManager<S>& manager, const Scene<S>& scene,
                    const std::vector<int>& groups) {
  for (std::size_t f = 0; f < scene.fibers().size(); ++f) {
    const FiberGroup group{f < groups.size() ? groups[f] : 0};
    manager.registerFiber(scene.fibers()[f], scene.ends()[f], group);
  }
  for (fcl::CollisionObject<S>* object : scene.loose()) manager.registerObject(object);
}

template <typename S>
std::unique_ptr<FiberCollisionManager<S>> cloneOf(
    const FiberCollisionManager<S>& manager, const std::vector<fcl::CollisionObject<S>*>& objects) {
  if (const auto* boxes = dynamic_cast<const LayeredAABBTreeCollisionManager<S>*>(&manager)) {
    return boxes->clone(objects);
  }
  return dynamic_cast<const WrappedSphereTreeCollisionManager<S>&>(manager).clone(objects);
}

template <typename S>
std::vector<fcl::CollisionObject<S>*> objectsOf(const fcl::BroadPhaseCollisionManager<S>& manager) {
  std::vector<fcl::CollisionObject<S>*> objects;
  manager.getObjects(objects);
  return objects;
}

#define FCL_FIBERS_INSTANTIATE(S)                                                          \
  template std::unique_ptr<FiberCollisionManager<S>> makeLayeredAabbTree<S>(               \
      const FiberManagerOptions&);                                                         \
  template std::unique_ptr<WrappedSphereTreeCollisionManager<S>> makeWrappedSphereTree<S>( \
      const FiberManagerOptions&);                                                         \
  template std::unique_ptr<fcl::BroadPhaseCollisionManager<S>> makeFclTree<S>();           \
  template std::unique_ptr<fcl::BroadPhaseCollisionManager<S>> makeFclNaive<S>();          \
  template std::vector<                                                                    \
      std::pair<std::string, std::unique_ptr<fcl::BroadPhaseCollisionManager<S>>>>         \
  makeFclManagers<S>();                                                                    \
  template std::vector<                                                                    \
      std::pair<std::string, std::unique_ptr<fcl::BroadPhaseCollisionManager<S>>>>         \
      makeEachManager<S>(FiberManagerOptions);                                             \
  template void registerFibers<S>(FiberCollisionManager<S>&, const Scene<S>&,              \
                                  const std::vector<int>&);                                \
  template std::unique_ptr<FiberCollisionManager<S>> cloneOf<S>(                           \
      const FiberCollisionManager<S>&, const std::vector<fcl::CollisionObject<S>*>&);      \
  template std::vector<fcl::CollisionObject<S>*> objectsOf<S>(                             \
      const fcl::BroadPhaseCollisionManager<S>&);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::test
