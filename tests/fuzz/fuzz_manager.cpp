// SPDX-License-Identifier: BSD-3-Clause
//
// A manager under any sequence of calls, with objects of any poses and sizes. It may refuse by
// std::invalid_argument only, and what it refuses to register or unregister is as it was; each pair
// comes once, and the same query gives the same pairs.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision_object.h>
#include <fuzzer/FuzzedDataProvider.h>

#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "fuzz_input.h"

namespace {

using fcl_fibers::FiberCollisionManager;
using fcl_fibers::FiberManagerOptions;
using fcl_fibers::fuzz::readNumber;
using fcl_fibers::fuzz::require;

constexpr int kNumbers = 10;  // see readNumber()

template <typename Call>
bool isRefused(Call&& call) {
  try {
    call();
  } catch (const std::invalid_argument&) {
    return true;
  }
  return false;
}

template <typename S>
fcl::Transform3<S> readPose(FuzzedDataProvider& data) {
  fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
  if (data.ConsumeBool()) {
    const double w = data.ConsumeIntegral<std::int8_t>(), x = data.ConsumeIntegral<std::int8_t>();
    const double y = data.ConsumeIntegral<std::int8_t>(), z = data.ConsumeIntegral<std::int8_t>();
    const Eigen::Quaterniond turn(w + 0.5, x, y, z);
    pose.linear() = turn.normalized().toRotationMatrix().template cast<S>();
  }
  if (data.ConsumeIntegralInRange(0, 31) == 0) {
    pose.linear()(data.ConsumeIntegralInRange(0, 2), data.ConsumeIntegralInRange(0, 2)) =
        readNumber<S>(data, kNumbers);
  }
  for (int axis = 0; axis < 3; ++axis) pose.translation()[axis] = readNumber<S>(data, kNumbers);
  return pose;
}

template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> readShape(FuzzedDataProvider& data) {
  const S radius = std::fabs(readNumber<S>(data, kNumbers)) / 4,
          length = std::fabs(readNumber<S>(data, kNumbers));
  switch (data.ConsumeIntegralInRange(0, 7)) {
    case 0:
      return std::make_shared<fcl::Sphere<S>>(radius);
    case 1:
      return std::make_shared<fcl::Box<S>>(radius, length, radius);
    case 2:
      return std::make_shared<fcl::Halfspace<S>>(fcl::Vector3<S>::UnitZ(), radius);
    default:
      return std::make_shared<fcl::Capsule<S>>(radius, length);
  }
}

template <typename S>
class Program {
 public:
  explicit Program(FuzzedDataProvider& data) : data_(data) {
    FiberManagerOptions options;
    options.topology =
        data.ConsumeBool() ? fcl_fibers::Topology::kBundle : fcl_fibers::Topology::kSuperThread;
    options.report =
        data.ConsumeBool() ? fcl_fibers::Report::kCapsules : fcl_fibers::Report::kVolumes;
    options.ignored_neighbors = data.ConsumeIntegralInRange(0, 2);
    options.margin = data.ConsumeBool() ? 0 : data.ConsumeFloatingPointInRange(0.0, 10.0);
    if (data.ConsumeBool()) {
      manager_ = std::make_unique<fcl_fibers::LayeredAABBTreeCollisionManager<S>>(options);
    } else {
      manager_ = std::make_unique<fcl_fibers::WrappedSphereTreeCollisionManager<S>>(options);
    }
    const std::size_t count = data.ConsumeIntegralInRange<std::size_t>(1, 40);
    for (std::size_t i = 0; i < count; ++i) {
      const auto shape = readShape<S>(data);
      owned_.push_back(std::make_unique<Object>(shape, readPose<S>(data)));
    }
  }

  void run() {
    while (data_.remaining_bytes() > 0) {
      step();
      Objects objects;
      manager_->getObjects(objects);
      require(objects == managed_ && manager_->size() == managed_.size());
    }
  }

 private:
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;

