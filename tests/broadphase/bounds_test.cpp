// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/sphere.h>

#include "support/exact_geometry.h"
#include "support/least_box.h"
#include "support/managed.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

template <typename S>
fcl::AABB<S> tightBox(const fcl::CollisionObject<S>& object) {
  fcl::Vector3<S> half = fcl::Vector3<S>::Zero();
  if (object.getNodeType() == fcl::GEOM_CAPSULE) {
    const auto& capsule = static_cast<const fcl::Capsule<S>&>(*object.collisionGeometry());
    half = (capsule.lz / 2 * object.getRotation().col(2)).cwiseAbs();
    half.array() += capsule.radius;
  } else {
    const auto& sphere = static_cast<const fcl::Sphere<S>&>(*object.collisionGeometry());
    half.setConstant(sphere.radius);
  }
  return {object.getTranslation() - half, object.getTranslation() + half};
}

// Whether an object reaches a box. A capsule or a sphere has to by itself, as its box alone is not
// what counts among spheres.
template <typename S>
bool meets(const fcl::AABB<S>& box, const fcl::CollisionObject<S>& object) {
  const ExactBox exact{box.min_.template cast<Real>(), box.max_.template cast<Real>()};
  if (object.getNodeType() != fcl::GEOM_CAPSULE && object.getNodeType() != fcl::GEOM_SPHERE) {
    return boxGap(exact, leastBox(object)) <= 0;
  }
  const ExactCapsule capsule = exactCapsule(object);
  return segmentBoxDistance(capsule.a, capsule.b, exact) <= capsule.radius;
}

// The most that a box has beyond the least one on any side.
template <typename S>
Real largestExcess(const fcl::CollisionObject<S>& object) {
  const fcl::AABB<S>& box = object.getAABB();
  const fcl::AABB<S> tight = tightBox(object);
  const Point below = tight.min_.template cast<Real>() - box.min_.template cast<Real>(),
              above = box.max_.template cast<Real>() - tight.max_.template cast<Real>();
  return std::max({Real(0), below.maxCoeff(), above.maxCoeff()});
}

// The ways in which programs give their objects a margin. A sphere is as FCL has it in the third,
// where it is not turned.
constexpr const char* kWays[] = {"in the object's box", "in the shape's box", "in the shape's ball",
                                 "in a tight box"};
template <typename S>
void widen(fcl::CollisionObject<S>& object, int way, S margin) {
  if (way == 1) widenShape(object, double{margin});
  if (way == 2) {
    const_cast<fcl::CollisionGeometry<S>&>(*object.collisionGeometry()).aabb_radius += margin;
  }
  object.computeAABB();
  if (way == 3) aabbOf(object) = tightBox(object);
  if (way == 0 || way == 3) grow(aabbOf(object), margin);
}

template <typename S>
Scene<S> capsulesAndSpheres(std::uint64_t seed) {
  Scene<S> scene = strandScene<S>(5, 12, seed);
  Random random(seed + 1);
  for (int i = 0; i < 20; ++i) {
    scene.addSphere(random.inCube(1), random.between(0.02, 0.1));
    jolt(*scene.objects().back(), random, 0, 3);
  }
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d from = random.inCube(1);
    scene.addCapsule(from, from + random.inCube(0.2), random.between(0.01, 0.05));
  }
  return scene;
}

// Dyadic, so that radii are exact with them.
template <typename S>
S marginOf(std::size_t i) {
  return static_cast<S>(i % 3) / 64;
}

// The same capsules and spheres, thicker by each one's margin: pairs that are within their margins
// touch.
template <typename S>
Scene<S> thickened(const Scene<S>& scene) {
  Scene<S> thicker;
  for (std::size_t i = 0; i < scene.size(); ++i) {
    const auto& shape = *scene[i]->collisionGeometry();
    const double margin = double{marginOf<S>(i)};
    if (const auto* capsule = dynamic_cast<const fcl::Capsule<S>*>(&shape)) {
      thicker.addCapsule(scene[i]->getTransform(), capsule->radius + margin, capsule->lz);
    } else {
      const auto& sphere = static_cast<const fcl::Sphere<S>&>(shape);
      thicker.addSphere({0, 0, 0}, sphere.radius + margin);
      moveTo(*thicker.objects().back(), scene[i]->getTransform());
    }
  }
  return thicker;
}

