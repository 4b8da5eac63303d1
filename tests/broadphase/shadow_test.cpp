// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/shadow_manager.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

#include "support/managers_under_test.h"
#include "support/pair_queries.h"
#include "support/random.h"
#include "support/scalars.h"
#include "support/scene.h"

namespace fcl_fibers::test {
namespace {

using testing::HasSubstr;

ShadowOptions withoutFile() {
  ShadowOptions options;
  options.file.clear();
  return options;
}

/// A path of this process alone, as shards and builds run at once. The file goes with the process.
std::string temporary(const std::string& name) {
  struct Files : std::vector<std::string> {
    ~Files() {
      for (const std::string& path : *this) std::filesystem::remove(path);
    }
  };
  static Files files;
  files.push_back(testing::TempDir() + "shadow_test_" + std::to_string(getpid()) + "_" + name);
  std::filesystem::remove(files.back());
  return files.back();
}

std::string contentOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// One of each kind of shape, close together, and a fiber among them.
template <typename S>
void fill(Scene<S>& scene, std::uint64_t seed, bool has_planes = false) {
  Random random(seed);
  const auto pose = [&] { return makePose<S>(random.rotation(), random.inCube(0.6)); };
  for (int i = 0; i < 3; ++i) {
    scene.addSphere(random.inCube(0.6), 0.2);
    scene.addCapsule(pose(), 0.1, 0.5);
    scene.addBox(random.inCube(0.6), random.rotation(), {0.2, 0.3, 0.4});
    scene.add(std::make_shared<fcl::Cylinder<S>>(S(0.2), S(0.4)), pose());
    scene.add(std::make_shared<fcl::Cone<S>>(S(0.2), S(0.4)), pose());
    scene.add(std::make_shared<fcl::Ellipsoid<S>>(S(0.2), S(0.3), S(0.1)), pose());
    scene.addConvex(random.inCube(0.6), 0.3);
    scene.addMesh(random.inCube(0.6), 0.3);
    scene.addOctree(random.inCube(0.6), 0.2);
  }
  if (has_planes) {
    scene.addHalfspace({0, 0, 1}, -0.4);
    scene.addPlane({0, 1, 0.5}, 0.1);
  }
  std::vector<Eigen::Vector3d> points{random.inCube(0.5)};
  for (int i = 0; i < 12; ++i) points.push_back(points.back() + 0.2 * random.direction());
  scene.addFiber(points, 0.05);
}

/// What a program's distance callback may be: distances of the centres.
template <typename S>
struct CenterSearch {
  Calls<S> calls;
  std::vector<S> given;

  static bool visit(fcl::CollisionObject<S>* a, fcl::CollisionObject<S>* b, void* data, S& dist) {
    auto& self = *static_cast<CenterSearch*>(data);
    self.calls.emplace_back(a, b);
    self.given.push_back(dist);
    dist = std::min(dist, S((a->getTranslation() - b->getTranslation()).norm()));
    return false;
  }
};

/// Ours with one planted fault.
template <typename S>
class Faulty final : public LayeredAABBTreeCollisionManager<S> {
 public:
  enum class Fault { kLoses, kRepeats, kInvents, kPairsItself, kThrows, kWrongDistance, kRefuses };
  using Object = fcl::CollisionObject<S>;
  using Base = LayeredAABBTreeCollisionManager<S>;
  using Base::collide;
  using Base::distance;
  using Base::update;

  Faulty(Fault fault, Object* a, Object* b, const FiberManagerOptions& options)
      : Base(options), fault_(fault), a_(a), b_(b) {}

  void collide(void* cdata, fcl::CollisionCallBack<S> callback) const override {
    if (fault_ == Fault::kThrows) throw 7;
    PairCollector<S> all;
    Base::collide(&all, &PairCollector<S>::collide);
    for (const auto& [a, b] : all.calls) {
      const bool is_it = (a == a_ && b == b_) || (a == b_ && b == a_);
      if (is_it && fault_ == Fault::kLoses) continue;
      if (callback(a, b, cdata)) return;
      if (is_it && fault_ == Fault::kRepeats) callback(b, a, cdata);
    }
    if (fault_ == Fault::kInvents) callback(a_, b_, cdata);
    if (fault_ == Fault::kPairsItself) callback(a_, a_, cdata);
  }
  void distance(void* cdata, fcl::DistanceCallBack<S> callback) const override {
    if (fault_ != Fault::kWrongDistance) return Base::distance(cdata, callback);
  }
  void update() override {
    if (fault_ == Fault::kRefuses) throw std::runtime_error("refused");
    Base::update();
  }

