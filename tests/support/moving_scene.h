// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl_fibers/continuous_fiber_collision_manager.h>

#include "support/least_box.h"
#include "support/motions.h"
#include "support/text_of.h"

namespace fcl_fibers::test {

template <typename S>
using Moving = fcl::ContinuousCollisionObject<S>;
template <typename S>
using Calls = std::vector<std::pair<Moving<S>*, Moving<S>*>>;
template <typename S>
using Motion = std::shared_ptr<fcl::MotionBase<S>>;

/// Objects that move, and where they are.
template <typename S>
class MovingScene {
 public:
  Moving<S>* add(const std::shared_ptr<fcl::CollisionGeometry<S>>& shape, const Motion<S>& motion) {
    parts_.emplace_back(shape, motion);
    objects_.push_back(std::make_unique<Moving<S>>(shape, motion));
    pointers_.push_back(objects_.back().get());
    return pointers_.back();
  }
  /// A sphere along a line.
  Moving<S>* addSphere(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius) {
    return add(std::make_shared<fcl::Sphere<S>>(S(radius)), translation(from, to));
  }
  static Motion<S> translation(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return std::make_shared<fcl::TranslationMotion<S>>(fcl::Matrix3<S>(fcl::Matrix3<S>::Identity()),
                                                       fcl::Vector3<S>(from.template cast<S>()),
                                                       fcl::Vector3<S>(to.template cast<S>()));
  }

  const std::vector<Moving<S>*>& objects() const { return pointers_; }
  Moving<S>* operator[](std::size_t i) const { return pointers_[i]; }
  std::size_t size() const { return pointers_.size(); }
  std::size_t indexOf(const Moving<S>* object) const {
    return static_cast<std::size_t>(std::find(pointers_.begin(), pointers_.end(), object) -
                                    pointers_.begin());
  }

  /// The same shapes and motions, which are shared, in objects that were allocated from last to
  /// first.
  MovingScene reallocated() const {
    MovingScene copy;
    for (std::size_t i = size(); i-- > 0;) copy.add(parts_[i].first, parts_[i].second);
    std::reverse(copy.pointers_.begin(), copy.pointers_.end());
    std::reverse(copy.parts_.begin(), copy.parts_.end());
    return copy;
  }

 private:
  std::vector<std::pair<std::shared_ptr<fcl::CollisionGeometry<S>>, Motion<S>>> parts_;
  std::vector<std::unique_ptr<Moving<S>>> objects_;
  std::vector<Moving<S>*> pointers_;
};

template <typename S>
fcl::CollisionObject<S> poseAt(const Moving<S>& object, double t) {
  fcl::Transform3<S> pose;
  object.getMotion()->integrate(static_cast<S>(t));
  object.getMotion()->getCurrentTransform(pose);
  auto shape = std::const_pointer_cast<fcl::CollisionGeometry<S>>(object.collisionGeometry());
  return fcl::CollisionObject<S>(shape, pose);
}

/// How far apart, on the axis that keeps them apart most, the least boxes of two objects are when
/// they are nearest: exactly if both move along lines, and otherwise at the best of many times.
/// Negative if the boxes overlap.
template <typename S>
class SeparationOracle {
 public:
  explicit SeparationOracle(const std::vector<Moving<S>*>& objects, int times = 48) {
    for (Moving<S>* object : objects) {
      std::vector<ExactBox>& boxes = boxes_.emplace_back();
      for (int i = 0; i <= times; ++i) {
        boxes.push_back(leastBox(poseAt(*object, static_cast<double>(i) / times)));
      }
    }
  }
  Real operator()(std::size_t a, std::size_t b) const {
    Real least = std::numeric_limits<Real>::max();
    for (std::size_t i = 0; i < boxes_[a].size(); ++i) {
      least = std::min(least, apart(boxes_[a][i], boxes_[b][i]));
    }
    return least;
  }
  /// For linear motions: the largest of six linear functions, which is convex in time.
  Real ofLines(std::size_t a, std::size_t b) const {
    double start[6], end[6], least = -std::numeric_limits<double>::max();
    for (int i = 0; i < 3; ++i) {
      const auto gaps = [&](const ExactBox& p, const ExactBox& q, double* gap) {
        gap[2 * i] = static_cast<double>(p.min[i] - q.max[i]);
        gap[2 * i + 1] = static_cast<double>(q.min[i] - p.max[i]);
      };
      gaps(boxes_[a].front(), boxes_[b].front(), start);
      gaps(boxes_[a].back(), boxes_[b].back(), end);
    }
    for (int i = 0; i < 6; ++i) least = std::max(least, std::min(start[i], end[i]));
    if (least > 0.1) return least;  // a lower bound is enough
    const auto at = [&](double t) {
      double largest = -std::numeric_limits<double>::max();
      for (int i = 0; i < 6; ++i) largest = std::max(largest, (1 - t) * start[i] + t * end[i]);
      return largest;
    };
    double from = 0, to = 1;
    for (int i = 0; i < 60; ++i) {
      const double p = from + (to - from) / 3, q = to - (to - from) / 3;
      at(p) < at(q) ? to = q : from = p;
    }
    return std::min({at(from), at(0), at(1)});
  }

