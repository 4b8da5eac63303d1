// SPDX-License-Identifier: BSD-3-Clause
//
// A manager under any sequence of calls, with objects of any poses and sizes. It may refuse by
// std::invalid_argument only, and what it refuses to register or unregister is as it was; each pair
// comes once and is of two that may meet, and the same query gives the same pairs, in the same
// order on two threads. So of its clones, and of it and them or one of FCL's managers. Each object
// that a capsule touches is found, at the end of a step as well, and under Report::kCapsules none
// that is surely apart. A distance query finds all that is nearer than the callback asks.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_bruteforce.h>
#include <fcl/narrowphase/collision_object.h>
#include <fuzzer/FuzzedDataProvider.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/impact_collector.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "fuzz_input.h"
#include "fuzz_objects.h"
#include "support/scene.h"

namespace {

using fcl_fibers::FiberCollisionManager;
using fcl_fibers::FiberEnds;
using fcl_fibers::FiberGroup;
using fcl_fibers::FiberManagerOptions;
using fcl_fibers::FiberObstacles;
using fcl_fibers::MeshContact;
using fcl_fibers::ObstacleOptions;
using fcl_fibers::fuzz::gapOf;
using fcl_fibers::fuzz::isCapsule;
using fcl_fibers::fuzz::isCloud;
using fcl_fibers::fuzz::isRefused;
using fcl_fibers::fuzz::kNumbers;
using fcl_fibers::fuzz::modelOf;
using fcl_fibers::fuzz::readByte;
using fcl_fibers::fuzz::readNumber;
using fcl_fibers::fuzz::readPose;
using fcl_fibers::fuzz::readShape;
using fcl_fibers::fuzz::require;
using fcl_fibers::fuzz::sizeOf;

/// The band about contact in which either answer is right, see docs/numerics.md, is smaller than
/// this part of the scene's size.
constexpr double kBand = 1e-11;

template <typename S>
class Program {
 public:
  Program(FuzzedDataProvider& data, int threads) : data_(data) {
    FiberManagerOptions options;
    options.threads = threads;
    options.topology =
        data.ConsumeBool() ? fcl_fibers::Topology::kBundle : fcl_fibers::Topology::kSuperThread;
    options.report =
        data.ConsumeBool() ? fcl_fibers::Report::kCapsules : fcl_fibers::Report::kVolumes;
    options.ignored_neighbors = data.ConsumeIntegralInRange(0, 2);
    if (data.ConsumeBool()) options.ignored_arc_length = data.ConsumeFloatingPointInRange(0.0, 4.0);
    options.margin = data.ConsumeBool() ? 0 : data.ConsumeFloatingPointInRange(0.0, 10.0);
    // Not of bytes of its own, so that the kept inputs mean what they did.
    options.bounds = static_cast<fcl_fibers::Bounds>(options.ignored_neighbors);
    options.motion = (readByte(data) & 1) != 0;
    if (data.ConsumeBool()) {
      if (options.report == fcl_fibers::Report::kVolumes) {
        options.motion = false;
      } else if (!options.motion) {
        options.skin = static_cast<double>(
            std::array{0, -1, 1}.at(static_cast<std::size_t>(options.ignored_neighbors)));
      }
      boxes_ = std::make_unique<Boxes>(options);
    } else {
      options.motion = false;
      spheres_ = std::make_unique<Spheres>(options);
    }
    manager_ = boxes_ ? static_cast<Manager*>(boxes_.get()) : spheres_.get();
    const std::size_t count = data.ConsumeIntegralInRange<std::size_t>(1, 40);
    std::shared_ptr<fcl::CollisionGeometry<S>> shape;
    for (std::size_t i = 0; i < count; ++i) {
      // Some meshes share a model.
      const bool is_mesh = shape != nullptr && shape->getObjectType() == fcl::OT_BVH;
      if (!is_mesh || data.ConsumeBool()) shape = readShape<S>(data);
      owned_.push_back(std::make_unique<Object>(shape, readPose<S>(data)));
    }
  }

