// SPDX-License-Identifier: BSD-3-Clause
//
// How faces are cut, against winding numbers and areas that are computed without error.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/io/mesh_file.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <boost/multiprecision/cpp_int.hpp>

#include "io/obj_text.h"
#include "support/random.h"

namespace fcl_fibers::io {
namespace {

using Rational = boost::multiprecision::cpp_rational;
using test::Random;
using testing::HasSubstr;

/// Of a plane. Number is a whole number that holds all products, or Rational.
template <typename Number>
using Place = std::array<Number, 2>;
template <typename Number>
using Outline = std::vector<Place<Number>>;

using Whole = std::int64_t;
using Grid = Outline<Whole>;

template <typename Number>
Number twiceArea(const Place<Number>& a, const Place<Number>& b, const Place<Number>& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

template <typename Number>
int side(const Place<Number>& a, const Place<Number>& b, const Place<Number>& c) {
  const Number area = twiceArea(a, b, c);
  return (area > 0) - (area < 0);
}

template <typename Number>
Number twiceArea(const Outline<Number>& outline) {
  Number area = 0;
  for (std::size_t i = 1; i + 1 < outline.size(); ++i) {
    area += twiceArea(outline[0], outline[i], outline[i + 1]);
  }
  return area;
}

/// How many times the outline runs around a point that is not on it.
template <typename Number>
int windings(const Outline<Number>& outline, const Place<Number>& point) {
  int count = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Place<Number>&p = outline[i], &q = outline[(i + 1) % outline.size()];
    if (p[1] <= point[1] && q[1] > point[1] && side(p, q, point) > 0) ++count;
    if (q[1] <= point[1] && p[1] > point[1] && side(p, q, point) < 0) --count;
  }
  return count;
}

template <typename Number>
bool isOnSegment(const Place<Number>& p, const Place<Number>& q, const Place<Number>& point) {
  return side(p, q, point) == 0 && std::min(p[0], q[0]) <= point[0] &&
         point[0] <= std::max(p[0], q[0]) && std::min(p[1], q[1]) <= point[1] &&
         point[1] <= std::max(p[1], q[1]);
}

/// Whether two edges cross between their ends.
template <typename Number>
bool hasCrossing(const Outline<Number>& outline) {
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Place<Number>&p = outline[i], &q = outline[(i + 1) % n];
    for (std::size_t k = i + 1; k < n; ++k) {
      const Place<Number>&r = outline[k], &s = outline[(k + 1) % n];
      if (side(p, q, r) * side(p, q, s) < 0 && side(r, s, p) * side(r, s, q) < 0) return true;
    }
  }
  return false;
}

/// Whether edges meet where they follow one another, and nowhere else.
template <typename Number>
bool isSimple(const Outline<Number>& outline) {
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) {
      if (k != i && k != (i + 1) % n && isOnSegment(outline[i], outline[(i + 1) % n], outline[k])) {
        return false;
      }
    }
  }
  return !hasCrossing(outline);
}

using Triangles = std::vector<std::array<std::size_t, 3>>;

/// As indices of corners; nothing if the face is refused.
std::optional<Triangles> cut(const std::vector<Point>& corners) {
  try {
    const MeshFile mesh = parseMesh(objText(corners), "a face");
    EXPECT_EQ(mesh.points, corners);
    Triangles triangles;
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
      std::array<std::size_t, 3>& triangle = triangles.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        triangle[k] = static_cast<std::size_t>(mesh.triangles[i + k]);
      }
    }
    return triangles;
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("a face', line "));
    EXPECT_THAT(error.what(), HasSubstr("the face crosses itself; "));
    return std::nullopt;
  }
}

/// Where a whole place of the plane is in space.
struct Plane {
  Point origin, x, y;

  std::vector<Point> inSpace(const Grid& outline) const {
    std::vector<Point> points;
    for (const auto& [u, v] : outline) {
      Point& point = points.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        point[k] = origin[k] + static_cast<double>(u) * x[k] + static_cast<double>(v) * y[k];
      }
    }
    return points;
  }
};

constexpr Plane kFlat = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};

