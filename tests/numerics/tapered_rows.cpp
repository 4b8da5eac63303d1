// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/tapered_rows.h"

#include <algorithm>
#include <cfenv>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include "numerics/row_fibers.h"

namespace fcl_fibers::test {
namespace {

using namespace row_fibers;

/// The same fibers, each of which becomes thinner towards its tip, where nothing is left.
template <typename S>
Assembly<S> withTips(Assembly<S> fibers) {
  fibers.radii_are = Assembly<S>::Radii::kPerPoint;
  for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
    const std::size_t first = fibers.point_begin[f], tip = fibers.point_begin[f + 1] - 1;
    for (std::size_t i = first; i <= tip; ++i) {
      fibers.radii[i] *= static_cast<S>(tip - i) / static_cast<S>(tip - first);
    }
  }
  return fibers;
}

/// The same points, at each of which is one of the radii.
template <typename S>
Assembly<S> withRadii(Assembly<S> fibers, const std::vector<double>& radii, std::uint64_t seed) {
  Random random(seed);
  fibers.radii_are = Assembly<S>::Radii::kPerPoint;
  for (S& radius : fibers.radii) radius = static_cast<S>(radii[random.below(radii.size())]);
  return fibers;
}

template <typename S>
Assembly<S> noCones() {
  Assembly<S> fibers;
  fibers.radii_are = Assembly<S>::Radii::kPerPoint;
  return fibers;
}

/// As wide as long, one ulp less and more, and far wider, so that one ball holds the other one or
/// all but does. Lengths are whole along each of the directions.
template <typename S>
Assembly<S> wideCones(std::uint64_t seed) {
  Random random(seed);
  Assembly<S> fibers = noCones<S>();
  const std::pair<Point, double> ways[] = {{{0, 0, 0}, 0},  {{1, 0, 0}, 1},  {{0, -3, 4}, 5},
                                           {{2, -1, 2}, 3}, {{6, 2, -3}, 7}, {{-4, 7, 4}, 9}};
  for (int i = 0; i < 200; ++i) {
    Point a;
    for (double& x : a) x = static_cast<double>(random.below(64));
    const auto& [way, length] = ways[random.below(6)];
    const double least = static_cast<double>(random.below(3));
    const S whole = static_cast<S>(least + length);
    const double most[] = {static_cast<double>(whole),
                           std::fabs(static_cast<double>(neighbor(whole, -1))),
                           static_cast<double>(neighbor(whole, 1)), least + 1.5 * length};
    fibers.addCone(a, a + way, least, most[i % 4]);
    if (i % 2 == 0) std::swap(fibers.radii.end()[-1], fibers.radii.end()[-2]);
  }
  return fibers;
}

/// Radii, lengths and ways from the origin from 10^-decades to 1, each of any magnitude.
template <typename S>
Assembly<S> needlesAndBalls(double decades, std::uint64_t seed) {
  Random random(seed);
  Assembly<S> fibers = noCones<S>();
  const auto magnitude = [&] { return std::pow(10.0, -random.between(0, decades)); };
  for (int i = 0; i < 300; ++i) {
    const Point a = magnitude() * toPoint(random.direction());
    const double length = magnitude(), radius = 0.1 * magnitude();
    if (i % 3 == 0) {
      fibers.addBall(a, radius);
    } else {
      fibers.addCone(a, a + length * toPoint(random.direction()), i % 3 == 1 ? 0 : magnitude(),
                     radius);
    }
  }
  return fibers;
}

/// Pairs whose distance is that of contact plus `ulps`. Below the first of each is a plane that it
/// touches along a line, as its axis rises along y by as much as its radius grows.
template <typename S>
Assembly<S> conesInContact(int ulps) {
  Assembly<S> fibers = noCones<S>();
  for (int i = 0; i < 48; ++i) {
    const double x = 16.0 * i;
    const double size = std::ldexp(1.0, i / 6 % 8 - 6), half = size / 2;
    const S reach = static_cast<S>(3 * size);
    const double gap = static_cast<double>(neighbor(reach, ulps));
    const double a = size, b = 2 * size;
    const Point low = {x, -gap, 0};
    fibers.addCone({x - 1, 0, -1}, {x + 1, half, 1}, a, a + half);
    switch (i % 6) {
      case 0:  // crossing, both tapered
        fibers.addCone({x + 1, -gap - half, -1}, {x - 1, -gap, 1}, b + half, b);
        break;
      case 1:  // along each other
        fibers.addCone({x - 2, -gap, -2}, {x + 1, -gap - half, 1}, b, b + half);
        break;
      case 2:  // a capsule
        fibers.addCapsule({x - 1, -gap, 1}, {x + 1, -gap, -1}, b);
        break;
      case 3:
        fibers.addBall(low, b);
        break;
      case 4:  // end to end
        fibers.addCone({x, -8, 0}, low, half, b);
        break;
      default:  // a ball that all but holds the other one, and touches it where it touches the
                // first
        fibers.addCone(low, {x, -gap - half, 0}, b, b + half);
    }
  }
  return fibers;
}

/// Pairs that cross at angles of 10^-k, at no distance, at about that of contact, and beyond.
template <typename S>
Assembly<S> crossingCones(double from, double to) {
  Assembly<S> fibers = crossings<S>();
  fibers.radii_are = Assembly<S>::Radii::kPerPoint;
  for (std::size_t i = 0; i < fibers.radii.size(); ++i) {
    // Of a pair the one grows along y and the other one shrinks.
    fibers.radii[i] = static_cast<S>(0x1p-8 * (i % 4 == 0 || i % 4 == 3 ? from : to));
  }
  return fibers;
}

/// Fibers of whole coordinates that turn back onto themselves at each point.
template <typename S>
Assembly<S> hairpins(std::uint64_t seed) {
  Random random(seed);
  Assembly<S> fibers = noCones<S>();
  for (int f = 0; f < 25; ++f) {
    Point root, way;
    for (double& x : root) x = static_cast<double>(random.below(65));
    for (double& x : way) x = static_cast<double>(random.below(9)) - 4;
    for (int i = 0; i < 9; ++i) {
      const double end = i % 2 == 0 ? 0 : static_cast<double>(1 + random.below(4));
      fibers.addPoint(root + end * way, static_cast<double>(random.below(4)) / 2);
    }
    fibers.endFiber();
  }
  return fibers;
}

}  // namespace

