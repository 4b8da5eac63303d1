// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/impact_decisions.h"

#include <array>
#include <cmath>
#include <limits>
#include <sstream>

#include "geometry/impact.h"
#include "geometry/triangle_impact.h"
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

double powerOfTen(Random& random, double low, double high) {
  return std::pow(10, random.between(low, high));
}
Vec inCube(Random& random) {
  const Eigen::Vector3d p = random.inCube(1);
  return {p.x(), p.y(), p.z()};
}
Vec direction(Random& random) {
  const Eigen::Vector3d p = random.direction();
  return {p.x(), p.y(), p.z()};
}
double sign(Random& random) { return random.below(2) == 0 ? 1 : -1; }
/// In [0, 1], an end as often as not.
double part(Random& random) {
  return random.below(2) == 0 ? random.unit() : static_cast<double>(random.below(2));
}
Vec across(const Vec& p, const Vec& v) {
  return dot(v, v) > 0 ? p - (dot(p, v) / dot(v, v)) * v : p;
}

/// Two shapes at the time of their meeting, and how they move then. A point of the axis is `gap`
/// from a point of the hull, which is the origin.
struct Meeting {
  double time;
  double s;
  Vec weight;  ///< of the corners
  Vec gap, velocity;
  Vec u, turn;                ///< of the axis
  Vec edge[2], edge_turn[2];  ///< from the first corner to the others
  Vec common{}, offset{};     ///< of both

  GivenInstant at(double t) const {
    const double dt = t - time;
    const Vec along = u + dt * turn;
    const Vec v[2] = {edge[0] + dt * edge_turn[0], edge[1] + dt * edge_turn[1]};
    const Vec place = offset + dt * common;
    const Vec a = place + gap + dt * velocity - s * along;
    const Vec c = place - weight[1] * v[0] - weight[2] * v[1];
    return {{a, a + along}, {c, c + v[0], c + v[1]}};
  }
};

Meeting anyMeeting(Random& random, std::size_t corners) {
  Meeting m;
  m.time = random.below(8) == 0 ? part(random) : random.unit();
  m.s = part(random);
  const double x = part(random), y = corners == 3 ? part(random) * (1 - x) : 0;
  m.weight = {1 - x - y, x, y};
  m.gap = powerOfTen(random, -4, 0) * direction(random);
  m.velocity = powerOfTen(random, -2, 1) * inCube(random);
  const auto length = [&] { return powerOfTen(random, -2, 0.5) * inCube(random); };
  const bool turns = random.below(4) != 0;
  const auto turn = [&](const Vec& v) {
    return (turns ? powerOfTen(random, -2, 0.5) * std::sqrt(dot(v, v)) : 0) * inCube(random);
  };
  m.u = length();
  m.turn = turn(m.u);
  for (int k = 0; k < 2; ++k) {
    m.edge[k] = length();
    m.edge_turn[k] = turn(m.edge[k]);
  }
  m.common = powerOfTen(random, -2, 1) * inCube(random);
  return m;
}

// Each kind changes a meeting.

