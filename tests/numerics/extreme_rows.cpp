// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/extreme_rows.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <type_traits>
#include <utility>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "support/random.h"

namespace fcl_fibers::test {
namespace {

using Point = std::array<double, 3>;

Point operator+(const Point& p, const Point& q) { return {p[0] + q[0], p[1] + q[1], p[2] + q[2]}; }
Point operator*(double s, const Point& p) { return {s * p[0], s * p[1], s * p[2]}; }
Point toPoint(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

/// A lock of hair about 50 radii across, at `origin` and `scale` times as large: 20 fibers of 15
/// segments that wander side by side. Many segments touch others.
template <typename S>
Assembly<S> lock(const Point& origin, double scale, double radius, std::uint64_t seed) {
  Random random(seed);
  Assembly<S> fibers;
  for (int f = 0; f < 20; ++f) {
    Point p = 25 * radius * toPoint(random.inCube(1));
    Point along = {0, 0, 10 * radius};
    for (int i = 0; i <= 15; ++i) {
      fibers.addPoint(origin + scale * p, scale * radius);
      along = along + 4 * radius * toPoint(random.inCube(1));
      p = p + along;
    }
    fibers.endFiber();
  }
  return fibers;
}

/// Capsules of all directions in a cube.
template <typename S>
Assembly<S> soup(int count, double length, double radius, double side, std::uint64_t seed) {
  Random random(seed);
  Assembly<S> fibers;
  for (int i = 0; i < count; ++i) {
    const Point a = toPoint(random.inCube(side / 2));
    fibers.addCapsule(a, a + length * toPoint(random.direction()), radius);
  }
  return fibers;
}

/// A walk over points with whole coordinates, in units of `unit`; radii are whole as well. Contact
/// is often exact, and segments coincide.
template <typename S>
Assembly<S> lattice(double unit, std::uint64_t seed) {
  Random random(seed);
  Assembly<S> fibers;
  for (int f = 0; f < 12; ++f) {
    Point p = {0, 0, 0};
    for (int i = 0; i <= 12; ++i) {
      fibers.addPoint(unit * p, unit * static_cast<double>(random.below(3)));
      for (double& x : p) x += 4 * (static_cast<double>(random.below(5)) - 2);
    }
    fibers.endFiber();
  }
  return fibers;
}

template <typename S>
S neighbor(S x, int ulps) {
  for (; ulps > 0; --ulps) x = std::nextafter(x, std::numeric_limits<S>::infinity());
  for (; ulps < 0; ++ulps) x = std::nextafter(x, -std::numeric_limits<S>::infinity());
  return x;
}

/// Pairs of capsules at a distance of exactly the sum of their radii, but for the second one's, by
/// `ulps`: side by side, end to end, crossing, and two balls.
template <typename S>
Assembly<S> contact(int ulps) {
  Assembly<S> fibers;
  for (int i = 0; i < 40; ++i) {
    const double x = 16.0 * i;
    const double size = std::ldexp(1.0, i % 10 - 8);
    const S reach = static_cast<S>(3 * size);
    const double gap = static_cast<double>(neighbor(reach, ulps));
    const double a = size, b = 2 * size;
    // Along y, so that x rounds nothing.
    const Point low = {x, 0, 0}, high = {x + 1, 0, 0}, up = {0, gap, 0};
    switch (i % 4) {
      case 0:
        fibers.addCapsule(low, high, a);
        fibers.addCapsule(high + up, low + up, b);
        break;
      case 1:
        fibers.addCapsule(low, {x, -1, 0}, a);
        fibers.addCapsule(low + up, {x, 8, 0}, b);
        break;
      case 2:
        fibers.addCapsule(low, high, a);
        fibers.addCapsule(Point{x + 0.5, 0, -1} + up, Point{x + 0.5, 0, 1} + up, b);
        break;
      default:
        fibers.addBall(low, a);
        fibers.addBall(low + up, b);
    }
  }
  return fibers;
}

/// Pairs that cross at angles of 10^-k, at no distance, at that of contact, and beyond.
template <typename S>
Assembly<S> crossings() {
  Assembly<S> fibers;
  for (int k = 0; k <= 12; ++k) {
    const double tilt = std::pow(10.0, -k);
    for (int i = 0; i < 6; ++i) {
      // Small numbers along y, where they stay exact.
      const double z = 8.0 * (6 * k + i), radius = i < 3 ? 0 : 0x1p-8;
      const double gap = i % 3 == 0 ? 0 : i % 3 == 1 ? 2 * radius : 2.25 * radius + 0x1p-12;
      fibers.addCapsule({-1, -tilt / 2, z}, {1, tilt / 2, z}, radius);
      fibers.addCapsule({-1, tilt / 2, z + gap}, {1, -tilt / 2, z + gap}, radius);
    }
  }
  return fibers;
}

/// Capsules along one direction, `sense` +1 or -1 in turn where it is -1; `spread` apart across.
template <typename S>
Assembly<S> alongOneDirection(const Point& direction, int sense, double spread, double radius,
                              std::uint64_t seed) {
  Random random(seed);
  Assembly<S> fibers;
  for (int i = 0; i < 200; ++i) {
    // Whole numbers: parallel to the last bit in float as well.
    Point a = static_cast<double>(random.below(64)) * direction;
    a = a + Point{spread * static_cast<double>(random.below(8)),
                  spread * static_cast<double>(random.below(8)), 0};
    const double length = static_cast<double>(random.below(8));
    fibers.addCapsule(a, a + (i % 2 == 0 ? 1 : sense) * length * direction, radius);
  }
  return fibers;
}

/// Balls on a sphere of radius 15, all of whose centres have whole coordinates.
template <typename S>
Assembly<S> cosphericalBalls() {
  Assembly<S> fibers;
  for (int x = -15; x <= 15; ++x) {
    for (int y = -15; y <= 15; ++y) {
      for (int z = -15; z <= 15; ++z) {
        if (x * x + y * y + z * z != 225) continue;
        fibers.addBall({double(x), double(y), double(z)}, (x + y + z) % 2 == 0 ? 1 : 1.5);
      }
    }
  }
  return fibers;
}

template <typename S>
Assembly<S> coplanarBalls() {
  Assembly<S> fibers;
  for (int x = 0; x < 16; ++x) {
    for (int y = 0; y < 16; ++y) fibers.addBall({double(x), double(y), 3}, (x + y) % 3 * 0.5);
  }
  return fibers;
}

template <typename S>
Assembly<S> collinearBalls() {
  Assembly<S> fibers;
  for (int i = 0; i < 250; ++i) fibers.addBall({double(i), 2.0 * i, -2.0 * i}, i % 3 * 1.5);
  return fibers;
}

template <typename S>
Assembly<S> coincidentBalls(bool nested) {
  Assembly<S> fibers;
  for (int i = 0; i < 120; ++i) fibers.addBall({0.1, 0.2, 0.3}, nested ? std::ldexp(1.0, -i) : 1);
  return fibers;
}

/// All inside the first one, and tangent to it from inside.
template <typename S>
Assembly<S> internallyTangentBalls() {
  Assembly<S> fibers;
  fibers.addBall({0, 0, 0}, 64);
  for (int i = 0; i < 120; ++i) {
    const double radius = 1 + i % 32;
    Point center = {0, 0, 0};
    center[static_cast<std::size_t>(i % 3)] = (i % 2 == 0 ? 1 : -1) * (64 - radius);
    fibers.addBall(center, radius);
  }
  return fibers;
}

template <typename S>
Assembly<S> identical() {
  Assembly<S> fibers;
  for (int i = 0; i < 300; ++i) {
    if (i % 2 == 0) {
      fibers.addCapsule({0.1, 0.2, 0.3}, {0.4, 0.6, 0.9}, i % 3 * 1e-3);
    } else {
      fibers.addCapsule({0.4, 0.6, 0.9}, {0.1, 0.2, 0.3}, i % 3 * 1e-3);
    }
  }
  return fibers;
}

/// Each within the next one, on one line.
template <typename S>
Assembly<S> nested() {
  Assembly<S> fibers;
  for (int i = 0; i < 300; ++i) fibers.addCapsule({-1.0 - i, 0, 0}, {1.0 + i, 0, 0}, 0);
  return fibers;
}

}  // namespace

template <typename S>
std::vector<ExtremeRow<S>> extremeRows() {
  constexpr bool kDouble = std::is_same_v<S, double>;
  constexpr double kLeast = static_cast<double>(std::numeric_limits<S>::denorm_min());
  constexpr double kMost = static_cast<double>(std::numeric_limits<S>::max());
  constexpr double kHair = 1e-5;
  std::vector<ExtremeRow<S>> rows;
  const auto add = [&](std::string name, Assembly<S> fibers, double margin = 0) {
    rows.push_back({std::move(name), std::move(fibers), margin, false});
  };

  for (const int exponent : {0, 3, 6, 9, 12, 15}) {
    const double far = exponent == 0 ? 0 : std::pow(10.0, exponent);
    add("Offset" + (exponent == 0 ? std::string("None") : "1e" + std::to_string(exponent)),
        lock<S>({far, -far, far / 2}, 1, kHair, 1));
  }
  for (const int part : {-3, -2, -1, 1, 2, 3}) {
    const int exponent = part * (kDouble ? 50 : 10);
    const std::string sign = part < 0 ? "Down" : "Up";
    add("Scale" + sign + std::to_string(std::abs(part)) + "Thirds",
        lock<S>({0, 0, 0}, std::pow(10.0, exponent), 1e-2, 2));
  }

  Assembly<S> points = soup<S>(200, 0, 0.05, 1, 3);
  for (const auto& capsule : soup<S>(100, 0.3, 0.05, 1, 4).capsules()) {
    points.addCapsule(capsule.a, capsule.b, capsule.radius);
  }
  add("ZeroLength", points);
  std::fill(points.radii.begin(), points.radii.end(), S(0));
  for (int i = 0; i < 100; ++i) {  // Points on points, and at ends of segments.
    points.addBall(points.point(static_cast<std::size_t>(2 * i)), 0);
    points.addBall(points.point(static_cast<std::size_t>(401 + 2 * i)), 0);
  }
  add("ZeroLengthAndRadius", points);
  add("ZeroRadius", lattice<S>(1, 5));
  std::fill(rows.back().fibers.radii.begin(), rows.back().fibers.radii.end(), S(0));
  add("RadiusFarLarger", soup<S>(300, 1e-12, 1, 10, 6));
  // So thin that only those touch that share an end or cross exactly.
  add("RadiusFarSmaller", lattice<S>(1, 8));
  std::fill(rows.back().fibers.radii.begin(), rows.back().fibers.radii.end(), S(1e-12));
  {
    Assembly<S> mixed = soup<S>(150, 1e-12, 1e-13, 1e-11, 9);
    for (const auto& capsule : soup<S>(50, 1, 0.01, 1, 10).capsules()) {
      mixed.addCapsule(capsule.a, capsule.b, capsule.radius);
    }
    add("SizesFarApart", mixed);
  }

  for (const bool flush : {false, true}) {
    add(std::string("Subnormal") + (flush ? "FlushedToZero" : ""), lattice<S>(kLeast, 11));
    rows.back().flush_to_zero = flush;
    // Subnormal numbers beside others.
    Assembly<S> beside = lattice<S>(kLeast, 12);
    for (const auto& capsule : soup<S>(50, 1, 0.1, 1, 13).capsules()) {
      beside.addCapsule(capsule.a, capsule.b, capsule.radius);
    }
    add(std::string("SubnormalBesideNormal") + (flush ? "FlushedToZero" : ""), beside);
    rows.back().flush_to_zero = flush;
    add(std::string("NormalLock") + (flush ? "FlushedToZero" : ""), lock<S>({0, 0, 0}, 1, 1e-2, 2));
    rows.back().flush_to_zero = flush;
  }
  add("NearOverflow", soup<S>(300, kMost / 64, kMost / 128, kMost / 16, 14));
  add("MarginNearOverflow", lattice<S>(1, 15), std::numeric_limits<double>::max() / 2);
  add("Margin", lattice<S>(1, 15), 1);

  add("Contact", contact<S>(0));
  add("ContactLess1Ulp", contact<S>(-1));
  add("ContactPlus1Ulp", contact<S>(1));
  add("ContactOnLattice", lattice<S>(1, 16));
  add("Crossings", crossings<S>());
  add("Parallel", alongOneDirection<S>({3, -2, 1}, 1, 1, 0.5, 17));
  add("AntiParallel", alongOneDirection<S>({3, -2, 1}, -1, 1, 0.5, 18));
  add("Collinear", alongOneDirection<S>({3, -2, 1}, -1, 0, 0, 19));
  add("Identical", identical<S>());
  add("Nested", nested<S>());
  add("BallsCospherical", cosphericalBalls<S>());
  add("BallsCoplanar", coplanarBalls<S>());
  add("BallsCollinear", collinearBalls<S>());
  add("BallsCoincident", coincidentBalls<S>(false));
  add("BallsNested", coincidentBalls<S>(true));
  add("BallsInternallyTangent", internallyTangentBalls<S>());
  return rows;
}

template std::vector<ExtremeRow<float>> extremeRows<float>();
template std::vector<ExtremeRow<double>> extremeRows<double>();

#if defined(__SSE2__)
ScopedFlushToZero::ScopedFlushToZero(bool on) : before_(_mm_getcsr()) {
  constexpr unsigned kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040;
  if (on) _mm_setcsr(before_ | kFlushToZero | kDenormalsAreZero);
}
ScopedFlushToZero::~ScopedFlushToZero() { _mm_setcsr(before_); }
#else
ScopedFlushToZero::ScopedFlushToZero(bool) {}
ScopedFlushToZero::~ScopedFlushToZero() = default;
#endif

}  // namespace fcl_fibers::test
