// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/shapes.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>

#include "arrays/motion.h"
#include "arrays/random_shapes.h"
#include "support/exact_geometry.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;
using Vector = Eigen::Vector3d;

template <typename S>
ExactCapsule capsuleOf(const Assembly<S>& fibers, std::int32_t segment) {
  return roundedCapsule(fibers.capsule(static_cast<std::size_t>(segment)));
}

template <typename S>
class Shapes : public testing::Test {};
TYPED_TEST_SUITE(Shapes, Scalars, ScalarName);

// A rope would fall through the floor, or be pushed by what it does not touch.
TYPED_TEST(Shapes, PairsAndContactsAreTheSegmentsThatTouch) {
  using S = TypeParam;
  const auto fibers = curledFibers<S>(61, 40);
  std::map<std::size_t, std::size_t> found_of, overlaps_of;
  for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
    for (const double margin : {0.0, 0.05}) {
      options.margin = margin;
      FiberTree tree(options);
      tree.build(fibers.view());
      Random random(62);
      for (int i = 0; i < 20; ++i) {
        for (const Shape& shape : randomShapes(random)) {
          std::vector<std::int32_t> segments;
          tree.find(Pairs{}, shape, segments);
          std::vector<std::int32_t> sorted = segments;
          std::sort(sorted.begin(), sorted.end());
          fibers.visitCapsules([&](std::size_t, std::size_t k) {
            constexpr Real kBand = 1e-13L;  // the library errs towards touching, by a few ulp
            const auto segment = static_cast<std::int32_t>(k);
            const ExactCapsule c = capsuleOf(fibers, segment);
            const Real gap = axisDistance(c.a, c.b, shape) - c.radius - margin;
            const auto times = std::count(sorted.begin(), sorted.end(), segment);
            EXPECT_LE(times, 1);
            EXPECT_TRUE(times == 1 || gap > 0) << "misses " << k << " of " << shape.index();
            EXPECT_TRUE(times == 0 || gap <= kBand) << k << " is apart by " << gap;
          });
          found_of[shape.index()] += segments.size();
          std::vector<ShapeContact> contacts;
          tree.find(Contacts{fibers.view()}, shape, contacts);
          ASSERT_EQ(contacts.size(), segments.size());
          for (std::size_t k = 0; k < contacts.size(); ++k) {
            const ShapeContact& contact = contacts[k];
            EXPECT_EQ(contact.segment, segments[k]);
            const FiberSegment place = tree.fiberSegment(contact.segment);
            EXPECT_EQ(contact.place.fiber, place.fiber);
            EXPECT_EQ(contact.place.number, place.number);
            EXPECT_NE(contact.layout, 0u);
            const ExactCapsule c = capsuleOf(fibers, contact.segment);
            const Real axes = axisDistance(c.a, c.b, shape);
            // Out of the shape the distance is that of the axis; in it, the depth is larger.
            const bool is_round = shape.index() < 2;
            if (axes > 1e-9L || is_round) {
              EXPECT_NEAR(contact.distance, static_cast<double>(axes - c.radius), 1e-14);
            } else {
              EXPECT_LE(contact.distance, static_cast<double>(-c.radius) + 1e-14);
              ++overlaps_of[shape.index()];
            }
            // A motion by the depth against the normal ends the contact.
            const test::Point move = Real(contact.distance) * toPoint(contact.normal);
            EXPECT_NEAR(static_cast<double>(axisDistance(c.a + move, c.b + move, shape)),
                        static_cast<double>(c.radius), 1e-13);
            const test::Point between = toPoint(contact.point_b) - toPoint(contact.point_a);
            EXPECT_LE((between - move).norm(), 1e-14L);
          }
        }
      }
    }
  }
  for (std::size_t kind = 0; kind < 5; ++kind) EXPECT_GT(found_of[kind], 200u) << kind;
  for (std::size_t kind = 2; kind < 5; ++kind) EXPECT_GT(overlaps_of[kind], 50u) << kind;
}

/// The distance of a capsule that moves and a shape at a time, less radius and margin.
struct Gap {
  ExactCapsule start, end;
  const Shape& shape;
  Real margin;

