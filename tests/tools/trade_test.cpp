// SPDX-License-Identifier: BSD-3-Clause
//
// What the command `trade` judges by, beside the oracles of the tests.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/branched_fibers.h"
#include "support/exact_geometry.h"
#include "support/least_of_convex.h"
#include "support/random.h"
#include "support/touch_oracle.h"
#include "tools/trade/coarser.h"
#include "tools/trade/front.h"
#include "tools/trade/trial.h"

namespace fcl_fibers::tools::trade {
namespace {

using testing::IsEmpty;
using Pair = std::pair<std::int32_t, std::int32_t>;

constexpr double kAll = 1e300;
const auto kSilent = [](double) {};

/// Fibers that wander in a cube, so that many touch others and some touch themselves.
FiberPolylines tangle(std::size_t fibers, std::size_t segments, double radius, std::uint64_t seed) {
  test::Random random(seed);
  FiberPolylines scene;
  scene.radius = radius;
  for (std::size_t f = 0; f < fibers; ++f) {
    Eigen::Vector3d p = random.inCube(0.5), way = random.direction();
    for (std::size_t i = 0; i <= segments; ++i) {
      scene.points.push_back({p.x(), p.y(), p.z()});
      way = (way + random.direction()).normalized();
      p += 0.1 * way;
    }
    scene.point_begin.push_back(scene.points.size());
  }
  return scene;
}

test::TouchOracle oracleOf(const FiberPolylines& scene, std::vector<std::int32_t>& segments) {
  std::vector<test::GivenCapsule> capsules;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t n = 0; n < scene.segmentCount(f); ++n) {
      const std::size_t i = scene.point_begin[f] + n;
      segments.push_back(static_cast<std::int32_t>(i));
      capsules.push_back({scene.points[i], scene.points[i + 1], scene.radiusAt(i)});
    }
  }
  return test::TouchOracle(std::move(capsules));
}

std::vector<Pair> pairsOf(const std::vector<Touch>& touches) {
  std::vector<Pair> pairs;
  for (const Touch& touch : touches) pairs.emplace_back(touch.a, touch.b);
  return pairs;
}

test::Point exact(const Point& p) { return {p[0], p[1], p[2]}; }

// A contact that the judge misses would be false when a tree reports it, and the other way around.
TEST(Judge, FindsWhatTouches) {
  const Scene scene = {tangle(60, 100, 0.03, 1), {}};
  const Verdict verdict = judge(scene, kAll, kSilent);
  std::vector<std::int32_t> segments;
  const test::TouchOracle truth = oracleOf(scene.fibers, segments);
  std::vector<Pair> expected;
  truth.visitNearPairs(0, [&](std::size_t i, std::size_t j, const auto& decided) {
    // Half a circle with the diameter of both radii is 0.094, less than a segment.
    if (decided.touching && segments[j] > segments[i] + 1) {
      expected.emplace_back(segments[i], segments[j]);
    }
  });
  ASSERT_GT(expected.size(), 500u);
  EXPECT_EQ(pairsOf(verdict.contacts), expected);
  EXPECT_THAT(verdict.open, IsEmpty());
  EXPECT_TRUE(verdict.isWhole());
  for (const Touch& touch : verdict.contacts) {
    const auto a = static_cast<std::size_t>(touch.a), b = static_cast<std::size_t>(touch.b);
    const std::vector<Point>& p = scene.fibers.points;
    const auto distance =
        test::segmentDistance(exact(p[a]), exact(p[a + 1]), exact(p[b]), exact(p[b + 1]));
    EXPECT_NEAR(touch.distance, static_cast<double>(distance) - 0.06, 1e-15);
  }
}

// Segments along a thick fiber would count as contacts of it with itself.
TEST(Judge, LeavesOutPairsAlongAFiber) {
  Scene scene;
  scene.fibers.radius = 1;
  for (int i = 0; i <= 10; ++i) scene.fibers.points.push_back({1.0 * i, 0, 0});
  scene.fibers.point_begin = {0, 11};
  const Verdict straight = judge(scene, kAll, kSilent);
  EXPECT_THAT(straight.contacts, IsEmpty());
  EXPECT_TRUE(straight.has_pairs_along);
  EXPECT_NEAR(defaultOptions(scene, straight).ignored_arc_length, std::acos(-1), 1e-6);
  // All around a circle touch. Half a circle of both radii is 3.14, and segments are 0.5 long, so
  // that seven of them may lie between two.
  for (int i = 0; i <= 10; ++i) {
    const double angle = 2 * std::asin(0.25 / 0.9) * i;
    scene.fibers.points[static_cast<std::size_t>(i)] = {0.9 * std::cos(angle),
                                                        0.9 * std::sin(angle), 0};
  }
  EXPECT_THAT(pairsOf(judge(scene, kAll, kSilent).contacts),
              testing::ElementsAre(Pair{0, 8}, Pair{0, 9}, Pair{1, 9}));
}

