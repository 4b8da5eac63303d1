// SPDX-License-Identifier: BSD-3-Clause
#include "support/scene.h"

#include <cmath>
#include <numeric>
#include <type_traits>
#include <utility>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/octree/octree.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>

namespace fcl_fibers::test {

template <typename S>
fcl::Transform3<S> makePose(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& position) {
  fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
  pose.linear() = rotation.normalized().toRotationMatrix().template cast<S>();
  pose.translation() = position.template cast<S>();
  return pose;
}

template <typename S>
void moveTo(fcl::CollisionObject<S>& object, const fcl::Transform3<S>& pose) {
  object.setTransform(pose);
  object.computeAABB();
}

template <typename S>
void jolt(fcl::CollisionObject<S>& object, Random& random, double distance, double angle) {
  const Eigen::Matrix3d rotation = object.getRotation().template cast<double>();
  const Eigen::Vector3d position = object.getTranslation().template cast<double>();
  const Eigen::Quaterniond turn = random.rotation(angle);
  const Eigen::Vector3d step = random.inCube(distance);
  moveTo(object, makePose<S>(turn * Eigen::Quaterniond(rotation), position + step));
}

template <typename S>
void translate(fcl::CollisionObject<S>& object, const Eigen::Vector3d& by) {
  fcl::Transform3<S> pose = object.getTransform();
  pose.translation() += by.template cast<S>();
  moveTo(object, pose);
}

template <typename S>
fcl::CollisionObject<S>* Scene<S>::add(std::shared_ptr<Geometry> geometry, const Pose& pose) {
  owned_.push_back(std::make_unique<Object>(geometry, pose));
  geometries_.push_back(std::move(geometry));
  objects_.push_back(owned_.back().get());
  return objects_.back();
}

template <typename S>
fcl::CollisionObject<S>* Scene<S>::addCapsule(const Pose& pose, double radius, double length) {
  return add(std::make_shared<fcl::Capsule<S>>(static_cast<S>(radius), static_cast<S>(length)),
             pose);
}

template <typename S>
fcl::CollisionObject<S>* Scene<S>::addCapsule(const Eigen::Vector3d& from,
                                              const Eigen::Vector3d& to, double radius) {
  // A quotient of its own: squares of tiny or huge lengths are out of range. No function of the C
  // library takes part, nor any order of sums that Eigen chooses: they differ between platforms.
  const Eigen::Vector3d apart = to - from;
  const double size = apart.cwiseAbs().maxCoeff();
  const Eigen::Vector3d part = size > 0 ? Eigen::Vector3d(apart / size) : Eigen::Vector3d::UnitZ();
  const double norm = std::sqrt(part.x() * part.x() + part.y() * part.y() + part.z() * part.z());
  const Eigen::Vector3d z = part / norm;
  // The basis of Duff et al., Building an Orthonormal Basis, Revisited, 2017.
  const double sign = std::copysign(1.0, z.z()), p = -1 / (sign + z.z()), q = z.x() * z.y() * p;
  Pose pose = Pose::Identity();
  pose.linear().col(0) =
      Eigen::Vector3d(1 + sign * z.x() * z.x() * p, sign * q, -sign * z.x()).template cast<S>();
  pose.linear().col(1) = Eigen::Vector3d(q, sign + z.y() * z.y() * p, -z.y()).template cast<S>();
  pose.linear().col(2) = z.template cast<S>();
  pose.translation() = (from + apart / 2).template cast<S>();
  return addCapsule(pose, radius, size * norm);
}

template <typename S>
fcl::CollisionObject<S>* Scene<S>::addSphere(const Eigen::Vector3d& center, double radius) {
  return add(std::make_shared<fcl::Sphere<S>>(static_cast<S>(radius)),
             makePose<S>(Eigen::Quaterniond::Identity(), center));
}

template <typename S>
fcl::CollisionObject<S>* Scene<S>::addBox(const Eigen::Vector3d& center,
                                          const Eigen::Quaterniond& rotation,
                                          const Eigen::Vector3d& sides) {
  const fcl::Vector3<S> rounded = sides.template cast<S>();
  return add(std::make_shared<fcl::Box<S>>(rounded), makePose<S>(rotation, center));
}

template <typename S>
fcl::CollisionObject<S>* Scene<S>::addMesh(const Eigen::Vector3d& center, double radius) {
  if constexpr (std::is_same_v<S, float>) {
    // A manager sees the same box of either, and FCL's library has meshes of doubles only: those of
    // floats would be compiled here, for half a minute.
    return addConvex(center, radius);
  } else {
    auto mesh = std::make_shared<fcl::BVHModel<fcl::AABB<S>>>();
    const fcl::Vector3<S> x = fcl::Vector3<S>::UnitX() * radius;
    const fcl::Vector3<S> y = fcl::Vector3<S>::UnitY() * radius;
    const fcl::Vector3<S> z = fcl::Vector3<S>::UnitZ() * radius;
    mesh->beginModel();
    for (const S sx : {S(-1), S(1)}) {
      for (const S sy : {S(-1), S(1)}) {
        for (const S sz : {S(-1), S(1)}) mesh->addTriangle(sx * x, sy * y, sz * z);
      }
    }
    mesh->endModel();
    return add(std::move(mesh), makePose<S>(Eigen::Quaterniond::Identity(), center));
  }
}

template <typename S>
fcl::CollisionObject<S>* Scene<S>::addConvex(const Eigen::Vector3d& center, double radius) {
  const auto r = static_cast<S>(radius);
  using Corner = fcl::Vector3<S>;
  const auto corners = std::make_shared<const std::vector<Corner>>(
      std::vector<Corner>{Corner(r, 0, 0), Corner(-r, 0, 0), Corner(0, r, 0), Corner(0, -r, 0),
                          Corner(0, 0, r), Corner(0, 0, -r)});
  // Of each face, the number of corners and the corners.
  const auto faces = std::make_shared<const std::vector<int>>(
      std::vector<int>{3, 0, 2, 4, 3, 2, 1, 4, 3, 1, 3, 4, 3, 3, 0, 4,
                       3, 2, 0, 5, 3, 1, 2, 5, 3, 3, 1, 5, 3, 0, 3, 5});
  return add(std::make_shared<fcl::Convex<S>>(corners, 8, faces),
             makePose<S>(Eigen::Quaterniond::Identity(), center));
}

template <typename S>
fcl::CollisionObject<S>* Scene<S>::addOctree(const Eigen::Vector3d& center, double half_side) {
  // The root is 2^16 finest cells wide.
  const auto tree = std::make_shared<octomap::OcTree>(std::ldexp(half_side, -15));
  const auto near_corner = static_cast<float>(half_side / 2);
  tree->updateNode(octomap::point3d(near_corner, near_corner, near_corner), true);
  return add(std::make_shared<fcl::OcTree<S>>(tree),
             makePose<S>(Eigen::Quaterniond::Identity(), center));
}

template <typename S>
fcl::CollisionObject<S>* Scene<S>::addHalfspace(const Eigen::Vector3d& normal, double offset) {
  const fcl::Vector3<S> rounded = normal.template cast<S>();
  return add(std::make_shared<fcl::Halfspace<S>>(rounded, static_cast<S>(offset)),
             Pose::Identity());
}

template <typename S>
fcl::CollisionObject<S>* Scene<S>::addPlane(const Eigen::Vector3d& normal, double offset) {
  const fcl::Vector3<S> rounded = normal.template cast<S>();
  return add(std::make_shared<fcl::Plane<S>>(rounded, static_cast<S>(offset)), Pose::Identity());
}

template <typename S>
std::vector<fcl::CollisionObject<S>*> Scene<S>::addFiber(const std::vector<Eigen::Vector3d>& points,
                                                         double radius, FiberEnds ends) {
  std::vector<Object*> fiber;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    fiber.push_back(addCapsule(points[i], points[i + 1], radius));
  }
  fibers_.push_back(fiber);
  ends_.push_back(ends);
  return fiber;
}

