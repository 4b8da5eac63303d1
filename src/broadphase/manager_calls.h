// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <utility>

#include "fibers/options.h"
#include "index/pair_query.h"

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
/// @tparam State  a ManagerState
template <class State>
class CollisionCall {
 public:
  static constexpr const char* kName = "collide";
  using Object = typename State::Object;
  using Callback = bool (*)(Object*, Object*, void*);

  CollisionCall(void* cdata, Callback callback)
      : cdata_(cdata), callback_(checkedCallback(kName, callback)) {}

  bool operator()(Object* a, Object* b) { return callback_(a, b, cdata_); }
  /// How far apart a pair may be, in the frame of a manager.
  double reach(const State& state) const { return state.generations().margin(); }
  static constexpr bool kRepeats = false;      ///< whether searches hand on some pairs repeatedly
  static constexpr bool kUsesMargin = true;    ///< whether FiberOptions::margin has an effect
  static constexpr bool kLooksAtSteps = true;  ///< whether FiberManagerOptions::motion has one

  template <class Pairs>
  class Sink final : public index::PairSink {
   public:
    Sink(CollisionCall& call, const State& /*state*/, Pairs pairs)
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
  Callback callback_;
};

/// A distance callback, its data, and the least distance so far.
template <class State>
class DistanceCall {
 public:
  static constexpr const char* kName = "distance";
  using Object = typename State::Object;
  using S = typename State::Scalar;
  using Callback = bool (*)(Object*, Object*, void*, S&);

  DistanceCall(void* cdata, Callback callback)
      : cdata_(cdata), callback_(checkedCallback(kName, callback)) {}

  bool operator()(Object* a, Object* b) { return callback_(a, b, cdata_, least_); }
  double reach(const State& state) const {
    return static_cast<double>(least_) * state.frame().scale;
  }
  static constexpr bool kRepeats = true;
  static constexpr bool kUsesMargin = false;
  static constexpr bool kLooksAtSteps = false;

  template <class Pairs>
  class Sink final : public index::NearestSink {
   public:
    Sink(DistanceCall& call, const State& state, Pairs pairs)
        : call_(call), state_(state), source_(state.source(kName)), pairs_(std::move(pairs)) {}
    double limit() const override { return call_.reach(state_); }
    const index::SegmentSource& source() const override { return source_; }
    tree::Visit visit(tree::SegmentId a, tree::SegmentId b, double& nearer_than) override {
      const bool stop = pairs_(a, b, call_);
      nearer_than = limit();
      return stop ? tree::Visit::kStop : tree::Visit::kContinue;
    }

   private:
    DistanceCall& call_;
    const State& state_;
    const typename State::Source source_;
    Pairs pairs_;
  };

 private:
  void* cdata_;
  Callback callback_;
  S least_ = std::numeric_limits<S>::max();
};

}  // namespace fcl_fibers::broadphase