/// Points for which no outline has a corner or an edge, as theirs are multiples of kUnit.
constexpr Whole kUnit = 840;

Place<Whole> sampleIn(Random& random, Whole low, Whole high) {
  const auto between = [&](Whole odd) {
    const auto steps = static_cast<std::size_t>((high - low) * 40);
    return low * kUnit + static_cast<Whole>(random.below(steps)) * (kUnit / 40) + odd;
  };
  const Whole x = between(1);
  return {x, between(2)};
}

bool isOnAnEdge(const Grid& outline, const Place<Whole>& point) {
  for (std::size_t i = 0; i < outline.size(); ++i) {
    if (isOnSegment(outline[i], outline[(i + 1) % outline.size()], point)) return true;
  }
  return false;
}

/// That the triangles cover once what the outline surrounds, and nothing else, in its direction.
/// Returns how many have no area.
std::size_t expectCover(const Grid& outline, const Triangles& triangles, Random& random,
                        Whole reach, int samples) {
  EXPECT_EQ(triangles.size() + 2, outline.size());
  const Whole area = twiceArea(outline);
  const int direction = area < 0 ? -1 : 1;
  Whole sum = 0;
  std::size_t flat = 0;
  for (const auto& [a, b, c] : triangles) {
    const Whole part = twiceArea(outline[a], outline[b], outline[c]);
    EXPECT_GE(direction * part, 0);
    sum += part;
    flat += part == 0 ? 1U : 0U;
  }
  EXPECT_EQ(sum, area);
  for (int i = 0; i < samples; ++i) {
    const Place<Whole> point = sampleIn(random, -reach, reach);
    if (isOnAnEdge(outline, point)) continue;
    int covering = 0, edges = 0;
    for (const auto& [a, b, c] : triangles) {
      const Grid triangle = {outline[a], outline[b], outline[c]};
      edges += isOnAnEdge(triangle, point) ? 1 : 0;
      covering += std::abs(windings(triangle, point));
    }
    if (edges > 0) continue;
    EXPECT_EQ(covering, direction * windings(outline, point));
    EXPECT_LE(covering, 1);
  }
  return flat;
}

Grid rotated(Grid outline, std::size_t start) {
  std::rotate(outline.begin(), outline.begin() + static_cast<std::ptrdiff_t>(start), outline.end());
  return outline;
}

Grid reversed(Grid outline) {
  std::reverse(outline.begin(), outline.end());
  return outline;
}

const Plane kPlanes[] = {kFlat,
                         {{3, -7, 11}, {0, 2, 0}, {0, 0, 5}},
                         {{1e6, 2e6, -3e6}, {0, 0, 1}, {1, 0, 0}},
                         {{8, 1, 2}, {1, 2, 3}, {-3, 1, 1}},
                         {{0, 0, 0}, {1, 1, 0}, {0, 0, 1}}};

/// From all corners on, in both directions, in several planes. Returns the largest number of
/// triangles without area.
std::size_t expectCut(const Grid& outline, Random& random, Whole reach, int samples = 20) {
  std::size_t flat = 0;
  for (std::size_t start = 0; start < outline.size(); ++start) {
    const Plane& plane = kPlanes[start % std::size(kPlanes)];
    for (const Grid& turned : {rotated(outline, start), reversed(rotated(outline, start))}) {
      const std::vector<Point> corners = plane.inSpace(turned);
      const std::optional<Triangles> triangles = cut(corners);
      if (!triangles) {
        ADD_FAILURE() << "refused:\n" << objText(corners);
        return 0;
      }
      flat = std::max(flat, expectCover(turned, *triangles, random, reach, samples));
      if (testing::Test::HasFailure()) {
        ADD_FAILURE() << objText(corners);
        return 0;
      }
    }
  }
  return flat;
}

Grid inUnits(Grid outline) {
  for (Place<Whole>& place : outline) place = {kUnit * place[0], kUnit * place[1]};
  return outline;
}