void somehow(Random&, Meeting&) {}
/// All across the gap, so that it is the distance.
void layAcross(Meeting& m) {
  m.u = across(m.u, m.gap);
  for (Vec& edge : m.edge) edge = across(edge, m.gap);
}
void graze(Random& random, Meeting& m) {
  layAcross(m);
  m.velocity = across(m.velocity, m.gap) + (sign(random) * powerOfTen(random, -17, -1)) * m.gap;
}
/// As graze(), and what turns does not come nearer where the two are closest.
void grazeFlatly(Random& random, Meeting& m) {
  graze(random, m);
  if (random.below(2) == 0) m.turn = across(m.turn, m.gap);
  for (Vec& turn : m.edge_turn) turn = across(turn, m.gap);
}
void slide(Random& random, Meeting& m) {
  m.u = across(m.u, m.gap);
  m.edge[0] = random.between(-2, 2) * m.u + powerOfTen(random, -18, -3) * inCube(random);
  m.edge[1] = across(m.edge[1], m.gap);
  m.turn = m.edge_turn[0] = m.edge_turn[1] = Vec{};
  m.velocity = across(m.velocity, m.gap);
  if (random.below(2) == 0) m.velocity = m.velocity + powerOfTen(random, -18, -3) * m.gap;
}
void stay(Random& random, Meeting& m) {
  if (random.below(2) == 0) layAcross(m);
  m.turn = m.edge_turn[0] = m.edge_turn[1] = m.velocity = Vec{};
}
/// As a rigid body does, at the time of the meeting.
void spin(Random& random, Meeting& m) {
  if (random.below(2) == 0) layAcross(m);
  const Vec axis = powerOfTen(random, -2, 0.5) * direction(random);
  m.velocity = cross(axis, m.gap);
  m.turn = cross(axis, m.u);
  for (int k = 0; k < 2; ++k) m.edge_turn[k] = cross(axis, m.edge[k]);
}
void loseLength(Random& random, Meeting& m) {
  if (random.below(2) == 0) graze(random, m);
  const auto lose = [&](Vec& u, Vec& turn) {
    const double when = part(random);
    if (random.below(2) == 0) turn = u = Vec{};
    // No length at `when`.
    if (when != m.time) turn = (1 / (m.time - when)) * u;
  };
  if (random.below(4) != 0) lose(m.u, m.turn);
  if (random.below(2) == 0) lose(m.edge[0], m.edge_turn[0]);
  if (random.below(2) == 0) lose(m.edge[1], m.edge_turn[1]);
  if (random.below(4) == 0) m.edge[1] = random.between(-1, 2) * m.edge[0];
}
void passThrough(Random&, Meeting& m) { m.gap = Vec{}; }
void stayInPlane(Random& random, Meeting& m) {
  if (random.below(2) == 0) m.gap = Vec{};
  for (Vec* p :
       {&m.velocity, &m.u, &m.turn, &m.edge[0], &m.edge[1], &m.edge_turn[0], &m.edge_turn[1]}) {
    (*p)[2] = 0;
  }
}
void beOfUnlikeSizes(Random& random, Meeting& m) {
  if (random.below(2) == 0) layAcross(m);
  const double scale = powerOfTen(random, -10, 6);
  m.u = scale * m.u;
  m.turn = scale * m.turn;
}
void beFarAway(Random& random, Meeting& m) {
  if (random.below(2) == 0) graze(random, m);
  m.offset = powerOfTen(random, 1, 12) * direction(random);
}
void moveFar(Random& random, Meeting& m) {
  m.gap = powerOfTen(random, -3, -1) * m.gap;
  m.velocity = powerOfTen(random, 0, 4) * m.velocity;
}
/// Nearly parallel for a moment.
void twist(Random& random, Meeting& m) {
  m.u = across(m.u, m.gap);
  m.edge[0] = random.between(-2, 2) * m.u + powerOfTen(random, -18, -1) * inCube(random);
  m.turn = random.between(-1, 1) * cross(m.gap, m.u);
  if (random.below(2) == 0) m.velocity = across(m.velocity, m.gap);
}

struct Kind {
  const char* name;
  const char* what;
  void (*change)(Random&, Meeting&);
};
constexpr Kind kKinds[] = {
    {"Somehow", "of any direction and motion", somehow},
    {"Grazing", "all across the line between the closest points", graze},
    {"GrazingFlatly", "the motion as well", grazeFlatly},
    {"Sliding", "along each other, parallel up to 1e-18, in contact all the time or nearly", slide},
    {"Staying", "at rest against each other", stay},
    {"Spinning", "as a rigid body spins", spin},
    {"WithoutLength", "points, or of no length at one time", loseLength},
    {"PassingThrough", "axes that meet, often without thickness", passThrough},
    {"InAPlane", "all in one plane, or in two that are parallel", stayInPlane},
    {"OfUnlikeSizes", "one up to 1e10 times as long as the other", beOfUnlikeSizes},
    {"FarFromTheOrigin", "up to 1e12 from the origin", beFarAway},
    {"MovingFar", "up to 1e5 times as far as they are thick", moveFar},
    {"Twisting", "parallel for a moment", twist},
    // Their numbers are changed afterwards.
    {"Growing", "with radii that grow", somehow},
    {"OnAGrid", "whole coordinates; half of them at rest", somehow},
    {"InFloat", "numbers that are floats", somehow},
};

template <class Change>
void changePoints(GivenMotion& motion, Change&& change) {
  for (GivenInstant* i : {&motion.start, &motion.end}) {
    for (auto& p : i->axis) std::for_each(p.begin(), p.end(), change);
    for (auto& p : i->corner) std::for_each(p.begin(), p.end(), change);
  }
}
template <class Change>
void changeRadii(GivenMotion& motion, Change&& change) {
  for (GivenInstant* i : {&motion.start, &motion.end}) {
    std::for_each(i->radii.begin(), i->radii.end(), change);
  }
}

