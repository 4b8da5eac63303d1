// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/posed_change.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "support/random.h"
#include "support/segments.h"

namespace fcl_fibers::geometry {
namespace {

using test::Point;
using test::Random;
using test::Real;
using Matrix = Eigen::Matrix<Real, 3, 3>;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Matrix linearPart(const AffineMap& map) {
  Matrix linear;
  for (int i = 0; i < 3; ++i) linear.col(i) = toPoint(map.column[i]);
  return linear;
}
Point mapped(const AffineMap& map, const Point& p) {
  return linearPart(map) * p + toPoint(map.shift);
}

/// @param skew  how far the columns may be from those of a rotation
AffineMap turned(Random& random, double scale, double skew) {
  const Eigen::Matrix3d rotation = random.rotation().toRotationMatrix();
  AffineMap map;
  for (int i = 0; i < 3; ++i) {
    map.column[i] = scale * (fromEigen(rotation.col(i)) + skew * fromEigen(random.inCube(1)));
  }
  return map;
}

double powerOfTen(Random& random, double low, double high) {
  return std::pow(10.0, random.between(low, high));
}

// Volumes of a size and about a centre, some of them points.

double extentOf(Random& random, double size) {
  return random.below(3) == 0 ? 0 : size * powerOfTen(random, -9, 0);
}
void make(Random& random, double size, Box& box) {
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = static_cast<float>(size * random.between(-1, 1));
    box.high[axis] = box.low[axis] + static_cast<float>(extentOf(random, size));
  }
}
void make(Random& random, double size, Sphere& sphere) {
  for (float& x : sphere.center) x = static_cast<float>(size * random.between(-1, 1));
  sphere.radius = static_cast<float>(extentOf(random, size));
}
void make(Random& random, double size, Segment& segment) {
  segment.a = size * fromEigen(random.inCube(1));
  const double length = extentOf(random, size);
  segment.b = segment.a + length * fromEigen(random.inCube(1));
  segment.radius = extentOf(random, size);
}

// Their farthest points: those of a ball along the axes of the image and in some other directions.

std::vector<Point> farthestPoints(Random& /*random*/, const AffineMap& /*map*/, const Box& box) {
  std::vector<Point> points;
  for (int corner = 0; corner < 8; ++corner) {
    Point& p = points.emplace_back();
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] = Real((corner >> axis & 1) != 0 ? box.high[axis] : box.low[axis]);
    }
  }
  return points;
}
std::vector<Point> pointsOfBall(Random& random, const AffineMap& map, const Point& center,
                                Real radius) {
  const Matrix linear = linearPart(map);
  const Matrix axes =
      Eigen::SelfAdjointEigenSolver<Matrix>(linear.transpose() * linear / linear.squaredNorm())
          .eigenvectors();
  std::vector<Point> directions;
  for (int i = 0; i < 3; ++i) {
    directions.push_back(linear.row(i).transpose().normalized());
    directions.push_back(axes.col(i));
    directions.push_back(random.direction().cast<Real>());
  }
  std::vector<Point> points;
  for (const Point& direction : directions) {
    points.emplace_back(center + radius * direction);
    points.emplace_back(center - radius * direction);
  }
  return points;
}
std::vector<Point> farthestPoints(Random& random, const AffineMap& map, const Sphere& sphere) {
  return pointsOfBall(random, map, centerOf(sphere), Real(sphere.radius));
}
std::vector<Point> farthestPoints(Random& random, const AffineMap& map, const Segment& segment) {
  auto points = pointsOfBall(random, map, toPoint(segment.a), Real(segment.radius));
  const auto others = pointsOfBall(random, map, toPoint(segment.b), Real(segment.radius));
  points.insert(points.end(), others.begin(), others.end());
  const Point along = toPoint(segment.b) - toPoint(segment.a);
  if (along.norm() > 0) {
    points.emplace_back(toPoint(segment.a) - Real(segment.radius) * along.normalized());
    points.emplace_back(toPoint(segment.b) + Real(segment.radius) * along.normalized());
  }
  return points;
}

