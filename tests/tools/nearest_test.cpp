// SPDX-License-Identifier: BSD-3-Clause
#include "tools/nearest.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/least_of_convex.h"
#include "support/random.h"

namespace fcl_fibers::tools {
namespace {

using test::Random;
using test::Real;

/// Fibers that wander, some of one point, some closed, some straight; their radii may differ.
FiberPolylines wanderers(Random& random) {
  FiberPolylines scene;
  const std::size_t fibers = 1 + random.below(5);
  const bool radii_differ = random.below(2) == 0;
  scene.radius = random.below(3) == 0 ? 0 : random.between(0, 0.3);
  for (std::size_t f = 0; f < fibers; ++f) {
    const std::size_t points = 1 + random.below(40), first = scene.points.size();
    const double turning = random.below(3) == 0 ? 0 : random.between(0, 2);
    Eigen::Vector3d at = random.inCube(4), way = random.direction();
    for (std::size_t i = 0; i < points; ++i) {
      scene.points.push_back({at.x(), at.y(), at.z()});
      way = (way + turning * random.direction()).normalized();
      at += way * (random.below(8) == 0 ? 0 : random.between(0.2, 1));
    }
    const bool closed = points > 3 && random.below(3) == 0;
    if (closed) scene.points.push_back(scene.points[first]);
    scene.closed.push_back(closed ? 1 : 0);
    scene.point_begin.push_back(scene.points.size());
  }
  for (std::size_t i = 0; radii_differ && i < scene.points.size(); ++i) {
    scene.radii.push_back(random.between(0, 0.5));
  }
  return scene;
}

test::Point at(const FiberPolylines& scene, std::size_t point) {
  const Point& p = scene.points[point];
  return {p[0], p[1], p[2]};
}

/// Length of the fiber from one point to a later one.
Real along(const FiberPolylines& scene, std::size_t from, std::size_t to) {
  Real length = 0;
  for (std::size_t i = from; i < to; ++i) length += (at(scene, i + 1) - at(scene, i)).norm();
  return length;
}

/// What findNearest() promises, pair by pair; infinity if no pair counts.
Real leastDistance(const FiberPolylines& scene, const FiberPolylines* other,
                   const FiberOptions& neighbors) {
  Real least = std::numeric_limits<Real>::infinity();
  const FiberPolylines& with = other == nullptr ? scene : *other;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1] - 1;
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t g = other == nullptr ? f : 0; g < with.fiberCount(); ++g) {
        const bool one_fiber = other == nullptr && f == g;
        for (std::size_t j = one_fiber ? i + 1 : with.point_begin[g];
             j + 1 < with.point_begin[g + 1]; ++j) {
          const Real axes =
              test::segmentDistance(at(scene, i), at(scene, i + 1), at(with, j), at(with, j + 1));
          if (one_fiber) {
            std::size_t apart = j - i;
            Real between = along(scene, i + 1, j);
            if (scene.isClosed(f)) {
              apart = std::min(apart, end - begin - apart);
              between = std::min(between, along(scene, begin, i) + along(scene, j + 1, end));
            }
            if (apart <= static_cast<std::size_t>(neighbors.ignored_neighbors)) continue;
            if (between <= neighbors.ignored_arc_length) continue;
            if (between <= std::acos(Real(-1)) / 2 * axes) continue;
          }
          least = std::min(least, axes - scene.radiusAt(i) - with.radiusAt(j));
        }
      }
    }
  }
  return least;
}

