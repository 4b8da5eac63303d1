// SPDX-License-Identifier: BSD-3-Clause
//
// Objects for fuzz_manager, and how far apart they are, by brute force.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

// BVH_model.h calls a function that it does not declare.
#include <fcl/math/bv/utility.h>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision_object.h>
#include <fcl_fibers/fiber_manager_options.h>
#include <fuzzer/FuzzedDataProvider.h>

#include "fuzz_input.h"
#include "support/exact_geometry.h"
#include "support/least_box.h"

namespace fcl_fibers::fuzz {

constexpr int kNumbers = 60;  // see readNumber(); most scenes have to be tame to be judged

template <typename S>
using Model = fcl::BVHModel<fcl::AABB<S>>;

/// The model of an object, or null.
template <typename S>
Model<S>* modelOf(const fcl::CollisionObject<S>& object) {
  if (object.getNodeType() != fcl::BV_AABB) return nullptr;
  return const_cast<Model<S>*>(static_cast<const Model<S>*>(object.collisionGeometry().get()));
}

template <typename S>
std::vector<fcl::Vector3<S>> readPoints(FuzzedDataProvider& data, int count) {
  std::vector<fcl::Vector3<S>> points(static_cast<std::size_t>(count));
  for (auto& point : points) {
    for (int axis = 0; axis < 3; ++axis) point[axis] = readNumber<S>(data, kNumbers);
  }
  return points;
}

/// Whether it is a model that distanceFrom() does not measure.
template <typename S>
bool isCloud(const fcl::CollisionObject<S>& object) {
  const Model<S>* model = modelOf(object);
  return model != nullptr && model->num_tris == 0;
}

template <typename S>
bool isCapsule(const fcl::CollisionObject<S>& object) {
  return object.getNodeType() == fcl::GEOM_CAPSULE || object.getNodeType() == fcl::GEOM_SPHERE;
}

/// What a manager was told of its objects.
struct MeetingRules {
  std::map<const void*, int> group;                 ///< of fibers
  std::map<const void*, std::uint32_t> meets;       ///< likewise
  std::map<const void*, std::uint32_t> categories;  ///< of obstacles
  std::set<const void*> solids;                     ///< likewise

  struct Place {
    int fiber, segment, fiber_size;
    bool is_closed;
  };
  std::map<const void*, Place> place;  ///< of fibers
  int fibers = 0;