// A sample would tell of contacts that there are not, or leave out some of its own.
TEST(Judge, ASampleHasAllContactsOfItsSegments) {
  const Scene scene = {tangle(60, 200, 0.01, 2), {}};
  const Verdict whole = judge(scene, kAll, kSilent), part = judge(scene, 2e6, kSilent);
  ASSERT_FALSE(part.isWhole());
  ASSERT_GT(part.judged_pieces, 5u);
  const auto isSampled = [&](std::int32_t i) {
    return part.sample[static_cast<std::size_t>(i)] != 0;
  };
  std::vector<Pair> expected;
  for (const Touch& touch : whole.contacts) {
    if (isSampled(touch.a) || isSampled(touch.b)) expected.emplace_back(touch.a, touch.b);
  }
  EXPECT_EQ(pairsOf(part.contacts), expected);
}

MeshFile meshOf(std::vector<Point> points, std::vector<std::int32_t> triangles) {
  TriangleMesh mesh({points.front().data(), points.size(), triangles.data(), triangles.size() / 3});
  return {"mesh", std::move(points), std::move(triangles), std::move(mesh)};
}

/// A sheet of waves over [-1, 1] x [-1, 1].
MeshFile waves(std::int32_t n) {
  std::vector<Point> points;
  std::vector<std::int32_t> triangles;
  for (std::int32_t i = 0; i <= n; ++i) {
    for (std::int32_t j = 0; j <= n; ++j) {
      const double x = 2.0 * i / n - 1, y = 2.0 * j / n - 1;
      points.push_back({x, y, 0.2 * std::sin(4 * x) * std::cos(3 * y)});
      const std::int32_t at = i * (n + 1) + j;
      if (i == n || j == n) continue;
      triangles.insert(triangles.end(), {at, at + n + 1, at + 1, at + 1, at + n + 1, at + n + 2});
    }
  }
  return meshOf(std::move(points), std::move(triangles));
}

double distanceToMesh(const Point& p, const Point& q, const MeshFile& mesh) {
  test::Real least = 1e300;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    const auto corner = [&](std::size_t k) {
      return exact(mesh.points[static_cast<std::size_t>(mesh.triangles[t + k])]);
    };
    least = std::min(least, test::segmentTriangleDistance(exact(p), exact(q),
                                                          {corner(0), corner(1), corner(2)}));
  }
  return static_cast<double>(least);
}

// As for two segments.
TEST(Judge, FindsWhatTouchesAMesh) {
  Scene scene = {tangle(20, 40, 0.05, 3), {}};
  scene.meshes.push_back(waves(12));
  const Verdict verdict = judge(scene, kAll, kSilent);
  std::size_t crossing = 0, next = 0;
  for (std::size_t i = 0; i + 1 < scene.fibers.points.size(); ++i) {
    if ((i + 1) % 41 == 0) continue;  // the last point of a fiber
    const double distance =
        distanceToMesh(scene.fibers.points[i], scene.fibers.points[i + 1], scene.meshes[0]);
    if (distance > 0.05) continue;
    ASSERT_LT(next, verdict.contacts.size());
    const Touch& touch = verdict.contacts[next++];
    EXPECT_EQ(touch.a, static_cast<std::int32_t>(i));
    EXPECT_EQ(touch.b, kAMesh);
    EXPECT_NEAR(touch.distance, distance - 0.05, 1e-15);
    crossing += distance == 0 ? 1 : 0;
  }
  EXPECT_EQ(next, verdict.contacts.size());
  EXPECT_GT(crossing, 5u);
  EXPECT_GT(next, 2 * crossing);
}

// A pair that meets in the middle of a step would go by, or its time be another one.
TEST(Judge, FindsWhatTouchesInAStep) {
  Scene scene = {tangle(30, 30, 0.01, 4), {}};
  scene.end.push_back(tangle(30, 30, 0.01, 5));
  const Verdict verdict = judge(scene, kAll, kSilent);
  std::vector<std::int32_t> segments;
  const test::TouchOracle start = oracleOf(scene.fibers, segments);
  std::vector<std::int32_t> same;
  constexpr int kInstants = 2000;
  std::size_t seen = 0;
  const auto at = [&](std::size_t i, double time) {
    test::Point p;
    for (std::size_t k = 0; k < 3; ++k) {
      p[static_cast<Eigen::Index>(k)] =
          (1 - time) * scene.fibers.points[i][k] + time * scene.end[0].points[i][k];
    }
    return p;
  };
  std::size_t late = 0;
  for (const Touch& touch : verdict.contacts) {
    const auto a = static_cast<std::size_t>(touch.a), b = static_cast<std::size_t>(touch.b);
    const auto gap = [&](double time) {
      return static_cast<double>(test::segmentDistance(at(a, time), at(a + 1, time), at(b, time),
                                                       at(b + 1, time))) -
             0.02;
    };
    EXPECT_LT(gap(touch.time), 1e-9);
    for (int i = 0; i < 20 && touch.time > 0; ++i) {
      late += gap(touch.time * i / 20 * 0.999) < -1e-6 ? 1 : 0;
    }
    ++seen;
  }
  EXPECT_EQ(late, 0u);
  ASSERT_GT(seen, 300u);
  // What touches at some instant is among them.
  const std::vector<Pair> found = pairsOf(verdict.contacts);
  test::Random random(6);
  for (int i = 0; i < kInstants; ++i) {
    const auto a = static_cast<std::size_t>(segments[random.below(segments.size())]);
    const auto b = static_cast<std::size_t>(segments[random.below(segments.size())]);
    if (b < a + 2) continue;
    for (int n = 0; n <= 40; ++n) {
      const double time = n / 40.0;
      const auto distance =
          test::segmentDistance(at(a, time), at(a + 1, time), at(b, time), at(b + 1, time));
      if (!(distance < 0.0199)) continue;
      EXPECT_THAT(found, testing::Contains(Pair(a, b))) << "at " << time;
    }
  }
}

