// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "geometry/box.h"
#include "geometry/rounding.h"
#include "geometry/sphere.h"
#include "support/overlap.h"
#include "support/random.h"
#include "support/segments.h"

namespace fcl_fibers::geometry {
namespace {

using simd::firstLanes;
using simd::LaneMask;
using test::Point;
using test::Random;
using test::Real;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kLargest = std::numeric_limits<float>::max();
constexpr float kSmallest = std::numeric_limits<float>::min();
constexpr double kUlp = std::numeric_limits<float>::epsilon();

Real distance(const Point& p, const Point& q) { return (p - q).norm(); }

float floatAbove(float x) { return std::nextafter(x, kInfinity); }

// Rounding.

TEST(Rounding, IsOutwardByOneToTwoUlp) {
  // If this fails, a bound lies inside of what it bounds, or is looser than stated.
  Random random(1);
  for (int i = 0; i < 200000; ++i) {
    double x = random.between(-1, 1) * std::pow(10.0, random.between(-37, 38));
    if (i % 3 == 0) x = double{static_cast<float>(x)};
    const double down = roundedDown(x), up = roundedUp(x);
    ASSERT_LT(down, x);
    ASSERT_GT(up, x);
    const double two_ulp = 2 * kUlp * std::fabs(x) + 2 * double{kSmallest};
    ASSERT_GE(down, x - two_ulp);
    ASSERT_LE(up, x + two_ulp);
  }
}

TEST(Rounding, CoversAllDoubles) {
  // If this fails, bounds break where floats end: at infinity, at the largest, below the smallest.
  const double infinity = std::numeric_limits<double>::infinity();
  const double cases[] = {
      0.0,  -0.0,  4.9e-324, 1e-300, 1e-45, 1e-40, kSmallest,           1.0, kLargest, 3.5e38,
      1e39, 1e300, infinity, 1e-46,  2e-38, 0.1,   2 * double{kLargest}};
  for (const double magnitude : cases) {
    for (const double x : {magnitude, -magnitude}) {
      EXPECT_LE(double{roundedDown(x)}, x) << x;
      EXPECT_GE(double{roundedUp(x)}, x) << x;
      EXPECT_EQ(roundedDown(x), -roundedUp(-x)) << x;
      EXPECT_FALSE(std::isnan(roundedUp(x))) << x;
    }
  }
  EXPECT_EQ(roundedDown(-1e39), -kInfinity);
  EXPECT_EQ(roundedUp(1e39), kInfinity);
  // The far side stays finite: a bound from below of something out of range.
  EXPECT_LT(roundedDown(1e39), kInfinity);
  EXPECT_GT(roundedDown(1e39), 0.9f * kLargest);
}

TEST(Segment, EndPointErrorCoversThePosesRounding) {
  // If this fails, a volume is too small for the capsule that a pose and a length define; or larger
  // than it has to be, and so is the number of pairs that take the exact way.
  const double eps = std::numeric_limits<double>::epsilon();
  EXPECT_EQ(endPointError({{1, 2, -3}, {0.5, 0, 2}, 7}), 8 * eps * 3);
  EXPECT_EQ(endPointError({{1, 2, 2}, {0.5, -5, 2}, 0}), 8 * eps * 5);
  EXPECT_EQ(endPointError(Segment::box({-4, 0, 0}, {1, 1, 1})), 8 * eps * 4);
  Random random(9);
  Real largest = 0;  // of errors, in parts of what covers them
  for (int i = 0; i < 200000; ++i) {
    const double half = 0.5 * random.between(0, 1) * std::pow(10.0, random.between(-3, 0));
    const Eigen::Quaterniond turn = random.rotation();
    const Eigen::Vector3d center = random.inCube(std::pow(10.0, random.between(-2, 2)));
    const Eigen::Vector3d h = turn.toRotationMatrix().col(2) * half;
    const Eigen::Vector3d a = center - h, b = center + h;
    const Point exact = turn.cast<Real>().normalized() * Point(0, 0, Real(half));
    const Real error = std::max((a.cast<Real>() - (center.cast<Real>() - exact)).norm(),
                                (b.cast<Real>() - (center.cast<Real>() + exact)).norm());
    const Real covered = Real(endPointError({fromEigen(a), fromEigen(b), 0}));
    ASSERT_LE(error, covered);
    largest = std::max(largest, error / covered);
  }
  EXPECT_GT(largest, 0.1L) << "it is far larger than any error";
}

// Volumes of segments.

/// A segment, and how far it is to be thickened.
struct Case {
  Segment segment;
  double padding;
};

std::vector<Case> casesOfAllSizes() {
  Random random(2);
  std::vector<Case> cases;
  for (int exponent = -45; exponent <= 45; ++exponent) {
    for (int i = 0; i < 60; ++i) {
      const double scale = std::pow(10.0, exponent);
      const auto smaller = [&] { return scale * std::pow(10.0, -random.between(0, 12)); };
      const Vec3d a = scale * fromEigen(random.inCube(1));
      const Vec3d b = a + smaller() * fromEigen(random.direction());
      Case c{{a, b, i % 4 == 0 ? 0 : smaller()}, i % 3 == 0 ? 0 : smaller()};
      // Sides near 0, where float's rounding does not cover that of the end points.
      if (i % 5 == 0) c.segment.radius = std::fabs(a.x);
      if (i % 7 == 0) c.segment.b = -1.0 * c.segment.a;
      if (i % 11 == 0) c.segment.b = c.segment.a;
      // Coordinates that are floats.
      if (i % 13 == 0 && exponent <= 38) {
        const float x = static_cast<float>(a.x);
        c.segment = {{double{x}, 0, 0}, {double{x}, double{x}, 0}, 0};
      }
      cases.push_back(c);
    }
  }
  for (const double x : {1e100, 1e154, 1e160, 1e300}) {
    cases.push_back({{{x, -x, 0}, {0, x, x}, x / 8}, 0});
    cases.push_back({{{x, 0, 0}, {x, 1, 0}, 1}, 1});
  }
  cases.push_back({{{0, 0, 0}, {0, 0, 0}, 0}, 0});
  cases.push_back({{{1, 2, 3}, {1, 2, 3}, 0}, 0});
  for (const Vec3d& high : {Vec3d{2, 3, 4}, Vec3d{1, 1, 1}}) {
    cases.push_back({Segment::box({1, 1, 1}, high), 0});
    cases.push_back({Segment::box({-1, -1, -1}, high), 0.25});
  }
  return cases;
}

std::string describe(const Case& c) {
  const auto text = [](const Vec3d& v) {
    return " (" + std::to_string(v.x) + ", " + std::to_string(v.y) + ", " + std::to_string(v.z) +
           ")";
  };
  return text(c.segment.a) + text(c.segment.b) + " r " + std::to_string(c.segment.radius);
}

/// How far from the stored axis a volume has to reach. A quarter of the end points' error, which is
/// stated generously, may go into the roundings of this very sum.
Real thicknessOf(const Case& c) {
  return Real(c.segment.thickness()) + Real(c.padding) + 0.75L * Real(endPointError(c.segment));
}

TEST(Box, ContainsTheCapsuleTightly) {
  // If this fails, a bound is rounded inward somewhere between 1e-45 and 1e300, or boxes are larger
  // than float's precision asks for, and so are the pairs in number.
  for (const Case& c : casesOfAllSizes()) {
    const Box box = Box::around(c.segment, c.padding);
    const Point low = toPoint(min(c.segment.a, c.segment.b)),
                high = toPoint(max(c.segment.a, c.segment.b));
    for (int axis = 0; axis < 3; ++axis) {
      const Real exact_low = low[axis] - thicknessOf(c), exact_high = high[axis] + thicknessOf(c);
      ASSERT_LE(Real(box.low[axis]), exact_low) << describe(c);
      ASSERT_GE(Real(box.high[axis]), exact_high) << describe(c);
      if (std::max(std::fabs(exact_low), std::fabs(exact_high)) > Real(kLargest)) continue;
      const Real least = Real(endPointError(c.segment)) + 3 * Real(kSmallest);
      ASSERT_GE(Real(box.low[axis]), exact_low - 2.1L * Real(kUlp) * std::fabs(exact_low) - least);
      ASSERT_LE(Real(box.high[axis]),
                exact_high + 2.1L * Real(kUlp) * std::fabs(exact_high) + least);
    }
  }
}

TEST(Sphere, ContainsTheCapsuleTightly) {
  // If this fails, moving the centre to floats has cost more than the radius has grown, or spheres
  // are larger than float's precision asks for.
  for (const Case& c : casesOfAllSizes()) {
    const Ball ball = Ball::around(c.segment, c.padding);
    const Sphere sphere = Sphere::around(c.segment, c.padding);
    const Point center = centerOf(sphere);
    ASSERT_TRUE(std::isfinite(sphere.center[0])) << describe(c);
    // A capsule is the hull of the balls around its ends.
    for (const Vec3d& end : {c.segment.a, c.segment.b}) {
      ASSERT_LE(distance(toPoint(ball.center), toPoint(end)) + thicknessOf(c), Real(ball.radius))
          << describe(c);
      ASSERT_LE(distance(center, toPoint(end)) + thicknessOf(c), Real(sphere.radius))
          << describe(c);
    }
    ASSERT_LE(distance(center, toPoint(ball.center)) + Real(ball.radius), Real(sphere.radius))
        << describe(c);
    const Real size = std::max(maxNorm(c.segment.a), maxNorm(c.segment.b));
    const Real exact = distance(toPoint(c.segment.a), toPoint(c.segment.b)) / 2 + thicknessOf(c);
    if (size + exact > Real(kLargest)) continue;
    // Half an ulp on each axis for the centre, two for the radius.
    ASSERT_LE(Real(sphere.radius), exact + Real(kUlp) * (size + 2.1L * exact) + 3 * Real(kSmallest))
        << describe(c);
  }
}

TEST(Volumes, OfABoxOpenToASideReachToItsOtherSides) {
  // If this fails, a floor meets what is high above it, or nothing.
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double padding : {0.0, 0.25}) {
    const Segment floor = Segment::box({-infinity, -infinity, -infinity}, {infinity, infinity, -2});
    EXPECT_GT(endPointError(floor), 0);
    EXPECT_LT(endPointError(floor), 1e-14);
    const Box box = Box::around(floor, padding);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(box.low[axis], -kInfinity);
    }
    EXPECT_EQ(box.high[0], kInfinity);
    EXPECT_EQ(box.high[1], kInfinity);
    EXPECT_GE(double{box.high[2]}, padding - 2);
    EXPECT_LT(double{box.high[2]}, padding - 2 + 1e-6);
    // A sphere has one side only.
    EXPECT_EQ(Ball::around(floor, padding).radius, infinity);
    const Sphere sphere = Sphere::around(floor, padding);
    EXPECT_EQ(sphere.radius, kInfinity);
    for (const float coordinate : sphere.center) EXPECT_TRUE(std::isfinite(coordinate));
  }
}

