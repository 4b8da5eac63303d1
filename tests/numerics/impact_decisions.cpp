// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/impact_decisions.h"

#include <array>
#include <cmath>
#include <limits>
#include <sstream>

#include "geometry/impact.h"
#include "numerics/impact_kinds.h"
#include "support/exact_numbers.h"
#include "support/impact_oracle.h"
#include "support/random.h"

namespace fcl_fibers::test {
namespace {

using geometry::MovingSegment;
using geometry::MovingTriangle;
using geometry::Segment;
using geometry::Vec3d;
using Vec = Vector<double>;

/// What the library says.
struct Answer {
  bool found;
  double time, s;
  Vec weight;
  double tolerance;
};

Vec3d toVec3d(const Vec& p) { return {p[0], p[1], p[2]}; }
Segment axisOf(const GivenInstant& i) {
  return {toVec3d(i.axis[0]), toVec3d(i.axis[1]), i.radii[0]};
}

/// As findImpact(), or by a search of many pairs.
bool findImpact(const geometry::ImpactQuery<Segment>& query, bool among_many,
                geometry::Impact& impact) {
  if (among_many) return geometry::findImpacts(&query, 1, &impact) != 0;
  const auto& [p, q, margin, error, from] = query;
  return geometry::findImpact(p, q, margin, error, from, impact);
}

Answer ask(const GivenMotion& motion, bool approach, bool among_many, double from) {
  const GivenInstant &start = motion.start, &end = motion.end;
  const MovingSegment p{axisOf(start), axisOf(end)};
  if (motion.corners == 2) {
    const auto other = [](const GivenInstant& i) -> Segment {
      return {toVec3d(i.corner[0]), toVec3d(i.corner[1]), i.radii[1]};
    };
    const MovingSegment q{other(start), other(end)};
    geometry::Impact impact{};
    const bool found = approach ? geometry::findApproach(p, q, motion.margin, 0, from, impact)
                                : findImpact({p, q, motion.margin, 0, from}, among_many, impact);
    const Vec weight{1 - impact.t, impact.t, 0};
    return {found, impact.time, impact.s, weight, geometry::impactTolerance(p, q)};
  }
  const auto triangle = [](const GivenInstant& i) -> geometry::Triangle {
    return {toVec3d(i.corner[0]), toVec3d(i.corner[1]), toVec3d(i.corner[2])};
  };
  const MovingTriangle q{triangle(start), triangle(end)};
  geometry::TriangleImpact impact{};
  const bool found = approach ? geometry::findApproach(p, q, motion.margin, 0, from, impact)
                              : geometry::findImpact(p, q, motion.margin, 0, from, impact);
  const auto& [a, b, c] = impact.weight;
  return {found, impact.time, impact.s, {a, b, c}, geometry::impactTolerance(p, q)};
}

GivenMotion scaled(GivenMotion motion, double scale) {
  changePoints(motion, [scale](double& x) { x *= scale; });
  changeRadii(motion, [scale](double& x) { x *= scale; });
  motion.margin *= scale;
  return motion;
}

/// By how much the points that are reported are farther apart than the two.
double misplacement(const GivenMotion& motion, const Answer& answer) {
  const GivenInstant &i = motion.start, &j = motion.end;
  const auto at = [&](const Vec& p, const Vec& q) {
    return (p - i.corner[0]) + answer.time * ((q - j.corner[0]) - (p - i.corner[0]));
  };
  const Vec a = at(i.axis[0], j.axis[0]), b = at(i.axis[1], j.axis[1]);
  Vec apart = a + answer.s * (b - a);
  for (std::size_t k = 0; k < motion.corners; ++k) {
    apart = apart - answer.weight[k] * at(i.corner[k], j.corner[k]);
  }
  GivenMotion axes = motion;
  changeRadii(axes, [](double& x) { x = 0; });
  axes.margin = 0;
  return std::sqrt(dot(apart, apart)) - ImpactOracle::excessAt(axes, answer.time);
}

std::string describe(const GivenMotion& motion, const Answer& answer, const char* what) {
  std::ostringstream out;
  out << what << ' ' << std::hexfloat << answer.time << ", tolerance " << answer.tolerance
      << ", margin " << motion.margin;
  for (const GivenInstant* i : {&motion.start, &motion.end}) {
    out << "; radii " << i->radii[0] << ' ' << i->radii[1];
    const auto tell = [&](const Vec& p) {
      out << " (" << p[0] << ", " << p[1] << ", " << p[2] << ')';
    };
    std::for_each(i->axis.begin(), i->axis.end(), tell);
    std::for_each(i->corner.begin(), i->corner.begin() + static_cast<long>(motion.corners), tell);
  }
  return out.str();
}

void decide(Random& random, const ImpactKind& kind, std::size_t corners, bool exact,
            ImpactTally& tally) {
  GivenMotion motion = someMotion(random, kind, corners);
  const double scale =
      random.below(2) == 0 ? 1 : std::ldexp(1.0, static_cast<int>(random.below(1801)) - 900);
  const GivenMotion asked = scaled(motion, scale);
  const double size = motion.size(), tolerance = ask(motion, false, false, 0).tolerance;
  const double excess = ImpactOracle::excessAt(motion, 0);
  const bool approach = random.below(4) == 0;
  // Whether a pair touches at the start is a matter of rounding here.
  const double rounding = 0x1p-44 * size;
  if (approach && std::fabs(excess - tolerance / 2) < rounding) return;
  const bool among_many = tally.decisions % 2 == 0;
  Answer answer = ask(asked, approach, among_many, 0);
  if (random.below(8) == 0 && answer.time > 0) {
    answer = ask(asked, approach, among_many, random.unit() * answer.time);
  }
  ++tally.decisions;
  tally.impacts += answer.found;
  tally.at_start += answer.found && answer.time == 0;
  const bool comes_nearer = approach && excess <= tolerance / 2;
  if (comes_nearer) {
    ++tally.approaches;
    motion.margin += excess - 2 * tolerance;
  }
  const auto tell = [&](std::uint64_t& count, const char* what) {
    if (++count; tally.first_wrong.empty()) {
      tally.first_wrong = std::string(kind.name) + ": " + describe(motion, answer, what);
    }
  };
  // Points that are one and stay so never come nearer, though no number tells that.
  if (comes_nearer && tolerance == 0) {
    if (answer.found) tell(tally.early, "too early");
    return;
  }
  const double until = answer.found ? answer.time : 1;
  bool used_integers = false;
  if (!answer.found || answer.time > 0) {
    GivenMotion nearer = motion;
    if (approach) nearer.margin -= rounding;
    const auto [apart, in_integers] = ImpactOracle::apartDuring(nearer, 0, until, exact);
    used_integers |= in_integers;
    if (!apart) tell(tally.late, answer.found ? "too late" : "missed");
  }
  if (answer.found) {
    GivenMotion farther = motion;
    farther.margin += tolerance;
    const auto [within, in_integers] = ImpactOracle::withinAt(farther, answer.time, exact);
    used_integers |= in_integers;
    if (!within || !(answer.time >= 0 && answer.time <= 1)) {
      tell(tally.early, "too early");
      // In tolerances, to the next power of two.
      double excess = 1;
      do {
        excess *= 2;
        farther.margin = motion.margin + excess * tolerance;
      } while (excess < 0x1p50 && !ImpactOracle::withinAt(farther, answer.time, exact).certain);
      tally.earliest = std::max(tally.earliest, excess);
    }
    if (!(misplacement(motion, answer) <= tolerance)) tell(tally.misplaced, "misplaced");
  }
  tally.exact += used_integers;
}

}  // namespace

std::vector<std::string> impactKinds() {
  std::vector<std::string> names;
  for (const ImpactKind& kind : allImpactKinds()) names.emplace_back(kind.name);
  return names;
}

std::string impactsTable() {
  std::string table = "row,with,impacts,at_the_start,pairs_that_are\n";
  constexpr std::uint64_t kPairs = 1000;
  const auto percent = [](std::uint64_t count) {
    return std::to_string((100 * count + kPairs / 2) / kPairs);
  };
  const std::vector<ImpactKind>& kinds = allImpactKinds();
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    for (const ImpactShape shape : {ImpactShape::kCapsules, ImpactShape::kTriangle}) {
      const ImpactTally tally = decideImpacts(shape, static_cast<int>(k), kPairs, 1);
      table += std::string(kinds[k].name) +
               (shape == ImpactShape::kCapsules ? ",capsules," : ",triangles,") +
               percent(tally.impacts) + ',' + percent(tally.at_start) + ",\"" + kinds[k].what +
               "\"\n";
    }
  }
  return table;
}

ImpactTally decideImpacts(ImpactShape shape, int kind, std::uint64_t decisions, std::uint64_t seed,
                          bool exact) {
  const std::vector<ImpactKind>& kinds = allImpactKinds();
  Random random(seed);
  ImpactTally tally;
  for (std::size_t i = 0; tally.decisions < decisions; ++i) {
    const std::size_t k = kind < 0 ? i % kinds.size() : static_cast<std::size_t>(kind);
    decide(random, kinds[k], shape == ImpactShape::kTriangle ? 3 : 2, exact, tally);
  }
  return tally;
}

}  // namespace fcl_fibers::test