template <typename S>
std::vector<ExtremeRow<S>> taperedRows() {
  constexpr bool kDouble = std::is_same_v<S, double>;
  constexpr double kLeast = static_cast<double>(std::numeric_limits<S>::denorm_min());
  constexpr double kMost = static_cast<double>(std::numeric_limits<S>::max());
  constexpr double kHair = 1e-5;
  const std::vector<double> whole = {0, 1, 2};
  std::vector<ExtremeRow<S>> rows;
  const auto add = [&](std::string name, std::string what, Assembly<S> fibers) -> ExtremeRow<S>& {
    rows.push_back({"Tapered" + name, std::move(what), std::move(fibers)});
    return rows.back();
  };
  add("", "a lock of hair that tapers from radius 1e-5 to 0",
      withTips(lock<S>({0, 0, 0}, 1, kHair, 1)));
  for (const int exponent : {6, 9, 12, 15}) {
    const double far = std::pow(10.0, exponent);
    const Point origin = {far, -far, far / 2};
    const double ulp = static_cast<double>(neighbor(static_cast<S>(far), 1)) - far;
    const double unit = std::max(kHair, 4 * ulp);
    add("Offset1e" + std::to_string(exponent),
        "1e" + std::to_string(exponent) +
            " from the origin, beside cones of a size that is "
            "resolved there",
        together<S>({withTips(lock<S>(origin, 1, kHair, 1)),
                     withRadii(lattice<S>(unit, 31, origin), {0, unit, 2 * unit}, 32)}));
  }
  for (const int sign : {-1, 1}) {
    const double scale = std::pow(10.0, sign * (kDouble ? 150 : 30));
    add(std::string("Scale") + (sign < 0 ? "Minus3" : "Plus3"),
        std::string("all lengths times 1e") +
            (sign < 0 ? "-30 in float, 1e-150" : "30 in float, 1e150") + " in double",
        withTips(lock<S>({0, 0, 0}, scale, 1e-2, 2)));
  }
  add("Needles", "cones that end in a point, of whole coordinates",
      withRadii(lattice<S>(1, 33), {0, 0, 1}, 34));
  add("Wide", "as wide as long, one ulp less and more, and wider", wideCones<S>(35));
  add("Over12Decades", "needles, cones and balls, radii and lengths from 1e-12 to 1",
      needlesAndBalls<S>(12, 36));
  add("OverAllDecades", "needles, cones and balls, radii and lengths from the least number to 1",
      needlesAndBalls<S>(-std::log10(kLeast), 60));
  add("FarSmaller", "radii 1e-12 of the length and 0",
      withRadii(lattice<S>(1, 37), {0, 1e-12}, 38));
  add("ByOneUlp", "whole coordinates, radii 1 and one ulp less and more",
      withRadii(
          lattice<S>(1, 39),
          {1, static_cast<double>(neighbor(S(1), 1)), static_cast<double>(neighbor(S(1), -1))},
          40));
  add("Subnormal", "all numbers subnormal",
      withRadii(lattice<S>(kLeast, 41), {0, kLeast, 2 * kLeast}, 42));
  add("SubnormalRadii", "subnormal radii, whole coordinates",
      withRadii(lattice<S>(1, 43), {0, kLeast, 2 * kLeast}, 44));
  add("SubnormalFlushedToZero", "subnormal cones beside a lock, subnormals flushed to zero",
      together<S>({withRadii(lattice<S>(kLeast, 45), {0, kLeast, 2 * kLeast}, 46),
                   withTips(lock<S>({0, 0, 0}, 1, 1e-2, 2))}))
      .environment.flushes_to_zero = true;
  add("NearOverflow", "coordinates up to 1/25 of the largest number",
      withRadii(soup<S>(300, kMost / 64, kMost / 128, kMost / 16, 47),
                {0, kMost / 256, kMost / 128}, 48));
  add("Margin", "a margin of 1 between whole coordinates", withRadii(lattice<S>(1, 49), whole, 50))
      .margin = 1;
  add("Contact", "distance exactly that of contact", conesInContact<S>(0));
  add("ContactLess1Ulp", "one ulp less", conesInContact<S>(-1));
  add("ContactPlus1Ulp", "one ulp more", conesInContact<S>(1));
  add("ContactOnLattice", "whole coordinates and radii", withRadii(lattice<S>(1, 51), whole, 52));
  add("Crossings", "crossing at angles of 1 to 1e-12, and above each other",
      together<S>({crossingCones<S>(0, 2), crossingCones<S>(0.5, 1.5)}));
  add("Parallel", "parallel and anti-parallel to the last bit",
      withRadii(alongOneDirection<S>({3, -2, 1}, -1, 1, 0.5, 53), {0, 0.25, 0.5}, 54));
  add("Collinear", "on one line",
      withRadii(alongOneDirection<S>({3, -2, 1}, -1, 0, 0, 55), {0, 1, 2}, 56));
  add("Hairpins", "fibers that turn back onto themselves at each point", hairpins<S>(57));
  add("Identical", "identical except for their sense and radii",
      withRadii(identical<S>(100), {0, 1e-3, 2e-3}, 58));

  const std::tuple<const char*, const char*, int> modes[] = {
      {"Up", "up", FE_UPWARD}, {"Down", "down", FE_DOWNWARD}, {"ToZero", "to zero", FE_TOWARDZERO}};
  for (const auto& [name, mode, rounding] : modes) {
    add(std::string("Rounded") + name,
        std::string("hair, contact to the last bit and crossings, rounded ") + mode,
        together<S>({withTips(lock<S>({9, 9, 9}, 1, 1e-2, 2)), conesInContact<S>(-1),
                     conesInContact<S>(0), conesInContact<S>(1), crossingCones<S>(0, 2)}))
        .environment.rounding = rounding;
  }
  return rows;
}

template std::vector<ExtremeRow<float>> taperedRows<float>();
template std::vector<ExtremeRow<double>> taperedRows<double>();

}  // namespace fcl_fibers::test