TEST(Nearest, AgreesWithBruteForce) {
  int none = 0, of_one_fiber = 0, of_two = 0;
  for (std::uint64_t seed = 0; seed < 250; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const FiberPolylines scene = wanderers(random), second = wanderers(random);
    FiberOptions neighbors;
    if (random.below(2) == 0) neighbors.ignored_neighbors = static_cast<int>(random.below(8));
    if (random.below(4) == 0) neighbors.ignored_neighbors = std::numeric_limits<int>::max();
    if (random.below(3) == 0) neighbors.ignored_arc_length = random.between(0, 5);
    for (const FiberPolylines* other : {static_cast<const FiberPolylines*>(nullptr), &second}) {
      const std::optional<Contact> found = findNearest(scene, other, neighbors);
      const Real least = leastDistance(scene, other, neighbors);
      ASSERT_EQ(found.has_value(), std::isfinite(least));
      if (!found) {
        ++none;
        continue;
      }
      // 32 eps of distance, lengths and radii, which are below 50.
      EXPECT_NEAR(found->distance, static_cast<double>(least), 1e-12);
      ++(other == nullptr && found->a.fiber == found->b.fiber ? of_one_fiber : of_two);
    }
  }
  EXPECT_GT(none, 20);
  EXPECT_GT(of_one_fiber, 50);
  EXPECT_GT(of_two, 100);
}

/// Fibers that start and end at points of others, some closed; they taper or have one radius.
FiberPolylines tree(Random& random) {
  FiberPolylines scene;
  const std::size_t fibers = 2 + random.below(5);
  const bool tapers = random.below(2) == 0, has_loops = random.below(2) == 0;
  scene.radius = random.between(0, 0.1);
  for (std::size_t f = 0; f < fibers; ++f) {
    const std::size_t points = 2 + random.below(6), first = scene.points.size();
    const auto any = [&](bool is_joined) {
      return f == 0 || !is_joined ? -1 : static_cast<std::int32_t>(random.below(first));
    };
    scene.starts_at.push_back(any(random.below(4) > 0));
    const bool closed = points > 3 && random.below(4) == 0;
    scene.ends_at.push_back(any(has_loops && !closed && random.below(3) == 0));
    for (std::size_t i = 0; i < points; ++i) {
      const Eigen::Vector3d at = random.inCube(2);
      scene.points.push_back({at.x(), at.y(), at.z()});
    }
    const auto repeat = [&](std::int32_t from, std::size_t to) {
      if (from >= 0) scene.points[to] = scene.points[static_cast<std::size_t>(from)];
    };
    repeat(scene.starts_at.back(), first);
    repeat(scene.ends_at.back(), scene.points.size() - 1);
    if (closed) scene.points.push_back(scene.points[first]);
    scene.closed.push_back(closed ? 1 : 0);
    scene.point_begin.push_back(scene.points.size());
  }
  for (std::size_t i = 0; tapers && i < scene.points.size(); ++i) {
    scene.radii.push_back(random.between(0, 0.2));
    scene.radii_are = FiberArrays<double>::Radii::kPerPoint;
  }
  return scene;
}

