// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_options.h>
#include <fcl_fibers/tree_export.h>
#include <fcl_fibers/triangle_mesh.h>

namespace fcl_fibers {

/// Fibers as plain arrays, which FiberTree reads. Fiber f is the polyline through the points
/// [point_begin[f], point_begin[f + 1]), with a capsule between each two consecutive points. A
/// fiber of fewer than two points has no capsule. The arrays are borrowed for the length of a call.
/// S is float or double.
///
///     const double points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};  // x, y, z of four points
///     const std::size_t point_begin[] = {0, 2, 4};                   // two fibers of two points
///     const double radius = 0.1;
///     const FiberArrays<double> fibers = {points, 4, point_begin, 2, &radius};
template <typename S>
struct FiberArrays {
  /// How many radii there are, and for which capsules.
  enum class Radii {
    kOne,       ///< one: radii[0] for all capsules
    kPerFiber,  ///< fiber_count: radii[f] for all capsules of fiber f
    /// point_count: radii[i] for the capsule that starts at point i. The radius at the last point
    /// of a fiber is checked but not used.
    kPerSegment,
  };

  const S* points = nullptr;    ///< x, y, z of each point: 3 * point_count finite numbers
  std::size_t point_count = 0;  ///< at most 2^27
  /// fiber_count + 1 numbers, which begin with 0, end with point_count and never descend.
  const std::size_t* point_begin = nullptr;
  std::size_t fiber_count = 0;    ///< including fibers without capsules; at most 2^27
  const S* radii = nullptr;       ///< in the unit of the points; finite, not negative
  Radii radii_are = Radii::kOne;  ///< what `radii` holds
  /// fiber_count numbers: 1 for a closed fiber, 0 for an open one. Null if no fiber is closed. The
  /// last point of a closed fiber repeats its first, so its last capsule is a neighbour of its
  /// first.
  const std::uint8_t* closed = nullptr;
  /// fiber_count group numbers, 0 for a fiber without a group. Null if no fiber has one. See
  /// FiberGroup.
  const std::int32_t* groups = nullptr;
  /// fiber_count bit masks: the categories of meshes that each fiber may meet, see
  /// TriangleMesh::setCategories(). Null if every fiber may meet every mesh, whatever it has.
  const std::uint32_t* meets = nullptr;
  /// fiber_count numbers, not negative: how many segments at the start of each fiber meet no mesh,
  /// because they are in the scalp. Null if there are none. rootSegments() counts them by length.
  const std::int32_t* root_segments = nullptr;
};

/// Returns for each fiber how many of its first segments begin at less than `length` along the
/// fiber from its start, for FiberArrays::root_segments. Throws std::invalid_argument if an array
/// is null or does not fit the others, or if the length is negative, NaN or infinite.
///@{
FCL_FIBERS_TREE_EXPORT std::vector<std::int32_t> rootSegments(const FiberArrays<float>& fibers,
                                                              double length);
FCL_FIBERS_TREE_EXPORT std::vector<std::int32_t> rootSegments(const FiberArrays<double>& fibers,
                                                              double length);
///@}

/// Two segments that a query reports. Each is named by the index of the point at which it starts,
/// not by its number along a fiber: segment `a` runs from point a to point a + 1 of the arrays.
/// FiberTree::fiberSegment() returns its fiber and its number. These names stay the same over
/// updates. In a pair of one tree, a < b.
struct SegmentPair {
  std::int32_t a;  ///< index of the point at which one segment starts
  std::int32_t b;  ///< index of the point at which the other starts
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

/// An axis-aligned box; low <= high on each axis.
struct BoxShape {
  std::array<double, 3> low;   ///< x, y, z of the low corner
  std::array<double, 3> high;  ///< x, y, z of the high corner
};

struct CapsuleShape;
struct Contact;
struct MeshContact;

/// Options of a FiberTree: those of FiberOptions, and what bounds the nodes of the tree.
struct FiberTreeOptions : FiberOptions {
  /// What bounds the nodes of the tree.
  enum class Volumes {
    kLayeredBoxes,    ///< as in LayeredAABBTreeCollisionManager
    kWrappedSpheres,  ///< as in WrappedSphereTreeCollisionManager
  };
  Volumes volumes = Volumes::kLayeredBoxes;  ///< boxes are faster; spheres are those of the paper
};

/// A box or a sphere that bounds a node of a FiberTree, for pictures and statistics. It contains
/// the capsules below the node, each thickened by half the margin. Coordinates are in the frame of
/// the arrays.
struct TreeVolume {
  FiberTreeOptions::Volumes kind = FiberTreeOptions::Volumes::kLayeredBoxes;  ///< box or sphere
  double center[3] = {0, 0, 0};                                               ///< x, y, z
  double half[3] = {0, 0, 0};  ///< half the edges of a box; the radius of a sphere, three times