/// Of corners around the origin, each of another direction from it.
Grid star(Random& random, std::size_t corners, Whole reach) {
  for (;;) {
    Grid outline;
    for (std::size_t i = 0; i < corners; ++i) {
      const auto coordinate = [&] {
        return static_cast<Whole>(random.below(static_cast<std::size_t>(2 * reach + 1))) - reach;
      };
      const Whole x = coordinate();
      outline.push_back({x, coordinate()});
    }
    const auto angle = [](const Place<Whole>& p) {
      return std::atan2(static_cast<double>(p[1]), static_cast<double>(p[0]));
    };
    std::sort(outline.begin(), outline.end(),
              [&](const auto& p, const auto& q) { return angle(p) < angle(q); });
    if (isSimple(outline) && twiceArea(outline) > 0) return outline;
  }
}

/// Whether three edges lie on one another. @pre corners are on a grid of 3 x 3
bool isPassedThrice(const Grid& outline) {
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Place<Whole>&p = outline[i], &q = outline[(i + 1) % outline.size()];
    for (const Whole quarters : {1, 3}) {
      const Place<Whole> point = {p[0] + (q[0] - p[0]) / 4 * quarters,
                                  p[1] + (q[1] - p[1]) / 4 * quarters};
      int edges = 0;
      for (std::size_t k = 0; k < outline.size(); ++k) {
        edges += isOnSegment(outline[k], outline[(k + 1) % outline.size()], point) ? 1 : 0;
      }
      if (p != q && edges > 2) return true;
    }
  }
  return false;
}

TEST(Polygon, AnyShapeOfFewCornersOnAGrid) {
  // If this fails, a face is cut over its notch, or one that crosses itself is accepted, or one
  // that does not is refused.
  Random random(1);
  std::size_t simple = 0, touching = 0, crossing = 0;
  const auto check = [&](const Grid& outline) {
    SCOPED_TRACE(objText(kFlat.inSpace(outline)));
    const std::optional<Triangles> triangles = cut(kFlat.inSpace(outline));
    const int direction = twiceArea(outline) < 0 ? -1 : 1;
    bool is_once = true;
    for (Whole x = 0; x < 2 * kUnit && is_once; x += kUnit / 8) {
      for (Whole y = 0; y < 2 * kUnit && is_once; y += kUnit / 8) {
        const Place<Whole> point = {x + 11, y + 23};
        if (isOnAnEdge(outline, point)) continue;
        const int around = direction * windings(outline, point);
        is_once = around == 0 || around == 1;
      }
    }
    const bool is_simple = isSimple(outline);
    (is_simple ? simple : is_once ? touching : crossing) += 1;
    if (triangles) {
      EXPECT_TRUE(is_once);
      if (triangles->size() + 2 != outline.size()) return;  // it goes round twice
      const std::size_t flat = expectCover(outline, *triangles, random, 2, 4);
      EXPECT_TRUE(flat == 0 || !is_simple);
    } else {
      EXPECT_TRUE(!is_once || hasCrossing(outline) || isPassedThrice(outline));
    }
  };
  const auto checkCode = [&](std::size_t code, std::size_t corners) {
    Grid outline;
    for (std::size_t i = 0; i < corners; ++i, code /= 9) {
      outline.push_back({static_cast<Whole>(code % 3), static_cast<Whole>(code / 3 % 3)});
    }
    check(inUnits(outline));
    return !HasFailure();
  };
  for (std::size_t code = 0; code < 9 * 9 * 9 * 9; ++code) ASSERT_TRUE(checkCode(code, 4));
  for (const std::size_t corners : {5U, 6U, 7U, 8U, 9U}) {
    for (int i = 0; i < 5000; ++i) {
      ASSERT_TRUE(checkCode(static_cast<std::size_t>(random.unit() * 0x1p52), corners));
    }
  }
  EXPECT_GT(simple, 1000U);
  EXPECT_GT(touching, 10000U);
  EXPECT_GT(crossing, 10000U);
}

/// With a corner in the middle of each edge, and some corners repeated. @pre the numbers are even
Grid withMoreCorners(Random& random, const Grid& outline, bool repeats) {
  Grid more;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Place<Whole>&p = outline[i], &q = outline[(i + 1) % outline.size()];
    more.push_back(p);
    if (repeats && random.below(3) == 0) more.push_back(p);
    more.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2});
  }
  return more;
}

