// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "support/distance_search.h"
#include "support/managers_under_test.h"
#include "support/pair_oracle.h"
#include "support/pair_queries.h"
#include "support/scene.h"

namespace fcl_fibers::test {

/// What a manager was given, and how its answers compare with brute force over that.
template <typename S>
class Answering {
 public:
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;
  using Base = fcl::BroadPhaseCollisionManager<S>;

  /// In the order of registration.
  const Objects& objects() const { return objects_; }
  std::size_t size() const { return objects_.size(); }
  Object* operator[](std::size_t i) const { return objects_[i]; }
  operator QueryPartner<S>() const { return {*manager_, objects_}; }
  /// One of every `step` objects.
  Objects every(std::size_t step) const;

  /// Pairs as numbers of these objects and then of the others, to compare those of other scenes.
  std::vector<std::pair<std::size_t, std::size_t>> numbered(const Calls<S>& calls,
                                                            const Objects& others = {}) const;

  /// By the poses of now. Knows these objects as well.
  PairOracle<S> oracle(const Objects& others = {}) const { return oracle(others, rules_); }

  /// Whether the manager holds these objects and reports their pairs, of which at least so many
  /// have to be found.
  testing::AssertionResult answersSelf(std::size_t least = 1) const;
  testing::AssertionResult answersWith(const QueryPartner<S>& partner, std::size_t least = 1) const;
  /// Whether these pairs are those of objects that touch, whatever the manager reports.
  testing::AssertionResult areTouching(const Calls<S>& pairs, const QueryPartner<S>& partner,
                                       std::size_t least) const;
  /// With each of these objects, at least one of which meets something.
  void expectAnswersWith(const Objects& partners) const;

  /// That a distance query finds the smallest distance, which is returned, and looks at nothing
  /// once it is zero.
  S expectNearest(const QueryPartner<S>& partner = {}) const;
  /// That a distance callback that lowers nothing gets every pair that is not ignored, once.
  void expectEveryPair(const QueryPartner<S>& partner = {}) const;

  void registerObject(Object* object);
  void registerObjects(const Objects& objects);
  void registerEach(const Objects& objects);
  void unregisterObject(Object* object);
  Object* unregister(std::size_t i);
  void clear();

 protected:
  Answering(Base& manager, const PairRules& rules, ArgumentOrder order)
      : manager_(&manager), rules_(rules), order_(order) {}

  void remember(const Objects& objects);
  /// The other's fibers, of these objects instead of its own.
  void rememberAs(const Answering& other, const Objects& objects);

  std::vector<Objects> fibers_;
  std::vector<int> groups_;
  std::vector<FiberEnds> ends_;

 private:
  PairOracle<S> oracle(const Objects& others, const PairRules& rules) const;
  void run(DistanceSearch<S>& search, const QueryPartner<S>& partner) const;

  Base* manager_;
  PairRules rules_;
  ArgumentOrder order_;
  Objects objects_;
  std::set<Object*> gone_;
};

extern template class Answering<float>;
extern template class Answering<double>;

/// A manager of this configuration.
template <typename Config>
class Managed : public Answering<typename Config::Scalar> {
 public:
  using S = typename Config::Scalar;
  using Objects = typename Answering<S>::Objects;
  using Manager = typename decltype(Config::make())::element_type;

  explicit Managed(const FiberManagerOptions& options = {})
      : Managed(Config::make(options), options) {}
  /// With these objects, registered at once and set up.
  explicit Managed(const Objects& objects, const FiberManagerOptions& options = {})
      : Managed(options) {
    this->registerObjects(objects);
    manager_->setup();
  }
  explicit Managed(const Scene<S>& scene, const FiberManagerOptions& options = {})
      : Managed(scene.objects(), options) {}
  /// Takes over a manager that is empty.
  Managed(std::unique_ptr<Manager> manager, const FiberManagerOptions& options)
      : Answering<S>(*manager, rulesOf<Config>(options), kOrder<Config>),
        manager_(std::move(manager)),
        options_(options) {}

  Manager& operator*() const { return *manager_; }
  Manager* operator->() const { return manager_.get(); }

  void registerFiber(const Objects& fiber, FiberEnds ends = FiberEnds::kOpen,
                     FiberGroup group = {}) {
    manager_->registerFiber(fiber, ends, group);
    this->remember(fiber);
    this->fibers_.push_back(fiber);
    this->ends_.push_back(ends);
    this->groups_.push_back(group.number);
  }
  /// Every fiber of the scene, and then what is in none. The first fibers have the groups.
  void registerFibers(const Scene<S>& scene, const std::vector<int>& groups = {}) {
    const std::size_t fibers = scene.fibers().size();
    for (std::size_t f = 0; f < fibers; ++f) {
      registerFiber(scene.fibers()[f], scene.ends()[f],
                    FiberGroup{f < groups.size() ? groups[f] : 0});
    }
    this->registerEach(scene.loose());
  }
  /// A clone whose objects stand for those of this one.
  Managed clone(const Objects& objects) const {
    auto made = cloneOf<S>(*manager_, objects);
    Managed clone(std::unique_ptr<Manager>(&dynamic_cast<Manager&>(*made.release())), options_);
    clone.rememberAs(*this, objects);
    return clone;
  }

 private:
  std::unique_ptr<Manager> manager_;
  FiberManagerOptions options_;
};

}  // namespace fcl_fibers::test
