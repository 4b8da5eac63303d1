// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#include <fcl_fibers/shapes.h>
#include <fcl_fibers/triangle_mesh.h>

namespace fcl_fibers {

/// Two segments that a query reports. Each is named by the index of the point at which it starts,
/// not by its number along a fiber: segment `a` runs from point a to point a + 1 of the arrays.
/// FiberTree::fiberSegment() returns its fiber and its number. These names stay the same over
/// updates. In a pair of one tree, a < b.
struct SegmentPair {
  std::int32_t a;  ///< index of the point at which one segment starts
  std::int32_t b;  ///< index of the point at which the other starts
};

/// The order in which Pairs and Contacts are found.
enum class Order {
  kFound,  ///< that of the search, which depends on the tree; it costs nothing
  /// Ascending by the segments of the tree, and for one segment by those of the partner, or by its
  /// triangles.
  kSegments,
  /// Ascending by the fiber of a, then by that of b, and in a pair of fibers by segments. So the
  /// contacts of two fibers follow each other, see fiberPairs().
  kFibers,
};

/// The first touch of two segments in a step, which lasts from time 0 to time 1.
struct Impact {
  SegmentPair pair;  ///< the two segments
  double time = 0;   ///< in [0, 1]; 0 if they touch at the start
  double s = 0;      ///< arc parameter of the closest point on a's axis at that time, as in Contact
  double t = 0;      ///< arc parameter of the closest point on b's axis
};

/// A segment of a tree, named as in SegmentPair, and a triangle of a mesh, named by its index.
struct TrianglePair {
  std::int32_t segment;   ///< index of the point at which the segment starts
  std::int32_t triangle;  ///< index of the triangle in MeshArrays::triangles
};

/// The first touch of a segment and a triangle in a step. impactContact() tells at which points.
struct MeshImpact {
  TrianglePair pair;  ///< the segment and the triangle
  double time = 0;    ///< in [0, 1]; 0 if they touch at the start
};

/// The first touch of a segment and a shape in a step.
struct ShapeImpact {
  std::int32_t segment = -1;  ///< index of the point at which the segment starts
  double time = 0;            ///< in [0, 1]; 0 if they touch at the start
};

/// A mesh that moves in a step: each corner moves linearly from its place in `start` to its place
/// in `end`. For a mesh that rests, pass it as both. A mesh that turns is given in two poses, which
/// should not differ by more than a few degrees: on the straight way, a corner comes nearer to the
/// axis by up to 0.04 % for 3 degrees. Both must have the same triangles, kind and categories, so
/// the end is best a copy of the start that was moved by TriangleMesh::setPose() or update().
struct MeshStep {
  TriangleMesh start;  ///< at time 0
  TriangleMesh end;    ///< at time 1
};

class FiberTree;
struct BareContact;
struct Contact;
struct ContactForces;
struct MeshContact;
struct PointSums;
struct ShapeContact;
template <typename S>
struct FiberArrays;

/// @name Questions
/// What FiberTree::visit() and find() can be asked. A question is asked about the segments of the
/// tree and a partner. Its static functions found() tell the compiler which partners it may have
/// and what is found of each; see FoundBy. Do not call them, because they have no definition.
/// closest() and safeStep() are functions of FiberTree. This is what is found of each partner:
///
/// |                    | FiberTree     | TriangleMesh   | MeshStep     | Shape          |
/// | ------------------ | ------------- | -------------- | ------------ | -------------- |
/// | `Pairs`            | `SegmentPair` | `TrianglePair` | none (1)     | the segment    |
/// | `Contacts`         | `Contact`     | `MeshContact`  | none (1)     | `ShapeContact` |
/// | `TouchingSegments` | none (2)      | the segment    | none (1)     | none (2)       |
/// | `Nearest`          | `SegmentPair` | `TrianglePair` | none (1)     | none (3)       |
/// | closest()          | `Contact`     | `MeshContact`  | none (1)     | none (3)       |
/// | `Impacts`          | `Impact`      | none (4)       | `MeshImpact` | `ShapeImpact`  |
/// | safeStep()         | a time        | none (4)       | a time       | a time         |
/// | `MovingPairs`      | `SegmentPair` | none (5)       | none (5)     | none (5)       |
///
/// * (1) The question is not about a step, so ask about one of the two meshes.
/// * (2) A pair of two trees has a segment on both sides. For a shape ask `Pairs`, which finds the
///   segments themselves.
/// * (3) shapeContact() tells the distance of each segment.
/// * (4) For a mesh that rests ask about `MeshStep{mesh, mesh}`.
/// * (5) They are for a program's own test of two segments.
///@{

/// What touches: it is no further away than the radii and the margin allow. If the tree has
/// Report::kVolumes, segments and shapes touch if their volumes overlap, and a mesh is refused.
struct Pairs {
  /// Pairs of segments. Of one tree, neighbours and pairs within one group are left out.
  static SegmentPair found(const FiberTree&);
  /// A triangle touches if it is no further from the segment's axis than the radius and the margin
  /// together, so an axis that crosses it touches it. A segment wholly inside a solid mesh is found
  /// with its nearest triangle. Segments at roots, and those that may not meet the mesh, are left
  /// out.
  static TrianglePair found(const TriangleMesh&);
  /// The segment that touches the shape. A segment inside the shape touches it too. Roots and
  /// categories do not matter, because a program chooses the shapes that it asks about. Under
  /// Report::kVolumes, the volume of a box is the least box along the axes around it, and a plane
  /// or half-space is its own volume.
  static std::int32_t found(const Shape&);