// Packs.

template <class V, int N>
struct PackCase {
  using Volume = V;
  static constexpr int kLanes = N;
};

struct PackCaseName {
  template <class T>
  static std::string GetName(int) {
    return (std::is_same_v<typename T::Volume, Box> ? "Box" : "Sphere") + std::to_string(T::kLanes);
  }
};

// What a pack must answer, one volume at a time.

bool overlap(const Box& p, const Box& q) {
  for (int axis = 0; axis < 3; ++axis) {
    if (!(p.low[axis] <= q.high[axis] && q.low[axis] <= p.high[axis])) return false;
  }
  return true;
}
bool overlap(const Sphere& p, const Sphere& q) {
  const float x = p.center[0] - q.center[0], y = p.center[1] - q.center[1],
              z = p.center[2] - q.center[2];
  const float reach = p.radius + q.radius;
  return x * x + y * y + z * z <= reach * reach * (1 + 0x1p-20f) + kSmallest;
}

/// Exact except for the rounding of long double; negative for spheres that overlap.
Real gapOf(const Box& p, const Box& q) {
  Real squared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const Real gap = std::max(
        {Real(p.low[axis]) - Real(q.high[axis]), Real(q.low[axis]) - Real(p.high[axis]), Real(0)});
    squared += gap * gap;
  }
  return std::sqrt(squared);
}
Real gapOf(const Sphere& p, const Sphere& q) {
  return distance(centerOf(p), centerOf(q)) - Real(p.radius) - Real(q.radius);
}

