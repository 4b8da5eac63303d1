// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/narrowphase/collision_object.h>
#include <fcl_fibers/fiber_objects.h>

#include <fcl_fibers/benchmark/judge.h>
#include <fcl_fibers/benchmark/managers.h>

namespace fcl_fibers::benchmarks {

/// A capsule whose box can be made tight, which FCL's own object cannot.
template <typename S>
class BasicCapsuleObject : public fcl::CollisionObject<S> {
 public:
  using fcl::CollisionObject<S>::CollisionObject;
  void computeTightAABB() { this->aabb = tightBox(); }

  /// End points +- radius, where the object is now.
  fcl::AABB<S> tightBox() const;

  /// Where the object is now.
  Capsule capsule() const;

 private:
  const fcl::Capsule<S>& shape() const;
};

/// The objects that all managers share, and the frames of their motion.
template <typename S>
class BasicMovingFibers {
 public:
  using Object = fcl::CollisionObject<S>;

  /// Frames that there are at least, and that managers are checked in.
  static constexpr int kFrames = 2;

  /// Both scenes have the same fibers; all objects start in frame 0, in their order in the scene.
  BasicMovingFibers(std::string name, const FiberPolylines& frame0, const FiberPolylines& frame1);

  /// A further frame of the same fibers. Capsules keep their lengths of frame 0.
  void addFrame(const FiberPolylines& frame);
  int frameCount() const { return static_cast<int>(poses_.size()); }

  const std::string& name() const { return name_; }
  std::size_t fiberCount() const { return fibers_.size(); }
  std::size_t segmentCount() const { return objects_.size(); }

  const std::vector<Object*>& objects() const { return objects_; }

  /// As registerFiber() takes it.
  using Fiber = FiberObjects<Object>;
  const std::vector<Fiber>& fibers() const { return fibers_; }

  /// The object's number in objects().
  static std::size_t index(const Object* object) {
    return reinterpret_cast<std::uintptr_t>(object->getUserData());
  }

  /// The number of the segment that follows each one in its fiber, or its own at the end of one.
  std::vector<std::uint32_t> nextInFiber() const;

  /// Capsules of all objects where they are now.
  std::vector<Capsule> capsules() const;

  /// By how much a manager may err in the distance of two capsules, as its scalar rounds their
  /// poses and boxes.
  double rounding() const;

  void setPoses(int frame);
  void computeBoxes(Boxes boxes);

  /// Poses and boxes as asked for, at no cost if they are so already; kNone: FCL's of this pose.
  void bringTo(int frame, Boxes boxes);

  /// Leaves all fibers but the first ones out.
  void keepFirst(std::size_t fiber_count);

 private:
  std::string name_;
  std::vector<std::unique_ptr<BasicCapsuleObject<S>>> capsule_objects_;
  std::vector<Object*> objects_;
  std::vector<Fiber> fibers_;
  std::vector<std::vector<fcl::Transform3<S>>> poses_;  ///< by frame
  int frame_ = 0;
  Boxes boxes_ = Boxes::kStock;
};

extern template class BasicCapsuleObject<float>;
extern template class BasicCapsuleObject<double>;
extern template class BasicMovingFibers<float>;
extern template class BasicMovingFibers<double>;

using Object = fcl::CollisionObjectd;
using CapsuleObject = BasicCapsuleObject<double>;
using MovingFibers = BasicMovingFibers<double>;

}  // namespace fcl_fibers::benchmarks