  /// Returns what it has been told, in order.
  std::vector<std::size_t> run() {
    if (!data_.ConsumeBool()) {  // all that can be, so that there is something to find
      for (const auto& object : owned_) {
        if (isRefused([&] { manager_->registerObject(object.get()); })) continue;
        managed_.push_back(object.get());
      }
    }
    for (bool goes_on = true; goes_on;) {
      goes_on = data_.remaining_bytes() > 0;
      goes_on ? step() : collide(nullptr);
      Objects objects;
      manager_->getObjects(objects);
      require(objects == managed_ && manager_->size() == managed_.size());
    }
    return std::move(told_);
  }

 private:
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;
  using Manager = FiberCollisionManager<S>;
  using Boxes = fcl_fibers::LayeredAABBTreeCollisionManager<S>;
  using Spheres = fcl_fibers::WrappedSphereTreeCollisionManager<S>;

  Object* any() {
    return owned_[data_.ConsumeIntegralInRange<std::size_t>(0, owned_.size() - 1)].get();
  }
  Objects several() {
    Objects objects(data_.ConsumeIntegralInRange<std::size_t>(0, 12));
    for (Object*& object : objects) object = any();
    return objects;
  }

  void step() {
    switch (data_.ConsumeIntegralInRange(0, 17)) {
      case 0: {
        Object* object = any();
        if (!isRefused([&] { manager_->registerObject(object); })) managed_.push_back(object);
        return;
      }
      case 14: {
        Object* object = any();
        const ObstacleOptions obstacle{data_.ConsumeBool(),
                                       data_.ConsumeIntegralInRange<std::uint32_t>(0, 3)};
        if (isRefused([&] { manager_->registerObstacle(object, obstacle); })) return;
        managed_.push_back(object);
        rules_.categories[object] = obstacle.categories;
        if (obstacle.solid) rules_.solids.insert(object);
        return;
      }
      case 15: {
        Object* object = any();
        if (auto* model = modelOf(*object)) fcl_fibers::fuzz::movePoints(data_, *model);
        if (data_.ConsumeBool()) object->computeAABB();
        isRefused([&] { manager_->update(object); });
        return;
      }
      case 17:
        if (data_.ConsumeBool()) {
          isRefused([&] { manager_->beginStep(); });
        } else {
          isRefused([&] { manager_->endStep(); });
        }
        return;
      case 16: {
        std::vector<MeshContact> contacts;
        const Object *capsule = any(), *mesh = any();
        isRefused([&] { manager_->findMeshContacts(capsule, mesh, 0.5, contacts); });
        const auto* model = modelOf(*mesh);
        for (const MeshContact& contact : contacts) {
          require(contact.triangle >= 0 && contact.triangle < model->num_tris);
        }
        return;
      }
      case 1:
      case 2: {
        const Objects added = several();
        if (!data_.ConsumeBool()) {
          if (isRefused([&] { manager_->registerObjects(added); })) return;
        } else {
          const FiberEnds ends = data_.ConsumeBool() ? FiberEnds::kClosed : FiberEnds::kOpen;
          const FiberGroup group{data_.ConsumeIntegralInRange(0, 2)};
          FiberObstacles obstacles;
          obstacles.meets = data_.ConsumeIntegralInRange<std::uint32_t>(0, 3);
          obstacles.root_segments = data_.ConsumeIntegralInRange(0, 1);
          if (isRefused([&] { manager_->registerFiber(added, ends, group, obstacles); })) return;
          const int fiber = rules_.fibers++, size = static_cast<int>(added.size());
          for (Object* const& object : added) {
            const auto segment = static_cast<int>(&object - &added[0]);
            rules_.place[object] = {fiber, segment, size, ends == FiberEnds::kClosed};
            rules_.group[object] = group.number;
            rules_.meets[object] = obstacles.meets;
          }
          if (obstacles.root_segments > 0 && !added.empty()) rules_.meets[added[0]] = 0;
        }
        managed_.insert(managed_.end(), added.begin(), added.end());
        return;
      }
      case 3: {
        Object* object = any();
        const auto place = std::find(managed_.begin(), managed_.end(), object);
        require(isRefused([&] { manager_->unregisterObject(object); }) ==
                (place == managed_.end()));
        if (place != managed_.end()) managed_.erase(place);
        rules_.forget(object);
        return;
      }
      case 4:
      case 5: {
        const Objects moved = several();
        for (Object* object : moved) {
          object->setTransform(readPose<S>(data_));
          if (moved.size() % 4 != 3) object->computeAABB();
          if (moved.size() > 8) {
            fcl_fibers::test::grow(fcl_fibers::test::aabbOf(*object),
                                   readNumber<S>(data_, kNumbers));
          }
        }
        manager_->movedSinceUpdate();
        if (data_.ConsumeBool()) {
          isRefused([&] { manager_->update(moved); });
        } else {
          isRefused([&] { manager_->update(); });
        }
        return;
      }
      case 6:
        isRefused([&] { manager_->setup(); });
        return;
      case 7:
        if (data_.ConsumeIntegralInRange(0, 7) == 0) {
          manager_->clear();
          managed_.clear();
          rules_ = {};
        }
        return;
      case 8:
        return collide(nullptr);
      case 9:
        return collide(any());
      case 10:
        return distance(nullptr);
      case 11:
        return distance(any());
      case 12:
        return withClone([&](Manager& clone) { clone.collide(&query_, record); });
      default:
        return withClone([&](Manager& clone) { manager_->collide(&clone, &query_, record); });
    }
  }

