// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/continuous_fiber_collision_manager.h>

#include <limits>

#include "broadphase/continuous_state.h"
#include "broadphase/fcl_layout.h"
#include "broadphase/pair_rules.h"

namespace fcl_fibers {
namespace {

using broadphase::ContinuousIndex;
using fibers::throwInvalidArgument;
using tree::SegmentId;
using tree::Visit;

/// Throws std::invalid_argument if a callback is null.
template <class Callback>
Callback checkedCallback(const char* call, Callback callback) {
  if (callback == nullptr) throwInvalidArgument(call, "the callback is null; pass a function");
  return callback;
}

/// A collision callback and its data. pairs(a, b) returns whether the query ends.
template <typename S>
class Collision {
 public:
  static constexpr const char* kName = "collide";
  using Object = fcl::ContinuousCollisionObject<S>;

  Collision(void* cdata, fcl::ContinuousCollisionCallBack<S> callback)
      : cdata_(cdata), callback_(checkedCallback(kName, callback)) {}

  bool operator()(Object* a, Object* b) { return callback_(a, b, cdata_); }

  template <class Pairs, class... Other>
  void search(const ContinuousIndex& index, const Pairs& pairs, const Other&... other) {
    Sink<Pairs> sink(pairs);
    index.search(other..., sink);
  }

 private:
  template <class Pairs>
  class Sink final : public index::PairSink {
   public:
    explicit Sink(const Pairs& pairs) : pairs_(pairs) {}
    Visit take(const tree::Pair* pairs, std::size_t count) override {
      for (const tree::Pair* pair = pairs; pair != pairs + count; ++pair) {
        if (pairs_(pair->a, pair->b)) return Visit::kStop;
      }
      return Visit::kContinue;
    }

   private:
    const Pairs& pairs_;
  };

  void* cdata_;
  fcl::ContinuousCollisionCallBack<S> callback_;
};

/// A distance callback, its data, and the least distance so far.
template <typename S>
class Distance {
 public:
  static constexpr const char* kName = "distance";
  using Object = fcl::ContinuousCollisionObject<S>;

  Distance(void* cdata, fcl::ContinuousDistanceCallBack<S> callback)
      : cdata_(cdata), callback_(checkedCallback(kName, callback)) {}

  bool operator()(Object* a, Object* b) { return callback_(a, b, cdata_, least_); }

  template <class Pairs, class... Other>
  void search(const ContinuousIndex& index, const Pairs& pairs, const Other&... other) {
    index.searchNear(other..., static_cast<double>(least_),
                     [&](SegmentId a, SegmentId b, double& limit) {
                       const bool stop = pairs(a, b);
                       limit = static_cast<double>(least_);
                       return stop ? Visit::kStop : Visit::kContinue;
                     });
  }

 private:
  void* cdata_;
  fcl::ContinuousDistanceCallBack<S> callback_;
  S least_ = std::numeric_limits<S>::max();
};

[[noreturn]] void refuseCallback(const char* call, const char* right) {
  throwInvalidArgument(call, std::string("its callback takes fcl::CollisionObject, which a "
                                         "continuous object is not; pass an ") +
                                 right);
}
[[noreturn]] void refuseCollide() { refuseCallback("collide", "fcl::ContinuousCollisionCallBack"); }
[[noreturn]] void refuseDistance() {
  refuseCallback("distance", "fcl::ContinuousDistanceCallBack");
}

}  // namespace

template <typename S>
class ContinuousFiberCollisionManager<S>::Impl final : public broadphase::ContinuousState<S> {
 public:
  using State = broadphase::ContinuousState<S>;
  using Registry = typename State::Registry;
  using Rules = broadphase::PairRules<Registry>;
  using State::State;

  static const FiberOptions& checked(const FiberOptions& options) {
    broadphase::requireLayoutOfFcl();
    fibers::requireValid("FiberOptions", options);
    return options;
  }

  // Each query finds the pairs within this manager, with an object, or with another manager.

  template <class Call>
  void query(Call call) const {
    const typename State::QueryScope scope(*this, Call::kName);
    const Registry& registry = this->registry();
    const Rules rules(registry, registry.idCount());
    call.search(this->index(), [&](SegmentId a, SegmentId b) {
      if (a > b) std::swap(a, b);
      return rules.reports(a, b) && call(registry[a], registry[b]);
    });
  }

  template <class Call>
  void query(Call call, Object* object) const {
    if (object == nullptr) {
      throwInvalidArgument(Call::kName, "the object is null; pass an object");
    }
    queryObjects(call, {object}, [](std::size_t) { return std::string("the given object"); });
  }

  template <class Call>
  void query(Call call, Base* other) const {
    if (other == nullptr) throwInvalidArgument(Call::kName, "the manager is null; pass a manager");
    const auto* ours = dynamic_cast<const ContinuousFiberCollisionManager*>(other);
    if (ours == nullptr) {
      std::vector<Object*> objects;
      other->getObjects(objects);
      return queryObjects(call, objects, [](std::size_t i) {
        return broadphase::nameOf(i) + " of the other manager";
      });
    }
    if (ours->impl_.get() == this) return query(call);
    const Impl& theirs = *ours->impl_;
    const typename State::QueryScope scope(*this, Call::kName), their_scope(theirs, Call::kName);
    const Registry &registry = this->registry(), &partners = theirs.registry();
    const Rules rules(registry, registry.idCount());
    const auto report = [&](SegmentId a, SegmentId b) {
      return rules.reportsWith(a, partners, b) && call(registry[a], partners[b]);
    };
    call.search(this->index(), report, theirs.index());
  }