  Real at(Real time) const {
    const auto between = [time](const auto& p, const auto& q) { return (1 - time) * p + time * q; };
    const test::Point a = between(start.a, end.a), b = between(start.b, end.b);
    return axisDistance(a, b, shape) - between(start.radius, end.radius) - margin;
  }
  /// The fastest that it can fall.
  Real speed() const {
    return std::max((end.a - start.a).norm(), (end.b - start.b).norm()) +
           std::abs(end.radius - start.radius);
  }
  /// A time before which the two are certainly apart. It is the first touch if they come as near
  /// as this.
  Real apartUntil(Real near) const {
    Real time = 0;
    for (int step = 0; step < 20000 && time < 1; ++step) {
      const Real gap = at(time);
      if (gap <= near) return time;
      time += gap / speed();
    }
    return time;
  }
};

// A step would end in the floor, or long before it.
TYPED_TEST(Shapes, ImpactsAreTheFirstTouches) {
  using S = TypeParam;
  std::map<std::size_t, std::size_t> late_of;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const auto motion = Motion<S>::random(seed, 12, seed % 2 == 0 ? 0.6 : 0.03);
    const double margin = seed % 3 == 0 ? 0 : 0.003;
    const FiberTree tree = treeOf(motion, capsules(1, margin));
    Random random(seed + 63);
    for (int i = 0; i < 14; ++i) {
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
          const auto segment = static_cast<std::int32_t>(k);
          const Gap gap{capsuleOf(motion.start, segment), capsuleOf(motion.end, segment), shape,
                        Real(margin)};
          const auto found = times.find(segment);
          const Real apart = gap.apartUntil(1e-12L);
          if (found == times.end()) {
            EXPECT_GE(apart, 1) << "misses " << k << " of " << shape.index();
            return;
          }
          const Real time = found->second;
          EXPECT_LE(gap.at(time), kTolerance) << k << " of " << shape.index() << " at " << time;
          EXPECT_LE(time, apart + 1e-9L) << k << " of " << shape.index() << " is too late";
          late_of[shape.index()] += time > 0;
        });
      }
    }
  }
  for (std::size_t kind = 0; kind < 5; ++kind) EXPECT_GT(late_of[kind], 100u) << kind;
}

// A step would be cut short where nothing touches, or pass what touches.
TYPED_TEST(Shapes, SafeStepsEndAtTheFirstImpact) {
  using S = TypeParam;
  std::size_t cut = 0;
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    auto motion = Motion<S>::random(seed, 12, 0.6);
    Random random(seed + 64);
    for (int i = 0; i < 6; ++i) {
      for (const Shape& shape : randomShapes(random)) {
        // Nothing touches at the start: what does is taken away.
        Motion<S> apart = motion;
        for (std::size_t k = 0; k + 1 < motion.start.pointCount(); ++k) {
          const ExactCapsule c = capsuleOf(motion.start, static_cast<std::int32_t>(k));
          if (axisDistance(c.a, c.b, shape) > c.radius + 0.001) continue;
          for (auto* fibers : {&apart.start, &apart.end}) {
            for (std::size_t x = 0; x < 6; ++x) fibers->points[3 * k + x] = S(100);
          }
        }
        const FiberTree tree = treeOf(apart, capsules(1, 0));
        double first = 1;
        tree.visit(Impacts{}, shape, [&](const ShapeImpact& impact) {
          if (impact.time > 0) first = std::min(first, impact.time);
        });
        const double safe = tree.safeStep(shape);
        // Segments that lead to the far place may touch at the start.
        EXPECT_LE(safe, first + 1e-9);
        cut += safe < 1;
      }
    }
  }
  EXPECT_GT(cut, 20u);
}

FiberTree oneSegment(const std::array<double, 12>& points, double radius, double end_radius) {
  const std::size_t begin[] = {0, 2};
  FiberTree tree(capsules(1, 0));
  const FiberArrays<double> start{points.data(), 2, begin, 1, &radius},
      end{points.data() + 6, 2, begin, 1, &end_radius};
  tree.build(start);
  tree.update(start, end);
  return tree;
}

