// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <exception>
#include <vector>

#include <Eigen/Geometry>

#include <fcl/narrowphase/collision.h>
#include <fcl_fibers/contact.h>

#include "broadphase/shadow_record.h"

namespace fcl_fibers::broadphase {

/// Bounds of the least distance of two surfaces, which is negative where the shapes overlap.
struct Gap {
  double low = -kInfinity, high = kInfinity;
  double volumes = -kInfinity;  ///< a lower bound for whatever managers put around the two
};

/// A recorded object as FCL's narrow phase takes it.
struct PosedRecord {
  const RecordedObject& object;
  const fcl::CollisionGeometry<double>& shape;
  fcl::Transform3<double> pose = fcl::Transform3<double>::Identity();
  Eigen::Vector3d center = {0, 0, 0};
  double radius = 0;  ///< of a ball around the shape; a plane's is infinite
  double size = 0, drift = 0;

  explicit PosedRecord(const RecordedObject& of) : object(of), shape(of.shape->exact()) {
    pose.affine() = object.pose();
    const bool is_open = !(shape.aabb_radius < 1e100);
    center = pose * (is_open ? center : Eigen::Vector3d(shape.aabb_center));
    radius = is_open ? kInfinity : shape.aabb_radius;
    if (!is_open) size = 2 * radius;
    const Eigen::Matrix3d r = pose.linear();
    drift = (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  }
  /// Whether FCL's narrow phase can tell what touches it. It need not end if numbers are far from
  /// 1, and is wrong for planes.
  bool isSolid() const {
    const auto& [kind, n] = object.shape->line;
    const fcl::AABB<double>& box = shape.aabb_local;
    if (kind == "mesh")
      return double(n.size()) > kSizes + 1 + 3 * n[kSizes];  // No cloud of points.
    return kind != "bounds" && kind != "plane" && (box.max_ - box.min_).minCoeff() > 1e-5;
  }
  /// The ends of the axis of a capsule or sphere, one in each column.
  Eigen::Matrix<double, 3, 2> axis() const {
    const std::vector<double>& n = object.shape->line.numbers;
    const double half = n.size() > kSizes + 1 ? n[kSizes + 1] / 2 : 0;
    Eigen::Matrix<double, 3, 2> ends;
    ends << pose * Eigen::Vector3d(0, 0, -half), pose * Eigen::Vector3d(0, 0, half);
    return ends;
  }
  /// The radius of a ball around a box around the ball, and around a ball around getAABB().
  double volume() const {
    const Eigen::Vector3d middle = (object.low() + object.high()) / 2 - center;
    const double box = middle.norm() + (object.high() - object.low()).norm() / 2;
    return box > 2 * radius ? box : 2 * radius;
  }
};

/// Bounds the least distance of two objects while their points move linearly from `a_start` to `a`
/// and from `b_start` to `b`, unless their shapes change: that of capsules and spheres at some of
/// the times in closed form, and whether others touch at the end by FCL's narrow phase, in double.
/// What FCL's boxes may lose, as they are computed in float or double, is within the bounds, and so
/// is what a step may add.
inline Gap gapBetween(const RecordedObject& a_start, const RecordedObject& a,
                      const RecordedObject& b_start, const RecordedObject& b, bool is_float) {
  using Ends = Eigen::Matrix<double, 3, 2>;
  Gap gap;
  if (!a_start.isFinite() || !a.isFinite() || !b_start.isFinite() || !b.isFinite()) return gap;
  if (!a.shape->isLike(*a_start.shape) || !b.shape->isLike(*b_start.shape)) return gap;
  try {
    const PosedRecord p0(a_start), p(a), q0(b_start), q(b);
    const double size = p.size + q.size;
    const double far =
        std::max(p0.center.norm() + q0.center.norm(), p.center.norm() + q.center.norm()) + size;
    const double drift = std::max(p0.drift + q0.drift, p.drift + q.drift);
    // How far the centers are apart when they are nearest, as seen from one of them.
    const Eigen::Vector3d first = p0.center - q0.center, way = p.center - q.center - first;
    const double at = way.squaredNorm() > 0 ? -first.dot(way) / way.squaredNorm() : 1;
    const double between = (first + std::clamp(at, 0.0, 1.0) * way).norm();
    // FCL's boxes take a rotation for the identity if its entries are about that. A shape that
    // moves counts up to 1/4096 of the way.
    const bool moves = &a_start != &a || &b_start != &b;
    const double doubt = 2 * ((is_float ? 1e-5 : 1e-12) + drift) * far +
                         (moves ? 0x1p-12 * (way.norm() + 2 * size) : 0);
    gap.volumes = between - std::max(p0.volume() + q0.volume(), p.volume() + q.volume()) - doubt;
    gap.low = between - p.radius - q.radius - doubt;
    if (a.shape->isRound() && b.shape->isRound()) {
      // Between two times the distance changes by no more than ends move against each other.
      const Ends from[] = {p0.axis(), q0.axis()}, to[] = {p.axis(), q.axis()};
      const Ends moved[] = {to[0] - from[0], to[1] - from[1]};
      double most = 0, least = kInfinity;
      for (int i = 0; i < 4; ++i) {
        most = std::max(most, (moved[0].col(i / 2) - moved[1].col(i % 2)).norm());
      }
      constexpr int kParts = 64;
      const auto capsuleAt = [&](double t, int of, const RecordedObject& object) -> CapsuleShape {
        const Ends ends = t < 1 ? Ends(from[of] + t * moved[of]) : to[of];
        return {{ends(0, 0), ends(1, 0), ends(2, 0)},
                {ends(0, 1), ends(1, 1), ends(2, 1)},
                object.shape->line.numbers[kSizes]};
      };
      for (int i = most > 0 ? 0 : kParts; i <= kParts; ++i) {
        const double t = double(i) / kParts;
        least = std::min(least, capsuleContact(capsuleAt(t, 0, a), capsuleAt(t, 1, b)).distance);
      }
      return {least - most / (2 * kParts) - doubt, least + doubt, gap.volumes};
    }
    // The narrow phase is iterative, with a tolerance of 1e-6, so a pair touches without doubt only
    // if it still does after one shape has been moved in any direction.
    const double error = 2 * doubt + 2e-4 * size + 8e-6;
    bool touches = p.isSolid() && q.isSolid() && far < 1e5;
    for (int i = 0; touches && i < 7; ++i) {
      fcl::Transform3<double> moved = q.pose;
      if (i < 6) moved.translation() += (i < 3 ? error : -error) * Eigen::Vector3d::Unit(i % 3);
      fcl::CollisionRequest<double> request;
      request.gjk_solver_type = fcl::GST_INDEP;  // libccd does not always end.
      fcl::CollisionResult<double> result;
      touches = fcl::collide(&p.shape, p.pose, &q.shape, moved, request, result) > 0;
    }
    if (touches) gap.high = 0;
  } catch (const std::exception&) {  // FCL gives up on some shapes, and a mesh may be broken.
  }
  return gap;
}

/// The same of two that rest.
inline Gap gapBetween(const RecordedObject& a, const RecordedObject& b, bool is_float) {
  return gapBetween(a, a, b, b, is_float);
}

}  // namespace fcl_fibers::broadphase