  /// Nothing if the arc length decides.
  std::optional<bool> areNeighbors(const void* a, const void* b,
                                   const FiberManagerOptions& options) const {
    const auto first = place.find(a), second = place.find(b);
    if (first == place.end() || second == place.end()) return false;
    const Place &p = first->second, &q = second->second;
    if (p.fiber != q.fiber) return false;
    const int apart = std::abs(p.segment - q.segment);
    const int reach = options.ignored_neighbors;
    if (apart <= reach || (p.is_closed && p.fiber_size - apart <= reach)) return true;
    if (options.ignored_arc_length > 0) return std::nullopt;
    return false;
  }
  void forget(const void* object) {
    place.erase(object);
    group.erase(object);
    meets.erase(object);
    categories.erase(object);
    solids.erase(object);
  }
  bool shareGroup(const void* a, const void* b) const {
    const auto p = group.find(a), q = group.find(b);
    return p != group.end() && q != group.end() && p->second != 0 && p->second == q->second;
  }
  bool mayMeet(const void* a, const void* b) const {
    if (meets.count(a) == meets.count(b)) return true;
    const auto fiber = meets.count(a) > 0 ? meets.find(a) : meets.find(b);
    const auto obstacle = categories.find(meets.count(a) > 0 ? b : a);
    return obstacle == categories.end() ? fiber->second != 0
                                        : (fiber->second & obstacle->second) != 0;
  }
};

/// A model of a few triangles, a closed one of four, or a cloud of points.
template <typename S>
std::shared_ptr<Model<S>> readModel(FuzzedDataProvider& data) {
  const int count = data.ConsumeIntegralInRange(1, 6);
  const auto points = readPoints<S>(data, count);
  std::vector<fcl::Triangle> triangles;
  if (count == 4 && data.ConsumeBool()) {
    triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  } else {
    const auto corner = [&] {
      return data.ConsumeIntegralInRange<std::size_t>(0, points.size() - 1);
    };
    for (int i = data.ConsumeIntegralInRange(0, 6); i > 0; --i) {
      const std::size_t a = corner(), b = corner(), c = corner();
      triangles.emplace_back(a, b, c);
    }
  }
  auto model = std::make_shared<Model<S>>();
  model->beginModel();
  triangles.empty() ? model->addSubModel(points) : model->addSubModel(points, triangles);
  model->endModel();
  return model;
}

template <typename S>
fcl::Transform3<S> readPose(FuzzedDataProvider& data) {
  fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
  if (data.ConsumeBool()) {
    const double w = data.ConsumeIntegral<std::int8_t>(), x = data.ConsumeIntegral<std::int8_t>();
    const double y = data.ConsumeIntegral<std::int8_t>(), z = data.ConsumeIntegral<std::int8_t>();
    const Eigen::Quaterniond turn(w + 0.5, x, y, z);
    pose.linear() = turn.normalized().toRotationMatrix().template cast<S>();
  }
  if (data.ConsumeIntegralInRange(0, 31) == 0) {
    pose.linear()(data.ConsumeIntegralInRange(0, 2), data.ConsumeIntegralInRange(0, 2)) =
        readNumber<S>(data, kNumbers);
  }
  for (int axis = 0; axis < 3; ++axis) pose.translation()[axis] = readNumber<S>(data, kNumbers);
  return pose;
}

/// The hull of four points.
template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> makeConvex(S a, S b) {
  using V = fcl::Vector3<S>;
  const auto points = std::make_shared<std::vector<V>>(
      std::vector<V>{V(0, 0, 0), V(a, 0, 0), V(0, b, 0), V(0, a, b)});
  const auto faces = std::make_shared<std::vector<int>>(
      std::vector<int>{3, 0, 2, 1, 3, 0, 1, 3, 3, 1, 2, 3, 3, 2, 0, 3});
  return std::make_shared<fcl::Convex<S>>(points, 4, faces);
}

template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> readSolid(FuzzedDataProvider& data, S a, S b) {
  switch (readByte(data) % 6) {
    case 1:
      return std::make_shared<fcl::Cylinder<S>>(a, b);
    case 2:
      return std::make_shared<fcl::Cone<S>>(a, b);
    case 3:
      return std::make_shared<fcl::Ellipsoid<S>>(a, b, a);
    case 4:
      return makeConvex(a, b);
    case 5:
      return std::make_shared<fcl::Plane<S>>(fcl::Vector3<S>::UnitZ(), a);
    default:
      return std::make_shared<fcl::Box<S>>(a, b, a);
  }
}

template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> readShape(FuzzedDataProvider& data) {
  const S radius = std::fabs(readNumber<S>(data, kNumbers)) / 4,
          length = std::fabs(readNumber<S>(data, kNumbers));
  switch (data.ConsumeIntegralInRange(0, 7)) {
    case 3:
      return readModel<S>(data);
    case 0:
      return std::make_shared<fcl::Sphere<S>>(radius);
    case 1:
      return readSolid(data, radius, length);
    case 2:
      return std::make_shared<fcl::Halfspace<S>>(fcl::Vector3<S>::UnitZ(), radius);
    default:
      return std::make_shared<fcl::Capsule<S>>(radius, length);
  }
}

/// Replaces the points of a model, which now and then remains unfinished until the next call.
template <typename S>
void movePoints(FuzzedDataProvider& data, Model<S>& model) {
  if (model.build_state != fcl::BVH_BUILD_STATE_REPLACE_BEGUN) {
    model.beginReplaceModel();
    model.replaceSubModel(readPoints<S>(data, model.num_vertices));
    if (data.ConsumeIntegralInRange(0, 7) == 0) return;
  }
  model.endReplaceModel();
  if (data.ConsumeBool()) model.computeLocalAABB();
}

/// The largest coordinate of an object, at least.
template <typename S>
double sizeOf(const fcl::CollisionObject<S>& object) {
  const double size = static_cast<double>(object.getTranslation().cwiseAbs().maxCoeff());
  if (const Model<S>* model = modelOf(object)) {
    double most = 0;
    for (int i = 0; i < model->num_vertices; ++i) {
      most = std::max(most, static_cast<double>(model->vertices[i].cwiseAbs().maxCoeff()));
    }
    return size + 3 * most;
  }
  const auto& shape = *object.collisionGeometry();
  if (object.getNodeType() == fcl::GEOM_HALFSPACE) {
    return size + std::fabs(static_cast<double>(static_cast<const fcl::Halfspace<S>&>(shape).d));
  }
  if (object.getNodeType() == fcl::GEOM_PLANE) {
    return size + std::fabs(static_cast<double>(static_cast<const fcl::Plane<S>&>(shape).d));
  }
  return size + static_cast<double>(shape.aabb_center.norm() + shape.aabb_radius);
}

/// How far a capsule or sphere is from another object, by what counts of that; negative if they
/// overlap.
template <typename S>
test::Real gapOf(const fcl::CollisionObject<S>& object, const fcl::CollisionObject<S>& other) {
  if (isCapsule(other)) return test::exactGap(object, other);
  const test::ExactCapsule a = test::exactCapsule(object);
  test::Real distance = test::distanceFrom(other)(a.a, a.b);
  const bool is_bounded =
      other.getNodeType() != fcl::GEOM_PLANE && other.getNodeType() != fcl::GEOM_HALFSPACE;
  if (modelOf(other) == nullptr && is_bounded) {
    distance = std::max(distance, test::segmentBoxDistance(a.a, a.b, test::leastBox(other)));
  }
  return distance - a.radius;
}

}  // namespace fcl_fibers::fuzz