/// Teeth of one width, of other heights.
Grid comb(Random& random, Whole teeth) {
  Grid outline = {{2 * teeth, -1}, {2 * teeth, 0}};
  for (Whole tooth = teeth; tooth-- > 0;) {
    const Whole height = 1 + static_cast<Whole>(random.below(9));
    outline.insert(outline.end(), {{2 * tooth + 1, height}, {2 * tooth, 0}});
  }
  outline.push_back({0, -1});
  return outline;
}

/// A band that winds around the origin.
Grid spiral(Whole rounds) {
  Grid outer, inner;
  for (Whole i = 1; i <= rounds; ++i) {
    const Whole r = 3 * i;
    outer.insert(outer.end(), {{r, -r + 3}, {r, r}, {-r, r}, {-r, -r}});
    inner.insert(inner.end(), {{r - 1, 4 - r}, {r - 1, r - 1}, {1 - r, r - 1}, {1 - r, 1 - r}});
  }
  outer.insert(outer.end(), inner.rbegin(), inner.rend());
  return outer;
}

TEST(Polygon, ConcaveShapesAreCutWithinThem) {
  // If this fails, a fiber in a notch of a face touches it, or one that passes the face does not.
  Random random(2);
  for (int i = 0; i < 60; ++i) {
    const Grid outline = star(random, 4 + random.below(12), 6);
    EXPECT_EQ(expectCut(inUnits(outline), random, 6), 0U);
    EXPECT_EQ(expectCut(withMoreCorners(random, inUnits(outline), false), random, 6), 0U);
    expectCut(withMoreCorners(random, inUnits(outline), true), random, 6);
    ASSERT_FALSE(HasFailure());
  }
  for (const Whole size : {1, 2, 5}) {
    EXPECT_EQ(expectCut(inUnits(comb(random, 3 * size)), random, 10), 0U);
    EXPECT_EQ(expectCut(inUnits(spiral(size)), random, 3 * size), 0U);
  }
}

/// A frame of which a bridge leads to each hole, from the left side or from the hole before.
Grid withHoles(Random& random, std::size_t holes, bool in_a_row) {
  const Whole height = in_a_row ? 12 : 12 * static_cast<Whole>(holes);
  const Whole width = in_a_row ? 12 * static_cast<Whole>(holes) : 12;
  Grid outline = {{0, 0}, {width, 0}, {width, height}, {0, height}};
  Grid back;
  for (std::size_t i = 0; i < holes; ++i) {
    const Whole step = 12 * static_cast<Whole>(i);
    const Place<Whole> middle =
        in_a_row ? Place<Whole>{step + 6, 6} : Place<Whole>{6, height - step - 6};
    Grid hole = reversed(star(random, 3 + random.below(6), 5));
    for (auto& place : hole) place = {middle[0] + place[0], middle[1] + place[1]};
    // A bridge from the left arrives at the leftmost corner.
    const auto first = std::min_element(hole.begin(), hole.end());
    std::rotate(hole.begin(), first, hole.end());
    const Place<Whole> entry = hole.front();
    hole.push_back(entry);
    if (in_a_row) {
      // To the right the next bridge leaves from the rightmost corner.
      const auto last = std::max_element(hole.begin(), hole.end());
      if (i == 0) outline.push_back({0, entry[1]});
      if (i == 0) back.push_back({0, entry[1]});
      outline.insert(outline.end(), hole.begin(), last + 1);
      // The last corner of the row is passed once.
      back.insert(back.end(), hole.rbegin(),
                  std::make_reverse_iterator(i + 1 == holes ? last + 1 : last));
    } else {
      outline.push_back({0, entry[1]});
      outline.insert(outline.end(), hole.begin(), hole.end());
      outline.push_back({0, entry[1]});
    }
  }
  outline.insert(outline.end(), back.rbegin(), back.rend());
  return outline;
}

