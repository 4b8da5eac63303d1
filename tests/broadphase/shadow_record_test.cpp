// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/shadow_record.h"
#include "broadphase/shadow_gap.h"

#include <gtest/gtest.h>

#include <algorithm>
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
  numbers.push_back(std::nan(""));
  const RecordLine line{"word", numbers};
  const RecordLine read = RecordLine::parse(line.text());
  ASSERT_EQ(read.numbers.size(), numbers.size());
  EXPECT_EQ(read.word, "word");
  EXPECT_TRUE(std::isnan(read.numbers.back()));
  for (std::size_t i = 0; i + 1 < numbers.size(); ++i) {
    EXPECT_EQ(bitsOf(read.numbers[i]), bitsOf(numbers[i])) << numbers[i];
  }
}

// A damaged number would be taken for another one.
TEST(RecordedNumbers, AreRefusedIfTheyAreNone) {
  for (const char* const word : {"-", "--1", "p1", "1p", "1.5.5", "1e", "infinity", "1,5", "x"}) {
    EXPECT_THROW(RecordLine::parse(std::string("word ") + word), std::invalid_argument) << word;
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
    const RecordLine recorded = readShape<S>(shape.get());
    const auto made = makeShape<S>(recorded);
    // Of some shapes only the bounds come back, and no manager looks at a mesh's volumes.
    EXPECT_TRUE(readShape<S>(made.get()) == recorded) << recorded.word;
    if (recorded.word != "bounds" && recorded.word != "mesh") {
      EXPECT_EQ(made->getNodeType(), shape->getNodeType());
    }
    RecordLine other = recorded;
    other.numbers[4] = 17;
    EXPECT_FALSE(other == recorded);
    RecordLine damaged = recorded;
    damaged.numbers.push_back(1);
    EXPECT_THROW(makeShape<S>(damaged), std::invalid_argument) << recorded.word;
    if (recorded.word != "convex" && recorded.word != "mesh") continue;
    for (const double index : {-1.0, 0x1p40, 6.0, std::nan("")}) {
      damaged = recorded;
      damaged.numbers.back() = index;
      EXPECT_THROW(makeShape<S>(damaged), std::invalid_argument) << recorded.word;
      damaged = recorded;
      damaged.numbers[11] = index;
      if (index != 6) {
        EXPECT_THROW(makeShape<S>(damaged), std::invalid_argument) << recorded.word;
      }
    }
  }
  EXPECT_EQ(readShape<S>(nullptr).word, "bounds");
  EXPECT_EQ(makeShape<S>(RecordLine{"update", {}}), nullptr);
}

/// A point of a shape, on its surface or inside; every extreme point is found in the long run.
Eigen::Vector3d pointOf(const RecordedShape& shape, std::mt19937& random) {
  const auto unit = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
  const std::vector<double> n(shape.line.numbers.begin() + 11, shape.line.numbers.end());
  Eigen::Vector3d p(unit(), unit(), unit());
  const auto onto = [](double x) { return x < 0 ? -1 : 1; };
  if (shape.line.word == "box")
    return {onto(p.x()) * n[0] / 2, onto(p.y()) * n[1] / 2, onto(p.z()) * n[2] / 2};
  if (shape.line.word == "ellipsoid")
    return p.normalized().cwiseProduct(Eigen::Vector3d(n[0], n[1], n[2]));
  if (shape.line.word == "sphere") return n[0] * p.normalized();
  if (shape.line.word == "capsule")
    return n[0] * p.normalized() + Eigen::Vector3d(0, 0, onto(unit()) * n[1] / 2);
  const Eigen::Vector3d rim = n[0] * Eigen::Vector3d(p.x(), p.y(), 0).normalized();
  if (shape.line.word == "cylinder") return rim + Eigen::Vector3d(0, 0, onto(p.z()) * n[1] / 2);
  if (shape.line.word == "cone") {
    return p.z() > 0 ? Eigen::Vector3d(0, 0, n[1] / 2) : rim - Eigen::Vector3d(0, 0, n[1] / 2);
  }
  const std::size_t i = 1 + 3 * (random() % static_cast<std::size_t>(n[0]));
  return {n[i], n[i + 1], n[i + 2]};
}

RecordedObject objectOf(const std::shared_ptr<fcl::CollisionGeometry<double>>& shape,
                        std::mt19937& random) {
  const auto unit = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
  fcl::CollisionObject<double> object(shape);
  const Eigen::Quaterniond q = Eigen::Quaterniond(unit(), unit(), unit(), unit()).normalized();
  object.setTransform(q.toRotationMatrix(), 0.6 * Eigen::Vector3d(unit(), unit(), unit()));
  object.computeAABB();
  return readObject<double>(
      object, 0,
      std::make_shared<const RecordedShape>(RecordedShape{readShape<double>(shape.get())}));
}

Eigen::Vector3d posed(const RecordedObject& object, const Eigen::Vector3d& p) {
  return object.pose() * p.homogeneous();
}

