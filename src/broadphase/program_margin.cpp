// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/shape_box.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace fcl_fibers::broadphase {
namespace {

using geometry::Vec3d;

template <typename S>
constexpr double kEps = double{std::numeric_limits<S>::epsilon()};

double least(const Vec3d& v) { return std::min({v.x, v.y, v.z}); }
double most(const Vec3d& v) { return std::max({v.x, v.y, v.z}); }
Vec3d cube(double half) { return {half, half, half}; }

/// The object's box, relative to its position, if the program has left that box alone. `margin` is
/// the part of it that the program has added to the shape's own box.
struct Form {
  Corners box;
  double margin = 0;
};

/// The excess if it is equal on all axes and more than rounding, else 0.
double evenExcess(const Vec3d& least_excess, const Vec3d& most_excess, double rounding) {
  const double low = least(least_excess), high = most(most_excess);
  return high - low <= 2 * rounding && low > rounding ? high + rounding : 0;
}

double marginOfEvenSize(const BoxSize& size, const Form* forms, std::size_t count) {
  double margin = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3d excess = size.half - forms[i].box.half();
    const double even = evenExcess(excess, excess, size.rounding);
    if (even > 0) margin = std::max(margin, even + forms[i].margin);
  }
  return margin;
}

/// The margin of a box of another pose. Only its size can tell.
double marginOfSize(const BoxSize& size, const Form* forms, std::size_t count) {
  double margin = marginOfEvenSize(size, forms, count);
  if (margin > 0) return margin;
  for (std::size_t i = 0; i < count; ++i) {
    const double everywhere = least(size.half - forms[i].box.half());
    if (everywhere > size.rounding) margin = std::max(margin, everywhere + size.rounding);
  }
  return margin;
}

/// FCL computes the local boxes of these from a length along z.
bool hasLength(fcl::NODE_TYPE type) {
  return type == fcl::GEOM_CAPSULE || type == fcl::GEOM_CYLINDER || type == fcl::GEOM_CONE ||
         type == fcl::GEOM_BOX;
}