/// What rounding is relative to.
Real sizeOf(const Box& p, const Box& q) { return gapOf(p, q); }
Real sizeOf(const Sphere& p, const Sphere& q) {
  return std::fabs(gapOf(p, q)) + 2 * (Real(p.radius) + Real(q.radius));
}

/// Volumes to ask about.
template <class Volume>
struct Make;

template <>
struct Make<Box> {
  static Box anyVolume(Random& random, float scale) {
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = scale * static_cast<float>(random.between(-1, 1));
      box.high[axis] = box.low[axis] + scale * static_cast<float>(random.unit());
    }
    return box;
  }
  /// Just touches the other, on one axis.
  static Box touching(const Box& p, float size) {
    return {{p.high[0], p.low[1], p.low[2]}, {p.high[0] + size, p.high[1], p.high[2]}};
  }
  static Box all() {
    return {{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
  }
  /// Of radius 1, around (x, 0, 0).
  static Box at(float x) { return {{x - 1, -1, -1}, {x + 1, 1, 1}}; }
};

template <>
struct Make<Sphere> {
  static Sphere anyVolume(Random& random, float scale) {
    Sphere sphere;
    for (float& x : sphere.center) x = scale * static_cast<float>(random.between(-1, 1));
    sphere.radius = scale * static_cast<float>(random.between(0, 0.7));
    return sphere;
  }
  static Sphere touching(const Sphere& p, float size) {
    return {{p.center[0] + (p.radius + size), p.center[1], p.center[2]}, size};
  }
  static Sphere all() { return {{0, 0, 0}, kInfinity}; }
  static Sphere at(float x) { return {{x, 0, 0}, 1}; }
};

template <class Case>
class PackTest : public testing::Test, public Make<typename Case::Volume> {
 protected:
  using Volume = typename Case::Volume;
  static constexpr int kLanes = Case::kLanes;
  using Pack = typename Volume::template Pack<kLanes>;

  static Pack packOf(const std::vector<Volume>& volumes) {
    Pack pack;
    for (int lane = 0; lane < kLanes; ++lane)
      pack.set(lane, volumes[static_cast<std::size_t>(lane)]);
    return pack;
  }
  static std::vector<Volume> randomVolumes(Random& random, float scale) {
    std::vector<Volume> volumes;
    for (int lane = 0; lane < kLanes; ++lane) volumes.push_back(PackTest::anyVolume(random, scale));
    return volumes;
  }
  static LaneMask lanesOf(const std::vector<Volume>& volumes, const Volume& volume) {
    LaneMask mask = 0;
    for (int lane = 0; lane < kLanes; ++lane) {
      if (overlap(volumes[static_cast<std::size_t>(lane)], volume)) mask |= LaneMask{1} << lane;
    }
    return mask;
  }
};

using PackCases =
    testing::Types<PackCase<Box, 2>, PackCase<Box, 8>, PackCase<Sphere, 2>, PackCase<Sphere, 8>>;
TYPED_TEST_SUITE(PackTest, PackCases, PackCaseName);

TYPED_TEST(PackTest, OverlapsAreThoseOfOneVolumeAtATime) {
  // If this fails, lanes are mixed up, or the wide test rounds in another way than the narrow one.
  Random random(4);
  int overlapping = 0, apart = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto scale = static_cast<float>(std::pow(10.0, random.between(-25, 25)));
    const auto volumes = this->randomVolumes(random, scale);
    const auto pack = this->packOf(volumes);
    // Every third touches a lane as exactly as floats allow.
    auto volume = this->anyVolume(random, scale);
    if (i % 3 == 0) {
      volume = this->touching(volumes[random.below(volumes.size())],
                              scale * static_cast<float>(random.unit()));
    }
    const LaneMask expected = this->lanesOf(volumes, volume);
    ASSERT_EQ(overlaps(pack, volume), expected) << i;
    (expected == 0 ? apart : overlapping)++;
  }
  EXPECT_GT(overlapping, 2000);
  EXPECT_GT(apart, 1000);
}

