// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/new_objects.h"

#include <algorithm>
#include <limits>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cylinder.h>

#include "joined_text.h"

namespace fcl_fibers::broadphase {

using geometry::Frame;
using geometry::Segment;

namespace {

/// Whether the two share an end point, within 4 ulp of the largest coordinate.
template <typename S>
bool shareEnd(const Segment& p, const Segment& q) {
  const double largest = std::max({maxNorm(p.a), maxNorm(p.b), maxNorm(q.a), maxNorm(q.b)});
  const double tolerance = 4 * double{std::numeric_limits<S>::epsilon()} * largest;
  for (const auto& end : {p.a, p.b}) {
    if (maxNorm(end - q.a) <= tolerance || maxNorm(end - q.b) <= tolerance) return true;
  }
  return false;
}

}  // namespace

template <typename S>
std::optional<double> lengthInFiber(const fcl::CollisionGeometry<S>& shape) {
  switch (shape.getNodeType()) {
    case fcl::GEOM_CAPSULE:
      return static_cast<double>(static_cast<const fcl::Capsule<S>&>(shape).lz);
    case fcl::GEOM_CYLINDER:
      return static_cast<double>(static_cast<const fcl::Cylinder<S>&>(shape).lz);
    case fcl::GEOM_BOX:
      return static_cast<double>(static_cast<const fcl::Box<S>&>(shape).side[2]);
    default:
      return std::nullopt;
  }
}

template <typename S>
SegmentId rootsOf(const char* call, const std::vector<fcl::CollisionObject<S>*>& fiber,
                  const FiberObstacles& obstacles) {
  if (obstacles.root_segments < 0) {
    fibers::throwInvalidArgument(call, "root_segments is " +
                                           std::to_string(obstacles.root_segments) +
                                           "; give 0 or more segments");
  }
  if (!isSize(obstacles.root_length)) {
    fibers::throwInvalidArgument(call, joinedText("root_length is ", obstacles.root_length,
                                                  "; give a finite length of 0 or more"));
  }
  std::size_t by_length = 0;
  for (double start = 0; by_length < fiber.size() && start < obstacles.root_length; ++by_length) {
    const fcl::CollisionObject<S>* object = fiber[by_length];
    if (object == nullptr || ObjectMembers<S>::shape(*object) == nullptr) break;
    start += lengthInFiber(*object).value_or(0);
  }
  const auto by_number = static_cast<std::size_t>(obstacles.root_segments);
  return static_cast<SegmentId>(std::min(fiber.size(), std::max(by_length, by_number)));
}

template <typename S>
Segment readNew(const char* call, const std::vector<fcl::CollisionObject<S>*>& objects,
                std::size_t i, Bounds bounds) {
  if (objects[i] == nullptr) {
    fibers::throwInvalidArgument(call, nameOf(i) + " is null; pass a pointer to an object");
  }
  return readObject(call, *objects[i], Frame{}, bounds, [i] { return nameOf(i); });
}

template <typename S>
NewObjects readNewObjects(const char* call, const std::vector<fcl::CollisionObject<S>*>& added,
                          const typename ObjectRegistry<S>::Kind& kind,
                          const FiberManagerOptions& options,
                          const std::optional<Segment>& previous) {
  NewObjects found;
  found.starts_fiber.resize(added.size());
  if (options.ignored_arc_length > 0) found.lengths.resize(added.size());
  found.last = previous;
  const bool needs_length =
      kind.has_neighbors || !found.lengths.empty() || options.bounds == Bounds::kObjects;
  // The build finds margins, which cannot make an object unreadable unless they overflow.
  const Bounds bounds = options.bounds == Bounds::kObjects ? Bounds::kObjects : Bounds::kShapes;
  for (std::size_t i = 0; i < added.size(); ++i) {
    prefetchObject<S>([&](std::size_t k) { return added[k]; }, i, added.size());
    Segment segment = readNew(call, added, i, bounds);
    const bool is_capsule = isCapsule(*added[i]);
    const std::optional<double> length =
        needs_length ? lengthInFiber(*added[i]) : std::optional<double>();
    // If its box counts instead, there are no end points to compare, and nobody has checked the
    // length.
    if (segment.isBox() && (is_capsule || (length && options.bounds == Bounds::kObjects))) {
      segment = readObject(call, *added[i], Frame{}, Bounds::kShapes, [i] { return nameOf(i); });
    }
    if (!is_capsule && !isSphere(*added[i])) found.obstacles.push_back(i);
    if (!found.lengths.empty()) found.lengths[i] = length.value_or(0);
    if (kind.has_neighbors) {
      if (!length) {
        fibers::throwInvalidArgument(
            call,
            nameOf(i) + " is not a capsule, cylinder or box; register it by registerObject()");
      }
      found.starts_fiber[i] = i == 0;
    } else {
      found.starts_fiber[i] = !(is_capsule && found.last && shareEnd<S>(*found.last, segment));
      found.last = is_capsule ? std::optional<Segment>(segment) : std::nullopt;
    }
  }
  if (kind.has_neighbors) found.last.reset();
  return found;
}

template std::optional<double> lengthInFiber(const fcl::CollisionGeometry<float>&);
template std::optional<double> lengthInFiber(const fcl::CollisionGeometry<double>&);
template SegmentId rootsOf(const char*, const std::vector<fcl::CollisionObject<float>*>&,
                           const FiberObstacles&);
template SegmentId rootsOf(const char*, const std::vector<fcl::CollisionObject<double>*>&,
                           const FiberObstacles&);
template Segment readNew(const char*, const std::vector<fcl::CollisionObject<float>*>&, std::size_t,
                         Bounds);
template Segment readNew(const char*, const std::vector<fcl::CollisionObject<double>*>&,
                         std::size_t, Bounds);
template NewObjects readNewObjects<float>(const char*,
                                          const std::vector<fcl::CollisionObject<float>*>&,
                                          const ObjectRegistry<float>::Kind&,
                                          const FiberManagerOptions&,
                                          const std::optional<Segment>&);
template NewObjects readNewObjects<double>(const char*,
                                           const std::vector<fcl::CollisionObject<double>*>&,
                                           const ObjectRegistry<double>::Kind&,
                                           const FiberManagerOptions&,
                                           const std::optional<Segment>&);

}  // namespace fcl_fibers::broadphase