constexpr auto kPerPoint = FiberArrays<double>::Radii::kPerPoint;

/// Fibers that meet, and whose radii differ from point to point.
FiberPolylines taperedTree(std::uint64_t seed) {
  FiberPolylines scene = test::branchedFibers(seed);
  test::Random random(seed);
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    scene.radii.push_back(static_cast<float>(random.between(0.01, 0.1)));
  }
  scene.radii_are = kPerPoint;
  return scene;
}

std::vector<std::size_t> segmentsOf(const FiberPolylines& scene) {
  std::vector<std::size_t> segments;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t n = 0; n < scene.segmentCount(f); ++n) {
      segments.push_back(scene.point_begin[f] + n);
    }
  }
  return segments;
}

/// A ball of a segment: its middle, and its radius.
std::array<long double, 4> ballAt(const FiberPolylines& scene, std::size_t i, long double s) {
  const Point &p = scene.points[i], &q = scene.points[i + 1];
  const auto mix = [s](double from, double to) { return (1 - s) * from + s * to; };
  return {mix(p[0], q[0]), mix(p[1], q[1]), mix(p[2], q[2]),
          mix(scene.radiusAt(i, 0), scene.radiusAt(i, 1))};
}

long double ballGap(const std::array<long double, 4>& x, const std::array<long double, 4>& y) {
  const long double dx = x[0] - y[0], dy = x[1] - y[1], dz = x[2] - y[2];
  return std::sqrt(dx * dx + dy * dy + dz * dz) - x[3] - y[3];
}

/// By the definition, unless capsules around are apart.
double coneGap(const FiberPolylines& scene, std::size_t i, std::size_t j) {
  const std::vector<Point>& p = scene.points;
  const double least = static_cast<double>(test::segmentDistance(exact(p[i]), exact(p[i + 1]),
                                                                 exact(p[j]), exact(p[j + 1]))) -
                       scene.radiusAt(i) - scene.radiusAt(j);
  if (least > 1e-9 || !scene.hasRadiiOfPoints()) return least;
  return static_cast<double>(test::leastOfConvex([&](long double s) {
    const auto ball = ballAt(scene, i, s);
    return test::leastOfConvex([&](long double t) { return ballGap(ball, ballAt(scene, j, t)); });
  }));
}

/// The shortest ways between all points along fibers (Floyd and Warshall).
class Ways {
 public:
  /// @param by_number  each segment counts as 1, not by its length
  Ways(const FiberPolylines& scene, bool by_number)
      : length_(scene.points.size(), std::vector<double>(scene.points.size(), 1e300)) {
    const auto join = [&](std::size_t p, std::size_t q, double length) {
      length_[p][q] = length_[q][p] = std::min(length_[p][q], length);
    };
    const std::size_t count = length_.size();
    for (std::size_t i = 0; i < count; ++i) length_[i][i] = 0;
    for (const std::size_t i : segmentsOf(scene)) {
      const Point &p = scene.points[i], &q = scene.points[i + 1];
      join(i, i + 1, by_number ? 1 : std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]));
    }
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1];
      if (scene.isClosed(f)) join(begin, end - 1, 0);
      const auto joinAt = [&](const std::vector<std::int32_t>& at, std::size_t own) {
        if (!at.empty() && at[f] >= 0) join(own, static_cast<std::size_t>(at[f]), 0);
      };
      joinAt(scene.starts_at, begin);
      joinAt(scene.ends_at, end - 1);
    }
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t j = 0; j < count; ++j) {
          length_[i][j] = std::min(length_[i][j], length_[i][k] + length_[k][j]);
        }
      }
    }
  }
  double between(std::size_t i, std::size_t j) const {
    return std::min({length_[i][j], length_[i + 1][j], length_[i][j + 1], length_[i + 1][j + 1]});
  }

 private:
  std::vector<std::vector<double>> length_;
};

/// All pairs that touch and are not adjacent, nor as near along fibers as `most` tells.
template <class Most>
std::vector<Pair> pairsByHand(const FiberPolylines& scene, const Most& most) {
  const Ways lengths(scene, false), numbers(scene, true);
  std::vector<Pair> pairs;
  const std::vector<std::size_t> segments = segmentsOf(scene);
  for (const std::size_t i : segments) {
    for (const std::size_t j : segments) {
      if (j <= i || numbers.between(i, j) == 0 || lengths.between(i, j) <= most(i, j)) continue;
      if (coneGap(scene, i, j) < 0) pairs.emplace_back(i, j);
    }
  }
  return pairs;
}

/// What is true: pairs other than those whose part between them cannot turn back.
std::vector<Pair> contactsByHand(const FiberPolylines& scene) {
  return pairsByHand(scene, [&](std::size_t i, std::size_t j) {
    return std::acos(-1) / 2 * (scene.radiusAt(i) + scene.radiusAt(j));
  });
}