TEST(BoxPack, BoxesAreClosedToTheLastBitOnEveryAxis) {
  // If this fails, some comparison of the six is strict, or looks at another axis.
  const Box box{{0, 0, 0}, {1, 1, 1}};
  Box::Pack<8> pack;
  pack.set(3, box);
  for (int axis = 0; axis < 3; ++axis) {
    Box other = box;
    other.low[axis] = 1;
    other.high[axis] = 2;
    EXPECT_EQ(overlaps(pack, other), 8u);
    other.low[axis] = floatAbove(1);
    EXPECT_EQ(overlaps(pack, other), 0u);
    other.low[axis] = -1;
    other.high[axis] = 0;
    EXPECT_EQ(overlaps(pack, other), 8u);
    other.high[axis] = -1e-30f;
    EXPECT_EQ(overlaps(pack, other), 0u);
  }
}

TYPED_TEST(PackTest, EachLaneAnswersForItself) {
  // If this fails, a lane is missed or answers in the place of another.
  for (int lane = 0; lane < TestFixture::kLanes; ++lane) {
    typename TestFixture::Pack pack;
    for (int other = 0; other < TestFixture::kLanes; ++other) pack.set(other, this->at(100));
    pack.set(lane, this->at(0));
    EXPECT_EQ(overlaps(pack, this->at(0)), LaneMask{1} << lane);
    EXPECT_EQ(overlaps(pack, this->at(100)),
              firstLanes(TestFixture::kLanes) & ~(LaneMask{1} << lane));
    float distances[TestFixture::kLanes];
    EXPECT_EQ(nearer(pack, this->at(0), 97, distances), LaneMask{1} << lane);
    EXPECT_EQ(nearer(pack, this->at(0), 99, distances), firstLanes(TestFixture::kLanes));
    for (int other = 0; other < TestFixture::kLanes; ++other) {
      EXPECT_NEAR(distances[other], other == lane ? 0 : 98, 1e-3) << lane;
    }
    EXPECT_EQ(overlap(pack.get(lane), this->at(0)), true);
    EXPECT_EQ(pack.get(lane).size(), this->at(0).size());
  }
}

