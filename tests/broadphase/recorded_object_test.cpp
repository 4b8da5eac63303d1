// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/recorded_object.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/geometry/shape/triangle_p.h>

#include "support/scalars.h"

namespace fcl_fibers::broadphase {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::uint64_t bitsOf(double number) {
  std::uint64_t bits;
  std::memcpy(&bits, &number, sizeof(bits));
  return bits;
}

// A replay would have another pose than the program.
TEST(RecordedNumbers, ComeBackToTheLastBit) {
  std::mt19937_64 random(4801);
  std::vector<double> numbers = {0.0,
                                 -0.0,
                                 1,
                                 -2,
                                 0x1p53,
                                 0x1.fffffffffffffp52,
                                 kInfinity,
                                 -kInfinity,
                                 std::numeric_limits<double>::denorm_min(),
                                 std::numeric_limits<double>::min(),
                                 std::numeric_limits<double>::max()};
  for (int i = 0; i < 20000; ++i) {
    const std::uint64_t bits = random();
    double number;
    std::memcpy(&number, &bits, sizeof(number));
    if (!std::isnan(number)) numbers.push_back(number);
  }
  for (const double number : numbers) {
    std::string text;
    appendNumber(text, number);
    double read = 7;
    ASSERT_TRUE(readNumber(text.substr(1), read)) << text;
    EXPECT_EQ(bitsOf(read), bitsOf(number)) << text;
  }
  std::string text;
  appendNumber(text, std::nan(""));
  double read = 7;
  EXPECT_TRUE(readNumber(text.substr(1), read));
  EXPECT_TRUE(std::isnan(read));
}

// A damaged number would be taken for another one.
TEST(RecordedNumbers, AreRefusedIfTheyAreNone) {
  double number = 0;
  for (const char* const word : {"", "-", "--1", "p1", "1p", "1p1p1", "1.5", "0x1", "1e5", "+1",
                                 " 1", "1 ", "infinity", "9007199254740993", "1p99999999999"}) {
    EXPECT_FALSE(readNumber(word, number)) << word;
  }
}

template <typename S>
class RecordedShapes : public testing::Test {};
TYPED_TEST_SUITE(RecordedShapes, test::Scalars, test::ScalarName);

template <typename S>
std::vector<std::shared_ptr<fcl::CollisionGeometry<S>>> eachShape() {
  using Point = fcl::Vector3<S>;
  const auto points = std::make_shared<std::vector<Point>>(std::vector<Point>{
      Point(0, 0, 0), Point(1, 0, 0), Point(0, S(1) / 3, 0), Point(0, 0, S(0.7))});
  const auto faces = std::make_shared<std::vector<int>>(
      std::vector<int>{3, 0, 2, 1, 3, 0, 1, 3, 3, 0, 3, 2, 3, 1, 2, 3});
  auto mesh = std::make_shared<fcl::BVHModel<fcl::AABB<S>>>();
  mesh->beginModel();
  mesh->addTriangle((*points)[0], (*points)[1], (*points)[2]);
  mesh->addTriangle((*points)[1], (*points)[3], (*points)[2]);
  mesh->endModel();
  const Point normal(S(0.3), S(0.4), S(0.9));
  return {std::make_shared<fcl::Sphere<S>>(S(0.1)),
          std::make_shared<fcl::Box<S>>(S(0.1), S(0.2), S(0.3)),
          std::make_shared<fcl::Ellipsoid<S>>(S(0.1), S(0.2), S(0.3)),
          std::make_shared<fcl::Capsule<S>>(S(0.1), S(0.7)),
          std::make_shared<fcl::Cylinder<S>>(S(0.1), S(0.7)),
          std::make_shared<fcl::Cone<S>>(S(0.1), S(0.7)),
          std::make_shared<fcl::Convex<S>>(points, 4, faces),
          std::make_shared<fcl::Halfspace<S>>(normal, S(0.2)),
          std::make_shared<fcl::Plane<S>>(normal, S(0.2)),
          std::make_shared<fcl::TriangleP<S>>(Point(1, 0, 0), Point(0, 1, 0), Point(0, 0, 1)),
          mesh};
}

// A replay would ask for other objects than the program had.
TYPED_TEST(RecordedShapes, AreMadeAgain) {
  using S = TypeParam;
  for (const auto& shape : eachShape<S>()) {
    shape->computeLocalAABB();
    shape->aabb_local.max_[1] += S(0.125);  // as a program widens it
    shape->aabb_radius *= 2;
    const RecordedShape recorded = recordedShape<S>(shape.get());
    const auto made = makeShape<S>(recorded);
    RecordedShape again = recordedShape<S>(made.get());
    // Of some shapes only the bounds come back, and no manager looks at a mesh's volumes.
    if (recorded.kind == "triangle") again.kind = recorded.kind;
    EXPECT_TRUE(isSame(again, recorded)) << recorded.kind;
    if (recorded.kind != "triangle" && recorded.kind != "mesh") {
      EXPECT_EQ(made->getNodeType(), shape->getNodeType());
    }
    RecordedShape other = recorded;
    other.bounds[4] = 17;
    EXPECT_FALSE(isSame(other, recorded));
    RecordedShape damaged = recorded;
    damaged.numbers.push_back(1);
    EXPECT_THROW(makeShape<S>(damaged), std::invalid_argument) << recorded.kind;
    if (!recorded.indices.empty()) {
      for (const std::int64_t index : {std::int64_t{-1}, std::int64_t{1} << 40, std::int64_t{6}}) {
        damaged = recorded;
        damaged.indices[1] = index;
        EXPECT_THROW(makeShape<S>(damaged), std::invalid_argument) << recorded.kind;
        damaged = recorded;
        damaged.indices[0] = index;
        EXPECT_THROW(makeShape<S>(damaged), std::invalid_argument) << recorded.kind;
      }
      damaged = recorded;
      damaged.indices.pop_back();
      EXPECT_THROW(makeShape<S>(damaged), std::invalid_argument) << recorded.kind;
    }
  }
  EXPECT_EQ(recordedShape<S>(nullptr).kind, "unknown");
}

/// A point of a shape, on its surface or inside; every extreme point is found in the long run.
Eigen::Vector3d pointOf(const RecordedShape& shape, std::mt19937& random) {
  const auto unit = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
  const auto& n = shape.numbers;
  Eigen::Vector3d p(unit(), unit(), unit());
  const auto onto = [](double x) { return x < 0 ? -1 : 1; };
  if (shape.kind == "box")
    return {onto(p.x()) * n[0] / 2, onto(p.y()) * n[1] / 2, onto(p.z()) * n[2] / 2};
  if (shape.kind == "ellipsoid")
    return p.normalized().cwiseProduct(Eigen::Vector3d(n[0], n[1], n[2]));
  if (shape.kind == "sphere") return n[0] * p.normalized();
  if (shape.kind == "capsule")
    return n[0] * p.normalized() + Eigen::Vector3d(0, 0, onto(unit()) * n[1] / 2);
  const Eigen::Vector3d rim = n[0] * Eigen::Vector3d(p.x(), p.y(), 0).normalized();
  if (shape.kind == "cylinder") return rim + Eigen::Vector3d(0, 0, onto(p.z()) * n[1] / 2);
  if (shape.kind == "cone") {
    return p.z() > 0 ? Eigen::Vector3d(0, 0, n[1] / 2) : rim - Eigen::Vector3d(0, 0, n[1] / 2);
  }
  const std::size_t i = 3 * (random() % (n.size() / 3));
  return {n[i], n[i + 1], n[i + 2]};
}

template <typename S>
RecordedState stateOf(const fcl::CollisionGeometry<S>& shape, std::mt19937& random) {
  const auto unit = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
  RecordedState state;
  state.shape = std::make_shared<const RecordedShape>(recordedShape<S>(&shape));
  const Eigen::Quaterniond q = Eigen::Quaterniond(unit(), unit(), unit(), unit()).normalized();
  Eigen::Affine3d pose(q);
  pose.translation() = 0.6 * Eigen::Vector3d(unit(), unit(), unit());
  for (int i = 0; i < 12; ++i) state.pose[static_cast<std::size_t>(i)] = pose(i / 4, i % 4);
  return state;
}

Eigen::Vector3d posed(const RecordedState& state, const Eigen::Vector3d& p) {
  const auto& m = state.pose;
  return {m[0] * p.x() + m[1] * p.y() + m[2] * p.z() + m[3],
          m[4] * p.x() + m[5] * p.y() + m[6] * p.z() + m[7],
          m[8] * p.x() + m[9] * p.y() + m[10] * p.z() + m[11]};
}

// A pair with a half-space would be judged wrongly: the truth is the lowest of many points.
TEST(RecordedGaps, ToPlanesAreThoseOfTheLowestPoints) {
  std::mt19937 random(4802);
  const auto shapes = eachShape<double>();
  for (const std::string open : {"halfspace", "plane"}) {
    for (const auto& plane : shapes) {
      if (recordedShape<double>(plane.get()).kind != open) continue;
      for (const auto& shape : shapes) {
        const RecordedState a = stateOf<double>(*plane, random);
        const RecordedState b = stateOf<double>(*shape, random);
        if (b.shape->isOpen() || b.shape->numbers.empty()) continue;
        const auto& n = a.shape->numbers;
        double low = kInfinity, high = -kInfinity;
        for (int i = 0; i < 40000; ++i) {
          const Eigen::Vector3d p = posed(b, pointOf(*b.shape, random));
          // Into the frame of the plane, whose rotation is orthogonal.
          const auto& m = a.pose;
          const Eigen::Vector3d q = p - Eigen::Vector3d(m[3], m[7], m[11]);
          const Eigen::Vector3d local(m[0] * q.x() + m[4] * q.y() + m[8] * q.z(),
                                      m[1] * q.x() + m[5] * q.y() + m[9] * q.z(),
                                      m[2] * q.x() + m[6] * q.y() + m[10] * q.z());
          const double above = Eigen::Vector3d(n[0], n[1], n[2]).dot(local) - n[3];
          low = std::min(low, above);
          high = std::max(high, above);
        }
        const double gap = open == "plane" ? std::max(low, -high) : low;
        for (const Gap found :
             {gapBetween(a, b, false, kInfinity), gapBetween(b, a, false, kInfinity)}) {
          EXPECT_LE(found.low, found.high);
          EXPECT_LE(found.high - found.low, 1e-10);
          // Points lie that much within the surface at most.
          EXPECT_NEAR(found.low, gap, 2e-4) << open << ", " << b.shape->kind;
        }
      }
    }
  }
}

// A pair would be called a touching one although its points are apart, or the other way round.
TEST(RecordedGaps, HoldTheDistanceOfPoints) {
  std::mt19937 random(4803);
  const auto shapes = eachShape<double>();
  int touching = 0, apart = 0;
  for (int trial = 0; trial < 800; ++trial) {
    const RecordedState a = stateOf<double>(*shapes[random() % shapes.size()], random);
    const RecordedState b = stateOf<double>(*shapes[random() % shapes.size()], random);
    if (a.shape->isOpen() || b.shape->isOpen()) continue;
    const Gap gap = gapBetween(a, b, false, kInfinity);
    EXPECT_LE(gap.low, gap.high);
    if (a.shape->numbers.empty() || b.shape->numbers.empty()) {
      EXPECT_EQ(gap.high, kInfinity);
      continue;
    }
    double nearest = kInfinity;
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 60; ++i) points.push_back(posed(b, pointOf(*b.shape, random)));
    for (int i = 0; i < 60; ++i) {
      const Eigen::Vector3d p = posed(a, pointOf(*a.shape, random));
      for (const Eigen::Vector3d& q : points) nearest = std::min(nearest, (p - q).norm());
    }
    EXPECT_LE(gap.low, nearest) << a.shape->kind << ", " << b.shape->kind;
    touching += gap.high <= 0;
    apart += gap.low > 0;
  }
  EXPECT_GT(touching, 30);
  EXPECT_GT(apart, 100);

  RecordedState a = stateOf<double>(*shapes[0], random), b = a;
  b.pose[3] = std::nan("");
  EXPECT_EQ(gapBetween(a, b, false, kInfinity).low, -kInfinity);
  EXPECT_EQ(gapBetween(a, b, false, kInfinity).high, kInfinity);
}

}  // namespace
}  // namespace fcl_fibers::broadphase