template <class To, class Volume>
To changed(const PosedChange<To>& change, const Volume& volume) {
  if constexpr (std::is_same_v<Volume, Segment>) {
    return change.ofCapsule(volume, 0);
  } else {
    return change(volume);
  }
}

/// Whether all points at most `growth` from p along each axis of a box, or anywhere around the
/// centre of a sphere, are inside.
bool contains(const Box& box, const Point& p, Real growth) {
  for (int axis = 0; axis < 3; ++axis) {
    if (!(Real(box.low[axis]) <= p[axis] - growth && p[axis] + growth <= Real(box.high[axis]))) {
      return false;
    }
  }
  return true;
}
bool contains(const Sphere& sphere, const Point& p, Real growth) {
  return sphere.radius == kInfinity ||
         (p - centerOf(sphere)).norm() + growth <= Real(sphere.radius);
}

bool isUnbounded(const Box& box) {
  return std::all_of(box.low, box.low + 3, [](float x) { return x == -kInfinity; }) &&
         std::all_of(box.high, box.high + 3, [](float x) { return x == kInfinity; });
}
bool isUnbounded(const Sphere& sphere) { return sphere.radius == kInfinity; }

/// How far a volume reaches on the first axis.
Real width(const Box& box) { return Real(box.high[0]) - Real(box.low[0]); }
Real width(const Sphere& sphere) { return 2 * Real(sphere.radius); }

template <class Pair>
class PosedChangeOf : public testing::Test {};
template <class T, class U>
struct Types {
  using To = T;
  using Volume = U;
};
using AllTypes = testing::Types<Types<Box, Box>, Types<Box, Sphere>, Types<Box, Segment>,
                                Types<Sphere, Box>, Types<Sphere, Sphere>, Types<Sphere, Segment>>;
TYPED_TEST_SUITE(PosedChangeOf, AllTypes, );

TYPED_TEST(PosedChangeOf, HoldsWhatItMoves) {
  // If this fails, triangles that a fiber touches are missed where a mesh is turned.
  Random random(1);
  for (int i = 0; i < 20000; ++i) {
    const double size = powerOfTen(random, -6, 6), scale = powerOfTen(random, -6, 6);
    AffineMap map = turned(random, scale, i % 3 == 0 ? 0 : powerOfTen(random, -15, -1));
    typename TypeParam::Volume volume;
    make(random, size, volume);
    const auto points = farthestPoints(random, map, volume);
    // Every other time the volume comes to lie about the origin, where coordinates cancel.
    map.shift = size * scale * fromEigen(random.inCube(10));
    if (i % 2 == 0) {
      const Point p = -(linearPart(map) * points[0]);
      map.shift = {double(p.x()), double(p.y()), double(p.z())};
    }
    const double growth = i % 5 == 0 ? 0 : size * scale * powerOfTen(random, -12, 1);
    const PosedChange<typename TypeParam::To> change(map, growth);
    const auto result = changed(change, volume);
    for (const Point& p : points) {
      ASSERT_TRUE(contains(result, mapped(map, p), Real(growth))) << i;
    }
  }
}

TYPED_TEST(PosedChangeOf, HoldsWhatComesBackByTheInverse) {
  // If this fails, the rounding of a pose's inverse moves fibers off the mesh.
  Random random(2);
  for (int i = 0; i < 20000; ++i) {
    const double size = powerOfTen(random, -6, 6), scale = powerOfTen(random, -6, 6);
    AffineMap map = turned(random, scale, i % 3 == 0 ? 0 : 1e-7);
    typename TypeParam::Volume volume;
    make(random, size, volume);
    // So that every other one comes from about the origin.
    const auto points = farthestPoints(random, map, volume);
    map.shift = size * fromEigen(random.inCube(10));
    if (i % 2 == 0)
      map.shift = {double(points[0].x()), double(points[0].y()), double(points[0].z())};
    const AffineMap inverse = map.inverse();
    const auto result = changed(PosedChange<typename TypeParam::To>(inverse, 0), volume);
    const Matrix exact_inverse = linearPart(map).inverse();
    for (const Point& p : farthestPoints(random, inverse, volume)) {
      ASSERT_TRUE(contains(result, exact_inverse * (p - toPoint(map.shift)), 0)) << i;
    }
  }
}

