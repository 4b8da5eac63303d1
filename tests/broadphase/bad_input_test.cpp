// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <functional>
#include <initializer_list>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "support/managed.h"
#include "support/scene_generators.h"
#include "support/text_of.h"

namespace fcl_fibers::test {
namespace {

// Whether the call throws std::invalid_argument and its text holds all `words`.
template <typename Call>
testing::AssertionResult refuses(Call&& call, std::initializer_list<std::string> words) {
  const std::string text = textOf(call);
  for (const std::string& word : words) {
    if (text.find(word) == std::string::npos) {
      return testing::AssertionFailure() << "'" << word << "' is not in: " << text;
    }
  }
  if (text.size() > 40) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "only the mistake is named: " << text;
}

template <typename S>
struct Spoiled {
  std::string what;
  std::function<void(Scene<S>&, std::size_t)> apply;
};

// Everything that a stored pose and a capsule can have wrong.
template <typename S>
std::vector<Spoiled<S>> waysToSpoil() {
  const S nan = std::numeric_limits<S>::quiet_NaN();
  const S infinity = std::numeric_limits<S>::infinity();
  const auto translation = [](S value, int axis) {
    return [=](Scene<S>& scene, std::size_t i) {
      fcl::Vector3<S> position = scene[i]->getTranslation();
      position[axis] = value;
      scene[i]->setTranslation(position);
    };
  };
  const auto entry = [](S value, int row, int column) {
    return [=](Scene<S>& scene, std::size_t i) {
      fcl::Matrix3<S> rotation = scene[i]->getRotation();
      rotation(row, column) = value;
      scene[i]->setRotation(rotation);
    };
  };
  const auto scaled = [](S x, S y, S z) {
    return [=](Scene<S>& scene, std::size_t i) {
      const fcl::Matrix3<S> rotation = scene[i]->getRotation();
      scene[i]->setRotation(rotation * fcl::Vector3<S>(x, y, z).asDiagonal());
    };
  };
  const auto radius = [](S value) {
    return [=](Scene<S>& scene, std::size_t i) { scene.capsule(i).radius = value; };
  };
  const auto length = [](S value) {
    return [=](Scene<S>& scene, std::size_t i) { scene.capsule(i).lz = value; };
  };
  return {
      {"NaN in the position", translation(nan, 0)},
      {"NaN in the position, z", translation(nan, 2)},
      {"infinite position", translation(infinity, 1)},
      {"negative infinite position", translation(-infinity, 2)},
      {"NaN in the rotation", entry(nan, 0, 0)},
      {"NaN in the rotation, off the axis", entry(nan, 2, 1)},
      {"infinite rotation", entry(infinity, 1, 2)},
      {"scaled rotation", scaled(S(1.5), S(1.5), S(1.5))},
      {"rotation stretched along the axis", scaled(1, 1, S(1.01))},
      {"rotation stretched across the axis", scaled(S(0.5), 1, 1)},
      {"reflection", scaled(1, 1, -1)},
      {"zero rotation", scaled(0, 0, 0)},
      {"axes of a rotation that are a little oblique",
       [](Scene<S>& scene, std::size_t i) {
         fcl::Matrix3<S> rotation = scene[i]->getRotation();
         rotation.col(1) = (rotation.col(1) + S(2e-3) * rotation.col(0)).normalized();
         scene[i]->setRotation(rotation);
       }},
      {"sheared rotation",
       [](Scene<S>& scene, std::size_t i) {
         fcl::Matrix3<S> rotation = scene[i]->getRotation();
         rotation.col(2) = (rotation.col(2) + rotation.col(0)).normalized();
         scene[i]->setRotation(rotation);
       }},
      {"negative radius", radius(S(-0.1))},
      {"NaN radius", radius(nan)},
      {"negative length", length(S(-0.1))},
      {"NaN length", length(nan)},
  };
}

template <typename Config>
class BadInput : public testing::Test {
 protected:
  using S = typename Config::Scalar;
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;
  using Manager = FiberCollisionManager<S>;

  BadInput() : scene_(strandScene<S>(5, 12, 181)), manager_(&*managed_) {
    managed_.registerFibers(scene_);
    manager_->setup();
    pairs_ = selfPairs<S>(*manager_);
  }

