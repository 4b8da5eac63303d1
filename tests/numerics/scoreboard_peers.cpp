// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/scoreboard_peers.h"

#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <type_traits>

#include <fcl/geometry/shape/capsule.h>

#include "benchmarks/contenders/closed_form.h"

#if FCL_FIBERS_WITH_EMBREE == 4
#include <embree4/rtcore.h>
#elif defined(FCL_FIBERS_WITH_EMBREE)
#include <embree3/rtcore.h>
#endif
#ifdef FCL_FIBERS_WITH_COAL
#include <coal/broadphase/broadphase_dynamic_AABB_tree.h>
#include <coal/collision.h>
#include <coal/shape/geometric_shapes.h>
#include <coal/config.hh>
#endif

namespace fcl_fibers::test {
namespace {

#ifdef FCL_FIBERS_WITH_EMBREE
struct FloatBox {
  float low[3], high[3];
};

/// Around the box of an object that is tight, rounded outward.
template <typename S>
FloatBox boxOf(const fcl::CollisionObject<S>& object) {
  const benchmarks::CapsuleAxis<S> axis = benchmarks::axisOf(object);
  FloatBox box;
  for (int k = 0; k < 3; ++k) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const double center = static_cast<double>(axis.center[k]);
    const double extent = std::abs(double(axis.half[k])) + double(axis.radius);
    const auto at = static_cast<std::size_t>(k);
    box.low[at] = std::nextafter(static_cast<float>(center - extent), -kInfinity);
    box.high[at] = std::nextafter(static_cast<float>(center + extent), kInfinity);
  }
  return box;
}

template <typename S>
std::vector<NumberPair> embree(const Specimen<S>& specimen, double) {
  struct Query {
    Objects<S> objects;
    std::vector<FloatBox> boxes;
    std::mutex mutex;
    std::vector<NumberPair> found;
  } query;
  query.objects = specimen.objects();
  for (const auto* object : query.objects) query.boxes.push_back(boxOf(*object));
  RTCDevice device = rtcNewDevice("threads=1");
  RTCScene scene = rtcNewScene(device);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(query.boxes.size()));
  rtcSetGeometryUserData(geometry, &query.boxes);
  rtcSetGeometryBoundsFunction(
      geometry,
      [](const RTCBoundsFunctionArguments* asked) {
        const FloatBox& box =
            (*static_cast<const std::vector<FloatBox>*>(asked->geometryUserPtr))[asked->primID];
        *asked->bounds_o = {box.low[0],  box.low[1],  box.low[2],  0,
                            box.high[0], box.high[1], box.high[2], 0};
      },
      nullptr);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcCommitScene(scene);
  rtcCollide(
      scene, scene,
      [](void* data, RTCCollision* collisions, unsigned count) {
        auto& asked = *static_cast<Query*>(data);
        const std::lock_guard<std::mutex> lock(asked.mutex);
        for (unsigned i = 0; i < count; ++i) {
          // Embree visits both orders of a pair, and each box with itself.
          const unsigned a = collisions[i].primID0, b = collisions[i].primID1;
          if (a < b && benchmarks::capsulesTouch(*asked.objects[a], *asked.objects[b])) {
            asked.found.push_back({static_cast<std::int32_t>(a), static_cast<std::int32_t>(b)});
          }
        }
      },
      &query);
  rtcReleaseGeometry(geometry);
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
  return std::move(query.found);
}
#endif

#ifdef FCL_FIBERS_WITH_COAL
/// coal's broad phase, with its own test of a pair or the closed form.
template <bool kClosedForm>
std::vector<NumberPair> coalTree(const Specimen<double>& specimen, double) {
  const Objects<double> fcl_objects = specimen.objects();
  struct Callback : coal::CollisionCallBackBase {
    explicit Callback(const Objects<double>& all) : all(all) {}
    const Objects<double>& all;
    std::map<const coal::CollisionObject*, std::int32_t> numbers;
    std::vector<NumberPair> found;
    bool collide(coal::CollisionObject* a, coal::CollisionObject* b) override {
      const NumberPair pair = {numbers.at(a), numbers.at(b)};
      if (kClosedForm ? benchmarks::capsulesTouch(object(pair.a), object(pair.b)) : touch(a, b)) {
        found.push_back(pair);
      }
      return false;
    }
    const fcl::CollisionObjectd& object(std::int32_t i) const {
      return *all[static_cast<std::size_t>(i)];
    }
    static bool touch(const coal::CollisionObject* a, const coal::CollisionObject* b) {
      coal::CollisionResult result;
      return coal::collide(a, b, coal::CollisionRequest(), result) > 0;
    }
  } callback(fcl_objects);
  std::vector<std::unique_ptr<coal::CollisionObject>> objects;
  coal::DynamicAABBTreeCollisionManager manager;
  for (const auto* object : fcl_objects) {
    const auto& capsule = static_cast<const fcl::Capsuled&>(*object->collisionGeometry());
    const coal::Transform3s pose(object->getRotation(), object->getTranslation());
    objects.push_back(std::make_unique<coal::CollisionObject>(
        std::make_shared<coal::Capsule>(capsule.radius, capsule.lz), pose));
    callback.numbers.emplace(objects.back().get(), static_cast<std::int32_t>(objects.size()) - 1);
    manager.registerObject(objects.back().get());
  }
  manager.setup();
  manager.collide(&callback);
  return std::move(callback.found);
}
#endif

}  // namespace

template <typename S>
std::vector<std::pair<std::string, Ask<S>>> peers() {
  std::vector<std::pair<std::string, Ask<S>>> all;
#ifdef FCL_FIBERS_WITH_EMBREE
  all.emplace_back("Embree, closed form", embree<S>);
#endif
#ifdef FCL_FIBERS_WITH_COAL
  if constexpr (std::is_same_v<S, double>) {
    all.emplace_back("coal, closed form", coalTree<true>);
    all.emplace_back("coal, `coal::collide`", coalTree<false>);
  }
#endif
  return all;
}

template std::vector<std::pair<std::string, Ask<float>>> peers<float>();
template std::vector<std::pair<std::string, Ask<double>>> peers<double>();

std::vector<std::string> peerTexts() {
  return {
#ifdef FCL_FIBERS_WITH_EMBREE
      "**Embree** " RTC_VERSION_STRING
      ": `rtcCollide` over boxes in float, rounded outward, and the same closed form.",
#else
      "**Embree** was not found.",
#endif
#ifdef FCL_FIBERS_WITH_COAL
      "**coal** " COAL_VERSION
      ": `DynamicAABBTreeCollisionManager`, and the same closed form or `coal::collide` with its "
      "defaults, in double only.",
#else
      "**coal** was not found.",
#endif
  };
}

}  // namespace fcl_fibers::test