  struct Seen {
    std::vector<std::pair<Object*, Object*>> calls;
    std::size_t stop_at;
    double factor;
    double limit = std::numeric_limits<double>::max();
    double least = limit;  ///< as told to a distance query last
  };

  void tell(Object* object) {
    const auto is = [&](const auto& owned) { return owned.get() == object; };
    const auto place = std::find_if(owned_.begin(), owned_.end(), is);
    told_.push_back(static_cast<std::size_t>(place - owned_.begin()));
  }

  void checkCalls(const Seen& seen, const Object* partner) {
    require(seen.calls.size() <= seen.stop_at);
    std::set<std::pair<Object*, Object*>> pairs;
    for (const auto& [a, b] : seen.calls) {
      tell(a);
      tell(b);
      require(!rules_.shareGroup(a, b) && rules_.mayMeet(a, b));
      require(rules_.areNeighbors(a, b, manager_->options()) != true);
      require(a != b && pairs.insert(std::minmax(a, b)).second);
      require(std::find(managed_.begin(), managed_.end(), a) != managed_.end());
      if (partner != nullptr) {
        require(b == partner);
      } else {
        require(std::find(managed_.begin(), managed_.end(), b) != managed_.end());
      }
    }
  }

  /// Calls judge(other, gap, rounding, is_found) for all pairs of a capsule and another object that
  /// brute force can measure. All objects are where they were read.
  template <class Judge>
  void judgePairs(const Seen& seen, const Object* partner, Judge&& judge) const {
    const FiberManagerOptions& options = manager_->options();
    if (options.bounds == fcl_fibers::Bounds::kObjects) return;
    std::set<std::pair<const Object*, const Object*>> found(seen.calls.begin(), seen.calls.end());
    for (const auto& [a, b] : seen.calls) found.emplace(b, a);
    std::vector<const Object*> all(managed_.begin(), managed_.end());
    if (partner != nullptr) all.push_back(partner);
    // The frame's origin is at the median of the objects.
    std::vector<double> sizes;
    for (const Object* object : all) sizes.push_back(sizeOf(*object));
    std::sort(sizes.begin(), sizes.end());
    const std::size_t above_median = std::min(sizes.size() / 2 + 2, sizes.size()) - 1;
    const double usual = sizes.empty() ? 0 : sizes[above_median] + options.margin;
    for (const Object* capsule : all) {
      if (!isCapsule(*capsule)) continue;
      for (const Object* other : all) {
        if (other == capsule || isCloud(*other)) continue;
        if (partner != nullptr && capsule != partner && other != partner) continue;
        const double size = usual + sizeOf(*capsule) + sizeOf(*other);
        if (!(size < 1e100)) continue;
        if (!rules_.mayMeet(capsule, other) || rules_.shareGroup(capsule, other)) continue;
        if (rules_.areNeighbors(capsule, other, options) != false) continue;
        judge(*other, gapOf(*capsule, *other), kBand * size, found.count({capsule, other}) > 0);
      }
    }
  }

