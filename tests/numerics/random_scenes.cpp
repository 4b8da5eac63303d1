// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/random_scenes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "support/exact_geometry.h"
#include "support/random.h"

namespace fcl_fibers::test {
namespace {

using Numbers = std::array<double, 3>;

Numbers numbers(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

/// Locks of 20 fibers side by side, all over a box.
template <typename S>
Assembly<S> denseScene(std::size_t capsules, Random& random) {
  constexpr std::size_t kFibers = 20, kSegments = 20;
  Assembly<S> fibers;
  const std::size_t locks = capsules / (kFibers * kSegments) + 1;
  const double radius = random.between(0.005, 0.02);
  for (std::size_t lock = 0; lock < locks; ++lock) {
    const Eigen::Vector3d root = random.inCube(1), towards = 0.08 * random.direction();
    for (std::size_t f = 0; f < kFibers; ++f) {
      Eigen::Vector3d p = root + random.inCube(0.12);
      for (std::size_t i = 0; i <= kSegments; ++i) {
        fibers.addPoint(numbers(p), radius);
        p += towards + random.inCube(0.03);
      }
      fibers.endFiber();
    }
  }
  return fibers;
}

template <typename S>
Assembly<S> sparseScene(std::size_t capsules, Random& random) {
  Assembly<S> fibers;
  // Some two contacts a capsule, whatever the number.
  const double size = 1.5 / std::cbrt(static_cast<double>(capsules));
  for (std::size_t i = 0; i < capsules; ++i) {
    const Eigen::Vector3d a = random.inCube(1), direction = random.direction();
    const Eigen::Vector3d b = a + random.between(0, size) * direction;
    fibers.addCapsule(numbers(a), numbers(b), random.between(0, size / 3));
  }
  return fibers;
}

template <typename S>
Assembly<S> curledScene(std::size_t capsules, Random& random) {
  Assembly<S> fibers;
  const std::size_t fiber_count = 1 + random.below(5);
  const double step = 1.2 / std::cbrt(static_cast<double>(capsules));
  for (std::size_t f = 0; f < fiber_count; ++f) {
    Eigen::Vector3d p = random.inCube(0.5), direction = random.direction();
    const double radius = step * random.between(0.02, 0.3);
    for (std::size_t i = 0; i <= capsules / fiber_count; ++i) {
      fibers.addPoint(numbers(p), radius);
      // Turns back before it leaves the unit ball.
      direction = (direction + 0.6 * random.direction() - 0.3 * p).normalized();
      p += step * direction;
    }
    fibers.endFiber();
  }
  return fibers;
}

template <typename S>
Assembly<S> degenerateScene(std::size_t capsules, Random& random) {
  Assembly<S> fibers;
  const auto side = static_cast<int>(4 * std::cbrt(static_cast<double>(capsules)));
  for (std::size_t count = 0; count < capsules;) {
    const std::size_t segments = random.below(4) == 0 ? 1 : random.below(30);
    Numbers p;
    for (double& x : p) x = static_cast<double>(random.below(static_cast<std::size_t>(side)));
    for (std::size_t i = 0; i <= segments; ++i) {
      fibers.addPoint(p, static_cast<double>(random.below(4)) / 2);
      if (random.below(8) == 0) continue;
      for (double& x : p) x += static_cast<double>(random.below(5)) - 2;
    }
    fibers.endFiber();
    count += segments;
  }
  return fibers;
}

/// On a grid, so that pairs touch nothing but themselves.
template <typename S>
Assembly<S> contactScene(std::size_t capsules, Random& random) {
  Assembly<S> fibers;
  const auto row = static_cast<std::size_t>(std::sqrt(static_cast<double>(capsules) / 2)) + 1;
  for (std::size_t i = 0; i < capsules / 2; ++i) {
    const Numbers place = {8.0 * static_cast<double>(i % row), 0,
                           8.0 * static_cast<double>(i / row)};
    if (std::is_same_v<S, double> && i % 2 == 0) {
      // Anywhere; the radius is within 1e-12 of that of contact.
      const Eigen::Vector3d at(place[0], place[1], place[2]);
      const Numbers a = numbers(at + random.inCube(1)), b = numbers(at + random.inCube(1));
      const Numbers c = numbers(at + random.inCube(1)), d = numbers(at + random.inCube(1));
      const auto point = [](const Numbers& p) { return Point(p[0], p[1], p[2]); };
      const Real distance = segmentDistance(point(a), point(b), point(c), point(d));
      const int exponent = -40 - static_cast<int>(random.below(14));
      const double off = std::ldexp(random.between(-1, 1), exponent);
      fibers.addCapsule(a, b, static_cast<double>(distance) / 4);
      fibers.addCapsule(c, d, static_cast<double>(distance * (1 + Real(off))) * 3 / 4);
    } else {
      // Crossing at right angles to y, along which the sum of the radii is exact.
      const auto radius = static_cast<S>(random.between(0.1, 1));
      S gap = 2 * radius;
      const std::size_t kind = random.below(4);
      if (kind == 0) gap = std::nextafter(gap, S(0));
      if (kind == 1) gap = std::nextafter(gap, S(4));
      const auto r = static_cast<double>(radius);
      const Eigen::Vector3d p(place[0], 0, place[2]),
          q(place[0], static_cast<double>(gap), place[2]);
      const double angle = random.between(0, 6.3);
      const Eigen::Vector3d along(std::cos(angle), 0, std::sin(angle));
      const Eigen::Vector3d a = p - random.unit() * Eigen::Vector3d::UnitX();
      const Eigen::Vector3d b = p + random.unit() * Eigen::Vector3d::UnitX();
      const Eigen::Vector3d c = q - random.unit() * along;
      const Eigen::Vector3d d = q + random.unit() * along;
      fibers.addCapsule(numbers(a), numbers(b), r);
      fibers.addCapsule(numbers(c), numbers(d), r);
    }
  }
  return fibers;
}

template <typename S>
Assembly<S> hairScene(std::size_t capsules, Random& random, const HairFiles& files) {
  Assembly<S> fibers;
  if (files.empty()) return fibers;
  const auto& [points, length] = files[random.below(files.size())];
  const std::size_t strands = std::min(capsules / (length - 1) + 1, points.size() / length);
  // Files have neighbours near each other.
  const std::size_t first = random.below(points.size() / length - strands + 1);
  const Numbers &p = points[first * length], &q = points[first * length + length / 2];
  const double size = std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
  const double radius = size * std::pow(10.0, random.between(-4, -1.5));
  for (std::size_t f = first; f < first + strands; ++f) {
    for (std::size_t i = 0; i < length; ++i) fibers.addPoint(points[f * length + i], radius);
    fibers.endFiber();
  }
  return fibers;
}

/// Pairs of cones on a grid. Radii at both ends grow until the distance is that of contact, within
/// 1e-12 or as well as S tells.
template <typename S>
Assembly<S> conesInContact(std::size_t capsules, Random& random) {
  Assembly<S> fibers;
  const auto row = static_cast<std::size_t>(std::sqrt(static_cast<double>(capsules) / 2)) + 1;
  const auto rounded = [](double x) { return static_cast<double>(static_cast<S>(x)); };
  for (std::size_t i = 0; i < capsules / 2; ++i) {
    const Eigen::Vector3d place(8.0 * static_cast<double>(i % row), 0,
                                8.0 * static_cast<double>(i / row));
    GivenCapsule cones[2];
    for (GivenCapsule& cone : cones) {
      for (Numbers* end : {&cone.a, &cone.b}) {
        *end = numbers(place + random.inCube(1));
        for (double& x : *end) x = rounded(x);
      }
      cone.radius = random.below(3) == 0 ? 0 : rounded(random.unit());
      cone.radius_of_second = random.below(3) == 0 ? 0 : rounded(random.unit());
    }
    const Real distance = surfaceDistance(roundedCapsule(cones[0]), roundedCapsule(cones[1]));
    const double off = std::ldexp(random.between(-1, 1), -40 - static_cast<int>(random.below(14)));
    const double growth = std::max(static_cast<double>(distance) * (1 + off), 0.0);
    fibers.addCone(cones[0].a, cones[0].b, cones[0].radius + growth,
                   cones[0].radius_of_second + growth);
    fibers.addCone(cones[1].a, cones[1].b, cones[1].radius, cones[1].radius_of_second);
  }
  return fibers;
}

template <typename S>
Assembly<S> taperedScene(std::size_t capsules, Random& random) {
  const std::size_t kind = random.below(4);
  Assembly<S> fibers = kind == 0   ? conesInContact<S>(capsules, random)
                       : kind == 1 ? denseScene<S>(capsules, random)
                       : kind == 2 ? curledScene<S>(capsules, random)
                                   : degenerateScene<S>(capsules, random);
  fibers.radii_are = Assembly<S>::Radii::kPerPoint;
  if (kind == 0) return fibers;
  for (S& radius : fibers.radii) {
    const double times[] = {0, 1, 2, kind == 3 ? 1 : random.between(0, 2)};
    radius = static_cast<S>(static_cast<double>(radius) * times[random.below(4)]);
  }
  return fibers;
}

}  // namespace

std::string nameOf(RandomKind kind) {
  switch (kind) {
    case RandomKind::kDense:
      return "dense";
    case RandomKind::kSparse:
      return "sparse";
    case RandomKind::kCurled:
      return "curled";
    case RandomKind::kDegenerate:
      return "degenerate";
    case RandomKind::kContact:
      return "contact";
    case RandomKind::kTapered:
      return "tapered";
    default:
      return "hair";
  }
}

template <typename S>
Assembly<S> randomScene(RandomKind kind, std::size_t capsules, std::uint64_t seed,
                        const HairFiles& hair) {
  Random random(seed);
  switch (kind) {
    case RandomKind::kDense:
      return denseScene<S>(capsules, random);
    case RandomKind::kSparse:
      return sparseScene<S>(capsules, random);
    case RandomKind::kCurled:
      return curledScene<S>(capsules, random);
    case RandomKind::kDegenerate:
      return degenerateScene<S>(capsules, random);
    case RandomKind::kContact:
      return contactScene<S>(capsules, random);
    case RandomKind::kTapered:
      return taperedScene<S>(capsules, random);
    default:
      return hairScene<S>(capsules, random, hair);
  }
}

template Assembly<float> randomScene(RandomKind, std::size_t, std::uint64_t, const HairFiles&);
template Assembly<double> randomScene(RandomKind, std::size_t, std::uint64_t, const HairFiles&);

}  // namespace fcl_fibers::test
