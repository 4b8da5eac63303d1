// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <future>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/managed.h"
#include "support/process_threads.h"
#include "support/scene_generators.h"
#include "support/text_of.h"

namespace fcl_fibers::test {
namespace {

/// Not those of FiberManagers, so that with these all of ours are asked for something.
using Managers = testing::Types<
    LayeredAabb<double, Topology::kBundle>, LayeredAabb<float, Topology::kSuperThread>,
    WrappedSphere<float, Topology::kBundle>, WrappedSphere<double, Topology::kSuperThread>>;

constexpr int kThreads[] = {1, 2, 3, 8};

// More objects than one task reads, so that they are read by several threads.
template <typename Config>
class Threads : public testing::Test {
 protected:
  using S = typename Config::Scalar;

  Threads() : hair_(strandScene<S>(48, 100, 151)), scarf_(strandScene<S>(12, 40, 152)) {
    hair_.addSphere({0, 0, 0}, 0.1);
    hair_.addBox({0.1, 0, 0.5}, Eigen::Quaterniond::Identity(), {0.2, 0.2, 0.2});
    hair_.addHalfspace({0, 0, 1}, -0.98);
  }

  static FiberManagerOptions options(int threads, Report report = Report::kCapsules) {
    FiberManagerOptions options;
    options.threads = threads;
    options.report = report;
    options.margin = 0.001;
    options.ignored_neighbors = 1;
    return options;
  }

  Managed<Config> managerOf(const Scene<S>& scene, const FiberManagerOptions& options) {
    Managed<Config> manager(options);
    manager.registerFibers(scene);
    return manager;
  }

  Scene<S> hair_, scarf_;
};
TYPED_TEST_SUITE(Threads, Managers, ManagerNames);

// The number of threads would show in the answer, or what stands beside the tree come earlier.
TYPED_TEST(Threads, PairsAndTheirOrderAreTheSameWithAnyNumber) {
  using S = typename TypeParam::Scalar;
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    const Scene<S>& hair = this->hair_;
    std::vector<Managed<TypeParam>> managers;
    for (const int threads : kThreads) {
      managers.push_back(this->managerOf(hair, this->options(threads, report)));
    }
    const auto scarf = this->managerOf(this->scarf_, this->options(2, report));
    Random random(153);
    for (int step = 0; step < 2; ++step) {
      SCOPED_TRACE(describe(this->options(1, report)) + ", step " + std::to_string(step));
      const Calls<S> self = selfPairs<S>(*managers[0]);
      const Calls<S> between = pairsWith<S>(*managers[0], *scarf);
      EXPECT_GT(self.size(), hair.size());
      EXPECT_GT(between.size(), hair.size());
      for (const auto& manager : managers) {
        EXPECT_TRUE(selfPairs<S>(*manager) == self);
        EXPECT_TRUE(pairsWith<S>(*manager, *scarf) == between);
      }
      jolt(hair.objects(), random, 0.01, 0.05);
      for (const auto& manager : managers) manager->update();
    }
  }
}

/// Notes on which threads it was called.
template <typename S>
struct CallerCheck {
  std::thread::id caller = std::this_thread::get_id();
  std::size_t calls = 0, elsewhere = 0;