  // That nothing happened: same objects, same answers.
  testing::AssertionResult unchanged() const {
    if (manager_->size() != scene_.size() || manager_->empty()) {
      return testing::AssertionFailure() << "size is " << manager_->size();
    }
    if (objectsOf<S>(*manager_) != scene_.objects()) {
      return testing::AssertionFailure() << "getObjects gives other objects";
    }
    if (selfPairs<S>(*manager_) != pairs_) {
      return testing::AssertionFailure() << "the same query gives another answer";
    }
    return testing::AssertionSuccess();
  }

  // By both queries with the object or manager, with this word in the text.
  template <typename Partner>
  void expectRefused(Partner* partner, const std::string& word = "") const {
    EXPECT_TRUE(refuses([&] { manager_->collide(partner, nullptr, &BadInput::ignore); },
                        {"collide", word}));
    EXPECT_TRUE(refuses([&] { manager_->distance(partner, nullptr, &BadInput::ignoreDistance); },
                        {"distance", word}));
  }

  static bool ignore(Object*, Object*, void*) { return false; }
  static bool ignoreDistance(Object*, Object*, void*, S&) { return false; }

  Scene<S> scene_;
  Managed<Config> managed_;
  Manager* manager_;
  Calls<S> pairs_;
};
TYPED_TEST_SUITE(BadInput, FiberManagers, ManagerNames);

// A null pointer would be followed.
TYPED_TEST(BadInput, NullIsRefused) {
  using S = typename TypeParam::Scalar;
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;
  auto& m = *this->manager_;
  const Scene<S> more = soupScene<S>(50, 0.3, 182);
  Objects holed = more.objects();
  holed[37] = nullptr;
  Objects updated = this->scene_.objects();
  updated[37] = nullptr;
  Object* const none = nullptr;

  EXPECT_TRUE(refuses([&] { m.registerObject(none); }, {"registerObject"}));
  EXPECT_TRUE(refuses([&] { m.registerObjects(holed); }, {"registerObjects", "37"}));
  EXPECT_TRUE(refuses([&] { m.registerFiber(holed); }, {"registerFiber", "37"}));
  EXPECT_TRUE(refuses([&] { m.unregisterObject(none); }, {"unregisterObject"}));
  EXPECT_TRUE(this->unchanged());

  this->expectRefused(none);
  this->expectRefused(static_cast<fcl::BroadPhaseCollisionManager<S>*>(nullptr));

  const auto other = TypeParam::make();
  other->registerObjects(more.objects());
  fcl::CollisionCallBack<S> const no_call = nullptr;
  fcl::DistanceCallBack<S> const no_distance = nullptr;
  EXPECT_TRUE(refuses([&] { m.collide(nullptr, no_call); }, {"collide"}));
  EXPECT_TRUE(refuses([&] { m.collide(more[0], nullptr, no_call); }, {"collide"}));
  EXPECT_TRUE(refuses([&] { m.collide(other.get(), nullptr, no_call); }, {"collide"}));
  EXPECT_TRUE(refuses([&] { m.collide(&m, nullptr, no_call); }, {"collide"}));
  EXPECT_TRUE(refuses([&] { m.distance(nullptr, no_distance); }, {"distance"}));
  EXPECT_TRUE(refuses([&] { m.distance(more[0], nullptr, no_distance); }, {"distance"}));
  EXPECT_TRUE(refuses([&] { m.distance(other.get(), nullptr, no_distance); }, {"distance"}));
  EXPECT_TRUE(this->unchanged());

  EXPECT_TRUE(refuses([&] { m.update(none); }, {"update"}));
  m.update();
  EXPECT_TRUE(this->unchanged());
  EXPECT_TRUE(refuses([&] { m.update(updated); }, {"update", "37"}));
  m.update();
  EXPECT_TRUE(this->unchanged());
}

// An object that is in twice would collide with itself, and stay when it is taken out.
TYPED_TEST(BadInput, RegisteringTwiceIsRefused) {
  using S = typename TypeParam::Scalar;
  auto& m = *this->manager_;
  const Scene<S> more = soupScene<S>(50, 0.3, 183);
  std::vector<fcl::CollisionObject<S>*> known = more.objects();
  known[37] = this->scene_[5];
  std::vector<fcl::CollisionObject<S>*> repeated = more.objects();
  repeated[37] = repeated[11];

  EXPECT_TRUE(refuses([&] { m.registerObject(this->scene_[5]); }, {"registerObject"}));
  EXPECT_TRUE(refuses([&] { m.registerObjects(known); }, {"registerObjects", "37"}));
  EXPECT_TRUE(refuses([&] { m.registerFiber(known); }, {"registerFiber", "37"}));
  EXPECT_TRUE(refuses([&] { m.registerObjects(repeated); }, {"registerObjects", "37"}));
  EXPECT_TRUE(refuses([&] { m.registerFiber(repeated); }, {"registerFiber", "37"}));
  EXPECT_TRUE(this->unchanged());
  // None of the failed calls' objects stayed: they can be registered now.
  m.registerObjects(more.objects());
  EXPECT_EQ(m.size(), this->scene_.size() + more.size());
}

// An unknown object would take another one with it.
TYPED_TEST(BadInput, UnknownObjectsAreRefused) {
  using S = typename TypeParam::Scalar;
  auto& m = *this->manager_;
  const Scene<S> unknown = soupScene<S>(2, 0.3, 184);
  EXPECT_TRUE(refuses([&] { m.unregisterObject(unknown[0]); }, {"unregisterObject"}));
  EXPECT_TRUE(this->unchanged());
  // One that was taken out is unknown, too.
  m.unregisterObject(this->scene_[59]);
  EXPECT_TRUE(refuses([&] { m.unregisterObject(this->scene_[59]); }, {"unregisterObject"}));
  EXPECT_EQ(m.size(), this->scene_.size() - 1);

  const auto empty = TypeParam::make();
  EXPECT_TRUE(refuses([&] { empty->unregisterObject(unknown[0]); }, {"unregisterObject"}));
  EXPECT_EQ(empty->size(), 0u);
}

// One broken object would spoil the answers for all others, silently.
TYPED_TEST(BadInput, BrokenObjectsAreNotRegistered) {
  using S = typename TypeParam::Scalar;
  auto& m = *this->manager_;
  for (const Spoiled<S>& spoiled : waysToSpoil<S>()) {
    SCOPED_TRACE(spoiled.what);
    Scene<S> more = strandScene<S>(1, 50, 185);
    spoiled.apply(more, 37);
    EXPECT_TRUE(refuses([&] { m.registerObject(more[37]); }, {"registerObject"}));
    EXPECT_TRUE(refuses([&] { m.registerObjects(more.objects()); }, {"registerObjects", "37"}));
    EXPECT_TRUE(refuses([&] { m.registerFiber(more.objects()); }, {"registerFiber", "37"}));
    EXPECT_TRUE(this->unchanged());
    const auto empty = TypeParam::make();
    EXPECT_TRUE(refuses([&] { empty->registerObjects(more.objects()); }, {"37"}));
    EXPECT_TRUE(empty->empty());
    EXPECT_TRUE(selfPairs<S>(*empty).empty());
  }
}

// A broken object as the query would match everything, or nothing.
TYPED_TEST(BadInput, BrokenObjectsAreNoPartners) {
  using S = typename TypeParam::Scalar;
  for (const Spoiled<S>& spoiled : waysToSpoil<S>()) {
    SCOPED_TRACE(spoiled.what);
    Scene<S> more = strandScene<S>(1, 50, 186);
    spoiled.apply(more, 37);
    this->expectRefused(more[37]);
    ForeignManager<S> foreign(more.objects());
    this->expectRefused(&foreign, "37");
    EXPECT_TRUE(this->unchanged());
  }
}

// Other shapes would be trusted where capsules are not.
TYPED_TEST(BadInput, BrokenShapesBesideFibersAreRefused) {
  using S = typename TypeParam::Scalar;
  auto& m = *this->manager_;
  const S nan = std::numeric_limits<S>::quiet_NaN();
  const S infinity = std::numeric_limits<S>::infinity();
  for (const S value : {nan, infinity, -infinity}) {
    for (int kind = 0; kind < 5; ++kind) {
      SCOPED_TRACE(std::to_string(kind) + ", " + std::to_string(value));
      Scene<S> shapes;
      addShapes(shapes, 5, 0.3, 187);
      fcl::CollisionObject<S>* broken = shapes[static_cast<std::size_t>(kind)];
      fcl::Vector3<S> position = broken->getTranslation();
      position[1] = value;
      broken->setTranslation(position);
      broken->computeAABB();
      EXPECT_TRUE(refuses([&] { m.registerObject(broken); }, {"registerObject"}));
      EXPECT_TRUE(refuses([&] { m.registerObjects(shapes.objects()); },
                          {"registerObjects", std::to_string(kind)}));
      this->expectRefused(broken);
      EXPECT_TRUE(this->unchanged());
    }
  }
  Scene<S> sphere;
  sphere.addSphere({0, 0, 0}, -0.5);
  EXPECT_TRUE(refuses([&] { m.registerObject(sphere[0]); }, {"registerObject"}));
  EXPECT_TRUE(this->unchanged());
}

// Objects without any shape would be followed into nothing.
TYPED_TEST(BadInput, AnObjectWithoutGeometryIsRefused) {
  using S = typename TypeParam::Scalar;
  auto& m = *this->manager_;
  fcl::CollisionObject<S> hollow(std::shared_ptr<fcl::CollisionGeometry<S>>{});
  EXPECT_TRUE(refuses([&] { m.registerObject(&hollow); }, {"registerObject"}));
  EXPECT_TRUE(refuses([&] { m.registerFiber({&hollow}); }, {"registerFiber"}));
  this->expectRefused(&hollow);
  EXPECT_TRUE(this->unchanged());
}

// Rotations that carry the rounding of their computation would be refused in the middle of a run.
TYPED_TEST(BadInput, RotationsRoundedByUseAreAccepted) {
  using S = typename TypeParam::Scalar;
  auto& m = *this->manager_;
  Random random(191);
  const fcl::Matrix3<S> turn = random.rotation(0.3).toRotationMatrix().template cast<S>();
  for (int i = 0; i < 1000; ++i) {
    // Never made orthonormal again.
    this->scene_[37]->setRotation(turn * this->scene_[37]->getRotation());
  }
  m.update();
  EXPECT_TRUE(this->managed_.answersSelf());
}

// "Neighbours" would mean nothing for a mesh in a fiber.
TYPED_TEST(BadInput, AFiberIsMadeOfCapsulesCylindersAndBoxes) {
  auto& m = *this->manager_;
  for (int kind = 0; kind < 3; ++kind) {
    auto more = strandScene<typename TypeParam::Scalar>(1, 37, 188);
    if (kind == 0) more.addSphere({0, 0, 0}, 1);
    if (kind == 1) more.addMesh({0, 0, 0}, 1);
    if (kind == 2) more.addHalfspace({0, 0, 1}, 0);
    more.addCapsule(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0, 0, 1), 0.1);
    EXPECT_TRUE(refuses([&] { m.registerFiber(more.objects()); },
                        {"registerFiber", "37", "capsule, cylinder or box"}));
    EXPECT_TRUE(this->unchanged());
  }
}

// Options that mean nothing would be taken as something.
TYPED_TEST(BadInput, OptionsOutOfRangeAreRefused) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double margin :
       {-1.0, -1e-300, infinity, -infinity, std::numeric_limits<double>::quiet_NaN()}) {
    FiberManagerOptions options;
    options.margin = margin;
    EXPECT_TRUE(refuses([&] { TypeParam::make(options); }, {"margin"})) << margin;
    options = {};
    options.ignored_arc_length = margin;
    EXPECT_TRUE(refuses([&] { TypeParam::make(options); }, {"ignored_arc_length"})) << margin;
  }
  for (const int threads : {0, -1}) {
    FiberManagerOptions options;
    options.threads = threads;
    EXPECT_TRUE(
        refuses([&] { TypeParam::make(options); }, {"threads is " + std::to_string(threads)}));
  }
  for (const int neighbors : {-1, std::numeric_limits<int>::min()}) {
    FiberManagerOptions options;
    options.ignored_neighbors = neighbors;
    EXPECT_TRUE(refuses([&] { TypeParam::make(options); }, {"ignored_neighbors"})) << neighbors;
  }
}

