// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/impact_kinds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "support/exact_numbers.h"

namespace fcl_fibers::test {

/// Two shapes at the time of their meeting, and how they move then. A point of the axis is `gap`
/// from a point of the hull, which is the origin.
struct Meeting {
  using Vec = Vector<double>;

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

namespace {

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
// Compilers differ in the order of the operands of an expression. So each draw is a statement.

double signedPowerOfTen(Random& random, double low, double high) {
  const double sign = random.below(2) == 0 ? 1 : -1;
  return sign * powerOfTen(random, low, high);
}
/// @param shape  inCube or direction
Vec ofSize(Random& random, double low, double high, Vec (*shape)(Random&)) {
  const double size = powerOfTen(random, low, high);
  return size * shape(random);
}
/// Along u, except for a little.
Vec nearlyAlong(Random& random, const Vec& u, double least, double most) {
  const Vec along = random.between(-2, 2) * u;
  return along + ofSize(random, least, most, inCube);
}
/// In [0, 1], an end as often as not.
double part(Random& random) {
  return random.below(2) == 0 ? random.unit() : static_cast<double>(random.below(2));
}
Vec across(const Vec& p, const Vec& v) {
  return dot(v, v) > 0 ? p - (dot(p, v) / dot(v, v)) * v : p;
}

Meeting anyMeeting(Random& random, std::size_t corners) {
  Meeting m;
  m.time = random.below(8) == 0 ? part(random) : random.unit();
  m.s = part(random);
  const double x = part(random), y = corners == 3 ? part(random) * (1 - x) : 0;
  m.weight = {1 - x - y, x, y};
  m.gap = ofSize(random, -4, 0, direction);
  m.velocity = ofSize(random, -2, 1, inCube);
  const auto length = [&] { return ofSize(random, -2, 0.5, inCube); };
  const bool turns = random.below(4) != 0;
  const auto turn = [&](const Vec& v) {
    return turns ? std::sqrt(dot(v, v)) * ofSize(random, -2, 0.5, inCube) : Vec{};
  };
  m.u = length();
  m.turn = turn(m.u);
  for (int k = 0; k < 2; ++k) {
    m.edge[k] = length();
    m.edge_turn[k] = turn(m.edge[k]);
  }
  m.common = ofSize(random, -2, 1, inCube);
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
  m.velocity = across(m.velocity, m.gap) + signedPowerOfTen(random, -17, -1) * m.gap;
}
/// As graze(), and what turns does not come nearer where the two are closest.
void grazeFlatly(Random& random, Meeting& m) {
  graze(random, m);
  if (random.below(2) == 0) m.turn = across(m.turn, m.gap);
  for (Vec& turn : m.edge_turn) turn = across(turn, m.gap);
}
void slide(Random& random, Meeting& m) {
  m.u = across(m.u, m.gap);
  m.edge[0] = nearlyAlong(random, m.u, -18, -3);
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
  const Vec axis = ofSize(random, -2, 0.5, direction);
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
  m.offset = ofSize(random, 1, 12, direction);
}
void moveFar(Random& random, Meeting& m) {
  m.gap = powerOfTen(random, -3, -1) * m.gap;
  m.velocity = powerOfTen(random, 0, 4) * m.velocity;
}
/// Nearly parallel for a moment.
void twist(Random& random, Meeting& m) {
  m.u = across(m.u, m.gap);
  m.edge[0] = nearlyAlong(random, m.u, -18, -1);
  m.turn = random.between(-1, 1) * cross(m.gap, m.u);
  if (random.below(2) == 0) m.velocity = across(m.velocity, m.gap);
}

/// Triangles are needles, and axes a bit tilted against them.
void beNearAndThin(Random& random, Meeting& m) {
  if (random.below(2) == 0) m.gap = powerOfTen(random, -17, 0) * m.gap;
  if (random.below(4) == 0) m.edge[1] = nearlyAlong(random, m.edge[0], -18, -1);
  if (random.below(8) == 0) m.u = nearlyAlong(random, m.edge[random.below(2)], -18, -1);
  if (random.below(8) == 0) m.u = m.u + ofSize(random, -18, -1, inCube);
}

/// Near the distance, or none.
double someReach(Random& random, double distance, double size) {
  switch (random.below(6)) {
    case 0:
      return distance;
    case 1:
      return distance * (1 + signedPowerOfTen(random, -16, 0));
    case 2:
      return distance + signedPowerOfTen(random, -17, -3) * size;
    case 3:
      return 0;
    default:
      return distance * random.between(0, 2);
  }
}

}  // namespace

const std::vector<ImpactKind>& allImpactKinds() {
  static const std::vector<ImpactKind> kinds = {
      {"Somehow", "of any direction and motion", somehow},
      {"Grazing", "all across the line between the closest points", graze},
      {"GrazingFlatly", "the motion as well", grazeFlatly},
      {"Sliding", "along each other, parallel up to 1e-18, in contact all the time or nearly",
       slide},
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
  return kinds;
}

GivenMotion someMotion(Random& random, const ImpactKind& kind, std::size_t corners, bool rests) {
  const std::string name = kind.name;
  Meeting meeting = anyMeeting(random, corners);
  kind.change(random, meeting);
  if (rests) beNearAndThin(random, meeting);
  GivenMotion motion{meeting.at(rests ? meeting.time : 0), meeting.at(1), corners};
  if (name == "OnAGrid") {
    const double largest = random.below(2) == 0 ? 2 : 8;
    changePoints(motion, [&](double& x) { x = std::round(largest * random.between(-1, 1)); });
    if (random.below(2) == 0) motion.end = motion.start;
  }
  if (rests) motion.end = motion.start;
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
    const double radii = rests ? reach : reach * radiusAt(i == &motion.start ? 0 : 1);
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

}  // namespace fcl_fibers::test
