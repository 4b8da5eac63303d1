// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

#include "support/least_box.h"
#include "support/pair_queries.h"
#include "support/scene.h"

// Programs with a manager with FiberManagerOptions::motion, and brute force, which follows each
// pair through the step.

namespace fcl_fibers::test {

inline FiberManagerOptions movingOptions(int threads = 1) {
  FiberManagerOptions options;
  options.threads = threads;
  options.report = Report::kCapsules;
  options.motion = true;
  return options;
}

struct Motion {
  ExactCapsule start, end;

  ExactCapsule at(Real time) const {
    return {start.a + time * (end.a - start.a), start.b + time * (end.b - start.b),
            start.radius + time * (end.radius - start.radius)};
  }
  /// How far any point of the capsule goes.
  Real way() const {
    return std::max((end.a - start.a).norm(), (end.b - start.b).norm()) +
           std::abs(end.radius - start.radius);
  }
};

/// How far the surfaces are apart beyond `margin` when they are nearest in the step, if that may be
/// negative, up to `resolution` of the way of both. The distance cannot shrink faster than both
/// move, so times at which they cannot touch are passed over.
inline Real leastGap(const Motion& p, const Motion& q, Real margin, Real resolution) {
  const Real way = p.way() + q.way();
  Real least = std::numeric_limits<Real>::infinity();
  for (Real time = 0;;) {
    const ExactCapsule i = p.at(time), j = q.at(time);
    const Real gap = segmentDistance(i.a, i.b, j.a, j.b) - i.radius - j.radius - margin;
    least = std::min(least, gap);
    if (least < -1e-3 || time >= 1 || way == 0) return least;
    time = std::min(Real(1), time + std::max(resolution, gap / way));
  }
}

/// What a program does with a manager, and what the manager must answer.
template <typename S>
class Program {
 public:
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;
  using Manager = LayeredAABBTreeCollisionManager<S>;
  using Pairs = std::set<std::pair<const Object*, const Object*>>;

  struct Known {
    std::size_t fiber = 0, segment = 0;
    std::optional<ExactCapsule> start;  ///< nothing until it has been read
  };

  Program(const FiberManagerOptions& options, std::uint64_t seed)
      : manager(options), random(seed) {}

  std::unique_ptr<Object> makeObject(double length) {
    std::shared_ptr<fcl::CollisionGeometry<S>> shape;
    const S radius = S(random.between(0.01, 0.05));
    if (length > 0) {
      shape = std::make_shared<fcl::Capsule<S>>(radius, S(length));
    } else {
      shape = std::make_shared<fcl::Sphere<S>>(radius);
    }
    auto object = std::make_unique<Object>(shape);
    place(*object, 1);
    return object;
  }
  /// Moves an object by about `distance`, and turns it.
  void place(Object& object, double distance) {
    const Point place = object.getTranslation().template cast<Real>();
    reach = std::max(reach, 2 + place.cwiseAbs().maxCoeff());
    jolt(object, random, distance, distance);
  }

  void registerFiber(std::size_t count) {
    Objects fiber;
    for (std::size_t i = 0; i < count; ++i) {
      own.push_back(makeObject(0.4));
      fiber.push_back(own.back().get());
      known[fiber.back()] = {fibers, i, {}};
    }
    ++fibers;
    manager.registerFiber(fiber);
    order.insert(order.end(), fiber.begin(), fiber.end());
  }
  void registerBall() {
    own.push_back(makeObject(0));
    known[own.back().get()] = {fibers++, 0, {}};
    manager.registerObject(own.back().get());
    order.push_back(own.back().get());
  }
  void unregister() {
    if (order.empty()) return;
    const auto at = order.begin() + static_cast<std::ptrdiff_t>(random.below(order.size()));
    manager.unregisterObject(*at);
    known.erase(*at);
    order.erase(at);
  }
  void update(std::size_t count, double distance) {
    Objects moved;
    for (std::size_t i = 0; i < count && !order.empty(); ++i) {
      moved.push_back(order[random.below(order.size())]);
    }
    update(moved, distance);
  }
  void update(const Objects& moved, double distance) {
    for (Object* object : moved) place(*object, distance);
    manager.update(moved);
    if (!moved.empty()) read();
  }
  void updateAll(double distance) {
    for (Object* object : order) place(*object, distance);
    manager.update();
    read();
  }
  void clear() {
    manager.clear();
    known.clear();
    order.clear();
    has_step = false;
  }