// The thin end of a cone would touch as its thick one does, or branches would touch where they
// begin.
TEST(Judge, FindsWhatTouchesWhereFibersTaperAndBranch) {
  std::size_t contacts = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Scene scene = {taperedTree(seed), {}};
    const Verdict verdict = judge(scene, kAll, kSilent);
    EXPECT_EQ(pairsOf(verdict.contacts), contactsByHand(scene.fibers));
    EXPECT_THAT(verdict.open, IsEmpty());
    contacts += verdict.contacts.size();
    for (const Touch& touch : verdict.contacts) {
      const auto a = static_cast<std::size_t>(touch.a), b = static_cast<std::size_t>(touch.b);
      EXPECT_NEAR(touch.distance, coneGap(scene.fibers, a, b), 1e-15);
      if (touch.normal == Point{}) continue;
      // No plane has more of a gap than the right normal's, nor the place another depth.
      long double gap = 1;
      for (const int s : {0, 1}) {
        for (const int t : {0, 1}) {
          const auto p = ballAt(scene.fibers, a, s), q = ballAt(scene.fibers, b, t);
          long double along = -p[3] - q[3];
          for (std::size_t k = 0; k < 3; ++k) along += touch.normal[k] * (q[k] - p[k]);
          gap = std::min(gap, along);
        }
      }
      EXPECT_NEAR(static_cast<double>(gap), touch.distance, 1e-13);
      // Unless that is so deep that it is beyond the axis of the thin one.
      const auto thin = [&](std::size_t i) {
        return std::min(scene.fibers.radii[i], scene.fibers.radii[i + 1]);
      };
      if (-touch.distance / 2 > std::min(thin(a), thin(b))) continue;
      const std::array<long double, 4> place = {touch.place[0], touch.place[1], touch.place[2], 0};
      for (const std::size_t i : {a, b}) {
        const long double depth = test::leastOfConvex(
            [&](long double s) { return ballGap(place, ballAt(scene.fibers, i, s)); });
        EXPECT_NEAR(static_cast<double>(depth), touch.distance / 2, 1e-13);
      }
    }
  }
  EXPECT_GT(contacts, 100u);
}

/// Fibers whose radii are drawn for each point.
FiberPolylines taperedTangle(std::size_t fibers, std::size_t segments, std::uint64_t seed) {
  FiberPolylines scene = tangle(fibers, segments, 0, seed);
  test::Random random(seed);
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    scene.radii.push_back(random.between(0, 0.05));
  }
  scene.radii_are = kPerPoint;
  return scene;
}

// As for two segments. Some taper so much that they are deepest beside where they cross.
TEST(Judge, FindsTheDepthOfTapersInAMesh) {
  Scene scene = {taperedTangle(8, 20, 10), {}};
  for (std::size_t i = 0; i < scene.fibers.radii.size(); i += 7) scene.fibers.radii[i] = 0.3;
  scene.meshes.push_back(waves(6));
  const Verdict verdict = judge(scene, kAll, kSilent);
  std::size_t next = 0;
  for (const std::size_t i : segmentsOf(scene.fibers)) {
    double gap = 1e300;
    const MeshFile& mesh = scene.meshes[0];
    for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
      const auto corner = [&](std::size_t k) {
        return exact(mesh.points[static_cast<std::size_t>(mesh.triangles[t + k])]);
      };
      const test::ExactTriangle triangle = {corner(0), corner(1), corner(2)};
      const auto distance = [&](long double s) {
        const auto ball = ballAt(scene.fibers, i, s);
        const test::Point p(ball[0], ball[1], ball[2]);
        return test::segmentTriangleDistance(p, p, triangle) - ball[3];
      };
      gap = std::min(gap, static_cast<double>(test::leastOfConvex(distance)));
    }
    if (gap > 0) continue;
    ASSERT_LT(next, verdict.contacts.size());
    EXPECT_EQ(verdict.contacts[next].a, static_cast<std::int32_t>(i));
    EXPECT_NEAR(verdict.contacts[next++].distance, gap, 1e-15);
  }
  EXPECT_EQ(next, verdict.contacts.size());
  EXPECT_GT(next, 30u);
}

// The radii of one end would count for both, or those of the start for the whole step.
TEST(Judge, FindsWhatTapersTouchInAStep) {
  Scene scene = {taperedTangle(16, 10, 11), {}};
  scene.end.push_back(taperedTangle(16, 10, 12));
  const Verdict verdict = judge(scene, kAll, kSilent);
  const auto gapAt = [&](std::size_t a, std::size_t b, double time) {
    FiberPolylines two;
    for (const std::size_t i : {a, a + 1, b, b + 1}) {
      const auto mix = [time](double from, double to) { return from + time * (to - from); };
      Point p;
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = mix(scene.fibers.points[i][k], scene.end[0].points[i][k]);
      }
      two.points.push_back(p);
      two.radii.push_back(mix(scene.fibers.radii[i], scene.end[0].radii[i]));
    }
    two.radii_are = kPerPoint;
    return coneGap(two, 0, 2);
  };
  ASSERT_GT(verdict.contacts.size(), 200u);
  for (const Touch& touch : verdict.contacts) {
    const auto a = static_cast<std::size_t>(touch.a), b = static_cast<std::size_t>(touch.b);
    EXPECT_LT(gapAt(a, b, touch.time), 0);
    EXPECT_NEAR(gapAt(a, b, touch.time), touch.distance, 1e-14);
    for (int i = 0; i < 4 && touch.time > 0; ++i) {
      EXPECT_GT(gapAt(a, b, touch.time * i / 4 * 0.999), -1e-6);
    }
  }
  const std::vector<Pair> found = pairsOf(verdict.contacts);
  std::size_t seen = 0;
  for (const std::size_t a : segmentsOf(scene.fibers)) {
    for (const std::size_t b : segmentsOf(scene.fibers)) {
      if (b < a + 11 || !(gapAt(a, b, 0.4) < -1e-6)) continue;
      ++seen;
      EXPECT_THAT(found, testing::Contains(Pair(a, b)));
    }
  }
  EXPECT_GT(seen, 15u);
}