  static bool collide(fcl::CollisionObject<S>*, fcl::CollisionObject<S>*, void* data) {
    auto& self = *static_cast<CallerCheck*>(data);
    ++self.calls;
    self.elsewhere += std::this_thread::get_id() != self.caller;
    return false;
  }
};

// Callbacks, written for one thread, would race.
TYPED_TEST(Threads, CallbacksRunOnTheCallersThread) {
  using S = typename TypeParam::Scalar;
  const auto manager = this->managerOf(this->hair_, this->options(8));
  const auto scarf = this->managerOf(this->scarf_, this->options(3));
  CallerCheck<S> check;
  manager->collide(&check, &CallerCheck<S>::collide);
  manager->collide(&*scarf, &check, &CallerCheck<S>::collide);
  EXPECT_GT(check.calls, 1000u);
  EXPECT_EQ(check.elsewhere, 0u);
}

// Whoever wants the first contact would be called again.
TYPED_TEST(Threads, TrueEndsTheQueryAtOnce) {
  using S = typename TypeParam::Scalar;
  const auto scarf = this->managerOf(this->scarf_, this->options(2));
  for (const int threads : {2, 8}) {
    const auto manager = this->managerOf(this->hair_, this->options(threads));
    const Calls<S> all = selfPairs<S>(*manager);
    const Calls<S> all_between = pairsWith<S>(*manager, *scarf);
    for (const std::size_t stop :
         {std::size_t{1}, std::size_t{2}, std::size_t{17}, all.size() - 1, all.size()}) {
      PairCollector<S> some;
      some.stop_at = stop;
      manager->collide(&some, &PairCollector<S>::collide);
      ASSERT_EQ(some.calls.size(), stop);
      EXPECT_TRUE(std::equal(some.calls.begin(), some.calls.end(), all.begin()));
    }
    PairCollector<S> between;
    between.stop_at = all_between.size() / 2;
    manager->collide(&*scarf, &between, &PairCollector<S>::collide);
    ASSERT_EQ(between.calls.size(), between.stop_at);
    EXPECT_TRUE(std::equal(between.calls.begin(), between.calls.end(), all_between.begin()));
  }
}

// An exception on its way through a query would leave workers behind, or the manager locked.
TYPED_TEST(Threads, ACallbackMayThrow) {
  using S = typename TypeParam::Scalar;
  const auto manager = this->managerOf(this->hair_, this->options(3));
  const auto scarf = this->managerOf(this->scarf_, this->options(1));
  const Calls<S> all = selfPairs<S>(*manager);
  for (const std::size_t at : {std::size_t{1}, all.size() / 2, all.size()}) {
    PairCollector<S> thrower;
    thrower.throw_at = at;
    EXPECT_THROW(manager->collide(&thrower, &PairCollector<S>::collide), CallbackError);
    EXPECT_EQ(thrower.calls.size(), at);
    EXPECT_TRUE(selfPairs<S>(*manager) == all);
    EXPECT_NO_THROW(manager->update());
    EXPECT_TRUE(selfPairs<S>(*manager) == all);
  }
  PairCollector<S> thrower;
  thrower.throw_at = 3;
  EXPECT_THROW(manager->collide(&*scarf, &thrower, &PairCollector<S>::collide), CallbackError);
  EXPECT_NO_THROW(scarf->update());
  EXPECT_TRUE(selfPairs<S>(*manager) == all);
}

// The error would be the object's that some thread came across first.
TYPED_TEST(Threads, OfBrokenObjectsTheFirstIsNamed) {
  using S = typename TypeParam::Scalar;
  const std::size_t before = this->hair_.size();
  const auto manager = this->managerOf(this->hair_, this->options(3));
  const Calls<S> all = selfPairs<S>(*manager);
  ASSERT_GT(before, 4500u);
  std::vector<std::pair<std::size_t, fcl::Transform3<S>>> good;
  for (const std::size_t i : {std::size_t{4500}, std::size_t{4100}, std::size_t{4099}}) {
    good.emplace_back(i, this->hair_[i]->getTransform());
    fcl::Transform3<S> bad = good.back().second;
    bad.translation().x() = std::numeric_limits<S>::quiet_NaN();
    this->hair_[i]->setTransform(bad);
  }
  expectRefusal([&] { manager->update(); }, "4099");
  for (const auto& [i, pose] : good) this->hair_[i]->setTransform(pose);
  manager->update();
  EXPECT_TRUE(selfPairs<S>(*manager) == all);
}

// A fiber would be cut where another thread goes on, or what stands among fibers be mixed up.
TYPED_TEST(Threads, ManyAreRegisteredAtOnceByAnyNumber) {
  using S = typename TypeParam::Scalar;
  Scene<S> posts;
  typename Managed<TypeParam>::Objects loose, fiber;
  std::vector<std::size_t> numbers;
  for (const auto& strand : this->hair_.fibers()) {
    fiber.insert(fiber.end(), strand.begin(), strand.end());
    loose.insert(loose.end(), strand.begin(), strand.end());
    for (std::size_t i = 0; i < strand.size(); ++i) numbers.push_back(i);
    const double height = 0.04 * static_cast<double>(posts.size()) - 1;
    loose.push_back(posts.addBox({0, 0, height}, Eigen::Quaterniond::Identity(), {0.1, 0.1, 0.02}));
    if (posts.size() % 8 == 1) loose.push_back(posts.addHalfspace({0, 0, 1}, height));
    numbers.resize(loose.size(), 0);
  }
  std::vector<Calls<S>> of_loose, of_fiber;
  for (const int threads : kThreads) {
    SCOPED_TRACE(threads);
    Managed<TypeParam> manager(this->options(threads));
    manager.registerObjects(loose);
    for (std::size_t i = 0; i < loose.size(); ++i) {
      ASSERT_EQ(manager->fiberSegment(loose[i]).number, numbers[i]) << i;
    }
    of_loose.push_back(selfPairs<S>(*manager));
    EXPECT_TRUE(of_loose.back() == of_loose.front());

    Managed<TypeParam> of_one(this->options(threads));
    of_one.registerFiber(fiber);
    for (std::size_t i = 0; i < fiber.size(); ++i) {
      ASSERT_EQ(of_one->fiberSegment(fiber[i]).number, i);
    }
    of_fiber.push_back(selfPairs<S>(*of_one));
    EXPECT_TRUE(of_fiber.back() == of_fiber.front());
  }
  EXPECT_GT(of_loose[0].size(), of_fiber[0].size());
  EXPECT_GT(of_fiber[0].size(), fiber.size());
}

// The error would be of the object that some thread came across first, or half of a call would
// stay.
TYPED_TEST(Threads, OfManyNewObjectsTheFirstThatIsRefusedIsNamed) {
  using S = typename TypeParam::Scalar;
  using Objects = typename Managed<TypeParam>::Objects;
  Objects good = this->hair_.objects();
  fcl::CollisionObject<S>* const sphere = good[4800];
  good.resize(4800);
  Scene<S> others = soupScene<S>(1, 0.3, 155);
  fcl::Transform3<S> nowhere = others[0]->getTransform();
  nowhere.translation().x() = std::numeric_limits<S>::quiet_NaN();
  others[0]->setTransform(nowhere);

  std::vector<Managed<TypeParam>> managers;
  for (const int threads : kThreads) {
    managers.emplace_back(this->options(threads));
    managers.back().registerFiber(this->scarf_.fibers()[0]);
  }
  using Places = std::vector<std::pair<std::size_t, fcl::CollisionObject<S>*>>;
  const auto expectRefused = [&](const Places& bad, const std::string& text,
                                 bool as_fiber = false) {
    Objects objects = good;
    for (const auto& [place, object] : bad) objects[place] = object;
    for (const auto& manager : managers) {
      SCOPED_TRACE(text);
      expectRefusal([&] { manager->registerFiber(objects); }, "registerFiber: object " + text);
      if (!as_fiber) {
        expectRefusal([&] { manager->registerObjects(objects); },
                      "registerObjects: object " + text);
      }
      EXPECT_EQ(manager->size(), this->scarf_.fibers()[0].size());
    }
  };
  expectRefused({{4100, nullptr}, {1030, nullptr}}, "1030 is null");
  expectRefused({{4799, others[0]}, {512, others[0]}}, "512: its pose is NaN");
  expectRefused({{511, others[0]}, {512, nullptr}}, "511: its pose is NaN");
  expectRefused({{3000, nullptr}, {2999, sphere}}, "2999 is not a capsule", /*as_fiber=*/true);
  expectRefused({{4000, good[0]}, {3000, good[4799]}, {100, good[3500]}},
                "3500 is registered already");
  expectRefused({{4000, good[1]}, {3990, good[1]}, {2, good[1]}}, "2 is registered already");
  expectRefused({{2000, this->scarf_[0]}, {2500, good[0]}}, "2000 is registered already");
  // Nothing of those calls has stayed.
  for (const auto& manager : managers) {
    manager->registerFiber(good);
    EXPECT_EQ(manager->fiberSegment(good[4799]).fiber, 1u);
    EXPECT_TRUE(selfPairs<S>(*manager) == selfPairs<S>(*managers[0]));
  }
}

// Two of the user's own threads would disturb each other, the more so in the first query, which
// builds the tree.
TYPED_TEST(Threads, SeveralOfTheUsersMayQueryAtOnce) {
  using S = typename TypeParam::Scalar;
  const auto scarf = this->managerOf(this->scarf_, this->options(2));
  const Calls<S> expected = selfPairs<S>(*this->managerOf(this->hair_, this->options(1)));
  const Calls<S> expected_between =
      pairsWith<S>(*this->managerOf(this->hair_, this->options(1)), *scarf);
  for (const int threads : {1, 3}) {
    const auto manager = this->managerOf(this->hair_, this->options(threads));  // not built yet
    std::vector<Calls<S>> self(4), between(4);
    std::vector<std::thread> users;
    for (std::size_t user = 0; user < 4; ++user) {
      users.emplace_back([&, user] {
        if (user % 2 == 1) between[user] = pairsWith<S>(*manager, *scarf);
        self[user] = selfPairs<S>(*manager);
        if (user % 2 == 0) between[user] = pairsWith<S>(*manager, *scarf);
      });
    }
    for (std::thread& user : users) user.join();
    for (std::size_t user = 0; user < 4; ++user) {
      EXPECT_TRUE(self[user] == expected) << "user " << user;
      EXPECT_TRUE(between[user] == expected_between) << "user " << user;
    }
  }
}

// The tree would change below another thread's query.
TYPED_TEST(Threads, ChangesDuringTheQueryOfAnotherThreadAreRefused) {
  using S = typename TypeParam::Scalar;
  const auto manager = this->managerOf(this->scarf_, this->options(1));
  Scene<S> others = soupScene<S>(1, 0.3, 154);
  struct Waiting {
    std::promise<void> has_begun, may_end;
    static bool collide(fcl::CollisionObject<S>*, fcl::CollisionObject<S>*, void* data) {
      auto& self = *static_cast<Waiting*>(data);
      self.has_begun.set_value();
      self.may_end.get_future().wait();
      return true;
    }
  } waiting;
  std::thread user([&] { manager->collide(&waiting, &Waiting::collide); });
  waiting.has_begun.get_future().wait();
  EXPECT_THROW(manager->update(), std::invalid_argument);
  EXPECT_THROW(manager->update(manager[0]), std::invalid_argument);
  EXPECT_THROW(manager->update({manager[0]}), std::invalid_argument);
  EXPECT_THROW(manager->clear(), std::invalid_argument);
  EXPECT_THROW(manager->registerObject(others[0]), std::invalid_argument);
  EXPECT_THROW(manager->unregisterObject(manager[0]), std::invalid_argument);
  waiting.may_end.set_value();
  user.join();
  EXPECT_NO_THROW(manager->update());
  EXPECT_TRUE(manager.answersSelf());
}

// A program that may have no other threads would get some.
TYPED_TEST(Threads, AreOnlyMadeIfAskedFor) {
  using S = typename TypeParam::Scalar;
  const auto threadsMadeBy = [&](int threads) {
    const std::size_t before = threadsOfThisProcess();
    const auto manager = this->managerOf(this->hair_, this->options(threads));
    const auto scarf = this->managerOf(this->scarf_, this->options(threads));
    selfPairs<S>(*manager);
    pairsWith<S>(*manager, *scarf);
    pairsWith<S>(*manager, *this->scarf_[0]);
    manager->distance(nullptr, [](auto*, auto*, void*, S&) { return true; });
    manager->update();
    return static_cast<int>(threadsOfThisProcess() - before);
  };
  // In processes of their own, started anew, because threads of other tests stay.
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(std::exit(threadsMadeBy(1)), testing::ExitedWithCode(0), "");
  // oneTBB makes none where there is one processor.
  if (processorsOfThisProcess() == 1) return;
  EXPECT_EXIT(std::exit(threadsMadeBy(2) > 0 ? 0 : 1), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace fcl_fibers::test