// Float's own rounding hides that of double, unless products cancel in one coordinate of a box.

TEST(PosedChange, HoldsPointsWhoseProductsCancel) {
  // If this fails, a point on a plane through the origin is off by the rounding of its products.
  Random random(8);
  for (int i = 0; i < 5000; ++i) {
    AffineMap map = turned(random, 1, 0);
    const Vec3d p = fromEigen(random.inCube(1));
    const Sphere sphere{{static_cast<float>(p.x), static_cast<float>(p.y), 1}, 0};
    // The first coordinate becomes the rounding of this sum. Large skews would hide it.
    map.column[2].x =
        -(map.column[0].x * double{sphere.center[0]} + map.column[1].x * double{sphere.center[1]});
    const Point exact = mapped(map, centerOf(sphere));
    ASSERT_LE(std::abs(exact.x()), 1e-15L);
    ASSERT_TRUE(contains(PosedChange<Box>(map, 0)(sphere), exact, 0)) << i;
  }
}

TEST(PosedChange, HoldsTheOriginWhereShiftsCancel) {
  // If this fails, the shift of an inverse is taken for exact.
  Random random(9);
  for (int i = 0; i < 5000; ++i) {
    AffineMap map = turned(random, 1, 0);
    map.shift = map.linear({0, random.between(-1, 1), random.between(-1, 1)});
    const Point exact = linearPart(map).inverse() * -toPoint(map.shift);
    ASSERT_LE(std::abs(exact.x()), 1e-15L);
    const PosedChange<Box> change(map.inverse(), 0);
    ASSERT_TRUE(contains(change(Sphere{{0, 0, 0}, 0}), exact, 0)) << i;
  }
}

TYPED_TEST(PosedChangeOf, IsTightForRotations) {
  // If this fails, queries of a mesh that is turned test far more triangles than they need to.
  using To = typename TypeParam::To;
  Random random(3);
  for (int i = 0; i < 3000; ++i) {
    const double size = powerOfTen(random, -6, 6), scale = powerOfTen(random, -6, 6);
    AffineMap map = turned(random, scale, 0);
    map.shift = size * scale * fromEigen(random.inCube(10));
    typename TypeParam::Volume volume;
    make(random, size, volume);
    const double growth = size * scale * random.unit();
    const To result = changed(PosedChange<To>(map, growth), volume);
    Real low = kInfinity, high = -kInfinity, diameter = 0;
    const auto points = farthestPoints(random, map, volume);
    for (const Point& p : points) {
      const Point q = mapped(map, p);
      low = std::min(low, q.x());
      high = std::max(high, q.x());
      for (const Point& other : points) {
        diameter = std::max(diameter, (q - mapped(map, other)).norm());
      }
    }
    // A sphere allows for growth along each axis.
    constexpr bool kIsBox = std::is_same_v<To, Box>;
    const Real exact = kIsBox ? high - low + 2 * growth : diameter + 4 * growth;
    // The rounding of float, of coordinates up to 10 and 2 sizes.
    ASSERT_LE(width(result), exact + 1e-5L * size * scale) << i;
  }
}

TEST(PosedChange, ScaleIsNoMoreThanTheLeast) {
  // If this fails, a search for the nearest triangle passes over it.
  Random random(4);
  for (int i = 0; i < 20000; ++i) {
    const double skew = i % 3 == 0 ? 0 : powerOfTen(random, -15, -0.5);
    const AffineMap map = turned(random, powerOfTen(random, -6, 6), skew);
    const Matrix linear = linearPart(map);
    const Real least = Eigen::JacobiSVD<Matrix>(linear).singularValues()[2];
    const double scale = PosedChange<Box>(map, 0).scale();
    ASSERT_GE(scale, 0);
    ASSERT_LE(Real(scale), least) << i;
    ASSERT_GE(Real(scale), least * (1 - 20 * Real(skew) - 1e-12L)) << i;
  }
}

