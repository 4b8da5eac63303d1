// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/touch_decisions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>
#include <vector>

#include "geometry/capsule_test.h"
#include "geometry/segment_distance.h"
#include "geometry/touch.h"
#include "geometry/triangle_distance.h"
#include "geometry/triangle_test.h"
#include "numerics/impact_kinds.h"
#include "support/exact_geometry.h"
#include "support/float_environment.h"
#include "support/impact_oracle.h"
#include "support/random.h"
#include "support/scoped_target.h"
#include "support/touch_oracle.h"

namespace fcl_fibers::test {
namespace {

using geometry::Segment;
using geometry::Triangle;
using geometry::Vec3d;

int verdictOf(const geometry::PairBlock::Verdict& verdict) {
  return static_cast<int>(verdict.touching & 1u) - static_cast<int>(verdict.apart & 1u);
}

/// What a test of many pairs decides of one: 1 for touching, -1 for apart, 0 for neither. All
/// instruction sets have to agree, or it is 2.
template <class Decide>
int inAllTargets(const Decide& decide) {
  int decided = 2;
  bool is_first = true;
  for (const std::int64_t target : simd::availableTargets()) {
    const simd::ScopedTarget scoped(target);
    const int verdict = verdictOf(decide());
    if (!is_first && verdict != decided) return 2;
    decided = verdict;
    is_first = false;
  }
  return decided;
}

int inFloat(const Segment& s, const Triangle& t, std::size_t corners, double reach, double unit) {
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
  return inAllTargets([&] {
    if (corners == 2) {
      geometry::CapsulePairs pairs(unit);
      pairs.add(ends.data(), others.data(), /*margin=*/reach / 4, /*error=*/0);
      return pairs.decide();
    }
    geometry::TrianglePairs pairs(geometry::AffineMap(), unit);
    pairs.add(ends.data(), {&points[0], &points[1], &points[2]}, /*margin=*/0, /*error=*/0);
    return pairs.decide();
  });
}

void decide(Random& random, std::size_t corners, int rounding, TouchTally& tally) {
  const std::vector<ImpactKind>& kinds = allImpactKinds();
  GivenMotion rests =
      someMotion(random, kinds[tally.decisions % kinds.size()], corners, /*rests=*/true);
  double reach = rests.start.radii[0] + rests.start.radii[1] + rests.margin;
  changeRadii(rests, [](double& x) { x = 0; });
  rests.margin = 0;
  double size = rests.size();
  tally.at_contact += std::fabs(ImpactOracle::excessAt(rests, 0) - reach) <= 1e-12 * size;
  if (random.below(4) == 0) {
    const double scale = std::ldexp(1.0, static_cast<int>(random.below(1961)) - 1000);
    changePoints(rests, [scale](double& x) { x *= scale; });
    reach *= scale;
    size *= scale;
  }
  const GivenInstant& pair = rests.start;
  const auto at = [](const std::array<double, 3>& p) -> Vec3d { return {p[0], p[1], p[2]}; };
  const Segment s{at(pair.axis[0]), at(pair.axis[1]), 0};
  const Triangle t{at(pair.corner[0]), at(pair.corner[1]), at(pair.corner[2])};
  const double unit = tally.decisions % 4 == 0 ? 1 : geometry::PairBlock::unitFor(size);
  bool answer;
  int in_float;
  {
    const ScopedFloatEnvironment scoped({rounding, false});
    answer = corners == 2 ? axesWithin(s, {t.a, t.b, 0}, reach) : axisWithin(s, t, reach);
    in_float = inFloat(s, t, corners, reach, unit);
  }
  const auto judge = [&](double slack) {
    const double least = std::numeric_limits<double>::denorm_min();
    return ImpactOracle::within(pair, corners, answer ? reach + slack * size + least : reach);
  };
  if (in_float != 0) {
    ++tally.in_float;
    // There is no tolerance: what float cannot decide has to be left open.
    const bool is_within = ImpactOracle::within(pair, corners, reach).certain;
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
  for (const Vec3d& p : {s.a, s.b, t.a, t.b, t.c}) {
    out << " (" << p.x << ", " << p.y << ", " << p.z << ')';
  }
  tally.first_wrong = out.str();
}

// --- Cones ---

/// Of each cone a ball at most is as thick as the capsule.
GivenCapsule someCone(Random& random, const std::array<double, 3>& a,
                      const std::array<double, 3>& b, double radius) {
  const auto part = [&] {
    const double parts[] = {0, 1, random.unit()};
    return radius * parts[random.below(3)];
  };
  GivenCapsule cone{a, b, part()};
  cone.radius_of_second = part();
  return cone;
}

int inFloat(const GivenCapsule& p, const GivenCapsule& q, double margin, double unit) {
  const auto endsOf = [](const GivenCapsule& c) {
    return std::array<geometry::CapsuleEnd, 2>{
        {{{c.a[0], c.a[1], c.a[2], c.radius}}, {{c.b[0], c.b[1], c.b[2], c.radiusAtB()}}}};
  };
  const auto ends = endsOf(p), others = endsOf(q);
  return inAllTargets([&] {
    geometry::CapsulePairs pairs(unit);
    pairs.setMayTaper(true, true);
    pairs.add(ends.data(), others.data(), margin, /*error=*/0);
    return pairs.decide();
  });
}

void decideCones(Random& random, int rounding, TouchTally& tally) {
  const std::vector<ImpactKind>& kinds = allImpactKinds();
  const GivenMotion rests =
      someMotion(random, kinds[tally.decisions % kinds.size()], 2, /*rests=*/true);
  const GivenInstant& pair = rests.start;
  GivenCapsule cones[] = {someCone(random, pair.axis[0], pair.axis[1], pair.radii[0]),
                          someCone(random, pair.corner[0], pair.corner[1], pair.radii[1])};
  auto& [p, q] = cones;
  double size = rests.size() + rests.margin + 2 * (pair.radii[0] + pair.radii[1]);
  // A margin makes it contact, or the radii of one of the two.
  const Real apart = surfaceDistance(roundedCapsule(p), roundedCapsule(q));
  const double off = std::ldexp(random.between(-1, 1), -static_cast<int>(random.below(60)));
  const double missing = std::max(static_cast<double>(apart) + off * size, 0.0);
  const bool has_margin = random.below(2) == 0;
  double margin = has_margin ? missing : 0;
  if (!has_margin) {
    p.radius += missing;
    p.radius_of_second += missing;
  }
  size += 2 * missing;
  tally.at_contact += std::fabs(off) <= 1e-12;
  if (random.below(4) == 0) {
    const double scale = std::ldexp(1.0, static_cast<int>(random.below(1961)) - 1000);
    for (GivenCapsule& c : cones) {
      for (auto* point : {&c.a, &c.b}) {
        for (double& x : *point) x *= scale;
      }
      c.radius *= scale;
      c.radius_of_second *= scale;
    }
    margin *= scale;
    size *= scale;
  }
  const auto segmentOf = [](const GivenCapsule& c) {
    return Segment::cone({c.a[0], c.a[1], c.a[2]}, {c.b[0], c.b[1], c.b[2]}, c.radius,
                         c.radiusAtB());
  };
  const double unit = tally.decisions % 4 == 0 ? 1 : geometry::PairBlock::unitFor(size);
  bool answer;
  int in_float;
  {
    const ScopedFloatEnvironment scoped({rounding, false});
    answer = touch(segmentOf(p), segmentOf(q), margin, 0);
    in_float = inFloat(p, q, margin, unit);
  }
  const TouchOracle::Verdict truth = TouchOracle::judge(p, q, margin);
  ++tally.decisions;
  tally.within += answer;
  tally.exact += truth.exact;
  if (in_float != 0) {
    ++tally.in_float;
    tally.wrong_in_float += in_float != (truth.touching ? 1 : -1);
  }
  const double beyond =
      margin + kExcessOfCapsules * size + std::numeric_limits<double>::denorm_min();
  const bool is_missed = truth.touching && !answer;
  if (!is_missed && (truth.touching == answer || TouchOracle::judge(p, q, beyond).touching)) return;
  ++(is_missed ? tally.missed : tally.unpromised);
  if (!tally.first_wrong.empty()) return;
  std::ostringstream out;
  out << std::hexfloat << (answer ? "not within " : "missed within ") << margin << ':';
  for (const GivenCapsule& c : cones) {
    for (const auto& [x, radius] : {std::pair{c.a, c.radius}, {c.b, c.radiusAtB()}}) {
      out << " (" << x[0] << ", " << x[1] << ", " << x[2] << "; " << radius << ')';
    }
  }
  tally.first_wrong = out.str();
}

}  // namespace

TouchTally decideConeTouches(std::uint64_t decisions, std::uint64_t seed, int rounding) {
  Random random(seed);
  TouchTally tally;
  while (tally.decisions < decisions) decideCones(random, rounding, tally);
  return tally;
}

TouchTally decideTouches(std::size_t corners, std::uint64_t decisions, std::uint64_t seed,
                         int rounding) {
  Random random(seed);
  TouchTally tally;
  while (tally.decisions < decisions) decide(random, corners, rounding, tally);
  return tally;
}

}  // namespace fcl_fibers::test
