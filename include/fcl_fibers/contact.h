// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <variant>
#include <vector>

#include <fcl_fibers/fiber_options.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/tree_export.h>

namespace fcl_fibers {

/// The points that carry a contact, and the part of it that each carries. The weights of a
/// segment's two points are not negative, and their sum is 1.
template <std::size_t N>
struct ContactNodes {
  std::array<std::int32_t, N> points;  ///< indices into the arrays of their owner
  std::array<double, N> weights;       ///< in the same order
};

/// A contact without what can be computed from it and the arrays: 64 bytes for a solver that has
/// many. Contact tells more.
struct BareContact {
  SegmentPair pair{-1, -1};  ///< the segments, named by their first points; -1 without arrays

  /// Identifies the arrays that the segments are of: it is equal for equal `point_begin` and
  /// `point_end`. It is 0 if they are not known, which is so in every result of a function without
  /// a tree, such as capsuleContact() and shapeContact(). Then accumulate() cannot tell that a
  /// contact is of an earlier build.
  std::uint32_t layout = 0;
  std::int32_t reserved = 0;  ///< 0; room for a later version

  /// Arc parameter of the closest point on a's axis: 0 at the capsule's first end and 1 at its
  /// second. It is 0 if both ends are one point. The axis of an `fcl::Capsule` runs from -z to +z.
  double s = 0;
  double t = 0;  ///< arc parameter of the closest point on b's axis

  /// Distance between the two surfaces. It is negative if the capsules overlap. Then a motion of
  /// one capsule by that depth along `normal`, away from the other, separates them.
  double distance = 0;

  /// Unit vector from a to b: point_a is moved along it, point_b against it. If the axes are no
  /// further apart than 16 eps of the coordinates, the normal is perpendicular to both. If that
  /// leaves a choice, because they are parallel or have no length, the choice depends only on the
  /// axes.
  std::array<double, 3> normal{};

  /// Returns the two points of a, then the two of b. If the contact is of two trees, b's are points
  /// of the other tree. The segments must be of arrays, not two single capsules.
  constexpr ContactNodes<4> nodes() const {
    return {{pair.a, pair.a + 1, pair.b, pair.b + 1}, {1 - s, s, 1 - t, t}};
  }
};

/// Where two capsules a and b touch or, if they are apart, where they are closest. Two closest
/// points of their axes determine it. Points are in the frame of the capsules, lengths in their
/// unit.
///
///     const Contact c = capsuleContact(fibers, pair);
///     if (c.distance < 0) push(c.a.fiber, c.b.fiber, c.normal, -c.distance);
///
/// A segment with radii at its points is a row of balls. Then the two closest balls take the place
/// of the closest points: `s` and `t` tell their centers. If the axes intersect, the normal leans
/// from the perpendicular towards the thin ends, by as much as the surfaces do.
///
/// If many points are closest, as for parallel axes, the contact names one pair of them. The error
/// of `distance` is at most 32 eps of (distance of the axes + their lengths + radii), at any angle.
/// The points are rounded like coordinates of their size.
struct Contact : BareContact {
  FiberSegment a;                   ///< place of the first capsule
  FiberSegment b;                   ///< place of the second capsule
  std::array<double, 3> point_a{};  ///< closest point of a's axis, moved to a's surface
  std::array<double, 3> point_b{};  ///< closest point of b's axis, moved to b's surface
};

/// Where a capsule and a shape touch or, if they are apart, where they are closest. Points are in
/// the frame of the fibers, lengths in their unit.
///
/// If the axis reaches into a box, the depth is that of the shortest way of the whole capsule out.
/// If the axis reaches into a half-space, the way leads straight out of it. If the axis crosses a
/// plane, the way leads to the side on which the middle of the axis is.
///
/// A segment with radii at its points is a row of balls, and the contact is that of one of them.
/// This is the ball that is closest to the shape, or if the axis reaches into a box or crosses a
/// plane, the one that leaves it last. `s` is the arc parameter of its center, and its radius is
/// the one that counts. Such a segment leaves a plane to the side that takes the shorter way.
///
/// The error of `distance` is at most 32 eps of a sum: the radius, the axis's length, the box's
/// sides or the sphere's or other capsule's radius and length, and the ways from the shape's middle
/// to the ends of the axis. With a plane or half-space these ways begin at its point next to the
/// origin, and its offset is part of the sum.
struct ShapeContact {
  std::int32_t segment = -1;  ///< the capsule, named by its first point

  /// See BareContact::layout.
  std::uint32_t layout = 0;
  FiberSegment place;  ///< place of the capsule
  double s = 0;        ///< arc parameter of the closest point on the capsule's axis, as in Contact

  /// Distance between the capsule's surface and the shape. It is negative if they overlap: a motion
  /// of the capsule by that depth against `normal` takes it off the shape.
  double distance = 0;
  std::array<double, 3> point_a{};  ///< closest point of the axis, moved to the capsule's surface
  std::array<double, 3> point_b{};  ///< closest point of the shape
  std::array<double, 3> normal{};   ///< unit vector from the capsule to the shape

