// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>

#include "broadphase/manager_state.h"

namespace fcl_fibers::broadphase {

/// What a program asks a manager for: the pairs that collide, or those nearer than the least
/// distance so far. Of the manager's objects among themselves, or with others.
template <typename S>
class ManagerQuery {
 public:
  using State = ManagerState<S>;
  using Object = fcl::CollisionObject<S>;

  // They throw std::invalid_argument if the callback is null.
  ManagerQuery(void* cdata, fcl::CollisionCallBack<S> callback);
  ManagerQuery(void* cdata, fcl::DistanceCallBack<S> callback);

  void ask(const State& state);
  void ask(const State& state, const State& other);
  /// @param object  managed or not
  void ask(const State& state, Object* object);
  /// Asks for the pairs with the objects of another class of manager. It reads each object only
  /// when its turn comes, which saves time if the query ends early.
  void ask(const State& state, const std::vector<Object*>& others);

  const char* name() const { return distance_ == nullptr ? "collide" : "distance"; }
  /// Calls the callback, and returns whether that ends the query.
  bool operator()(Object* a, Object* b) {
    return distance_ == nullptr ? collision_(a, b, cdata_) : distance_(a, b, cdata_, least_);
  }
  bool isForDistances() const { return distance_ != nullptr; }
  /// Whether it looks at the whole step.
  bool moves(const State& state) const { return !isForDistances() && state.options().motion; }
  /// How far apart a pair may be, in the frame of a manager. Margins and steps have no effect on
  /// distances.
  double reach(const State& state) const {
    return isForDistances() ? static_cast<double>(least_) * state.frame().scale
                            : state.generations().margin();
  }

 private:
  void* const cdata_;
  const fcl::CollisionCallBack<S> collision_ = nullptr;
  const fcl::DistanceCallBack<S> distance_ = nullptr;
  S least_ = std::numeric_limits<S>::max();
};

extern template class ManagerQuery<float>;
extern template class ManagerQuery<double>;

}  // namespace fcl_fibers::broadphase