// A manager would be blamed for a pair that comes near between two times, or on a way that turns.
TEST(RecordedGaps, HoldTheLeastDistanceOfAStep) {
  std::mt19937 random(4804);
  const auto shapes = eachShape<double>();
  int apart = 0, touching = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const bool are_spheres = trial % 2 == 0;
    const auto shape = [&] { return shapes[are_spheres ? 0 : random() % shapes.size()]; };
    const auto far = [&](RecordedObject object) {
      for (const std::size_t i : {5u, 9u, 13u}) object.line.numbers[i] *= 1 + trial % 30;
      return object;
    };
    const auto p = shape(), q = shape();
    const RecordedObject p0 = far(objectOf(p, random)), p1 = far(objectOf(p, random));
    RecordedObject q0 = far(objectOf(q, random)), q1 = far(objectOf(q, random));
    if (are_spheres) {  // One passes the other, half a sample away.
      const double t = (trial % 64 + 0.5) / 64, beside = 0.001 * trial;
      for (const std::size_t i : {5u, 9u, 13u}) {
        q0.line.numbers[i] = (1 - t) * p0.line.numbers[i] + t * p1.line.numbers[i] + beside / 2;
      }
      q1 = q0;
    }
    const Gap gap = gapBetween(p0, p1, q0, q1, false);
    const std::string kind = p0.shape->line.word, other = q0.shape->line.word;
    if (are_spheres) {
      const Eigen::Vector3d d0 = p0.pose().col(3) - q0.pose().col(3),
                            way = p1.pose().col(3) - q1.pose().col(3) - d0;
      const double t = std::clamp(-d0.dot(way) / way.squaredNorm(), 0.0, 1.0);
      const double least = (d0 + t * way).norm() - 2 * 0.1;
      EXPECT_LE(gap.low, least);
      EXPECT_GE(gap.high, least);
      touching += gap.high <= 0;
    } else if (std::isfinite(gap.low) && kind != "bounds" && other != "bounds") {
      for (int i = 0; i < 500; ++i) {
        const double t = double(i % 11) / 10;
        const Eigen::Vector3d a = pointOf(*p0.shape, random), b = pointOf(*q0.shape, random);
        const Eigen::Vector3d at = (1 - t) * posed(p0, a) + t * posed(p1, a),
                              its = (1 - t) * posed(q0, b) + t * posed(q1, b);
        ASSERT_LE(gap.low, (at - its).norm()) << kind << ", " << other;
      }
    }
    EXPECT_LE(gap.volumes, gap.low);
    apart += gap.low > 0;
  }
  EXPECT_GT(apart, 50);
  EXPECT_GT(touching, 5);
}

// A pair would be called a touching one although its points are apart, or the other way round.
TEST(RecordedGaps, HoldTheDistanceOfPoints) {
  std::mt19937 random(4803);
  const auto shapes = eachShape<double>();
  int touching = 0, apart = 0, above_halfspace = 0;
  for (int trial = 0; trial < 800; ++trial) {
    const RecordedObject a = objectOf(shapes[random() % shapes.size()], random);
    const RecordedObject b = objectOf(shapes[random() % shapes.size()], random);
    const std::string kinds = a.shape->line.word + ", " + b.shape->line.word;
    const auto isHalfspace = [](const RecordedObject& object) {
      return object.shape->line.word == "halfspace";
    };
    const Gap gap = gapBetween(a, b, false);
    EXPECT_LE(gap.low, gap.high);
    EXPECT_LE(gap.volumes, gap.low);
    const auto isUndecided = [](const RecordedObject& object) {
      return object.shape->line.word == "bounds" || object.shape->line.word == "plane";
    };
    if (isUndecided(a) || isUndecided(b)) {
      EXPECT_EQ(gap.high, kInfinity);
      continue;
    }
    if (isHalfspace(a) && isHalfspace(b)) continue;  // Two that are turned always overlap.
    double nearest = kInfinity;
    if (isHalfspace(a) || isHalfspace(b)) {
      const RecordedObject &halfspace = isHalfspace(a) ? a : b, &other = isHalfspace(a) ? b : a;
      const auto& n = halfspace.shape->line.numbers;
      for (int i = 0; i < 3000; ++i) {
        const Eigen::Vector3d p =
            posed(other, pointOf(*other.shape, random)) - halfspace.pose().col(3);
        const double above = Eigen::Vector3d(n[11], n[12], n[13])
                                 .dot(halfspace.pose().leftCols<3>().transpose() * p) -
                             n[14];
        nearest = std::min(nearest, above);
      }
      // Points lie that much within the surface at most.
      if (gap.high <= 0) {
        EXPECT_LE(nearest, 2e-2) << kinds;
      } else if (other.shape->line.word != "cone") {  // FCL misses some of these.
        EXPECT_GE(nearest, -2e-3) << kinds;
      }
      above_halfspace += gap.high > 0;
      continue;
    }
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 60; ++i) points.push_back(posed(b, pointOf(*b.shape, random)));
    for (int i = 0; i < 60; ++i) {
      const Eigen::Vector3d p = posed(a, pointOf(*a.shape, random));
      for (const Eigen::Vector3d& q : points) nearest = std::min(nearest, (p - q).norm());
    }
    EXPECT_LE(gap.low, nearest) << kinds;
    touching += gap.high <= 0;
    apart += gap.low > 0;
  }
  EXPECT_GT(touching, 30);
  EXPECT_GT(apart, 100);
  EXPECT_GT(above_halfspace, 5);

  // A cloud of points, and a mesh of no points, which cannot be made again.
  const auto cloud = std::make_shared<fcl::BVHModel<fcl::OBBRSS<double>>>();
  cloud->beginModel();
  cloud->addSubModel({{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}});
  cloud->endModel();
  RecordedObject a = objectOf(shapes[0], random), b = objectOf(cloud, random);
  std::copy_n(a.line.numbers.begin() + 2, 12, b.line.numbers.begin() + 2);
  EXPECT_EQ(gapBetween(a, b, false).high, kInfinity);
  b.shape = std::make_shared<const RecordedShape>(
      RecordedShape{{"mesh", std::vector<double>(12, 0.0)}, nullptr});
  EXPECT_EQ(gapBetween(a, b, false).low, -kInfinity);
  b = a;
  b.line.numbers[5] = std::nan("");
  EXPECT_EQ(gapBetween(a, b, false).low, -kInfinity);
  EXPECT_EQ(gapBetween(a, b, false).high, kInfinity);
}

}  // namespace
}  // namespace fcl_fibers::broadphase