template <typename S>
std::vector<fcl::CollisionObject<S>*> Scene<S>::loose() const {
  // Fibers are in the order of their objects.
  std::vector<Object*> loose;
  auto fiber = fibers_.begin();
  for (std::size_t i = 0; i < size();) {
    if (fiber != fibers_.end() && !fiber->empty() && objects_[i] == fiber->front()) {
      i += (fiber++)->size();
    } else {
      loose.push_back(objects_[i++]);
    }
  }
  return loose;
}

template <typename S>
fcl::Capsule<S>& Scene<S>::capsule(std::size_t i) {
  return dynamic_cast<fcl::Capsule<S>&>(*geometries_[i]);
}

template <typename S>
Scene<S> Scene<S>::reallocated(std::uint64_t seed) const {
  Random random(seed);
  std::vector<std::size_t> order(size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  random.shuffle(order);

  Scene copy;
  copy.owned_.resize(size());
  copy.objects_.resize(size());
  copy.geometries_ = geometries_;
  for (const std::size_t i : order) {
    copy.owned_[i] = std::make_unique<Object>(*objects_[i]);
    copy.objects_[i] = copy.owned_[i].get();
  }
  std::size_t begin = 0;
  for (const auto& fiber : fibers_) {
    while (objects_[begin] != fiber.front()) ++begin;
    const auto first = copy.objects_.begin() + static_cast<std::ptrdiff_t>(begin);
    copy.fibers_.emplace_back(first, first + static_cast<std::ptrdiff_t>(fiber.size()));
  }
  copy.ends_ = ends_;
  return copy;
}

#define FCL_FIBERS_INSTANTIATE(S)                                                             \
  template class Scene<S>;                                                                    \
  template fcl::Transform3<S> makePose<S>(const Eigen::Quaterniond&, const Eigen::Vector3d&); \
  template void moveTo<S>(fcl::CollisionObject<S>&, const fcl::Transform3<S>&);               \
  template void jolt<S>(fcl::CollisionObject<S>&, Random&, double, double);                   \
  template void translate<S>(fcl::CollisionObject<S>&, const Eigen::Vector3d&);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::test
