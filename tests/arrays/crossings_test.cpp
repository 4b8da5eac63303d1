// SPDX-License-Identifier: BSD-3-Clause
// What may be true of fibers, all at once: they taper, they branch, they are closed, they have
// groups. docs/crossings.md names these tests. Truth is brute force over all segments, with the
// distances of tests/support/cone_oracle.h and the ways along a graph of all points.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <ostream>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/live_pairs.h>

#include "arrays/meshes.h"
#include "geometry/moving_segment.h"
#include "support/cone_oracle.h"
#include "support/exact_geometry.h"
#include "support/random.h"
#include "support/segments.h"

namespace fcl_fibers {
namespace {

using geometry::Segment;
using geometry::Vec3d;
using test::Random;
using test::Real;
using Numbers = std::pair<std::int32_t, std::int32_t>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Distances this near to contact are nobody's to decide; no pair here is.
constexpr double kDoubt = 1e-10;

struct Kind {
  bool tapers, branches, are_closed;
};
std::ostream& operator<<(std::ostream& out, const Kind& kind) {
  return out << (kind.tapers ? "tapers " : "") << (kind.branches ? "branches " : "")
             << (kind.are_closed ? "closed" : "");
}
std::string nameOf(const testing::TestParamInfo<Kind>& info) {
  const auto [tapers, branches, are_closed] = info.param;
  const std::string name = std::string(tapers ? "Tapered" : "") + (branches ? "Branched" : "") +
                           (are_closed ? "Closed" : "");
  return name.empty() ? "Plain" : name;
}

/// Fibers that wander about a cube, of which some start and end at points of earlier ones.
class Fibers {
 public:
  Fibers(std::uint64_t seed, const Kind& kind, int count = 14) : random_(seed), kind_(kind) {
    for (int f = 0; f < count; ++f) addFiber(f);
    findWays();
  }

  FiberArrays<double> view() const {
    FiberArrays<double> arrays{&points_[0].x, points_.size(), begin_.data(), begin_.size() - 1,
                               radii_.data()};
    using Radii = FiberArrays<double>::Radii;
    arrays.radii_are = kind_.tapers ? Radii::kPerPoint : Radii::kPerFirstPoint;
    arrays.groups = groups_.data();
    if (kind_.are_closed) arrays.closed = closed_.data();
    if (kind_.branches) {
      arrays.starts_at = starts_at_.data();
      arrays.ends_at = ends_at_.data();
    }
    return arrays;
  }

  /// Moves all points and radii by up to a length, and keeps together what is one point.
  void move(double length) {
    for (Vec3d& p : points_) p = p + geometry::fromEigen(random_.inCube(length));
    for (double& radius : radii_)
      radius = std::max(0.001, radius + random_.between(-0.3, 0.3) * length);
    for (std::size_t f = 0; f + 1 < begin_.size(); ++f) join(f);
  }

  const std::vector<std::int32_t>& segments() const { return segments_; }
  Segment segment(std::int32_t first) const {
    const auto i = static_cast<std::size_t>(first);
    return Segment::cone(points_[i], points_[i + 1], radii_[i], radii_[kind_.tapers ? i + 1 : i]);
  }
  std::int32_t groupOf(std::int32_t segment) const { return groups_[fiberOf(segment)]; }

  /// Whether a rule leaves the two out: by numbers, or by the length between them.
  bool areNeighbors(std::int32_t a, std::int32_t b, int reach, double length) const {
    return leastWay(hops_, a, b) + 1 <= reach || (length > 0 && leastWay(ways_, a, b) <= length);
  }

 private:
  using Ways = std::vector<std::vector<double>>;

