// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>

#include "support/least_box.h"
#include "support/managed.h"
#include "support/mesh_models.h"
#include "support/scene_generators.h"

// Planes and half-spaces, whose boxes have no end: they are beside the tree, and every answer has
// to be as if they were in it.

namespace fcl_fibers::test {
namespace {

MANAGER_SUITE(UnboundedShapes, FiberManagers);
MANAGER_SUITE(MovingUnboundedShapes, LayeredManagers);

/// Planes and half-spaces in turn that pass the placement at up to a third of its scale.
template <typename S>
void addUnbounded(Scene<S>& scene, std::size_t count, Random& random, const Placement& at = {}) {
  for (std::size_t i = 0; i < count; ++i) {
    // Straight ones have boxes with an end, and so have those that are turned by half a turn.
    Eigen::Vector3d normal = i % 4 < 2
                                 ? random.direction()
                                 : Eigen::Vector3d(Eigen::Vector3d::Unit(static_cast<int>(i % 3)));
    if (i % 8 > 5) normal = -normal;
    const double offset = normal.dot(at.origin) - at.scale * random.between(0, 0.3);
    auto* object = i % 2 == 0 ? scene.addHalfspace(normal, offset) : scene.addPlane(normal, offset);
    if (i % 3 == 1) {
      // It is the pose that turns it or brings it here.
      const Eigen::Quaterniond turn = random.rotation(0.5);
      moveTo(*object,
             makePose<S>(turn, at.origin - turn * at.origin + random.inCube(0.1) * at.scale));
    }
    if (i % 5 == 4) {
      moveTo(*object, makePose<S>(Eigen::Quaterniond::Identity(), random.inCube(0.2) * at.scale));
    }
  }
}

/// Strands, balls, boxes, meshes and others among half-spaces and planes.
template <typename S>
Scene<S> roomScene(std::uint64_t seed, std::size_t unbounded, const Placement& at = {}) {
  Random random(seed);
  Scene<S> scene = strandScene<S>(3, 7, seed + 1, at);
  addShapes(scene, 8, 0.2, seed + 2, at);
  for (int i = 0; i < 3; ++i) {
    scene.addSphere(at.origin + random.inCube(1) * at.scale, 0.1 * at.scale);
    scene.addBox(at.origin + random.inCube(1) * at.scale, random.rotation(),
                 Eigen::Vector3d(0.1, 0.2, 0.3) * at.scale);
  }
  addUnbounded(scene, unbounded, random, at);
  return scene;
}

// A floor would be lost, or meet all that is above it.
TYPED_TEST(UnboundedShapes, AnswersAreThoseOfAllPairs) {
  using S = typename TypeParam::Scalar;
  const double far = std::is_same_v<S, float> ? 50 : 1e4;
  // The frames of the two managers are near each other, or far in place and size.
  const Placement places[] = {{}, {{0.2, 0.1, -0.3}, 0.25}, {{far, -far, 2 * far}, 3}};
  std::uint64_t seed = 1000;
  for (const Placement& place : places) {
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
      SCOPED_TRACE(std::to_string(place.scale) + ", " + describe(options));
      seed += 10;
      Scene<S> scene = roomScene<S>(seed, 7), others = roomScene<S>(seed + 5, 6, place);
      FiberManagerOptions its_options = options;
      its_options.margin = 0.02 * place.scale;
      Managed<TypeParam> managed(options), other(its_options);
      managed.registerFibers(scene);
      other.registerFibers(others);
      const auto expectAnswers = [&](const char* when) {
        SCOPED_TRACE(when);
        EXPECT_TRUE(managed.answersSelf());
        EXPECT_TRUE(other.answersSelf());
        EXPECT_TRUE(managed.answersWith(other, 0));
        EXPECT_TRUE(other.answersWith(managed, 0));
        for (std::size_t i = 0; i < managed.size(); i += 5) {
          EXPECT_TRUE(managed.answersWith(managed[i], 0)) << i;
          EXPECT_TRUE(other.answersWith(managed[i], 0)) << i;
        }
        EXPECT_FALSE(managed->movedSinceUpdate());
      };
      expectAnswers("registered");
      managed.expectNearest();
      managed.expectNearest(other);
      managed.expectEveryPair(other);

      Random random(seed + 7);
      jolt(scene.objects(), random, 0.05, 0.3);
      jolt(others.objects(), random, 0.05 * place.scale, 0.001);
      EXPECT_TRUE(managed->movedSinceUpdate());
      managed->update();
      other->update();
      expectAnswers("moved");

      // One alone, by a motion that a box without end does not show.
      auto* const floor = scene[scene.size() - 7];
      jolt(*floor, random, 0.2, 0.2);
      // If only volumes count, the answers are the same.
      EXPECT_TRUE(managed->movedSinceUpdate() || options.report == Report::kVolumes);
      managed->update(floor);
      expectAnswers("one moved");

      auto* const gone = managed.unregister(managed.size() - 3);
      managed.unregister(2);
      managed.unregister(managed.size() - 5);
      expectAnswers("some gone");
      managed.registerObject(gone);
      expectAnswers("one back");

      Scene<S> copies;
      for (auto* object : managed.objects()) {
        auto* copy = copies.add(
            std::const_pointer_cast<fcl::CollisionGeometry<S>>(object->collisionGeometry()),
            object->getTransform());
        copy->computeAABB();
      }
      const Managed<TypeParam> clone = managed.clone(copies.objects());
      EXPECT_TRUE(clone.answersSelf());
      EXPECT_TRUE(clone.answersWith(other, 0));
      EXPECT_TRUE(other.answersWith(clone, 0));
      clone.expectNearest(other);
    }
  }
}

// What is asked for by its box alone would be told by its plane.
TYPED_TEST(UnboundedShapes, CountByTheirBoxesIfObjectsAreAsked) {
  using S = typename TypeParam::Scalar;
  for (FiberManagerOptions options : optionsToTest<TypeParam>(0)) {
    SCOPED_TRACE(describe(options));
    options.bounds = Bounds::kObjects;
    Scene<S> scene = roomScene<S>(1201, 9), others = roomScene<S>(1202, 5);
    for (std::size_t i = 0; i < scene.size(); i += 3) grow(aabbOf(*scene[i]), 0.05);
    const Managed<TypeParam> managed(scene, options), other(others, options);
    Random random(1203);
    for (const bool has_moved : {false, true}) {
      if (has_moved) {
        jolt(scene.objects(), random, 0.1, 0.5);
        managed->update();
      }
      const Calls<S> self = selfPairs(*managed), with = pairsWith(*managed, *other);
      std::set<std::pair<const void*, const void*>> found;
      for (const auto& [a, b] : self)
        EXPECT_TRUE(found.insert(std::minmax<const void*>(a, b)).second);
      for (const auto& [a, b] : with)
        EXPECT_TRUE(found.insert(std::minmax<const void*>(a, b)).second);
      std::size_t overlapping = 0;
      const auto expectPair = [&](auto* a, auto* b) {
        if (!a->getAABB().overlap(b->getAABB())) return;
        ++overlapping;
        EXPECT_TRUE(found.count(std::minmax<const void*>(a, b)));
      };
      for (std::size_t i = 0; i < scene.size(); ++i) {
        for (std::size_t j = i + 1; j < scene.size(); ++j) expectPair(scene[i], scene[j]);
        for (auto* object : others.objects()) expectPair(scene[i], object);
      }
      // Balls around boxes meet where the boxes do not.
      if (TypeParam::kVolume == LeafVolume::kBox || options.report == Report::kCapsules) {
        EXPECT_EQ(found.size(), overlapping);
      }
    }
  }
}

/// That pairs which touch are reported, and none whose boxes do not. Where an object is that has
/// become another shape, it may count by its box.
/// @param others  of the other manager, or null for the pairs of one
template <typename Config>
void expectWhatTouches(const Managed<Config>& managed, const Managed<Config>* other = nullptr) {
  using S = typename Config::Scalar;
  FiberManagerOptions by_capsules = managed->options();
  by_capsules.report = Report::kCapsules;
  auto all = managed.objects();
  if (other != nullptr) all.insert(all.end(), other->objects().begin(), other->objects().end());
  const PairOracle<S> oracle(all, rulesOf<Config>(by_capsules));
  const auto calls = other != nullptr ? pairsWith(*managed, **other) : selfPairs(*managed);
  const std::set found(calls.begin(), calls.end());
  EXPECT_EQ(found.size(), calls.size()) << "a pair comes twice";
  // Spheres around boxes reach further.
  const bool by_boxes =
      Config::kVolume == LeafVolume::kBox || managed->options().report == Report::kCapsules;
  const Real rounding = volumeBand(oracle.extent()) +
                        64 * Real(std::numeric_limits<S>::epsilon()) * oracle.largestCoordinate();
  const auto expectPair = [&](auto* a, auto* b) {
    const bool is_found = found.count({a, b}) > 0;
    if (oracle.verdict(a, b) == Verdict::kMust) {
      EXPECT_TRUE(is_found) << "missing, " << oracle.distance(a, b);
    } else if (by_boxes &&
               boxGap(leastBox(*a), leastBox(*b)) > Real(managed->options().margin) + rounding) {
      EXPECT_FALSE(is_found) << "extra, " << oracle.distance(a, b);
    }
  };
  for (std::size_t i = 0; i < managed.size(); ++i) {
    if (other == nullptr) {
      for (std::size_t k = i + 1; k < managed.size(); ++k) expectPair(managed[i], managed[k]);
    } else {
      for (auto* b : other->objects()) expectPair(managed[i], b);
    }
  }
}

// An object would remain what it was when it was registered: a floor without end, or a box.
TYPED_TEST(UnboundedShapes, MayBecomeOtherShapes) {
  using S = typename TypeParam::Scalar;
  using V = fcl::Vector3<S>;
  const std::shared_ptr<fcl::CollisionGeometry<S>> shapes[] = {
      std::make_shared<fcl::Halfspace<S>>(V(0, 0, 1), S(-0.25)),
      std::make_shared<fcl::Capsule<S>>(S(0.25), S(1)),
      std::make_shared<fcl::Plane<S>>(V(S(0.6), 0, S(0.8)), S(0.1)),
      std::make_shared<fcl::Box<S>>(S(1), S(0.5), S(0.25)),
      std::make_shared<fcl::Halfspace<S>>(V(S(0.6), S(-0.8), 0), S(0.1)),
      std::make_shared<fcl::Sphere<S>>(S(0.5)),
      std::make_shared<fcl::Cylinder<S>>(S(0.25), S(1)),
      std::make_shared<fcl::Plane<S>>(V(0, 1, 0), S(0)),
      std::make_shared<fcl::Halfspace<S>>(V(0, 0, -1), S(0.125))};
  std::vector<FiberManagerOptions> all = optionsToTest<TypeParam>(0.03);
  if (TypeParam::kVolume == LeafVolume::kBox) {
    all.push_back(all.back());
    all.back().motion = true;
  }
  for (const FiberManagerOptions& options : all) {
    for (const bool is_named : {false, true}) {
      Random random(1301);
      Scene<S> scene = strandScene<S>(4, 10, 1302), others = roomScene<S>(1303, 3);
      addShapes(scene, 6, 0.3, 1304);
      std::vector<fcl::CollisionObject<S>*> changing;
      for (std::size_t i = 0; i < 4; ++i)
        changing.push_back(scene.add(shapes[i], somePose<S>(random, 0.3)));
      Managed<TypeParam> managed(options), other(options);
      managed.registerFibers(scene);
      other.registerFibers(others);
      EXPECT_TRUE(managed.answersSelf());
      for (std::size_t step = 1; step < 7; ++step) {
        SCOPED_TRACE(describe(options) + (options.motion ? ", motion" : "") +
                     (is_named ? ", named" : "") + ", step " + std::to_string(step));
        std::vector<fcl::CollisionObject<S>*> changed;
        for (std::size_t i = 0; i < changing.size(); ++i) {
          if ((step + i) % 3 == 0) continue;
          *changing[i] = fcl::CollisionObject<S>(shapes[(i + step) % std::size(shapes)],
                                                 somePose<S>(random, 0.3));
          changed.push_back(changing[i]);
        }
        EXPECT_TRUE(managed->movedSinceUpdate());
        if (options.motion) managed->beginStep();
        if (is_named) {
          managed->update(changed);
        } else {
          managed->update();
        }
        if (options.motion) managed->endStep();
        expectWhatTouches(managed);
        expectWhatTouches(managed, &other);
        expectWhatTouches(other, &managed);
        // A new manager knows them as what they are.
        Managed<TypeParam> anew(options);
        anew.registerFibers(scene);
        EXPECT_TRUE(anew.answersSelf());
        EXPECT_TRUE(anew.answersWith(other));
        if (step % 4 == 0) managed.expectNearest();
        if (this->HasFailure()) return;
      }
    }
  }
}

// What has become unbounded, or a solid, in the tree would be taken from where it is now.
TYPED_TEST(UnboundedShapes, ThatWereSpheresKeepTheirPairsUntilTheUpdate) {
  using S = typename TypeParam::Scalar;
  using Object = fcl::CollisionObject<S>;
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  Scene<S> models;
  const Object* const sources[] = {models.addHalfspace({0.6, 0, 0.8}, 0),
                                   models.addPlane({0.6, 0, 0.8}, 0),
                                   models.addConvex({0, 0, 0}, 0.25)};
  for (const Object* source : sources) {
    SCOPED_TRACE(source->getNodeType());
    Scene<S> scene;
    Object* const object = scene.addSphere({5, 5, 5}, 0.1);
    Object* const capsule = scene.addCapsule({0, 0, 0}, {0.1, 0, 0}, 0.03125);
    const Managed<TypeParam> manager(scene, options);
    EXPECT_EQ(selfPairs(*manager).size(), 0u);
    *object = Object(*source);
    manager->update();
    EXPECT_EQ(selfPairs(*manager).size(), 1u);
    EXPECT_EQ(pairsWith(*manager, *capsule).size(), 1u);
    object->setTranslation(fcl::Vector3<S>(-10, 0, -10));
    EXPECT_EQ(selfPairs(*manager).size(), 1u) << "lost before the update";
    EXPECT_EQ(pairsWith(*manager, *capsule).size(), 1u) << "lost before the update";
  }
}

// A box beside the tree would meet by its volume in one query, and by its shape in another.
TYPED_TEST(UnboundedShapes, ThatHaveBecomeBoxesHaveTheSamePairsInEveryQuery) {
  using S = typename TypeParam::Scalar;
  using Object = fcl::CollisionObject<S>;
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.01)) {
    SCOPED_TRACE(describe(options));
    Random random(1311);
    Scene<S> scene = strandScene<S>(4, 10, 1312);
    addShapes(scene, 6, 0.3, 1313);
    Object* const object = scene.addHalfspace({0, 0, 1}, -0.25);
    const Managed<TypeParam> manager(scene, options);
    (void)selfPairs(*manager);
    std::size_t beside = 0;
    for (int i = 0; i < 6; ++i) {
      *object =
          Object(std::make_shared<fcl::Box<S>>(S(1.5), S(0.1), S(0.1)), somePose<S>(random, 0.2));
      manager->update();
      std::set<Object*> self, of_box, of_each;
      for (const auto& [a, b] : selfPairs(*manager)) {
        if (a != object && b != object) continue;
        EXPECT_TRUE(self.insert(a == object ? b : a).second);
      }
      for (const auto& [a, b] : pairsWith(*manager, *object)) of_box.insert(a);
      for (Object* one : scene.objects()) {
        if (one == object) continue;
        for (const auto& [a, b] : pairsWith(*manager, *one)) {
          if (a == object) of_each.insert(b);
        }
        if (self.count(one) == 0 && one->getAABB().overlap(object->getAABB())) ++beside;
      }
      EXPECT_TRUE(self == of_box);
      // A tree of spheres takes the box by the sphere around it, and another object meets the box.
      if (TypeParam::kVolume == LeafVolume::kBox || options.report == Report::kCapsules) {
        EXPECT_TRUE(self == of_each);
      } else {
        EXPECT_TRUE(std::includes(self.begin(), self.end(), of_each.begin(), of_each.end()));
      }
      EXPECT_FALSE(self.empty());
    }
    if (options.report == Report::kCapsules) {
      EXPECT_GT(beside, 10u);
    }
  }
}