  /// The capsules below the node, each named by the index of its first point. They are borrowed
  /// from the tree until it is built, updated or destroyed.
  const std::int32_t* segments = nullptr;
  std::size_t segment_count = 0;  ///< number of `segments`
};

/// Finds the pairs of segments that touch, or whose volumes overlap (see Report), in fibers that a
/// program keeps in its own arrays. It has the tree of the fiber managers and reports the same
/// pairs, but it needs no FCL object for each segment. This header needs neither FCL nor Eigen.
///
///     FiberTree tree(options);
///     tree.build(fibers);
///     tree.visitPairs([&](SegmentPair pair) { handle(capsuleContact(fibers, pair)); });
///
/// Queries are const and may run from several threads at once. While a query runs, for instance in
/// its visitor, build() and update() of each tree that it reads throw std::invalid_argument and
/// change nothing. What is moved, assigned to or destroyed meanwhile, and a mesh that changes,
/// counts for the query as it was when the query began. No query may begin during a build or an
/// update.
///
/// Both refuse invalid arrays: they throw std::invalid_argument, whose text names the point, fiber
/// or radius, and leave the tree as it was. If one of them runs out of memory (std::bad_alloc),
/// queries throw std::invalid_argument until one of the two succeeds.
class FCL_FIBERS_TREE_EXPORT FiberTree {
 public:
  /// Makes an empty tree. Throws std::invalid_argument if an option is out of range.
  explicit FiberTree(const FiberTreeOptions& options = {});
  ~FiberTree();

  /// Takes over the other tree, which afterwards may only be destroyed or assigned to.
  ///@{
  FiberTree(FiberTree&&) noexcept;
  FiberTree& operator=(FiberTree&&) noexcept;
  ///@}

  /// Replaces all fibers and builds the tree. Coordinates may be in any frame and unit.
  ///@{
  void build(const FiberArrays<float>& fibers);
  void build(const FiberArrays<double>& fibers);
  ///@}

  /// Reads the points and radii again after they have changed. Every fiber must have as many points
  /// as at the last build(). S may differ from it. Closed fibers, groups, categories and roots stay
  /// as they were at that build.
  ///@{
  void update(const FiberArrays<float>& fibers);
  void update(const FiberArrays<double>& fibers);
  ///@}

  /// Does the same for a step: from `start`, at time 0, to `end`, at time 1, each point and radius
  /// changes linearly. visitImpacts(), visitMovingPairs() and safeStep() ask about the step. All
  /// other calls answer for its end. An update with one argument, or a build, ends the step. Throws
  /// std::invalid_argument as the update above does, and if the tree has wrapped spheres.
  ///@{
  void update(const FiberArrays<float>& start, const FiberArrays<float>& end);
  void update(const FiberArrays<double>& start, const FiberArrays<double>& end);
  ///@}

  /// Calls visit(SegmentPair) once for every pair that the options ask for. `visit` returns
  /// nothing or a bool; true ends the query. The call returns whether `visit` ended it. The order
  /// of the pairs depends only on the arrays that were passed to the builds and updates.
  template <class Visitor>
  bool visitPairs(Visitor&& visit) const {
    Bridge<Visitor, SegmentPair> bridge(visit);
    return visitRuns(bridge);
  }