  void addFiber(int f) {
    const std::size_t first = points_.size();
    const std::size_t count = 5 + random_.below(5);
    const auto anyPoint = [&] {
      const bool is_linked = kind_.branches && f > 0 && random_.below(3) != 0;
      return is_linked ? static_cast<std::int32_t>(random_.below(first)) : -1;
    };
    const std::int32_t start = anyPoint();
    const bool is_closed = kind_.are_closed && start < 0 && f % 2 == 1;
    std::int32_t end = is_closed ? -1 : anyPoint();
    starts_at_.push_back(start);
    ends_at_.push_back(random_.below(2) == 0 ? end : -1);
    closed_.push_back(is_closed ? 1 : 0);
    groups_.push_back(f % 5 == 0 ? 1 : 0);
    Vec3d p = start < 0 ? geometry::fromEigen(random_.inCube(0.45)) : points_[std::size_t(start)];
    Vec3d way = geometry::fromEigen(random_.direction());
    for (std::size_t i = 0; i < count; ++i) {
      points_.push_back(p);
      radii_.push_back(0.07 * random_.between(0.1, 1.9));
      way = way + 0.7 * geometry::fromEigen(random_.direction());
      p = p + (random_.between(0.1, 0.3) / norm(way)) * way;
    }
    begin_.push_back(points_.size());
    for (std::size_t i = first; i + 1 < points_.size(); ++i) {
      segments_.push_back(static_cast<std::int32_t>(i));
    }
    join(static_cast<std::size_t>(f));
  }

  void join(std::size_t f) {
    const std::size_t first = begin_[f], last = begin_[f + 1] - 1;
    if (starts_at_[f] >= 0) points_[first] = points_[std::size_t(starts_at_[f])];
    if (ends_at_[f] >= 0) points_[last] = points_[std::size_t(ends_at_[f])];
    if (closed_[f] != 0) points_[last] = points_[first];
  }

  std::size_t fiberOf(std::int32_t point) const {
    const auto next = std::upper_bound(begin_.begin(), begin_.end(), std::size_t(point));
    return static_cast<std::size_t>(next - begin_.begin()) - 1;
  }

  /// Floyd and Warshall's shortest ways between all points, of which some are one.
  void findWays() {
    const std::size_t n = points_.size();
    hops_ = ways_ = Ways(n, std::vector<double>(n, kInfinity));
    const auto connect = [&](std::size_t i, std::size_t j, double hops, double length) {
      hops_[i][j] = hops_[j][i] = std::min(hops_[i][j], hops);
      ways_[i][j] = ways_[j][i] = std::min(ways_[i][j], length);
    };
    for (std::size_t i = 0; i < n; ++i) connect(i, i, 0, 0);
    for (const std::int32_t s : segments_) {
      const auto i = static_cast<std::size_t>(s);
      connect(i, i + 1, 1, norm(points_[i + 1] - points_[i]));
    }
    for (std::size_t f = 0; f + 1 < begin_.size(); ++f) {
      const std::size_t first = begin_[f], last = begin_[f + 1] - 1;
      if (starts_at_[f] >= 0) connect(first, std::size_t(starts_at_[f]), 0, 0);
      if (ends_at_[f] >= 0) connect(last, std::size_t(ends_at_[f]), 0, 0);
      if (closed_[f] != 0) connect(first, last, 0, 0);
    }
    for (Ways* ways : {&hops_, &ways_}) {
      for (std::size_t k = 0; k < n; ++k) {
        for (std::size_t i = 0; i < n; ++i) {
          for (std::size_t j = 0; j < n; ++j) {
            (*ways)[i][j] = std::min((*ways)[i][j], (*ways)[i][k] + (*ways)[k][j]);
          }
        }
      }
    }
  }
  static double leastWay(const Ways& ways, std::int32_t a, std::int32_t b) {
    const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
    return std::min({ways[i][j], ways[i + 1][j], ways[i][j + 1], ways[i + 1][j + 1]});
  }