template <typename S>
Calls<S> translated(const Calls<S>& calls, const Scene<S>& from, const Scene<S>& to) {
  std::unordered_map<const fcl::CollisionObject<S>*, fcl::CollisionObject<S>*> image;
  for (std::size_t i = 0; i < from.size(); ++i) image[from[i]] = to[i];
  Calls<S> result;
  for (const auto& [a, b] : calls) result.push_back({image.at(a), image.at(b)});
  return result;
}

MANAGER_SUITE(FiberBounds, FiberManagers);

template <typename S>
auto selfNumbers(const fcl::BroadPhaseCollisionManager<S>& manager, const Scene<S>& scene) {
  return numbersOf(selfPairs<S>(manager), scene.objects());
}

// A program that looks at a distance before objects touch would lose pairs in silence. A margin
// would be lost where an object has moved by less than that, without computeAABB().
TYPED_TEST(FiberBounds, AMarginInABoxIsTheObjects) {
  using S = typename TypeParam::Scalar;
  using Objects = std::vector<fcl::CollisionObject<S>*>;
  for (int way = 0; way < 4; ++way) {
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
      SCOPED_TRACE(std::string(kWays[way]) + ", " + describe(options));
      const Scene<S> scene = capsulesAndSpheres<S>(301), thicker = thickened(scene);
      for (std::size_t i = 0; i < scene.size(); ++i) widen(*scene[i], way, marginOf<S>(i));
      const auto manager = TypeParam::make(options);
      manager->registerObjects(scene.objects());
      PairOracle<S> oracle(thicker.objects(), rulesOf<TypeParam>(options));
      const auto image = [&](const Calls<S>& calls) { return translated(calls, scene, thicker); };
      EXPECT_TRUE(oracle.answersSelf(image(selfPairs<S>(*manager)), thicker.objects(),
                                     ArgumentOrder::kPromised, 100));

      // All moved by little, without computeAABB(): more may be reported, as a box is still around
      // its shape.
      const auto moveBy = [&](std::size_t i, const Eigen::Vector3d& by) {
        for (auto* object : {scene[i], thicker[i]}) {
          object->setTranslation(object->getTranslation() + by.cast<S>());
        }
      };
      Random random(302);
      for (std::size_t i = 0; i < scene.size(); ++i) moveBy(i, random.inCube(0.01));
      manager->update();
      oracle = PairOracle<S>(thicker.objects(), rulesOf<TypeParam>(options));
      const auto reported = selfNumbers<S>(*manager, scene);
      for (std::size_t i = 0; i < scene.size(); ++i) {
        for (std::size_t j = i + 1; j < scene.size(); ++j) {
          if (oracle.verdict(thicker[i], thicker[j]) != Verdict::kMust) continue;
          EXPECT_TRUE(reported.count({i, j})) << i << ", " << j;
        }
      }

      // All moved by more than their boxes are large, and these as before: no motion changes a
      // size.
      Objects moved;
      for (std::size_t i = 0; i < scene.size(); ++i) {
        moveBy(i, random.inCube(0.1) + Eigen::Vector3d::Constant(4));
        if (i % 7 == 0) moved.push_back(scene[i]);
      }
      manager->update(moved);
      manager->update();
      oracle = PairOracle<S>(thicker.objects(), rulesOf<TypeParam>(options));
      EXPECT_TRUE(oracle.answersSelf(image(selfPairs<S>(*manager)), thicker.objects(),
                                     ArgumentOrder::kPromised, 100));

      // Of one object, and of another manager with the other half.
      for (std::size_t i = 0; i < scene.size(); i += 9) {
        EXPECT_TRUE(oracle.answersBetween(image(pairsWith<S>(*manager, *scene[i])),
                                          thicker.objects(), {thicker[i]}, ArgumentOrder::kPromised,
                                          0));
      }
      const auto half = scene.objects().begin() + 50;
      const auto a = TypeParam::make(options), b = TypeParam::make(options);
      a->registerObjects(Objects(scene.objects().begin(), half));
      b->registerObjects(Objects(half, scene.objects().end()));
      const auto end = thicker.objects().begin() + 50;
      EXPECT_TRUE(oracle.answersBetween(
          image(pairsWith<S>(*a, *b)), Objects(thicker.objects().begin(), end),
          Objects(end, thicker.objects().end()), ArgumentOrder::kPromised, 20));
    }
  }
}