TEST(Polygon, HolesBehindBridgesStayOpen) {
  // If this fails, a doorway is closed, or a wall with windows is refused.
  Random random(3);
  for (int i = 0; i < 4; ++i) {
    for (const std::size_t holes : {1U, 2U, 4U}) {
      const Grid outline = withHoles(random, holes, false);
      EXPECT_EQ(expectCut(inUnits(outline), random, 12 * static_cast<Whole>(holes)), 0U);
      expectCut(withMoreCorners(random, inUnits(outline), true), random, 50);
      const Grid row = withHoles(random, holes, true);
      EXPECT_EQ(expectCut(inUnits(row), random, 12 * static_cast<Whole>(holes)), 0U);
      ASSERT_FALSE(HasFailure());
    }
  }
}

const Grid kTouching[] = {
    {{0, 0}, {2, 0}, {2, 2}, {0, 0}, {-2, 2}, {-2, 0}},               // at a corner
    {{-4, 0}, {4, 0}, {4, 4}, {0, 0}, {-4, 4}},                       // at an edge
    {{-4, -4}, {4, -4}, {4, 4}, {0, -4}, {-1, 0}, {0, -4}, {-4, 4}},  // with a slit
    {{-4, -4}, {4, -4}, {4, 4}, {-4, 4}, {-4, 0}, {0, 1}, {-4, 0}},   // with a slit inside
    {{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {-4, -4}},               // with a line outside
    {{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 3}, {3, 1}},         // with a hole at a corner
    // Two squares, and a line between them, straight and bent.
    {{0, 0}, {2, 0}, {2, 2}, {0, 2}, {0, 0}, {-2, 0}, {-4, 0}, {-4, -2}, {-2, -2}, {-2, 0}},
    {{0, 0},
     {2, 0},
     {2, 2},
     {0, 2},
     {0, 0},
     {-1, 3},
     {-3, 0},
     {-4, 0},
     {-4, -2},
     {-2, -2},
     {-3, 0},
     {-1, 3}}};

const Grid kCrossing[] = {
    {{0, 0}, {1, 1}, {1, 0}, {0, 1}},  // a bow tie without an area
    {{0, 0}, {3, 3}, {3, 0}, {0, 1}},  // and with one
    {{0, 0}, {2, 0}, {0, 2}, {0, 0}, {-2, 0}, {0, -2}, {0, 0}, {2, -2}, {2, -4}, {-4, 2}},
    {{0, 3}, {-2, -3}, {3, 1}, {-3, 1}, {2, -3}},  // a pentagram
    {{2, 0}, {1, 1}, {1, 0}, {2, 1}, {0, 1}},      // all of its turns are to the left
    {{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 1}, {3, 1}, {3, 3}, {1, 3}, {1, 1}},
    // A band over its own start.
    {{0, 0},
     {5, 0},
     {5, 5},
     {1, 5},
     {1, 2},
     {8, 2},
     {8, 3},
     {2, 3},
     {2, 4},
     {4, 4},
     {4, 1},
     {0, 1}}};

TEST(Polygon, WhatTouchesItselfIsNoCrossing) {
  // If this fails, faces are refused that surround nothing twice.
  Random random(4);
  for (const Grid& outline : kTouching) expectCut(inUnits(outline), random, 5);
}

TEST(Polygon, WhatCrossesItselfIsRefused) {
  // If this fails, a face covers what is outside of it.
  for (const Grid& outline : kCrossing) {
    for (std::size_t start = 0; start < outline.size(); ++start) {
      for (const Plane& plane : kPlanes) {
        const Grid turned = rotated(inUnits(outline), start);
        EXPECT_FALSE(cut(plane.inSpace(turned))) << objText(plane.inSpace(turned));
        EXPECT_FALSE(cut(plane.inSpace(reversed(turned))));
      }
    }
  }
}

/// Anywhere in space, as a program writes it that rounds to six decimals.
std::vector<Point> written(Random& random, const Grid& outline) {
  const Eigen::Matrix3d turn = random.rotation().toRotationMatrix();
  const Eigen::Vector3d shift = random.inCube(1000);
  std::vector<Point> corners;
  for (const auto& [x, y] : outline) {
    const Eigen::Vector3d place =
        shift + turn * Eigen::Vector3d(static_cast<double>(x), static_cast<double>(y), 0) / kUnit;
    Point& corner = corners.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      corner[k] = std::round(place[static_cast<Eigen::Index>(k)] * 1e6) / 1e6;
    }
  }
  return corners;
}

