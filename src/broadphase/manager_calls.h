// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <utility>

#include <fcl/broadphase/broadphase_collision_manager.h>

#include "broadphase/manager_state.h"

namespace fcl_fibers::broadphase {

/// Throws std::invalid_argument if a callback is null.
template <class Callback>
Callback checkedCallback(const char* call, Callback callback) {
  if (callback == nullptr) {
    fibers::throwInvalidArgument(call, "the callback is null; pass a function");
  }
  return callback;
}

/// A collision callback and its data. The limit of a collision query never changes, so the index
/// hands on pairs in runs.
template <typename S>
class CollisionCall {
 public:
  static constexpr const char* kName = "collide";

  CollisionCall(void* cdata, fcl::CollisionCallBack<S> callback)
      : cdata_(cdata), callback_(checkedCallback(kName, callback)) {}

  bool operator()(fcl::CollisionObject<S>* a, fcl::CollisionObject<S>* b) {
    return callback_(a, b, cdata_);
  }
  /// How far apart a pair may be, in the frame of a manager.
  double reach(const ManagerState<S>& state) const { return state.generations().margin(); }
  static constexpr bool kRepeats = false;      ///< whether searches hand on some pairs repeatedly
  static constexpr bool kUsesMargin = true;    ///< whether FiberOptions::margin has an effect
  static constexpr bool kLooksAtSteps = true;  ///< whether FiberManagerOptions::motion has one

  template <class Pairs>
  class Sink final : public index::PairSink {
   public:
    Sink(CollisionCall& call, const ManagerState<S>& /*state*/, Pairs pairs)
        : call_(call), pairs_(std::move(pairs)) {}
    tree::Visit take(const tree::Pair* pairs, std::size_t count) override {
      for (const tree::Pair* pair = pairs; pair != pairs + count; ++pair) {
        if (pairs_(pair->a, pair->b, call_)) return tree::Visit::kStop;
      }
      return tree::Visit::kContinue;
    }

   private:
    CollisionCall& call_;
    Pairs pairs_;
  };

 private:
  void* cdata_;
  fcl::CollisionCallBack<S> callback_;
};

/// A distance callback, its data, and the least distance so far.
template <typename S>
class DistanceCall {
 public:
  static constexpr const char* kName = "distance";

  DistanceCall(void* cdata, fcl::DistanceCallBack<S> callback)
      : cdata_(cdata), callback_(checkedCallback(kName, callback)) {}

  bool operator()(fcl::CollisionObject<S>* a, fcl::CollisionObject<S>* b) {
    return callback_(a, b, cdata_, least_);
  }
  double reach(const ManagerState<S>& state) const {
    return static_cast<double>(least_) * state.generations().frame().scale;
  }
  static constexpr bool kRepeats = true;
  static constexpr bool kUsesMargin = false;
  static constexpr bool kLooksAtSteps = false;

  template <class Pairs>
  class Sink final : public index::NearestSink {
   public:
    Sink(DistanceCall& call, const ManagerState<S>& state, Pairs pairs)
        : call_(call), state_(state), source_(state.source(kName)), pairs_(std::move(pairs)) {}
    double limit() const override { return call_.reach(state_); }
    const index::SegmentSource& source() const override { return source_; }
    tree::Visit visit(SegmentId a, SegmentId b, double& nearer_than) override {
      const bool stop = pairs_(a, b, call_);
      nearer_than = limit();
      return stop ? tree::Visit::kStop : tree::Visit::kContinue;
    }

   private:
    DistanceCall& call_;
    const ManagerState<S>& state_;
    const ObjectSource<S> source_;
    Pairs pairs_;
  };

 private:
  void* cdata_;
  fcl::DistanceCallBack<S> callback_;
  S least_ = std::numeric_limits<S>::max();
};

}  // namespace fcl_fibers::broadphase