  Random random_;
  Kind kind_;
  std::vector<Vec3d> points_;
  std::vector<std::size_t> begin_ = {0};
  std::vector<double> radii_;
  std::vector<std::int32_t> starts_at_, ends_at_, groups_, segments_;
  std::vector<std::uint8_t> closed_;
  Ways hops_, ways_;
};
static_assert(sizeof(Vec3d) == 3 * sizeof(double));

/// The distance of two segments; above `most` a lower bound.
double distanceOf(const Segment& p, const Segment& q, double most = kInfinity) {
  const auto around = static_cast<double>(geometry::capsuleDistance(p, q));
  const bool is_plain = !p.isTapered() && !q.isTapered();
  return is_plain || around > most ? around : static_cast<double>(test::coneDistance(p, q));
}

/// The distance of a segment and a convex set, of which the distance of a point is given.
template <class OfPoint>
double distanceTo(const Segment& p, const OfPoint& ofPoint) {
  return static_cast<double>(test::leastOfConvex([&](Real s) {
    const test::Point a = geometry::toPoint(p.a), b = geometry::toPoint(p.b);
    return ofPoint(test::Point((1 - s) * a + s * b)) -
           ((1 - s) * Real(p.radiusAtA()) + s * Real(p.radiusAtB()));
  }));
}

std::set<Numbers> touchingPairs(const Fibers& fibers, const FiberTreeOptions& options) {
  std::set<Numbers> pairs;
  for (const std::int32_t a : fibers.segments()) {
    for (const std::int32_t b : fibers.segments()) {
      const bool is_left_out =
          (fibers.groupOf(a) != 0 && fibers.groupOf(a) == fibers.groupOf(b)) ||
          fibers.areNeighbors(a, b, options.ignored_neighbors, options.ignored_arc_length);
      if (a >= b || is_left_out) continue;
      const double gap =
          distanceOf(fibers.segment(a), fibers.segment(b), options.margin) - options.margin;
      EXPECT_GT(std::fabs(gap), kDoubt) << "another seed will do";
      if (gap <= 0) pairs.emplace(a, b);
    }
  }
  return pairs;
}

/// The pairs of a question, each of which has to come once.
template <class Question, class Partner>
std::set<Numbers> found(const FiberTree& tree, const Question& question, const Partner& partner) {
  std::set<Numbers> pairs;
  tree.visit(question, partner, [&](const auto& one) {
    Numbers pair;
    if constexpr (std::is_same_v<std::decay_t<decltype(one)>, SegmentPair>) {
      pair = {one.a, one.b};
    } else {
      pair = {one.segment, one.triangle};
    }
    EXPECT_TRUE(pairs.insert(pair).second) << "repeated: " << pair.first << ", " << pair.second;
  });
  return pairs;
}

using Volumes = FiberTreeOptions::Volumes;

/// All volumes and topologies.
std::vector<FiberTreeOptions> allTrees(double margin = 0) {
  std::vector<FiberTreeOptions> all;
  for (const Volumes volumes : {Volumes::kLayeredBoxes, Volumes::kWrappedSpheres}) {
    for (const Topology topology : {Topology::kBundle, Topology::kSuperThread}) {
      FiberTreeOptions& options = all.emplace_back();
      options.volumes = volumes;
      options.topology = topology;
      options.margin = margin;
    }
  }
  return all;
}

/// All volumes and topologies with each rule about neighbours.
std::vector<FiberTreeOptions> allOptions() {
  std::vector<FiberTreeOptions> all;
  for (FiberTreeOptions options : allTrees()) {
    for (const auto& [reach, length] :
         {std::pair{1, 0.0}, {0, 0.0}, {3, 0.0}, {0, 0.35}, {2, 0.6}}) {
      options.ignored_neighbors = reach;
      options.ignored_arc_length = length;
      options.margin = length > 0 ? 0.02 : 0;
      options.threads = reach > 1 ? 2 : 1;
      all.push_back(options);
    }
  }
  return all;
}

class Crossings : public testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(Of, Crossings,
                         testing::Values(Kind{false, false, false}, Kind{true, false, false},
                                         Kind{false, true, false}, Kind{false, false, true},
                                         Kind{true, true, false}, Kind{true, false, true},
                                         Kind{false, true, true}, Kind{true, true, true}),
                         nameOf);

TEST_P(Crossings, Pairs) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Fibers fibers(seed, GetParam());
    std::map<std::array<double, 3>, std::set<Numbers>> truth;
    for (const FiberTreeOptions& options : allOptions()) {
      FiberTree tree(options);
      tree.build(fibers.view());
      auto& expected =
          truth[{double(options.ignored_neighbors), options.ignored_arc_length, options.margin}];
      if (expected.empty()) expected = touchingPairs(fibers, options);
      EXPECT_GT(expected.size(), 10u);
      EXPECT_EQ(found(tree, Pairs{}, tree), expected) << GetParam() << ", seed " << seed;
    }
  }
}

TEST_P(Crossings, Updates) {
  Fibers fibers(4, GetParam());
  for (const FiberTreeOptions& options : allOptions()) {
    FiberTree tree(options);
    Fibers moved = fibers;
    tree.build(moved.view());
    for (int step = 0; step < 3; ++step) {
      moved.move(0.03);
      tree.update(moved.view());
      EXPECT_EQ(found(tree, Pairs{}, tree), touchingPairs(moved, options)) << GetParam();
    }
  }
}