  /// Does the same for pairs of a segment a of this tree and a segment b of another tree. The
  /// report and the margin of this tree count. No pair is left out as neighbours or as one group.
  /// If `other` is this tree, the call is the one above.
  ///
  /// Throws std::invalid_argument if the other tree has different volumes or another topology, or
  /// if this tree has Report::kCapsules and the other one does not.
  template <class Visitor>
  bool visitPairs(const FiberTree& other, Visitor&& visit) const {
    Bridge<Visitor, SegmentPair> bridge(visit);
    return visitRuns(other, bridge);
  }

  /// Replaces the content of `pairs` by all pairs. The vector keeps its memory for the next call.
  void findPairs(std::vector<SegmentPair>& pairs) const;

  /// Calls visit(Impact) once for every pair of segments that touch at any time of the step, within
  /// the margin. Pairs that visitPairs() leaves out are left out here. `visit`, the return value
  /// and the order are those of visitPairs(), so impacts do not come in the order of their times.
  ///
  /// No impact is missed, and no time is too late. At its time a pair is no further apart than its
  /// radii, the margin, 2^-36 of the sizes and distance of its capsules, and 2^-48 of the extent of
  /// all fibers, which is the rounding of their coordinates. docs/numerics.md tells how rare the
  /// exceptions are.
  ///
  /// This call and the others about a step throw std::invalid_argument if the last update was no
  /// step and, except visitMovingPairs(), if the tree has Report::kVolumes.
  template <class Visitor>
  bool visitImpacts(Visitor&& visit) const {
    Bridge<Visitor, Impact> bridge(visit);
    return visitRuns(bridge);
  }

  /// Does the same for segments a of this tree and b of another tree, which was updated with a step
  /// too; one that rests takes the same arrays twice. What visitPairs() of two trees says about
  /// them holds here.
  template <class Visitor>
  bool visitImpacts(const FiberTree& other, Visitor&& visit) const {
    Bridge<Visitor, Impact> bridge(visit);
    return visitRuns(other, bridge);
  }

  /// Replaces the content of `impacts` by all impacts.
  void findImpacts(std::vector<Impact>& impacts) const;

  /// Calls visit(SegmentPair) once for every pair that may touch during the step: the boxes of both
  /// overlap at one common time, if each side moves linearly. A program with a test of its own
  /// takes these. `visit` and the return value are those of visitPairs().
  template <class Visitor>
  bool visitMovingPairs(Visitor&& visit) const {
    Bridge<Visitor, SegmentPair> bridge(visit);
    return visitMovingRuns(bridge);
  }
  /// Does the same for segments of this tree and of another tree, as visitImpacts() does.
  template <class Visitor>
  bool visitMovingPairs(const FiberTree& other, Visitor&& visit) const {
    Bridge<Visitor, SegmentPair> bridge(visit);
    return visitMovingRuns(other, bridge);
  }

  /// Calls visit(MeshImpact) once for every segment and triangle that touch at any time of the
  /// step, while each corner moves linearly from its place in `start` to its place in `end`. A mesh
  /// that rests is passed twice. One that turns is passed in two poses, which should not differ by
  /// more than a few degrees: on the straight way, a corner comes nearer to the axis by up to 0.04
  /// % for 3 degrees. A segment that is wholly inside a solid mesh at the start is visited once, at
  /// time 0 with its nearest triangle. Roots and categories are those of visitMesh().
  ///
  /// Throws std::invalid_argument as visitMesh() does, if the last update was no step, and if the
  /// two meshes do not have the same triangles, kind and categories; `end` is best a copy of
  /// `start` that was moved by setPose() or update().
  template <class Visitor>
  bool visitImpacts(const TriangleMesh& start, const TriangleMesh& end, Visitor&& visit) const {
    Bridge<Visitor, MeshImpact> bridge(visit);
    return visitRuns(start, end, bridge);
  }

