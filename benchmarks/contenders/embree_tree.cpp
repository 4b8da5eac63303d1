// SPDX-License-Identifier: BSD-3-Clause
//
// Embree has three ways to follow a motion. A rebuild by surface area is its default, for which the
// higher qualities are one. With the scene's quality low, it keeps a tree for each geometry, which
// it rebuilds by Morton codes, at a quarter of the time, or refits. A refit without the low quality
// or without the flag "dynamic" is none: it costs a rebuild, which that flag makes slower.
//
// rtcCollide of a scene with itself calls back for pairs of leaves, in both orders. Its rebuilt
// trees have one box to a leaf, so that these are the pairs that overlap. A tree to be refitted has
// several and no test of their boxes, so that we test them.
#if FCL_FIBERS_WITH_EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "contenders/foreign_tree.h"

namespace fcl_fibers::benchmarks {
namespace {

using Device = std::shared_ptr<std::remove_pointer_t<RTCDevice>>;
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

void commit(RTCDevice device, RTCScene scene) {
  rtcCommitScene(scene);
  requireNoError(device);
}

/// Calls block(collisions, count) for blocks of the pairs of leaves of two scenes of one device.
template <typename Block>
void forEachBlock(const Scene& a, const Scene& b, Block&& block) {
  rtcCollide(
      a.get(), b.get(),
      [](void* data, RTCCollision* collisions, unsigned int count) {
        (*static_cast<std::remove_reference_t<Block>*>(data))(collisions, count);
      },
      &block);
}

/// Counts of the threads on which Embree calls back, each in cache lines of its own.
class CountsOfThreads {
 public:
  PairCount& own() {
    thread_local std::uint64_t known_number = 0;
    thread_local PairCount* known = nullptr;
    if (known_number != number_) {
      const std::lock_guard<std::mutex> lock(mutex_);
      known = &counts_.emplace_back().count;
      known_number = number_;
    }
    return *known;
  }

  PairCount sum() const {
    PairCount sum;
    for (const Padded& one : counts_) {
      sum.pairs += one.count.pairs;
      sum.visited += one.count.visited;
    }
    return sum;
  }

 private:
  struct alignas(128) Padded {
    PairCount count;
  };
  static std::uint64_t nextNumber() {
    static std::atomic<std::uint64_t> last{0};
    return ++last;
  }

  std::uint64_t number_ = nextNumber();
  std::mutex mutex_;
  std::deque<Padded> counts_;
};

FloatBox boxOf(const FloatBox& box) { return box; }
FloatBox boxOf(Object* object) {
  return floatBox(static_cast<const CapsuleObject*>(object)->tightBox());
}

/// @param items  boxes, or objects that have them; borrowed, and read again at each commit
template <typename Item>
void setBoxes(RTCGeometry geometry, const std::vector<Item>& items) {
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned int>(items.size()));
  rtcSetGeometryUserData(geometry, const_cast<std::vector<Item>*>(&items));
  const auto bounds = [](const RTCBoundsFunctionArguments* arguments) {
    const auto& all = *static_cast<const std::vector<Item>*>(arguments->geometryUserPtr);
    const FloatBox box = boxOf(all[arguments->primID]);
    *arguments->bounds_o = {box.least[0],    box.least[1],    box.least[2],    0,
                            box.greatest[0], box.greatest[1], box.greatest[2], 0};
  };
  rtcSetGeometryBoundsFunction(geometry, bounds, nullptr);
}

/// A way to follow a motion, at its best on the scenes of the headline.
struct EmbreeWay {
  const char* name;
  RTCBuildQuality scene, geometry;
  bool is_dynamic;
  /// Whether Embree's builder asks for boxes that are read from the poses right then. By Morton
  /// codes and in a refit it asks for each several times.
  bool reads_poses;
};

constexpr EmbreeWay kWays[] = {
    {"rebuild", RTC_BUILD_QUALITY_MEDIUM, RTC_BUILD_QUALITY_MEDIUM, false, true},
    {"morton", RTC_BUILD_QUALITY_LOW, RTC_BUILD_QUALITY_LOW, true, false},
    {"refit", RTC_BUILD_QUALITY_LOW, RTC_BUILD_QUALITY_REFIT, true, false}};

class EmbreeTree : public ForeignTree {
 public:
  EmbreeTree(const EmbreeWay& way, int threads)
      : ForeignTree(threads),
        way_(way),
        threads_(threads),
        leaves_are_boxes_(way.geometry != RTC_BUILD_QUALITY_REFIT),
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
    if (way.is_dynamic) rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_DYNAMIC);
    rtcSetSceneBuildQuality(scene_.get(), way.scene);
    rtcSetGeometryBuildQuality(geometry_.get(), way.geometry);
  }

  void setup() override {
    if (way_.reads_poses) {
      setBoxes(geometry_.get(), objects());
    } else {
      readBoxes();
      setBoxes(geometry_.get(), boxes());
    }
    rtcCommitGeometry(geometry_.get());
    rtcAttachGeometry(scene_.get(), geometry_.get());
    commit(device_.get(), scene_.get());
  }

  void update() override {
    if (!way_.reads_poses) readBoxes();
    rtcCommitGeometry(geometry_.get());
    commit(device_.get(), scene_.get());
  }

  using ForeignTree::collide;
  void collide(void* cdata, fcl::CollisionCallBack<double> callback) const override {
    // Embree calls back from all of its threads.
    std::mutex mutex;
    forEachBlock(scene_, scene_, [&](const RTCCollision* collisions, unsigned int count) {
      const std::lock_guard<std::mutex> lock(mutex);
      for (unsigned int i = 0; i < count; ++i) {
        const RTCCollision& found = collisions[i];
        if (isPair(found)) callback(object(found.primID0), object(found.primID1), cdata);
      }
    });
  }

  PairCount countPairs() const override {
    return sumOfBlocks([this](const RTCCollision* collisions, unsigned int size, PairCount& count) {
      count.pairs += pairsIn(collisions, size);
      count.visited += size;
    });
  }

  std::size_t countTouching() const override {
    const auto& capsules = axesOfObjects();
    return sumOfBlocks([&](const RTCCollision* collisions, unsigned int size, PairCount& count) {
             for (unsigned int i = 0; i < size; ++i) {
               const RTCCollision& pair = collisions[i];
               if (!isPair(pair)) continue;
               count.pairs += capsulesTouch(capsules[pair.primID0], capsules[pair.primID1]);
             }
           })
        .pairs;
  }

  std::size_t libraryBytes(std::size_t) const override {
    return static_cast<std::size_t>(bytes_->load());
  }

 private:
  /// Calls add(collisions, size, count) for each block, with a count of the thread.
  template <typename Add>
  PairCount sumOfBlocks(Add&& add) const {
    if (threads_ == 1) {
      PairCount count;
      forEachBlock(scene_, scene_, [&](const RTCCollision* collisions, unsigned int size) {
        add(collisions, size, count);
      });
      return count;
    }
    CountsOfThreads counts;
    forEachBlock(scene_, scene_, [&](const RTCCollision* collisions, unsigned int size) {
      add(collisions, size, counts.own());
    });
    return counts.sum();
  }

  bool isPair(const RTCCollision& found) const {
    return found.primID0 < found.primID1 &&
           (leaves_are_boxes_ || overlap(boxes()[found.primID0], boxes()[found.primID1]));
  }

  std::size_t pairsIn(const RTCCollision* collisions, unsigned int count) const {
    std::size_t pairs = 0;
    for (unsigned int i = 0; i < count; ++i) pairs += isPair(collisions[i]) ? 1 : 0;
    return pairs;
  }

  EmbreeWay way_;
  int threads_;
  bool leaves_are_boxes_;
  // Outlives the device, which still frees memory when it is released.
  std::unique_ptr<std::atomic<ssize_t>> bytes_ = std::make_unique<std::atomic<ssize_t>>(0);
  Device device_;
  Scene scene_;
  Geometry geometry_;
};

