// SPDX-License-Identifier: BSD-3-Clause
#include "measures/pair_scenes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>

#include "scenes/random.h"

namespace fcl_fibers::benchmarks {
namespace {

using fcl::Vector3d;

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// All pairs of overlapping tight boxes, by sorting along x. Boxes are larger by rounding, so that
/// no pair is lost.
IndexPairs overlappingBoxes(const std::vector<PosedCapsule>& capsules,
                            const std::vector<std::uint32_t>& fiber_of) {
  struct Box {
    Vector3d low, high;
  };
  std::vector<Box> boxes;
  for (const PosedCapsule& c : capsules) {
    const Vector3d extent = (c.length / 2 * c.axis).cwiseAbs().array() + c.radius;
    const Vector3d rounding = 4 * kEps * (c.centre.cwiseAbs() + extent);
    boxes.push_back({c.centre - extent - rounding, c.centre + extent + rounding});
  }
  std::vector<std::uint32_t> order(boxes.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](auto i, auto j) { return boxes[i].low.x() < boxes[j].low.x(); });
  IndexPairs pairs;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Box& p = boxes[order[i]];
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      const Box& q = boxes[order[j]];
      if (q.low.x() > p.high.x()) break;
      if (q.low.y() > p.high.y() || p.low.y() > q.high.y() || q.low.z() > p.high.z() ||
          p.low.z() > q.high.z()) {
        continue;
      }
      const auto [a, b] = std::minmax(order[i], order[j]);
      if (b == a + 1 && fiber_of[a] == fiber_of[b]) continue;
      pairs.emplace_back(a, b);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

constexpr double kRadius = 0.0035, kLength = 0.3125;  // cm, of a lock of hair

/// Two capsules: ends, and radii.
struct TwoCapsules {
  Vector3d a[2], b[2];
  double radius_a = kRadius, radius_b = kRadius;
};

/// A frame at a random place, and numbers.
struct Draw {
  explicit Draw(scenes::Random& random) : random(random) {
    const auto direction = [&] {
      return Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    };
    along = rounded(direction(), 0x1p30);
    across = along.cross(direction()).normalized();
    centre = rounded(direction(), 0x1p30);
  }

  double uniform(double low, double high) { return low + (high - low) * random.uniform(); }
  /// Uniform in its logarithm.
  double power(double low, double high) { return std::pow(10.0, uniform(low, high)); }

  static Vector3d rounded(const Vector3d& x, double scale) {
    return (scale * x).array().round() / scale;
  }

  /// The capsule about `middle`, at an angle to `along` in the plane across `across`. What is
  /// parallel is so to the last bit: no sum is rounded.
  void put(Vector3d (&ends)[2], const Vector3d& middle, double angle, double length) const {
    const Vector3d direction =
        angle == 0 ? along
                   : Vector3d(std::cos(angle) * along + std::sin(angle) * across.cross(along));
    const Vector3d about = angle == 0 ? rounded(middle, 0x1p40) : middle;
    ends[0] = about - length / 2 * direction;
    ends[1] = about + length / 2 * direction;
  }

  scenes::Random& random;
  Vector3d along, across, centre;
};

TwoCapsules drawPair(const std::string& kind, scenes::Random& random) {
  Draw draw(random);
  TwoCapsules two;
  double angle = draw.uniform(0.1, 1.5), gap = draw.uniform(0.001, 1.999) * kRadius, shift = 0;
  double length_a = kLength, length_b = kLength;
  if (kind == "parallel") {
    angle = 0;
    shift = draw.uniform(-0.9, 0.9) * kLength;
  } else if (kind == "near-parallel") {
    angle = draw.power(-12, -3);
    shift = draw.uniform(-0.4, 0.4) * kLength;
  } else if (kind == "end to end") {
    angle = 0;
    shift = kLength + gap;
    gap = 0;
  } else if (kind == "joint") {
    angle = draw.power(-6, 0);
    gap = 0;
  } else if (kind == "nested") {
    angle = gap = 0;
    length_b = kLength / 2;
    shift = draw.uniform(-0.2, 0.2) * kLength;
    two.radius_b = kRadius / 2;
  } else if (kind == "axes that meet") {
    gap = 0;
  } else if (kind == "grazing") {
    gap = 2 * kRadius * (1 + (random.uniform() < 0.5 ? -1 : 1) * draw.power(-16, -3));
  } else if (kind == "balls") {
    length_a = length_b = 0;
  } else if (kind == "thick") {
    length_a = length_b = 1e-6 * kRadius;
  }
  draw.put(two.a, draw.centre, 0, length_a);
  const Vector3d away = draw.centre + shift * draw.along + gap * draw.across;
  draw.put(two.b, away, angle, length_b);
  if (kind == "joint") {
    const Vector3d moved = two.a[1] - two.b[0];
    two.b[0] = two.a[1];
    two.b[1] += moved;
  }
  return two;
}

}  // namespace

IndexPairs pairsOf(const PairScene& scene, const std::vector<PosedCapsule>& capsules) {
  if (!scene.paired) {
    std::vector<std::uint32_t> fiber_of;
    for (std::uint32_t f = 0; f < scene.fibers.fiberCount(); ++f) {
      const std::size_t points = scene.fibers.point_begin[f + 1] - scene.fibers.point_begin[f];
      fiber_of.insert(fiber_of.end(), points - 1, f);
    }
    return overlappingBoxes(capsules, fiber_of);
  }
  IndexPairs pairs;
  for (std::uint32_t i = 0; i + 1 < capsules.size(); i += 2) pairs.emplace_back(i, i + 1);
  return pairs;
}

FiberPolylines scaled(FiberPolylines fibers, double scale, double offset) {
  for (Point& point : fibers.points) {
    for (double& x : point) x = scale * x + offset;
  }
  fibers.radius *= scale;
  for (double& radius : fibers.radii) radius *= scale;
  return fibers;
}

PairScene extreme(const std::string& kind, int pairs) {
  scenes::Random random(1);
  PairScene scene{kind, {}, /*paired=*/true};
  const auto add = [&](const Vector3d(&ends)[2], double radius) {
    for (const Vector3d& end : ends) {
      scene.fibers.points.push_back({end.x(), end.y(), end.z()});
      scene.fibers.radii.push_back(radius);
    }
    scene.fibers.point_begin.push_back(scene.fibers.points.size());
  };
  for (int i = 0; i < pairs; ++i) {
    const TwoCapsules two = drawPair(kind, random);
    add(two.a, two.radius_a);
    add(two.b, two.radius_b);
  }
  return scene;
}

}  // namespace fcl_fibers::benchmarks