  /// Returns a time of the step up to which no pair of visitPairs() starts to touch, or 1 if none
  /// does. A pair that touches at the start counts once it comes nearer, so the result is close to
  /// 0, such as 1e-9, if one of them does so at first. To leave them out, take the least time above
  /// 0 of visitImpacts(), or pass radii to update() with which nothing touches at the start.
  ///
  /// The time is as little too early as that of an impact, and never too late. What touches at the
  /// start, or misses that by less than rounding, counts once it is nearer than it was there by
  /// 2^-35 of the sizes and distance of the capsules. The last digits of the time may depend on the
  /// number of threads.
  ///
  /// A program that moves only so far meets the same pair again at once. The pairs that touch next
  /// are the impacts whose time is little more than this one.
  double safeStep() const;

  /// Does the same for the pairs with another tree, as visitImpacts() does. The lesser of all
  /// results is safe for both trees.
  double safeStep(const FiberTree& other) const;

  /// Does the same for the pairs of visitMesh(), with a mesh that moves as in visitImpacts(). The
  /// lesser of both results is safe for fibers and mesh. A segment that is wholly inside a solid at
  /// the start, or whose axis crosses a triangle there, cannot come nearer to it: the former does
  /// not count, the latter does for other triangles and if its radius grows. Throws as
  /// visitImpacts() with a mesh does.
  double safeStep(const TriangleMesh& start, const TriangleMesh& end) const;

  /// Calls visit(TrianglePair) once for every segment and triangle of the mesh that touch: the
  /// triangle is no further from the segment's axis than its radius and the margin together. An
  /// axis that crosses a triangle touches it. A segment wholly inside a solid mesh is visited with
  /// its nearest triangle. Segments at roots, and those that may not meet the mesh, are left out.
  /// `visit` and the return value are those of visitPairs().
  ///
  /// The order of the pairs depends only on the arrays of fibers and mesh and on the poses.
  ///
  /// This call and the next two throw std::invalid_argument if the tree has Report::kVolumes,
  /// because such a tree keeps no capsules, or if the mesh is so far from the fibers that its
  /// coordinates overflow.
  template <class Visitor>
  bool visitMesh(const TriangleMesh& mesh, Visitor&& visit) const {
    Bridge<Visitor, TrianglePair> bridge(visit);
    return visitRuns(mesh, bridge);
  }

  /// Replaces the content of `segments` by the segments that touch the mesh, each once.
  void findTouching(const TriangleMesh& mesh, std::vector<std::int32_t>& segments) const;

  /// Replaces the content of `pairs` by each segment that is at most `distance` from the mesh, and
  /// its nearest triangle. The distance is that of the axis minus the radius; the margin does not
  /// count. A segment inside a solid mesh is as far from it as from its triangles. Throws
  /// std::invalid_argument if `distance` is negative or NaN.
  void findNearest(const TriangleMesh& mesh, double distance,
                   std::vector<TrianglePair>& pairs) const;

  /// Calls visit(std::int32_t) once for each segment that touches the capsule, or the box and what
  /// is in it: the two are at most the margin apart. A sphere is a capsule of length zero. If the
  /// tree has Report::kVolumes, the segments are those whose volumes overlap the shape's volume.
  /// Roots and categories do not matter here.
  ///
  /// Throws std::invalid_argument if a number is NaN or its magnitude exceeds 2^1000, if the radius
  /// is negative, if low exceeds high, or if the shape is so far from the fibers that its
  /// coordinates overflow.
  ///@{
  template <class Visitor>
  bool visitOverlaps(const CapsuleShape& capsule, Visitor&& visit) const {
    Bridge<Visitor, std::int32_t> bridge(visit);
    return visitRuns(capsule, bridge);
  }
  template <class Visitor>
  bool visitOverlaps(const BoxShape& box, Visitor&& visit) const {
    Bridge<Visitor, std::int32_t> bridge(visit);
    return visitRuns(box, bridge);
  }
  ///@}