// A straight one would be rounded to the frame of its own manager, whose fibers are far away, and
// back, and miss what it touches by a little.
TYPED_TEST(MovingUnboundedShapes, TouchByALittleWhatIsInAFarFrame) {
  using S = typename TypeParam::Scalar;
  using Object = fcl::CollisionObject<S>;
  std::size_t touching = 0;
  for (const double far : {1e6, 1e9, 1e12, 1e14}) {
    for (const Report report : {Report::kVolumes, Report::kCapsules}) {
      for (const bool moves : {false, true}) {
        if (moves && report == Report::kVolumes) continue;
        FiberManagerOptions options;
        options.report = report;
        options.motion = moves;
        SCOPED_TRACE(describe(options) + (moves ? ", motion" : "") + ", at " + std::to_string(far));
        Random random(1321);
        Scene<S> near, walls;
        std::vector<Object*> capsules;
        const double radius = 0.0625, little = std::min(0.25, 1e-12 * far);
        // Each has a wall of its own direction that it touches by a little.
        for (int i = 0; i < 48; ++i) {
          const int axis = i % 3;
          const Eigen::Vector3d normal = (i % 2 == 0 ? 1 : -1) * Eigen::Vector3d::Unit(axis);
          Eigen::Vector3d at = random.inCube(1), along = random.inCube(0.3);
          along[axis] = 0;
          capsules.push_back(near.addCapsule(at - along, at + along, radius));
          const double depth = i % 4 == 0 ? little : little * std::pow(10, -random.between(0, 4));
          const double offset = normal.dot(at) - radius + depth;
          i % 5 < 3 ? walls.addHalfspace(normal, offset) : walls.addPlane(normal, offset);
        }
        for (int i = 0; i < 20; ++i) {
          const Eigen::Vector3d at = Eigen::Vector3d(far, -far, 0.7 * far) + random.inCube(far / 4);
          walls.addCapsule(at, at + random.inCube(far / 20), far / 1000);
        }
        // From outside, for half of them.
        const auto shift = [&](double by) {
          for (std::size_t i = 0; moves && i < capsules.size(); i += 2) {
            const int axis = static_cast<int>(i % 3);
            fcl::Vector3<S> to = capsules[i]->getTranslation();
            to[axis] += S(by);
            capsules[i]->setTranslation(to);
            capsules[i]->computeAABB();
          }
        };
        shift(0.5);
        const Managed<TypeParam> first(near, options), second(walls, options);
        if (moves) {
          first->beginStep();
          second->beginStep();
        }
        shift(-0.5);
        first->update();
        second->update();
        const auto ends = [&] {
          std::vector<ExactCapsule> now;
          for (Object* capsule : capsules) now.push_back(exactCapsule(*capsule));
          return now;
        }();
        std::vector<std::pair<Object*, Object*>> expected;
        for (std::size_t w = 0; w < 48; ++w) {
          const auto distance = distanceFrom(*walls[w]);
          for (std::size_t c = 0; c < capsules.size(); ++c) {
            // Where ends are is rounded, too.
            if (distance(ends[c].a, ends[c].b) < Real(radius) - 1e-15L)
              expected.emplace_back(capsules[c], walls[w]);
          }
        }
        touching += expected.size();
        const auto with = asSet(pairsWith(*first, *second)),
                   back = asSet(pairsWith(*second, *first));
        for (const auto& [capsule, wall] : expected) {
          EXPECT_TRUE(with.count({capsule, wall}));
          EXPECT_TRUE(back.count({wall, capsule}));
          if (!moves) continue;
          TimedContact contact;
          EXPECT_TRUE(first->findImpact(capsule, wall, &*second, contact));
          EXPECT_TRUE(second->findImpact(wall, capsule, &*first, contact));
        }
      }
    }
  }
  EXPECT_GT(touching, 1000u);
}