// After an object broke, answers would be those for some of the objects at some of their poses.
TYPED_TEST(BadInput, QueriesRefuseAfterAFailedUpdateUntilOneSucceeds) {
  using S = typename TypeParam::Scalar;
  using Fixture = BadInput<TypeParam>;
  auto& m = *this->manager_;
  const Scene<S> probe = soupScene<S>(1, 1, 189);
  const auto other = TypeParam::make();
  other->registerObjects(probe.objects());
  int way = 0;
  for (const Spoiled<S>& spoiled : waysToSpoil<S>()) {
    SCOPED_TRACE(spoiled.what);
    const fcl::Transform3<S> pose = this->scene_[37]->getTransform();
    const S radius = this->scene_.capsule(37).radius;
    const S length = this->scene_.capsule(37).lz;
    spoiled.apply(this->scene_, 37);
    switch (way++ % 3) {
      case 0:
        EXPECT_TRUE(refuses([&] { m.update(); }, {"update", "37"}));
        break;
      case 1:
        EXPECT_TRUE(refuses([&] { m.update(this->scene_[37]); }, {"update"}));
        break;
      default:
        EXPECT_TRUE(refuses([&] { m.update(this->scene_.objects()); }, {"update", "37"}));
    }
    EXPECT_EQ(m.size(), this->scene_.size());
    EXPECT_EQ(objectsOf<S>(m), this->scene_.objects());
    EXPECT_ANY_THROW(m.collide(nullptr, &Fixture::ignore));
    EXPECT_ANY_THROW(m.collide(probe[0], nullptr, &Fixture::ignore));
    EXPECT_ANY_THROW(m.collide(other.get(), nullptr, &Fixture::ignore));
    EXPECT_ANY_THROW(other->collide(&m, nullptr, &Fixture::ignore));
    EXPECT_ANY_THROW(m.distance(nullptr, &Fixture::ignoreDistance));
    EXPECT_ANY_THROW(m.distance(probe[0], nullptr, &Fixture::ignoreDistance));
    EXPECT_ANY_THROW(m.distance(other.get(), nullptr, &Fixture::ignoreDistance));
    EXPECT_ANY_THROW(m.update()) << "the object is still broken";
    EXPECT_ANY_THROW(m.collide(nullptr, &Fixture::ignore));

    this->scene_[37]->setTransform(pose);
    this->scene_.capsule(37).radius = radius;
    this->scene_.capsule(37).lz = length;
    EXPECT_ANY_THROW(m.collide(nullptr, &Fixture::ignore)) << "an update has to succeed first";
    m.update();
    EXPECT_TRUE(this->unchanged());
  }
}

