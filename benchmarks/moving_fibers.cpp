// SPDX-License-Identifier: BSD-3-Clause
#include "moving_fibers.h"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include <fcl/geometry/shape/capsule.h>
#include <fcl_fibers/scenes/cap.h>
#include <fcl_fibers/scenes/fiber_file.h>
#include <fcl_fibers/scenes/helix.h>

namespace fcl_fibers::benchmarks {
namespace {

const fcl::Capsuled& shape(const CapsuleObject& object) {
  return static_cast<const fcl::Capsuled&>(*object.collisionGeometry());
}

scenes::FiberScene swing(scenes::FiberScene scene, double angle) {
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const scenes::Point root = scene.points[scene.point_begin[f]];
    for (std::size_t i = scene.point_begin[f]; i < scene.point_begin[f + 1]; ++i) {
      scenes::Point& point = scene.points[i];
      const double y = point[1] - root[1];
      const double z = point[2] - root[2];
      point[1] = root[1] + std::cos(angle) * y - std::sin(angle) * z;
      point[2] = root[2] + std::sin(angle) * y + std::cos(angle) * z;
    }
  }
  return scene;
}

}  // namespace

void CapsuleObject::computeTightAABB() { aabb = tightBox(); }

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

MovingFibers::MovingFibers(std::string name, const scenes::FiberScene& frame0,
                           const scenes::FiberScene& frame1)
    : name_(std::move(name)) {
  addFrame(frame0);
  addFrame(frame1);
  for (std::unique_ptr<Object>& object : scenes::makeObjects<double>(frame0)) {
    // The capsule was made for this object; FCL hands it out as const only.
    auto geometry = std::const_pointer_cast<fcl::CollisionGeometryd>(object->collisionGeometry());
    const fcl::Transform3d pose = object->getTransform();
    object.reset();
    capsule_objects_.push_back(std::make_unique<CapsuleObject>(geometry, pose));
    CapsuleObject* const capsule_object = capsule_objects_.back().get();
    capsule_object->setUserData(reinterpret_cast<void*>(objects_.size()));
    objects_.push_back(capsule_object);
  }
  fibers_ = scenes::objectsByFiber(frame0, objects_);
}

void MovingFibers::addFrame(const scenes::FiberScene& frame) {
  poses_.push_back(scenes::segmentPoses<double>(frame));
  if (poses_.back().size() != poses_.front().size()) {
    throw std::invalid_argument("MovingFibers: the frames differ in their segments");
  }
}

std::string MovingFibers::name() const {
  const std::size_t segments = fiberCount() == 0 ? 0 : segmentCount() / fiberCount();
  return name_ + "/fibers:" + std::to_string(fiberCount()) +
         "/segments:" + std::to_string(segments);
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
  if (boxes_ != boxes) computeBoxes(boxes);
}

void MovingFibers::keepFirst(std::size_t fiber_count) {
  std::size_t segments = 0;
  for (std::size_t f = 0; f < fiber_count; ++f) segments += fibers_[f].objects.size();
  fibers_.resize(fiber_count);
  objects_.resize(segments);
}

MovingFibers makeMovingStrand(int fibers, int segments, unsigned long long seed) {
  scenes::HelixParameters parameters;
  parameters.fibers = fibers;
  parameters.segments = segments;
  parameters.seed = seed;
  const scenes::FiberScene frame0 = scenes::makeHelix(parameters);
  parameters.frame = 1;
  return MovingFibers("strand", frame0, scenes::makeHelix(parameters));
}

MovingFibers makeMovingScalp(int fibers, int segments, unsigned long long seed) {
  scenes::CapParameters parameters;
  parameters.fibers = fibers;
  parameters.segments = segments;
  parameters.seed = seed;
  const scenes::FiberScene frame0 = scenes::makeCap(parameters);
  parameters.frame = 1;
  return MovingFibers("scalp", frame0, scenes::makeCap(parameters));
}

MovingFibers makeMovingAssembly(const scenes::PaperDynamic& assembly,
                                const std::vector<int>& states) {
  MovingFibers moving("dynamic", assembly.scene(states.at(0)), assembly.scene(states.at(1)));
  for (std::size_t i = 2; i < states.size(); ++i) moving.addFrame(assembly.scene(states[i]));
  return moving;
}

MovingFibers makeSwingingFibers(std::string name, const scenes::FiberScene& scene) {
  return MovingFibers(std::move(name), scene, swing(scene, 0.01));
}

scenes::FiberScene readHair(const HairRequest& hair, int frame) {
  scenes::FiberFileOptions options;
  options.radius = hair.radius;
  const scenes::FiberFile file = scenes::readFibers(hair.path, options);
  if (!file.has_radius) {
    throw std::invalid_argument("--hair=" + hair.path +
                                ": the file holds no radius; give --radius R, in the file's unit");
  }
  for (const std::string& warning : file.warnings) {
    if (frame == 0) std::fprintf(stderr, "%s: %s\n", hair.path.c_str(), warning.c_str());
  }
  return swing(file.scene, 0.01 * frame);
}

MovingFibers readMovingHair(const HairRequest& hair) {
  return MovingFibers(hairName(hair), readHair(hair, 0), readHair(hair, 1));
}

std::string hairName(const HairRequest& hair) {
  return std::filesystem::path(hair.path).stem().string();
}

}  // namespace fcl_fibers::benchmarks
