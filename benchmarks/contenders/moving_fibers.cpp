// SPDX-License-Identifier: BSD-3-Clause
#include "contenders/moving_fibers.h"

#include <cstdint>
#include <stdexcept>
#include <utility>

#include <fcl/geometry/shape/capsule.h>

namespace fcl_fibers::benchmarks {
namespace {

const fcl::Capsuled& shape(const CapsuleObject& object) {
  return static_cast<const fcl::Capsuled&>(*object.collisionGeometry());
}

}  // namespace

fcl::AABBd CapsuleObject::tightBox() const {
  const fcl::Capsuled& capsule = shape(*this);
  const fcl::Vector3d extent =
      (0.5 * capsule.lz * t.linear().col(2).cwiseAbs()).array() + capsule.radius;
  fcl::AABBd box;
  box.min_ = t.translation() - extent;
  box.max_ = t.translation() + extent;
  return box;
}

Capsule CapsuleObject::capsule() const {
  const fcl::Vector3d half = 0.5 * shape(*this).lz * t.linear().col(2);
  return {t.translation() - half, t.translation() + half, shape(*this).radius};
}

MovingFibers::MovingFibers(std::string name, const FiberPolylines& frame0,
                           const FiberPolylines& frame1)
    : name_(std::move(name)) {
  addFrame(frame0);
  addFrame(frame1);
  for (std::unique_ptr<Object>& object : makeObjects<double>(frame0)) {
    // The capsule was made for this object; FCL hands it out as const only.
    auto geometry = std::const_pointer_cast<fcl::CollisionGeometryd>(object->collisionGeometry());
    const fcl::Transform3d pose = object->getTransform();
    object.reset();
    capsule_objects_.push_back(std::make_unique<CapsuleObject>(geometry, pose));
    CapsuleObject* const capsule_object = capsule_objects_.back().get();
    capsule_object->setUserData(reinterpret_cast<void*>(objects_.size()));
    objects_.push_back(capsule_object);
  }
  fibers_ = objectsByFiber(frame0, objects_);
}

void MovingFibers::addFrame(const FiberPolylines& frame) {
  poses_.push_back(segmentPoses<double>(frame));
  if (poses_.back().size() != poses_.front().size()) {
    throw std::invalid_argument("MovingFibers: the frames differ in their segments");
  }
}

std::size_t MovingFibers::index(const Object* object) {
  return reinterpret_cast<std::uintptr_t>(object->getUserData());
}

std::vector<Capsule> MovingFibers::capsules() const {
  std::vector<Capsule> capsules;
  capsules.reserve(segmentCount());
  for (std::size_t i = 0; i < segmentCount(); ++i) {
    capsules.push_back(capsule_objects_[i]->capsule());
  }
  return capsules;
}

void MovingFibers::setPoses(int frame) {
  const std::vector<fcl::Transform3d>& poses = poses_[static_cast<std::size_t>(frame)];
  for (std::size_t i = 0; i < segmentCount(); ++i) objects_[i]->setTransform(poses[i]);
  frame_ = frame;
  boxes_ = Boxes::kNone;
}

void MovingFibers::computeBoxes(Boxes boxes) {
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

void MovingFibers::bringTo(int frame, Boxes boxes) {
  if (frame_ != frame) setPoses(frame);
  // A program that makes no boxes has FCL's. Those of another contender would cost ours twice the
  // update: it would look for what a program has added to FCL's, and a tight box is none of these.
  if (boxes == Boxes::kNone) boxes = Boxes::kStock;
  if (boxes_ != boxes) computeBoxes(boxes);
}

std::vector<std::uint32_t> MovingFibers::nextInFiber() const {
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

void MovingFibers::keepFirst(std::size_t fiber_count) {
  std::size_t segments = 0;
  for (std::size_t f = 0; f < fiber_count; ++f) segments += fibers_[f].objects.size();
  fibers_.resize(fiber_count);
  objects_.resize(segments);
}

}  // namespace fcl_fibers::benchmarks
