// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/program_margin.h"

#include <algorithm>
#include <cmath>

#include "broadphase/object_members.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Vec3d;

double least(const Vec3d& v) { return std::min({v.x, v.y, v.z}); }
double most(const Vec3d& v) { return std::max({v.x, v.y, v.z}); }

template <typename S>
Vec3d halfOf(const fcl::AABB<S>& box) {
  return BoxSize(box).half;
}

/// By the formula of CollisionObject::computeAABB() for objects that are rotated.
template <typename S>
bool containsStockBox(const fcl::CollisionObject<S>& object) {
  const fcl::CollisionGeometry<S>& shape = *ObjectMembers<S>::shape(object);
  const fcl::Vector3<S> center = ObjectMembers<S>::pose(object) * shape.aabb_center;
  const fcl::Vector3<S> delta = fcl::Vector3<S>::Constant(shape.aabb_radius);
  const fcl::AABB<S>& box = ObjectMembers<S>::box(object);
  return (box.min_.array() <= (center - delta).array()).all() &&
         (box.max_.array() >= (center + delta).array()).all();
}

}  // namespace

template <typename S>
Widening wideningOf(const fcl::CollisionObject<S>& object, const BoxSize& size,
                    const Vec3d& unrotated, const Vec3d& tight) {
  constexpr double kRounding = 8 * double{std::numeric_limits<S>::epsilon()};
  const fcl::CollisionGeometry<S>& shape = *ObjectMembers<S>::shape(object);
  const Vec3d local = halfOf(shape.aabb_local);
  const double radius = static_cast<double>(shape.aabb_radius);
  // FCL's own boxes overflow before capsules do.
  if (!std::isfinite(radius) || !std::isfinite(maxNorm(local))) return {};

  // What the shape's own box has beyond the shape. A length that has changed since FCL computed
  // that box shows on one axis, and so adds nothing.
  double added_to_shape = least(local - unrotated);
  if (!(added_to_shape > kRounding * maxNorm(local))) added_to_shape = 0;
  double added_to_radius = added_to_shape;
  const double usual_radius = norm(local);
  if (std::fabs(radius - usual_radius) > kRounding * usual_radius) {
    const double least_radius = shape.getNodeType() == fcl::GEOM_SPHERE ? local.x : usual_radius;
    const double beyond = radius - least_radius;
    if (beyond > kRounding * radius) added_to_radius += beyond;
  }

  const struct {
    Vec3d half;
    double margin;
  } forms[] = {{{radius, radius, radius}, added_to_radius}, {local, added_to_shape}, {tight, 0}};
  for (const auto& form : forms) {
    if (size.isAbout(form.half)) return {form.margin, false};
  }
  double margin = -1;
  for (const auto& form : forms) {
    const Vec3d beyond = size.half - form.half;
    if (!(most(beyond) - least(beyond) <= 2 * size.rounding && least(beyond) > size.rounding)) {
      continue;
    }
    margin = std::max(margin, most(beyond) + size.rounding + form.margin);
  }
  if (margin >= 0) return {margin, false};
  if (containsStockBox(object)) return {0, true};
  // It is of another pose, or of another size of the shape.
  const double beyond = std::max(least(size.half - unrotated), least(size.half - tight));
  return {beyond > size.rounding && std::isfinite(beyond) ? beyond + size.rounding : 0, false};
}

template Widening wideningOf(const fcl::CollisionObject<float>&, const BoxSize&, const Vec3d&,
                             const Vec3d&);
template Widening wideningOf(const fcl::CollisionObject<double>&, const BoxSize&, const Vec3d&,
                             const Vec3d&);

}  // namespace fcl_fibers::broadphase