/// wideningOf() a box whose size is not a stock one.
template <typename S>
[[gnu::noinline]] Widening wideningOfSize(const fcl::CollisionObject<S>& object,
                                          const ShapeBox& shape, const BoxSize& size) {
  const fcl::CollisionGeometry<S>& geometry = *ObjectMembers<S>::shape(object);
  const fcl::Transform3<S>& pose = ObjectMembers<S>::pose(object);
  const fcl::AABB<S>& box = ObjectMembers<S>::box(object);
  const fcl::NODE_TYPE type = geometry.getNodeType();
  const bool is_sphere = type == fcl::GEOM_SPHERE;
  if (!isProper(box)) return {};
  // The program may have widened the shape's own box, too. Excess along the axis does not count,
  // because the length may have changed since FCL computed that box.
  const BoxSize own(geometry.aabb_local);
  const Corners own_box{toVec3(geometry.aabb_local.min_), toVec3(geometry.aabb_local.max_)};
  const double own_rounding = 4 * own.rounding;
  Vec3d excess = own.half - shape.local.half();
  if (hasLength(type)) excess.z = excess.x;
  const double low = least(excess), high = most(excess);
  // If the box is not larger on any side, the shape has grown since.
  const bool is_even = (high - low <= own_rounding || high <= own_rounding) &&
                       maxNorm(own_box.middle() - shape.local.middle()) <= own_rounding;
  const double in_box = is_even && high > own_rounding ? high : 0;

  // The ball around that box, by which FCL bounds rotated objects.
  const auto ball = static_cast<double>(geometry.aabb_radius), usual = norm(own.half);
  // If FCL's own box has overflowed, its size tells nothing.
  if (size.is_open && !std::isfinite(ball)) return {};
  if (size.is_open) return {std::numeric_limits<double>::infinity(), /*is_uneven=*/true};
  double in_ball = in_box;
  if (std::fabs(ball - usual) > own_rounding) {
    const double beyond = ball - (is_sphere ? own.half.x : usual);
    if (beyond > own_rounding && std::isfinite(beyond)) in_ball += beyond;
  }

  // A mesh may fill less of its ball than usual, so an addition to the ball cannot be told.
  const bool is_known = std::isfinite(ball) && (shape.is_least || in_ball == in_box);
  const Vec3d center = toVec3(geometry.aabb_center);
  // By components, because Eigen's product is rounded otherwise on arm64.
  const auto& axes = pose.linear();
  const auto& offset = geometry.aabb_center;
  fcl::Vector3<S> turned;
  for (int i = 0; i < 3; ++i) {
    turned[i] = axes(i, 0) * offset[0] + axes(i, 1) * offset[1] + axes(i, 2) * offset[2];
  }
  const Corners ball_box = around(toVec3(turned), cube(ball));

  // This covers FCL's rounding of a middle that is not the position. It also covers the error of a
  // box that FCL does not turn, because the pose is near the identity.
  const bool is_turned = !pose.linear().isIdentity();
  const double shift = 8 * kEps<S> * maxNorm(center);
  const double tilt = is_turned ? 0
                                : 4 * double{Eigen::NumTraits<S>::dummy_precision()} *
                                      (maxNorm(own.half) + maxNorm(center));
  const Vec3d position = toVec3(pose.matrix().col(3));
  const Vec3d below = position - toVec3(box.min_), above = toVec3(box.max_) - position;
  // FCL's cube does not grow with a rotation that has drifted, so the ends of a thin shape may
  // stick out of it by 5e-4 of its length. A box of this pose then contains the rest.
  Corners posed = shape.posed;
  if (is_turned && shape.is_least && is_known) {
    posed = {max(posed.low, ball_box.low), min(posed.high, ball_box.high)};
  }
  // A box around a mesh may be smaller than ours, but the two meet. FCL rounds less than programs.
  const Vec3d beyond_low = below + (shape.is_least ? posed.low : posed.high),
              beyond_high = above - (shape.is_least ? posed.high : posed.low);
  const bool is_of_pose =
      least(min(beyond_low, beyond_high)) >= -(0.6 * size.rounding + shift + tilt);

  // If both of FCL's boxes are cubes, the pose tells which one this is. It also does for a box of
  // this pose if rounding, below taken as 1, hides whether it is FCL's cube around the ball of
  // radius b or a local box that a program widened. If only one axis was widened, the other sides
  // are within 1 of b, so b^2 >= 2 (b - 1)^2, b <= 3.5, and the sides differ by no more. If all
  // were widened evenly, they differ by 2 at most.
  const double cube_rounding =
      is_of_pose ? std::max(own_rounding, 4 * size.rounding) : own_rounding;
  const bool is_cube = most(own.half) - least(own.half) <= cube_rounding;
  Form forms[3] = {{own_box, in_box}, {shape.posed, 0}};
  std::size_t count = 2;
  if (is_known && (is_turned || !is_cube)) forms[count++] = {ball_box, in_ball};

  if (is_even) {
    for (std::size_t i = 0; i < count; ++i) {
      if (maxNorm(size.half - forms[i].box.half()) <= size.rounding) {
        return {forms[i].margin, false};
      }
    }
  }
  if (is_of_pose) {
    double margin = 0;
    for (std::size_t i = is_turned && is_cube ? 1 : 0; is_even && i < count; ++i) {
      const Vec3d p = below + forms[i].box.low, q = above - forms[i].box.high;
      const double even = evenExcess(min(p, q), max(p, q), 2 * size.rounding + shift);
      if (even > 0) margin = std::max(margin, even + forms[i].margin);
    }
    if (margin > 0) return {margin, false};
    const double largest = most(max(beyond_low, beyond_high)) + size.rounding + shift;
    // A program whose numbers are floats rounds each side by so much, and means no margin. In a
    // scene of floats that is the rounding of all boxes.
    const double noise =
        std::is_same_v<S, float>
            ? 0
            : 2 * kEps<float> * (maxNorm(position) + maxNorm(max(abs(below), abs(above))));
    if (shape.is_least && largest - least(min(beyond_low, beyond_high)) <= noise) {
      return {largest, false};
    }
    // The box was widened on one side, or it was widened on all sides and the object has moved by
    // less than that.
    return {largest, true, marginOfEvenSize(size, forms, count)};
  }
  if (!is_even) return {std::max(0.0, std::max(high, most(size.half - shape.posed.half()))), false};
  return {marginOfSize(size, forms, count), false};
}

}  // namespace

template <typename S>
Widening wideningOf(const fcl::CollisionObject<S>& object, const ShapeBox& shape) {
  const BoxSize size(ObjectMembers<S>::box(object));
  // segmentsOf() and addsNothing() have asked this of capsules and spheres.
  const fcl::NODE_TYPE type = ObjectMembers<S>::shape(object)->getNodeType();
  if (type != fcl::GEOM_CAPSULE && type != fcl::GEOM_SPHERE &&
      isStockSize(size, shape, ObjectMembers<S>::pose(object))) {
    return {};
  }
  return wideningOfSize(object, shape, size);
}

template Widening wideningOf(const fcl::CollisionObject<float>&, const ShapeBox&);
template Widening wideningOf(const fcl::CollisionObject<double>&, const ShapeBox&);

}  // namespace fcl_fibers::broadphase
