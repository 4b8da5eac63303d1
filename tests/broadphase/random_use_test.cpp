// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "support/distance_search.h"
#include "support/managers_under_test.h"
#include "support/pair_oracle.h"
#include "support/pair_queries.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

// One program after another, each a random sequence of everything that a user may do, and the
// oracle asked after each step.
template <typename Config>
class RandomUse : public testing::Test {
 protected:
  using S = typename Config::Scalar;
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;

  void begin(std::uint64_t seed) {
    random_ = Random(seed);
    options_ = {};
    options_.report = random_.unit() < 0.5 ? Report::kVolumes : Report::kCapsules;
    options_.margin = random_.unit() < 0.5 ? 0 : 0.05;
    options_.ignored_neighbors = static_cast<int>(random_.below(4));
    const double offset = random_.unit() < 0.5 ? 0 : std::pow(10.0, random_.between(0, 5));
    const Placement placement{Eigen::Vector3d(offset, -offset, offset / 2), 1};
    scene_ = unequalScene<S>(seed, placement);
    addShapes(scene_, random_.below(12), 0.4, seed + 1, placement);
    if (random_.unit() < 0.3) scene_.addHalfspace({0, 0, 1}, offset / 2 - 0.5);
    probes_ = soupScene<S>(6, 1, seed + 2, placement);
    addShapes(probes_, 5, 0.4, seed + 3, placement);
    manager_ = Config::make(options_);
    other_ = Config::make(options_);
    other_->registerObjects(probes_.objects());
    inside_.clear();
    fibers_.clear();
    // The long fibers come as fibers, the others lie ready one by one.
    outside_.clear();
    waiting_.clear();
    Objects in_fibers;
    for (const Objects& fiber : scene_.fibers()) {
      in_fibers.insert(in_fibers.end(), fiber.begin(), fiber.end());
      if (fiber.size() > 4) {
        waiting_.push_back(fiber);
      } else {
        outside_.insert(outside_.end(), fiber.begin(), fiber.end());
      }
    }
    for (Object* object : scene_.objects()) {
      if (std::find(in_fibers.begin(), in_fibers.end(), object) == in_fibers.end()) {
        outside_.push_back(object);
      }
    }
  }

  void take(Objects& from, std::size_t i) {
    inside_.push_back(from[i]);
    from.erase(from.begin() + static_cast<std::ptrdiff_t>(i));
  }

  std::string step() {
    switch (random_.below(9)) {
      case 0:
      case 1: {
        if (waiting_.empty()) return "nothing";
        const Objects fiber = waiting_.back();
        waiting_.pop_back();
        inside_.insert(inside_.end(), fiber.begin(), fiber.end());
        if (random_.unit() < 0.3) {
          manager_->registerObjects(fiber);
          return "registerObjects";
        }
        manager_->registerFiber(fiber);
        fibers_.push_back(fiber);
        return "registerFiber";
      }
      case 2:
      case 3: {
        if (outside_.empty()) return "nothing";
        const std::size_t i = random_.below(outside_.size());
        manager_->registerObject(outside_[i]);
        take(outside_, i);
        return "registerObject";
      }
      case 4: {
        if (inside_.empty()) return "nothing";
        const std::size_t i = random_.below(inside_.size());
        Object* object = inside_[i];
        manager_->unregisterObject(object);
        inside_.erase(inside_.begin() + static_cast<std::ptrdiff_t>(i));
        outside_.push_back(object);
        for (Objects& fiber : fibers_) {
          std::replace(fiber.begin(), fiber.end(), object, static_cast<Object*>(nullptr));
        }
        return "unregisterObject";
      }
      case 5: {
        const double distance = std::pow(10.0, random_.between(-4, 0));
        for (Object* object : inside_) jolt(*object, random_, distance, 0.3);
        manager_->update();
        return "update()";
      }
      case 6: {
        if (inside_.empty()) return "nothing";
        Objects moved;
        for (std::size_t i = random_.below(10); i > 0; --i) {
          moved.push_back(inside_[random_.below(inside_.size())]);
          jolt(*moved.back(), random_, 0.5, 1);
        }
        manager_->update(moved);
        return "update(objects)";
      }
      case 7: {
        if (inside_.empty()) return "nothing";
        Object* object = inside_[random_.below(inside_.size())];
        jolt(*object, random_, 0.5, 1);
        manager_->update(object);
        return "update(object)";
      }
      default:
        manager_->setup();
        return "setup";
    }
  }

  void check() {
    Objects all = scene_.objects();
    all.insert(all.end(), probes_.objects().begin(), probes_.objects().end());
    const PairOracle<S> oracle(all, rulesOf<Config>(options_), fibers_);
    EXPECT_EQ(objectsOf<S>(*manager_), inside_);
    const Calls<S> pairs = selfPairs<S>(*manager_);
    EXPECT_TRUE(oracle.answersSelf(pairs, inside_));
    EXPECT_EQ(manager_->selfCollisionStatistics().pairs, pairs.size());
    Object* probe = probes_[random_.below(probes_.size())];
    EXPECT_TRUE(oracle.answersBetween(pairsWith<S>(*manager_, *probe), inside_, {probe}));
    EXPECT_TRUE(
        oracle.answersBetween(pairsWith<S>(*manager_, *other_), inside_, probes_.objects()));
    EXPECT_TRUE(
        oracle.answersBetween(pairsWith<S>(*other_, *manager_), probes_.objects(), inside_));
    if (!inside_.empty()) {
      Object* one = inside_[random_.below(inside_.size())];
      EXPECT_TRUE(oracle.answersBetween(pairsWith<S>(*manager_, *one), inside_, {one}));
      EXPECT_TRUE(distanceIsRight(oracle, oracle.smallestDistance(inside_, {one}),
                                  [&](auto& search) { search.run(*manager_, *one); }));
    }
    EXPECT_TRUE(distanceIsRight(oracle, oracle.smallestDistance(inside_),
                                [&](auto& search) { search.run(*manager_); }));
    EXPECT_TRUE(distanceIsRight(oracle, oracle.smallestDistance(inside_, probes_.objects()),
                                [&](auto& search) { search.run(*manager_, *other_); }));
  }

  template <typename Run>
  testing::AssertionResult distanceIsRight(const PairOracle<S>& oracle, S smallest, Run run) {
    DistanceSearch<S> search(oracle);
    run(search);
    if (const auto rules = search.keepsToTheRules(); !rules) return rules;
    if (smallest > 0 ? search.result() == smallest : search.result() <= 0) {
      return testing::AssertionSuccess();
    }
    return testing::AssertionFailure()
           << "found distance " << search.result() << " instead of " << smallest;
  }

  Random random_{0};
  FiberManagerOptions options_;
  Scene<S> scene_;
  Scene<S> probes_;
  decltype(Config::make()) manager_;
  decltype(Config::make()) other_;
  Objects inside_;
  Objects outside_;
  std::vector<Objects> waiting_;
  std::vector<Objects> fibers_;
};
TYPED_TEST_SUITE(RandomUse, FiberManagers, ManagerNames);

// Some combination of calls that nobody thought of would leave the manager wrong.
TYPED_TEST(RandomUse, AnswersAreRightAfterEveryStep) {
  for (std::uint64_t seed = 1000; seed < 1010; ++seed) {
    this->begin(seed);
    std::string history;
    for (int step = 0; step < 25; ++step) {
      history += " " + this->step();
      SCOPED_TRACE("seed " + std::to_string(seed) + ", " + describe(this->options_) + ":" +
                   history);
      this->check();
      if (this->HasFailure()) return;
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::test
