// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/contact_collector.h>

#include <stdexcept>
#include <string>

#include "broadphase/object_reader.h"
#include "fibers/public_contact.h"

namespace fcl_fibers {
namespace {

using geometry::Frame;
using geometry::Segment;

[[noreturn]] void refuse(const char* name, const char* problem) {
  throw std::invalid_argument(std::string("fcl_fibers: capsuleContact: object ") + name + ": " +
                              problem);
}

template <typename S>
Segment readCapsule(const fcl::CollisionObject<S>& object, const Frame& frame, const char* name) {
  Segment segment;
  const char* problem = broadphase::readSegment(object, frame, Bounds::kShapes, segment);
  if (problem == nullptr && segment.isBox()) {
    problem = "it is neither a capsule nor a sphere; pass it to fcl::collide";
  }
  if (problem == nullptr) problem = geometry::contactProblem(segment);
  if (problem != nullptr) refuse(name, problem);
  return segment;
}

}  // namespace

template <typename S>
Contact capsuleContact(const fcl::CollisionObject<S>& a, const fcl::CollisionObject<S>& b) {
  // The first object's position is the origin, so no digits are lost far from the world's origin.
  Frame frame;
  const auto& position = a.getTransform().matrix().col(3);
  frame.origin = {static_cast<double>(position[0]), static_cast<double>(position[1]),
                  static_cast<double>(position[2])};
  const Segment p = readCapsule(a, frame, "a"), q = readCapsule(b, frame, "b");
  return fibers::publicContact(geometry::capsuleContact(p, q, frame.origin));
}

template Contact capsuleContact(const fcl::CollisionObject<float>&,
                                const fcl::CollisionObject<float>&);
template Contact capsuleContact(const fcl::CollisionObject<double>&,
                                const fcl::CollisionObject<double>&);

}  // namespace fcl_fibers
