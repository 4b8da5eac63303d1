// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/touch_decisions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <sstream>

#include "geometry/capsule_test.h"
#include "geometry/segment_distance.h"
#include "geometry/triangle_distance.h"
#include "geometry/triangle_test.h"
#include "support/impact_oracle.h"
#include "support/random.h"
#include "support/scoped_target.h"
#include "support/segments.h"

namespace fcl_fibers::test {
namespace {

using geometry::fromEigen;
using geometry::Segment;
using geometry::Triangle;
using geometry::Vec3d;

/// A segment and the hull of two or three corners. Of two, the last is there twice.
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
// Compilers differ in the order of the operands of an expression. So each draw is a statement.

/// @param shape  inCube or direction
Vec3d ofSize(Random& random, double low, double high, Vec3d (*shape)(Random&)) {
  const double size = powerOfTen(random, low, high);
  return size * shape(random);
}
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
/// At a distance of it.
Vec3d besideIt(Random& random, const Triangle& t, double low, double high) {
  const Vec3d p = pointOf(random, t);
  return p + ofSize(random, low, high, direction);
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
  const Vec3d p = besideIt(random, pair.triangle, -17, -1);
  pair.segment = along(random, p, ofSize(random, -3, 1, direction));
  return pair;
}
Pair needle(Random& random) {
  Pair pair = near(random);
  Triangle& t = pair.triangle;
  t.c = t.a + random.between(-1, 2) * (t.b - t.a);
  t.c = t.c + ofSize(random, -18, -1, inCube);
  const Vec3d p = besideIt(random, t, -17, 0);
  pair.segment = along(random, p, inCube(random));
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
  const Vec3d from = pointOf(random, t), to = pointOf(random, t);
  const Vec3d p = besideIt(random, t, -17, 0);
  pair.segment = along(random, p, to - from + ofSize(random, -18, -1, direction));
  return pair;
}
Pair nearlyAlongAnEdge(Random& random) {
  Pair pair = random.below(2) == 0 ? needle(random) : anywhere(random);
  const Triangle& t = pair.triangle;
  const Vec3d v = random.below(2) == 0 ? t.b - t.a : t.c - t.b;
  const Vec3d p = t.b - random.unit() * v, way = random.between(-2, 2) * v;
  const Vec3d beside = p + ofSize(random, -17, 0, direction);
  pair.segment = along(random, beside, way + ofSize(random, -18, -1, direction));
  return pair;
}
Pair ofUnlikeSizes(Random& random) {
  Pair pair = near(random);
  Segment& s = pair.segment;
  Triangle& t = pair.triangle;
  if (random.below(2) == 0) {
    s = along(random, s.a, ofSize(random, -13, 13, direction));
  } else {
    const double size = powerOfTen(random, -13, 13);
    t = {t.a, t.a + size * inCube(random), t.a + size * inCube(random)};
  }
  return pair;
}
Pair farFromTheOrigin(Random& random) {
  Pair pair = random.below(2) == 0 ? near(random) : needle(random);
  const Vec3d offset = ofSize(random, 1, 15, direction);
  for (Vec3d* p : pair.points()) *p = *p + offset;
  return pair;
}

constexpr Pair (*kMakers[])(Random&) = {
    anywhere,      grid,          coplanar,          near,          needle,          withoutArea,
    withoutLength, nearlyInPlane, nearlyAlongAnEdge, ofUnlikeSizes, farFromTheOrigin};

std::array<double, 3> numbers(const Vec3d& v) { return {v.x, v.y, v.z}; }

GivenInstant given(const Pair& pair) {
  const auto& [s, t] = pair;
  return {{numbers(s.a), numbers(s.b)}, {numbers(t.a), numbers(t.b), numbers(t.c)}};
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

int verdictOf(const geometry::PairBlock::Verdict& verdict) {
  return static_cast<int>(verdict.touching & 1u) - static_cast<int>(verdict.apart & 1u);
}

/// What a test of many pairs decides of one: 1 for touching, -1 for apart, 0 for neither. All
/// instruction sets have to agree, or it is 2.
int inFloat(const Pair& pair, std::size_t corners, double reach, double unit) {
  const auto& [s, t] = pair;
  // All shares are exact.
  const auto endsOf = [](const Vec3d& a, const Vec3d& b, double radius) {
    return std::array<geometry::CapsuleEnd, 2>{{{{a.x, a.y, a.z, radius}}, {{b.x, b.y, b.z, 0}}}};
  };
  const auto ends = endsOf(s.a, s.b, corners == 2 ? reach / 4 : reach);
  const auto others = endsOf(t.a, t.b, reach / 2);
  geometry::MeshPoint points[3];
  for (int i = 0; i < 3; ++i) {
    const Vec3d& p = *std::array{&t.a, &t.b, &t.c}[static_cast<std::size_t>(i)];
    points[i] = {{p.x, p.y, p.z, 0}};
  }
  int decided = 2;
  bool is_first = true;
  for (const std::int64_t target : simd::availableTargets()) {
    const simd::ScopedTarget scoped(target);
    int verdict = 0;
    if (corners == 2) {
      geometry::CapsulePairs pairs(unit);
      pairs.add(ends.data(), others.data(), /*margin=*/reach / 4, /*error=*/0);
      verdict = verdictOf(pairs.decide());
    } else {
      geometry::TrianglePairs pairs(geometry::AffineMap(), unit);
      pairs.add(ends.data(), {&points[0], &points[1], &points[2]}, /*margin=*/0, /*error=*/0);
      verdict = verdictOf(pairs.decide());
    }
    if (!is_first && verdict != decided) return 2;
    decided = verdict;
    is_first = false;
  }
  return decided;
}

void decide(Random& random, std::size_t corners, TouchTally& tally) {
  Pair pair = kMakers[tally.decisions % std::size(kMakers)](random);
  if (corners == 2) pair.triangle.c = pair.triangle.b;
  GivenMotion rests{given(pair), given(pair), corners};
  const double distance = ImpactOracle::excessAt(rests, 0);
  double size = rests.size();
  double reach = std::max(0.0, someReach(random, distance, size));
  tally.at_contact += std::fabs(distance - reach) <= 1e-12 * size;
  if (random.below(4) == 0) {
    const double scale = std::ldexp(1.0, static_cast<int>(random.below(1961)) - 1000);
    for (Vec3d* p : pair.points()) *p = scale * *p;
    reach *= scale;
    size *= scale;
  }
  const auto& [s, t] = pair;
  const bool answer = corners == 2 ? axesWithin(s, {t.a, t.b, 0}, reach) : axisWithin(s, t, reach);
  const auto judge = [&](double slack) {
    const double least = std::numeric_limits<double>::denorm_min();
    return ImpactOracle::within(given(pair), corners,
                                answer ? reach + slack * size + least : reach);
  };
  const double unit = tally.decisions % 4 == 0 ? 1 : geometry::PairBlock::unitFor(size);
  const int in_float = inFloat(pair, corners, reach, unit);
  if (in_float != 0) {
    ++tally.in_float;
    // There is no tolerance: what float cannot decide has to be left open.
    const bool is_within = ImpactOracle::within(given(pair), corners, reach).certain;
    tally.wrong_in_float += in_float != (is_within ? 1 : -1);
  }
  const auto [within, exact] = judge(corners == 2 ? kExcessOfCapsules : kUsualExcess);
  ++tally.decisions;
  tally.within += answer;
  tally.exact += exact;
  if (within == answer) return;
  tally.beyond_usual += answer;
  if (answer && corners == 3 && judge(kMostExcess).certain) return;
  ++(answer ? tally.unpromised : tally.missed);
  if (!tally.first_wrong.empty()) return;
  std::ostringstream out;
  out << std::hexfloat << (answer ? "not within " : "missed within ") << reach << ':';
  for (const Vec3d* p : pair.points()) out << " (" << p->x << ", " << p->y << ", " << p->z << ')';
  tally.first_wrong = out.str();
}

}  // namespace

TouchTally decideTouches(std::size_t corners, std::uint64_t decisions, std::uint64_t seed) {
  Random random(seed);
  TouchTally tally;
  while (tally.decisions < decisions) decide(random, corners, tally);
  return tally;
}

}  // namespace fcl_fibers::test
