// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <exception>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "support/managed.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

// A dense scene in a manager, another one in a second, and all six queries over them.
template <typename Config>
class Queries : public testing::Test {
 protected:
  using S = typename Config::Scalar;
  using Manager = fcl::BroadPhaseCollisionManager<S>;

  Queries()
      : scene_(strandScene<S>(6, 12, 131)),
        others_(soupScene<S>(30, 1, 132)),
        manager_(scene_),
        other_(others_),
        oracle_(manager_.oracle(others_.objects())) {
    // An object that meets many.
    probe_ = *std::max_element(
        others_.objects().begin(), others_.objects().end(), [&](auto* a, auto* b) {
          return pairsWith(*manager_, *a).size() < pairsWith(*manager_, *b).size();
        });
  }

  /// Itself, an object and another manager.
  std::vector<QueryPartner<S>> partners() const { return {{}, probe_, other_}; }

  // Each runs one query and gives the pairs that the callback saw. Distance callbacks lower
  // nothing, so that they are called often.
  Calls<S> run(std::size_t query, std::size_t stop_at, std::size_t throw_at, bool* thrown) const {
    PairCollector<S> collector;
    collector.stop_at = stop_at;
    collector.throw_at = throw_at;
    DistanceSearch<S> search(oracle_);
    search.lowers = false;
    search.stop_at = stop_at;
    search.throw_at = throw_at;
    *thrown = false;
    const QueryPartner<S> partner = partners()[query % 3];
    try {
      if (query < 3) {
        partner.collide(*manager_, &collector, &PairCollector<S>::collide);
      } else {
        search.run(*manager_, partner);
      }
    } catch (const CallbackError&) {
      *thrown = true;
    }
    return query < 3 ? collector.calls : search.calls;
  }

  static constexpr std::size_t kQueries = 6;

  Scene<S> scene_;
  Scene<S> others_;
  Managed<Config> manager_, other_;
  PairOracle<S> oracle_;
  fcl::CollisionObject<S>* probe_;
};

template <typename Config>
class QueryContract : public Queries<Config> {};
TYPED_TEST_SUITE(QueryContract, AllManagers, ManagerNames);

template <typename Config>
class FiberQuery : public Queries<Config> {};
TYPED_TEST_SUITE(FiberQuery, FiberManagers, ManagerNames);

// Whoever asks for the first contact would be called again after an answer, or pay for all of them.
TYPED_TEST(QueryContract, TrueEndsTheQueryAtOnce) {
  for (std::size_t query = 0; query < this->kQueries; ++query) {
    bool thrown = false;
    const auto all = this->run(query, kNever, kNever, &thrown);
    ASSERT_GT(all.size(), 4u) << "query " << query;
    for (const std::size_t stop : {std::size_t{1}, std::size_t{2}, std::size_t{4}, all.size() / 2,
                                   all.size() - 1, all.size()}) {
      const auto some = this->run(query, stop, kNever, &thrown);
      ASSERT_EQ(some.size(), stop) << "query " << query;
      EXPECT_TRUE(std::equal(some.begin(), some.end(), all.begin()))
          << "query " << query << ", stop at " << stop;
    }
  }
}

// An exception on its way through a query would spoil the manager for all later ones.
TYPED_TEST(QueryContract, ACallbackMayThrow) {
  for (std::size_t query = 0; query < this->kQueries; ++query) {
    SCOPED_TRACE("query " + std::to_string(query));
    bool thrown = false;
    const std::size_t count = this->run(query, kNever, kNever, &thrown).size();
    EXPECT_FALSE(thrown);
    for (const std::size_t at : {std::size_t{1}, count / 2, count}) {
      // FCL's tree has another order after an update.
      const auto all = this->run(query, kNever, kNever, &thrown);
      const auto some = this->run(query, kNever, at, &thrown);
      EXPECT_TRUE(thrown);
      EXPECT_EQ(some.size(), at);
      for (std::size_t next = 0; next < this->kQueries; ++next) {
        this->run(next, 1, kNever, &thrown);
        EXPECT_FALSE(thrown);
      }
      EXPECT_EQ(this->run(query, kNever, kNever, &thrown), all);
      EXPECT_NO_THROW(this->manager_->update());
      EXPECT_NO_THROW(this->other_->update());
    }
  }
  // And for changes.
  bool thrown = false;
  this->run(0, kNever, 3, &thrown);
  EXPECT_TRUE(thrown);
  this->manager_.registerObject(this->manager_.unregister(20));
  this->manager_->update();
  EXPECT_TRUE(this->manager_.answersSelf());
}

// The caller's data would not arrive as it was given.
TYPED_TEST(QueryContract, TheCallersPointerIsPassedOn) {
  using S = typename TypeParam::Scalar;
  using Object = fcl::CollisionObject<S>;
  static std::vector<void*> given;  // as a callback that is a plain function has its pointer only
  const fcl::CollisionCallBack<S> collide = [](Object*, Object*, void* data) {
    given.push_back(data);
    return false;
  };
  const fcl::DistanceCallBack<S> distance = [](Object*, Object*, void* data, S&) {
    given.push_back(data);
    return false;
  };
  int first = 0, second = 0;
  // A null pointer is the caller's business: it is passed on like any other.
  for (void* const data :
       {static_cast<void*>(&first), static_cast<void*>(&second), static_cast<void*>(nullptr)}) {
    for (std::size_t query = 0; query < this->kQueries; ++query) {
      const auto partner = this->partners()[query % 3];
      given.clear();
      if (query < 3) {
        partner.collide(*this->manager_, data, collide);
      } else {
        partner.distance(*this->manager_, data, distance);
      }
      ASSERT_GT(given.size(), 1u) << query;
      EXPECT_EQ(given, std::vector<void*>(given.size(), data)) << query;
    }
  }
}

