// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/continuous_fiber_collision_manager.h>

#include <utility>

#include "broadphase/continuous_state.h"
#include "broadphase/fcl_layout.h"
#include "broadphase/impact_of_objects.h"
#include "broadphase/manager_calls.h"
#include "broadphase/motion_bounds.h"
#include "broadphase/pair_rules.h"

namespace fcl_fibers {
namespace {

using fibers::throwInvalidArgument;
using tree::SegmentId;
using tree::Visit;

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
  using Collision = broadphase::CollisionCall<State>;
  using Distance = broadphase::DistanceCall<State>;
  using State::index, State::registry, State::State;

  static const FiberOptions& checked(const FiberOptions& options) {
    broadphase::requireLayoutOfFcl();
    fibers::requireValid("FiberOptions", options);
    return options;
  }

  // Each query finds the pairs within this manager, with an object, or with another manager.

  template <class Call>
  void query(Call call) const {
    const typename State::QueryScope scope(*this, Call::kName);
    const Rules rules(registry(), registry().idCount());
    search(call, [&](SegmentId a, SegmentId b, Call&) {
      if (a > b) std::swap(a, b);
      return rules.reports(a, b, /*is_beside=*/false) && call(registry()[a], registry()[b]);
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
    const Registry& partners = theirs.registry();
    const Rules rules(registry(), registry().idCount());
    const auto report = [&](SegmentId a, SegmentId b, Call&) {
      return rules.reportsWith(a, partners, b) && call(registry()[a], partners[b]);
    };
    search(call, report, theirs.index());
  }

 private:
  using Rules = broadphase::PairRules<Registry>;

  template <class Call, class Pairs, class... Where>
  Visit search(Call& call, const Pairs& pairs, const Where&... where) const {
    typename Call::template Sink<Pairs> sink(call, *this, pairs);
    return index().search(where..., sink);
  }

  template <class Call, class Name>
  void queryObjects(Call& call, const std::vector<Object*>& objects, const Name& name) const {
    const typename State::QueryScope scope(*this, Call::kName);
    if (registry().size() == 0) return;
    std::vector<geometry::MovingSegment> moving(objects.size());
    for (std::size_t i = 0; i < objects.size(); ++i) {
      if (objects[i] == nullptr) {
        throwInvalidArgument(Call::kName, name(i) + " is null; remove it from that manager");
      }
      moving[i] = broadphase::readMoving(Call::kName, *objects[i], [&] { return name(i); });
    }
    const Rules rules(registry(), registry().idCount());
    for (std::size_t i = 0; i < objects.size(); ++i) {
      const SegmentId own_id = registry().find(objects[i]);
      const tree::Group group =
          own_id == Registry::kNotFound ? tree::kNoGroup : registry().fibers().groupOf(own_id);
      const auto report = [&](SegmentId a, SegmentId /*second*/, Call&) {
        return rules.reportsWith(a, own_id) && call(registry()[a], objects[i]);
      };
      if (search(call, report, moving[i], group, SegmentId{0}) == Visit::kStop) return;
    }
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
  impl_->registry().list(objects);
}

template <typename S>
void ContinuousFiberCollisionManager<S>::collide(
    Object* object, void* cdata, fcl::ContinuousCollisionCallBack<S> callback) const {
  impl_->query(typename Impl::Collision(cdata, callback), object);
}

template <typename S>
void ContinuousFiberCollisionManager<S>::collide(
    void* cdata, fcl::ContinuousCollisionCallBack<S> callback) const {
  impl_->query(typename Impl::Collision(cdata, callback));
}

template <typename S>
void ContinuousFiberCollisionManager<S>::collide(
    Base* other, void* cdata, fcl::ContinuousCollisionCallBack<S> callback) const {
  impl_->query(typename Impl::Collision(cdata, callback), other);
}

template <typename S>
void ContinuousFiberCollisionManager<S>::distance(
    Object* object, void* cdata, fcl::ContinuousDistanceCallBack<S> callback) const {
  impl_->query(typename Impl::Distance(cdata, callback), object);
}

template <typename S>
void ContinuousFiberCollisionManager<S>::distance(
    void* cdata, fcl::ContinuousDistanceCallBack<S> callback) const {
  impl_->query(typename Impl::Distance(cdata, callback));
}

template <typename S>
void ContinuousFiberCollisionManager<S>::distance(
    Base* other, void* cdata, fcl::ContinuousDistanceCallBack<S> callback) const {
  impl_->query(typename Impl::Distance(cdata, callback), other);
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
bool ContinuousFiberCollisionManager<S>::isRegistered(const Object* object) const {
  return object != nullptr && impl_->registry().find(object) != Impl::Registry::kNotFound;
}

template <typename S>
FiberSegment ContinuousFiberCollisionManager<S>::fiberSegment(const Object* object) const {
  const SegmentId id = impl_->managedId("fiberSegment", object, "the given object");
  return impl_->registry().fibers().placeOf(id);
}

template <typename S>
bool ContinuousFiberCollisionManager<S>::findImpact(const Object* a, const Object* b,
                                                    const ContinuousFiberCollisionManager* other,
                                                    TimedContact& contact) const {
  return broadphase::findImpact<S>(*impl_, other == nullptr ? nullptr : other->impl_.get(), a, b,
                                   contact);
}

template <typename S>
std::size_t ContinuousFiberCollisionManager<S>::memoryUsage() const {
  return impl_->memoryUsage();
}

template class ContinuousFiberCollisionManager<float>;
template class ContinuousFiberCollisionManager<double>;

}  // namespace fcl_fibers
