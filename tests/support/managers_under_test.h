// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>
#include <fcl_fibers/fiber_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "support/pair_oracle.h"
#include "support/scalars.h"
#include "support/scene.h"

namespace fcl_fibers::test {

// Made in one file, as the headers of FCL's trees are slow to compile.
template <typename S>
std::unique_ptr<FiberCollisionManager<S>> makeLayeredAabbTree(const FiberManagerOptions& options);
template <typename S>
std::unique_ptr<WrappedSphereTreeCollisionManager<S>> makeWrappedSphereTree(
    const FiberManagerOptions& options);
template <typename S>
std::unique_ptr<fcl::BroadPhaseCollisionManager<S>> makeFclTree();
template <typename S>
std::unique_ptr<fcl::BroadPhaseCollisionManager<S>> makeFclNaive();
/// One of each of FCL's managers, with its name.
template <typename S>
std::vector<std::pair<std::string, std::unique_ptr<fcl::BroadPhaseCollisionManager<S>>>>
makeFclManagers();
/// These, ours with both topologies, and one of another program.
template <typename S>
std::vector<std::pair<std::string, std::unique_ptr<fcl::BroadPhaseCollisionManager<S>>>>
makeEachManager(FiberManagerOptions options = {});

inline std::string topologyName(Topology topology) {
  return topology == Topology::kBundle ? "Bundle" : "SuperThread";
}

// The managers that the contract suites run over. Each says how to make one, what its leaves are
// bounded by, and whether it promises what FCL's own does not.

template <LeafVolume kLeafVolume, typename ScalarT, Topology kTopology>
struct FiberManagerConfig {
  using Scalar = ScalarT;
  static constexpr bool kIsFiberManager = true;
  static constexpr LeafVolume kVolume = kLeafVolume;

  static auto make(FiberManagerOptions options = {}) {
    options.topology = kTopology;
    if constexpr (kVolume == LeafVolume::kBox) {
      return makeLayeredAabbTree<Scalar>(options);
    } else {
      return makeWrappedSphereTree<Scalar>(options);
    }
  }
  static std::string name() {
    return (kVolume == LeafVolume::kBox ? "LayeredAabb" : "WrappedSphere") +
           topologyName(kTopology) + scalarName(Scalar());
  }
};

template <typename Scalar, Topology kTopology>
using LayeredAabb = FiberManagerConfig<LeafVolume::kBox, Scalar, kTopology>;
template <typename Scalar, Topology kTopology>
using WrappedSphere = FiberManagerConfig<LeafVolume::kSphere, Scalar, kTopology>;

template <typename ScalarT>
struct FclTree {
  using Scalar = ScalarT;
  static constexpr bool kIsFiberManager = false;
  static constexpr LeafVolume kVolume = LeafVolume::kStock;

  static auto make(const FiberManagerOptions& = {}) { return makeFclTree<Scalar>(); }
  static std::string name() { return "FclDynamicAabbTree" + scalarName(Scalar()); }
};

template <typename A, typename B>
struct Joined;
template <typename... A, typename... B>
struct Joined<testing::Types<A...>, testing::Types<B...>> {
  using Types = testing::Types<A..., B...>;
};

// By default the four of ours that have every pair of volume, scalar and topology.
#ifdef FCL_FIBERS_ALL_MANAGERS
template <LeafVolume kVolume>
using ManagersOf = testing::Types<FiberManagerConfig<kVolume, float, Topology::kBundle>,
                                  FiberManagerConfig<kVolume, float, Topology::kSuperThread>,
                                  FiberManagerConfig<kVolume, double, Topology::kBundle>,
                                  FiberManagerConfig<kVolume, double, Topology::kSuperThread>>;
using LayeredManagers = ManagersOf<LeafVolume::kBox>;
using WrappedManagers = ManagersOf<LeafVolume::kSphere>;
using FclManagers = testing::Types<FclTree<float>, FclTree<double>>;
#elif defined(FCL_FIBERS_OTHER_MANAGERS)  // What the default leaves out.
using LayeredManagers = testing::Types<LayeredAabb<double, Topology::kBundle>,
                                       LayeredAabb<float, Topology::kSuperThread>>;
using WrappedManagers = testing::Types<WrappedSphere<float, Topology::kBundle>,
                                       WrappedSphere<double, Topology::kSuperThread>>;
using FclManagers = testing::Types<FclTree<double>>;
#else
using LayeredManagers = testing::Types<LayeredAabb<float, Topology::kBundle>,
                                       LayeredAabb<double, Topology::kSuperThread>>;
using WrappedManagers = testing::Types<WrappedSphere<double, Topology::kBundle>,
                                       WrappedSphere<float, Topology::kSuperThread>>;
using FclManagers = testing::Types<>;
#endif
using FiberManagers = Joined<LayeredManagers, WrappedManagers>::Types;
/// Ours, and FCL's own, so that what is tested is FCL's contract.
using AllManagers = Joined<FiberManagers, FclManagers>::Types;

struct ManagerNames {
  template <typename Config>
  static std::string GetName(int) {
    return Config::name();
  }
};

/// A suite of tests that run over these managers and share nothing.
#define MANAGER_SUITE(Suite, Managers)   \
  template <typename Config>             \
  class Suite : public testing::Test {}; \
  TYPED_TEST_SUITE(Suite, Managers, ::fcl_fibers::test::ManagerNames)

/// Reports and margins; those that FCL's own has: none.
template <typename Config>
std::vector<FiberManagerOptions> optionsToTest(double margin) {
  std::vector<FiberManagerOptions> all(1);
  if (!Config::kIsFiberManager) return all;
  all.clear();
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    for (const double m : margin > 0 ? std::vector{0.0, margin} : std::vector{0.0}) {
      FiberManagerOptions options;
      options.report = report;
      options.margin = m;
      all.push_back(options);
    }
  }
  return all;
}