TEST(Polygon, RoundedCornersChangeNothing) {
  // If this fails, a face that touches itself is refused because a file's decimals make it cross
  // itself, or one that crosses itself is accepted as rounded.
  Random random(8);
  const auto expect = [&](const Grid& outline, Whole reach) {
    for (int i = 0; i < 20; ++i) {
      const std::vector<Point> corners = written(random, outline);
      const std::optional<Triangles> triangles = cut(corners);
      ASSERT_TRUE(triangles) << objText(corners);
      expectCover(outline, *triangles, random, reach, 10);
      ASSERT_FALSE(HasFailure()) << objText(corners);
    }
  };
  for (const Grid& outline : kTouching) {
    expect(inUnits(outline), 5);
    expect(withMoreCorners(random, inUnits(outline), true), 5);
  }
  for (int i = 0; i < 5; ++i) {
    expect(withMoreCorners(random, inUnits(star(random, 8, 6)), true), 6);
    expect(withMoreCorners(random, inUnits(withHoles(random, 2, true)), true), 12);
  }
  expect(inUnits({{0, 0}, {1, 1}, {3, 3}, {2, 2}}), 4);
  for (const Grid& outline : kCrossing) {
    for (int i = 0; i < 20; ++i) {
      const std::vector<Point> corners = written(random, inUnits(outline));
      EXPECT_FALSE(cut(corners)) << objText(corners);
    }
  }
}

TEST(Polygon, AQuadrangleMayBeTwisted) {
  // If this fails, a mesh is refused for a face that crosses itself from nowhere but one side.
  Random random(9);
  for (int i = 0; i < 1000; ++i) {
    std::vector<Point> corners;
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector3d corner = random.inCube(1);
      corners.push_back({corner[0], corner[1], corner[2]});
    }
    // Few of these are flatter than a thousandth of their size.
    const auto edge = [&](std::size_t k) {
      return Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(corners[k].data()) -
                             Eigen::Map<const Eigen::Vector3d>(corners[0].data()));
    };
    if (std::fabs(edge(1).cross(edge(2)).dot(edge(3))) < 0.05) continue;
    const std::optional<Triangles> triangles = cut(corners);
    ASSERT_TRUE(triangles) << objText(corners);
    EXPECT_EQ(triangles->size(), 2U);
  }
}

TEST(Polygon, WhatGoesRoundSeveralTimesCountsOnce) {
  // If this fails, a face that a program has repeated is refused, or makes a solid leak.
  std::string text = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 1 0.5 0\nf";
  for (int i = 0; i < 200; ++i) text += " 1 5 2 3 4";
  const MeshFile mesh = parseMesh(text, "a face");
  EXPECT_EQ(mesh.triangles.size(), 9U);
  EXPECT_EQ(parseMesh("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 1 2 3", "").triangles.size(), 3U);
}

TEST(Polygon, LinesAndPointsBecomeTrianglesThere) {
  // If this fails, a file with a face without an area is refused, or the face covers something.
  const auto expect = [](const Grid& outline) {
    for (const Plane& plane : kPlanes) {
      const std::optional<Triangles> triangles = cut(plane.inSpace(outline));
      ASSERT_TRUE(triangles) << objText(plane.inSpace(outline));
      EXPECT_EQ(triangles->size() + 2, outline.size());
    }
  };
  expect({{1, 2}, {1, 2}, {1, 2}, {1, 2}, {1, 2}});
  expect({{0, 0}, {3, 3}, {1, 1}, {2, 2}, {5, 5}, {4, 4}});
  expect({{0, 0}, {1, 0}, {0, 0}, {1, 0}});
  expect({{0, 0}, {1, 0}, {1, 1}, {1, 0}});  // there and back
  // On a line but for rounding.
  const std::vector<Point> line = {
      {0, 0, 0}, {.1, .2, .3}, {.3, .6, .9}, {.2, .4, .6}, {.4, .8, 1.2}};
  EXPECT_TRUE(cut(line));
}

