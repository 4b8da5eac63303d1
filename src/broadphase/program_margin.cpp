// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/program_margin.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>

#include "broadphase/object_members.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Vec3d;

template <typename S>
constexpr double kEps = double{std::numeric_limits<S>::epsilon()};

double least(const Vec3d& v) { return std::min({v.x, v.y, v.z}); }
double most(const Vec3d& v) { return std::max({v.x, v.y, v.z}); }
Vec3d cube(double half) { return {half, half, half}; }

/// Half the size of the object's box if the program has left that box alone. `margin` is the part
/// of it that the program has added to the shape's own box.
struct Form {
  Vec3d half;
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
    const Vec3d excess = size.half - forms[i].half;
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
    const double everywhere = least(size.half - forms[i].half);
    if (everywhere > size.rounding) margin = std::max(margin, everywhere + size.rounding);
  }
  return margin;
}

}  // namespace

template <typename S>
BoxSize::BoxSize(const fcl::AABB<S>& box) {
  const Vec3d low = toVec3(box.min_), high = toVec3(box.max_);
  half = 0.5 * high - 0.5 * low;
  const double farthest = std::max(maxNorm(low), maxNorm(high));
  is_open = farthest > double{std::numeric_limits<S>::max()} / 4;
  // FCL rounds each corner to nearest. The extent that it adds to the position carries three
  // roundings.
  rounding = kEps<S> * (0.75 * farthest + 3 * maxNorm(half)) +
             4 * double{std::numeric_limits<S>::denorm_min()};
}

template <typename S>
Widening wideningOf(const fcl::CollisionObject<S>& object, double radius, double length) {
  const fcl::CollisionGeometry<S>& shape = *ObjectMembers<S>::shape(object);
  const fcl::Transform3<S>& pose = ObjectMembers<S>::pose(object);
  const fcl::AABB<S>& box = ObjectMembers<S>::box(object);
  const BoxSize size(box);
  if (!(least(size.half) >= 0)) return {};  // NaN, or empty
  // The program may have widened the shape's own box, too. Excess along the axis does not count,
  // because the length may have changed since FCL computed that box.
  const bool is_sphere = shape.getNodeType() == fcl::GEOM_SPHERE;
  const BoxSize own(shape.aabb_local);
  const Vec3d middle = 0.5 * toVec3(shape.aabb_local.min_) + 0.5 * toVec3(shape.aabb_local.max_);
  const double own_rounding = 4 * own.rounding;
  const double excess[] = {own.half.x - radius, own.half.y - radius,
                           is_sphere ? own.half.z - radius : own.half.x - radius};
  const auto [low, high] = std::minmax({excess[0], excess[1], excess[2]});
  const bool is_even = high - low <= own_rounding && maxNorm(middle) <= own_rounding;
  const double in_box = is_even && high > own_rounding ? high : 0;

  // The ball around that box, by which FCL bounds rotated objects.
  const auto ball = static_cast<double>(shape.aabb_radius), usual = norm(own.half);
  // If FCL's own box has overflowed, its size tells nothing.
  if (size.is_open) return {0, std::isfinite(ball)};
  double in_ball = in_box;
  if (std::fabs(ball - usual) > own_rounding) {
    const double beyond = ball - (is_sphere ? own.half.x : usual);
    if (beyond > own_rounding && std::isfinite(beyond)) in_ball += beyond;
  }

  const Vec3d axis = toVec3(pose.matrix().col(2));
  const Vec3d tight = {std::fabs(axis.x) * length / 2 + radius,
                       std::fabs(axis.y) * length / 2 + radius,
                       std::fabs(axis.z) * length / 2 + radius};
  Form forms[3] = {{own.half, in_box}, {tight, 0}};
  std::size_t count = 2;
  // If both of FCL's boxes are cubes, the pose tells which one this is.
  const bool may_be_turned =
      !(most(own.half) - least(own.half) <= own_rounding) || !pose.linear().isIdentity();
  if (std::isfinite(ball) && may_be_turned) forms[count++] = {cube(ball), in_ball};

  if (is_even) {
    for (std::size_t i = 0; i < count; ++i) {
      if (maxNorm(size.half - forms[i].half) <= size.rounding) return {forms[i].margin, false};
    }
  }
  const Vec3d position = toVec3(pose.matrix().col(3));
  const Vec3d below = position - toVec3(box.min_), above = toVec3(box.max_) - position;
  const Vec3d inner = min(below, above), outer = max(below, above);
  if (least(inner - tight) >= -size.rounding) {
    double margin = 0;
    for (std::size_t i = 0; is_even && i < count; ++i) {
      const double even =
          evenExcess(inner - forms[i].half, outer - forms[i].half, 2 * size.rounding);
      if (even > 0) margin = std::max(margin, even + forms[i].margin);
    }
    if (margin > 0) return {margin, false};
    // The box was widened on one side, or it was widened on all and the object has moved by less.
    // Box and margin both count.
    return {marginOfEvenSize(size, forms, count), true};
  }
  if (!is_even) return {std::max(0.0, std::max(high, most(size.half - tight))), false};
  return {marginOfSize(size, forms, count), false};
}

template <typename S>
double marginOfOldBox(const fcl::CollisionObject<S>& object, const BoxSize& size,
                      const Vec3d& posed) {
  const fcl::CollisionGeometry<S>& shape = *ObjectMembers<S>::shape(object);
  const auto ball = static_cast<double>(shape.aabb_radius);
  if (size.is_open) return 0;
  const Form forms[] = {{BoxSize(shape.aabb_local).half, 0}, {posed, 0}, {cube(ball), 0}};
  for (const Form& form : forms) {
    if (maxNorm(size.half - form.half) <= size.rounding) return 0;
  }
  return marginOfSize(size, forms, std::isfinite(ball) ? 3 : 2);
}

#define FCL_FIBERS_INSTANTIATE(S)                                               \
  template BoxSize::BoxSize(const fcl::AABB<S>&);                               \
  template Widening wideningOf(const fcl::CollisionObject<S>&, double, double); \
  template double marginOfOldBox(const fcl::CollisionObject<S>&, const BoxSize&, const Vec3d&);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::broadphase
