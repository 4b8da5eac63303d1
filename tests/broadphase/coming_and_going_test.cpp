// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include "support/distance_search.h"
#include "support/managers_under_test.h"
#include "support/pair_oracle.h"
#include "support/pair_queries.h"
#include "support/random.h"
#include "support/scene_generators.h"

// Few objects that come and go beside many that stay: the tree is not built anew for them, and
// every answer has to be as if it were.

namespace fcl_fibers::test {
namespace {

template <typename S>
using Objects = std::vector<fcl::CollisionObject<S>*>;

/// A manager, and what is in it.
template <typename Config>
struct Managed {
  using S = typename Config::Scalar;

  explicit Managed(const FiberManagerOptions& manager_options)
      : options(manager_options), manager(Config::make(manager_options)) {}

  void registerFiber(const Objects<S>& fiber) {
    manager->registerFiber(fiber);
    fibers.push_back(fiber);
    objects.insert(objects.end(), fiber.begin(), fiber.end());
  }
  void registerObject(fcl::CollisionObject<S>* object) {
    manager->registerObject(object);
    objects.push_back(object);
  }
  void unregister(std::size_t i) {
    manager->unregisterObject(objects[i]);
    objects.erase(objects.begin() + static_cast<std::ptrdiff_t>(i));
  }
  PairOracle<S> oracle() const { return {objects, rulesOf<Config>(options), fibers}; }

  FiberManagerOptions options;
  std::unique_ptr<typename Config::Manager> manager;
  Objects<S> objects;
  std::vector<Objects<S>> fibers;
};

/// All of FCL's queries against brute force.
template <typename Config>
void expectAnswers(const Managed<Config>& managed, const Managed<Config>& other) {
  using S = typename Config::Scalar;
  const PairOracle<S> oracle = managed.oracle();
  EXPECT_TRUE(oracle.answersSelf(selfPairs(*managed.manager), managed.objects));
  DistanceSearch<S> search(oracle);
  search.run(*managed.manager);
  EXPECT_TRUE(search.keepsToTheRules());
  EXPECT_EQ(std::max(search.result(), S(0)),
            std::max(oracle.smallestDistance(managed.objects), S(0)));

  Objects<S> all = managed.objects;
  all.insert(all.end(), other.objects.begin(), other.objects.end());
  const PairOracle<S> both(all, rulesOf<Config>(managed.options), managed.fibers);
  EXPECT_TRUE(both.answersBetween(pairsWith(*managed.manager, *other.manager), managed.objects,
                                  other.objects));
  EXPECT_TRUE(both.answersBetween(pairsWith(*other.manager, *managed.manager), other.objects,
                                  managed.objects));
  DistanceSearch<S> between(both);
  between.run(*managed.manager, *other.manager);
  EXPECT_EQ(std::max(between.result(), S(0)),
            std::max(both.smallestDistance(managed.objects, other.objects), S(0)));

  for (std::size_t i = 0; i < all.size(); i += 7) {
    EXPECT_TRUE(
        both.answersBetween(pairsWith(*managed.manager, *all[i]), managed.objects, {all[i]}))
        << "object " << i;
    DistanceSearch<S> nearest(both);
    nearest.run(*managed.manager, *all[i]);
    EXPECT_EQ(std::max(nearest.result(), S(0)),
              std::max(both.smallestDistance(managed.objects, {all[i]}), S(0)))
        << "object " << i;
  }
}

template <typename Config>
class ComingAndGoing : public testing::Test {};
TYPED_TEST_SUITE(ComingAndGoing, FiberManagers, ManagerNames);

// What came late, or has gone, would be missed or answered for.
TYPED_TEST(ComingAndGoing, AnswersAreThoseOfANewTree) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(12, 16, 301);
  const std::vector<Objects<S>> strands = scene.fibers();
  const Objects<S> curl =
      scene.addFiber({{-0.5, 0, 0}, {0, 0.3, 0}, {0.2, -0.1, 0.4}, {0, 0, 0}}, 0.03);
  const std::vector<fcl::CollisionObject<S>*> shapes = {
      scene.addHalfspace({0, 0, 1}, -0.4), scene.addSphere({0.1, 0.1, 0}, 0.1),
      scene.addPlane({1, 0, 0}, 0.3), scene.addMesh({0, 0, 0.2}, 0.15)};
  Scene<S> other_scene = strandScene<S>(6, 9, 302);
  other_scene.addHalfspace({0, 1, 0}, -0.6);