// Any box that FCL would find a pair by has to find it here, whatever the program does with it. If
// capsules count, they have to be as near as the box reaches beyond one of them.
TYPED_TEST(FiberBounds, ABoxAroundTheShapeFindsWhatItFindsInFcl) {
  using S = typename TypeParam::Scalar;
  using Box = fcl::AABB<S>;
  struct Widened {
    const char* how;
    void (*widen)(Box& box, fcl::CollisionGeometry<S>& shape, fcl::CollisionObject<S>& object);
  };
  constexpr S kInfinity = std::numeric_limits<S>::infinity(), kMost = std::numeric_limits<S>::max();
  const Widened kAll[] = {
      {"along x", [](Box& box, auto&, auto&) { box.max_[0] += S(0.5); }},
      {"against z", [](Box& box, auto&, auto&) { box.min_[2] -= S(0.5); }},
      {"along all three", [](Box& box, auto&, auto&) { box.max_.array() += S(0.5); }},
      {"most of all across",
       [](Box& box, auto&, auto&) {
         box.min_ -= fcl::Vector3<S>(S(0.3), S(0.3), S(0.1));
         box.max_ += fcl::Vector3<S>(S(0.3), S(0.3), S(0.1));
       }},
      {"everywhere", [](Box& box, auto&, auto&) { grow(box, kInfinity); }},
      {"as far as a plane", [](Box& box, auto&, auto&) { box.max_[1] = kMost; }},
      {"the shape's box, along x",
       [](Box&, auto& shape, auto& object) {
         shape.aabb_local.max_[0] += S(0.5);
         shape.aabb_center = shape.aabb_local.center();
         shape.aabb_radius = (shape.aabb_local.max_ - shape.aabb_center).norm();
         object.computeAABB();
       }},
  };
  for (const auto& [how, widen] : kAll) {
    for (const bool is_turned : {false, true}) {
      for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0)) {
        SCOPED_TRACE(std::string(how) + (is_turned ? ", turned, " : ", ") + describe(options));
        Random random(312);
        Scene<S> scene;
        for (int i = 0; i < 100; ++i) {
          fcl::Transform3<S> pose = somePose<S>(random, 0.6);
          if (!is_turned) pose.linear().setIdentity();
          if (i % 5 == 0) scene.addCapsule(pose, 0.05, 0.3);
          if (i % 5 == 1) scene.addCapsule(pose, 0.1, 0);
          if (i % 5 == 2) scene.add(std::make_shared<fcl::Sphere<S>>(S(0.1)), pose);
          if (i % 5 == 3) scene.add(std::make_shared<fcl::Cylinder<S>>(S(0.05), S(0.3)), pose);
          if (i % 5 == 4) scene.add(std::make_shared<fcl::Box<S>>(S(0.1), S(0.05), S(0.3)), pose);
        }
        const auto isRound = [](std::size_t i) { return i % 5 < 3; };
        for (std::size_t i = 0; i < scene.size(); i += 4) {
          widen(aabbOf(*scene[i]),
                const_cast<fcl::CollisionGeometry<S>&>(*scene[i]->collisionGeometry()), *scene[i]);
        }
        const auto manager = TypeParam::make(options);
        manager->registerObjects(scene.objects());
        const auto reported = selfNumbers<S>(*manager, scene);
        std::size_t found = 0;
        for (std::size_t i = 0; i < scene.size(); i += 4) {
          for (std::size_t j = 0; j < scene.size(); ++j) {
            if (j == i) continue;
            if (options.report == Report::kCapsules) {
              // AnUnevenExcessCountsInEveryQuery has the others.
              if (isRound(i) != isRound(j)) continue;
              if (isRound(i) && exactGap(*scene[i], *scene[j]) > largestExcess(*scene[i])) continue;
            }
            if (meets(scene[i]->getAABB(), *scene[j])) {
              EXPECT_TRUE(reported.count(std::minmax(i, j))) << i << ", " << j;
              ++found;
            }
          }
        }
        EXPECT_GT(found, 10u);
      }
    }
  }
}