TYPED_TEST(PackTest, ClearedLanesOverlapNothingAndAreNearNothing) {
  // If this fails, a node with few children has more, out of nowhere.
  typename TestFixture::Pack pack;
  float distances[TestFixture::kLanes];
  const LaneMask all = firstLanes(TestFixture::kLanes);
  const auto expectNone = [&](LaneMask lanes) {
    for (const auto& volume : {this->all(), this->at(0), this->at(1e30f)}) {
      EXPECT_EQ(overlaps(pack, volume) & lanes, 0u);
      EXPECT_EQ(nearer(pack, volume, kInfinity, distances), ~lanes & all);
    }
  };
  expectNone(all);
  for (int lane = 0; lane < TestFixture::kLanes; ++lane) {
    pack.set(lane, this->at(0));
    expectNone(all & ~(LaneMask{1} << lane));
    EXPECT_EQ(overlaps(pack, this->at(0)), LaneMask{1} << lane);
    pack.set(lane, this->all());
    expectNone(all & ~(LaneMask{1} << lane));
    pack.clear(lane);
    expectNone(all);
  }
}

TYPED_TEST(PackTest, UnboundedVolumesOverlapAll) {
  // If this fails, infinity minus infinity has made a volume that covers everything miss something.
  typename TestFixture::Pack pack;
  const LaneMask lanes = firstLanes(TestFixture::kLanes);
  for (int lane = 0; lane < TestFixture::kLanes; ++lane) pack.set(lane, this->all());
  float distances[TestFixture::kLanes];
  for (const auto& volume :
       {this->all(), this->at(0), this->at(1e15f), this->at(-1e30f), this->at(kLargest)}) {
    EXPECT_EQ(overlaps(pack, volume), lanes);
    EXPECT_EQ(nearer(pack, volume, 0, distances), lanes);
    for (int lane = 0; lane < TestFixture::kLanes; ++lane) EXPECT_EQ(distances[lane], 0) << lane;
  }
}