// A solver would stop at once where a rope lies on the floor, or let it sink.
TEST(Shapes, WhatTouchesAtTheStartCountsOnceItIsNearer) {
  const Shape ground = HalfSpaceShape{{0, 0, 2}, 0}, plane = PlaneShape{{0, 0, -1}, 0},
              box = BoxShape{{-5, -5, -1}, {5, 5, 0}};
  const auto step = [](double z, double dz, double radius, const Shape& shape) {
    return oneSegment({-1, 0, z, 1, 0, z, -1, 0.1, z + dz, 1, 0, z + dz}, radius, radius)
        .safeStep(shape);
  };
  for (const Shape& shape : {ground, plane, box}) {
    EXPECT_EQ(step(0.1, 0, 0.1, shape), 1) << "it slides";
    EXPECT_EQ(step(0.05, 0.1, 0.1, shape), 1) << "it leaves";
    const double sinks = step(0.05, -0.1, 0.1, shape);
    EXPECT_GT(sinks, 0);
    EXPECT_LT(sinks, 1e-8);
    EXPECT_NEAR(step(0.4, -0.6, 0.1, shape), 0.5, 1e-9);
  }
  EXPECT_EQ(oneSegment({-1, 0, 0.2, 1, 0, -0.2, -1, 0, 0.1, 1, 0, -0.3}, 0.1, 0.1).safeStep(plane),
            1);
  EXPECT_EQ(step(-0.5, 0.1, 0.1, box), 1) << "it is in the box";
  EXPECT_EQ(step(-0.5, 0.1, 0.1, ground), 1) << "it rises";
  EXPECT_LT(step(-0.5, -0.1, 0.1, ground), 1e-8);
  EXPECT_LT(oneSegment({-1, 0, 0.1, 1, 0, 0.1, -1, 0, 0.1, 1, 0, 0.1}, 0.1, 0.2).safeStep(box),
            1e-8)
      << "its radius grows";
}

// Far from the origin a rope would hover over the floor by as much as coordinates are rounded.
TEST(Shapes, ContactsFarFromTheOriginLoseNoDigits) {
  // Multiples of 2^-16, so that they are exact at both places.
  Random random(65);
  const auto rounded = [&](double half) {
    return Vector(random.inCube(half).array().unaryExpr(
        [](double x) { return std::round(x * 0x1p16) * 0x1p-16; }));
  };
  const Vector far(0x1p30, -0x1p31, 0x1p29);
  for (int i = 0; i < 200; ++i) {
    const Vector a = rounded(1), b = rounded(1), p = rounded(1), q = rounded(1);
    const Vector low = p.cwiseMin(q), high = p.cwiseMax(q), n(3, -4, 12);
    const MeshPose turned = poseOf(random.rotation(), a);
    MeshPose moved = turned;
    moved.position = coordinatesOf(a + far);
    const std::vector<std::pair<Shape, Shape>> shapes = {
        {CapsuleShape{coordinatesOf(p), coordinatesOf(q), 0.1},
         CapsuleShape{coordinatesOf(p + far), coordinatesOf(q + far), 0.1}},
        {SphereShape{coordinatesOf(p), 0.1}, SphereShape{coordinatesOf(p + far), 0.1}},
        {BoxShape{coordinatesOf(low), coordinatesOf(high)},
         BoxShape{coordinatesOf(low + far), coordinatesOf(high + far)}},
        {BoxShape{coordinatesOf(low), coordinatesOf(high), turned},
         BoxShape{coordinatesOf(low), coordinatesOf(high), moved}},
        {HalfSpaceShape{coordinatesOf(n), n.dot(p)},
         HalfSpaceShape{coordinatesOf(n), n.dot(p + far)}},
        {PlaneShape{coordinatesOf(n), n.dot(p)}, PlaneShape{coordinatesOf(n), n.dot(p + far)}}};
    const Vector a_far = a + far, b_far = b + far;
    const double radius = 0.1;
    const std::size_t begin[] = {0, 2};
    const std::array<double, 6> near_points = {a.x(), a.y(), a.z(), b.x(), b.y(), b.z()},
                                far_points = {a_far.x(), a_far.y(), a_far.z(),
                                              b_far.x(), b_far.y(), b_far.z()};
    const FiberArrays<double> near_fibers{near_points.data(), 2, begin, 1, &radius},
        far_fibers{far_points.data(), 2, begin, 1, &radius};
    for (const auto& [near_shape, far_shape] : shapes) {
      const ShapeContact near = shapeContact(near_fibers, near_shape, 0),
                         there = shapeContact(far_fibers, far_shape, 0);
      EXPECT_NEAR(near.distance, there.distance, 1e-14) << near_shape.index();
      EXPECT_LE((toPoint(near.normal) - toPoint(there.normal)).norm(), 1e-9L);
    }
  }
}