// A floor would lose its margin with its size, which is that of the largest number.
TYPED_TEST(FiberBounds, PlanesAndHalfspacesKeepTheirs) {
  using S = typename TypeParam::Scalar;
  for (const double size : {1e-3, 1.0, 1e3}) {
    for (const bool is_turned : {false, true}) {
      for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0)) {
        SCOPED_TRACE(std::to_string(size) + (is_turned ? ", turned, " : ", ") + describe(options));
        Scene<S> scene;
        scene.addHalfspace({0, 0, 1}, 0);
        scene.addPlane({0, 1, 0}, 0);
        if (is_turned) {
          // Down, and about itself.
          moveTo(*scene[0], makePose<S>(Eigen::Quaterniond(0, 1, 0, 0), {0, 0, 0}));
          moveTo(*scene[1], makePose<S>(Eigen::Quaterniond(0, 0, 1, 0), {0, 0, 0}));
        }
        const double side = is_turned ? -size : size;
        scene.addCapsule(Eigen::Vector3d(0, 0.5, 0.5) * side, Eigen::Vector3d(1, 0.5, 0.5) * side,
                         0.1 * size);
        for (auto* object : {scene[0], scene[1]}) grow(aabbOf(*object), S(0.45 * size));
        auto manager = TypeParam::make(options);
        manager->registerObjects(scene.objects());
        const auto reported = selfNumbers<S>(*manager, scene);
        // FCL's box of a turned plane is open on all sides, so a program cannot widen it, and
        // capsules count by the plane itself.
        if (!(is_turned && options.report == Report::kCapsules)) {
          EXPECT_TRUE(reported.count({0, 2}) && reported.count({1, 2}));
        }

        // A plane without a margin is where it is, not where it was. A sphere around one is around
        // everything.
        if (TypeParam::kVolume == LeafVolume::kSphere && options.report == Report::kVolumes)
          continue;
        Scene<S> moved;
        moved.addPlane({0, 0, 1}, 0);
        moved.addCapsule(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(size, 0, 0), 0.1 * size);
        moved[0]->setTranslation(fcl::Vector3<S>(0, 0, S(-size)));
        manager = TypeParam::make(options);
        manager->registerObjects(moved.objects());
        EXPECT_TRUE(selfPairs<S>(*manager).empty());
      }
    }
  }
}

// Boxes that are larger would hide what is nearest.
TYPED_TEST(FiberBounds, DistancesAreThoseOfTheShapes) {
  using S = typename TypeParam::Scalar;
  for (int way = 0; way < 4; ++way) {
    SCOPED_TRACE(kWays[way]);
    Random random(303);
    Scene<S> scene;
    for (int i = 0; i < 40; ++i) {
      const Eigen::Vector3d from = 3 * random.inCube(1);
      scene.addCapsule(from, from + random.inCube(0.1), 0.01);
    }
    for (std::size_t i = 0; i < scene.size(); ++i) widen(*scene[i], way, marginOf<S>(i));
    const Managed<TypeParam> manager(scene);
    EXPECT_GT(manager.expectNearest(), 0);
    manager.expectEveryPair();
    for (auto* object : scene.objects()) manager.expectNearest(object);
  }
}

// Boxes that FCL computes, now, long ago or for another length, would become margins: in a program
// that never calls computeAABB() every capsule would meet every other one.
TYPED_TEST(FiberBounds, BoxesThatNobodyWidensAddNothing) {
  using S = typename TypeParam::Scalar;
  Random random(304);
  for (const double offset : {0.0, 1e3, 1e6}) {
    for (const double size : {1e-3, 1.0, 1e3}) {
      SCOPED_TRACE(std::to_string(offset) + ", " + std::to_string(size));
      Scene<S> scene;
      const auto pose = [&] {
        return makePose<S>(random.rotation(),
                           Eigen::Vector3d::Constant(offset) + size * random.inCube(1));
      };
      for (int i = 0; i < 100; ++i) {
        scene.addCapsule(i % 3 == 0 ? fcl::Transform3<S>::Identity() : pose(), 0.02 * size, size);
        scene.addSphere({0, 0, 0}, 0.02 * size);
      }
      Managed<TypeParam> manager;
      const auto expectNone = [&](const char* when) {
        for (auto* object : scene.objects()) EXPECT_EQ(manager->margin(object), 0) << when;
      };
      expectNone("as constructed");
      for (auto* object : scene.objects()) object->setTransform(pose());
      expectNone("moved");
      for (std::size_t i = 0; i < scene.size(); i += 2) {
        scene.capsule(i).lz = static_cast<S>(random.between(0.01, 1.5) * size);
      }
      expectNone("of other lengths");
      manager.registerObjects(scene.objects());
      EXPECT_TRUE(manager.answersSelf(0));
      for (auto* object : scene.objects()) object->computeAABB();
      expectNone("of other lengths, their boxes computed");
      for (std::size_t i = 0; i < scene.size(); i += 2) scene.capsule(i).computeLocalAABB();
      for (auto* object : scene.objects()) object->computeAABB();
      expectNone("computed in full");
      for (auto* object : scene.objects()) aabbOf(*object) = tightBox(*object);
      expectNone("tight");
      for (auto* object : scene.objects()) object->setTransform(pose());
      expectNone("tight in another pose");
      for (auto* object : scene.objects()) {
        aabbOf(*object).min_.setConstant(std::numeric_limits<S>::quiet_NaN());
      }
      expectNone("NaN");
    }
  }
}

