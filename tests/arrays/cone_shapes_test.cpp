// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/shapes.h>

#include "arrays/motion.h"
#include "arrays/random_shapes.h"
#include "arrays/tapered_fibers.h"
#include "support/least_of_convex.h"
#include "support/scalars.h"

// Fibers with a radius at each point, so that their segments are rounded cones, and shapes.
namespace fcl_fibers::test {
namespace {

/// The distance by its definition: the least over all balls. It is some value that is not positive
/// if the axis reaches into the shape.
Real distanceOf(const Cone& cone, const Shape& shape) {
  return leastOfConvex([&](Real s) {
    const test::Point center = (1 - s) * cone.a + s * cone.b;
    return axisDistance(center, center, shape) - ((1 - s) * cone.at_a + s * cone.at_b);
  });
}

template <typename S>
class ConeShapes : public testing::Test {};
TYPED_TEST_SUITE(ConeShapes, Scalars, ScalarName);

// A tapered rope would be met by the capsules around its segments.
TYPED_TEST(ConeShapes, PairsAndContactsAreTheConesThatTouch) {
  using S = TypeParam;
  const auto fibers = taperedFibers<S>(161, 25);
  std::map<std::size_t, std::size_t> found_of, spared_of;
  for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
    for (const double margin : {0.0, 0.02}) {
      options.margin = margin;
      FiberTree tree(options);
      tree.build(fibers.view());
      Random random(162);
      for (int i = 0; i < 4; ++i) {
        for (const Shape& shape : randomShapes(random)) {
          std::vector<std::int32_t> segments;
          tree.find(Pairs{}, shape, segments);
          std::vector<std::int32_t> sorted = segments;
          std::sort(sorted.begin(), sorted.end());
          fibers.visitCapsules([&](std::size_t, std::size_t k) {
            const Cone cone = coneOf(fibers, k);
            const auto times =
                std::count(sorted.begin(), sorted.end(), static_cast<std::int32_t>(k));
            EXPECT_LE(times, 1);
            const Real axis = axisDistance(cone.a, cone.b, shape);
            const Real around = axis - cone.thickest() - margin;
            if (around > 1e-9L) {
              EXPECT_EQ(times, 0) << k;
              return;
            }
            constexpr Real kBand = 1e-13L;  // the library errs towards touching, by a few ulp
            const Real gap = distanceOf(cone, shape) - margin;
            EXPECT_TRUE(times == 1 || gap > 0) << "misses " << k << " of " << shape.index();
            EXPECT_TRUE(times == 0 || gap <= kBand) << k << " is apart by " << gap;
            spared_of[shape.index()] += times == 0;
          });
          found_of[shape.index()] += segments.size();
          std::vector<ShapeContact> contacts;
          tree.find(Contacts{fibers.view()}, shape, contacts);
          ASSERT_EQ(contacts.size(), segments.size());
          for (const ShapeContact& contact : contacts) {
            const Cone cone = coneOf(fibers, static_cast<std::size_t>(contact.segment));
            if (axisDistance(cone.a, cone.b, shape) > 1e-9L) {
              EXPECT_NEAR(contact.distance, static_cast<double>(distanceOf(cone, shape)), 1e-14);
            }
            // A motion by the depth against the normal ends the contact.
            const test::Point move = Real(contact.distance) * toPoint(contact.normal);
            const Cone moved{cone.a + move, cone.b + move, cone.at_a, cone.at_b};
            EXPECT_NEAR(static_cast<double>(distanceOf(moved, shape)), 0, 1e-13)
                << contact.segment << " of " << shape.index();
            const test::Point between = toPoint(contact.point_b) - toPoint(contact.point_a);
            EXPECT_LE((between - move).norm(), 1e-13L);
            const Real radius = (1 - contact.s) * cone.at_a + contact.s * cone.at_b;
            const test::Point on_cone = (1 - Real(contact.s)) * cone.a + Real(contact.s) * cone.b +
                                        radius * toPoint(contact.normal);
            EXPECT_LE((on_cone - toPoint(contact.point_a)).norm(), 1e-14L);
          }
        }
      }
    }
  }
  for (std::size_t kind = 0; kind < 5; ++kind) EXPECT_GT(found_of[kind], 200u) << kind;
  for (std::size_t kind = 0; kind < 5; ++kind) EXPECT_GT(spared_of[kind], 50u) << kind;
}

/// A cone in motion, and a shape.
struct Step {
  Cone start, end;
  const Shape& shape;
  Real margin;