/// A setting of that many missed pairs and false ones.
std::vector<Touch> without(std::vector<Touch> touches, std::size_t missed, std::size_t wrong) {
  touches.erase(touches.begin(), touches.begin() + static_cast<std::ptrdiff_t>(missed));
  // Segments of a fiber are adjacent.
  for (std::size_t i = 0; i < wrong; ++i) {
    touches.push_back({static_cast<std::int32_t>(i), static_cast<std::int32_t>(i + 1)});
  }
  std::sort(touches.begin(), touches.end());
  return touches;
}

// Shares and errors would be those of other answers.
TEST(Compare, CountsWhatIsMissedAndFalse) {
  const Scene scene = {tangle(60, 100, 0.03, 1), {}};
  const Verdict verdict = judge(scene, kAll, kSilent);
  std::vector<Touch> found = without(verdict.contacts, 7, 5);
  const Outcome outcome = compare(scene, verdict, {}, found);
  EXPECT_EQ(outcome.missed, 7u);
  EXPECT_EQ(outcome.wrong, 5u);
  EXPECT_EQ(outcome.judged, found.size());
  EXPECT_DOUBLE_EQ(outcome.most_missed, outcome.missed_share);
  EXPECT_EQ(outcome.depth.worst, 0);
  EXPECT_EQ(outcome.normal.worst, 0);
  for (Touch& touch : found) {
    touch.distance += 0.015;  // half a radius
    for (double& x : touch.place) x += 0.03 / std::sqrt(3);
    if (touch.normal != Point{}) std::swap(touch.normal[0], touch.normal[1]);
  }
  const Outcome off = compare(scene, verdict, {}, found);
  EXPECT_NEAR(off.depth.median, 0.5, 1e-9);
  EXPECT_NEAR(off.place.median, 1, 1e-9);
  EXPECT_GT(off.normal.worst, 10);
}

// A sample would be taken for all.
TEST(Compare, BoundsWhatASampleMayHideOfAll) {
  const Scene scene = {tangle(60, 200, 0.01, 2), {}};
  const Verdict part = judge(scene, 2e6, kSilent);
  const Outcome none = compare(scene, part, {}, part.contacts);
  EXPECT_EQ(none.missed, 0u);
  // Wilson's bound for none of n is z^2 / (n + z^2). The contacts of a piece tell less than as many
  // from anywhere.
  const double n = 3.8415 / none.most_missed - 3.8415;
  EXPECT_GT(n, 1);
  EXPECT_LT(n, 0.9 * static_cast<double>(part.contacts.size()));
  EXPECT_DOUBLE_EQ(mostHidden(part), none.most_missed);
  EXPECT_EQ(none.false_share, 0);
  EXPECT_NEAR(none.most_false, none.most_missed, 1e-3);
  const Outcome some = compare(scene, part, {}, without(part.contacts, 10, 0));
  EXPECT_GT(some.most_missed, some.missed_share);
  // What is false outside of the sample is not known.
  std::vector<Touch> found = part.contacts;
  for (std::int32_t i = 0; i < 200; ++i) found.push_back({i, i + 1});
  std::sort(found.begin(), found.end());
  const Outcome judged = compare(scene, part, {}, found);
  EXPECT_LT(judged.wrong, 200u);
  EXPECT_GT(judged.most_false, judged.false_share);
  EXPECT_EQ(judged.wrong + part.contacts.size(), judged.judged);
}

// Pairs of two pieces come into the sample twice as often as those of one, so what loses pairs that
// are near along a fiber would seem to lose fewer than it does.
TEST(Compare, ASampleTellsTheShareOfAll) {
  const auto withoutNear = [](std::vector<Touch> touches) {
    const auto isNear = [](const Touch& touch) { return touch.b - touch.a < 40; };
    touches.erase(std::remove_if(touches.begin(), touches.end(), isNear), touches.end());
    return touches;
  };
  double share = 0, told = 0, counted = 0;
  for (std::uint64_t seed = 20; seed < 50; ++seed) {
    const Scene scene = {tangle(60, 200, 0.01, seed), {}};
    const Verdict whole = judge(scene, kAll, kSilent), part = judge(scene, 2e6, kSilent);
    ASSERT_FALSE(part.isWhole());
    share += compare(scene, whole, {}, withoutNear(whole.contacts)).missed_share;
    const Outcome outcome = compare(scene, part, {}, withoutNear(part.contacts));
    told += outcome.missed_share;
    counted += static_cast<double>(outcome.missed) / static_cast<double>(outcome.contacts);
  }
  // Some 90 contacts in each of 30 samples: three standard deviations of the mean.
  EXPECT_NEAR(told, share, 0.2 * share);
  EXPECT_LT(counted, 0.8 * share);
}

