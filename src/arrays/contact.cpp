// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/contact.h>

#include <string>

#include "arrays/fiber_arrays.h"
#include "fibers/options.h"
#include "fibers/public_contact.h"

namespace fcl_fibers {
namespace {

using geometry::Segment;

[[noreturn]] void refuse(const std::string& what) {
  fibers::throwInvalidArgument("capsuleContact", what);
}

Segment toSegment(const CapsuleShape& capsule) {
  const auto& [from, to, radius] = capsule;
  return {{from[0], from[1], from[2]}, {to[0], to[1], to[2]}, radius};
}

template <class Name>
const Segment& checked(const Segment& segment, Name&& name) {
  if (const char* problem = geometry::contactProblem(segment)) refuse(name() + ": " + problem);
  return segment;
}

struct LocatedSegment {
  Segment segment;
  FiberSegment place;
};

template <typename S>
LocatedSegment locate(const FiberArrays<S>& fibers, std::int32_t id) {
  const auto name = [id] { return "the capsule at point " + std::to_string(id); };
  const auto point = static_cast<std::size_t>(id);
  arrays::checkEnds(fibers, refuse);
  if (id < 0 || point >= fibers.point_count) {
    refuse("no capsule starts at point " + std::to_string(id) + " of " +
           std::to_string(fibers.point_count) + "; pass the arrays that the tree was built from");
  }
  const std::size_t fiber = arrays::fiberOf(fibers.point_begin, fibers.fiber_count, point);
  // The second comparison stays inside the array if point_begin descends.
  if (point + 1 >= fibers.point_begin[fiber + 1] || point + 1 == fibers.point_count) {
    refuse("point " + std::to_string(id) +
           " is the last of its fiber; pass the arrays that the tree was built from");
  }
  const Segment segment{arrays::pointOf(fibers, point), arrays::pointOf(fibers, point + 1),
                        arrays::radiusOf(fibers, point, fiber)};
  return {checked(segment, name), {fiber, point - fibers.point_begin[fiber]}};
}

template <typename S>
Contact contactOf(const FiberArrays<S>& a, const FiberArrays<S>& b, SegmentPair pair) {
  const LocatedSegment p = locate(a, pair.a), q = locate(b, pair.b);
  return fibers::publicContact(geometry::capsuleContact(p.segment, q.segment, {0, 0, 0}), p.place,
                               q.place);
}

}  // namespace

Contact capsuleContact(const CapsuleShape& a, const CapsuleShape& b) {
  return fibers::publicContact(geometry::capsuleContact(
      checked(toSegment(a), [] { return std::string("capsule a"); }),
      checked(toSegment(b), [] { return std::string("capsule b"); }), {0, 0, 0}));
}

Contact capsuleContact(const FiberArrays<float>& fibers, SegmentPair pair) {
  return contactOf(fibers, fibers, pair);
}
Contact capsuleContact(const FiberArrays<double>& fibers, SegmentPair pair) {
  return contactOf(fibers, fibers, pair);
}
Contact capsuleContact(const FiberArrays<float>& a, const FiberArrays<float>& b, SegmentPair pair) {
  return contactOf(a, b, pair);
}
Contact capsuleContact(const FiberArrays<double>& a, const FiberArrays<double>& b,
                       SegmentPair pair) {
  return contactOf(a, b, pair);
}

}  // namespace fcl_fibers
