// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>

#include "broadphase/manager_state.h"
#include "broadphase/pair_rules.h"

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

  template <class Pairs>
  class Sink final : public index::NearestSink {
   public:
    Sink(DistanceCall& call, const ManagerState<S>& state, Pairs pairs)
        : call_(call),
          scale_(state.generations().frame().scale),
          source_(state.source(kName)),
          pairs_(std::move(pairs)) {}
    double limit() const override { return static_cast<double>(call_.least_) * scale_; }
    const index::SegmentSource& source() const override { return source_; }
    tree::Visit visit(SegmentId a, SegmentId b, double& nearer_than) override {
      const bool stop = pairs_(a, b, call_);
      nearer_than = limit();
      return stop ? tree::Visit::kStop : tree::Visit::kContinue;
    }

   private:
    DistanceCall& call_;
    const double scale_;
    const ObjectSource<S> source_;
    Pairs pairs_;
  };

 private:
  void* cdata_;
  fcl::DistanceCallBack<S> callback_;
  S least_ = std::numeric_limits<S>::max();
};

/// The queries of a manager. `Call` is CollisionCall or DistanceCall.
template <typename S, class Call>
class ManagerQueries {
 public:
  using State = ManagerState<S>;
  using Object = fcl::CollisionObject<S>;

  ManagerQueries(const State& state, Call& call)
      : state_(state), scope_(state, Call::kName), rules_(state), call_(call) {}

  /// Finds the pairs among the manager's objects.
  void self() {
    search([this](SegmentId a, SegmentId b, Call& call) {
      if (a > b) std::swap(a, b);
      return rules_.reports(a, b) && call(state_.registry()[a], state_.registry()[b]);
    });
  }

  /// Finds the pairs with an object, managed or not.
  void with(Object* object) {
    if (object == nullptr) {
      fibers::throwInvalidArgument(Call::kName, "the object is null; pass an object");
    }
    searchOne(object, [] { return std::string("the given object"); });
  }

  /// Finds the pairs with the objects of another manager class. It reads each object only when its
  /// turn comes, which saves time if the query ends early.
  void with(const std::vector<Object*>& others) {
    for (std::size_t i = 0; i < others.size() && state_.registry().size() > 0; ++i) {
      const auto name = [i] { return nameOf(i) + " of the other manager"; };
      if (others[i] == nullptr) {
        fibers::throwInvalidArgument(Call::kName, name() + " is null; remove it from that manager");
      }
      if (searchOne(others[i], name) == tree::Visit::kStop) return;
    }
  }

  /// Finds the pairs with the objects of another fiber manager.
  void with(const State& other) {
    const typename State::QueryScope other_scope(other, Call::kName);
    const ObjectSource<S> source = other.source(Call::kName);
    search(
        [&](SegmentId a, SegmentId b, Call& call) {
          Object* partner = other.registry()[b];
          return rules_.reportsWith(a, partner) && call(state_.registry()[a], partner);
        },
        other.generations(), source);
  }

 private:
  /// @param pairs  pairs(a, b, call) calls the callback if the rules report the pair, and returns
  ///               whether that ends the query
  template <class Pairs, class... Where>
  tree::Visit search(Pairs pairs, const Where&... where) {
    typename Call::template Sink<Pairs> sink(call_, state_, std::move(pairs));
    return state_.generations().search(where..., sink);
  }

  template <class Name>
  tree::Visit searchOne(Object* object, Name&& name) {
    const geometry::Segment segment = readObject(Call::kName, *object, state_.generations().frame(),
                                                 state_.options().bounds, name);
    const SegmentId own_id = state_.registry().find(object);
    const tree::Group group = own_id == State::Registry::kNotFound
                                  ? tree::kNoGroup
                                  : state_.registry().fibers().groupOf(own_id);
    return search(
        [&](SegmentId a, SegmentId, Call& call) {
          return rules_.reportsWith(a, own_id) && call(state_.registry()[a], object);
        },
        segment, endPointError(segment), group, SegmentId{0});
  }

  const State& state_;
  const typename State::QueryScope scope_;
  const PairRules<S> rules_;
  Call& call_;
};

}  // namespace fcl_fibers::broadphase