/// Near the distance, or none.
double someReach(Random& random, double distance, double size) {
  switch (random.below(6)) {
    case 0:
      return distance;
    case 1:
      return distance * (1 + sign(random) * powerOfTen(random, -16, 0));
    case 2:
      return distance + sign(random) * powerOfTen(random, -17, -3) * size;
    case 3:
      return 0;
    default:
      return distance * random.between(0, 2);
  }
}

GivenMotion someMotion(Random& random, const Kind& kind, std::size_t corners) {
  const std::string name = kind.name;
  Meeting meeting = anyMeeting(random, corners);
  kind.change(random, meeting);
  GivenMotion motion{meeting.at(0), meeting.at(1), corners};
  if (name == "OnAGrid") {
    const double largest = random.below(2) == 0 ? 2 : 8;
    changePoints(motion, [&](double& x) { x = std::round(largest * random.between(-1, 1)); });
    if (random.below(2) == 0) motion.end = motion.start;
  }
  if (name == "InFloat") changePoints(motion, [](double& x) { x = static_cast<float>(x); });
  const double distance = ImpactOracle::excessAt(motion, meeting.time);
  double reach = std::max(0.0, someReach(random, distance, motion.size()));
  if (random.below(4) == 0) {
    motion.margin = part(random) * reach;
    reach -= motion.margin;
  }
  const double share = corners == 2 ? random.unit() : 1;
  const double growth = name == "Growing" ? 2 : random.below(4) == 0 ? random.between(-1, 1) : 0;
  const auto radiusAt = [&](double t) { return std::max(0.0, 1 + (t - meeting.time) * growth); };
  for (GivenInstant* i : {&motion.start, &motion.end}) {
    const double radii = reach * radiusAt(i == &motion.start ? 0 : 1);
    i->radii = {share * radii, (1 - share) * radii};
  }
  const auto round = [](double& x) { x = std::round(2 * x) / 2; };
  if (name == "OnAGrid") {
    changeRadii(motion, round);
    round(motion.margin);
  }
  if (name == "InFloat") changeRadii(motion, [](double& x) { x = static_cast<float>(x); });
  return motion;
}

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
bool findImpact(const geometry::ImpactQuery& query, bool among_many, geometry::Impact& impact) {
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

void decide(Random& random, const Kind& kind, std::size_t corners, bool exact, ImpactTally& tally) {
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
  if (approach && excess <= tolerance / 2) {
    ++tally.approaches;
    motion.margin += excess - 2 * tolerance;
  }
  const auto tell = [&](std::uint64_t& count, const char* what) {
    if (++count; tally.first_wrong.empty()) {
      tally.first_wrong = std::string(kind.name) + ": " + describe(motion, answer, what);
    }
  };
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
  for (const Kind& kind : kKinds) names.emplace_back(kind.name);
  return names;
}

std::string impactsTable() {
  std::string table =
      "| row | pairs that are | impacts % | at the start % |\n"
      "|---|---|--:|--:|\n";
  constexpr std::uint64_t kPairs = 1000;
  const auto percent = [](std::uint64_t count) {
    return std::to_string((100 * count + kPairs / 2) / kPairs);
  };
  for (std::size_t k = 0; k < std::size(kKinds); ++k) {
    table += std::string("| ") + kKinds[k].name + " | " + kKinds[k].what;
    const auto kind = static_cast<int>(k);
    const ImpactTally capsules = decideImpacts(ImpactShape::kCapsules, kind, kPairs, 1);
    const ImpactTally triangles = decideImpacts(ImpactShape::kTriangle, kind, kPairs, 1);
    table += " | " + percent(capsules.impacts) + " / " + percent(triangles.impacts) + " | " +
             percent(capsules.at_start) + " / " + percent(triangles.at_start) + " |\n";
  }
  return table;
}

ImpactTally decideImpacts(ImpactShape shape, int kind, std::uint64_t decisions, std::uint64_t seed,
                          bool exact) {
  Random random(seed);
  ImpactTally tally;
  for (std::size_t i = 0; tally.decisions < decisions; ++i) {
    const std::size_t k = kind < 0 ? i % std::size(kKinds) : static_cast<std::size_t>(kind);
    decide(random, kKinds[k], shape == ImpactShape::kTriangle ? 3 : 2, exact, tally);
  }
  return tally;
}

}  // namespace fcl_fibers::test