// A margin that is measured from boxes far out would be too small by their rounding.
TYPED_TEST(FiberBounds, MarginsAreMeasuredOutward) {
  using S = typename TypeParam::Scalar;
  const double eps = double{std::numeric_limits<S>::epsilon()};
  Managed<TypeParam> manager;
  for (const double offset : {0.0, 1.0, 100.0}) {
    for (int way = 0; way < 4; ++way) {
      SCOPED_TRACE(std::string(kWays[way]) + ", " + std::to_string(offset));
      Scene<S> scene = strandScene<S>(1, 20, 305);
      for (auto* object : scene.objects()) {
        object->setTranslation(object->getTranslation().array() + S(offset));
        widen(*object, way, S(0.0625));
        EXPECT_GE(manager->margin(object), 0.0625 - 8 * eps * (1 + offset));
        EXPECT_LE(manager->margin(object), 0.0625 + 32 * eps * (1 + offset));
      }
    }
  }
}

// With other shapes, another manager or one object alone the box would count without its shape.
TYPED_TEST(FiberBounds, AnUnevenExcessCountsInEveryQuery) {
  using S = typename TypeParam::Scalar;
  using Object = fcl::CollisionObject<S>;
  for (const double margin : {0.0, 0.03}) {
    SCOPED_TRACE(margin);
    FiberManagerOptions options, its_options;
    options.report = its_options.report = Report::kCapsules;
    options.margin = margin;
    its_options.margin = 0.01;
    Scene<S> scene;
    Random random(321);
    const auto cylinder = std::make_shared<fcl::Cylinder<S>>(S(0.03), S(0.5));
    std::vector<bool> is_wide;
    for (int i = 0; i < 150; ++i) {
      const Eigen::Vector3d from = random.inCube(0.6);
      if (i % 5 < 2) scene.addCapsule(from, from + random.inCube(0.5), 0.02);
      if (i % 5 == 2) scene.addSphere(from, random.between(0.02, 0.1));
      if (i % 5 == 3) scene.addBox(from, random.rotation(), {0.5, 0.04, 0.05});
      if (i % 5 == 4) scene.add(cylinder, makePose<S>(random.rotation(), from));
      // All kinds, but of boxes and cylinders fewer.
      is_wide.push_back(i % 3 == 0 && (i % 5 < 3 || i % 2 == 0));
    }
    const auto leastOf = [](const Object& object) -> fcl::AABB<S> {
      const ExactBox least = leastBox(object);
      return {least.min.template cast<S>(), least.max.template cast<S>()};
    };
    std::vector<Real> excesses(scene.size(), 0);
    for (std::size_t i = 0; i < scene.size(); ++i) {
      if (!is_wide[i]) continue;
      fcl::AABB<S>& box = aabbOf(*scene[i]);
      const fcl::AABB<S> least = box = leastOf(*scene[i]);
      const int axis = static_cast<int>(i % 3 + i / 3) % 3;
      box.max_[axis] += S(i % 2 == 0 ? 0.4 : 0.02);
      box.min_[(axis + 1) % 3] -= S(i % 4 == 0 ? 0.1 : 0);
      excesses[i] =
          std::max((box.max_ - least.max_).maxCoeff(), (least.min_ - box.min_).maxCoeff());
    }
    const Real rounding = 64 * Real(std::numeric_limits<S>::epsilon());
    const auto boxes = [&](std::size_t i, std::size_t j) {
      const auto box = [&](std::size_t k) -> ExactBox {
        if (!is_wide[k]) return leastBox(*scene[k]);
        const fcl::AABB<S>& is = scene[k]->getAABB();
        return {is.min_.template cast<Real>(), is.max_.template cast<Real>()};
      };
      return boxGap(box(i), box(j));
    };
    const auto isRound = [&](std::size_t i) { return i % 5 < 3; };
    const auto shapes = [&](std::size_t i, std::size_t j) -> Real {
      if (isRound(i) && isRound(j)) return exactGap(*scene[i], *scene[j]);
      if (!isRound(i) && !isRound(j)) return 0;
      const Object &round = *scene[isRound(i) ? i : j], &other = *scene[isRound(i) ? j : i];
      const ExactCapsule capsule = exactCapsule(round);
      return distanceFrom(other)(capsule.a, capsule.b) - capsule.radius;
    };
    // One manager, two of all pairs between even and odd ones, and each object alone.
    const Managed<TypeParam> manager(scene, options);
    std::vector<Object*> even, odd;
    for (std::size_t i = 0; i < scene.size(); ++i) (i % 2 == 0 ? even : odd).push_back(scene[i]);
    const Managed<TypeParam> first(even, options), second(odd, its_options);
    std::set<std::pair<std::size_t, std::size_t>> of_one, self = selfNumbers<S>(*manager, scene);
    const auto numbered = [&](const Calls<S>& calls) { return numbersOf(calls, scene.objects()); };
    const auto with = numbered(pairsWith(*first, *second)),
               back = numbered(pairsWith(*second, *first));
    for (std::size_t i = 0; i < scene.size(); ++i) {
      for (const auto& pair : numbered(pairsWith(*manager, *scene[i]))) of_one.insert(pair);
      // What nobody has registered is read from itself.
      if (i % 2 == 0) continue;
      for (const auto& pair : numbered(pairsWith(*first, *scene[i]))) {
        EXPECT_TRUE(with.count(pair)) << pair.first << ", " << pair.second;
      }
    }
    int met = 0, apart = 0, apart_as_shapes = 0;
    for (std::size_t i = 0; i < scene.size(); ++i) {
      for (std::size_t j = i + 1; j < scene.size(); ++j) {
        if (!is_wide[i] && !is_wide[j]) continue;
        const Real box_gap = boxes(i, j), shape_gap = shapes(i, j) - excesses[i] - excesses[j];
        const auto expectPair = [&](const auto& found, double reach) {
          const Real most = Real(reach) + rounding, least = Real(reach) - rounding;
          if (box_gap <= least && shape_gap <= least) {
            EXPECT_TRUE(found.count({i, j})) << i << ", " << j;
            ++met;
          } else if (box_gap > most || shape_gap > most) {
            EXPECT_FALSE(found.count({i, j})) << i << ", " << j;
            ++apart;
            apart_as_shapes += box_gap <= least ? 1 : 0;
          }
        };
        expectPair(self, margin);
        expectPair(of_one, margin);
        if (i % 2 == j % 2) continue;
        expectPair(with, margin);
        expectPair(back, its_options.margin);
      }
    }
    EXPECT_GT(met, 300);
    EXPECT_GT(apart, 300);
    EXPECT_GT(apart_as_shapes, 50);
  }
}