// A floor that comes up would pass what it carries, one that passes meet all in the world, or a
// capsule pass through a box, or meet everything in the box around a tilted one.
TYPED_TEST(MovingUnboundedShapes, AreMetDuringTheWholeStep) {
  using S = typename TypeParam::Scalar;
  using Object = fcl::CollisionObject<S>;
  constexpr double kRadius = 0.03125;
  std::size_t passed = 0, beside = 0;
  for (std::uint64_t seed = 1400; seed < 1408; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    // Managers of different frames: one has walls alone or with a few of the capsules.
    const double offset = seed % 3 == 0 ? 0 : std::is_same_v<S, float> ? 3 : 100;
    const Eigen::Vector3d at(offset, -offset, 0.5 * offset);
    Scene<S> hair, walls;
    for (int i = 0; i < 24; ++i) {
      const Eigen::Vector3d from = at + random.inCube(1);
      if (i % 8 == 0) {
        hair.addSphere(from, kRadius);
      } else {
        hair.addCapsule(from, from + random.inCube(0.2), kRadius);
      }
    }
    addUnbounded(walls, 8, random, {at, 1});
    for (int i = 0; i < 4; ++i) {
      const auto pose = somePose<S>(random, 0.5);
      auto* const wall =
          i % 2 == 0 ? walls.addBox({0, 0, 0}, Eigen::Quaterniond::Identity(), {1, 0.6, 0.02})
                     : walls.add(std::make_shared<fcl::Cylinder<S>>(S(0.05), S(0.8)), pose);
      moveTo(*wall, pose);
      translate(*wall, at);
    }
    FiberManagerOptions options, its_options;
    options.report = its_options.report = Report::kCapsules;
    options.motion = its_options.motion = true;
    options.margin = seed % 4 == 1 ? 0.0625 : 0;
    its_options.margin = seed % 4 == 2 ? 0.25 : seed % 4 == 1 ? 0.015625 : 0;
    Managed<TypeParam> both(options), first(hair, options), second(walls, its_options);
    both.registerObjects(hair.objects());
    both.registerObjects(walls.objects());
    both->setup();
    for (int step = 0; step < 3; ++step) {
      both->beginStep();
      first->beginStep();
      second->beginStep();
      struct State {
        std::vector<ExactCapsule> ends;
        std::vector<fcl::Transform3<S>> poses;
        std::vector<std::function<Real(const Point&, const Point&)>> distances;
      };
      const auto state = [&] {
        State now;
        for (const Object* object : hair.objects()) now.ends.push_back(exactCapsule(*object));
        for (const Object* object : walls.objects()) {
          now.poses.push_back(object->getTransform());
          now.distances.push_back(distanceFrom(*object));
        }
        return now;
      };
      const State start = state();
      for (Object* object : hair.objects()) {
        if (random.below(4) > 0) jolt(*object, random, 0.3, 0.5);
      }
      std::vector<bool> turns;
      for (Object* object : walls.objects()) {
        const std::size_t way = random.below(3);
        turns.push_back(way == 2);
        if (way == 1) translate(*object, random.inCube(0.4));
        if (way == 2) {
          // About a point here.
          const fcl::Transform3<S> pose = object->getTransform();
          const fcl::Matrix3<S> turn = random.rotation(0.5).toRotationMatrix().template cast<S>();
          const fcl::Vector3<S> here = at.template cast<S>();
          fcl::Transform3<S> turned = pose;
          turned.linear() = turn * pose.linear();
          turned.translation() = turn * (pose.translation() - here) + here;
          moveTo(*object, turned);
        }
      }
      if (step == 1) {
        // Some are named, and the others rest where they were read.
        auto all = hair.objects();
        all.insert(all.end(), walls.objects().begin(), walls.objects().end());
        both->update(all);
        first->update(hair.objects());
        second->update(walls.objects());
      } else {
        both->update();
        first->update();
        second->update();
      }
      const State end = state();
      const auto self = asSet(selfPairs(*both)), with = asSet(pairsWith(*first, *second)),
                 back = asSet(pairsWith(*second, *first));
      EXPECT_FALSE(both->movedSinceUpdate());
      // Samples here, and a part of the way that is the library's.
      constexpr int kSamples = 64;
      const Real rounding =
          (64 * Real(std::numeric_limits<S>::epsilon()) + 1e-12L) * Real(2 + 2 * offset);
      for (std::size_t w = 0; w < walls.size(); ++w) {
        const Point shift =
            (end.poses[w].translation() - start.poses[w].translation()).template cast<Real>();
        // A cylinder counts by its boxes.
        const bool is_exact = !turns[w] && walls[w]->getNodeType() != fcl::GEOM_CYLINDER;
        for (std::size_t h = 0; h < hair.size(); ++h) {
          const Point &a = start.ends[h].a, &b = start.ends[h].b;
          const Point &c = end.ends[h].a, &d = end.ends[h].b;
          const Real at_end = end.distances[w](c, d) - Real(kRadius);
          Real least = std::min(at_end, start.distances[w](a, b) - Real(kRadius));
          const Real way = std::max((c - a).norm(), (d - b).norm()) + shift.norm();
          for (int k = 1; k < kSamples && !turns[w]; ++k) {
            const Real t = Real(k) / kSamples;
            const Point wall = (1 - t) * shift;
            least = std::min(
                least, end.distances[w]((1 - t) * a + t * c + wall, (1 - t) * b + t * d + wall) -
                           Real(kRadius));
          }
          const std::pair pair(hair[h], walls[w]), turned(walls[w], hair[h]);
          const auto expectPair = [&](const auto& found, const auto& one, double margin) {
            if (least < Real(margin) - rounding) {
              EXPECT_TRUE(found.count(one)) << "missing, " << static_cast<double>(least);
            } else if (is_exact && least > Real(margin) + rounding + way / kSamples * 2) {
              EXPECT_FALSE(found.count(one)) << "extra, " << static_cast<double>(least);
              ++beside;
            }
          };
          expectPair(self, pair, options.margin);
          expectPair(with, pair, options.margin);
          expectPair(back, turned, its_options.margin);
          passed += least < -rounding && at_end > 0 ? 1 : 0;
          if (h % 10 == 0 && !turns[w] && least < Real(options.margin) - rounding) {
            TimedContact contact;
            EXPECT_TRUE(first->findImpact(hair[h], walls[w], &*second, contact));
          }
        }
        const auto of_one = asSet(pairsWith(*both, *walls[w]));
        for (auto* object : hair.objects()) {
          EXPECT_EQ(of_one.count({object, walls[w]}), self.count({object, walls[w]}));
        }
      }
      if (this->HasFailure()) return;
    }
  }
  EXPECT_GT(passed, 50u);
  EXPECT_GT(beside, 1000u);
}

}  // namespace
}  // namespace fcl_fibers::test
