// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <memory>
#include <type_traits>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/triangle_p.h>
#include <fcl/narrowphase/collision_object.h>

#include "support/exact_geometry.h"
#include "support/random.h"

// Objects for the tests that read them without a manager.
namespace fcl_fibers::test {

/// What a program may change of it.
template <typename S>
class Object : public fcl::CollisionObject<S> {
 public:
  using fcl::CollisionObject<S>::CollisionObject;
  using fcl::CollisionObject<S>::aabb;
  fcl::CollisionGeometry<S>& shape() { return *this->cgeom; }
};

enum Kind { kBox, kCube, kCylinder, kCone, kEllipsoid, kConvex, kTriangle, kBounded };

/// A bounded shape, and points of it that lie at its ends.
template <typename S>
struct Sample {
  std::shared_ptr<fcl::CollisionGeometry<S>> shape;
  std::vector<Point> points;
};

/// Some of its sizes are 0.
template <typename S>
Sample<S> makeSample(int kind, double size, Random& random) {
  const auto side = [&] {
    return static_cast<S>(random.below(8) == 0 ? 0 : size * random.between(0.1, 1));
  };
  S a = side(), b = side(), c = side();
  if (kind == kCube) b = c = a;
  std::vector<Point> points;
  // A circle of points in a disc, turned by an angle that is no multiple of a quarter.
  const auto addDisc = [&](Real radius, Real height) {
    for (int i = 0; i < 8; ++i) {
      const Real angle = i + Real(random.unit());
      points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), height);
    }
  };
  switch (kind) {
    case kBox:
    case kCube:
      for (int i = 0; i < 8; ++i) {
        const Point corner(i % 2 == 0 ? -1 : 1, i / 2 % 2 == 0 ? -1 : 1, i / 4 == 0 ? -1 : 1);
        points.emplace_back(Point(a, b, c).cwiseProduct(corner) / 2);
      }
      return {std::make_shared<fcl::Box<S>>(a, b, c), points};
    case kCylinder:
      addDisc(a, Real(b) / 2);
      addDisc(a, -Real(b) / 2);
      return {std::make_shared<fcl::Cylinder<S>>(a, b), points};
    case kCone:
      addDisc(a, -Real(b) / 2);
      points.emplace_back(0, 0, Real(b) / 2);
      return {std::make_shared<fcl::Cone<S>>(a, b), points};
    case kEllipsoid:
      for (int i = 0; i < 20; ++i) {
        const Point direction = random.direction().cast<Real>();
        points.emplace_back(Point(a, b, c).cwiseProduct(direction) * (1 - 1e-15L));
      }
      return {std::make_shared<fcl::Ellipsoid<S>>(a, b, c), points};
    default:
      break;
  }
  const auto corners = std::make_shared<std::vector<fcl::Vector3<S>>>();
  const Eigen::Vector3d center = random.inCube(2 * size);
  for (int i = 0; i < (kind == kTriangle ? 3 : 4); ++i) {
    corners->emplace_back((center + random.inCube(size)).template cast<S>());
    points.push_back(corners->back().template cast<Real>());
  }
  if (kind == kTriangle) {
    return {std::make_shared<fcl::TriangleP<S>>((*corners)[0], (*corners)[1], (*corners)[2]),
            points};
  }
  const auto faces = std::make_shared<std::vector<int>>(
      std::vector<int>{3, 0, 1, 2, 3, 0, 3, 1, 3, 1, 3, 2, 3, 2, 3, 0});
  return {std::make_shared<fcl::Convex<S>>(corners, 4, faces), points};
}

constexpr std::size_t kAnyTurn = 4;

/// Turned not at all, hardly, by a quarter, with a rotation that has drifted, or anyhow, as `i`
/// counts.
template <typename S>
fcl::Transform3<S> makePose(std::size_t i, const Eigen::Vector3d& position, Random& random) {
  fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
  pose.translation() = position.template cast<S>();
  Eigen::Matrix3d turn = random.rotation().toRotationMatrix();
  const double tiny = std::is_same_v<S, float> ? 2e-6 : 2e-13;
  if (i % 5 == 0) turn.setIdentity();
  if (i % 5 == 1) turn = Eigen::AngleAxisd(tiny, random.direction()).toRotationMatrix();
  if (i % 5 == 2) turn = Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitX());
  // Within what is taken for rounding.
  if (i % 5 == 3) turn *= 1 + 4e-4;
  pose.linear() = turn.template cast<S>();
  return pose;
}

/// Somewhere in a cube of this half side.
template <typename S>
fcl::Transform3<S> makePose(std::size_t i, Random& random, double half_side) {
  const Eigen::Vector3d position = random.inCube(half_side);
  return makePose<S>(i, position, random);
}

}  // namespace fcl_fibers::test
