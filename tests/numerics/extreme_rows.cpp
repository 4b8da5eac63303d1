// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/extreme_rows.h"

#include <algorithm>
#include <cfenv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <type_traits>
#include <utility>

#include "numerics/row_fibers.h"
#include "numerics/specimen.h"
#include "numerics/tapered_rows.h"
#include "support/float_environment.h"
#include "support/random.h"

namespace fcl_fibers::test {
namespace {

using namespace row_fibers;

/// Pairs of capsules whose distance is that of contact plus `ulps`: side by side, end to end,
/// crossing, and two balls.
template <typename S>
Assembly<S> contact(int ulps) {
  Assembly<S> fibers;
  for (int i = 0; i < 40; ++i) {
    const double x = 16.0 * i;
    const double size = std::ldexp(1.0, i % 10 - 8);
    const S reach = static_cast<S>(3 * size);
    const double gap = static_cast<double>(neighbor(reach, ulps));
    const double a = size, b = 2 * size;
    // Along y, so that x rounds nothing.
    const Point low = {x, 0, 0}, high = {x + 1, 0, 0}, up = {0, gap, 0};
    switch (i % 4) {
      case 0:
        fibers.addCapsule(low, high, a);
        fibers.addCapsule(high + up, low + up, b);
        break;
      case 1:
        fibers.addCapsule(low, {x, -1, 0}, a);
        fibers.addCapsule(low + up, {x, 8, 0}, b);
        break;
      case 2:
        fibers.addCapsule(low, high, a);
        fibers.addCapsule(Point{x + 0.5, 0, -1} + up, Point{x + 0.5, 0, 1} + up, b);
        break;
      default:
        fibers.addBall(low, a);
        fibers.addBall(low + up, b);
    }
  }
  return fibers;
}

/// Radii, lengths and ways from the origin from 1e-12 to 1, each of any magnitude.
template <typename S>
Assembly<S> overDecades(std::uint64_t seed) {
  Random random(seed);
  Assembly<S> fibers;
  const auto magnitude = [&] { return std::pow(10.0, -random.between(0, 12)); };
  for (int i = 0; i < 300; ++i) {
    const Point a = magnitude() * toPoint(random.direction());
    const double length = magnitude();
    fibers.addCapsule(a, a + length * toPoint(random.direction()), 0.1 * magnitude());
  }
  return fibers;
}

/// Stacks along y, in which each segment is 1 from the next and 2 from the one after that, up to a
/// part of 1e-12. One radius is 1 and the next one tiny, so all these pairs are as near to contact.
/// Small numbers along z move them apart by so little, also in float.
template <typename S>
Assembly<S> stacksAtContact(std::uint64_t seed) {
  Random random(seed);
  Assembly<S> fibers;
  for (int stack = 0; stack < 6; ++stack) {
    for (int i = 0; i < 20; ++i) {
      const bool is_thin = i % 2 == 1;
      const Point a = {16.0 * stack, double(i), 1e-6 * random.between(-1, 1)};
      const Point ways[] = {{0, 0, 0}, {4, 0, 0}, {is_thin ? -4.0 : 4.0, 0, 0}};
      fibers.addCapsule(a, a + ways[stack % 3], is_thin ? 1e-12 * random.unit() : 1);
    }
  }
  return fibers;
}

/// Each has a point of its own numbers, or the middle of a segment, where all the others have it.
template <typename S>
Assembly<S> throughOnePoint(std::uint64_t seed) {
  Random random(seed);
  Assembly<S> fibers;
  const Point center = {3, -5, 7};
  for (int f = 0; f < 60; ++f) {
    Point way;
    for (double& x : way) x = static_cast<double>(random.below(33)) - 16;
    const double radius = f % 4 < 2 ? 0 : 0x1p-8;
    std::vector<Point> points = {center + -3 * way, center + -1 * way, center + way,
                                 center + 3 * way};
    if (f % 2 == 1) points.insert(points.begin() + 2, center);
    fibers.addFiber(points, radius);
  }
  return fibers;
}

/// Balls on a sphere of radius 15, all of whose centres have whole coordinates.
template <typename S>
Assembly<S> cosphericalBalls() {
  Assembly<S> fibers;
  for (int x = -15; x <= 15; ++x) {
    for (int y = -15; y <= 15; ++y) {
      for (int z = -15; z <= 15; ++z) {
        if (x * x + y * y + z * z != 225) continue;
        fibers.addBall({double(x), double(y), double(z)}, (x + y + z) % 2 == 0 ? 1 : 1.5);
      }
    }
  }
  return fibers;
}

template <typename S>
Assembly<S> coplanarBalls() {
  Assembly<S> fibers;
  for (int x = 0; x < 16; ++x) {
    for (int y = 0; y < 16; ++y) fibers.addBall({double(x), double(y), 3}, (x + y) % 3 * 0.5);
  }
  return fibers;
}

template <typename S>
Assembly<S> collinearBalls() {
  Assembly<S> fibers;
  for (int i = 0; i < 250; ++i) fibers.addBall({double(i), 2.0 * i, -2.0 * i}, i % 3 * 1.5);
  return fibers;
}

template <typename S>
Assembly<S> coincidentBalls(bool nested) {
  Assembly<S> fibers;
  for (int i = 0; i < 120; ++i) fibers.addBall({0.1, 0.2, 0.3}, nested ? std::ldexp(1.0, -i) : 1);
  return fibers;
}

/// All inside the first one, and tangent to it from inside.
template <typename S>
Assembly<S> internallyTangentBalls() {
  Assembly<S> fibers;
  fibers.addBall({0, 0, 0}, 64);
  for (int i = 0; i < 120; ++i) {
    const double radius = 1 + i % 32;
    Point center = {0, 0, 0};
    center[static_cast<std::size_t>(i % 3)] = (i % 2 == 0 ? 1 : -1) * (64 - radius);
    fibers.addBall(center, radius);
  }
  return fibers;
}

/// Each within the next one, on one line.
template <typename S>
Assembly<S> nested() {
  Assembly<S> fibers;
  for (int i = 0; i < 300; ++i) fibers.addCapsule({-1.0 - i, 0, 0}, {1.0 + i, 0, 0}, 0);
  return fibers;
}

template <typename S>
std::vector<ExtremeRow<S>> makeRows() {
  constexpr bool kDouble = std::is_same_v<S, double>;
  constexpr double kLeast = static_cast<double>(std::numeric_limits<S>::denorm_min());
  constexpr double kMost = static_cast<double>(std::numeric_limits<S>::max());
  constexpr double kHair = 1e-5;
  std::vector<ExtremeRow<S>> rows;
  const auto add = [&](std::string name, std::string what, Assembly<S> fibers, double margin = 0) {
    rows.push_back({std::move(name), std::move(what), std::move(fibers), margin});
  };

  add("OffsetNone", "a lock of hair of radius 1e-5 about the origin",
      lock<S>({0, 0, 0}, 1, kHair, 1));
  for (const int exponent : {3, 6, 9, 12, 15}) {
    const double far = std::pow(10.0, exponent);
    const std::string name = "1e" + std::to_string(exponent);
    const Point origin = {far, -far, far / 2};
    // What the lock has collapsed to beside hair of a size that S still resolves there.
    const double ulp = static_cast<double>(neighbor(static_cast<S>(far), 1)) - far;
    Assembly<S> beside = lattice<S>(std::max(kHair, 4 * ulp), 20, origin);
    std::fill(beside.radii.begin(), beside.radii.end(), S(kHair));
    add("Offset" + name, name + " from the origin, beside hair of a size that is resolved there",
        together<S>({lock<S>(origin, 1, kHair, 1), beside}));
  }
  for (const int third : {-3, -2, -1, 1, 2, 3}) {
    const std::string single = std::to_string(10 * third), both = std::to_string(50 * third);
    add(std::string("Scale") + (third < 0 ? "Minus" : "Plus") + std::to_string(std::abs(third)),
        "all lengths times 1e" + single + " in float, 1e" + both + " in double",
        lock<S>({0, 0, 0}, std::pow(10.0, third * (kDouble ? 50 : 10)), 1e-2, 2));
  }

  Assembly<S> points = together<S>({soup<S>(200, 0, 0.05, 1, 3), soup<S>(100, 0.3, 0.05, 1, 4)});
  add("ZeroLength", "segments of length zero among others", points);
  std::fill(points.radii.begin(), points.radii.end(), S(0));
  for (int i = 0; i < 100; ++i) {
    points.addBall(points.point(static_cast<std::size_t>(2 * i)), 0);
    points.addBall(points.point(static_cast<std::size_t>(401 + 2 * i)), 0);
  }
  add("ZeroLengthAndRadius", "points on points and at ends of segments, nothing thick", points);
  add("ZeroRadius", "segments without thickness, of whole coordinates", lattice<S>(1, 5));
  std::fill(rows.back().fibers.radii.begin(), rows.back().fibers.radii.end(), S(0));
  add("RadiusFarLarger", "radius 1e12 times the length", soup<S>(300, 1e-12, 1, 10, 6));
  add("RadiusFarSmaller", "radius 1e-12 of the length", lattice<S>(1, 8));
  std::fill(rows.back().fibers.radii.begin(), rows.back().fibers.radii.end(), S(1e-12));
  add("SizesFarApart", "segments 1e-12 as long as others",
      together<S>({soup<S>(150, 1e-12, 1e-13, 1e-11, 9), soup<S>(50, 1, 0.01, 1, 10)}));
  add("SizesOver12Decades", "radii and lengths from 1e-12 to 1, each by itself",
      overDecades<S>(21));

  for (const bool flush : {false, true}) {
    const std::string name = flush ? "FlushedToZero" : "";
    const std::string what = flush ? ", subnormals flushed to zero" : "";
    add("Subnormal" + name, "all numbers subnormal" + what, lattice<S>(kLeast, 11));
    rows.back().environment.flushes_to_zero = flush;
    add("SubnormalBesideNormal" + name, "subnormal capsules beside normal ones" + what,
        together<S>({lattice<S>(kLeast, 12), soup<S>(50, 1, 0.1, 1, 13)}));
    rows.back().environment.flushes_to_zero = flush;
  }
  add("NormalFlushedToZero", "a lock of hair, subnormals flushed to zero",
      lock<S>({0, 0, 0}, 1, 1e-2, 2));
  rows.back().environment.flushes_to_zero = true;
  add("NearOverflow", "coordinates up to 1/25 of the largest number",
      soup<S>(300, kMost / 64, kMost / 128, kMost / 16, 14));
  add("MarginNearOverflow", "a margin of half the largest double", lattice<S>(1, 15),
      std::numeric_limits<double>::max() / 2);
  add("Margin", "a margin of 1 between whole coordinates", lattice<S>(1, 15), 1);

  add("Contact", "distance exactly that of contact", contact<S>(0));
  add("ContactLess1Ulp", "one ulp less", contact<S>(-1));
  add("ContactPlus1Ulp", "one ulp more", contact<S>(1));
  add("ContactWithin1e12", "stacks of segments within 1e-12 of contact, on either side",
      stacksAtContact<S>(22));
  add("ContactOnLattice", "whole coordinates and radii", lattice<S>(1, 16));
  add("Crossings", "crossing at angles of 1 to 1e-12, and above each other", crossings<S>());
  add("Parallel", "parallel to the last bit", alongOneDirection<S>({3, -2, 1}, 1, 1, 0.5, 17));
  add("AntiParallel", "parallel and anti-parallel",
      alongOneDirection<S>({3, -2, 1}, -1, 1, 0.5, 18));
  add("Collinear", "on one line, without thickness",
      alongOneDirection<S>({3, -2, 1}, -1, 0, 0, 19));
  add("ThroughOnePoint", "all through one point, half of them without thickness",
      throughOnePoint<S>(23));
  add("Identical", "identical except for their sense and radius", identical<S>(300));
  add("Nested", "each within the next, on one line", nested<S>());
  add("BallsCospherical", "centres on one sphere", cosphericalBalls<S>());
  add("BallsCoplanar", "centres in one plane", coplanarBalls<S>());
  add("BallsCollinear", "centres on one line", collinearBalls<S>());
  add("BallsCoincident", "one ball many times", coincidentBalls<S>(false));
  add("BallsNested", "one centre, each ball half as large as the last", coincidentBalls<S>(true));
  add("BallsInternallyTangent", "tangent to a large ball from inside", internallyTangentBalls<S>());

  const std::pair<const char*, int> modes[] = {
      {"Up", FE_UPWARD}, {"Down", FE_DOWNWARD}, {"ToZero", FE_TOWARDZERO}};
  for (const auto& [mode, rounding] : modes) {
    add(std::string("Rounded") + mode,
        "hair, contact to the last bit and crossings, rounded " +
            std::string(rounding == FE_UPWARD     ? "up"
                        : rounding == FE_DOWNWARD ? "down"
                                                  : "to zero"),
        together<S>({lock<S>({9, 9, 9}, 1, 1e-2, 2), contact<S>(-1), contact<S>(0), contact<S>(1),
                     stacksAtContact<S>(24), crossings<S>()}));
    rows.back().environment.rounding = rounding;
  }

  // Last, as these rows have no objects.
  for (ExtremeRow<S>& row : taperedRows<S>()) rows.push_back(std::move(row));
  return rows;
}

using Volumes = FiberTreeOptions::Volumes;

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, share > 0 && share < 0.0005 ? "%.2g" : "%.1f", 100 * share);
  return text;
}

