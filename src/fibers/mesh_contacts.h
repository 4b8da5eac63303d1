// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/tree_export.h>

#include "geometry/moving_segment.h"
#include "geometry/triangle_contact.h"
#include "index/posed_mesh.h"

namespace fcl_fibers::fibers {

/// Takes the numbers of a contact, whose points are in the world.
template <class Found>
void setContact(const Found& found, ShapeContact& contact) {
  const auto toArray = [](const geometry::Vec3d& v) { return std::array{v.x, v.y, v.z}; };
  contact.s = found.s;
  contact.distance = found.distance;
  contact.point_a = toArray(found.point_a);
  contact.point_b = toArray(found.point_b);
  contact.normal = toArray(found.normal);
}

/// @param is_inside  whether the capsule is inside a solid
MeshContact publicContact(const geometry::TriangleContact& contact, FiberSegment place,
                          index::TriangleId triangle, bool is_inside);

/// Computes the contacts of capsules with a mesh, which it borrows. Several threads may ask it.
class FCL_FIBERS_TREE_EXPORT MeshContacts {
 public:
  explicit MeshContacts(const index::PlacedMesh& mesh);
  MeshContacts(const MeshContacts&) = delete;

  /// The frame of capsules. Its origin is the mesh's position, so that no digits are lost far from
  /// the world's origin.
  const geometry::Frame& frame() const { return frame_; }

  /// A capsule of frame() and a triangle that the mesh has.
  struct Pair {
    geometry::Segment capsule;
    FiberSegment place;
    index::TriangleId triangle;
  };
  static constexpr std::size_t kAtOnce = geometry::kClosestAtOnce;
  /// Computes contacts, which are in the world, several at a time.
  /// @param count  1 to kAtOnce
  void compute(const Pair* pairs, std::size_t count, MeshContact* contacts) const;
  MeshContact operator()(const geometry::Segment& capsule, FiberSegment place,
                         index::TriangleId triangle) const {
    const Pair pair{capsule, place, triangle};
    MeshContact contact;
    compute(&pair, 1, &contact);
    return contact;
  }

  /// Replaces the content of `triangles` by those at most `reach` from a capsule of frame(), in
  /// ascending order, or else by its nearest.
  void findTriangles(const geometry::Segment& capsule, double reach,
                     std::vector<index::TriangleId>& triangles) const;

 private:
  const bool is_solid_;
  const geometry::Frame frame_;
  const index::PosedTriangles triangles_;
};

/// The contact of a capsule and a triangle of a mesh at the time of their impact in a step.
/// @param capsule     in the world's unit, relative to `origin`
/// @param start, end  the same triangles
FCL_FIBERS_TREE_EXPORT MeshContact impactContact(const geometry::MovingSegment& capsule,
                                                 const geometry::Vec3d& origin,
                                                 const index::PlacedMesh& start,
                                                 const index::PlacedMesh& end,
                                                 index::TriangleId triangle, double time,
                                                 FiberSegment place);

}  // namespace fcl_fibers::fibers
