// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/triangle_p.h>
#include <fcl_fibers/contact_collector.h>

#include "support/drift.h"
#include "support/least_box.h"
#include "support/managed.h"
#include "support/mesh_models.h"
#include "support/text_of.h"

namespace fcl_fibers::test {
namespace {

MANAGER_SUITE(DriftedPoses, FiberManagers);
MANAGER_SUITE(DriftedSteps, LayeredManagers);

template <typename S>
fcl::Transform3<S> poseOf(const Eigen::Matrix<S, 3, 3>& rotation, const Eigen::Vector3d& position) {
  fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
  pose.linear() = rotation;
  pose.translation() = position.template cast<S>();
  return pose;
}

constexpr int kShapes = 10;

template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> makeShape(int kind, Random& random) {
  const auto side = [&] { return static_cast<S>(random.between(0.05, 0.6)); };
  const fcl::Vector3<S> normal = random.direction().template cast<S>();
  switch (kind) {
    case 0:
      return std::make_shared<fcl::Box<S>>(side(), side(), side());
    case 1:
      return std::make_shared<fcl::Cylinder<S>>(side(), side());
    case 2:
      return std::make_shared<fcl::Cone<S>>(side(), side());
    case 3:
      return std::make_shared<fcl::Ellipsoid<S>>(side(), side(), side());
    case 4:
      return std::make_shared<fcl::Plane<S>>(normal, static_cast<S>(random.between(-1, 1)));
    case 5:
      return std::make_shared<fcl::Halfspace<S>>(normal, static_cast<S>(random.between(-1, 1)));
    case 6: {
      const auto corner = [&]() -> fcl::Vector3<S> {
        return random.inCube(0.5).template cast<S>();
      };
      return std::make_shared<fcl::TriangleP<S>>(corner(), corner(), corner());
    }
    case 7: {
      const auto corners = std::make_shared<std::vector<fcl::Vector3<S>>>();
      for (int i = 0; i < 4; ++i) corners->push_back(random.inCube(0.5).template cast<S>());
      const auto faces = std::make_shared<std::vector<int>>(
          std::vector<int>{3, 0, 1, 2, 3, 0, 3, 1, 3, 1, 3, 2, 3, 2, 3, 0});
      return std::make_shared<fcl::Convex<S>>(corners, 4, faces);
    }
    default:
      return makeModel<S>(kind == 8 ? fcl::BV_AABB : fcl::BV_OBBRSS, blob(0.4, 0.1, 8, 6));
  }
}

/// Shapes of all kinds, and capsules and spheres that touch one of them or a capsule, or miss it,
/// by 1e-5 of their distance: much less than if a matrix were made a rotation.
template <typename S>
Scene<S> closeScene(Drift drift, std::uint64_t seed) {
  Random random(seed);
  Scene<S> scene;
  const auto pose = [&](const Eigen::Vector3d& position) {
    const Eigen::Matrix<S, 3, 3> rotation = driftedRotation<S>(drift, random);
    EXPECT_LT(driftOf(rotation), 1e-3);
    return poseOf<S>(rotation, position);
  };
  for (int kind = 0; kind < kShapes; ++kind) {
    // Away from the others, so that few capsules meet what they are not made for.
    scene.add(makeShape<S>(kind, random), pose(Eigen::Vector3d(3.0 * kind, 0, 0)));
  }
  for (int i = 0; i < 4; ++i) {
    scene.addCapsule(pose(Eigen::Vector3d(3.0 * i, 6, 0)), 0.01, random.between(0.5, 1));
  }
  const std::size_t others = scene.size();
  for (std::size_t i = 0; i < others; ++i) {
    const fcl::CollisionObject<S>& other = *scene[i];
    for (int k = 0; k < 6; ++k) {
      const S length = static_cast<S>(k == 0 ? 0 : random.between(0.5, 1));
      const Eigen::Vector3d direction = random.direction();
      const Eigen::Vector3d away = random.between(0.3, 1) * direction;
      const fcl::Transform3<S> at = pose(other.getTranslation().template cast<double>() + away);
      const fcl::CollisionObject<S> thin(std::make_shared<fcl::Capsule<S>>(S(0), length), at);
      const ExactCapsule axis = exactCapsule(thin);
      const Real distance = other.getNodeType() == fcl::GEOM_CAPSULE
                                ? exactGap(thin, other)
                                : distanceFrom(other)(axis.a, axis.b);
      if (!(distance > 1e-3)) continue;
      const double radius = static_cast<double>(distance) * (k % 2 == 0 ? 1 - 1e-5 : 1 + 1e-5);
      if (length > 0) scene.addCapsule(at, radius, double{length});
      if (length == 0) moveTo(*scene.addSphere({0, 0, 0}, radius), at);
    }
  }
  return scene;
}

// Programs whose matrices are products, or come from quaternions of few digits, would be refused
// in the middle of a run. Or objects would be where no matrix puts them.
TYPED_TEST(DriftedPoses, AreTakenAsTheyAre) {
  using S = typename TypeParam::Scalar;
  for (const Drift drift : kDrifts) {
    const Scene<S> scene = closeScene<S>(drift, 41);
    ASSERT_GT(scene.size(), 50u);
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
      SCOPED_TRACE(std::string(kDriftNames[static_cast<int>(drift)]) + ", " + describe(options));
      const Managed<TypeParam> manager(scene, options);
      EXPECT_TRUE(manager.answersSelf(30));
    }
  }
}

// The calls that read one object would judge its pose in another way.
TYPED_TEST(DriftedPoses, AreTakenByUpdatesAndAsPartners) {
  using S = typename TypeParam::Scalar;
  for (const Drift drift : {Drift::kDigits4, Drift::kSheared}) {
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0)) {
      SCOPED_TRACE(std::string(kDriftNames[static_cast<int>(drift)]) + ", " + describe(options));
      const Scene<S> scene = closeScene<S>(drift, 42), partners = closeScene<S>(drift, 42);
      std::vector<fcl::Transform3<S>> poses;
      Random random(43);
      for (auto* object : scene.objects()) {
        poses.push_back(object->getTransform());
        moveTo(*object, somePose<S>(random, 5));
      }
      const Managed<TypeParam> manager(scene, options);
      for (std::size_t i = 0; i < scene.size(); ++i) {
        // Without computeAABB(), which is not asked for.
        scene[i]->setTransform(poses[i]);
        manager->update(scene[i]);
      }
      EXPECT_TRUE(manager.answersSelf(30));
      manager->update();
      manager.expectAnswersWith(partners.objects());
      Managed<TypeParam> other(partners, options);
      EXPECT_TRUE(manager.answersWith(other, 30));
    }
  }
}