  /// Returns the two points of the segment. TriangleMesh::corners() returns those of a triangle, in
  /// the order of MeshContact::weights. The segment must be of arrays.
  constexpr ContactNodes<2> nodes() const { return {{segment, segment + 1}, {1 - s, s}}; }
};

/// The contact of a capsule and a triangle of a mesh.
///
///     const MeshContact c = meshContact(fibers, head, pair);
///     if (c.distance < 0) push(c.place.fiber, c.normal, -c.distance);  // against the normal
///
/// If the axis is no further from the triangle than 16 eps of the coordinates, or is inside a solid
/// mesh, the depth is how far you must push the whole capsule straight out of the triangle's plane,
/// until all of it is on one side. If `solid` is set, that is the side that is outside the solid at
/// this triangle, and the depth is at least the radius.
///
/// A segment with radii at its points is a row of balls, and the contact is that of one of them:
/// the ball that is nearest to the triangle, or the one whose center is where the axis crosses. `s`
/// is the arc parameter of its center, and its radius is the one that counts.
///
/// The normal is perpendicular to the triangle if the axis crosses it, and the motion against it is
/// the shorter one of the two. If `solid` is set, it is perpendicular too and points into the
/// solid.
///
/// The error of `distance` is at most 64 eps of the sum of the radius, the axis's length, two edges
/// and the way between the first points of capsule and triangle. The points of axis and triangle
/// are as near to each other as the closest ones, up to the same error. The pose of the mesh adds
/// 16 eps of its largest coordinate. A depth along the normal of a needle is only as exact as that
/// normal.
struct MeshContact : ShapeContact {
  std::int32_t triangle = -1;  ///< index of the triangle in MeshArrays::triangles

  /// Whether the mesh is solid and the axis crosses the triangle or has its closest point inside.
  bool solid = false;

  /// Barycentric coordinates of the closest point of the triangle: the weights of its three points,
  /// in their order. They are not negative, and their sum is 1.
  std::array<double, 3> weights{};
};

/// Contacts and the force at each of them, for FiberTree::accumulate(). Both are ranges, such as
/// std::vector, which are borrowed for the length of the call. A contact is a Contact, BareContact,
/// MeshContact or ShapeContact. A force is an std::array<double, 3>, or a double along the
/// contact's normal, which pushes apart if it is positive.
struct ContactForces {
  /// Borrows contacts and as many forces.
  template <class Contacts, class Forces>
  ContactForces(const Contacts& contacts, const Forces& forces)
      : first(std::data(contacts)),
        contact_size(sizeof(*std::data(contacts))),
        count(std::size(contacts)),
        numbers(reinterpret_cast<const double*>(std::data(forces))),
        numbers_each(sizeof(*std::data(forces)) / sizeof(double)),
        force_count(std::size(forces)) {
    using Force = std::decay_t<decltype(*std::data(forces))>;
    static_assert(std::is_same_v<Force, double> || std::is_same_v<Force, std::array<double, 3>>,
                  "a force is a double or an std::array<double, 3>");
  }

  /// The first contact, as the base class of it that accumulate() reads.
  std::variant<const BareContact*, const ShapeContact*, const MeshContact*> first;
  std::size_t contact_size;  ///< bytes from one to the next, because only a part of each is read
  std::size_t count;         ///< number of contacts
  const double* numbers;     ///< the forces
  std::size_t numbers_each;  ///< 1 along the normal, 3 of a vector
  std::size_t force_count;   ///< as many as contacts
};

/// Where FiberTree::accumulate() adds up: x, y, z of each point, in float or double. The numbers
/// are borrowed for the length of the call.
struct PointSums {
  PointSums() = default;  ///< adds nothing
  /// Borrows x, y, z of `count` points.
  template <typename S>
  PointSums(S* sums, std::size_t count) : numbers(sums), point_count(count) {}
  /// Borrows a vector of points.
  template <typename S>
  PointSums(std::vector<std::array<S, 3>>& sums)  // NOLINT: passed like the vector itself
      : PointSums(reinterpret_cast<S*>(sums.data()), sums.size()) {}