TEST_P(Crossings, ContactsAndNearest) {
  const Fibers fibers(5, GetParam());
  FiberTree tree;
  tree.build(fibers.view());
  // Of what is 32 eps of lengths below 4, and as much for the oracle.
  constexpr double kError = 64 * 4 * std::numeric_limits<double>::epsilon();
  std::size_t contacts = 0;
  tree.visit(Contacts{fibers.view()}, [&](const Contact& contact) {
    const Segment p = fibers.segment(contact.pair.a), q = fibers.segment(contact.pair.b);
    EXPECT_NEAR(contact.distance, distanceOf(p, q), kError);
    // A motion of q by the depth along the normal separates the two.
    const Vec3d normal{contact.normal[0], contact.normal[1], contact.normal[2]};
    const Vec3d way = -contact.distance * normal;
    Segment away = q;
    away.a = q.a + way, away.b = q.b + way;
    EXPECT_GE(distanceOf(p, away), -kError);
    ++contacts;
  });
  EXPECT_GT(contacts, 10u);
  std::map<std::int32_t, std::int32_t> nearest;
  tree.visit(Nearest{kInfinity}, [&](SegmentPair pair) { nearest[pair.a] = pair.b; });
  for (const std::int32_t a : fibers.segments()) {
    double least = kInfinity;
    for (const std::int32_t b : fibers.segments()) {
      const bool is_left_out = (fibers.groupOf(a) != 0 && fibers.groupOf(a) == fibers.groupOf(b)) ||
                               a == b || fibers.areNeighbors(a, b, 1, 0);
      if (is_left_out) continue;
      least = std::min(least, distanceOf(fibers.segment(a), fibers.segment(b), least));
    }
    ASSERT_EQ(nearest.count(a), 1u);
    EXPECT_NEAR(distanceOf(fibers.segment(a), fibers.segment(nearest[a])), least, kError);
  }
}

TEST_P(Crossings, TwoTrees) {
  const Fibers fibers(6, GetParam());
  for (const Kind& kind : {Kind{false, false, false}, Kind{true, true, true}}) {
    const Fibers others(7, kind);
    for (const FiberTreeOptions& options : allOptions()) {
      FiberTree tree(options), other(options);
      tree.build(fibers.view());
      other.build(others.view());
      std::set<Numbers> expected;
      for (const std::int32_t a : fibers.segments()) {
        for (const std::int32_t b : others.segments()) {
          const double gap =
              distanceOf(fibers.segment(a), others.segment(b), options.margin) - options.margin;
          EXPECT_GT(std::fabs(gap), kDoubt);
          if (gap <= 0) expected.emplace(a, b);
        }
      }
      EXPECT_GT(expected.size(), 0u);
      EXPECT_EQ(found(tree, Pairs{}, other), expected) << GetParam() << " and " << kind;
    }
  }
}

TEST_P(Crossings, Meshes) {
  const Fibers fibers(8, GetParam());
  const auto soup = test::soup<double>(9, 150, 0.8);
  const TriangleMesh mesh(soup.view());
  for (const double margin : {0.0, 0.03}) {
    std::set<Numbers> expected;
    for (const std::int32_t a : fibers.segments()) {
      for (std::size_t t = 0; t < soup.count(); ++t) {
        const test::ExactTriangle triangle = soup.triangle(t, mesh.pose());
        const double gap = distanceTo(fibers.segment(a),
                                      [&](const test::Point& x) {
                                        return test::segmentTriangleDistance(x, x, triangle);
                                      }) -
                           margin;
        EXPECT_GT(std::fabs(gap), kDoubt);
        if (gap <= 0) expected.emplace(a, static_cast<std::int32_t>(t));
      }
    }
    EXPECT_GT(expected.size(), 10u);
    for (const FiberTreeOptions& options : allTrees(margin)) {
      FiberTree tree(options);
      tree.build(fibers.view());
      EXPECT_EQ(found(tree, Pairs{}, mesh), expected) << GetParam();
    }
  }
}