// A program could not get rid of a broken object.
TYPED_TEST(BadInput, ABrokenObjectMayBeUnregisteredOrCleared) {
  using S = typename TypeParam::Scalar;
  auto& m = *this->manager_;
  fcl::CollisionObject<S>* broken = this->scene_[37];
  const fcl::Transform3<S> pose = broken->getTransform();
  broken->setTranslation(fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN()));
  EXPECT_TRUE(refuses([&] { m.update(); }, {"update", "37"}));
  this->managed_.unregisterObject(broken);
  m.update();
  EXPECT_TRUE(this->managed_.answersSelf());
  const auto left = this->managed_.objects();

  broken->setTransform(pose);
  m.registerObject(broken);
  broken->setTranslation(fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN()));
  EXPECT_TRUE(refuses([&] { m.update(broken); }, {"update"}));
  this->managed_.clear();
  EXPECT_TRUE(selfPairs<S>(m).empty());
  this->managed_.registerObjects(left);
  EXPECT_TRUE(this->managed_.answersSelf());
  // Nobody could fix what is not there any more.
  const fcl::Transform3<S> place = left[3]->getTransform();
  left[3]->setTranslation(fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN()));
  EXPECT_THROW(m.update(), std::invalid_argument);
  EXPECT_THROW(selfPairs<S>(m), std::invalid_argument);
  while (this->managed_.size() > 0) this->managed_.unregister(0);
  EXPECT_TRUE(this->managed_.answersSelf(0));
  left[3]->setTransform(place);
  this->managed_.registerObjects(left);
  EXPECT_TRUE(this->managed_.answersSelf());
}

}  // namespace
}  // namespace fcl_fibers::test