  void checkGaps(const Seen& seen, const Object* partner) const {
    const FiberManagerOptions& options = manager_->options();
    // A box that the program has widened counts, too, and so does the way of what moves.
    const bool counts_by_shape = options.report == fcl_fibers::Report::kCapsules &&
                                 options.bounds == fcl_fibers::Bounds::kShapes && !options.motion;
    judgePairs(seen, partner, [&](const Object& other, auto gap, double rounding, bool is_found) {
      require(is_found || gap > options.margin - rounding);
      if (!counts_by_shape || rules_.solids.count(&other) > 0) return;
      // Shapes are turned by the matrix as it is.
      const bool is_turned = !isCapsule(other) && modelOf(other) == nullptr;
      const double turning = is_turned ? 64 * double(std::numeric_limits<S>::epsilon()) : 0;
      require(!is_found || gap <= options.margin + rounding + turning / kBand * rounding);
    });
  }

  /// Of a query that is complete.
  void checkImpacts(const Seen& seen) const {
    if (!manager_->options().motion) return;
    fcl_fibers::ImpactCollector<S> impacts(*manager_);
    for (const auto& [a, b] : seen.calls) impacts.callback(a, b, &impacts);
    for (const auto& impact : impacts.impacts()) {
      require(!impact.has_time || (impact.time >= 0 && impact.time <= 1));
    }
  }

  static bool record(Object* a, Object* b, void* data) {
    auto& self = *static_cast<Seen*>(data);
    self.calls.emplace_back(a, b);
    return self.calls.size() == self.stop_at;
  }

  void collide(Object* partner) {
    // Once no byte is left, the whole answer is checked.
    const bool is_cut = data_.ConsumeBool();
    Seen seen{{}, is_cut ? data_.ConsumeIntegralInRange<std::size_t>(1, 9) : 1000000, 1};
    const auto query = [&] {
      seen.calls.clear();
      if (partner != nullptr) {
        manager_->collide(partner, &seen, record);
      } else {
        manager_->collide(&seen, record);
      }
    };
    const bool is_current = !is_cut && !data_.ConsumeBool();
    if (is_current && isRefused([&] { manager_->update(); })) return;
    if (isRefused(query)) return;
    checkCalls(seen, partner);
    if (is_current) checkGaps(seen, partner);
    checkImpacts(seen);
    const auto before = seen.calls;
    query();
    require(seen.calls == before);
  }

