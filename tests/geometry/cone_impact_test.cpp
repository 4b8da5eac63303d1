// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include "geometry/impact.h"
#include "geometry/impact_pairs.h"
#include "support/cone_oracle.h"
#include "support/exact_geometry.h"
#include "support/random.h"
#include "support/scoped_target.h"
#include "support/segments.h"

namespace fcl_fibers::geometry {
namespace {

using test::Random;

template <class Hull>
struct Question {
  MovingSegment p;
  Moving<Hull> q;
  double margin = 0, error = 0;
};

// The truth: the distance at one time is the least over both arc parameters, or over one of the
// distance of a triangle and a point.

/// By its definition, without the larger radius.
Segment coneAt(const MovingSegment& s, double time) { return at(s, time); }

long double distanceAt(const Question<Segment>& question, double time) {
  return test::coneDistance(coneAt(question.p, time), coneAt(question.q, time));
}
long double distanceAt(const Question<Triangle>& question, double time) {
  const Segment p = coneAt(question.p, time);
  const Triangle q = at(question.q, time);
  const auto point = [](const Vec3d& x) { return test::Point(x.x, x.y, x.z); };
  const test::Point a = point(p.a), along = point(p.b) - a;
  const test::ExactTriangle triangle{point(q.a), point(q.b), point(q.c)};
  return test::leastOfConvex([&](long double s) {
    const test::Point x = a + s * along;
    return test::segmentTriangleDistance(x, x, triangle) - (1 - s) * p.radiusAtA() -
           s * p.radiusAtB();
  });
}
template <class Hull>
long double excessAt(const Question<Hull>& question, double time) {
  return distanceAt(question, time) - question.margin - question.error;
}

std::vector<Vec3d> cornersOf(const Segment& s) { return {s.a, s.b}; }
std::vector<Vec3d> cornersOf(const Triangle& t) { return {t.a, t.b, t.c}; }
double radiusGrowth(const Moving<Segment>& s) {
  return std::max(std::fabs(s.end.radiusAtA() - s.start.radiusAtA()),
                  std::fabs(s.end.radiusAtB() - s.start.radiusAtB()));
}
double radiusGrowth(const Moving<Triangle>&) { return 0; }

/// How fast the distance changes at most.
template <class Hull>
double fastest(const Question<Hull>& question) {
  double most = 0;
  const auto p0 = cornersOf(question.p.start), p1 = cornersOf(question.p.end);
  const auto q0 = cornersOf(question.q.start), q1 = cornersOf(question.q.end);
  for (std::size_t i = 0; i < p0.size(); ++i) {
    for (std::size_t k = 0; k < q0.size(); ++k) {
      most = std::max(most, norm((p1[i] - p0[i]) - (q1[k] - q0[k])));
    }
  }
  return most + radiusGrowth(question.p) + radiusGrowth(question.q);
}

/// The least excess over `level` that is met before a time, on a march whose steps pass no touch
/// but one shallower than some 2^-21 of the fastest change.
template <class Hull>
long double leastBefore(const Question<Hull>& question, double level, double until) {
  const double speed = fastest(question);
  long double least = 1e300L;
  for (double time = 0; time < until;) {
    const long double excess = excessAt(question, time) - level;
    least = std::min(least, excess);
    if (excess < 0) break;
    time += std::max(speed > 0 ? static_cast<double>(excess) / speed : 1.0, 0x1p-11);
  }
  return least;
}

std::string describe(const MovingSegment& s) {
  std::ostringstream out;
  out << std::hexfloat;
  for (const Segment* i : {&s.start, &s.end}) {
    out << " (" << i->a.x << ", " << i->a.y << ", " << i->a.z << ") (" << i->b.x << ", " << i->b.y
        << ", " << i->b.z << ") " << i->radiusAtA() << ' ' << i->radiusAtB() << ';';
  }
  return out.str();
}
std::string describe(const MovingTriangle& t) {
  std::ostringstream out;
  out << std::hexfloat << " triangle";
  for (const Triangle* i : {&t.start, &t.end}) {
    for (const Vec3d& x : cornersOf(*i)) out << " (" << x.x << ", " << x.y << ", " << x.z << ")";
    out << ';';
  }
  return out.str();
}

// --- Pairs ---

double length(Random& random) {
  return random.below(6) == 0 ? 0 : std::pow(10, random.between(-2, 0));
}

/// Radii of both ends for an axis: of any kind at which something may go wrong.
void setRadii(Random& random, Segment& s) {
  const double axis = norm(s.b - s.a), radius = 0.2 * std::pow(10, random.between(-2, 0));
  double radii[2] = {radius, radius};
  switch (random.below(5)) {
    case 0:
      radii[0] = 0;
      break;
    case 1:  // one ball holds the other, or nearly so
      radii[1] = radius + axis * (random.below(2) == 0 ? 1 + 1e-15 : random.between(0.9, 1.5));
      break;
    case 2:
      radii[1] *= random.between(0.9, 1.1);
      break;
    case 3:
      break;
    default:
      radii[1] *= random.unit();
  }
  if (random.below(2) == 0) std::swap(radii[0], radii[1]);
  s = Segment::cone(s.a, s.b, radii[0], radii[1]);
}

/// It turns, grows or only moves, past the origin.
MovingSegment randomCone(Random& random) {
  MovingSegment s;
  const Vec3d a = fromEigen(random.inCube(1)),
              along = length(random) * fromEigen(random.direction());
  const Vec3d way = -2.0 * a + fromEigen(random.inCube(0.3));
  s.start.a = a, s.start.b = a + along;
  s.end.a = a + way;
  s.end.b =
      s.end.a + (random.below(2) == 0 ? along : length(random) * fromEigen(random.direction()));
  setRadii(random, s.start);
  if (random.below(2) == 0) {
    s.end = Segment::cone(s.end.a, s.end.b, s.start.radiusAtA(), s.start.radiusAtB());
  } else {
    setRadii(random, s.end);
  }
  if (random.below(4) == 0) s.end = s.start;
  return s;
}
void setHull(Random& random, Question<Segment>& question) {
  question.q = randomCone(random);
  const Vec3d start = question.p.start.b - question.p.start.a;
  const Vec3d end = question.p.end.b - question.p.end.a;
  if (random.below(4) == 0) {  // parallel, or nearly so
    const double factor = random.between(-2, 2), turn = random.below(2) == 0 ? 0 : 1e-9;
    question.q.start.b = question.q.start.a + factor * start + fromEigen(random.inCube(turn));
    question.q.end.b = question.q.end.a + factor * end;
  }
}
void setHull(Random& random, Question<Triangle>& question) {
  const Vec3d a = fromEigen(random.inCube(0.5)), way = fromEigen(random.inCube(0.5));
  const auto side = [&] { return length(random) * fromEigen(random.direction()); };
  const Vec3d b = a + side(), c = a + side();
  question.q = {{a, b, c}, {a + way, b + way, c + way}};
  if (random.below(2) == 0) question.q.end.b = a + side();
}
template <class Hull>
Question<Hull> randomQuestion(Random& random) {
  Question<Hull> question;
  question.p = randomCone(random);
  setHull(random, question);
  if (random.below(2) == 0) question.margin = 0.1 * random.unit();
  if (random.below(4) == 0) question.error = 1e-4 * random.unit();
  if (random.below(3) != 0) return question;
  // They almost graze.
  long double least = 1e300L;
  for (int k = 0; k <= 64; ++k) least = std::min(least, excessAt(question, k / 64.0));
  question.margin += static_cast<double>(least) + random.between(-1e-3, 1e-3);
  // Nothing is nearer to a triangle than what passes through it.
  if (std::is_same_v<Hull, Triangle>) question.margin = std::max(question.margin, 0.0);
  return question;
}

/// Judges an answer: none is later than the first touch, and it is no earlier than by the
/// tolerance.
template <class Hull>
void judge(const Question<Hull>& question, bool approach, bool found, double time) {
  const double tolerance = impactTolerance(question.p, question.q);
  // Rounding of the start decides below this whether it has to come nearer.
  const double rounding = 0x1p-44 * (1 + std::fabs(question.margin));
  const auto start = static_cast<double>(excessAt(question, 0));
  if (approach && std::fabs(start - tolerance / 2) < rounding) return;
  const double level = approach && start <= tolerance / 2 ? start - 2 * tolerance : 0;
  ASSERT_GE(static_cast<double>(leastBefore(question, level, found ? time : 1)), -rounding)
      << (found ? "too late: " : "missed: ") << time << describe(question.p) << describe(question.q)
      << " margin " << question.margin << (approach ? " approach" : "");
  if (!found) return;
  ASSERT_TRUE(time >= 0 && time <= 1);
  ASSERT_LE(static_cast<double>(excessAt(question, time)) - level, tolerance + rounding)
      << "too early: " << time << describe(question.p) << describe(question.q) << " margin "
      << question.margin << (approach ? " approach" : "");
}

Impact timeOf(const Impact& impact) { return impact; }
Impact timeOf(const TriangleImpact& impact) { return {impact.time, impact.s, 0}; }

template <class Hull>
void judgeRandom(std::uint64_t seed, int count) {
  Random random(seed);
  int impacts = 0, approaches = 0;
  for (int i = 0; i < count; ++i) {
    const Question<Hull> question = randomQuestion<Hull>(random);
    const auto& [p, q, margin, error] = question;
    ImpactWith<Hull> impact;
    const bool approach = i % 3 == 0;
    const bool found = approach ? findApproach(p, q, margin, error, 0, impact)
                                : findImpact(p, q, margin, error, 0, impact);
    ++(found ? impacts : approaches);
    judge(question, approach, found, found ? timeOf(impact).time : 1);
    if (testing::Test::HasFatalFailure()) FAIL() << i;
  }
  EXPECT_GT(impacts, count / 5);
  EXPECT_GT(approaches, count / 10);
}

// A cone that takes for its radius that of another end would be met too late or too early.
TEST(ConeImpact, IsTheFirstTouch) { judgeRandom<Segment>(1, 150); }
TEST(ConeImpact, WithATriangleIsTheFirstTouch) { judgeRandom<Triangle>(2, 600); }

// The formula would be that of another problem.
TEST(ConeImpact, TimesThatAreKnown) {
  const auto cone = [](double height, double at_a, double at_b) {
    return Segment::cone({-1, 0, height}, {1, 0, height}, at_a, at_b);
  };
  Impact impact;
  // A ball that falls on the thick end, on the thin one, and on a cone whose ends change places.
  const auto ball = [](double x, double z) { return Segment{{x, 0, z}, {x, 0, z}, 0.25}; };
  const MovingSegment rest{cone(0, 0.25, 0.75), cone(0, 0.25, 0.75)};
  ASSERT_TRUE(findImpact(rest, {ball(1, 2), ball(1, 0)}, 0, 0, 0, impact));
  EXPECT_NEAR(impact.time, 0.5, 1e-10);
  EXPECT_NEAR(impact.s, 1, 1e-12);
  ASSERT_TRUE(findImpact({ball(-3, 0), ball(-1, 0)}, rest, 0, 0, 0, impact));
  EXPECT_NEAR(impact.time, 0.75, 1e-10);
  // Between the ends the surface is sqrt(1 - 1/16) from the axis along the line to the ball: at
  // x = 0 its height is 0.5 / sqrt(1 - 1/16).
  ASSERT_TRUE(
      findImpact(rest, {{{0, 0, 2}, {0, 0, 2}, 0}, {{0, 0, 0}, {0, 0, 0}, 0}}, 0, 0, 0, impact));
  EXPECT_NEAR(impact.time, 1 - 0.25 / std::sqrt(15.0 / 16), 1e-10);
  const MovingSegment swaps{cone(0, 0.25, 0.75), cone(0, 0.75, 0.25)};
  ASSERT_TRUE(findImpact(swaps, {ball(-1, 0.75), ball(-1, 0.75)}, 0, 0, 0, impact));
  EXPECT_NEAR(impact.time, 0.5, 1e-10);
  TriangleImpact on_triangle;
  const Triangle floor{{-4, -4, -1}, {4, -4, -1}, {0, 8, -1}};
  ASSERT_TRUE(findImpact({cone(0, 0.25, 0.75), cone(-0.5, 0.25, 0.75)}, {floor, floor}, 0, 0, 0,
                         on_triangle));
  EXPECT_NEAR(on_triangle.time, 0.5, 1e-10);
  EXPECT_NEAR(on_triangle.s, 1, 1e-12);
  EXPECT_FALSE(
      findImpact({cone(0, 0.25, 0.75), cone(0, 0.9, 0.75)}, {floor, floor}, 0, 0, 0, on_triangle));
}

// A pair would be found by another time in other company.
TEST(ConeImpact, OfManyIsThatOfOne) {
  Random random(3);
  int found = 0;
  for (int i = 0; i < 8; ++i) {
    ImpactQuery<Segment> queries[kImpactsAtOnce];
    Question<Segment> questions[kImpactsAtOnce];
    for (int k = 0; k < kImpactsAtOnce; ++k) {
      questions[k] = randomQuestion<Segment>(random);
      if (random.below(4) == 0) {
        for (Segment* s : {&questions[k].p.start, &questions[k].p.end, &questions[k].q.start,
                           &questions[k].q.end}) {
          *s = {s->a, s->b, s->radius};
        }
      }
      const auto& [p, q, margin, error] = questions[k];
      queries[k] = {p, q, margin, error, 0};
    }
    Impact impacts[kImpactsAtOnce]{};
    const std::uint32_t bits = findImpacts(queries, kImpactsAtOnce, impacts);
    for (int k = 0; k < kImpactsAtOnce; ++k) {
      judge(questions[k], false, (bits >> k & 1u) != 0, impacts[k].time);
      if (testing::Test::HasFatalFailure()) FAIL() << i;
      Impact alone{};
      ASSERT_EQ(findImpacts(&queries[k], 1, &alone), bits >> k & 1u);
      if ((bits >> k & 1u) == 0) continue;
      ++found;
      ASSERT_EQ(alone.time, impacts[k].time);
      ASSERT_EQ(alone.s, impacts[k].s);
    }
    for (const std::int64_t target : simd::availableTargets()) {
      const simd::ScopedTarget scoped(target);
      Impact again[kImpactsAtOnce]{};
      ASSERT_EQ(findImpacts(queries, kImpactsAtOnce, again), bits) << simd::targetName(target);
      for (int k = 0; k < kImpactsAtOnce; ++k) {
        const bool is_found = (bits >> k & 1u) != 0;
        ASSERT_TRUE(!is_found || again[k].time == impacts[k].time);
      }
    }
  }
  EXPECT_GT(found, 20);
}

// What float parts would be missed; if it parted hardly any, it would be of no use.
TEST(ConeImpact, InFloatNoneIsMissed) {
  Random random(4);
  std::size_t apart = 0, advanced = 0, all = 0;
  for (int block = 0; block < 4; ++block) {
    std::vector<Question<Segment>> questions(1 + random.below(64));
    std::vector<CapsuleEnd> ends;
    ends.reserve(8 * questions.size());
    const auto add = [&](const Segment& s) {
      ends.push_back(firstEndOf(s));
      ends.push_back(secondEndOf(s));
      return &ends[ends.size() - 2];
    };
    ImpactPairs pairs(1);
    pairs.setMayTaper({true, true}, {true, true});
    for (Question<Segment>& question : questions) {
      question = randomQuestion<Segment>(random);
      const auto& [p, q, margin, error] = question;
      const CapsuleEnd *const p0 = add(p.start), *const p1 = add(p.end);
      const CapsuleEnd *const q0 = add(q.start), *const q1 = add(q.end);
      pairs.add({p0, p1}, {q0, q1}, margin, error);
    }
    const std::uint64_t verdict = pairs.decide();
    for (std::size_t i = 0; i < questions.size(); ++i, ++all) {
      const bool is_apart = (verdict >> i & 1u) != 0;
      const double from = pairs.from(static_cast<int>(i));
      apart += is_apart;
      advanced += !is_apart && from > 0;
      ASSERT_GT(static_cast<double>(leastBefore(questions[i], 0, is_apart ? 1 : from)), 0)
          << describe(questions[i].p) << describe(questions[i].q) << " margin "
          << questions[i].margin << " from " << from;
    }
  }
  EXPECT_GT(apart, all / 5);
  EXPECT_GT(advanced, all / 10);
}

// The second ends of capsules, which may have the radius of others, would count.
TEST(ConeImpact, OfACapsuleInFloatTheFirstEndCounts) {
  const CapsuleEnd p[] = {{{-1, 0, 0, 0.25}}, {{1, 0, 0, 9}}},
                   q[] = {{{0, 0, 1, 0.25}}, {{0, 0, 2, 0}}};
  const CapsuleEnd p_end[] = {{{-1, 0, 0, 0.25}}, {{1, 0, 0, 0.5}}};
  ImpactPairs pairs(1);
  pairs.setMayTaper({false, true}, {false, false});
  pairs.add({p, p_end}, {q, q}, 0, 0);
  EXPECT_EQ(pairs.decide() & 1u, 1u);
}

}  // namespace
}  // namespace fcl_fibers::geometry