/// A neuron would touch itself wherever it branches, and a fiber across a branch would count.
TEST(Nearest, AgreesWithBruteForceAcrossBranches) {
  int found_any = 0, none = 0;
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const FiberPolylines scene = tree(random);
    FiberOptions neighbors;
    neighbors.ignored_neighbors = static_cast<int>(random.below(4));
    neighbors.ignored_arc_length = random.below(2) == 0 ? 0 : random.between(0, 3);
    // The shortest ways between all points, by length and by number of segments (Floyd, Warshall).
    const std::size_t count = scene.points.size();
    const Real far = std::numeric_limits<Real>::infinity();
    std::vector<std::vector<Real>> lengths(count, std::vector<Real>(count, far)), numbers = lengths;
    const auto join = [&](std::size_t i, std::size_t j, Real length, Real number) {
      lengths[i][j] = lengths[j][i] = std::min(length, lengths[i][j]);
      numbers[i][j] = numbers[j][i] = std::min(number, numbers[i][j]);
    };
    std::vector<std::size_t> segments;
    for (std::size_t i = 0; i < count; ++i) join(i, i, 0, 0);
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      const std::size_t first = scene.point_begin[f], last = scene.point_begin[f + 1] - 1;
      for (std::size_t i = first; i < last; ++i) {
        join(i, i + 1, (at(scene, i + 1) - at(scene, i)).norm(), 1);
        segments.push_back(i);
      }
      const auto at_other = [](std::int32_t place) { return static_cast<std::size_t>(place); };
      if (scene.starts_at[f] >= 0) join(first, at_other(scene.starts_at[f]), 0, 0);
      if (scene.ends_at[f] >= 0) join(last, at_other(scene.ends_at[f]), 0, 0);
      if (scene.isClosed(f)) join(first, last, 0, 0);
    }
    for (auto* ways : {&lengths, &numbers}) {
      for (std::size_t k = 0; k < count; ++k) {
        for (std::size_t i = 0; i < count; ++i) {
          for (std::size_t j = 0; j < count; ++j) {
            (*ways)[i][j] = std::min((*ways)[i][j], (*ways)[i][k] + (*ways)[k][j]);
          }
        }
      }
    }
    // By the definition: the least distance of two balls.
    const auto distance = [&](std::size_t i, std::size_t j) {
      return test::leastOfConvex([&](Real s) {
        const test::Point x = (1 - s) * at(scene, i) + s * at(scene, i + 1);
        return test::leastOfConvex([&](Real t) {
          const test::Point y = (1 - t) * at(scene, j) + t * at(scene, j + 1);
          return (x - y).norm() - scene.radiusAt(i, static_cast<double>(s)) -
                 scene.radiusAt(j, static_cast<double>(t));
        });
      });
    };
    Real least = far;
    for (const std::size_t i : segments) {
      for (const std::size_t j : segments) {
        if (j <= i) continue;
        Real length = far, number = far;
        for (const std::size_t p : {i, i + 1}) {
          for (const std::size_t q : {j, j + 1}) {
            length = std::min(length, lengths[p][q]);
            number = std::min(number, numbers[p][q] + 1);
          }
        }
        const Real axes =
            test::segmentDistance(at(scene, i), at(scene, i + 1), at(scene, j), at(scene, j + 1));
        if (number <= neighbors.ignored_neighbors || length <= neighbors.ignored_arc_length ||
            length <= std::acos(Real(-1)) / 2 * axes) {
          continue;
        }
        // The capsules around both are no farther apart, and are measured at once.
        const Real capsules = axes - scene.radiusAt(i) - scene.radiusAt(j);
        if (capsules >= least) continue;
        least = scene.radii.empty() ? capsules : std::min<Real>(least, distance(i, j));
      }
    }
    const std::optional<Contact> found = findNearest(scene, nullptr, neighbors);
    ASSERT_EQ(found.has_value(), std::isfinite(least));
    ++(found ? found_any : none);
    if (found) {
      EXPECT_NEAR(found->distance, static_cast<double>(least), 1e-12);
    }
  }
  EXPECT_GT(found_any, 100);
  EXPECT_GT(none, 2);
}

/// Looking at each pair of segments would take an hour.
TEST(Nearest, OneLongFiber) {
  FiberPolylines scene;
  for (int i = 0; i < 200'000; ++i) scene.points.push_back({i * 0.1, 3 * std::sin(i * 0.01), 0});
  scene.point_begin.push_back(scene.points.size());
  scene.radius = 0.05;
  EXPECT_FALSE(findNearest(scene, nullptr, {}));
  scene.points.push_back({scene.points.back()[0], 1, 7});
  scene.points.push_back({0, 1, 7});
  scene.point_begin.back() += 2;
  const std::optional<Contact> found = findNearest(scene, nullptr, {});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->b.number, 200'000u);
  EXPECT_GT(found->distance, 6.9 - 1e-12);  // of z, less twice the radius
  EXPECT_LT(found->distance, 6.9001);       // points at y near 1 are less than 0.002 from it
}

}  // namespace
}  // namespace fcl_fibers::tools