  /// In which order. Unless it is kFound, visit() finds all pairs before it hands on the first.
  Order order = Order::kFound;
};

/// The segments that touch a mesh by the rule of Pairs, each once.
struct TouchingSegments {
  static std::int32_t found(const TriangleMesh&);  ///< the segment
};

/// Each segment that is at most `distance` from the partner, and the segment or triangle of the
/// partner that is nearest to it. The distance is that of the surfaces, so if several overlap the
/// segment, the deepest one is nearest. The margin does not count. A query throws
/// std::invalid_argument if `distance` is negative or NaN.
struct Nearest {
  double distance;  ///< in the unit of the fibers; not negative; may be infinite
  /// a is a segment of this tree, and b is the nearest segment of the other one. If rounding leaves
  /// open which of several is the nearest, b is the one with the least name. If the tree itself is
  /// the partner, neighbours and segments of one group are left out, and b may be less than a.
  static SegmentPair found(const FiberTree&);
  /// A segment and its nearest triangle. Its distance is that of its axis minus its radius, also
  /// where it is inside a solid mesh.
  static TrianglePair found(const TriangleMesh&);
};

/// What touches at any time of the step, within the margin. Each pair comes once, with the time of
/// its impact. Pairs that Pairs leaves out are left out here. Impacts do not come in the order of
/// their times.
///
/// No impact is missed, and no time is too late. At its time a pair is no further apart than its
/// radii, the margin, 2^-36 of the sizes and distance of its capsules, and 2^-48 of the extent of
/// all fibers, which is the rounding of their coordinates. Radii at points change linearly along a
/// segment, and each of them changes linearly in time. docs/numerics.md tells how rare the
/// exceptions are.
struct Impacts {
  static Impact found(const FiberTree&);  ///< of two segments
  /// A segment that is wholly inside a solid mesh at the start is found once, at time 0 with its
  /// nearest triangle.
  static MeshImpact found(const MeshStep&);
  /// The shape rests. In the bound above, the size of a box is that of its edges, and a plane has
  /// no size.
  static ShapeImpact found(const Shape&);
};

/// Pairs that may touch during the step: the boxes around both overlap at one common time, if each
/// side of a box moves linearly. The boxes include the margin. Pairs that Pairs leaves out are left
/// out here. This is for a program that has a test of its own.
struct MovingPairs {
  static SegmentPair found(const FiberTree&);  ///< the pair
};

/// The contacts of all Pairs, in their order. Threads share the work. Pass the arrays of the last
/// build or update of each tree. Arrays whose fibers have other numbers of points are refused.
/// Moved points are not noticed, and give wrong contacts. Where a Contact is found, find() also
/// fills a vector of BareContact, which takes less than half of the memory.
template <typename S>
struct Contacts {
  FiberArrays<S> fibers;                          ///< of the tree
  const FiberArrays<S>* others = nullptr;         ///< of another tree that is the partner
  Order order = Order::kFound;                    ///< as in Pairs
  static Contact found(const FiberTree&);         ///< of two segments
  static MeshContact found(const TriangleMesh&);  ///< of a segment and a triangle
  static ShapeContact found(const Shape&);        ///< of a segment and the shape
};
/// @cond
template <typename S>
Contacts(FiberArrays<S>, const FiberArrays<S>* = nullptr, Order = Order::kFound) -> Contacts<S>;
template <typename S>
Contacts(FiberArrays<S>, std::nullptr_t, Order) -> Contacts<S>;
/// @endcond
///@}

/// What a question finds of a partner.
template <class Question, class Partner>
using FoundBy = decltype(Question::found(std::declval<const Partner&>()));

/// Whether a question may be asked of a partner.
template <class Question, class Partner, class = void>
inline constexpr bool kHasAnswer = false;
template <class Question, class Partner>
inline constexpr bool kHasAnswer<Question, Partner, std::void_t<FoundBy<Question, Partner>>> = true;

/// Whether find() fills a vector of Found with what the question finds of the partner.
template <class Found, class Question, class Partner>
inline constexpr bool kIsFoundBy = std::is_same_v<Found, FoundBy<Question, Partner>> ||
                                   (std::is_same_v<Found, BareContact> &&
                                    std::is_same_v<Contact, FoundBy<Question, Partner>>);

}  // namespace fcl_fibers
