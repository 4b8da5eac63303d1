// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

namespace fcl_fibers {

/// A first touch in a step and its two objects.
template <typename S>
struct ObjectImpact : TimedContact {
  fcl::CollisionObject<S>* object_a = nullptr;  ///< the callback's first argument
  fcl::CollisionObject<S>* object_b = nullptr;  ///< the second argument
  /// Whether the time is known. If not, only the two objects and their numbers `a` and `b` are set.
  /// That happens if the query was with a manager that the collector does not know, if b has moved
  /// since the query, or where rounding decides whether the two touch.
  bool has_time = false;
};

/// An FCL callback that collects when the pairs of a query touch first in a step, and where, with
/// fiber and segment numbers. The manager must have FiberManagerOptions::motion:
///
///     ImpactCollector<double> collector(manager);
///     manager.beginStep();
///     ...  // objects move
///     manager.update();
///     manager.collide(&collector, collector.callback);
///     for (const auto& impact : collector.impacts()) ...  // impact.time, impact.normal, ...
///
/// Impacts come in the order of their pairs, not of their times. A pair with a mesh has the impact
/// with the triangle that is touched first.
template <typename S>
class ImpactCollector {
 public:
  using Manager = FiberCollisionManager<S>;  ///< a manager whose queries are collected
  using Object = fcl::CollisionObject<S>;    ///< an object of the manager

  /// Collects the impacts of collision queries.
  /// @param manager  the manager that is queried; it has to outlive the collector
  /// @param other    a fiber manager with second objects, as in `manager.collide(other, ...)`. It
  ///                 has to outlive the collector, too. Null if there is none. A second object that
  ///                 it does not have is looked for in `manager`. What is in neither has no fiber.
  explicit ImpactCollector(const Manager& manager, const Manager* other = nullptr)
      : manager_(manager), other_(other) {}

  /// Returns the impacts of all queries since clear(), in the order of their pairs.
  const std::vector<ObjectImpact<S>>& impacts() const { return impacts_; }

  /// Forgets the impacts but keeps their memory for the next query.
  void clear() { impacts_.clear(); }

  /// The callback to pass to `collide`, with the collector as `cdata`. It never ends the query. It
  /// throws std::invalid_argument if the manager has no FiberManagerOptions::motion, if `a` is not
  /// registered in it, or if `b` cannot be read.
  static bool callback(Object* a, Object* b, void* cdata) {
    static_cast<ImpactCollector*>(cdata)->add(a, b);
    return false;
  }

 private:
  void add(Object* a, Object* b) {
    ObjectImpact<S> impact;
    impact.has_time = manager_.findImpact(a, b, other_, impact);
    impact.object_a = a;
    impact.object_b = b;
    impacts_.push_back(impact);
  }

  const Manager& manager_;
  const Manager* other_;
  std::vector<ObjectImpact<S>> impacts_;
};

}  // namespace fcl_fibers
