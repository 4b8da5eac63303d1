// SPDX-License-Identifier: BSD-3-Clause
#include "arrays/shapes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <type_traits>

#include "arrays/located_segment.h"
#include "arrays/triangle_mesh.h"
#include "fibers/mesh_contacts.h"
#include "fibers/options.h"
#include "geometry/double_double.h"
#include "geometry/least_distance.h"
#include "geometry/obstacle_contact.h"
#include "joined_text.h"

namespace fcl_fibers::arrays {
namespace {

using geometry::DoubleDouble;
using geometry::Frame;
using geometry::Obstacle;
using geometry::Segment;
using geometry::Vec3d;

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// In the order of Shape.
constexpr const char* kNames[] = {"capsule", "sphere", "box", "half-space", "plane"};

Vec3d toVector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

Obstacle place(const CapsuleShape& capsule, const Frame& frame) {
  const Segment segment = frame.fromWorld(toSegment(capsule));
  Obstacle axis{Obstacle::Kind::kAxis, midpoint(segment), {0.5 * segment.b - 0.5 * segment.a}};
  axis.margin = segment.radius;
  axis.error = endPointError(segment);
  return axis;
}
Obstacle place(const SphereShape& sphere, const Frame& frame) {
  return place(CapsuleShape{sphere.center, sphere.center, sphere.radius}, frame);
}
Obstacle place(const BoxShape& shape, const Frame& frame) {
  const geometry::AffineMap map = toAffineMap(shape.pose);
  const Vec3d low = toVector(shape.low), high = toVector(shape.high);
  // If the box is not turned, each corner is rounded once.
  const Vec3d shift = map.shift - frame.origin;
  const Segment diagonal{frame.scale * (map.linear(low) + shift),
                         frame.scale * (map.linear(high) + shift), 0};
  Obstacle box{Obstacle::Kind::kBox, midpoint(diagonal)};
  for (std::size_t k = 0; k < 3; ++k) {
    box.vector[k] = (frame.scale * (0.5 * shape.high[k] - 0.5 * shape.low[k])) * map.column[k];
  }
  box.error = endPointError(diagonal);
  if (map.turns()) box.error += 16 * kEps * frame.scale * (maxNorm(low) + maxNorm(high));
  return box;
}
Obstacle placeFlat(Obstacle::Kind kind, const Vec3d& normal, double offset, const Frame& frame) {
  // The power of two keeps the square of the normal's length in range.
  const double unit = std::ldexp(1.0, std::min(-std::ilogb(maxNorm(normal)), 1000));
  const Vec3d n = unit * normal, none{0, 0, 0};
  const double length = norm(n);
  // Far from the origin, double would lose the digits of the height.
  const DoubleDouble height =
      DoubleDouble(unit) * offset - dot(geometry::difference<DoubleDouble>(n, none),
                                        geometry::difference<DoubleDouble>(frame.origin, none));
  Obstacle flat{kind, none, {(1 / length) * n}};
  flat.offset = frame.scale * (double(height) / length);
  flat.error = 8 * kEps * std::fabs(flat.offset);
  return flat;
}
Obstacle place(const HalfSpaceShape& s, const Frame& frame) {
  return placeFlat(Obstacle::Kind::kHalfspace, toVector(s.normal), s.offset, frame);
}
Obstacle place(const PlaneShape& s, const Frame& frame) {
  return placeFlat(Obstacle::Kind::kPlane, toVector(s.normal), s.offset, frame);
}

}  // namespace

void requireShape(const std::string& call, const Shape& shape) {
  const auto require = [&](bool is_right, const auto&... what) {
    if (is_right) return;
    fibers::throwInvalidArgument(call, joinedText("the ", kNames[shape.index()], ": ", what...));
  };
  const auto requireNumber = [&](double x, const auto&... name) {
    require(std::fabs(x) <= 0x1p1000, name..., " is ", x,
            "; give a finite number of a magnitude up to 2^1000");
  };
  const auto requireVector = [&](const char* name, const std::array<double, 3>& v) {
    for (std::size_t i = 0; i < 3; ++i) requireNumber(v[i], name, '[', i, ']');
  };
  std::visit(
      [&](const auto& s) {
        using T = std::decay_t<decltype(s)>;
        if constexpr (std::is_same_v<T, BoxShape>) {
          requireVector("low", s.low);
          requireVector("high", s.high);
          for (std::size_t i = 0; i < 3; ++i) {
            require(s.low[i] <= s.high[i], "low[", i, "] is ", s.low[i], " and exceeds high[", i,
                    "], which is ", s.high[i], "; exchange the two");
          }
          const char* const problem = poseProblem(s.pose);
          require(problem == nullptr, problem != nullptr ? problem : "");
        } else if constexpr (std::is_same_v<T, CapsuleShape> || std::is_same_v<T, SphereShape>) {
          if constexpr (std::is_same_v<T, CapsuleShape>) {
            requireVector("start", s.start);
            requireVector("end", s.end);
          } else {
            requireVector("center", s.center);
          }
          requireNumber(s.radius, "radius");
          require(s.radius >= 0, "radius is ", s.radius, "; give 0 or more");
        } else {
          requireVector("normal", s.normal);
          requireNumber(s.offset, "offset");
          require(maxNorm(toVector(s.normal)) > 0, "normal is 0; give a direction");
        }
      },
      shape);
}

Obstacle obstacleOf(const Shape& shape, const Frame& frame) {
  return std::visit([&](const auto& s) { return place(s, frame); }, shape);
}

ShapeContact shapeContact(const Segment& capsule, const Vec3d& origin, FiberSegment place,
                          const Shape& shape) {
  ShapeContact contact;
  contact.place = place;
  fibers::setContact(obstacleContact(capsule, obstacleOf(shape, {origin, 1}), origin), contact);
  return contact;
}

}  // namespace fcl_fibers::arrays