 private:
  Fault fault_;
  Object *a_, *b_;
};

template <typename S>
class Shadow : public testing::Test {};
TYPED_TEST_SUITE(Shadow, Scalars, ScalarName);

// A program would see other pairs, another order or another end than with its manager alone.
TYPED_TEST(Shadow, ShowsTheProgramTheFirstManagerAlone) {
  using S = TypeParam;
  Scene<S> scene;
  fill(scene, 4701);
  const auto alone = makeFclTree<S>();
  ShadowManager<S> shadow(makeFclTree<S>(), FiberManagerOptions{}, withoutFile());
  int data = 0;
  scene[0]->setUserData(&data);
  for (auto* const manager : {alone.get(), static_cast<decltype(alone.get())>(&shadow)}) {
    manager->registerObjects(scene.objects());
    manager->setup();
  }
  EXPECT_EQ(shadow.size(), scene.size());
  EXPECT_FALSE(shadow.empty());
  EXPECT_EQ(objectsOf<S>(shadow), objectsOf<S>(*alone));
  EXPECT_EQ(selfPairs<S>(shadow), selfPairs<S>(*alone));
  EXPECT_GT(selfPairs<S>(shadow).size(), 50u);
  EXPECT_EQ(pairsWith<S>(shadow, *scene[3]), pairsWith<S>(*alone, *scene[3]));
  EXPECT_EQ(pairsWith<S>(shadow, shadow), pairsWith<S>(*alone, *alone));
  for (const bool throws : {false, true}) {
    PairCollector<S> expected, found;
    (throws ? expected.throw_at : expected.stop_at) = 7;
    (throws ? found.throw_at : found.stop_at) = 7;
    const auto ask = [&](auto& manager, PairCollector<S>& collector) {
      manager.collide(&collector, &PairCollector<S>::collide);
    };
    if (throws) {
      EXPECT_THROW(ask(*alone, expected), CallbackError);
      EXPECT_THROW(ask(shadow, found), CallbackError);
    } else {
      ask(*alone, expected);
      ask(shadow, found);
    }
    EXPECT_EQ(found.calls, expected.calls);
  }
  CenterSearch<S> expected, found;
  alone->distance(&expected, &CenterSearch<S>::visit);
  shadow.distance(&found, &CenterSearch<S>::visit);
  EXPECT_EQ(found.calls, expected.calls);
  EXPECT_EQ(found.given, expected.given);
  EXPECT_EQ(scene[0]->getUserData(), &data);
  EXPECT_EQ(shadow.result().difference, "");
  EXPECT_EQ(shadow.result().problem, "");
  EXPECT_EQ(shadow.result().queries, 7u);
  EXPECT_GT(shadow.result().second.pairs, 50u);
  EXPECT_GE(shadow.result().second.seconds, 0);
}

// A refusal of the program's own manager would be lost, or be laid to the other one.
TYPED_TEST(Shadow, PassesOnWhatTheFirstManagerRefuses) {
  using S = TypeParam;
  Scene<S> scene;
  fill(scene, 4702);
  ShadowManager<S> shadow(std::make_unique<LayeredAABBTreeCollisionManager<S>>(), makeFclTree<S>(),
                          withoutFile());
  shadow.registerObjects(scene.objects());
  EXPECT_THROW(shadow.registerObject(scene[0]), std::invalid_argument);
  EXPECT_THROW(shadow.collide(nullptr, nullptr), std::invalid_argument);
  EXPECT_EQ(shadow.size(), scene.size());
  selfPairs<S>(shadow);
  EXPECT_EQ(shadow.result().difference, "");
}

FiberManagerOptions withMotion() {
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  options.motion = true;
  return options;
}

// A difference would be found where both managers keep their promises.
TYPED_TEST(Shadow, FindsNoDifferenceWhateverTheOptions) {
  using S = TypeParam;
  for (const bool wraps : {false, true}) {
    std::vector<FiberManagerOptions> all = assortedOptions();
    if (!wraps) all.insert(all.end(), {withMotion(), withMotion()});
    all.back().margin = 0.02;
    for (FiberManagerOptions options : all) {
      for (const Bounds bounds : {Bounds::kShapes, Bounds::kShapesAndMargins, Bounds::kObjects}) {
        options.bounds = bounds;
        SCOPED_TRACE(describe(options));
        Scene<S> scene, others;
        Random random(4703);
        fill(scene, 4704, true);
        fill(others, 4705);
        const auto make = [&]() -> std::unique_ptr<FiberCollisionManager<S>> {
          if (wraps) return makeWrappedSphereTree<S>(options);
          return makeLayeredAabbTree<S>(options);
        };
        // FCL's tree reads what it has not set where it balances boxes without end.
        ShadowManager<S> shadow(makeFclNaive<S>(), make(), withoutFile());
        ShadowManager<S> other(makeFclNaive<S>(), make(), withoutFile());
        for (auto* object : scene.loose()) shadow.registerObject(object);
        for (const auto& fiber : scene.fibers()) shadow.registerFiber(fiber, FiberEnds::kClosed);
        other.registerObjects(others.objects());
        other.registerObject(scene[4]);
        const std::vector<fcl::CollisionObject<S>*> few(scene.objects().begin() + 3,
                                                        scene.objects().begin() + 9);
        for (int step = 0; step < 6; ++step) {
          shadow.setup();
          if (options.motion && step % 3 == 0) shadow.beginStep();
          if (options.motion && step % 2 == 0) other.beginStep();
          selfPairs<S>(shadow);
          pairsWith<S>(shadow, *scene[1]);
          pairsWith<S>(shadow, *others[1]);
          pairsWith<S>(shadow, other);
          pairsWith<S>(shadow, shadow);
          CenterSearch<S> search;
          shadow.distance(&search, &CenterSearch<S>::visit);
          shadow.distance(others[2], &search, &CenterSearch<S>::visit);
          shadow.distance(&other, &search, &CenterSearch<S>::visit);
          // Between these calls objects are where no manager looks for them.
          const auto& moved = step % 2 == 0 ? few : scene.objects();
          for (auto* object : moved) {
            if (object->getNodeType() != fcl::GEOM_PLANE) jolt(*object, random, 0.1, 0.3);
          }
          if (options.motion) {
            jolt(others.objects(), random, 0.1, 0.3);
            other.update();
          }
          // As programs widen boxes: of one sphere evenly, of one capsule on one side.
          auto &even = const_cast<fcl::AABB<S>&>(scene[0]->getAABB()),
               &uneven = const_cast<fcl::AABB<S>&>(scene[1]->getAABB());
          even = fcl::AABB<S>(even, fcl::Vector3<S>::Constant(S(0.1)));
          uneven.max_[0] += S(0.1);
          selfPairs<S>(shadow);
          pairsWith<S>(shadow, *scene[4]);
          if (step == 0) shadow.update(few);
          if (step == 2) {
            for (auto* object : few) shadow.update(object);
          }
          if (step % 2 == 1) shadow.update();
          if (step == 4) {
            for (auto* object : few) shadow.unregisterObject(object);
            shadow.registerObjects(few);
          }
          for (const ShadowManager<S>* manager : {&shadow, &other}) {
            EXPECT_EQ(manager->result().difference, "");
            EXPECT_EQ(manager->result().problem, "");
          }
          EXPECT_EQ(shadow.result().second.pairs > 100, true);
        }
        shadow.clear();
        EXPECT_TRUE(selfPairs<S>(shadow).empty());
        EXPECT_EQ(shadow.result().difference, "");
      }
    }
  }
}

/// Capsules in a row, each of which touches the next one; the last one is far away.
template <typename S>
void fillRow(Scene<S>& scene) {
  for (int i = 0; i < 6; ++i) {
    const double x = i == 5 ? 40 : i;
    scene.addCapsule(Eigen::Vector3d(x, 0, 0), Eigen::Vector3d(x + 1, 0.3, 0), 0.2);
  }
}

// A fault of the manager beside the program's would not be found, or be laid to another pair.
TYPED_TEST(Shadow, FindsEachPlantedFault) {
  using S = TypeParam;
  using Fault = typename Faulty<S>::Fault;
  const std::vector<std::pair<Fault, std::string>> faults = {
      {Fault::kLoses,
       "collideSelf: the second manager does not hand on the pair of the objects 1 "
       "and 2; they touch"},
      {Fault::kRepeats,
       "the second manager hands on more than once the pair of the objects 1 and 2"},
      {Fault::kInvents,
       "the second manager hands on, although it is too far apart, the pair of the "
       "objects 0 and 4"},
      {Fault::kPairsItself, "the second manager invents a pair"},
      {Fault::kThrows, "the second manager throws what is no std::exception"},
      {Fault::kRefuses, "update: the second manager throws: refused"},
      {Fault::kWrongDistance, "distanceSelf: the least distance is "}};
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    for (const auto& [fault, text] : faults) {
      SCOPED_TRACE(text);
      Scene<S> scene;
      fillRow(scene);
      FiberManagerOptions options;
      options.report = report;
      ShadowOptions shadow_options;
      shadow_options.file = temporary("planted.txt");
      int told = 0;
      const ShadowManager<S>* asked = nullptr;
      shadow_options.on_difference = [&](const ShadowResult& result) {
        ++told;
        EXPECT_EQ(asked->result().difference, result.difference);
      };
      const bool invents = fault == Fault::kInvents;
      ShadowManager<S> shadow(makeFclTree<S>(),
                              std::make_unique<Faulty<S>>(fault, scene[invents ? 0 : 1],
                                                          scene[invents ? 4 : 2], options),
                              shadow_options);
      asked = &shadow;
      shadow.registerObjects(scene.objects());
      shadow.setup();
      for (int i = 0; i < 2; ++i) {
        EXPECT_GE(selfPairs<S>(shadow).size(), 4u);
        CenterSearch<S> search;
        shadow.distance(&search, &CenterSearch<S>::visit);
        shadow.update();
      }
      const ShadowResult result = shadow.result();
      EXPECT_THAT(result.difference, HasSubstr(text));
      EXPECT_GE(result.differences, 1u);
      EXPECT_EQ(told, 1);
      EXPECT_EQ(result.problem, "");
      EXPECT_EQ(result.file, shadow_options.file);
      // The fault was planted, so that the real managers agree.
      const ShadowReplay replay = replayRecord(result.file);
      EXPECT_EQ(replay.recorded, result.difference);
      EXPECT_EQ(replay.result.difference, "");
      EXPECT_THAT(replay.managers, HasSubstr("DynamicAABBTree"));
    }
  }
}

// A program that forgets computeAABB() would not hear that it loses pairs today.
TYPED_TEST(Shadow, IsReplayedWithTheSameDifference) {
  using S = TypeParam;
  for (const char* const first : {"tree", "naive"}) {
    Scene<S> scene;
    fillRow(scene);
    ShadowOptions options;
    options.file = temporary("computeAABB.txt");
    ShadowManager<S> shadow(*first == 't' ? makeFclTree<S>() : makeFclNaive<S>(),
                            FiberManagerOptions{}, options);
    shadow.registerObjects(scene.objects());
    selfPairs<S>(shadow);
    EXPECT_EQ(shadow.result().difference, "");
    const auto pose = makePose<S>(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0.2, 0.1));
    scene[5]->setTransform(pose);
    shadow.update();
    selfPairs<S>(shadow);
    const std::string difference = shadow.result().difference;
    EXPECT_THAT(difference, HasSubstr("the first manager does not hand on"));
    EXPECT_THAT(difference, HasSubstr("is computeAABB() missing?"));
    const ShadowReplay replay = replayRecord(shadow.result().file);
    EXPECT_EQ(replay.result.difference, difference);
    EXPECT_EQ(replay.recorded, difference);
    EXPECT_THAT(replay.managers, testing::Not(HasSubstr("in place of")));
  }
}

