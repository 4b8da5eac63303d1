// SPDX-License-Identifier: BSD-3-Clause
//
// Embree has three ways to follow a motion. A rebuild by surface area is its default. With the
// scene's quality low, it keeps a tree for each geometry, which it rebuilds by Morton codes, at a
// quarter of the time, or refits. A refit without the low quality is none: it costs a rebuild.
//
// rtcCollide calls back for pairs of leaves, in both orders and for an object with itself. Its
// rebuilt trees have one box to a leaf, so that these are the pairs that overlap. A tree to be
// refitted has several and no test of their boxes, so that we test them.
#include <embree3/rtcore.h>

#include <atomic>
#include <mutex>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "contenders/foreign_tree.h"

namespace fcl_fibers::benchmarks {
namespace {

using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, void (*)(RTCDevice)>;
using Scene = std::unique_ptr<std::remove_pointer_t<RTCScene>, void (*)(RTCScene)>;
using Geometry = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, void (*)(RTCGeometry)>;

Device newDevice(int threads) {
  const std::string options = "threads=" + std::to_string(threads) + ",set_affinity=0";
  Device device(rtcNewDevice(options.c_str()), rtcReleaseDevice);
  if (!device) throw std::runtime_error("Embree: no device with " + options);
  return device;
}

void requireNoError(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  if (error != RTC_ERROR_NONE) {
    throw std::runtime_error("Embree: error " + std::to_string(static_cast<int>(error)));
  }
}

/// @param boxes  borrowed, and read again at each commit
void setBoxes(RTCGeometry geometry, const std::vector<FloatBox>& boxes) {
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned int>(boxes.size()));
  rtcSetGeometryUserData(geometry, const_cast<std::vector<FloatBox>*>(&boxes));
  const auto bounds = [](const RTCBoundsFunctionArguments* arguments) {
    const auto& all = *static_cast<const std::vector<FloatBox>*>(arguments->geometryUserPtr);
    const FloatBox& box = all[arguments->primID];
    *arguments->bounds_o = {box.least[0],    box.least[1],    box.least[2],    0,
                            box.greatest[0], box.greatest[1], box.greatest[2], 0};
  };
  rtcSetGeometryBoundsFunction(geometry, bounds, nullptr);
}

class EmbreeTree : public ForeignTree {
 public:
  EmbreeTree(EmbreeUpdate update, int threads)
      : ForeignTree(threads),
        threads_(threads),
        leaves_are_boxes_(update != EmbreeUpdate::kRefit),
        device_(newDevice(threads)),
        scene_(rtcNewScene(device_.get()), rtcReleaseScene),
        geometry_(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_USER), rtcReleaseGeometry) {
    // Malloc gives only a part of it.
    rtcSetDeviceMemoryMonitorFunction(
        device_.get(),
        [](void* bytes, ssize_t more, bool) {
          *static_cast<std::atomic<ssize_t>*>(bytes) += more;
          return true;
        },
        bytes_.get());
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_DYNAMIC);
    if (update == EmbreeUpdate::kRebuild) return;
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_LOW);
    rtcSetGeometryBuildQuality(geometry_.get(), update == EmbreeUpdate::kRefit
                                                    ? RTC_BUILD_QUALITY_REFIT
                                                    : RTC_BUILD_QUALITY_LOW);
  }

  void setup() override {
    readBoxes();
    setBoxes(geometry_.get(), boxes());
    rtcCommitGeometry(geometry_.get());
    rtcAttachGeometry(scene_.get(), geometry_.get());
    commitScene();
  }

  void update() override {
    readBoxes();
    rtcCommitGeometry(geometry_.get());
    commitScene();
  }

  using ForeignTree::collide;
  void collide(void* cdata, fcl::CollisionCallBack<double> callback) const override {
    // Embree calls back from all of its threads.
    std::mutex mutex;
    forEachBlock([&](const RTCCollision* collisions, unsigned int count) {
      const std::lock_guard<std::mutex> lock(mutex);
      for (unsigned int i = 0; i < count; ++i) {
        const RTCCollision& found = collisions[i];
        if (isPair(found)) callback(object(found.primID0), object(found.primID1), cdata);
      }
    });
  }

  PairCount countPairs() const override {
    if (threads_ == 1) {
      PairCount count;
      forEachBlock([&](const RTCCollision* collisions, unsigned int size) {
        count.pairs += pairsIn(collisions, size);
        count.visited += size;
      });
      return count;
    }
    std::atomic<std::size_t> pairs{0}, visited{0};
    forEachBlock([&](const RTCCollision* collisions, unsigned int size) {
      const std::size_t found = pairsIn(collisions, size);
      if (found > 0) pairs.fetch_add(found, std::memory_order_relaxed);
      visited.fetch_add(size, std::memory_order_relaxed);
    });
    return {pairs, visited};
  }

  std::size_t libraryBytes(std::size_t) const override {
    return static_cast<std::size_t>(bytes_->load());
  }

 private:
  bool isPair(const RTCCollision& found) const {
    return found.primID0 < found.primID1 &&
           (leaves_are_boxes_ || overlap(boxes()[found.primID0], boxes()[found.primID1]));
  }

  std::size_t pairsIn(const RTCCollision* collisions, unsigned int count) const {
    std::size_t pairs = 0;
    for (unsigned int i = 0; i < count; ++i) pairs += isPair(collisions[i]) ? 1 : 0;
    return pairs;
  }

  template <typename Block>
  void forEachBlock(Block&& block) const {
    rtcCollide(
        scene_.get(), scene_.get(),
        [](void* data, RTCCollision* collisions, unsigned int count) {
          (*static_cast<std::remove_reference_t<Block>*>(data))(collisions, count);
        },
        &block);
  }

  void commitScene() {
    rtcCommitScene(scene_.get());
    requireNoError(device_.get());
  }

  int threads_;
  bool leaves_are_boxes_;
  // Outlives the device, which still frees memory when it is released.
  std::unique_ptr<std::atomic<ssize_t>> bytes_ = std::make_unique<std::atomic<ssize_t>>(0);
  Device device_;
  Scene scene_;
  Geometry geometry_;
};