TEST_P(Crossings, Shapes) {
  const Fibers fibers(10, GetParam());
  const auto expectSegments = [&](const Shape& shape, const auto& ofPoint) {
    std::set<std::int32_t> expected;
    for (const std::int32_t a : fibers.segments()) {
      const double gap = distanceTo(fibers.segment(a), ofPoint);
      EXPECT_GT(std::fabs(gap), kDoubt);
      if (gap <= 0) expected.insert(a);
    }
    EXPECT_GT(expected.size(), 3u);
    for (const FiberTreeOptions& options : allTrees()) {
      FiberTree tree(options);
      tree.build(fibers.view());
      std::set<std::int32_t> found;
      tree.visit(Pairs{}, shape, [&](std::int32_t a) { EXPECT_TRUE(found.insert(a).second); });
      EXPECT_EQ(found, expected) << GetParam() << ", shape " << shape.index();
    }
  };
  const test::Point center(0.1L, 0.2L, 0.1L), end(0.5L, -0.3L, 0.2L);
  expectSegments(SphereShape{{0.1, 0.2, 0.1}, 0.3}, [&](const test::Point& x) {
    return (x - center.cast<Real>()).norm() - Real(0.3);
  });
  expectSegments(BoxShape{{-0.3, -0.2, 0}, {0.1, 0.4, 0.2}}, [](const test::Point& x) {
    const test::ExactBox box{test::Point(-0.3, -0.2, 0), test::Point(0.1, 0.4, 0.2)};
    return test::segmentBoxDistance(x, x, box);
  });
  expectSegments(HalfSpaceShape{{0, 0.6, 0.8}, -0.1}, [](const test::Point& x) {
    return Real(0.6) * x[1] + Real(0.8) * x[2] + Real(0.1);
  });
  expectSegments(CapsuleShape{{0.1, 0.2, 0.1}, {0.5, -0.3, 0.2}, 0.1}, [&](const test::Point& x) {
    return test::pointSegmentDistance(x, center, end) - Real(0.1);
  });
}

/// Segments between the start and the end of a step.
Segment between(const Segment& start, const Segment& end, double time) {
  return geometry::at(geometry::MovingSegment{start, end}, time);
}

/// Expects a time of impact to be one of contact, and no sample before it to touch.
/// @param times  of pairs, by key
template <class Key, class GapAt>
void expectFirstTouch(const std::map<Key, double>& times, const Key& key, int samples,
                      const GapAt& gapAt) {
  const auto impact = times.find(key);
  const bool is_found = impact != times.end();
  if (is_found) {
    EXPECT_LE(gapAt(impact->second), 1e-9) << "neither so early nor at all";
  }
  for (int i = 0; i <= samples; ++i) {
    const double time = double(i) / samples;
    if (gapAt(time) > -kDoubt) continue;
    EXPECT_TRUE(is_found && impact->second <= time)
        << testing::PrintToString(key) << " at " << time;
    break;
  }
}

TEST_P(Crossings, Motion) {
  const Fibers start(11, GetParam());
  Fibers end = start;
  end.move(0.1);
  FiberTree tree;
  tree.build(start.view());
  tree.update(start.view(), end.view());
  std::map<Numbers, double> times;
  tree.visit(Impacts{}, [&](const Impact& impact) {
    EXPECT_TRUE(times.emplace(Numbers{impact.pair.a, impact.pair.b}, impact.time).second);
  });
  const std::set<Numbers> may_touch = found(tree, MovingPairs{}, tree);
  for (const std::int32_t a : start.segments()) {
    for (const std::int32_t b : start.segments()) {
      const bool is_left_out = (start.groupOf(a) != 0 && start.groupOf(a) == start.groupOf(b)) ||
                               a >= b || start.areNeighbors(a, b, 1, 0);
      if (is_left_out) continue;
      const auto gapAt = [&](double time) {
        return distanceOf(between(start.segment(a), end.segment(a), time),
                          between(start.segment(b), end.segment(b), time), 1e-9);
      };
      expectFirstTouch(times, Numbers{a, b}, 32, gapAt);
    }
  }
  double first = 1;
  for (const auto& [pair, time] : times) {
    EXPECT_EQ(may_touch.count(pair), 1u);
    if (time > 0) first = std::min(first, time);
  }
  EXPECT_GT(times.size(), 10u);
  EXPECT_LE(tree.safeStep(), first);
}