/// Two capsules side by side, the first of which swaps sides in a step, and one far from both.
template <typename S>
struct Crossing : Scene<S> {
  Crossing() {
    for (const double x : {-2.0, 0.0, 9.0}) {
      this->addCapsule(Eigen::Vector3d(x, 0, 0), Eigen::Vector3d(x, 0.3, 1), 0.2);
    }
  }
  void step(ShadowManager<S>& shadow) {
    shadow.registerObjects(this->objects());
    shadow.beginStep();
    (*this)[0]->setTranslation((*this)[0]->getTranslation() + fcl::Vector3<S>(4, 0, 0));
    (*this)[0]->computeAABB();
    shadow.update();
    selfPairs<S>(shadow);
  }
};

// A pair that touches on the way would be lost or invented unseen.
TYPED_TEST(Shadow, JudgesPairsOfAStep) {
  using S = TypeParam;
  using Fault = typename Faulty<S>::Fault;
  for (const bool invents : {false, true}) {
    Crossing<S> scene;
    ShadowManager<S> shadow(
        makeLayeredAabbTree<S>(withMotion()),
        std::make_unique<Faulty<S>>(invents ? Fault::kInvents : Fault::kLoses, scene[0],
                                    scene[invents ? 2 : 1], withMotion()),
        withoutFile());
    scene.step(shadow);
    EXPECT_THAT(shadow.result().difference, HasSubstr(invents ? "too far apart" : "does not hand"));
    EXPECT_THAT(shadow.result().difference, HasSubstr("apart in the step"));
  }
  Crossing<S> scene;
  ShadowManager<S> shadow(makeFclTree<S>(), withMotion(), withoutFile());
  scene.step(shadow);
  EXPECT_EQ(shadow.result().second.pairs, 1u);
  EXPECT_EQ(shadow.result().undecided, 0u);
  shadow.endStep();
  selfPairs<S>(shadow);
  EXPECT_EQ(shadow.result().second.pairs, 1u);
  // Where this one begins is not known.
  shadow.beginStep();
  shadow.unregisterObject(scene[0]);
  shadow.registerObject(scene[0]);
  selfPairs<S>(shadow);
  scene[0]->setTranslation(fcl::Vector3<S>(-2, 0, 0));
  scene[0]->computeAABB();
  shadow.update();
  selfPairs<S>(shadow);
  EXPECT_EQ(shadow.result().second.pairs, 2u);
  EXPECT_EQ(shadow.result().undecided, 1u);
  EXPECT_EQ(shadow.result().difference, "");
}