// What is in a solid that has drifted would be outside of it.
TYPED_TEST(DriftedPoses, ASolidHasItsInside) {
  using S = typename TypeParam::Scalar;
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  Random random(44);
  for (int round = 0; round < 10; ++round) {
    Scene<S> scene;
    auto* solid = scene.add(makeModel<S>(fcl::BV_OBBRSS, blob(1, 0, 16, 12)),
                            poseOf<S>(driftedRotation<S>(Drift::kSheared, random), {3, 2, 1}));
    for (int i = 0; i < 20; ++i) {
      const double away = i % 2 == 0 ? random.between(0, 0.8) : random.between(1.2, 2);
      scene.addCapsule(poseOf<S>(driftedRotation<S>(Drift::kSheared, random),
                                 Eigen::Vector3d(3, 2, 1) + away * random.direction()),
                       1e-3, 0.1);
    }
    const auto manager = TypeParam::make(options);
    manager->registerObstacle(solid, ObstacleOptions{true});
    const std::vector<fcl::CollisionObject<S>*> capsules(scene.objects().begin() + 1,
                                                         scene.objects().end());
    manager->registerObjects(capsules);
    std::set<const fcl::CollisionObject<S>*> found;
    for (const auto& [a, b] : selfPairs<S>(*manager)) {
      if (a == solid || b == solid) found.insert(a == solid ? b : a);
    }
    for (std::size_t i = 0; i < capsules.size(); ++i) {
      EXPECT_EQ(found.count(capsules[i]), i % 2 == 0 ? 1u : 0u) << i;
      EXPECT_EQ(pairsWith<S>(*manager, *capsules[i]).size() > 0, i % 2 == 0) << i;
    }
  }
}

// A step from one drifted pose to another would end where no matrix puts the object.
TYPED_TEST(DriftedSteps, EndAtTheMatricesAsTheyAre) {
  using S = typename TypeParam::Scalar;
  for (const double margin : {0.0, 0.03}) {
    FiberManagerOptions options;
    options.report = Report::kCapsules;
    options.margin = margin;
    SCOPED_TRACE(describe(options));
    const Scene<S> scene = closeScene<S>(Drift::kSheared, 46);
    const auto at_end = TypeParam::make(options);
    at_end->registerObjects(scene.objects());
    const Calls<S> due = selfPairs<S>(*at_end);
    EXPECT_GT(due.size(), 30u);
    std::vector<fcl::Transform3<S>> poses;
    Random random(47);
    for (auto* object : scene.objects()) {
      poses.push_back(object->getTransform());
      moveTo(*object, poseOf<S>(driftedRotation<S>(Drift::kSheared, random),
                                object->getTranslation().template cast<double>() +
                                    Eigen::Vector3d(0, 50 * random.unit(), 0)));
    }
    options.motion = true;
    const auto manager = TypeParam::make(options);
    manager->registerObjects(scene.objects());
    EXPECT_LT(selfPairs<S>(*manager).size(), due.size());
    manager->beginStep();
    for (std::size_t i = 0; i < scene.size(); ++i) scene[i]->setTransform(poses[i]);
    manager->update();
    const Calls<S> calls = selfPairs<S>(*manager);
    const std::set<typename Calls<S>::value_type> found(calls.begin(), calls.end());
    for (const auto& pair : due) EXPECT_EQ(found.count(pair), 1u);
  }
}