  /// A clone over copies of the objects, which a query is made of. What it reports is judged as
  /// pairs of the originals.
  template <typename Query>
  void withClone(Query&& query) {
    std::vector<std::unique_ptr<Object>> copies;
    Objects objects;
    std::map<const Object*, Object*> original;
    for (Object* object : managed_) {
      copies.push_back(std::make_unique<Object>(*object));
      objects.push_back(copies.back().get());
      original[objects.back()] = object;
    }
    std::unique_ptr<Manager> clone;
    if (isRefused([&] {
          if (boxes_) {
            clone = boxes_->clone(objects);
          } else {
            clone = spheres_->clone(objects);
          }
        })) {
      return;
    }
    Objects cloned;
    clone->getObjects(cloned);
    require(cloned == objects);
    query_ = {{}, 1000000, 1};
    if (isRefused([&] { query(*clone); })) return;
    std::set<std::pair<Object*, Object*>> pairs;
    for (const auto& [a, b] : query_.calls) {
      require(a != b && pairs.insert(std::minmax(a, b)).second);
      const bool both_are_copies = original.count(a) + original.count(b) == 2;
      const auto of = [&](Object* object) {
        return original.count(object) > 0 ? original[object] : object;
      };
      // Groups are a manager's own.
      require(!both_are_copies || !rules_.shareGroup(of(a), of(b)));
      tell(of(a));
      tell(of(b));
    }
    fcl::NaiveCollisionManager<S> stranger;
    stranger.registerObjects(objects);
    query_ = {{}, 1000000, 1};
    if (isRefused([&] { manager_->collide(&stranger, &query_, record); })) return;
    pairs.clear();
    for (const auto& [a, b] : query_.calls) {
      require(original.count(b) > 0 && pairs.emplace(a, b).second);
      tell(a);
      tell(original[b]);
    }
    // The same as one by one.
    std::size_t calls = 0;
    for (Object* object : objects) {
      Seen one{{}, 1000000, 1};
      manager_->collide(object, &one, record);
      for (const auto& pair : one.calls) require(pairs.count(pair) > 0);
      calls += one.calls.size();
    }
    require(calls == pairs.size());
  }

  void distance(Object* partner) {
    const bool is_whole = data_.ConsumeBool();
    Seen seen{{},
              is_whole ? 1000000 : data_.ConsumeIntegralInRange<std::size_t>(1, 9),
              data_.ConsumeFloatingPointInRange(0.0, 1.0)};
    const std::uint8_t limit = readByte(data_);
    const bool is_current = is_whole && limit > 0;
    if (is_current && isRefused([&] { manager_->update(); })) return;
    if (is_current) seen.limit = limit / 16.0;
    const fcl::DistanceCallBack<S> callback = [](Object* a, Object* b, void* data, S& least) {
      auto& self = *static_cast<Seen*>(data);
      self.calls.emplace_back(a, b);
      self.least = std::min(self.limit, self.factor * static_cast<double>(least));
      least = static_cast<S>(self.least);
      return self.calls.size() == self.stop_at;
    };
    if (isRefused([&] {
          if (partner != nullptr) {
            manager_->distance(partner, &seen, callback);
          } else {
            manager_->distance(&seen, callback);
          }
        })) {
      return;
    }
    checkCalls(seen, partner);
    if (!is_current) return;
    judgePairs(seen, partner, [&](const Object&, auto gap, double rounding, bool is_found) {
      // In float the limit is rounded.
      require(is_found || std::max<decltype(gap)>(gap, 0) > seen.least * (1 - 1e-6) - rounding);
    });
  }

  FuzzedDataProvider& data_;
  std::unique_ptr<Boxes> boxes_;  ///< the one, or
  std::unique_ptr<Spheres> spheres_;
  Manager* manager_ = nullptr;
  std::vector<std::unique_ptr<Object>> owned_;
  Objects managed_;
  fcl_fibers::fuzz::MeetingRules rules_;
  Seen query_{};
  std::vector<std::size_t> told_;
};

template <typename S>
void runTwice(const std::uint8_t* bytes, std::size_t size) {
  const auto run = [&](int threads) {
    FuzzedDataProvider data(bytes, size);
    (void)data.ConsumeBool();
    return Program<S>(data, threads).run();
  };
  require(run(1) == run(2));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (FuzzedDataProvider(bytes, size).ConsumeBool()) {
    runTwice<float>(bytes, size);
  } else {
    runTwice<double>(bytes, size);
  }
  return 0;
}