TEST_P(Crossings, MeshesInMotion) {
  const Fibers start(12, GetParam());
  Fibers end = start;
  end.move(0.1);
  const auto soup = test::soup<double>(13, 40, 0.8);
  MeshStep step{TriangleMesh(soup.view()), TriangleMesh(soup.view())};
  step.end.setPose({{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.05, -0.1, 0.02}});
  FiberTree tree;
  tree.build(start.view());
  tree.update(start.view(), end.view());
  std::map<Numbers, double> times;
  tree.visit(Impacts{}, step, [&](const MeshImpact& impact) {
    times[{impact.pair.segment, impact.pair.triangle}] = impact.time;
  });
  for (const std::int32_t a : start.segments()) {
    for (std::size_t t = 0; t < soup.count(); ++t) {
      const auto gapAt = [&](double time) {
        MeshPose pose;
        for (std::size_t k = 0; k < 3; ++k) pose.position[k] = time * step.end.pose().position[k];
        const test::ExactTriangle triangle = soup.triangle(t, pose);
        const Segment p = between(start.segment(a), end.segment(a), time);
        const Real around = test::segmentTriangleDistance(geometry::toPoint(p.a),
                                                          geometry::toPoint(p.b), triangle) -
                            Real(p.radius);
        return around > 1e-9 ? static_cast<double>(around)
                             : distanceTo(p, [&](const test::Point& x) {
                                 return test::segmentTriangleDistance(x, x, triangle);
                               });
      };
      expectFirstTouch(times, Numbers{a, static_cast<std::int32_t>(t)}, 12, gapAt);
    }
  }
  EXPECT_GT(times.size(), 5u);
}

TEST_P(Crossings, ShapesInMotion) {
  const Fibers start(15, GetParam());
  Fibers end = start;
  end.move(0.2);
  FiberTree tree;
  tree.build(start.view());
  tree.update(start.view(), end.view());
  const auto expectImpacts = [&](const Shape& shape, const auto& ofPoint) {
    std::map<std::int32_t, double> times;
    tree.visit(Impacts{}, shape, [&](const ShapeImpact& impact) {
      EXPECT_TRUE(times.emplace(impact.segment, impact.time).second);
    });
    EXPECT_GT(times.size(), 3u);
    for (const std::int32_t a : start.segments()) {
      const auto gapAt = [&](double time) {
        return distanceTo(between(start.segment(a), end.segment(a), time), ofPoint);
      };
      expectFirstTouch(times, a, 32, gapAt);
    }
  };
  expectImpacts(SphereShape{{0.1, 0.2, 0.1}, 0.5}, [](const test::Point& x) {
    return (x - test::Point(0.1L, 0.2L, 0.1L)).norm() - Real(0.5);
  });
  expectImpacts(HalfSpaceShape{{0, 0.6, 0.8}, -0.2}, [](const test::Point& x) {
    return Real(0.6) * x[1] + Real(0.8) * x[2] + Real(0.2);
  });
}

TEST_P(Crossings, WrappedSpheresHaveNeitherStepsNorLists) {
  const Fibers fibers(16, GetParam());
  FiberTreeOptions options;
  options.volumes = Volumes::kWrappedSpheres;
  FiberTree tree(options);
  tree.build(fibers.view());
  const auto refusal = [](const std::string& text) {
    return testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(text));
  };
  EXPECT_THAT([&] { tree.update(fibers.view(), fibers.view()); },
              refusal("wrapped spheres have no motion"));
  EXPECT_THAT([&] { LivePairs<> live(tree); },
              refusal("a tree has wrapped spheres; construct it with Volumes::kLayeredBoxes"));
}

TEST_P(Crossings, LivePairs) {
  Fibers fibers(14, GetParam());
  for (const double skin : {-1.0, 0.05}) {
    for (const FiberTreeOptions& options : allOptions()) {
      if (options.volumes != Volumes::kLayeredBoxes) continue;
      FiberTree tree(options);
      tree.build(fibers.view());
      LivePairsOptions live_options;
      live_options.skin = skin;
      LivePairs<> live(tree, live_options);
      Fibers moved = fibers;
      for (int step = 0; step < 6; ++step) {
        moved.move(0.004);
        tree.update(moved.view());
        live.update();
        std::set<Numbers> pairs;
        live.visit([&](SegmentPair pair, std::int32_t) {
          EXPECT_TRUE(pairs.emplace(pair.a, pair.b).second);
        });
        EXPECT_EQ(pairs, touchingPairs(moved, options)) << GetParam() << ", step " << step;
      }
    }
  }
}

}  // namespace
}  // namespace fcl_fibers