// A replay would look at other steps than the program.
TYPED_TEST(Shadow, RecordsSteps) {
  using S = TypeParam;
  Crossing<S> scene;
  ShadowManager<S> shadow(makeLayeredAabbTree<S>(withMotion()), withMotion(), withoutFile());
  scene.step(shadow);
  EXPECT_EQ(shadow.result().first.pairs, 1u);
  shadow.endStep();
  selfPairs<S>(shadow);
  const std::string path = temporary("steps.txt");
  shadow.writeRecord(path);
  EXPECT_THAT(contentOf(path), HasSubstr("\nbeginStep\n"));
  EXPECT_THAT(contentOf(path), HasSubstr("\nendStep\n"));
  const ShadowReplay replay = replayRecord(path);
  EXPECT_EQ(replay.result.difference, "");
  EXPECT_EQ(replay.result.first.pairs, 1u);
  EXPECT_EQ(replay.result.second.pairs, 1u);
}

// The program would not learn that its manager has no steps.
TYPED_TEST(Shadow, PassesOnThatAManagerHasNoSteps) {
  using S = TypeParam;
  ShadowManager<S> shadow(makeLayeredAabbTree<S>({}), withMotion(), withoutFile());
  EXPECT_THROW(shadow.beginStep(), std::invalid_argument);
  EXPECT_EQ(shadow.result().difference, "");
  ShadowManager<S> resting(makeFclTree<S>(), FiberManagerOptions{}, withoutFile());
  resting.beginStep();
  EXPECT_THAT(resting.result().difference, HasSubstr("beginStep: the second manager throws"));
}