// An object that moves within a box that a program has widened to one side would be taken from
// where it is now, and lose what it met at the last update.
TYPED_TEST(FiberBounds, AMotionWithinABoxWidenedUnevenlyIsAMotion) {
  using S = typename TypeParam::Scalar;
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  const S r = S(0.03125);
  const std::shared_ptr<fcl::CollisionGeometry<S>> shapes[] = {
      std::make_shared<fcl::Capsule<S>>(r, r), std::make_shared<fcl::Sphere<S>>(r),
      std::make_shared<fcl::Box<S>>(r, r, r), std::make_shared<fcl::Cylinder<S>>(r, r)};
  for (std::size_t kind = 0; kind < std::size(shapes); ++kind) {
    SCOPED_TRACE(kind);
    Scene<S> scene, probes;
    auto* const wide = scene.add(shapes[kind], fcl::Transform3<S>::Identity());
    // Within the excess of 1 of where it is at first, and not of where it goes.
    scene.addSphere({0.9375, 0.25, 0}, 0.015625);
    probes.addSphere({0.9375, 0.25, 0}, 0.015625);
    aabbOf(*wide).max_ += fcl::Vector3<S>(1, 1, 0);
    const Managed<TypeParam> manager(scene, options), other(probes, options);
    const auto expectPair = [&] {
      EXPECT_EQ(selfPairs(*manager).size(), 1u);
      EXPECT_EQ(pairsWith(*manager, *scene[1]).size(), 1u);
      // The two spheres are in the same place.
      EXPECT_EQ(pairsWith(*manager, *probes[0]).size(), 2u);
      EXPECT_EQ(pairsWith(*manager, *other).size(), 2u);
      EXPECT_EQ(pairsWith(*other, *manager).size(), 2u);
    };
    expectPair();
    EXPECT_FALSE(manager->movedSinceUpdate());
    wide->setTranslation(fcl::Vector3<S>(S(0.0625), S(0.9375), 0));
    EXPECT_TRUE(manager->movedSinceUpdate());
    expectPair();
    manager->update();
    EXPECT_FALSE(manager->movedSinceUpdate());
    EXPECT_EQ(selfPairs(*manager).size(), 0u) << "a scene that shows nothing";
  }
}

