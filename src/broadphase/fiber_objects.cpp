// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_objects.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/capsule.h>

#include "arguments.h"

namespace fcl_fibers {
namespace {

template <typename S>
struct PosedSegment {
  fcl::Transform3<S> pose;
  S length;
};

// Rotation that takes z to the unit vector `axis`: Duff et al., Building an Orthonormal Basis,
// Revisited, Journal of Computer Graphics Techniques, 2017, listing 3. It has no singular
// direction.
fcl::Matrix3<double> rotationOntoAxis(const fcl::Vector3<double>& axis) {
  const double x = axis.x(), y = axis.y(), z = axis.z();
  const double sign = std::copysign(1.0, z);
  const double a = -1 / (sign + z);
  const double b = x * y * a;
  fcl::Matrix3<double> rotation;
  rotation.col(0) << 1 + sign * x * x * a, sign * b, -sign * x;
  rotation.col(1) << b, sign + y * y * a, -y;
  rotation.col(2) = axis;
  return rotation;
}

// Computes in double and rounds to S at the end. The axis is the difference of the points divided
// by the length as S holds it. It is not normalised again, so that axis times length is the
// difference.
template <typename S>
PosedSegment<S> poseSegment(const Point& from, const Point& to) {
  using Vector = fcl::Vector3<double>;
  const Eigen::Map<const Vector> begin(from.data());
  const Eigen::Map<const Vector> end(to.data());
  PosedSegment<S> segment{fcl::Transform3<S>::Identity(), 0};
  segment.pose.translation() = (0.5 * (begin + end)).template cast<S>();

  const Vector difference = end - begin;
  const double largest = difference.cwiseAbs().maxCoeff();
  if (largest == 0) return segment;

  // Scaling by a power of two keeps the squares from overflow and underflow.
  int exponent = 0;
  std::frexp(largest, &exponent);
  const Vector scaled = difference.unaryExpr([=](double d) { return std::ldexp(d, -exponent); });
  // Eigen's order of this sum depends on the processor.
  double length =
      std::sqrt(scaled.x() * scaled.x() + scaled.y() * scaled.y() + scaled.z() * scaled.z());
  segment.length = static_cast<S>(std::ldexp(length, exponent));
  // A subnormal length has too few digits to be divided by.
  if (segment.length >= std::numeric_limits<S>::min()) {
    length = std::ldexp(static_cast<double>(segment.length), -exponent);
  }
  segment.pose.linear() = rotationOntoAxis(scaled / length).template cast<S>();
  return segment;
}

// The limit keeps lengths finite, which are at most 2 sqrt(3) times the largest coordinate.
template <typename S>
void requireCoordinates(const char* call, const FiberPolylines& scene) {
  fcl_fibers::requireCoordinates(
      call, scene, std::numeric_limits<S>::max() / 4,
      "give finite coordinates below a quarter of the scalar's largest number");
}

// Calls visit(first point's index) for every segment, fiber after fiber.
template <typename Visit>
void forEachSegment(const FiberPolylines& scene, const Visit& visit) {
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i) visit(i);
  }
}

}  // namespace

std::vector<std::pair<std::size_t, std::size_t>> joinedPoints(const FiberPolylines& scene) {
  std::vector<std::pair<std::size_t, std::size_t>> joined;
  if (scene.starts_at.empty() && scene.ends_at.empty()) return joined;
  requireFiberRanges("joinedPoints", scene);
  requireBranches("joinedPoints", scene);
  const std::vector<std::size_t>& begin = scene.point_begin;
  const auto isAlone = [&](std::size_t i) {
    return std::binary_search(begin.begin(), begin.end(), i) &&
           std::binary_search(begin.begin(), begin.end(), i + 1);
  };
  // The point of a fiber without segments leads to one that is the same, all others to themselves.
  std::vector<std::size_t> same(scene.points.size());
  std::iota(same.begin(), same.end(), std::size_t{0});
  const auto lastOf = [&](std::size_t i) {
    while (same[i] != i) i = same[i] = same[same[i]];
    return i;
  };
  const auto joinAll = [&](const std::vector<std::int32_t>& at, bool are_starts) {
    for (std::size_t f = 0; f < at.size(); ++f) {
      if (at[f] == -1) continue;
      const auto [p, q] = std::minmax({lastOf(are_starts ? begin[f] : begin[f + 1] - 1),
                                       lastOf(static_cast<std::size_t>(at[f]))});
      if (isAlone(q)) {
        same[q] = p;
      } else if (isAlone(p)) {
        same[p] = q;
      } else if (p != q) {
        joined.emplace_back(q, p);
      }
    }
  };
  joinAll(scene.starts_at, true);
  joinAll(scene.ends_at, false);
  std::sort(joined.begin(), joined.end());
  return joined;
}