Outline<Rational> exactOutline(const std::vector<Point>& corners, std::size_t axis) {
  Outline<Rational> outline;
  for (const Point& corner : corners) {
    outline.push_back({Rational(corner[(axis + 1) % 3]), Rational(corner[(axis + 2) % 3])});
  }
  return outline;
}

/// Where the projection along z is simple, that triangles run as it does, and are its area. That is
/// enough for them to cover it once.
void expectExact(const std::vector<Point>& corners) {
  const Outline<Rational> outline = exactOutline(corners, 2);
  if (!isSimple(outline)) return;
  SCOPED_TRACE(objText(corners));
  const std::optional<Triangles> triangles = cut(corners);
  ASSERT_TRUE(triangles);
  ASSERT_EQ(triangles->size() + 2, corners.size());
  const Rational area = twiceArea(outline);
  Rational sum = 0;
  for (const auto& [a, b, c] : *triangles) {
    const Rational part = twiceArea(outline[a], outline[b], outline[c]);
    EXPECT_TRUE(area < 0 ? part < 0 : part > 0);
    sum += part;
  }
  EXPECT_TRUE(sum == area);
}

TEST(Polygon, TheLastBitOfACoordinateDecides) {
  // If this fails, corners beside an edge are taken for the other side of it, and a face is cut
  // across its outline, or refused. The line from (12, 12) to (24, 24) passes the points near
  // (0.5, 0.5), on which rounding fails: Kettner et al., Classroom examples of robustness problems
  // in geometric computations, 2008.
  Random random(5);
  const auto near = [&] { return 0.5 + 0x1p-53 * static_cast<double>(random.below(20)); };
  for (int i = 0; i < 2000; ++i) {
    std::vector<Point> corners = {{12, 12, 0}, {24, 24, 0}};
    for (std::size_t k = 0; k < 2 + random.below(3); ++k) {
      const double x = near();
      corners.push_back({x, near(), 0});
    }
    random.shuffle(corners);
    expectExact(corners);
    ASSERT_FALSE(HasFailure());
  }
}

TEST(Polygon, CoordinatesOfAnySize) {
  // If this fails, products overflow or vanish, and large or small faces are cut over a notch.
  Random random(6);
  const int exponents[] = {0, 900, 1010, -900, -1030, -1060};
  for (int i = 0; i < 300; ++i) {
    const int ex = exponents[random.below(6)], ey = exponents[random.below(6)];
    const double offset = random.below(2) == 0 ? 0 : std::ldexp(random.unit(), ex);
    std::vector<Point> corners;
    for (const auto& [x, y] : star(random, 4 + random.below(6), 8)) {
      corners.push_back({std::ldexp(static_cast<double>(x), ex) + offset,
                         std::ldexp(static_cast<double>(y), ey), offset});
    }
    expectExact(corners);
    ASSERT_FALSE(HasFailure());
  }
}

TEST(Polygon, AFaceThatIsNotFlatIsCutAsItLooksAlongItsNormal) {
  // If this fails, a face of a scan is refused because its corners are rounded, or triangles of it
  // are turned over.
  Random random(7);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Matrix3d turn = random.rotation().toRotationMatrix();
    const double warp = random.below(2) == 0 ? 1e-6 : 0.2;
    std::vector<Point> corners;
    for (const auto& [x, y] : star(random, 5 + random.below(8), 100)) {
      const Eigen::Vector3d place =
          turn *
          Eigen::Vector3d(static_cast<double>(x), static_cast<double>(y), warp * random.unit());
      corners.push_back({place[0], place[1], place[2]});
    }
    std::array<Rational, 3> areas;
    std::size_t axis = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      areas[k] = twiceArea(exactOutline(corners, k));
      if (abs(areas[k]) > abs(areas[axis])) axis = k;
    }
    const Outline<Rational> outline = exactOutline(corners, axis);
    if (!isSimple(outline)) continue;
    const std::optional<Triangles> triangles = cut(corners);
    ASSERT_TRUE(triangles) << objText(corners);
    EXPECT_EQ(triangles->size() + 2, corners.size());
    for (const auto& [a, b, c] : *triangles) {
      ASSERT_TRUE(areas[axis] * twiceArea(outline[a], outline[b], outline[c]) > 0)
          << objText(corners);
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::io