  void beginStep() {
    manager.beginStep();
    has_step = true;
    for (auto& [object, known_object] : known) known_object.start = exactCapsule(*object);
  }
  void endStep() {
    manager.endStep();
    has_step = false;
  }
  /// What the next query sees has been read.
  void read() {
    for (auto& [object, known_object] : known) {
      if (!known_object.start) known_object.start = exactCapsule(*object);
    }
  }

  Motion motionOf(const Object* object) const {
    const auto found = known.find(object);
    const ExactCapsule end = exactCapsule(*object);
    return {!has_step || found == known.end() ? end : *found->second.start, end};
  }

  bool areNeighbors(const Object* a, const Object* b) const {
    const auto p = known.find(a), q = known.find(b);
    if (p == known.end() || q == known.end() || p->second.fiber != q->second.fiber) return false;
    const std::size_t i = p->second.segment, j = q->second.segment;
    return std::max(i, j) - std::min(i, j) <=
           static_cast<std::size_t>(manager.options().ignored_neighbors);
  }

  /// Whether these are the pairs that meet within the step, each once.
  void judge(const Calls<S>& calls, const Objects& others, const Program* other_program,
             const std::string& what) {
    SCOPED_TRACE(what);
    Pairs found;
    for (const auto& [a, b] : calls) {
      EXPECT_TRUE(found.emplace(a, b).second) << "a pair comes twice";
    }
    Pairs asked;
    for (std::size_t i = 0; i < order.size(); ++i) {
      const bool is_self = others.empty();
      for (std::size_t j = is_self ? i + 1 : 0; j < (is_self ? order.size() : others.size()); ++j) {
        const Object *a = order[i], *b = is_self ? order[j] : others[j];
        if (a == b || areNeighbors(a, b)) continue;
        const Motion p = motionOf(a), q = (other_program ? other_program : this)->motionOf(b);
        const Real margin = manager.options().margin, way = p.way() + q.way();
        const Real resolution = Real(1) / 1000;
        const Real least = leastGap(p, q, margin, resolution);
        const Real rounding = 1e-12 + 8 * Real(std::numeric_limits<S>::epsilon()) * reach;
        const bool is_found = found.count({a, b}) > 0;
        if (is_found) asked.emplace(a, b);
        if (least < -rounding) {
          EXPECT_TRUE(is_found) << "missing, " << double(least);
        } else if (least > resolution * way + rounding) {
          EXPECT_FALSE(is_found) << "extra, " << double(least);
        }
        if (!is_found || way == 0) continue;
        const Motion p_end{p.end, p.end}, q_end{q.end, q.end};
        missed_at_end += leastGap(p_end, q_end, margin, 1) > 0 ? 1 : 0;
      }
    }
    EXPECT_EQ(asked.size(), found.size()) << "a pair is ignored or unasked";
  }

  Manager manager;
  Random random;
  std::vector<std::unique_ptr<Object>> own;
  Objects order;
  std::map<const Object*, Known> known;
  std::size_t fibers = 0;
  bool has_step = false;
  Real reach = 1;                 ///< bounds the coordinates
  std::size_t missed_at_end = 0;  ///< pairs that a query about the end of the step would miss
};

/// A fiber of one capsule along x, whose middle is at a place.
template <typename S>
struct OneCapsule {
  explicit OneCapsule(double length = 0.2, double radius = 0.01)
      : object(std::make_shared<fcl::Capsule<S>>(S(radius), S(length))) {
    place(0, 0, 0);
  }
  void place(double x, double y, double z) {
    fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
    pose.linear() =
        fcl::AngleAxis<S>(S(1.5707963267948966), fcl::Vector3<S>::UnitY()).toRotationMatrix();
    pose.translation() = fcl::Vector3<S>(S(x), S(y), S(z));
    object.setTransform(pose);
  }
  fcl::CollisionObject<S> object;
};

}  // namespace fcl_fibers::test