// A margin that is less than what rounding may add would be taken for rounding.
TYPED_TEST(FiberBounds, ALittleMarginIsNeverLost) {
  using S = typename TypeParam::Scalar;
  const double eps = double{std::numeric_limits<S>::epsilon()};
  int judged = 0;
  for (const double offset : {0.0, 1e3}) {
    for (const double margin : {1e-3, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9}) {
      // What a box of S cannot tell from none is none.
      if (margin < 64 * eps * (1 + offset)) continue;
      for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0)) {
        for (const int way : {0, 1, 3}) {  // the ball is asked of turned objects alone
          SCOPED_TRACE(describe(options) + ", offset " + std::to_string(offset) + ", margin 1e" +
                       std::to_string(static_cast<int>(std::round(std::log10(margin)))) + ", " +
                       kWays[way]);
          // Pairs along x that are apart by more than one margin, and by less than two.
          Random random(331);
          Scene<S> scene;
          const double apart = 1.5 * margin;
          for (int i = 0; i < 12; ++i) {
            const double y = offset + 2.0 * i, radius = random.between(0.1, 0.3);
            const double x = offset + random.unit();
            if (i % 2 == 0) {
              scene.addSphere({x, y, offset}, radius);
              scene.addSphere({x + 2 * radius + apart, y, offset}, radius);
            } else {
              const Eigen::Vector3d half(0, 0, random.between(0, 0.5));
              const Eigen::Vector3d a(x, y, offset), b(x + 2 * radius + apart, y, offset);
              scene.addCapsule(a - half, a + half, radius);
              scene.addCapsule(b - half, b + half, radius);
            }
          }
          for (auto* object : scene.objects()) widen(*object, way, S(margin));
          const Managed<TypeParam> manager(scene, options);
          const auto self = selfNumbers<S>(*manager, scene);
          for (std::size_t i = 0; i < scene.size(); i += 2) {
            // The poses and radii are rounded, too.
            const Real away = exactGap(*scene[i], *scene[i + 1]);
            if (away > 2 * Real(margin) - 32 * Real(eps) * Real(1 + offset)) continue;
            ++judged;
            EXPECT_TRUE(self.count({i, i + 1})) << i;
            const Calls<S> with = pairsWith(*manager, *scene[i]);
            EXPECT_EQ(std::count(with.begin(), with.end(), std::pair(scene[i + 1], scene[i])), 1);
            const Managed<TypeParam> one({scene[i]}, options), other({scene[i + 1]}, options);
            EXPECT_EQ(pairsWith(*one, *other).size(), 1u);
          }
        }
      }
    }
  }
  EXPECT_GT(judged, 100);
}

