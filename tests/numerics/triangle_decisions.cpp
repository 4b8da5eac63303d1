// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/triangle_decisions.h"

#include <array>
#include <cmath>
#include <limits>
#include <sstream>

#include "geometry/triangle_distance.h"
#include "geometry/triangle_test.h"
#include "support/exact_geometry.h"
#include "support/random.h"
#include "support/segments.h"
#include "support/triangle_oracle.h"

namespace fcl_fibers::test {
namespace {

using geometry::fromEigen;
using geometry::Segment;
using geometry::Triangle;
using geometry::Vec3d;

struct Pair {
  Segment segment;
  Triangle triangle;

  std::array<Vec3d*, 5> points() {
    return {&segment.a, &segment.b, &triangle.a, &triangle.b, &triangle.c};
  }
};

double powerOfTen(Random& random, double low, double high) {
  return std::pow(10, random.between(low, high));
}
Vec3d inCube(Random& random) { return fromEigen(random.inCube(1)); }
Vec3d direction(Random& random) { return fromEigen(random.direction()); }
Vec3d onGrid(Random& random, double largest) {
  const Vec3d p = inCube(random);
  return {std::round(largest * p.x), std::round(largest * p.y), std::round(largest * p.z)};
}
/// Of the triangle, on an edge or at a corner as often as inside.
Vec3d pointOf(Random& random, const Triangle& t) {
  double x = random.unit(), y = random.unit() * (1 - x);
  if (random.below(4) == 0) x = 0;
  if (random.below(4) == 0) y = random.below(2) == 0 ? 0 : 1 - x;
  return t.a + x * (t.b - t.a) + y * (t.c - t.a);
}
/// Through a point.
Segment along(Random& random, const Vec3d& p, const Vec3d& v) {
  const double before = random.below(3) == 0 ? 0 : random.unit();
  return {p - before * v, p + random.unit() * v, 0};
}

Pair anywhere(Random& random) {
  return {{inCube(random), inCube(random), 0}, {inCube(random), inCube(random), inCube(random)}};
}
Pair grid(Random& random) {
  const double largest = random.below(2) == 0 ? 2 : 9;
  const auto p = [&] { return onGrid(random, largest); };
  return {{p(), p(), 0}, {p(), p(), p()}};
}
Pair coplanar(Random& random) {
  Pair pair = grid(random);
  for (Vec3d* p : pair.points()) p->z = 0;
  const double gap = static_cast<double>(random.below(3));
  pair.segment.a.z = pair.segment.b.z = gap;
  // A slope that is exact; the plane is not.
  const double slope =
      random.below(2) == 0 ? 0 : std::ldexp(1.0, -static_cast<int>(random.below(50)));
  for (Vec3d* p : pair.points()) p->z += slope * p->x;
  return pair;
}
/// As hair that meets a head.
Pair near(Random& random) {
  Pair pair = anywhere(random);
  const Vec3d p = pointOf(random, pair.triangle) + powerOfTen(random, -17, -1) * direction(random);
  pair.segment = along(random, p, powerOfTen(random, -3, 1) * direction(random));
  return pair;
}
Pair needle(Random& random) {
  Pair pair = near(random);
  Triangle& t = pair.triangle;
  t.c = t.a + random.between(-1, 2) * (t.b - t.a) + powerOfTen(random, -18, -1) * inCube(random);
  pair.segment = along(random, pointOf(random, t) + powerOfTen(random, -17, 0) * direction(random),
                       inCube(random));
  return pair;
}
Pair withoutArea(Random& random) {
  Pair pair = random.below(2) == 0 ? grid(random) : near(random);
  Triangle& t = pair.triangle;
  const double stretch = static_cast<double>(random.below(5)) - 2;
  t.c = random.below(2) == 0 ? t.b : t.a + stretch * (t.b - t.a);
  if (random.below(3) == 0) t.b = t.c = t.a;
  return pair;
}
Pair withoutLength(Random& random) {
  Pair pair = random.below(2) == 0 ? grid(random) : near(random);
  pair.segment.b = pair.segment.a;
  return pair;
}
Pair nearlyInPlane(Random& random) {
  Pair pair = anywhere(random);
  const Triangle& t = pair.triangle;
  const Vec3d v = pointOf(random, t) - pointOf(random, t);
  const Vec3d p = pointOf(random, t) + powerOfTen(random, -17, 0) * direction(random);
  pair.segment = along(random, p, v + powerOfTen(random, -18, -1) * direction(random));
  return pair;
}
Pair nearlyAlongAnEdge(Random& random) {
  Pair pair = random.below(2) == 0 ? needle(random) : anywhere(random);
  const Triangle& t = pair.triangle;
  const Vec3d v = random.below(2) == 0 ? t.b - t.a : t.c - t.b;
  const Vec3d p = t.b + powerOfTen(random, -17, 0) * direction(random);
  pair.segment = along(random, p - random.unit() * v,
                       random.between(-2, 2) * v + powerOfTen(random, -18, -1) * direction(random));
  return pair;
}
Pair ofUnlikeSizes(Random& random) {
  Pair pair = near(random);
  Segment& s = pair.segment;
  Triangle& t = pair.triangle;
  if (random.below(2) == 0) {
    s = along(random, s.a, powerOfTen(random, -13, 13) * direction(random));
  } else {
    const double size = powerOfTen(random, -13, 13);
    t = {t.a, t.a + size * inCube(random), t.a + size * inCube(random)};
  }
  return pair;
}
Pair farFromTheOrigin(Random& random) {
  Pair pair = random.below(2) == 0 ? near(random) : needle(random);
  const Vec3d offset = powerOfTen(random, 1, 15) * direction(random);
  for (Vec3d* p : pair.points()) *p = *p + offset;
  return pair;
}

constexpr Pair (*kMakers[])(Random&) = {
    anywhere,      grid,          coplanar,          near,          needle,          withoutArea,
    withoutLength, nearlyInPlane, nearlyAlongAnEdge, ofUnlikeSizes, farFromTheOrigin};

std::array<double, 3> numbers(const Vec3d& v) { return {v.x, v.y, v.z}; }

double sizeOf(const Pair& pair) {
  const auto norm1 = [](const Vec3d& v) {
    return std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z);
  };
  const auto& [s, t] = pair;
  return norm1(s.a - t.a) + norm1(s.b - s.a) + norm1(t.b - t.a) + norm1(t.c - t.a);
}

Real distanceOf(const Pair& pair) {
  const auto& [s, t] = pair;
  return segmentTriangleDistance(toPoint(s.a), toPoint(s.b),
                                 {toPoint(t.a), toPoint(t.b), toPoint(t.c)});
}

/// Near the distance, or none.
double someReach(Random& random, double distance, double size) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double sign = random.below(2) == 0 ? 1 : -1;
  switch (random.below(6)) {
    case 0:
      return distance;
    case 1:
      return std::nextafter(distance, sign * kInfinity);
    case 2:
      return distance * (1 + sign * powerOfTen(random, -16, 0));
    case 3:
      return distance + sign * powerOfTen(random, -17, -10) * size;
    case 4:
      return 0;
    default:
      return size * random.unit();
  }
}