  Object* any() {
    return owned_[data_.ConsumeIntegralInRange<std::size_t>(0, owned_.size() - 1)].get();
  }
  Objects several() {
    Objects objects(data_.ConsumeIntegralInRange<std::size_t>(0, 12));
    for (Object*& object : objects) object = any();
    return objects;
  }

  void step() {
    switch (data_.ConsumeIntegralInRange(0, 11)) {
      case 0: {
        Object* object = any();
        if (!isRefused([&] { manager_->registerObject(object); })) managed_.push_back(object);
        return;
      }
      case 1:
      case 2: {
        const Objects added = several();
        const bool fiber = data_.ConsumeBool();
        if (!isRefused([&] {
              fiber ? manager_->registerFiber(added) : manager_->registerObjects(added);
            })) {
          managed_.insert(managed_.end(), added.begin(), added.end());
        }
        return;
      }
      case 3: {
        Object* object = any();
        const auto place = std::find(managed_.begin(), managed_.end(), object);
        require(isRefused([&] { manager_->unregisterObject(object); }) ==
                (place == managed_.end()));
        if (place != managed_.end()) managed_.erase(place);
        return;
      }
      case 4:
      case 5: {
        const Objects moved = several();
        for (Object* object : moved) {
          object->setTransform(readPose<S>(data_));
          object->computeAABB();
        }
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
        }
        return;
      case 8:
        return collide(nullptr);
      case 9:
        return collide(any());
      case 10:
        return distance(nullptr);
      default:
        return distance(any());
    }
  }

  struct Seen {
    std::vector<std::pair<Object*, Object*>> calls;
    std::size_t stop_at;
    double factor;
  };

  void checkCalls(const Seen& seen, const Object* partner) const {
    require(seen.calls.size() <= seen.stop_at);
    std::set<std::pair<Object*, Object*>> pairs;
    for (const auto& [a, b] : seen.calls) {
      require(a != b && pairs.insert(std::minmax(a, b)).second);
      require(std::find(managed_.begin(), managed_.end(), a) != managed_.end());
      if (partner != nullptr) {
        require(b == partner);
      } else {
        require(std::find(managed_.begin(), managed_.end(), b) != managed_.end());
      }
    }
  }

  void collide(Object* partner) {
    Seen seen{
        {}, data_.ConsumeBool() ? 1000000 : data_.ConsumeIntegralInRange<std::size_t>(1, 9), 1};
    const fcl::CollisionCallBack<S> callback = [](Object* a, Object* b, void* data) {
      auto& self = *static_cast<Seen*>(data);
      self.calls.emplace_back(a, b);
      return self.calls.size() == self.stop_at;
    };
    const auto query = [&] {
      seen.calls.clear();
      if (partner != nullptr) {
        manager_->collide(partner, &seen, callback);
      } else {
        manager_->collide(&seen, callback);
      }
    };
    if (isRefused(query)) return;
    checkCalls(seen, partner);
    const auto before = seen.calls;
    query();
    require(seen.calls == before);
  }

  void distance(Object* partner) {
    Seen seen{{},
              data_.ConsumeBool() ? 1000000 : data_.ConsumeIntegralInRange<std::size_t>(1, 9),
              data_.ConsumeFloatingPointInRange(0.0, 1.0)};
    const fcl::DistanceCallBack<S> callback = [](Object* a, Object* b, void* data, S& least) {
      auto& self = *static_cast<Seen*>(data);
      self.calls.emplace_back(a, b);
      least = static_cast<S>(self.factor * static_cast<double>(least));
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
  }

  FuzzedDataProvider& data_;
  std::unique_ptr<FiberCollisionManager<S>> manager_;
  std::vector<std::unique_ptr<Object>> owned_;
  Objects managed_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  FuzzedDataProvider data(bytes, size);
  if (data.ConsumeBool()) {
    Program<float>(data).run();
  } else {
    Program<double>(data).run();
  }
  return 0;
}