/// Few, with neighbours by number and by arc length, margins and threads among them.
inline std::vector<FiberManagerOptions> assortedOptions() {
  std::vector<FiberManagerOptions> all(4);
  all[0].ignored_neighbors = 1;
  all[1].report = Report::kCapsules;
  all[1].margin = 0.02;
  all[2].report = Report::kCapsules;
  all[2].ignored_neighbors = 2;
  all[2].threads = 2;
  all[3].margin = 0.01;
  all[3].ignored_arc_length = 0.27;
  return all;
}

template <typename Config>
PairRules rulesOf(const FiberManagerOptions& options) {
  return {Config::kVolume, options.report, options.margin, options.ignored_neighbors,
          options.ignored_arc_length};
}

inline std::string describe(const FiberManagerOptions& options) {
  return std::string(options.report == Report::kVolumes ? "kVolumes" : "kCapsules") + ", margin " +
         std::to_string(options.margin) + ", ignored neighbors " +
         std::to_string(options.ignored_neighbors) + ", ignored arc length " +
         std::to_string(options.ignored_arc_length) + ", threads " +
         std::to_string(options.threads);
}

/// FCL leaves the order of arguments open.
template <typename Config>
constexpr ArgumentOrder kOrder =
    Config::kIsFiberManager ? ArgumentOrder::kPromised : ArgumentOrder::kAny;

/// Registers every fiber of the scene, and then what is in none, by itself. The first fibers have
/// the groups.
template <typename S>
void registerFibers(FiberCollisionManager<S>& manager, const Scene<S>& scene,
                    const std::vector<int>& groups = {});

/// clone() of whichever class the manager is.
template <typename S>
std::unique_ptr<FiberCollisionManager<S>> cloneOf(
    const FiberCollisionManager<S>& manager, const std::vector<fcl::CollisionObject<S>*>& objects);

template <typename S>
std::vector<fcl::CollisionObject<S>*> objectsOf(const fcl::BroadPhaseCollisionManager<S>& manager);

/// Another program's manager, that knows FCL's interface only. Holds objects and finds nothing.
template <typename S>
class ForeignManager : public fcl::BroadPhaseCollisionManager<S> {
 public:
  using Object = fcl::CollisionObject<S>;
  using Base = fcl::BroadPhaseCollisionManager<S>;
  using Base::update;

  explicit ForeignManager(std::vector<Object*> objects = {}) : objects_(std::move(objects)) {}

  void registerObject(Object* object) override { objects_.push_back(object); }
  void unregisterObject(Object*) override {}
  void setup() override {}
  void update() override {}
  void clear() override { objects_.clear(); }
  void getObjects(std::vector<Object*>& objects) const override { objects = objects_; }
  void collide(Object*, void*, fcl::CollisionCallBack<S>) const override {}
  void collide(void*, fcl::CollisionCallBack<S>) const override {}
  void collide(Base*, void*, fcl::CollisionCallBack<S>) const override {}
  void distance(Object*, void*, fcl::DistanceCallBack<S>) const override {}
  void distance(void*, fcl::DistanceCallBack<S>) const override {}
  void distance(Base*, void*, fcl::DistanceCallBack<S>) const override {}
  bool empty() const override { return objects_.empty(); }
  std::size_t size() const override { return objects_.size(); }

 private:
  std::vector<Object*> objects_;
};

}  // namespace fcl_fibers::test