/// What TrianglePairs decides of one pair: 1 for touching, -1 for apart, 0 for neither.
int inFloat(const Pair& pair, double reach, double unit) {
  const auto& [s, t] = pair;
  const geometry::CapsuleEnd ends[] = {{{s.a.x, s.a.y, s.a.z, reach}}, {{s.b.x, s.b.y, s.b.z, 0}}};
  geometry::MeshPoint corners[3];
  for (int i = 0; i < 3; ++i) {
    const Vec3d& p = *std::array{&t.a, &t.b, &t.c}[static_cast<std::size_t>(i)];
    corners[i] = {{p.x, p.y, p.z, 0}};
  }
  geometry::TrianglePairs pairs(geometry::AffineMap(), unit);
  pairs.add(ends, {&corners[0], &corners[1], &corners[2]}, /*margin=*/0, /*error=*/0);
  const auto [touching, apart] = pairs.decide();
  return static_cast<int>(touching & 1u) - static_cast<int>(apart & 1u);
}

void decide(Random& random, TriangleTally& tally) {
  Pair pair = kMakers[tally.decisions % std::size(kMakers)](random);
  const auto distance = static_cast<double>(distanceOf(pair));
  double size = sizeOf(pair);
  double reach = std::max(0.0, someReach(random, distance, size));
  tally.at_contact += std::fabs(distance - reach) <= 1e-12 * size;
  if (random.below(4) == 0) {
    const double scale = std::ldexp(1.0, static_cast<int>(random.below(1961)) - 1000);
    for (Vec3d* p : pair.points()) *p = scale * *p;
    reach *= scale;
    size *= scale;
  }
  const auto& [s, t] = pair;
  const GivenSegment segment{numbers(s.a), numbers(s.b)};
  const GivenTriangle triangle{numbers(t.a), numbers(t.b), numbers(t.c)};
  const bool answer = axisWithin(s, t, reach);
  const auto judge = [&](double slack) {
    const double least = std::numeric_limits<double>::denorm_min();
    return TriangleOracle::judge(segment, triangle, answer ? reach + slack * size + least : reach);
  };
  const double unit = tally.decisions % 4 == 0 ? 1 : geometry::PairBlock::unitFor(size);
  const int in_float = inFloat(pair, reach, unit);
  if (in_float != 0) {
    ++tally.in_float;
    // There is no tolerance: what float cannot decide has to be left open.
    tally.wrong_in_float +=
        TriangleOracle::judge(segment, triangle, reach).within != (in_float > 0);
  }
  const auto [within, exact] = judge(kUsualExcess);
  ++tally.decisions;
  tally.within += answer;
  tally.exact += exact;
  if (within == answer) return;
  tally.beyond_usual += answer;
  if (answer && judge(kMostExcess).within) return;
  ++(answer ? tally.unpromised : tally.missed);
  if (!tally.first_wrong.empty()) return;
  std::ostringstream out;
  out << std::hexfloat << (answer ? "not within " : "missed within ") << reach << ':';
  for (const Vec3d* p : pair.points()) out << " (" << p->x << ", " << p->y << ", " << p->z << ')';
  tally.first_wrong = out.str();
}

}  // namespace

TriangleTally decideTriangles(std::uint64_t decisions, std::uint64_t seed) {
  Random random(seed);
  TriangleTally tally;
  while (tally.decisions < decisions) decide(random, tally);
  return tally;
}

}  // namespace fcl_fibers::test