  Cone at(Real time) const {
    const auto between = [time](const auto& p, const auto& q) { return (1 - time) * p + time * q; };
    return {between(start.a, end.a), between(start.b, end.b), between(start.at_a, end.at_a),
            between(start.at_b, end.at_b)};
  }
  Real gapAt(Real time) const { return distanceOf(at(time), shape) - margin; }
  /// At most that, and quickly found.
  Real leastGapAt(Real time) const {
    const Cone cone = at(time);
    return axisDistance(cone.a, cone.b, shape) - cone.thickest() - margin;
  }
  /// The fastest that it can fall.
  Real speed() const {
    return std::max((end.a - start.a).norm() + std::abs(end.at_a - start.at_a),
                    (end.b - start.b).norm() + std::abs(end.at_b - start.at_b));
  }
  /// A time before which the two are certainly apart. It is the first touch if they come as near
  /// as this.
  Real apartUntil(Real near) const {
    Real time = 0;
    for (int step = 0; step < 3000 && time < 1; ++step) {
      Real gap = leastGapAt(time);
      if (gap <= 0.01L) gap = gapAt(time);
      if (gap <= near) return time;
      time += gap / speed();
    }
    return time;
  }
};

template <typename S>
Motion<S> taperedMotion(std::uint64_t seed, int fibers, double away) {
  auto motion = Motion<S>::random(seed, fibers, away);
  motion.start.radii = motion.end.radii = taperedFibers<S>(seed, fibers).radii;
  motion.start.radii_are = motion.end.radii_are = FiberArrays<S>::Radii::kPerPoint;
  for (std::size_t i = 0; i < motion.end.radii.size(); i += 3) motion.end.radii[i] += S(0.03);
  return motion;
}

// A step would end in the floor, or long before it.
TYPED_TEST(ConeShapes, ImpactsAreTheFirstTouches) {
  using S = TypeParam;
  std::map<std::size_t, std::size_t> late_of;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const auto motion = taperedMotion<S>(seed, 10, seed % 2 == 0 ? 0.6 : 0.03);
    const double margin = seed % 3 == 0 ? 0 : 0.003;
    const FiberTree tree = treeOf(motion, capsules(1, margin));
    Random random(seed + 163);
    for (int i = 0; i < 4; ++i) {
      for (const Shape& shape : randomShapes(random)) {
        std::map<std::int32_t, double> times;
        tree.visit(Impacts{}, shape, [&](const ShapeImpact& impact) {
          EXPECT_TRUE(times.emplace(impact.segment, impact.time).second) << "twice";
          const ShapeContact contact =
              impactContact(motion.start.view(), motion.end.view(), shape, impact);
          EXPECT_LE(contact.distance, margin + kTolerance);
          if (impact.time > 0) {
            EXPECT_GE(contact.distance, margin - kTolerance) << "too late";
          }
        });
        motion.start.visitCapsules([&](std::size_t, std::size_t k) {
          const Step step{coneOf(motion.start, k), coneOf(motion.end, k), shape, Real(margin)};
          const auto found = times.find(static_cast<std::int32_t>(k));
          const Real apart = step.apartUntil(1e-12L);
          if (found == times.end()) {
            EXPECT_GE(apart, 1) << "misses " << k << " of " << shape.index();
            return;
          }
          const Real time = found->second;
          EXPECT_LE(step.gapAt(time), kTolerance) << k << " of " << shape.index() << " at " << time;
          // Where they graze, they stay about as near for long.
          for (int part = 0; part < 4 && time > apart; ++part) {
            const Real before = apart + Real(part) / 4 * (time - apart);
            EXPECT_GE(step.gapAt(before), -kTolerance) << k << " of " << shape.index();
          }
          late_of[shape.index()] += time > 0;
        });
      }
    }
  }
  for (std::size_t kind = 0; kind < 5; ++kind) EXPECT_GT(late_of[kind], 20u) << kind;
}

/// One segment that moves by (0, 0, way), its radii given at the start and at the end.
double safeStepOf(const std::array<double, 6>& points, double way,
                  const std::array<double, 4>& radii, const Shape& shape) {
  std::array<double, 6> moved = points;
  moved[2] += way;
  moved[5] += way;
  const std::size_t begin[] = {0, 2};
  constexpr auto kPerPoint = FiberArrays<double>::Radii::kPerPoint;
  const FiberArrays<double> start{points.data(), 2, begin, 1, radii.data(), kPerPoint},
      end{moved.data(), 2, begin, 1, radii.data() + 2, kPerPoint};
  FiberTree tree(capsules(1, 0));
  tree.build(start);
  tree.update(start, end);
  return tree.safeStep(shape);
}

// A solver would stop a rope that lies on the floor at its thick end, or let it sink.
TEST(ConeShapes, StepsEndWhereTheThickEndArrives) {
  const Shape ground = HalfSpaceShape{{0, 0, 2}, 0}, plane = PlaneShape{{0, 0, -1}, 0},
              box = BoxShape{{-5, -5, -1}, {5, 5, 0}};
  const std::array<double, 4> thin_to_thick = {0.1, 0.3, 0.1, 0.3};
  const auto lying = [](double z) { return std::array<double, 6>{-1, 0, z, 1, 0, z}; };
  for (const Shape& shape : {ground, plane, box}) {
    EXPECT_NEAR(safeStepOf(lying(0.6), -0.6, thin_to_thick, shape), 0.5, 1e-9);
    EXPECT_EQ(safeStepOf(lying(0.31), -0.005, thin_to_thick, shape), 1);
    EXPECT_EQ(safeStepOf(lying(0.3), 0, thin_to_thick, shape), 1) << "it rests";
    EXPECT_EQ(safeStepOf(lying(0.25), 0.1, thin_to_thick, shape), 1) << "it leaves";
    EXPECT_LT(safeStepOf(lying(0.25), -0.1, thin_to_thick, shape), 1e-8) << "it sinks";
    // Tilted so that both ends lie on it; only the radius of one grows.
    const std::array<double, 6> tilted = {-1, 0, 0.1, 1, 0, 0.3};
    EXPECT_EQ(safeStepOf(tilted, 0, thin_to_thick, shape), 1);
    EXPECT_LT(safeStepOf(tilted, 0, {0.1, 0.3, 0.2, 0.3}, shape), 1e-8) << "it grows";
    EXPECT_NEAR(safeStepOf(lying(0.6), 0, {0.1, 0.3, 0.1, 0.9}, shape), 0.5, 1e-9) << "it grows";
  }
  EXPECT_EQ(safeStepOf({-1, 0, -0.5, 1, 0, -0.5}, -0.1, thin_to_thick, box), 1) << "it is inside";
}

}  // namespace
}  // namespace fcl_fibers::test
