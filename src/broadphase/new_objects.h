// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "broadphase/object_registry.h"
#include "broadphase/object_source.h"
#include "broadphase/obstacles.h"

namespace fcl_fibers::broadphase {

template <typename S>
bool isCapsule(const fcl::CollisionObject<S>& object) {
  return ObjectMembers<S>::shape(object)->getNodeType() == fcl::GEOM_CAPSULE;
}

template <typename S>
bool isSphere(const fcl::CollisionObject<S>& object) {
  return ObjectMembers<S>::shape(object)->getNodeType() == fcl::GEOM_SPHERE;
}

/// The length of a shape as a segment of a fiber, along its z axis. Nothing if it cannot be one.
///@{
template <typename S>
std::optional<double> lengthInFiber(const fcl::CollisionGeometry<S>& shape);
template <typename S>
std::optional<double> lengthInFiber(const fcl::CollisionObject<S>& object) {
  return lengthInFiber(*ObjectMembers<S>::shape(object));
}
///@}

/// How many of the first segments of a fiber meet no obstacle. Throws std::invalid_argument if an
/// option is out of range. Objects that registering will refuse count as of length 0.
template <typename S>
SegmentId rootsOf(const char* call, const std::vector<fcl::CollisionObject<S>*>& fiber,
                  const FiberObstacles& obstacles);

/// World-frame segment of an object about to be registered.
template <typename S>
geometry::Segment readNew(const char* call, const std::vector<fcl::CollisionObject<S>*>& objects,
                          std::size_t i, Bounds bounds);

/// The data that registering reads from objects. It refuses broken objects early and guesses fibers
/// from capsules that share end points. The index reads the objects again when it is built.
struct NewObjects {
  std::vector<bool> starts_fiber;
  std::vector<double> lengths;            ///< in fibers; empty if no arc length counts
  std::optional<geometry::Segment> last;  ///< a capsule that the next object may continue
  std::vector<std::size_t> obstacles;     ///< positions of objects other than capsules and spheres
};

/// @param previous  `last` of the objects registered before
template <typename S>
NewObjects readNewObjects(const char* call, const std::vector<fcl::CollisionObject<S>*>& added,
                          const typename ObjectRegistry<S>::Kind& kind,
                          const FiberManagerOptions& options,
                          const std::optional<geometry::Segment>& previous);

}  // namespace fcl_fibers::broadphase