// Callbacks that look around, for the partners of a partner say, would disturb the query.
TYPED_TEST(FiberQuery, ACallbackMayQuery) {
  using S = typename TypeParam::Scalar;
  struct Nested {
    const fcl::BroadPhaseCollisionManager<S>* manager;
    Calls<S> outer;
    std::vector<Calls<S>> inner;

    static bool collide(fcl::CollisionObject<S>* a, fcl::CollisionObject<S>* b, void* data) {
      auto& self = *static_cast<Nested*>(data);
      self.outer.emplace_back(a, b);
      if (self.outer.size() % 50 == 1) self.inner.push_back(selfPairs(*self.manager));
      return false;
    }
  };
  const Calls<S> expected = selfPairs<S>(*this->manager_);
  Nested nested{&*this->manager_, {}, {}};
  this->manager_->collide(&nested, &Nested::collide);
  EXPECT_EQ(nested.outer, expected);
  ASSERT_FALSE(nested.inner.empty());
  for (const Calls<S>& inner : nested.inner) EXPECT_EQ(inner, expected);
}

// A callback that changes the manager would pull the tree from under its own query.
TYPED_TEST(FiberQuery, ACallbackMayNotChangeTheManager) {
  using S = typename TypeParam::Scalar;
  using Manager = FiberCollisionManager<S>;
  struct Change {
    Manager* manager;
    std::function<void(Manager&)> apply;
    Calls<S> calls;
    std::size_t refused = 0;

    bool attempt(fcl::CollisionObject<S>* a, fcl::CollisionObject<S>* b) {
      calls.emplace_back(a, b);
      if (calls.size() % 16 != 1) return false;
      try {
        apply(*manager);
      } catch (const std::exception&) {
        ++refused;
      }
      return false;
    }
    static bool collide(fcl::CollisionObject<S>* a, fcl::CollisionObject<S>* b, void* data) {
      return static_cast<Change*>(data)->attempt(a, b);
    }
    static bool distance(fcl::CollisionObject<S>* a, fcl::CollisionObject<S>* b, void* data, S&) {
      return static_cast<Change*>(data)->attempt(a, b);
    }
  };

  const Scene<S> newcomers = strandScene<S>(1, 5, 133);
  fcl::CollisionObject<S>* known = this->scene_[7];
  const std::vector<std::pair<std::string, std::function<void(Manager&)>>> changes = {
      {"registerObject", [&](Manager& m) { m.registerObject(newcomers[0]); }},
      {"registerObjects", [&](Manager& m) { m.registerObjects(newcomers.objects()); }},
      {"registerFiber", [&](Manager& m) { m.registerFiber(newcomers.objects()); }},
      {"unregisterObject", [&](Manager& m) { m.unregisterObject(known); }},
      {"update()", [&](Manager& m) { m.update(); }},
      {"update(object)", [&](Manager& m) { m.update(known); }},
      {"update(objects)", [&](Manager& m) { m.update(std::vector{known}); }},
      {"clear", [&](Manager& m) { m.clear(); }},
  };
  Manager& manager = *this->manager_;
  const auto objects = objectsOf<S>(manager);
  const Calls<S> pairs = selfPairs<S>(manager);
  for (const auto& [name, apply] : changes) {
    SCOPED_TRACE(name);
    Change self{&manager, apply, {}, 0};
    manager.collide(&self, &Change::collide);
    EXPECT_GT(self.refused, 0u);
    EXPECT_EQ(self.calls, pairs);
    Change one{&manager, apply, {}, 0};
    manager.collide(this->probe_, &one, &Change::collide);
    EXPECT_GT(one.refused, 0u);
    Change other{&manager, apply, {}, 0};
    manager.collide(&*this->other_, &other, &Change::collide);
    EXPECT_GT(other.refused, 0u);
    // The other manager's tree is in use as well.
    if (name == "update()" || name == "clear") {
      Change theirs{&*this->other_, apply, {}, 0};
      manager.collide(&*this->other_, &theirs, &Change::collide);
      EXPECT_GT(theirs.refused, 0u);
    }
    Change distance{&manager, apply, {}, 0};
    manager.distance(&distance, &Change::distance);
    EXPECT_GT(distance.refused, 0u);

    EXPECT_EQ(objectsOf<S>(manager), objects);
    EXPECT_EQ(selfPairs<S>(manager), pairs);
    EXPECT_EQ(this->other_->size(), this->others_.size());
  }
  // And afterwards all of them are free again.
  manager.registerFiber(newcomers.objects());
  manager.update();
  manager.unregisterObject(known);
  EXPECT_EQ(manager.size(), objects.size() + newcomers.size() - 1);
  manager.clear();
  EXPECT_TRUE(manager.empty());
}

}  // namespace
}  // namespace fcl_fibers::test