  /// Replaces the content of `contacts` by the contacts of all pairs that visitPairs() visits, or
  /// of all that visitMesh() visits, in their order. `fibers` are the arrays of the last build or
  /// update. Threads share the work. Throws as the visit does, and as capsuleContact() does for
  /// fibers that do not suit it; then `contacts` keeps its content.
  ///@{
  void findContacts(const FiberArrays<float>& fibers, std::vector<Contact>& contacts) const;
  void findContacts(const FiberArrays<double>& fibers, std::vector<Contact>& contacts) const;
  void findContacts(const FiberArrays<float>& fibers, const TriangleMesh& mesh,
                    std::vector<MeshContact>& contacts) const;
  void findContacts(const FiberArrays<double>& fibers, const TriangleMesh& mesh,
                    std::vector<MeshContact>& contacts) const;
  ///@}

  /// Writes the contacts of `count` pairs that this tree has visited to `contacts`, in their order.
  /// Throws as the call above does; then some of the contacts may have been written.
  ///@{
  void findContacts(const FiberArrays<float>& fibers, const SegmentPair* pairs, std::size_t count,
                    Contact* contacts) const;
  void findContacts(const FiberArrays<double>& fibers, const SegmentPair* pairs, std::size_t count,
                    Contact* contacts) const;
  void findContacts(const FiberArrays<float>& fibers, const TriangleMesh& mesh,
                    const TrianglePair* pairs, std::size_t count, MeshContact* contacts) const;
  void findContacts(const FiberArrays<double>& fibers, const TriangleMesh& mesh,
                    const TrianglePair* pairs, std::size_t count, MeshContact* contacts) const;
  ///@}

  /// Returns the volumes that are `depth` levels below the root, whose own depth is 0. Capsules
  /// that are less deep come as volumes of their own, so every capsule is in one of the volumes.
  /// Throws std::invalid_argument if depth is negative.
  std::vector<TreeVolume> volumes(int depth) const;

  /// Returns the fiber of the segment that starts at point `segment`, and its number along that
  /// fiber, both counted from 0. Throws std::invalid_argument if no segment starts there.
  FiberSegment fiberSegment(std::int32_t segment) const;

  std::size_t fiberCount() const;           ///< including fibers without capsules
  std::size_t segmentCount() const;         ///< number of capsules
  const FiberTreeOptions& options() const;  ///< the options given at construction

  /// Returns the bytes that the tree holds, including those that a query on several threads keeps
  /// for the next one.
  std::size_t memoryUsage() const;

 private:
  template <class Found>
  class Runs {
   public:
    /// A return value of true ends the query.
    virtual bool take(const Found* found, std::size_t count) = 0;

   protected:
    ~Runs() = default;
  };

  template <class Visitor, class Found>
  class Bridge : public Runs<Found> {
   public:
    explicit Bridge(Visitor& visit) : visit_(visit) {}
    bool take(const Found* found, std::size_t count) override {
      for (const Found* one = found; one != found + count; ++one) {
        if constexpr (std::is_void_v<decltype(visit_(*one))>) {
          visit_(*one);
        } else if (visit_(*one)) {
          return true;
        }
      }
      return false;
    }

   private:
    Visitor& visit_;
  };

  bool visitRuns(Runs<SegmentPair>& runs) const;
  bool visitRuns(const FiberTree& other, Runs<SegmentPair>& runs) const;
  bool visitRuns(const TriangleMesh& mesh, Runs<TrianglePair>& runs) const;
  bool visitRuns(const TriangleMesh& start, const TriangleMesh& end, Runs<MeshImpact>& runs) const;
  bool visitRuns(Runs<Impact>& runs) const;
  bool visitRuns(const FiberTree& other, Runs<Impact>& runs) const;
  bool visitMovingRuns(Runs<SegmentPair>& runs) const;
  bool visitMovingRuns(const FiberTree& other, Runs<SegmentPair>& runs) const;
  bool visitRuns(const CapsuleShape& capsule, Runs<std::int32_t>& runs) const;
  bool visitRuns(const BoxShape& box, Runs<std::int32_t>& runs) const;

  class FCL_FIBERS_TREE_NO_EXPORT Impl;
  FCL_FIBERS_TREE_NO_EXPORT Impl& change(const char* call);
  FCL_FIBERS_TREE_NO_EXPORT std::shared_ptr<const Impl> held() const;

  std::shared_ptr<Impl> impl_;  ///< shared with the queries that run
};

}  // namespace fcl_fibers