double greatestDistance(const FiberPolylines& fibers, const CoarserFibers& coarser) {
  double greatest = 0;
  for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
    for (std::size_t n = 0; n < fibers.segmentCount(f); ++n) {
      const std::size_t i = fibers.point_begin[f] + n;
      const auto own = static_cast<std::size_t>(coarser.segment_of[i]);
      for (const std::size_t end : {i, i + 1}) {
        greatest =
            std::max(greatest, static_cast<double>(test::pointSegmentDistance(
                                   exact(fibers.points[end]), exact(coarser.fibers.points[own]),
                                   exact(coarser.fibers.points[own + 1]))));
      }
    }
  }
  return greatest;
}

// A margin of twice the error would miss contacts.
TEST(Coarser, FibersAreWithinTheirError) {
  FiberPolylines fibers = tangle(5, 23, 0.01, 7);
  fibers.radii.assign(fibers.points.size(), 0.01);
  fibers.radii[9] = 0.5;
  for (const std::size_t n : {std::size_t{2}, std::size_t{4}, std::size_t{8}}) {
    const CoarserFibers coarser = everyNth(fibers, n);
    ASSERT_EQ(coarser.fibers.fiberCount(), 5u);
    EXPECT_EQ(coarser.fibers.segmentCount(0), (23 + n - 1) / n);
    EXPECT_EQ(coarser.fibers.points[coarser.fibers.point_begin[1] - 1], fibers.points[23]);
    EXPECT_NEAR(greatestDistance(fibers, coarser), coarser.error, 1e-12);
    EXPECT_EQ(coarser.fibers.radiusAt(static_cast<std::size_t>(coarser.segment_of[9])), 0.5);
  }
}

// Branches would begin in the air, or a margin of twice the error would miss contacts.
TEST(Coarser, TreesStayJoinedAndWithinTheirError) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const FiberPolylines fibers = taperedTree(seed);
    const CoarserFibers coarser = everyNth(fibers, 4);
    ASSERT_EQ(coarser.fibers.fiberCount(), fibers.fiberCount());
    EXPECT_LT(coarser.fibers.segmentCount(), fibers.segmentCount());
    for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
      EXPECT_EQ(coarser.fibers.isClosed(f), fibers.isClosed(f));
      for (const bool at_start : {true, false}) {
        const auto& at = at_start ? coarser.fibers.starts_at : coarser.fibers.ends_at;
        EXPECT_EQ(at[f] < 0, (at_start ? fibers.starts_at : fibers.ends_at)[f] < 0);
        if (at[f] < 0) continue;
        const std::size_t own =
            at_start ? coarser.fibers.point_begin[f] : coarser.fibers.point_begin[f + 1] - 1;
        EXPECT_EQ(coarser.fibers.points[own],
                  coarser.fibers.points[static_cast<std::size_t>(at[f])]);
      }
    }
    // How far a ball sticks out of the segment that replaces it.
    long double greatest = 0;
    for (const std::size_t i : segmentsOf(fibers)) {
      const auto own = static_cast<std::size_t>(coarser.segment_of[i]);
      for (const int end : {0, 1}) {
        std::array<long double, 4> ball = ballAt(fibers, i, end);
        const long double radius = std::exchange(ball[3], 0);
        const long double gap = test::leastOfConvex(
            [&](long double s) { return ballGap(ball, ballAt(coarser.fibers, own, s)); });
        greatest = std::max(greatest, gap + radius);
      }
    }
    EXPECT_NEAR(static_cast<double>(greatest), coarser.error, 1e-12);
  }
}

/// So narrow that its triangles become edges.
MeshFile ribbon() {
  std::vector<Point> points;
  std::vector<std::int32_t> triangles;
  for (std::int32_t i = 0; i <= 40; ++i) {
    for (const double y : {0.0, 0.01}) points.push_back({0.1 * i, y, 0});
    if (i > 0)
      triangles.insert(triangles.end(),
                       {2 * i - 2, 2 * i, 2 * i + 1, 2 * i - 2, 2 * i + 1, 2 * i - 1});
  }
  return meshOf(std::move(points), std::move(triangles));
}

void expectWithinError(const MeshFile& fine) {
  for (const double edges : {2.0, 8.0}) {
    const CoarserMesh coarser = clusterPoints(fine, edges);
    EXPECT_LT(coarser.mesh.triangles.size(), fine.triangles.size() / 2);
    ASSERT_FALSE(coarser.mesh.triangles.empty());
    double greatest = 0;
    for (std::size_t t = 0; t < fine.triangles.size(); t += 3) {
      // Corners, and the middle.
      Point middle{};
      for (std::size_t k = 0; k < 3; ++k) {
        const Point& p = fine.points[static_cast<std::size_t>(fine.triangles[t + k])];
        for (std::size_t axis = 0; axis < 3; ++axis) middle[axis] += p[axis] / 3;
        greatest = std::max(greatest, distanceToMesh(p, p, coarser.mesh));
      }
      greatest = std::max(greatest, distanceToMesh(middle, middle, coarser.mesh));
    }
    EXPECT_LE(greatest, coarser.error + 1e-12);
    EXPECT_GT(greatest, 0);
  }
}