/// A tree with one box to a leaf.
class EmbreeBoxes : public BoxTree {
 public:
  EmbreeBoxes(Device device, bool morton)
      : device_(std::move(device)),
        scene_(rtcNewScene(device_.get()), rtcReleaseScene),
        geometry_(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_USER), rtcReleaseGeometry) {
    const RTCBuildQuality quality = morton ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_MEDIUM;
    if (morton) rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_DYNAMIC);
    rtcSetSceneBuildQuality(scene_.get(), quality);
    rtcSetGeometryBuildQuality(geometry_.get(), quality);
    rtcAttachGeometry(scene_.get(), geometry_.get());
  }

  void update(const std::vector<FloatBox>& boxes) override {
    setBoxes(geometry_.get(), boxes);
    rtcCommitGeometry(geometry_.get());
    commit(device_.get(), scene_.get());
  }

  void visitPairs(const Visitor& visit) const override {
    constexpr std::size_t kMost = 1024;
    Pairs pairs;
    const auto hand = [&] {
      visit(pairs);
      pairs.clear();
    };
    forEachBlock(scene_, scene_, [&](const RTCCollision* collisions, unsigned int count) {
      for (unsigned int i = 0; i < count; ++i) {
        const RTCCollision& found = collisions[i];
        if (found.primID0 < found.primID1) pairs.emplace_back(found.primID0, found.primID1);
      }
      if (pairs.size() >= kMost) hand();
    });
    hand();
  }

  std::size_t countOverlaps(const EmbreeBoxes& other) const {
    std::size_t count = 0;
    forEachBlock(scene_, other.scene_,
                 [&](const RTCCollision*, unsigned int more) { count += more; });
    return count;
  }

 private:
  Device device_;
  Scene scene_;
  Geometry geometry_;
};

std::vector<Contender> embreeTrees() {
  std::vector<Contender> trees;
  for (const int threads : {1, 2}) {
    for (const EmbreeWay& way : kWays) {
      const std::string variant = std::string(way.name) + (threads == 1 ? "" : "_2_threads");
      trees.push_back(foreignContender("Embree", variant, [&way, threads] {
        return std::make_unique<EmbreeTree>(way, threads);
      }));
    }
  }
  return trees;
}

/// Of the library that is loaded, which may be newer than the headers.
std::string loadedVersion() {
  const Device device = newDevice(1);
  std::string text;
  for (const RTCDeviceProperty part :
       {RTC_DEVICE_PROPERTY_VERSION_MAJOR, RTC_DEVICE_PROPERTY_VERSION_MINOR,
        RTC_DEVICE_PROPERTY_VERSION_PATCH}) {
    text += (text.empty() ? "" : ".") + std::to_string(rtcGetDeviceProperty(device.get(), part));
  }
  return text;
}

const AddLibrary kEmbree("Embree", loadedVersion(), embreeTrees());

}  // namespace

std::unique_ptr<BoxTree> makeEmbreeBoxes(bool morton) {
  return std::make_unique<EmbreeBoxes>(newDevice(1), morton);
}

std::function<std::size_t()> embreeOverlaps(const std::vector<FloatBox>& a,
                                            const std::vector<FloatBox>& b, bool morton) {
  const Device device = newDevice(1);
  const auto tree = std::make_shared<EmbreeBoxes>(device, morton);
  const auto other = std::make_shared<EmbreeBoxes>(device, morton);
  tree->update(a);
  other->update(b);
  return [=] { return tree->countOverlaps(*other); };
}

}  // namespace fcl_fibers::benchmarks