 private:
  template <class Call, class Name>
  void queryObjects(Call& call, const std::vector<Object*>& objects, const Name& name) const {
    const typename State::QueryScope scope(*this, Call::kName);
    const Registry& registry = this->registry();
    if (registry.size() == 0) return;
    const auto partners = this->indexOf(Call::kName, objects, name);
    const Rules rules(registry, registry.idCount());
    const auto report = [&](SegmentId a, SegmentId b) {
      Object* partner = objects[static_cast<std::size_t>(b)];
      return rules.reportsWith(a, registry.find(partner)) && call(registry[a], partner);
    };
    call.search(this->index(), report, *partners);
  }
};

template <typename S>
ContinuousFiberCollisionManager<S>::ContinuousFiberCollisionManager(const FiberOptions& options)
    : impl_(std::make_unique<Impl>(Impl::checked(options))) {}

template <typename S>
ContinuousFiberCollisionManager<S>::~ContinuousFiberCollisionManager() = default;

template <typename S>
void ContinuousFiberCollisionManager<S>::registerFiber(const std::vector<Object*>& fiber,
                                                       FiberEnds ends, FiberGroup group) {
  impl_->add("registerFiber", fiber, {true, ends == FiberEnds::kClosed, group.number});
}

template <typename S>
void ContinuousFiberCollisionManager<S>::registerObjects(const std::vector<Object*>& objects) {
  impl_->add("registerObjects", objects, {false, false, tree::kNoGroup});
}

template <typename S>
void ContinuousFiberCollisionManager<S>::registerObject(Object* object) {
  impl_->add("registerObject", {object}, {false, false, tree::kNoGroup});
}

template <typename S>
void ContinuousFiberCollisionManager<S>::unregisterObject(Object* object) {
  impl_->remove("unregisterObject", object);
}

template <typename S>
void ContinuousFiberCollisionManager<S>::setup() {
  impl_->setup("setup");
}

template <typename S>
void ContinuousFiberCollisionManager<S>::update() {
  impl_->update("update");
}

template <typename S>
void ContinuousFiberCollisionManager<S>::update(Object* object) {
  impl_->update("update", {object});
}

template <typename S>
void ContinuousFiberCollisionManager<S>::update(const std::vector<Object*>& objects) {
  impl_->update("update", objects);
}

template <typename S>
void ContinuousFiberCollisionManager<S>::clear() {
  impl_->clear("clear");
}

template <typename S>
void ContinuousFiberCollisionManager<S>::getObjects(std::vector<Object*>& objects) const {
  objects.clear();
  objects.reserve(size());
  for (Object* object : impl_->registry().objects()) {
    if (object != nullptr) objects.push_back(object);
  }
}

template <typename S>
void ContinuousFiberCollisionManager<S>::collide(
    Object* object, void* cdata, fcl::ContinuousCollisionCallBack<S> callback) const {
  impl_->query(Collision<S>(cdata, callback), object);
}

template <typename S>
void ContinuousFiberCollisionManager<S>::collide(
    void* cdata, fcl::ContinuousCollisionCallBack<S> callback) const {
  impl_->query(Collision<S>(cdata, callback));
}

template <typename S>
void ContinuousFiberCollisionManager<S>::collide(
    Base* other, void* cdata, fcl::ContinuousCollisionCallBack<S> callback) const {
  impl_->query(Collision<S>(cdata, callback), other);
}

template <typename S>
void ContinuousFiberCollisionManager<S>::distance(
    Object* object, void* cdata, fcl::ContinuousDistanceCallBack<S> callback) const {
  impl_->query(Distance<S>(cdata, callback), object);
}

template <typename S>
void ContinuousFiberCollisionManager<S>::distance(
    void* cdata, fcl::ContinuousDistanceCallBack<S> callback) const {
  impl_->query(Distance<S>(cdata, callback));
}

template <typename S>
void ContinuousFiberCollisionManager<S>::distance(
    Base* other, void* cdata, fcl::ContinuousDistanceCallBack<S> callback) const {
  impl_->query(Distance<S>(cdata, callback), other);
}

template <typename S>
void ContinuousFiberCollisionManager<S>::collide(Object*, void*, fcl::CollisionCallBack<S>) const {
  refuseCollide();
}
template <typename S>
void ContinuousFiberCollisionManager<S>::collide(void*, fcl::CollisionCallBack<S>) const {
  refuseCollide();
}
template <typename S>
void ContinuousFiberCollisionManager<S>::collide(Base*, void*, fcl::CollisionCallBack<S>) const {
  refuseCollide();
}
template <typename S>
void ContinuousFiberCollisionManager<S>::distance(Object*, void*, fcl::DistanceCallBack<S>) const {
  refuseDistance();
}
template <typename S>
void ContinuousFiberCollisionManager<S>::distance(void*, fcl::DistanceCallBack<S>) const {
  refuseDistance();
}
template <typename S>
void ContinuousFiberCollisionManager<S>::distance(Base*, void*, fcl::DistanceCallBack<S>) const {
  refuseDistance();
}

template <typename S>
bool ContinuousFiberCollisionManager<S>::empty() const {
  return size() == 0;
}

template <typename S>
std::size_t ContinuousFiberCollisionManager<S>::size() const {
  return impl_->registry().size();
}

template <typename S>
const FiberOptions& ContinuousFiberCollisionManager<S>::options() const {
  return impl_->options();
}

template <typename S>
FiberSegment ContinuousFiberCollisionManager<S>::fiberSegment(const Object* object) const {
  const SegmentId id = impl_->managedId("fiberSegment", object, "the given object");
  const fibers::Place place = impl_->registry().fibers().placeOf(id);
  return {place.fiber, place.segment};
}

template class ContinuousFiberCollisionManager<float>;
template class ContinuousFiberCollisionManager<double>;

}  // namespace fcl_fibers