// A manager of FCL that ignores an unknown object would hide that ours refuses it.
TYPED_TEST(Shadow, TellsOfAnObjectThatWasNeverRegistered) {
  using S = TypeParam;
  Scene<S> scene;
  fillRow(scene);
  ShadowOptions options;
  options.file = temporary("unknown.txt");
  ShadowManager<S> shadow(makeFclNaive<S>(), FiberManagerOptions{}, options);
  shadow.registerObject(scene[0]);
  shadow.unregisterObject(scene[1]);
  EXPECT_THAT(shadow.result().difference, HasSubstr("unregisterObject"));
  EXPECT_THAT(replayRecord(options.file).result.difference, HasSubstr("unregisterObject"));
  selfPairs<S>(shadow);  // The second one has missed a change.
  EXPECT_EQ(shadow.result().differences, 1u);
}

// What a callback does with the manager that calls it would end the program.
TYPED_TEST(Shadow, ServesACallbackThatMovesClonesAndAsksIt) {
  using S = TypeParam;
  using Manager = ShadowManager<S>;
  struct Program {
    std::optional<Manager> manager, moved;
    std::size_t pairs = 0, own = 0, cloned = 0;

    static bool visit(fcl::CollisionObject<S>*, fcl::CollisionObject<S>* b, void* data) {
      auto& self = *static_cast<Program*>(data);
      if (++self.pairs > 1) return false;
      self.own = selfPairs<S>(*self.manager).size() + pairsWith<S>(*self.manager, *b).size();
      Manager clone(makeFclTree<S>(), FiberManagerOptions{}, withoutFile());
      clone.registerObjects(objectsOf<S>(*self.manager));
      self.cloned = selfPairs<S>(clone).size();
      EXPECT_EQ(clone.result().difference, "");
      self.moved = std::move(*self.manager);
      EXPECT_THROW(self.manager->update(), std::logic_error);
      self.manager.reset();
      return false;
    }
  };
  Scene<S> scene;
  fill(scene, 4706);
  Program program;
  program.manager.emplace(makeFclTree<S>(), FiberManagerOptions{}, withoutFile());
  program.manager->registerObjects(scene.objects());
  program.manager->collide(&program, &Program::visit);
  ASSERT_TRUE(program.moved.has_value());
  EXPECT_GT(program.own, program.pairs);
  EXPECT_EQ(program.cloned, program.pairs);
  EXPECT_EQ(selfPairs<S>(*program.moved).size(), program.pairs);
  EXPECT_EQ(program.moved->result().difference, "");
  EXPECT_EQ(program.moved->result().queries, 4u);
}

