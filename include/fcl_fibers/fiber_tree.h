// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_options.h>
#include <fcl_fibers/tree_export.h>

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
};

/// Two segments that a query reports. Each is named by the index of the point at which it starts,
/// not by its number along a fiber: segment `a` runs from point a to point a + 1 of the arrays.
/// FiberTree::fiberSegment() returns its fiber and its number. These names stay the same over
/// updates. In a pair of one tree, a < b.
struct SegmentPair {
  std::int32_t a;  ///< index of the point at which one segment starts
  std::int32_t b;  ///< index of the point at which the other starts
};

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
/// Queries are const and may run from several threads at once. No query may run during a build or
/// an update. Both refuse invalid arrays: they throw std::invalid_argument, whose text names the
/// point, fiber or radius, and leave the tree as it was. If one of them runs out of memory
/// (std::bad_alloc), queries throw std::invalid_argument until one of the two succeeds.
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
  /// as at the last build(). S may differ from it. Closed fibers and groups stay as they were at
  /// that build.
  ///@{
  void update(const FiberArrays<float>& fibers);
  void update(const FiberArrays<double>& fibers);
  ///@}

  /// Calls visit(SegmentPair) once for every pair that the options ask for. `visit` returns
  /// nothing or a bool; true ends the query. The call returns whether `visit` ended it. The order
  /// of the pairs depends only on the arrays that were passed to the builds and updates.
  template <class Visitor>
  bool visitPairs(Visitor&& visit) const {
    Bridge<Visitor> bridge(visit);
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
    Bridge<Visitor> bridge(visit);
    return visitRuns(other, bridge);
  }

  /// Replaces the content of `pairs` by all pairs. The vector keeps its memory for the next call.
  void findPairs(std::vector<SegmentPair>& pairs) const;

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
  class Runs {
   public:
    /// A return value of true ends the query.
    virtual bool take(const SegmentPair* pairs, std::size_t count) = 0;

   protected:
    ~Runs() = default;
  };

  template <class Visitor>
  class Bridge : public Runs {
   public:
    explicit Bridge(Visitor& visit) : visit_(visit) {}
    bool take(const SegmentPair* pairs, std::size_t count) override {
      for (const SegmentPair* pair = pairs; pair != pairs + count; ++pair) {
        if constexpr (std::is_void_v<decltype(visit_(*pair))>) {
          visit_(*pair);
        } else if (visit_(*pair)) {
          return true;
        }
      }
      return false;
    }

   private:
    Visitor& visit_;
  };

  bool visitRuns(Runs& runs) const;
  bool visitRuns(const FiberTree& other, Runs& runs) const;

  class FCL_FIBERS_TREE_NO_EXPORT Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fcl_fibers