TEST(PosedChange, ScaleDoesNotOverflow) {
  // If this fails, everything is farther than the nearest so far.
  Random random(5);
  for (const double size : {1e-300, 1e-170, 1e-150, 1e150, 1e170, 1e300}) {
    const double scale = PosedChange<Box>(turned(random, size, 0), 0).scale();
    EXPECT_GE(scale, 0) << size;
    EXPECT_LE(scale, size) << size;
  }
}

TYPED_TEST(PosedChangeOf, HoldsWhatIsHugeOrTiny) {
  // If this fails, numbers that overflow or vanish hide what touches.
  Random random(6);
  for (int i = 0; i < 20000; ++i) {
    AffineMap map = turned(random, powerOfTen(random, -300, 300), 1e-9);
    const double far = powerOfTen(random, -300, 300);
    map.shift = far * fromEigen(random.inCube(1));
    typename TypeParam::Volume volume;
    make(random, powerOfTen(random, -30, 18), volume);
    const double growth = i % 2 == 0 ? 0 : powerOfTen(random, -300, 300);
    const auto result = changed(PosedChange<typename TypeParam::To>(map, growth), volume);
    for (const Point& p : farthestPoints(random, map, volume)) {
      ASSERT_TRUE(contains(result, mapped(map, p), Real(growth))) << i;
    }
  }
}

TYPED_TEST(PosedChangeOf, IsUnboundedWhereNumbersAreNotFinite) {
  // If this fails, a comparison with NaN takes for apart what may touch.
  using To = typename TypeParam::To;
  Random random(7);
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {infinity, -infinity, kNaN}) {
    typename TypeParam::Volume volume, around_the_origin{};
    make(random, 1, volume);
    for (int place = 0; place < 13; ++place) {
      AffineMap map = turned(random, 1, 0);
      double growth = 0;
      Vec3d& row = place < 9 ? map.column[place / 3] : map.shift;
      (place == 12 ? growth : place % 3 == 0 ? row.x : place % 3 == 1 ? row.y : row.z) = bad;
      const PosedChange<To> change(map, growth);
      EXPECT_TRUE(isUnbounded(changed(change, volume))) << place << " " << bad;
      EXPECT_TRUE(isUnbounded(changed(change, around_the_origin))) << place << " " << bad;
    }
    const PosedChange<To> change(turned(random, 1, 0), 0);
    const auto number = static_cast<float>(bad);
    if constexpr (std::is_same_v<typename TypeParam::Volume, Box>) {
      for (int axis = 0; axis < 3; ++axis) {
        Box low = volume, high = volume;
        low.low[axis] = high.high[axis] = number;
        EXPECT_TRUE(isUnbounded(change(low))) << axis << " " << bad;
        EXPECT_TRUE(isUnbounded(change(high))) << axis << " " << bad;
      }
      EXPECT_TRUE(isUnbounded(change(Box::unbounded())));
    } else if constexpr (std::is_same_v<typename TypeParam::Volume, Sphere>) {
      for (float& x : volume.center) {
        Sphere sphere = volume;
        (&sphere.center[0])[&x - &volume.center[0]] = number;
        EXPECT_TRUE(isUnbounded(change(sphere))) << bad;
      }
      EXPECT_TRUE(isUnbounded(change(Sphere::unbounded())));
    } else {
      for (double Vec3d::*axis : {&Vec3d::x, &Vec3d::y, &Vec3d::z}) {
        Segment a = volume, b = volume;
        a.a.*axis = b.b.*axis = bad;
        EXPECT_TRUE(isUnbounded(change.ofCapsule(a, 0))) << bad;
        EXPECT_TRUE(isUnbounded(change.ofCapsule(b, 0))) << bad;
      }
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::geometry