TEST(Coarser, AMeshIsWithinItsError) {
  expectWithinError(waves(16));
  expectWithinError(ribbon());
}

// A dial would miss contacts that it is said to find, or none that it is said to miss.
TEST(Settings, FindWhatTheyPromise) {
  const Scene scene = {tangle(40, 64, 0.02, 8), tangle(40, 64, 0.02, 9)};
  const Verdict verdict = judge(scene, kAll, kSilent);
  std::size_t coarse_missed = 0;
  for (const Setting& setting : settingsOf(scene, verdict)) {
    const std::unique_ptr<Trial> trial = setting.make();
    Deadline deadline(1e9);
    trial->frame(deadline);
    const Outcome outcome = compare(scene, verdict, setting, trial->found());
    const bool loses =
        setting.dial == "neighbours" ||
        (setting.dial == "sampling" && setting.value.find("margin") == std::string::npos);
    const bool reports_capsules = setting.value.find("volumes") == std::string::npos;
    if (setting.dial == "sampling" && loses) coarse_missed += outcome.missed;
    EXPECT_TRUE(loses || outcome.missed == 0) << setting.name();
    EXPECT_TRUE(setting.dial != "tree" || !reports_capsules || outcome.wrong == 0)
        << setting.name();
    EXPECT_TRUE(setting.dial != "tree" || outcome.depth.worst < 1e-12) << setting.name();
    EXPECT_GT(trial->bytes(), 0u) << setting.name();
  }
  EXPECT_GT(coarse_missed, 10u);
}

// A dial that leaves out tapers or branches would be said to miss and to add other pairs than it
// does.
TEST(Settings, LeaveOutTapersAndBranches) {
  std::size_t missed = 0, added_by_tapers = 0, added_by_branches = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Scene scene = {taperedTree(seed), taperedTree(seed)};
    const Verdict verdict = judge(scene, kAll, kSilent);
    const std::vector<Pair> truth = contactsByHand(scene.fibers);
    const double length = defaultOptions(scene, verdict).ignored_arc_length;
    std::size_t dials = 0;
    for (const Setting& setting : settingsOf(scene, verdict)) {
      FiberPolylines changed = scene.fibers;
      if (setting.dial == "branches") {
        changed.starts_at = changed.ends_at = {};
      } else if (setting.dial == "tapers") {
        changed.radii_are = FiberArrays<double>::Radii::kPerFirstPoint;
        for (const std::size_t i : segmentsOf(changed)) {
          const double p = scene.fibers.radii[i], q = scene.fibers.radii[i + 1];
          const bool is_mean = setting.value.find("mean") != std::string::npos;
          changed.radii[i] = is_mean ? (p + q) / 2 : std::max(p, q);
        }
      } else if (dials++ > 0) {
        continue;  // the default is the first one
      }
      const std::vector<Pair> reported =
          pairsByHand(changed, [&](std::size_t, std::size_t) { return length > 0 ? length : -1; });
      const std::unique_ptr<Trial> trial = setting.make();
      Deadline deadline(1e9);
      trial->frame(deadline);
      const std::vector<Touch> found = trial->found();
      EXPECT_EQ(pairsOf(found), reported) << setting.name();
      const Outcome outcome = compare(scene, verdict, setting, found);
      const auto isIn = [](const std::vector<Pair>& pairs) {
        return [&pairs](const Pair& pair) {
          return std::binary_search(pairs.begin(), pairs.end(), pair);
        };
      };
      const auto kept = std::count_if(truth.begin(), truth.end(), isIn(reported));
      EXPECT_EQ(outcome.missed, truth.size() - static_cast<std::size_t>(kept)) << setting.name();
      EXPECT_EQ(outcome.wrong, reported.size() - static_cast<std::size_t>(kept)) << setting.name();
      if (setting.dial == "tree") {
        EXPECT_EQ(outcome.missed, 0u);
        EXPECT_LT(outcome.depth.worst, 1e-12);
        added_by_tapers -= outcome.wrong;
        added_by_branches -= outcome.wrong;
      }
      if (setting.value == "left out, mean radii") missed += outcome.missed;
      if (setting.value == "left out, larger radii") added_by_tapers += outcome.wrong;
      if (setting.dial == "branches") added_by_branches += outcome.wrong;
      dials += setting.dial == "branches" || setting.dial == "tapers" ? 1 : 0;
    }
    EXPECT_GE(dials, 4u);
  }
  EXPECT_GT(missed, 10u);
  EXPECT_GT(added_by_tapers, 10u);
  EXPECT_GT(added_by_branches, 10u);
}