// A program would have to ask each shape by a call of its own.
TEST(Shapes, OfAnyTypeAreAskedAboutAlike) {
  const auto fibers = curledFibers<double>(66, 20);
  FiberTree tree(capsules(1, 0.01));
  tree.build(fibers.view());
  const BoxShape box{{-0.2, -0.3, -0.1}, {0.3, 0.2, 0.1}};
  std::vector<std::int32_t> one, two;
  tree.find(Pairs{}, box, one);
  tree.find(Pairs{}, Shape(box), two);
  EXPECT_EQ(one, two);
  EXPECT_FALSE(one.empty());
  std::vector<ShapeContact> written(one.size());
  tree.writeContacts(Contacts{fibers.view()}, box, one.data(), one.size(), written.data());
  for (const ShapeContact& contact : written) {
    const ShapeContact alone = shapeContact(fibers.view(), box, contact.segment);
    EXPECT_EQ(alone.distance, contact.distance);
    EXPECT_EQ(alone.point_a, contact.point_a);
  }
  // A turn by nothing changes nothing, and a sphere is a capsule without length.
  BoxShape turned = box;
  turned.pose.rotation = {0, -1, 0, 1, 0, 0, 0, 0, 1};  // x to y
  turned.low = {-0.3, -0.3, -0.1};
  turned.high = {0.2, 0.2, 0.1};
  tree.find(Pairs{}, turned, two);
  EXPECT_EQ(one, two);
  tree.find(Pairs{}, SphereShape{{0.1, 0, 0}, 0.2}, one);
  tree.find(Pairs{}, CapsuleShape{{0.1, 0, 0}, {0.1, 0, 0}, 0.2}, two);
  EXPECT_EQ(one, two);
}

// Found segments would be those of another radius, or all.
TEST(Shapes, MayBeAskedOfAnyTree) {
  const auto fibers = curledFibers<double>(67, 40);
  for (const FiberTreeOptions& options : allKinds(Report::kVolumes)) {
    FiberTreeOptions exact = options;
    exact.report = Report::kCapsules;
    FiberTree volumes(options), capsules(exact);
    std::vector<std::int32_t> found;
    volumes.find(Pairs{}, PlaneShape{{0, 0, 1}, 0}, found);
    EXPECT_TRUE(found.empty()) << "of no fibers";
    volumes.build(fibers.view());
    capsules.build(fibers.view());
    Random random(68);
    for (int i = 0; i < 10; ++i) {
      for (const Shape& shape : randomShapes(random)) {
        std::vector<std::int32_t> touching;
        volumes.find(Pairs{}, shape, found);
        capsules.find(Pairs{}, shape, touching);
        std::sort(found.begin(), found.end());
        std::sort(touching.begin(), touching.end());
        EXPECT_TRUE(std::includes(found.begin(), found.end(), touching.begin(), touching.end()));
      }
    }
    volumes.find(Pairs{}, PlaneShape{{1, 0, 0}, 0}, found);
    EXPECT_LT(found.size(), volumes.segmentCount());
    volumes.find(Pairs{}, PlaneShape{{1, 0, 0}, 9}, found);
    EXPECT_TRUE(found.empty());
    volumes.find(Pairs{}, HalfSpaceShape{{1, 0, 0}, 9}, found);
    EXPECT_EQ(found.size(), volumes.segmentCount());
  }
}

