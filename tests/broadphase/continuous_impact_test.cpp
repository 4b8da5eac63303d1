// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "support/moving_scene.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

using testing::HasSubstr;

template <typename S>
class ContinuousImpact : public testing::Test {};
TYPED_TEST_SUITE(ContinuousImpact, Scalars, ScalarName);

/// Two spheres that move along lines.
template <typename S>
class SpherePair {
 public:
  SpherePair(const Moving<S>& a, const Moving<S>& b)
      : from_(place(a, 0) - place(b, 0)),
        along_(place(a, 1) - place(b, 1) - from_),
        radii_(radius(a) + radius(b)) {}

  /// When they first come within a margin, by the quadratic formula.
  std::optional<Real> firstTime(Real margin) const {
    const Real reach = radii_ + margin;
    const Real c = from_.squaredNorm() - reach * reach;
    if (c <= 0) return 0;
    const Real a = along_.squaredNorm(), b = from_.dot(along_), root = b * b - a * c;
    if (b >= 0 || root < 0) return std::nullopt;
    const Real time = c / (-b + std::sqrt(root));
    return time <= 1 ? std::optional<Real>(time) : std::nullopt;
  }
  Real distanceAt(Real time) const { return (from_ + time * along_).norm() - radii_; }

 private:
  static Point place(const Moving<S>& object, double t) {
    return poseAt(object, t).getTranslation().template cast<Real>();
  }
  static Real radius(const Moving<S>& object) {
    return Real(static_cast<const fcl::Sphere<S>&>(*object.collisionGeometry()).radius);
  }
  Point from_, along_;
  Real radii_;
};

// The first touch would be sought at some times only, as FCL does, or be that of another pair.
TYPED_TEST(ContinuousImpact, SpheresTouchFirstWhenTheirDistanceFallsToTheirRadii) {
  using S = TypeParam;
  Random random(831);
  MovingScene<S> scene;
  for (int i = 0; i < 60; ++i) {
    scene.addSphere(random.inCube(1), random.inCube(1), random.between(0.1, 0.3));
  }
  const auto all = scene.objects();
  const std::vector<Moving<S>*> own(all.begin(), all.begin() + 30),
      others(all.begin() + 30, all.begin() + 50);
  // That of poses, and the tolerance of an impact, which is 2^-36 of a pair's size.
  const Real rounding = 1e3 * Real(std::numeric_limits<S>::epsilon()) + 1e-9L;
  for (FiberOptions options : assortedContinuousOptions()) {
    for (const Report report : {Report::kVolumes, Report::kCapsules}) {
      options.report = report;
      Manager<S> manager(options), other(options);
      manager.registerObjects(own);
      other.registerObjects(others);
      int touching = 0;
      for (std::size_t a = 0; a < own.size(); ++a) {
        for (std::size_t b = 0; b < all.size(); ++b) {
          if (a == b) continue;
          const SpherePair<S> pair(*all[a], *all[b]);
          const auto first = pair.firstTime(Real(options.margin));
          TimedContact found;
          const bool is_found = manager.findImpact(all[a], all[b], &other, found);
          EXPECT_EQ(found.a.fiber, a);
          EXPECT_EQ(found.b.fiber, b < 30 ? b : b < 50 ? b - 30 : 0);
          if (is_found != first.has_value()) {
            Real least = std::numeric_limits<Real>::max();
            for (int k = 0; k <= 1000; ++k) {
              least = std::min(least, pair.distanceAt(Real(k) / 1000));
            }
            EXPECT_NEAR(double(least), options.margin, 1e-5) << a << ", " << b;
            continue;
          }
          if (!first) continue;
          ++touching;
          EXPECT_TRUE(found.is_exact);
          EXPECT_LE(Real(found.time), *first + rounding) << a << ", " << b;
          EXPECT_NEAR(double(pair.distanceAt(Real(found.time))), found.distance, double(rounding));
          if (*first == 0) {
            EXPECT_EQ(found.time, 0);
          } else {
            EXPECT_NEAR(found.distance, options.margin, double(rounding)) << a << ", " << b;
          }
        }
      }
      EXPECT_GT(touching, 60);
    }
  }
}