// A program that computes tight boxes itself rounds them, which would make capsules count as boxes.
TYPED_TEST(FiberBounds, TightBoxesOfAProgramAddNothing) {
  using S = typename TypeParam::Scalar;
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  for (const double offset : {0.0, 10.0, 1000.0}) {
    for (const char* made_from : {"the pose", "the points", "the points in float"}) {
      SCOPED_TRACE(std::string(made_from) + ", at " + std::to_string(offset));
      Scene<S> scene;
      Random random(313);
      constexpr int kFibers = 30, kSegments = 40;
      for (int f = 0; f < kFibers; ++f) {
        Eigen::Vector3d p = random.inCube(1).array() + offset, step = random.inCube(0.05);
        for (int i = 0; i < kSegments; ++i) {
          const Eigen::Vector3d q = p + step;
          step += random.inCube(0.02);
          scene.addCapsule(p, q, 0.02);
          Eigen::Vector3d a = p, b = q;
          if (made_from == std::string("the pose")) {
            const auto* object = scene.objects().back();
            const auto& shape = static_cast<const fcl::Capsule<S>&>(*object->collisionGeometry());
            const fcl::Vector3<S> half =
                object->getTransform().linear() * fcl::Vector3<S>(0, 0, shape.lz / 2);
            a = (object->getTranslation() - half).template cast<double>();
            b = (object->getTranslation() + half).template cast<double>();
          } else if (made_from == std::string("the points in float")) {
            a = a.cast<float>().cast<double>();
            b = b.cast<float>().cast<double>();
          }
          auto& box = aabbOf(*scene.objects().back());
          box.min_ = (a.cwiseMin(b).array() - 0.02).matrix().template cast<S>();
          box.max_ = (a.cwiseMax(b).array() + 0.02).matrix().template cast<S>();
          p = q;
        }
      }
      const auto manager = TypeParam::make(options);
      manager->registerObjects(scene.objects());
      const auto reported = selfNumbers<S>(*manager, scene);
      // Two objects, each of whose boxes may reach this much further than the shape.
      const bool is_float =
          made_from == std::string("the points in float") || std::is_same<S, float>::value;
      const Real eps = is_float ? Real(std::numeric_limits<float>::epsilon())
                                : Real(std::numeric_limits<double>::epsilon());
      const Real rounding = 16 * eps * Real(offset + 3);
      int touching = 0, boxes = 0;
      for (std::size_t i = 0; i < scene.size(); ++i) {
        for (std::size_t j = i + 1; j < scene.size(); ++j) {
          if (!scene[i]->getAABB().overlap(scene[j]->getAABB())) continue;
          const Real apart = exactGap(*scene[i], *scene[j]);
          const bool is_reported = reported.count({i, j}) > 0;
          EXPECT_TRUE(is_reported || apart > 0) << i << ", " << j;
          EXPECT_TRUE(!is_reported || apart <= rounding) << i << ", " << j << ": " << apart;
          touching += apart <= 0 ? 1 : 0;
          boxes += apart > rounding ? 1 : 0;
        }
      }
      EXPECT_GT(touching, 1000);
      EXPECT_GT(boxes, 100);
    }
  }
}

// Who says outright what counts would not get it.
TYPED_TEST(FiberBounds, AreOfShapesAloneOrOfObjectsAlone) {
  using S = typename TypeParam::Scalar;
  for (FiberManagerOptions options : optionsToTest<TypeParam>(0)) {
    SCOPED_TRACE(describe(options));
    Scene<S> scene = strandScene<S>(5, 12, 310);
    for (std::size_t i = 0; i < scene.size(); ++i) widen(*scene[i], 0, marginOf<S>(i));
    options.bounds = Bounds::kShapes;
    Managed<TypeParam> shapes(scene, options);
    EXPECT_TRUE(shapes.answersSelf());
    EXPECT_EQ(shapes->margin(scene[2]), 0);

    options.bounds = Bounds::kObjects;
    Managed<TypeParam> objects(scene, options);
    const std::size_t pairs = selfPairs<S>(*objects).size();
    EXPECT_GT(pairs, selfPairs<S>(*shapes).size());
    // The box is as it was before the motion, and says so.
    translate(*scene[0], {100, 0, 0});
    aabbOf(*scene[0]).min_.setConstant(std::numeric_limits<S>::quiet_NaN());
    EXPECT_THROW(objects->update(), std::invalid_argument);
    scene[0]->computeAABB();
    objects->update();
    EXPECT_LT(selfPairs<S>(*objects).size(), pairs);
  }
}

}  // namespace
}  // namespace fcl_fibers::test