  std::variant<std::nullptr_t, float*, double*> numbers;  ///< null if nothing is added
  std::size_t point_count = 0;                            ///< number of points
};

/// Two fibers and their contacts, which follow each other.
struct FiberPair {
  std::size_t a;        ///< fiber of the first segment
  std::size_t b;        ///< fiber of the second
  std::size_t begin;    ///< number of their first contact
  std::size_t end;      ///< number of the one after their last
  std::size_t count;    ///< of their contacts: end - begin
  std::size_t deepest;  ///< number of the one whose `distance` is least; of several, the first
};

/// Returns the pairs of fibers of contacts that are in the order of their fibers, ascending by a,
/// then by b, as with Order::kFibers. The contacts are a range, such as std::vector, of anything
/// with `a.fiber`, `b.fiber` and `distance`, such as Contact or ObjectContact. Throws
/// std::invalid_argument if the contacts are in another order.
///
///     tree.find(Contacts{fibers, nullptr, Order::kFibers}, contacts);
///     for (const FiberPair& pair : fiberPairs(contacts)) print(contacts[pair.deepest].distance);
template <class Contacts>
std::vector<FiberPair> fiberPairs(const Contacts& contacts) {
  const auto* const contact = std::data(contacts);
  std::vector<FiberPair> pairs;
  for (std::size_t i = 0; i < std::size(contacts); ++i) {
    const std::size_t a = contact[i].a.fiber, b = contact[i].b.fiber;
    if (pairs.empty() || std::tie(pairs.back().a, pairs.back().b) < std::tie(a, b)) {
      pairs.push_back({a, b, i, i, 0, i});
    } else if (pairs.back().a != a || pairs.back().b != b) {
      throw std::invalid_argument(
          "fcl_fibers: fiberPairs: contact " + std::to_string(i) +
          " is not in the order of the fibers; find the contacts with Order::kFibers, or sort them "
          "by a.fiber, then by b.fiber");
    }
    FiberPair& pair = pairs.back();
    pair.end = i + 1;
    ++pair.count;
    if (contact[i].distance < contact[pair.deepest].distance) pair.deepest = i;
  }
  return pairs;
}

/// Returns the contact of a segment and a triangle that a FiberTree found. `fibers` are the arrays
/// of the tree's last build or update, and the mesh is where it was then. The coordinates are
/// computed relative to the mesh's position. Throws std::invalid_argument as capsuleContact() of a
/// pair does, and if the mesh has no such triangle.
template <typename S>
FCL_FIBERS_TREE_EXPORT MeshContact meshContact(const FiberArrays<S>& fibers,
                                               const TriangleMesh& mesh, TrianglePair pair);

/// Returns the contact of a segment that a FiberTree found and a shape, whether they touch or not.
/// `fibers` are the arrays of the tree's last build or update. Throws std::invalid_argument as
/// capsuleContact() of a pair does, and if the shape is refused by FiberTree::visit().
template <typename S>
FCL_FIBERS_TREE_EXPORT ShapeContact shapeContact(const FiberArrays<S>& fibers, const Shape& shape,
                                                 std::int32_t segment);

/// Returns the contact of two capsules, whether they touch or not. The closed form is that of
/// Ericson, Real-Time Collision Detection, 2005, section 5.1.9, without its determinant, which is
/// noise if the axes are nearly parallel.
///
/// Throws std::invalid_argument if a number is NaN or its magnitude exceeds 2^1000, or if a radius
/// is negative.
FCL_FIBERS_TREE_EXPORT Contact capsuleContact(const CapsuleShape& a, const CapsuleShape& b);

/// Returns the contact of a pair that a FiberTree found, with fiber and segment numbers. `fibers`
/// are the arrays of the tree's last build or update. For a pair of two trees, `a` are those of the
/// first one and `b` of the other.
///
/// Throws std::invalid_argument as capsuleContact() of two capsules does. It also throws if no
/// capsule starts at a point of the pair, if an array is null, or if point_begin does not run from
/// 0 to the number of points.
///@{
template <typename S>
FCL_FIBERS_TREE_EXPORT Contact capsuleContact(const FiberArrays<S>& fibers, SegmentPair pair);
template <typename S>
FCL_FIBERS_TREE_EXPORT Contact capsuleContact(const FiberArrays<S>& a, const FiberArrays<S>& b,
                                              SegmentPair pair);
///@}

/// Returns the contact of an impact that a FiberTree found, at its time. `start` and `end` are the
/// arrays of the tree's last update, and the mesh or shape is the one that was asked about. For an
/// impact of two trees, pass the arrays of both. Throws std::invalid_argument as capsuleContact()
/// and meshContact() of a pair do, and if the time is not in [0, 1].
///@{
template <typename S>
FCL_FIBERS_TREE_EXPORT Contact impactContact(const FiberArrays<S>& start, const FiberArrays<S>& end,
                                             const Impact& impact);
template <typename S>
FCL_FIBERS_TREE_EXPORT Contact impactContact(const FiberArrays<S>& a_start,
                                             const FiberArrays<S>& a_end,
                                             const FiberArrays<S>& b_start,
                                             const FiberArrays<S>& b_end, const Impact& impact);
template <typename S>
FCL_FIBERS_TREE_EXPORT MeshContact impactContact(const FiberArrays<S>& start,
                                                 const FiberArrays<S>& end, const MeshStep& mesh,
                                                 const MeshImpact& impact);
template <typename S>
FCL_FIBERS_TREE_EXPORT ShapeContact impactContact(const FiberArrays<S>& start,
                                                  const FiberArrays<S>& end, const Shape& shape,
                                                  const ShapeImpact& impact);
///@}

}  // namespace fcl_fibers