  for (FiberManagerOptions options : optionsToTest<TypeParam>(0.02)) {
    options.ignored_neighbors = 1;
    SCOPED_TRACE(describe(options));
    Managed<TypeParam> managed(options), other(options);
    for (const auto& fiber : strands) managed.registerFiber(fiber);
    for (fcl::CollisionObject<S>* object : other_scene.objects()) other.registerObject(object);
    managed.manager->setup();
    other.manager->setup();

    managed.registerFiber(curl);
    for (fcl::CollisionObject<S>* shape : shapes) managed.registerObject(shape);
    for (const std::size_t i : {190u, 100u, 41u, 40u, 0u}) managed.unregister(i);
    other.unregister(20);
    expectAnswers(managed, other);

    SCOPED_TRACE("after a motion");
    Random random(303);
    for (fcl::CollisionObject<S>* object : managed.objects) jolt(*object, random, 0.02, 0.1);
    managed.manager->update();
    expectAnswers(managed, other);
    for (const std::size_t i : {3u, 180u}) jolt(*managed.objects[i], random, 0.02, 0.1);
    managed.manager->update({managed.objects[3], managed.objects[180], curl[1]});
    expectAnswers(managed, other);

    SCOPED_TRACE("after some have gone again");
    managed.unregister(managed.objects.size() - 2);
    managed.unregister(managed.objects.size() - 4);
    expectAnswers(managed, other);
  }
}

// One object that comes and goes each frame would cost a tree, or make the manager grow.
TYPED_TEST(ComingAndGoing, OneMayComeAndGoForever) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(12, 16, 304);
  Managed<TypeParam> managed{FiberManagerOptions()};
  for (const auto& fiber : scene.fibers()) managed.registerFiber(fiber);
  managed.manager->setup();
  const std::size_t before = managed.manager->memoryUsage();
  for (int frame = 0; frame < 1000; ++frame) {
    fcl::CollisionObject<S>* const one = managed.objects[static_cast<std::size_t>(frame) % 97];
    managed.unregister(static_cast<std::size_t>(frame) % 97);
    managed.registerObject(one);
    if (frame % 50 == 0) {
      const PairOracle<S> oracle = managed.oracle();
      EXPECT_TRUE(oracle.answersBetween(pairsWith(*managed.manager, *one), managed.objects, {one}));
    }
  }
  EXPECT_TRUE(managed.oracle().answersSelf(selfPairs(*managed.manager), managed.objects));
  EXPECT_LT(managed.manager->memoryUsage(), 8 * before);
}

// Objects would count where they are without an update that names them, and a broken one would be
// held against the update of another.
TYPED_TEST(ComingAndGoing, ALateObjectIsReadAgainWhereAnUpdateNamesIt) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(12, 16, 301);
  const Objects<S> most = scene.objects();
  fcl::CollisionObject<S>* late = scene.addCapsule({0, 0, 0}, {0, 0, 0.1}, 0.05);
  const auto manager = TypeParam::make();
  manager->registerObjects(most);
  manager->setup();
  manager->registerObject(late);
  const auto with_it = [&] {
    const Calls<S> pairs = selfPairs(*manager);
    return std::count_if(pairs.begin(), pairs.end(), [&](const auto& pair) {
      return pair.first == late || pair.second == late;
    });
  };
  const auto before = with_it();
  EXPECT_GT(before, 0);
  late->setTranslation(fcl::Vector3<S>(100, 100, 100));
  manager->update(most[3]);
  EXPECT_EQ(with_it(), before);
  late->setTranslation(fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN()));
  manager->update(most[3]);
  EXPECT_EQ(with_it(), before);
  late->setTranslation(fcl::Vector3<S>(100, 100, 100));
  manager->update({most[3], late});
  EXPECT_EQ(with_it(), 0);
}

// Nobody could mend what is not there any more.
TYPED_TEST(ComingAndGoing, AnEmptyManagerHasNothingToRefuse) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(2, 8, 5);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  const fcl::Vector3<S> place = scene[3]->getTranslation();
  scene[3]->setTranslation(fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN()));
  EXPECT_THROW(manager->update(), std::invalid_argument);
  EXPECT_THROW(selfPairs(*manager), std::invalid_argument);
  for (fcl::CollisionObject<S>* object : scene.objects()) manager->unregisterObject(object);
  EXPECT_TRUE(selfPairs(*manager).empty());
  scene[3]->setTranslation(place);
  manager->registerObjects(scene.objects());
  EXPECT_FALSE(selfPairs(*manager).empty());
}

// An object that cannot be read would be passed over in silence.
TYPED_TEST(ComingAndGoing, ALateObjectThatHasGoneBadIsNamed) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(12, 16, 305);
  Managed<TypeParam> managed{FiberManagerOptions()};
  for (const auto& fiber : scene.fibers()) managed.registerFiber(fiber);
  managed.manager->setup();
  fcl::CollisionObject<S>* const late = scene.addCapsule({0, 0, 0}, {0, 0, 1}, 0.1);
  managed.registerObject(late);
  const auto pose = late->getTransform();
  auto bad = pose;
  bad.translation().x() = std::numeric_limits<S>::quiet_NaN();
  late->setTransform(bad);
  EXPECT_THROW(managed.manager->update(), std::invalid_argument);
  EXPECT_THROW(selfPairs(*managed.manager), std::invalid_argument);
  late->setTransform(pose);
  managed.manager->update();
  EXPECT_TRUE(managed.oracle().answersSelf(selfPairs(*managed.manager), managed.objects));
}

}  // namespace
}  // namespace fcl_fibers::test