/// Segments, what touches, and the percentage of reported pairs that do not, of capsules, boxes and
/// spheres.
template <typename S>
std::string line(const ExtremeRow<S>& row, const std::string& scalar) {
  const Specimen<S> specimen(row.fibers, Form::kArrays);
  const std::vector<NumberPair> touching = touchingPairs(specimen.truth(), row.margin);
  std::string line = row.name + ',' + scalar + ',' + std::to_string(specimen.truth().size()) + ',' +
                     std::to_string(touching.size());
  for (const FiberTreeOptions& options : allKinds(row.margin)) {
    // What nodes hold leaves the pairs as they are.
    if (options.topology != Topology::kBundle) continue;
    if (options.report == Report::kCapsules && options.volumes != Volumes::kLayeredBoxes) continue;
    std::vector<NumberPair> pairs;
    {
      const ScopedFloatEnvironment scoped(row.environment);
      pairs = specimen.pairs(options);
    }
    const Findings findings = examine(specimen.truth(), touching, options, pairs);
    line += ',' + percent(findings.falseRate());
  }
  return line + ",\"" + row.what + "\"\n";
}

}  // namespace

template <typename S>
const std::vector<ExtremeRow<S>>& extremeRows() {
  static const std::vector<ExtremeRow<S>> rows = makeRows<S>();
  return rows;
}

std::size_t rowsOfObjects() {
  const auto& rows = extremeRows<double>();
  return static_cast<std::size_t>(
      std::count_if(rows.begin(), rows.end(), [](const auto& row) { return !row.isTapered(); }));
}

std::string rowsTable() {
  std::string table =
      "row,scalar,segments,touching,false_capsules,false_boxes,false_spheres,what\n";
  const auto& singles = extremeRows<float>();
  const auto& doubles = extremeRows<double>();
  for (std::size_t i = 0; i < doubles.size(); ++i) {
    table += line(singles[i], "float") + line(doubles[i], "double");
  }
  return table;
}

template const std::vector<ExtremeRow<float>>& extremeRows<float>();
template const std::vector<ExtremeRow<double>>& extremeRows<double>();

}  // namespace fcl_fibers::test