// A callback that changes the manager would go unnoticed, although ours refuses that.
TYPED_TEST(Shadow, TellsOfACallbackThatChangesTheManager) {
  using S = TypeParam;
  Scene<S> scene;
  fillRow(scene);
  ShadowManager<S> shadow(makeFclNaive<S>(), FiberManagerOptions{}, withoutFile());
  shadow.registerObjects(scene.objects());
  const auto callback = [](fcl::CollisionObject<S>*, fcl::CollisionObject<S>*, void* data) {
    static_cast<ShadowManager<S>*>(data)->update();
    return true;
  };
  shadow.collide(&shadow, callback);
  EXPECT_THAT(shadow.result().difference, HasSubstr("a callback changes the manager"));
}

// FCL would cast our manager to its own class.
TYPED_TEST(Shadow, MeetsManagersOfEachKind) {
  using S = TypeParam;
  Scene<S> scene, others;
  fill(scene, 4707);
  fill(others, 4708);
  const auto tree = makeFclTree<S>();
  const auto ours = makeLayeredAabbTree<S>({});
  ShadowManager<S> shadow(makeFclTree<S>(), FiberManagerOptions{}, withoutFile());
  ShadowManager<S> second(makeFclTree<S>(), FiberManagerOptions{}, withoutFile());
  shadow.registerObjects(scene.objects());
  tree->registerObjects(others.objects());
  tree->setup();
  ours->registerObjects(others.objects());
  second.registerObjects(others.objects());
  const auto expected = [&] {
    const auto alone = makeFclTree<S>();
    alone->registerObjects(scene.objects());
    return pairsWith<S>(*alone, *tree);
  }();
  EXPECT_GT(expected.size(), 50u);
  EXPECT_EQ(pairsWith<S>(shadow, *tree), expected);
  EXPECT_EQ(pairsWith<S>(shadow, second), expected);
  EXPECT_GT(pairsWith<S>(*ours, shadow).size(), 30u);
  EXPECT_EQ(shadow.result().difference, "");
  EXPECT_EQ(second.result().difference, "");

  // The second ones of different classes meet object by object.
  ShadowManager<S> twice(makeFclTree<S>(), makeFclNaive<S>(), withoutFile());
  twice.registerObjects(scene.objects());
  EXPECT_EQ(pairsWith<S>(twice, second), expected);
  EXPECT_EQ(twice.result().problem, "");
}