TYPED_TEST(PackTest, NothingIsMissedAndOverlapsAndDistancesAreTight) {
  // If this fails, squares that overflow or vanish make volumes that meet look apart, or something
  // look farther than it is; or one well apart is reported, or nothing is pruned.
  Random random(7);
  for (int i = 0; i < 80000; ++i) {
    const bool is_moderate = i % 4 == 0;
    const double most = is_moderate ? 12 : 38;
    const auto scale = static_cast<float>(std::pow(10.0, random.between(-most, most)));
    const auto other_scale = static_cast<float>(std::pow(10.0, random.between(-most, most)));
    const auto volumes = this->randomVolumes(random, scale);
    auto volume = this->anyVolume(random, !is_moderate && i % 3 == 0 ? other_scale : scale);
    if (is_moderate && i % 3 == 0) volume = this->touching(volumes[0], scale);
    const auto pack = this->packOf(volumes);
    const LaneMask mask = overlaps(pack, volume);
    float distances[TestFixture::kLanes];
    ASSERT_EQ(nearer(pack, volume, kInfinity, distances), firstLanes(TestFixture::kLanes));
    for (int lane = 0; lane < TestFixture::kLanes; ++lane) {
      const auto& other = volumes[static_cast<std::size_t>(lane)];
      const Real gap = gapOf(other, volume), size = sizeOf(other, volume);
      const bool overlapping = (mask >> lane & 1u) != 0;
      ASSERT_TRUE(gap > 0 || overlapping) << i << " scale " << scale;
      ASSERT_GE(distances[lane], 0) << i << " scale " << scale;
      ASSERT_LE(Real(distances[lane]), std::max(gap, Real(0))) << i << " scale " << scale;
      if (!is_moderate) continue;
      ASSERT_FALSE(gap > 4e-6L * size && overlapping) << i;
      ASSERT_GE(Real(distances[lane]), gap - 1e-5L * size) << i;
    }
  }
}

TEST(SpherePack, SpheresOutOfRangeAreAtDistanceZero) {
  // If this fails, a sphere that has grown beyond the range of float is lost to distance queries.
  Sphere::Pack<8> pack;
  pack.set(0, {{1e30f, 0, 0}, kInfinity});
  float distances[8];
  EXPECT_EQ(nearer(pack, {{0, 0, 0}, 1}, 0, distances), 1u);
  EXPECT_EQ(distances[0], 0);
  EXPECT_EQ(nearer(pack, {{-1e30f, 0, 0}, kInfinity}, 0, distances), 1u);
  EXPECT_EQ(distances[0], 0);
  EXPECT_EQ(overlaps(pack, {{-1e30f, 0, 0}, 1}), 1u);
}

template <int N>
void expectUnion() {
  Random random(10);
  for (int i = 0; i < 2000; ++i) {
    Box::Pack<N> pack;
    Box expected{{kLargest, kLargest, kLargest}, {-kLargest, -kLargest, -kLargest}};
    for (int lane = 0; lane < N; ++lane) {
      pack.set(lane, Make<Box>::anyVolume(random, 1e9f));
      if (random.below(3) == 0) {
        pack.clear(lane);
        continue;
      }
      const Box box = pack.get(lane);
      for (int axis = 0; axis < 3; ++axis) {
        expected.low[axis] = std::min(expected.low[axis], box.low[axis]);
        expected.high[axis] = std::max(expected.high[axis], box.high[axis]);
      }
    }
    const Box united = unite(pack);
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_EQ(united.low[axis], expected.low[axis]);
      ASSERT_EQ(united.high[axis], expected.high[axis]);
    }
  }
}

TEST(BoxPack, UnionIsTheLeastBoxAroundAllButTheClearedLanes) {
  // If this fails, a parent does not contain its children, or a cleared lane spoils it.
  expectUnion<2>();
  expectUnion<8>();
}

TEST(Size, OrdersVolumesByExtent) {
  // If this fails, traversal descends the smaller of two volumes.
  EXPECT_EQ((Box{{0, 0, 0}, {1, 2, 3}}.size()), 6);
  EXPECT_EQ((Box{{-1, -1, -1}, {-1, -1, -1}}.size()), 0);
  EXPECT_EQ((Sphere{{5, 6, 7}, 2}.size()), 2);
  EXPECT_EQ(Make<Box>::all().size(), kInfinity);
}

TEST(FlushToZero, IsOnWhereTheEnvironmentAsksForIt) {
  // If this fails, the step flush_to_zero of tests/full.sh tests what all others do.
  volatile float least = kSmallest;
  EXPECT_EQ(least / 2 == 0, std::getenv("FCL_FIBERS_FLUSH_TO_ZERO") != nullptr);
}

}  // namespace
}  // namespace fcl_fibers::geometry
