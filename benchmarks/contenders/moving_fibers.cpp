// SPDX-License-Identifier: BSD-3-Clause
#include "contenders/moving_fibers.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>

#include <fcl/geometry/shape/capsule.h>

namespace fcl_fibers::benchmarks {
template <typename S>
const fcl::Capsule<S>& BasicCapsuleObject<S>::shape() const {
  return static_cast<const fcl::Capsule<S>&>(*this->collisionGeometry());
}

template <typename S>
fcl::AABB<S> BasicCapsuleObject<S>::tightBox() const {
  const fcl::Transform3<S>& pose = this->t;
  const fcl::Vector3<S> extent =
      (shape().lz / 2 * pose.linear().col(2).cwiseAbs()).array() + shape().radius;
  fcl::AABB<S> box;
  box.min_ = pose.translation() - extent;
  box.max_ = pose.translation() + extent;
  return box;
}

template <typename S>
Capsule BasicCapsuleObject<S>::capsule() const {
  const fcl::Transform3d pose = this->t.template cast<double>();
  const fcl::Vector3d half = 0.5 * static_cast<double>(shape().lz) * pose.linear().col(2);
  return {pose.translation() - half, pose.translation() + half,
          static_cast<double>(shape().radius)};
}

template <typename S>
BasicMovingFibers<S>::BasicMovingFibers(std::string name, const FiberPolylines& frame0,
                                        const FiberPolylines& frame1)
    : name_(std::move(name)) {
  addFrame(frame0);
  addFrame(frame1);
  for (std::unique_ptr<Object>& object : makeObjects<S>(frame0)) {
    // The capsule was made for this object; FCL hands it out as const only.
    auto geometry = std::const_pointer_cast<fcl::CollisionGeometry<S>>(object->collisionGeometry());
    const fcl::Transform3<S> pose = object->getTransform();
    object.reset();
    capsule_objects_.push_back(std::make_unique<BasicCapsuleObject<S>>(geometry, pose));
    auto* const capsule_object = capsule_objects_.back().get();
    capsule_object->setUserData(reinterpret_cast<void*>(objects_.size()));
    objects_.push_back(capsule_object);
  }
  fibers_ = objectsByFiber(frame0, objects_);
}

template <typename S>
void BasicMovingFibers<S>::addFrame(const FiberPolylines& frame) {
  poses_.push_back(segmentPoses<S>(frame));
  if (poses_.back().size() != poses_.front().size()) {
    throw std::invalid_argument("MovingFibers: the frames differ in their segments");
  }
}

template <typename S>
std::vector<Capsule> BasicMovingFibers<S>::capsules() const {
  std::vector<Capsule> capsules;
  capsules.reserve(segmentCount());
  for (std::size_t i = 0; i < segmentCount(); ++i) {
    capsules.push_back(capsule_objects_[i]->capsule());
  }
  return capsules;
}

template <typename S>
double BasicMovingFibers<S>::rounding() const {
  double extent = 0;
  for (const Object* const object : objects_) {
    extent = std::max(
        extent, static_cast<double>(object->getTranslation().template lpNorm<Eigen::Infinity>()));
  }
  // The pose, the box of each of the two, and their sums.
  return 8 * static_cast<double>(std::numeric_limits<S>::epsilon()) * extent;
}

template <typename S>
void BasicMovingFibers<S>::setPoses(int frame) {
  const std::vector<fcl::Transform3<S>>& poses = poses_[static_cast<std::size_t>(frame)];
  for (std::size_t i = 0; i < segmentCount(); ++i) objects_[i]->setTransform(poses[i]);
  frame_ = frame;
  boxes_ = Boxes::kNone;
}

template <typename S>
void BasicMovingFibers<S>::computeBoxes(Boxes boxes) {
  if (boxes == Boxes::kNone) return;
  for (std::size_t i = 0; i < segmentCount(); ++i) {
    if (boxes == Boxes::kStock) {
      objects_[i]->computeAABB();
    } else {
      capsule_objects_[i]->computeTightAABB();
    }
  }
  boxes_ = boxes;
}

template <typename S>
void BasicMovingFibers<S>::bringTo(int frame, Boxes boxes) {
  if (frame_ != frame) setPoses(frame);
  // A program that makes no boxes has FCL's. Those of another contender would cost ours twice the
  // update: it would look for what a program has added to FCL's, and a tight box is none of these.
  if (boxes == Boxes::kNone) boxes = Boxes::kStock;
  if (boxes_ != boxes) computeBoxes(boxes);
}

template <typename S>
std::vector<std::uint32_t> BasicMovingFibers<S>::nextInFiber() const {
  std::vector<std::uint32_t> next(capsule_objects_.size());
  for (std::size_t i = 0; i < next.size(); ++i) next[i] = static_cast<std::uint32_t>(i);
  for (const Fiber& fiber : fibers_) {
    const std::size_t count = fiber.objects.size();
    const bool closed = count > 2 && fiber.ends == FiberEnds::kClosed;
    for (std::size_t i = 0; i + (closed ? 0 : 1) < count; ++i) {
      next[index(fiber.objects[i])] =
          static_cast<std::uint32_t>(index(fiber.objects[(i + 1) % count]));
    }
  }
  return next;
}

template <typename S>
void BasicMovingFibers<S>::keepFirst(std::size_t fiber_count) {
  std::size_t segments = 0;
  for (std::size_t f = 0; f < fiber_count; ++f) segments += fibers_[f].objects.size();
  fibers_.resize(fiber_count);
  objects_.resize(segments);
}

template class BasicCapsuleObject<float>;
template class BasicCapsuleObject<double>;
template class BasicMovingFibers<float>;
template class BasicMovingFibers<double>;

}  // namespace fcl_fibers::benchmarks
