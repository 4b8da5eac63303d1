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

#include <fcl/geometry/shape/sphere.h>

#include "support/exact_geometry.h"
#include "support/managed.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

// What a subclass of CollisionObject may write.
template <typename S>
fcl::AABB<S>& boxOf(fcl::CollisionObject<S>& object) {
  struct Subclass : fcl::CollisionObject<S> {
    using fcl::CollisionObject<S>::aabb;
  };
  return object.*(&Subclass::aabb);
}

template <typename S>
void grow(fcl::AABB<S>& box, S by) {
  box.min_.array() -= by;
  box.max_.array() += by;
}

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

// Whether a capsule or a sphere reaches a box; by its own box alone it might not for spheres.
template <typename S>
bool meets(const fcl::AABB<S>& box, const fcl::CollisionObject<S>& object) {
  const fcl::AABB<S> tight = tightBox(object);
  Point half = Point::Zero();
  Real radius = Real(tight.max_[0] - tight.min_[0]) / 2;
  if (object.getNodeType() == fcl::GEOM_CAPSULE) {
    const auto& capsule = static_cast<const fcl::Capsule<S>&>(*object.collisionGeometry());
    half = Real(capsule.lz) / 2 * object.getRotation().col(2).template cast<Real>();
    radius = Real(capsule.radius);
  }
  const Point center = object.getTranslation().template cast<Real>();
  const ExactBox exact{box.min_.template cast<Real>(), box.max_.template cast<Real>()};
  return segmentBoxDistance(center - half, center + half, exact) <= radius;
}

// The ways in which programs give their objects a margin. A sphere is as FCL has it in the third,
// where it is not turned.
constexpr const char* kWays[] = {"in the object's box", "in the shape's box", "in the shape's ball",
                                 "in a tight box"};
template <typename S>
void widen(fcl::CollisionObject<S>& object, int way, S margin) {
  auto& shape = const_cast<fcl::CollisionGeometry<S>&>(*object.collisionGeometry());
  if (way == 1) {
    grow(shape.aabb_local, margin);
    shape.aabb_radius = (shape.aabb_local.max_ - shape.aabb_center).norm();
  }
  if (way == 2) shape.aabb_radius += margin;
  object.computeAABB();
  if (way == 3) boxOf(object) = tightBox(object);
  if (way == 0 || way == 3) grow(boxOf(object), margin);
}