// Contacts would be of other shapes than those that touch.
TYPED_TEST(DriftedPoses, HaveContactsOfTheirShapes) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = closeScene<S>(Drift::kSheared, 48);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  const auto isCapsule = [](const fcl::CollisionObject<S>& object) {
    return object.getNodeType() == fcl::GEOM_CAPSULE;
  };
  std::size_t pairs = 0, with_mesh = 0;
  for (std::size_t i = 0; i < scene.size(); ++i) {
    if (!isCapsule(*scene[i])) continue;
    const ExactCapsule capsule = exactCapsule(*scene[i]);
    for (std::size_t j = 0; j < scene.size(); ++j) {
      // A few ulp of coordinates of about 30.
      constexpr double kRounding = 1e-13;
      if (isCapsule(*scene[j]) && i != j) {
        EXPECT_NEAR(capsuleContact(*scene[i], *scene[j]).distance,
                    double(exactGap(*scene[i], *scene[j])), kRounding);
        ++pairs;
      } else if (scene[j]->getObjectType() == fcl::OT_BVH) {
        std::vector<MeshContact> contacts;
        ASSERT_TRUE(manager->findMeshContacts(scene[i], scene[j], 0, contacts));
        double least = std::numeric_limits<double>::infinity();
        for (const MeshContact& contact : contacts) least = std::min(least, contact.distance);
        const Real distance = distanceFrom(*scene[j])(capsule.a, capsule.b) - capsule.radius;
        EXPECT_NEAR(least, double(distance), kRounding);
        ++with_mesh;
      }
    }
  }
  EXPECT_GT(pairs, 1000u);
  EXPECT_GT(with_mesh, 80u);
}

// What is no rotation would be at a place or of a size that nobody meant.
TYPED_TEST(DriftedPoses, BeyondAThousandthAreRefused) {
  using S = typename TypeParam::Scalar;
  using Matrix = Eigen::Matrix<S, 3, 3>;
  Random random(45);
  const auto turned = [&](const Matrix& matrix) -> Matrix {
    return random.rotation().toRotationMatrix().template cast<S>() * matrix;
  };
  const Matrix identity = Matrix::Identity();
  Matrix sheared = identity, mirrored = identity, drifted_mirror = identity * S(1 + 3e-4);
  sheared(0, 1) = S(2e-3);
  mirrored(2, 2) = -1;
  drifted_mirror(0, 0) *= -1;
  Matrix third_is_long = identity;
  third_is_long(2, 2) = S(1.001);
  Matrix unset = identity, infinite = identity;
  unset(0, 2) = std::numeric_limits<S>::quiet_NaN();
  infinite(1, 1) = std::numeric_limits<S>::infinity();
  const std::string no_rotation = "rotation is not orthonormal or is a reflection";
  const std::string no_number = "pose is NaN or infinite";
  const std::pair<Matrix, std::string> cases[] = {{identity * S(1.001), no_rotation},
                                                  {identity * S(0.999), no_rotation},
                                                  {turned(identity * S(1.001)), no_rotation},
                                                  {turned(identity * S(0.999)), no_rotation},
                                                  {sheared, no_rotation},
                                                  {turned(sheared), no_rotation},
                                                  {mirrored, no_rotation},
                                                  {turned(mirrored), no_rotation},
                                                  {turned(drifted_mirror), no_rotation},
                                                  {-identity, no_rotation},
                                                  {third_is_long, no_rotation},
                                                  {Matrix::Zero(), no_rotation},
                                                  {unset, no_number},
                                                  {infinite, no_number}};
  Scene<S> shapes;
  for (int i = 0; i < 8; ++i) shapes.addCapsule({0.0, 0.1 * i, 0}, {1, 0, 0.1 * i}, 0.1);
  shapes.addSphere({0, 0, 0}, 0.5);
  for (int kind = 0; kind < kShapes; ++kind) {
    shapes.add(makeShape<S>(kind, random), poseOf<S>(identity, random.inCube(1)));
  }
  for (std::size_t c = 0; c < std::size(cases); ++c) {
    for (std::size_t i = 3; i < shapes.size(); ++i) {
      SCOPED_TRACE("matrix " + std::to_string(c) + ", object " + std::to_string(i));
      fcl::CollisionObject<S>* object = shapes[i];
      const fcl::Transform3<S> before = object->getTransform();
      const fcl::Transform3<S> wrong =
          poseOf<S>(cases[c].first, before.translation().template cast<double>());
      const auto registered = TypeParam::make();
      registered->registerObjects(shapes.objects());
      registered->setup();
      object->setTransform(wrong);
      const std::string& text = cases[c].second;
      const auto empty = TypeParam::make();
      expectRefusal([&] { empty->registerObjects(shapes.objects()); }, text);
      expectRefusal([&] { empty->registerObject(object); }, text);
      EXPECT_TRUE(empty->empty());
      expectRefusal([&] { registered->update(object); }, text);
      expectRefusal([&] { registered->update(); }, text);
      object->setTransform(before);
      registered->update();
      object->setTransform(wrong);
      fcl::CollisionObject<S> partner(*object);
      expectRefusal([&] { pairsWith<S>(*registered, partner); }, text);
      object->setTransform(before);
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::test