// What does not taper or branch would have dials that change nothing. Beside a mesh neighbours do
// not count.
TEST(Settings, LeaveOutWhatThereIs) {
  const auto has = [](const Scene& scene, const std::string& dial) {
    const std::vector<Setting> settings = settingsOf(scene, judge(scene, kAll, kSilent));
    return std::any_of(settings.begin(), settings.end(),
                       [&](const Setting& setting) { return setting.dial == dial; });
  };
  const FiberPolylines plain = tangle(4, 4, 0.05, 8);
  EXPECT_FALSE(has({plain, plain}, "tapers") || has({plain, plain}, "branches"));
  const FiberPolylines tree = taperedTree(1);
  Scene with_mesh = {tree, tree}, step = {tree, {}, {}, {tree}};
  with_mesh.meshes.push_back(waves(4));
  EXPECT_TRUE(has(with_mesh, "tapers") && !has(with_mesh, "branches"));
  EXPECT_TRUE(has(step, "tapers") && has(step, "branches"));
  for (const Scene* const scene : {&with_mesh, &step}) {
    const Verdict verdict = judge(*scene, kAll, kSilent);
    for (const Setting& setting : settingsOf(*scene, verdict)) {
      if (setting.dial == "neighbours" || setting.dial == "roots" || setting.dial == "mesh") {
        continue;
      }
      const std::unique_ptr<Trial> trial = setting.make();
      Deadline deadline(1e9);
      trial->frame(deadline);
      const Outcome outcome = compare(*scene, verdict, setting, trial->found());
      EXPECT_TRUE(outcome.missed == 0 || setting.value == "left out, mean radii" ||
                  setting.dial == "step")
          << setting.name();
    }
  }
}

// Where thin fibers are beside thick ones, the default would leave out contacts of the thin ones.
TEST(Settings, TheDefaultMissesNothingWhereRadiiDiffer) {
  Scene scene;
  // A thick fiber that is straight, and a thin one that turns back: between its first and its last
  // segment lie 0.29, which is more than half a circle of thin radii and less than one of thick
  // ones.
  for (int i = 0; i <= 5; ++i) scene.fibers.points.push_back({0.1 * i, 5, 0});
  for (const auto& [x, y] :
       {std::pair(0.0, 0.0), {0.1, 0.0}, {0.2, 0.0}, {0.2, 0.09}, {0.1, 0.09}, {0.0, 0.09}}) {
    scene.fibers.points.push_back({x, y, 0});
  }
  scene.fibers.point_begin = {0, 6, 12};
  for (int i = 0; i < 12; ++i) scene.fibers.radii.push_back(i < 6 ? 0.1 : 0.05);
  scene.before = scene.fibers;
  const Verdict verdict = judge(scene, kAll, kSilent);
  ASSERT_TRUE(verdict.has_pairs_along);
  EXPECT_THAT(pairsOf(verdict.contacts), testing::Contains(Pair{6, 10}));
  const Setting setting = settingsOf(scene, verdict).front();
  const std::unique_ptr<Trial> trial = setting.make();
  Deadline deadline(1e9);
  trial->frame(deadline);
  EXPECT_EQ(compare(scene, verdict, setting, trial->found()).missed, 0u);
}

Row row(double times, std::size_t missed, std::size_t wrong) {
  Outcome outcome;
  outcome.times = outcome.seconds = times;
  outcome.contacts = outcome.judged = 1000;
  outcome.missed = missed;
  outcome.wrong = wrong;
  outcome.missed_share = outcome.most_missed = static_cast<double>(missed) / 1000;
  outcome.false_share = outcome.most_false = static_cast<double>(wrong) / 1000;
  return {"dial", "value", "", "", outcome};
}

// A sample would be taken for all pairs, of which more may be missed or false.
TEST(Front, AsksForTheBoundsOfASample) {
  Row doubtful = row(1, 10, 10);
  doubtful.outcome.most_missed = doubtful.outcome.most_false = 0.06;
  const std::vector<Row> rows = {doubtful};
  EXPECT_EQ(choose(rows, {0.05, 0.07, {}}), nullptr);
  EXPECT_EQ(choose(rows, {0.07, 0.05, {}}), nullptr);
  EXPECT_EQ(choose(rows, {0.07, 0.07, {}}), &rows.front());
}

// A slower setting that misses more would be recommended.
TEST(Front, HasWhatNothingBeats) {
  std::vector<Row> rows = {row(1, 0, 0),    row(0.98, 0, 0),  row(0.5, 10, 0),
                           row(0.6, 10, 5), row(0.3, 0, 500), row(2, 0, 0)};
  rows.push_back(row(0.01, 0, 0));
  rows.back().outcome.is_ended = true;
  markFront(rows);
  std::vector<bool> on_front;
  for (const Row& each : rows) on_front.push_back(each.is_on_front);
  EXPECT_THAT(on_front, testing::ElementsAre(true, false, true, false, true, false, false));
  // Each is as fast as the next one to 5 %, but not all are as fast as the fastest.
  std::vector<Row> chain = {row(1.08, 0, 0), row(1.04, 0, 0), row(1, 0, 0)};
  markFront(chain);
  EXPECT_TRUE(chain[1].is_on_front && !chain[0].is_on_front && !chain[2].is_on_front);
  EXPECT_EQ(choose(rows, {}), &rows[0]);
  EXPECT_EQ(choose(rows, {0.01, 0, {}}), &rows[2]);
  EXPECT_EQ(choose(rows, {0, 0.5, {}}), &rows[4]);
  EXPECT_EQ(choose(rows, {0.01, 0, 0.4}), nullptr);
}

}  // namespace
}  // namespace fcl_fibers::tools::trade