/// A tree with one box to a leaf.
struct StandingTree {
  StandingTree(RTCDevice device, bool morton)
      : device(device),
        scene(rtcNewScene(device), rtcReleaseScene),
        geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER), rtcReleaseGeometry) {
    const RTCBuildQuality quality = morton ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_MEDIUM;
    if (morton) rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_DYNAMIC);
    rtcSetSceneBuildQuality(scene.get(), quality);
    rtcSetGeometryBuildQuality(geometry.get(), quality);
    rtcAttachGeometry(scene.get(), geometry.get());
  }

  void build(std::vector<FloatBox> all) {
    boxes = std::move(all);
    setBoxes(geometry.get(), boxes);
    rtcCommitGeometry(geometry.get());
    rtcCommitScene(scene.get());
    requireNoError(device);
  }

  RTCDevice device;
  std::vector<FloatBox> boxes;
  Scene scene;
  Geometry geometry;
};

struct StandingTrees {
  StandingTrees(std::vector<FloatBox> boxes_a, std::vector<FloatBox> boxes_b, bool morton)
      : device(newDevice(1)), a(device.get(), morton), b(device.get(), morton) {
    a.build(std::move(boxes_a));
    b.build(std::move(boxes_b));
  }

  std::size_t countOverlaps() const {
    std::size_t count = 0;
    rtcCollide(
        a.scene.get(), b.scene.get(),
        [](void* sum, RTCCollision*, unsigned int more) {
          *static_cast<std::size_t*>(sum) += more;
        },
        &count);
    return count;
  }

  Device device;
  StandingTree a, b;
};

class EmbreeBoxes : public BoxTree {
 public:
  explicit EmbreeBoxes(bool morton) : device_(newDevice(1)), tree_(device_.get(), morton) {}

  void update(std::vector<FloatBox> boxes) override { tree_.build(std::move(boxes)); }

  void visitPairs(const Visitor& visit) const override {
    rtcCollide(
        tree_.scene.get(), tree_.scene.get(),
        [](void* data, RTCCollision* collisions, unsigned int count) {
          for (unsigned int i = 0; i < count; ++i) {
            const RTCCollision& found = collisions[i];
            if (found.primID0 < found.primID1) {
              (*static_cast<const Visitor*>(data))(found.primID0, found.primID1);
            }
          }
        },
        const_cast<Visitor*>(&visit));
  }

 private:
  Device device_;
  StandingTree tree_;
};

}  // namespace

std::unique_ptr<BoxTree> makeEmbreeBoxes(bool morton) {
  return std::make_unique<EmbreeBoxes>(morton);
}

std::function<std::size_t()> embreeOverlaps(std::vector<FloatBox> a, std::vector<FloatBox> b,
                                            bool morton) {
  const auto trees = std::make_shared<StandingTrees>(std::move(a), std::move(b), morton);
  return [trees] { return trees->countOverlaps(); };
}

std::unique_ptr<ForeignTree> makeEmbreeTree(EmbreeUpdate update, int threads) {
  return std::make_unique<EmbreeTree>(update, threads);
}

}  // namespace fcl_fibers::benchmarks