template <typename S>
std::vector<fcl::Transform3<S>> segmentPoses(const FiberPolylines& scene) {
  requireFiberRanges("segmentPoses", scene);
  requireCoordinates<S>("segmentPoses", scene);

  std::vector<fcl::Transform3<S>> poses;
  poses.reserve(scene.segmentCount());
  forEachSegment(scene, [&](std::size_t i) {
    poses.push_back(poseSegment<S>(scene.points[i], scene.points[i + 1]).pose);
  });
  return poses;
}

template <typename S>
std::vector<std::unique_ptr<fcl::CollisionObject<S>>> makeObjects(const FiberPolylines& scene) {
  requireFiberRanges("makeObjects", scene);
  requireCoordinates<S>("makeObjects", scene);
  requireRadii<S>("makeObjects", scene);

  std::vector<std::unique_ptr<fcl::CollisionObject<S>>> objects;
  objects.reserve(scene.segmentCount());
  forEachSegment(scene, [&](std::size_t i) {
    const PosedSegment<S> segment = poseSegment<S>(scene.points[i], scene.points[i + 1]);
    const S radius = static_cast<S>(scene.radiusAt(i));
    objects.push_back(std::make_unique<fcl::CollisionObject<S>>(
        std::make_shared<fcl::Capsule<S>>(radius, segment.length), segment.pose));
  });
  return objects;
}

template <typename S>
void moveObjects(const FiberPolylines& scene,
                 const std::vector<std::unique_ptr<fcl::CollisionObject<S>>>& objects) {
  requireFiberRanges("moveObjects", scene);
  requireCoordinates<S>("moveObjects", scene);
  requireRadii<S>("moveObjects", scene);
  if (objects.size() != scene.segmentCount()) {
    throw std::invalid_argument("moveObjects: there are " + std::to_string(objects.size()) +
                                " objects and " + std::to_string(scene.segmentCount()) +
                                " segments; pass all objects of makeObjects(), and as many points");
  }
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (objects[i] != nullptr && objects[i]->getNodeType() == fcl::GEOM_CAPSULE) continue;
    throw std::invalid_argument("moveObjects: object " + std::to_string(i) +
                                (objects[i] == nullptr ? " is null" : " is not a capsule") +
                                "; pass the objects as makeObjects() made them");
  }

  auto next = objects.begin();
  forEachSegment(scene, [&](std::size_t i) {
    fcl::CollisionObject<S>& object = **next++;
    const PosedSegment<S> segment = poseSegment<S>(scene.points[i], scene.points[i + 1]);
    // FCL hands geometry out as const only. makeObjects() made the capsule, and not as const.
    auto& capsule = const_cast<fcl::Capsule<S>&>(
        static_cast<const fcl::Capsule<S>&>(*object.collisionGeometry()));
    capsule.radius = static_cast<S>(scene.radiusAt(i));
    capsule.lz = segment.length;
    capsule.computeLocalAABB();
    object.setTransform(segment.pose);
    object.computeAABB();
  });
}

template std::vector<fcl::Transform3<float>> segmentPoses<float>(const FiberPolylines&);
template std::vector<fcl::Transform3<double>> segmentPoses<double>(const FiberPolylines&);
template std::vector<std::unique_ptr<fcl::CollisionObject<float>>> makeObjects<float>(
    const FiberPolylines&);
template std::vector<std::unique_ptr<fcl::CollisionObject<double>>> makeObjects<double>(
    const FiberPolylines&);
template void moveObjects<float>(const FiberPolylines&,
                                 const std::vector<std::unique_ptr<fcl::CollisionObject<float>>>&);
template void moveObjects<double>(
    const FiberPolylines&, const std::vector<std::unique_ptr<fcl::CollisionObject<double>>>&);

}  // namespace fcl_fibers