 private:
  static Real apart(const ExactBox& p, const ExactBox& q) {
    return (p.min - q.max).cwiseMax(q.min - p.max).maxCoeff();
  }
  std::vector<std::vector<ExactBox>> boxes_;
};

struct CallbackError : std::runtime_error {
  CallbackError() : std::runtime_error("thrown by a callback") {}
};

template <typename S>
struct Collector {
  Calls<S> calls;
  std::size_t stop_at = std::numeric_limits<std::size_t>::max();
  std::size_t throw_at = stop_at;
  std::function<void()> during;

  bool take(Moving<S>* a, Moving<S>* b) {
    calls.emplace_back(a, b);
    if (during) during();
    if (calls.size() == throw_at) throw CallbackError();
    return calls.size() == stop_at;
  }
  static bool collide(Moving<S>* a, Moving<S>* b, void* data) {
    return static_cast<Collector*>(data)->take(a, b);
  }
  static bool distance(Moving<S>* a, Moving<S>* b, void* data, S&) {
    return static_cast<Collector*>(data)->take(a, b);
  }
};

template <typename S>
using Manager = ContinuousFiberCollisionManager<S>;

template <typename S, class... Partner>
Calls<S> collide(const Manager<S>& manager, Partner... partner) {
  Collector<S> collector;
  manager.collide(partner..., &collector, &Collector<S>::collide);
  return collector.calls;
}
template <typename S, class... Partner>
Calls<S> everyPair(const Manager<S>& manager, Partner... partner) {
  Collector<S> collector;
  manager.distance(partner..., &collector, &Collector<S>::distance);
  return collector.calls;
}

/// Another program's manager. It holds objects and finds nothing.
template <typename S>
class Foreign final : public fcl::BroadPhaseContinuousCollisionManager<S> {
 public:
  using Base = fcl::BroadPhaseContinuousCollisionManager<S>;
  std::vector<Moving<S>*> objects;

  void registerObject(Moving<S>* object) override { objects.push_back(object); }
  void unregisterObject(Moving<S>*) override {}
  void setup() override {}
  void update() override {}
  void clear() override {}
  void getObjects(std::vector<Moving<S>*>& all) const override { all = objects; }
  void collide(Moving<S>*, void*, fcl::CollisionCallBack<S>) const override {}
  void collide(void*, fcl::CollisionCallBack<S>) const override {}
  void collide(Base*, void*, fcl::CollisionCallBack<S>) const override {}
  void distance(Moving<S>*, void*, fcl::DistanceCallBack<S>) const override {}
  void distance(void*, fcl::DistanceCallBack<S>) const override {}
  void distance(Base*, void*, fcl::DistanceCallBack<S>) const override {}
  bool empty() const override { return objects.empty(); }
  std::size_t size() const override { return objects.size(); }
};

template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> randomShape(Random& random, double size) {
  const auto side = [&] { return static_cast<S>(size * random.between(0.3, 1)); };
  switch (random.below(3)) {
    case 0:
      return std::make_shared<fcl::Capsule<S>>(side() / 2, 2 * side());
    case 1:
      return std::make_shared<fcl::Sphere<S>>(side());
    default:
      return std::make_shared<fcl::Box<S>>(side(), side(), side());
  }
}

/// Objects in a cube of size 2 that move about as far.
template <typename S>
void fill(MovingScene<S>& scene, std::size_t count, const std::vector<MotionKind>& kinds,
          std::uint64_t seed, double size = 0.1) {
  Random random(seed);
  for (std::size_t i = 0; i < count; ++i) {
    const MotionKind kind = kinds[i % kinds.size()];
    scene.add(randomShape<S>(random, size),
              makeMotion<S>(kind, random.inCube(0.6), 0.4, random.between(0, 2), random));
  }
}

inline std::vector<FiberOptions> assortedContinuousOptions() {
  std::vector<FiberOptions> all(4);
  all[1].margin = 0.03;
  all[2].topology = Topology::kSuperThread;
  all[2].threads = 2;
  all[3].threads = 2;
  return all;
}

}  // namespace fcl_fibers::test