// A program would look on from a time at which the two have met already, or from the start.
TYPED_TEST(ContinuousImpact, OtherPairsTouchNoEarlierThanTheirBoxes) {
  using S = TypeParam;
  MovingScene<S> scene;
  const auto cube = std::make_shared<fcl::Box<S>>(S(1), S(1), S(1));
  Moving<S>* rests = scene.add(cube, scene.translation({0, 0, 0}, {0, 0, 0}));
  Moving<S>* passes = scene.add(cube, scene.translation({-10, 0.75, 0}, {10, -0.25, 0}));
  Moving<S>* ball = scene.addSphere({0, 0, 4}, {0, 0, -4}, 0.5);
  const auto rod = std::make_shared<fcl::Capsule<S>>(S(0.25), S(3));
  const fcl::Vector3<S> zero = fcl::Vector3<S>::Zero(), y = fcl::Vector3<S>::UnitY();
  const fcl::Vector3<S> high = fcl::Vector3<S>::UnitZ() * S(2);
  // It lies at first and stands at the end.
  Moving<S>* turns =
      scene.add(rod, std::make_shared<fcl::SplineMotion<S>>(high, high, high, high, S(2) * y,
                                                            S(1.5) * y, S(0.5) * y, zero));
  FiberOptions options;
  options.report = Report::kCapsules;
  Manager<S> manager(options);
  manager.registerObjects(scene.objects());
  TimedContact found;
  ASSERT_TRUE(manager.findImpact(rests, passes, nullptr, found));
  EXPECT_NEAR(found.time, 9.0 / 20, 1e-5);
  EXPECT_FALSE(found.is_exact);
  ASSERT_TRUE(manager.findImpact(ball, rests, nullptr, found));
  EXPECT_NEAR(found.time, 3.0 / 8, 1e-5);
  EXPECT_FALSE(found.is_exact);
  // The rod's end comes down to the cube. Its box is looser than the rod, but not at all times.
  ASSERT_TRUE(manager.findImpact(rests, turns, nullptr, found));
  EXPECT_FALSE(found.is_exact);
  const auto touches = [&](double t) { return leastBox(poseAt(*turns, t)).min[2] <= 0.5L; };
  double first = 0;
  while (first < 1 && !touches(first)) first += 1e-3;
  ASSERT_LT(first, 1);
  EXPECT_LE(found.time, first);
  EXPECT_GT(found.time, 0.1);
}

// The time would be that of motions that the tree does not have yet, or no longer.
TYPED_TEST(ContinuousImpact, ManagedObjectsCountAsTheyWereLastRead) {
  using S = TypeParam;
  MovingScene<S> scene;
  Moving<S>* target = scene.addSphere({0, 0, 0}, {0, 0, 0}, 1);
  Moving<S>* managed = scene.addSphere({6, 0, 0}, {-2, 0, 0}, 1);
  Moving<S>* stranger = scene.addSphere({6, 0, 0}, {-2, 0, 0}, 1);
  Manager<S> manager;
  manager.registerObjects({target, managed});
  const auto timeOf = [&](Moving<S>* object) {
    TimedContact contact;
    return manager.findImpact(target, object, nullptr, contact) ? contact.time : -1;
  };
  EXPECT_NEAR(timeOf(managed), 0.5, 1e-4);
  EXPECT_NEAR(timeOf(stranger), 0.5, 1e-4);
  const fcl::TranslationMotion<S> faster(fcl::Matrix3<S>(fcl::Matrix3<S>::Identity()),
                                         fcl::Vector3<S>(6, 0, 0), fcl::Vector3<S>(-10, 0, 0));
  for (Moving<S>* object : {managed, stranger}) {
    dynamic_cast<fcl::TranslationMotion<S>&>(*object->getMotion()) = faster;
  }
  EXPECT_NEAR(timeOf(managed), 0.5, 1e-4);
  EXPECT_NEAR(timeOf(stranger), 0.25, 1e-4);
  manager.update(managed);
  EXPECT_NEAR(timeOf(managed), 0.25, 1e-4);
}

// Mistakes would be answered by a time.
TYPED_TEST(ContinuousImpact, MistakesAreRefused) {
  using S = TypeParam;
  MovingScene<S> scene;
  Moving<S>* here = scene.addSphere({0, 0, 0}, {1, 0, 0}, 1);
  Moving<S>* elsewhere = scene.addSphere({0, 0, 0}, {1, 0, 0}, 1);
  Moving<S>* still = scene.add(std::make_shared<fcl::Sphere<S>>(S(1)), nullptr);
  Manager<S> manager;
  manager.registerObject(here);
  EXPECT_TRUE(manager.isRegistered(here));
  EXPECT_FALSE(manager.isRegistered(elsewhere));
  EXPECT_FALSE(manager.isRegistered(nullptr));
  const auto refusalOf = [&](const Moving<S>* a, const Moving<S>* b) {
    TimedContact contact;
    return textOf([&] { manager.findImpact(a, b, nullptr, contact); });
  };
  EXPECT_THAT(refusalOf(nullptr, here), HasSubstr("findImpact: object a is null"));
  EXPECT_THAT(refusalOf(elsewhere, here), HasSubstr("object a is not registered"));
  EXPECT_THAT(refusalOf(here, nullptr), HasSubstr("object b is null"));
  EXPECT_THAT(refusalOf(here, still), HasSubstr("object b: it has no motion"));
}

// A program that watches its memory would not see what the tree of distances takes.
TYPED_TEST(ContinuousImpact, MemoryIsThatOfAllIndexes) {
  using S = TypeParam;
  MovingScene<S> scene;
  fill(scene, 1000, {MotionKind::kTranslation}, 832);
  Manager<S> manager;
  const std::size_t empty = manager.memoryUsage();
  manager.registerObjects(scene.objects());
  const std::size_t registered = manager.memoryUsage();
  EXPECT_GE(registered, empty + scene.size() * sizeof(void*));
  manager.setup();
  const std::size_t built = manager.memoryUsage();
  // Two segments and two boxes of floats each.
  EXPECT_GE(built, registered + scene.size() * (14 * sizeof(double) + 12 * sizeof(float)));
  everyPair(manager, scene[0]);
  EXPECT_GE(manager.memoryUsage(), built + scene.size() * 6 * sizeof(float));
}

}  // namespace
}  // namespace fcl_fibers::test