// Threads would write to one memory, or wait for each other for ever.
TYPED_TEST(Shadow, AnswersSeveralThreads) {
  using S = TypeParam;
  Scene<S> scene, others;
  fill(scene, 4716);
  fill(others, 4717);
  ShadowManager<S> shadow(makeFclTree<S>(), FiberManagerOptions{}, withoutFile());
  ShadowManager<S> other(makeFclTree<S>(), FiberManagerOptions{}, withoutFile());
  shadow.registerObjects(scene.objects());
  other.registerObjects(others.objects());
  const auto expected = selfPairs<S>(shadow);
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&, i] {
      for (int k = 0; k < 5; ++k) {
        EXPECT_EQ(selfPairs<S>(shadow), expected);
        i % 2 == 0 ? pairsWith<S>(shadow, other) : pairsWith<S>(other, shadow);
        pairsWith<S>(shadow, *others[1]);
        CenterSearch<S> search;
        shadow.distance(&search, &CenterSearch<S>::visit);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(shadow.result().difference, "");
  EXPECT_EQ(other.result().difference, "");
  EXPECT_EQ(shadow.result().queries, 1u + 4 * 5 * 3 + 2 * 5);
  EXPECT_EQ(other.result().queries, 2u * 5);
}

// A half-space, whose box has no end, would make every pair of volumes near enough.
TYPED_TEST(Shadow, FindsAnInventedPairBesideAPlane) {
  using S = TypeParam;
  Scene<S> scene;
  fillRow(scene);
  scene.addHalfspace({0, 0, 1}, -90);
  ShadowManager<S> shadow(makeFclTree<S>(),
                          std::make_unique<Faulty<S>>(Faulty<S>::Fault::kInvents, scene[0],
                                                      scene[4], FiberManagerOptions{}),
                          withoutFile());
  for (auto* object : scene.objects()) shadow.registerObject(object);
  selfPairs<S>(shadow);
  EXPECT_THAT(shadow.result().difference, HasSubstr("although it is too far apart"));
}

// A pair of an object that is gone would be laid to the program's manager.
TYPED_TEST(Shadow, FindsAPairOfAnObjectThatWasUnregistered) {
  using S = TypeParam;
  Scene<S> scene;
  fillRow(scene);
  ShadowManager<S> shadow(makeFclTree<S>(),
                          std::make_unique<Faulty<S>>(Faulty<S>::Fault::kInvents, scene[0],
                                                      scene[1], FiberManagerOptions{}),
                          withoutFile());
  shadow.registerObjects(scene.objects());
  shadow.unregisterObject(scene[1]);
  selfPairs<S>(shadow);
  EXPECT_THAT(shadow.result().difference, HasSubstr("the second manager invents a pair"));
}

// A manager that has objects already would never be compared in full.
TYPED_TEST(Shadow, RefusesManagersThatAreNullOrFilled) {
  using S = TypeParam;
  Scene<S> scene;
  fillRow(scene);
  auto filled = makeFclTree<S>();
  filled->registerObjects(scene.objects());
  EXPECT_THROW(ShadowManager<S>(nullptr, FiberManagerOptions{}), std::invalid_argument);
  EXPECT_THROW(ShadowManager<S>(std::move(filled), FiberManagerOptions{}), std::invalid_argument);
  EXPECT_THROW(ShadowManager<S>(makeFclTree<S>(), nullptr), std::invalid_argument);
}

/// A program of all calls and shapes.
template <typename S>
void runAll(ShadowManager<S>& shadow, ShadowManager<S>& other, Scene<S>& scene, Scene<S>& others) {
  Random random(4709);
  other.registerObjects(others.objects());
  for (auto* object : scene.loose()) shadow.registerObject(object);
  shadow.registerFiber(scene.fibers()[0]);
  shadow.setup();
  for (int step = 0; step < 3; ++step) {
    selfPairs<S>(shadow);
    PairCollector<S> few;
    few.stop_at = 5;
    shadow.collide(&few, &PairCollector<S>::collide);
    pairsWith<S>(shadow, *others[1]);
    pairsWith<S>(shadow, other);
    pairsWith<S>(shadow, shadow);
    CenterSearch<S> search;
    shadow.distance(others[1], &search, &CenterSearch<S>::visit);
    const std::vector<fcl::CollisionObject<S>*> some{scene[1], scene[3], scene[7]};
    jolt(some, random, 0.1, 0.2);
    shadow.update(some);
    shadow.update(some[0]);
    shadow.unregisterObject(scene[2]);
    shadow.registerObjects({scene[2]});
    shadow.update();
  }
}

// A record would not be the program's: a number would come back another, or a call be left out.
TYPED_TEST(Shadow, RecordsEveryCallAndShape) {
  using S = TypeParam;
  Scene<S> scene, others;
  fill(scene, 4710, true);
  fill(others, 4711);
  ShadowManager<S> shadow(makeFclNaive<S>(), FiberManagerOptions{}, withoutFile());
  ShadowManager<S> other(makeFclNaive<S>(), FiberManagerOptions{}, withoutFile());
  runAll(shadow, other, scene, others);
  const std::string path = temporary("all.txt");
  shadow.writeRecord(path);
  const std::string text = contentOf(path);
  for (const char* const word : {"registerObject",
                                 "registerObjects",
                                 "registerFiber",
                                 "unregisterObject",
                                 "setup",
                                 "update",
                                 "updateObject",
                                 "updateObjects",
                                 "collideSelf",
                                 "collideSelf 5\n",
                                 "collideObject",
                                 "collideManager",
                                 "collideItself",
                                 "distanceObject",
                                 "sphere",
                                 "capsule",
                                 "box",
                                 "cylinder",
                                 "cone",
                                 "ellipsoid",
                                 "convex",
                                 "bounds",
                                 "halfspace",
                                 "plane"}) {
    EXPECT_THAT(text, HasSubstr(std::string(word)));
  }
  const ShadowReplay replay = replayRecord(path);
  EXPECT_EQ(replay.result.difference, "");
  EXPECT_EQ(replay.recorded, "");
  const ShadowResult result = shadow.result();
  EXPECT_EQ(result.difference, "");
  EXPECT_EQ(replay.result.changes, result.changes);
  EXPECT_EQ(replay.result.queries, result.queries);
  EXPECT_EQ(replay.result.second.pairs > 0, true);
}

// A long run would take all memory, or its record could not be replayed.
TYPED_TEST(Shadow, EndsTheRecordAtItsLimit) {
  using S = TypeParam;
  Scene<S> scene, others;
  fill(scene, 4712);
  fill(others, 4713);
  ShadowOptions options = withoutFile();
  options.record_limit = 40000;
  ShadowManager<S> shadow(makeFclTree<S>(), FiberManagerOptions{}, options);
  ShadowManager<S> other(makeFclTree<S>(), FiberManagerOptions{}, withoutFile());
  runAll(shadow, other, scene, others);
  const std::string path = temporary("limit.txt");
  shadow.writeRecord(path);
  EXPECT_THAT(contentOf(path), HasSubstr("\nlimit\n"));
  EXPECT_LT(contentOf(path).size(), 50000u);
  const ShadowReplay replay = replayRecord(path);
  EXPECT_EQ(replay.result.difference, "");
  EXPECT_LT(replay.result.changes, shadow.result().changes);
  EXPECT_THAT(replay.managers, HasSubstr("up to the limit of the record"));
}

// A record would replace another one, or the failure to write one reach the program.
TYPED_TEST(Shadow, KeepsRecordsAndTellsWhyNoneIsWritten) {
  using S = TypeParam;
  using Fault = typename Faulty<S>::Fault;
  const std::string path = temporary("kept.txt"), second = temporary("kept.txt-2");
  for (const std::string& file : {path, second, std::string("/no/such/folder/x.txt")}) {
    Scene<S> scene;
    fillRow(scene);
    ShadowOptions options;
    options.file = file == second ? path : file;
    ShadowManager<S> shadow(
        makeFclTree<S>(),
        std::make_unique<Faulty<S>>(Fault::kLoses, scene[0], scene[1], FiberManagerOptions{}),
        options);
    shadow.registerObjects(scene.objects());
    selfPairs<S>(shadow);
    EXPECT_NE(shadow.result().difference, "");
    EXPECT_EQ(shadow.result().file, file[1] == 'n' ? "" : file);
    EXPECT_EQ(shadow.result().problem.empty(), file[1] != 'n');
  }
  ShadowManager<S> shadow(makeFclTree<S>(), FiberManagerOptions{}, withoutFile());
  EXPECT_THROW(shadow.writeRecord("/no/such/folder/x.txt"), std::runtime_error);
}

// A damaged file would crash the reader, or pass for a record.
TYPED_TEST(Shadow, RefusesCutAndDamagedRecords) {
  using S = TypeParam;
  Scene<S> scene;
  Random random(4714);
  fill(scene, 4715, true);
  ShadowManager<S> shadow(makeFclTree<S>(), FiberManagerOptions{}, withoutFile());
  const std::vector<fcl::CollisionObject<S>*> few(scene.objects().begin(),
                                                  scene.objects().begin() + 9);
  shadow.registerObjects(few);
  shadow.registerObjects({scene.objects().end() - 3, scene.objects().end()});
  selfPairs<S>(shadow);
  CenterSearch<S> search;
  shadow.distance(&search, &CenterSearch<S>::visit);
  const std::string path = temporary("damaged.txt");
  shadow.writeRecord(path);
  const std::string text = contentOf(path);
  ASSERT_LT(text.size(), 50000u);
  const auto replay = [&](const std::string& damaged) {
    std::ofstream(path, std::ios::binary) << damaged;
    try {
      replayRecord(path);
      return std::string();
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr(path + ":"));
      return std::string(error.what());
    }
  };
  EXPECT_EQ(replay(text), "");
  for (std::size_t size = 0; size < text.size(); size += 7) {
    EXPECT_THAT(replay(text.substr(0, size)),
                testing::AnyOf(HasSubstr("the record is cut"), HasSubstr("is no record"),
                               HasSubstr("is empty")));
    replay(text.substr(0, size) + "\nend\n");
  }
  EXPECT_THAT(replay("fcl_fibers record 2\nend\n"), HasSubstr("damaged.txt:1: it is no record"));
  const char signs[] = "0123456789p-/ naif\nxS";
  for (std::size_t at = 0; at < text.size(); at += 5) {
    std::string damaged = text;
    const char sign = signs[random.below(sizeof(signs) - 1)];
    switch (random.below(3)) {
      case 0:
        damaged[at] = sign;
        break;
      case 1:
        damaged.insert(at, 1, sign);
        break;
      default:
        damaged.erase(at, 1 + random.below(4));
    }
    replay(damaged);
  }
}

}  // namespace
}  // namespace fcl_fibers::test