template <typename S>
Scene<S> capsulesAndSpheres(std::uint64_t seed) {
  Scene<S> scene = strandScene<S>(5, 12, seed);
  Random random(seed + 1);
  for (int i = 0; i < 20; ++i) {
    scene.addSphere(random.inCube(1), random.between(0.02, 0.1));
    moveTo(*scene.objects().back(),
           makePose<S>(random.rotation(),
                       scene.objects().back()->getTranslation().template cast<double>()));
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

// A program that looks at a distance before objects touch would lose pairs in silence.
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

      // All moved by more than their boxes are large, and these as before: no motion changes a
      // size.
      Random random(302);
      Objects moved;
      for (std::size_t i = 0; i < scene.size(); ++i) {
        const Eigen::Vector3d by = random.inCube(0.1) + Eigen::Vector3d::Constant(4);
        for (auto* object : {scene[i], thicker[i]}) {
          object->setTranslation(object->getTranslation() + by.cast<S>());
        }
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

template <typename S>
std::set<std::pair<std::size_t, std::size_t>> selfNumbers(
    const fcl::BroadPhaseCollisionManager<S>& manager, const Scene<S>& scene) {
  std::set<std::pair<std::size_t, std::size_t>> numbers;
  for (const auto& [a, b] : selfPairs<S>(manager)) {
    const auto numberOf = [&](const auto* object) {
      const auto& all = scene.objects();
      return static_cast<std::size_t>(std::find(all.begin(), all.end(), object) - all.begin());
    };
    EXPECT_TRUE(numbers.insert(std::minmax(numberOf(a), numberOf(b))).second);
  }
  return numbers;
}

// A margin would be lost where an object has moved by less than that, without computeAABB().
TYPED_TEST(FiberBounds, AMarginOutlastsASmallMotion) {
  using S = typename TypeParam::Scalar;
  for (int way = 0; way < 4; ++way) {
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
      SCOPED_TRACE(std::string(kWays[way]) + ", " + describe(options));
      const Scene<S> scene = capsulesAndSpheres<S>(301), thicker = thickened(scene);
      for (std::size_t i = 0; i < scene.size(); ++i) widen(*scene[i], way, marginOf<S>(i));
      Random random(311);
      for (std::size_t i = 0; i < scene.size(); ++i) {
        const Eigen::Vector3d by = random.inCube(0.01);
        for (auto* object : {scene[i], thicker[i]}) {
          object->setTranslation(object->getTranslation() + by.cast<S>());
        }
      }
      const auto manager = TypeParam::make(options);
      manager->registerObjects(scene.objects());
      const auto reported = selfNumbers<S>(*manager, scene);
      const PairOracle<S> oracle(thicker.objects(), rulesOf<TypeParam>(options));
      for (std::size_t i = 0; i < scene.size(); ++i) {
        for (std::size_t j = i + 1; j < scene.size(); ++j) {
          if (oracle.verdict(thicker[i], thicker[j]) != Verdict::kMust) continue;
          EXPECT_TRUE(reported.count({i, j})) << i << ", " << j;
        }
      }
    }
  }
}

// Any box that FCL would find a pair by has to find it here, whatever the program does with it.
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
        for (int i = 0; i < 60; ++i) {
          const auto pose = makePose<S>(
              is_turned ? random.rotation() : Eigen::Quaterniond::Identity(), random.inCube(0.6));
          if (i % 3 == 0) scene.addCapsule(pose, 0.05, 0.3);
          if (i % 3 == 1) scene.addCapsule(pose, 0.1, 0);
          if (i % 3 == 2) {
            scene.addSphere({0, 0, 0}, 0.1);
            moveTo(*scene.objects().back(), pose);
          }
        }
        for (std::size_t i = 0; i < scene.size(); i += 4) {
          widen(boxOf(*scene[i]),
                const_cast<fcl::CollisionGeometry<S>&>(*scene[i]->collisionGeometry()), *scene[i]);
        }
        const auto manager = TypeParam::make(options);
        manager->registerObjects(scene.objects());
        const auto reported = selfNumbers<S>(*manager, scene);
        std::size_t found = 0;
        for (std::size_t i = 0; i < scene.size(); i += 4) {
          for (std::size_t j = 0; j < scene.size(); ++j) {
            if (j != i && meets(scene[i]->getAABB(), *scene[j])) {
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
        for (auto* object : {scene[0], scene[1]}) grow(boxOf(*object), S(0.45 * size));
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
      for (auto* object : scene.objects()) boxOf(*object) = tightBox(*object);
      expectNone("tight");
      for (auto* object : scene.objects()) object->setTransform(pose());
      expectNone("tight in another pose");
      for (auto* object : scene.objects()) {
        boxOf(*object).min_.setConstant(std::numeric_limits<S>::quiet_NaN());
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

// A box that a program stretches along a motion is larger on one side alone.
TYPED_TEST(FiberBounds, ABoxWidenedUnevenlyCountsAsItIs) {
  using S = typename TypeParam::Scalar;
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
    SCOPED_TRACE(describe(options));
    Scene<S> scene = soupScene<S>(80, 0.2, 306);
    for (std::size_t i = 0; i < scene.size(); i += 4) {
      boxOf(*scene[i]).max_[static_cast<int>(i / 4 % 3)] += S(0.5);
    }
    Managed<TypeParam> manager(scene, options);
    const auto reported = selfNumbers<S>(*manager, scene);
    int swept = 0;
    for (std::size_t i = 0; i < scene.size(); ++i) {
      for (std::size_t j = i + 1; j < scene.size(); ++j) {
        const auto box = [&](std::size_t k) {
          return k % 4 == 0 ? scene[k]->getAABB() : tightBox(*scene[k]);
        };
        if ((i % 4 != 0 && j % 4 != 0) || !box(i).overlap(box(j))) continue;
        EXPECT_TRUE(reported.count({i, j})) << i << ", " << j;
        ++swept;
      }
    }
    EXPECT_GT(swept, 10);
    EXPECT_LT(reported.size(), 80u * 79 / 8) << "a flood";
  }
}

// A head that turns without computeAABB() would be found where it was, and one of a program with a
// margin without that.
TYPED_TEST(FiberBounds, OtherShapesNeedNoComputeAABBEither) {
  using S = typename TypeParam::Scalar;
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0)) {
    for (const S margin : {S(0), S(0.0625)}) {
      SCOPED_TRACE(describe(options) + ", " + std::to_string(margin));
      Scene<S> scene = strandScene<S>(5, 12, 307), fresh = strandScene<S>(5, 12, 307);
      for (Scene<S>* s : {&scene, &fresh}) {
        addShapes(*s, 40, 0.5, 308);
        s->addHalfspace({0, 0, 1}, -0.75);
        s->addPlane({0, 1, 0}, 0.75);
      }
      for (auto* object : scene.objects()) grow(boxOf(*object), margin);
      Random random(309);
      std::vector<fcl::Transform3<S>> poses;
      for (std::size_t i = 0; i < scene.size(); ++i) {
        const bool is_unbounded = i + 2 >= scene.size();
        poses.push_back(
            makePose<S>(is_unbounded ? Eigen::Quaterniond::Identity() : random.rotation(),
                        random.inCube(is_unbounded ? 0.1 : 1)));
      }
      Managed<TypeParam> manager(scene, options);
      for (std::size_t i = 0; i < scene.size(); ++i) {
        scene[i]->setTransform(poses[i]);
        moveTo(*fresh[i], poses[i]);
        grow(boxOf(*fresh[i]), margin);
      }
      manager->update();
      const auto reported = selfNumbers<S>(*manager, scene);
      // The octahedra of meshes and convex solids have every axis in them, and boxes have more.
      std::size_t within = 0, boxes = 0;
      for (std::size_t i = 0; i < scene.size(); ++i) {
        for (std::size_t j = std::max<std::size_t>(i + 1, 60); j < scene.size(); ++j) {
          boxes += fresh[i]->getAABB().overlap(fresh[j]->getAABB());
          // Within both a ball about the middle that each shape covers and the two margins.
          const auto ball = [&](std::size_t k) {
            if (k < 60) return scene.capsule(k).radius;
            const auto& local = scene[k]->collisionGeometry()->aabb_local;
            // The plane x + y + z = r of an octahedron, and half of what an octree's cell is from
            // the middle.
            return (local.max_ - local.min_).minCoeff() / 2 * S(0.57);
          };
          if (j + 2 >= scene.size()) continue;
          const S apart = (scene[i]->getTranslation() - scene[j]->getTranslation()).norm();
          if (apart > ball(i) + ball(j) + 2 * margin) continue;
          ++within;
          EXPECT_TRUE(reported.count({i, j})) << i << ", " << j;
        }
      }
      // The floor and the wall, by where capsules end.
      for (std::size_t i = 0; i < 60; ++i) {
        const fcl::AABB<S> box = tightBox(*scene[i]);
        const S floor = S(-0.75) + poses[scene.size() - 2].translation()[2];
        const S wall = S(0.75) + poses[scene.size() - 1].translation()[1];
        if (box.min_[2] - margin <= floor) {
          EXPECT_TRUE(reported.count({i, scene.size() - 2}));
          ++within;
        }
        if (box.min_[1] - margin <= wall && box.max_[1] + margin >= wall) {
          EXPECT_TRUE(reported.count({i, scene.size() - 1}));
        }
      }
      EXPECT_GT(within, 20u);
      EXPECT_LE(reported.size(), boxes + scene.size() * 20) << "a flood";
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
    const auto reported = selfNumbers<S>(*objects, scene);
    std::size_t overlapping = 0;
    for (std::size_t i = 0; i < scene.size(); ++i) {
      for (std::size_t j = i + 1; j < scene.size(); ++j) {
        if (!scene[i]->getAABB().overlap(scene[j]->getAABB())) continue;
        ++overlapping;
        EXPECT_TRUE(reported.count({i, j})) << i << ", " << j;
      }
    }
    // Balls around boxes meet where the boxes do not.
    if (TypeParam::kVolume == LeafVolume::kBox || options.report == Report::kCapsules) {
      EXPECT_EQ(reported.size(), overlapping);
    }
    // The box is as it was before the motion, and says so.
    translate(*scene[0], {100, 0, 0});
    boxOf(*scene[0]).min_.setConstant(std::numeric_limits<S>::quiet_NaN());
    EXPECT_THROW(objects->update(), std::invalid_argument);
    scene[0]->computeAABB();
    objects->update();
    EXPECT_LT(selfPairs<S>(*objects).size(), reported.size());
  }
}

}  // namespace
}  // namespace fcl_fibers::test