// A shape that is none would be compared with NaN, which finds all or nothing.
TEST(Shapes, ThatAreNoneAreRefusedAndNamed) {
  const auto fibers = curledFibers<double>(69, 10);
  FiberTree tree(capsules(1, 0));
  tree.build(fibers.view());
  tree.update(fibers.view(), fibers.view());
  const auto refused = [&](const Shape& shape, const std::string& text) {
    const auto expectRefused = [&](const std::string& call, const auto& ask) {
      EXPECT_THAT(ask, ThrowsMessage<std::invalid_argument>(HasSubstr(call + ": the " + text)));
    };
    std::vector<std::int32_t> segments(3);
    std::vector<ShapeContact> contacts(4);
    expectRefused("FiberTree::find(Pairs)", [&] { tree.find(Pairs{}, shape, segments); });
    expectRefused("FiberTree::find(Contacts)",
                  [&] { tree.find(Contacts{fibers.view()}, shape, contacts); });
    expectRefused("FiberTree::visit(Impacts)",
                  [&] { tree.visit(Impacts{}, shape, [](const ShapeImpact&) {}); });
    expectRefused("FiberTree::safeStep", [&] { (void)tree.safeStep(shape); });
    expectRefused("shapeContact", [&] { shapeContact(fibers.view(), shape, 0); });
    EXPECT_EQ(segments.size(), 3u);
    EXPECT_EQ(contacts.size(), 4u);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused(CapsuleShape{{0, nan, 0}, {0, 0, 0}, 1}, "capsule: start[1] is nan; give a finite");
  refused(CapsuleShape{{0, 0, 0}, {0, 0, 1e302}, 1}, "capsule: end[2] is 1e+302");
  refused(CapsuleShape{{0, 0, 0}, {0, 0, 0}, -1}, "capsule: radius is -1");
  refused(SphereShape{{INFINITY, 0, 0}, 1}, "sphere: center[0] is inf");
  refused(SphereShape{{0, 0, 0}, nan}, "sphere: radius is nan");
  refused(BoxShape{{0, 0, 0}, {1, nan, 1}}, "box: high[1] is nan");
  refused(BoxShape{{0, 2, 0}, {1, 1, 1}}, "box: low[1] is 2 and exceeds high[1], which is 1");
  BoxShape box{{0, 0, 0}, {1, 1, 1}};
  box.pose.rotation[0] = -1;
  refused(box, "box: the rotation is not orthonormal");
  box.pose = {};
  box.pose.position[2] = nan;
  refused(box, "box: the position is NaN");
  refused(HalfSpaceShape{{0, nan, 1}, 0}, "half-space: normal[1] is nan");
  refused(HalfSpaceShape{{0, 0, 0}, 0}, "half-space: normal is 0");
  refused(PlaneShape{{0, 0, 1}, INFINITY}, "plane: offset is inf");
  const std::vector<Shape> far = {
      SphereShape{{0, 0x1p1000, 0}, 1}, CapsuleShape{{0, 0, 0}, {0, 0x1p1000, 0}, 1},
      BoxShape{{0, 0, 0}, {1, 1, 0x1p1000}}, HalfSpaceShape{{0, 0, 0x1p-1000}, 1},
      PlaneShape{{0, 0, 1}, 0x1p1000}};
  for (const Shape& shape : far) {
    EXPECT_THAT([&] { tree.visit(Pairs{}, shape, [](std::int32_t) {}); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("overflow in the unit")))
        << shape.index();
  }
  FiberTreeOptions volumes = capsules(1, 0);
  volumes.report = Report::kVolumes;
  FiberTree without(volumes);
  without.build(fibers.view());
  without.update(fibers.view(), fibers.view());
  EXPECT_THAT(
      [&] {
        (void)without.safeStep(SphereShape{{0, 0, 0}, 1});
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("keeps no capsules")));
  tree.update(fibers.view());
  EXPECT_THAT(
      [&] {
        (void)tree.safeStep(SphereShape{{0, 0, 0}, 1});
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("the fibers rest")));
}

// A normal of any length means the same surface.
TEST(Shapes, NormalsOfAnyLengthAreNormals) {
  const double point[] = {0, 0, 1, 0, 0, 2};
  const std::size_t begin[] = {0, 2};
  const double radius = 0.25;
  const FiberArrays<double> fibers{point, 2, begin, 1, &radius};
  for (const double length : {1.0, 3.0, 0x1p-1000, 0x1p999, 1e-308, 5e-324}) {
    const ShapeContact c = shapeContact(fibers, HalfSpaceShape{{0, 0, length}, length / 2}, 0);
    // Half of the least number is rounded to 0.
    EXPECT_NEAR(c.distance, length / 2 == 0 ? 0.75 : 0.25, 1e-15) << length;
    EXPECT_EQ(c.normal, (std::array<double, 3>{0, 0, -1})) << length;
    EXPECT_EQ(c.s, 0);
  }
}

}  // namespace
}  // namespace fcl_fibers::test
