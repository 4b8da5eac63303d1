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

/// Fibers as plain arrays, borrowed for the length of a call. Fiber f owns the points
/// [point_begin[f], point_begin[f + 1]), in their order along it, and a capsule between each two
/// consecutive ones. A fiber of fewer than two points has no capsule. S is float or double.
template <typename S>
struct FiberArrays {
  /// What `radii` holds.
  enum class Radii {
    kOne,         ///< radii[0] for all capsules
    kPerFiber,    ///< radii[f] for all capsules of fiber f
    kPerSegment,  ///< radii[i] for the capsule that starts at point i
  };

  const S* points = nullptr;    ///< x, y, z of each point: 3 point_count finite numbers
  std::size_t point_count = 0;  ///< at most 2^27
  /// fiber_count + 1 numbers from 0 to point_count that never descend.
  const std::size_t* point_begin = nullptr;
  std::size_t fiber_count = 0;    ///< including those without capsules; at most 2^27
  const S* radii = nullptr;       ///< in the unit of the points; finite, not negative
  Radii radii_are = Radii::kOne;  ///< how many radii there are, and for what
  /// fiber_count numbers, 1 for a closed fiber and 0 for others, or null if no fiber is closed. The
  /// last point of a closed fiber repeats its first, so its last capsule is a neighbour of its
  /// first.
  const std::uint8_t* closed = nullptr;
  /// fiber_count numbers of groups, 0 for a fiber without a group, or null if no fiber has one. See
  /// FiberGroup.
  const std::int32_t* groups = nullptr;
};

/// Two capsules, each named by the index of its first point. Within one tree a < b.
struct SegmentPair {
  std::int32_t a;  ///< first point of one capsule
  std::int32_t b;  ///< first point of the other
};

/// Options of a FiberTree.
struct FiberTreeOptions : FiberOptions {
  /// What bounds the nodes of the tree.
  enum class Volumes {
    kLayeredBoxes,    ///< as in LayeredAABBTreeCollisionManager
    kWrappedSpheres,  ///< as in WrappedSphereTreeCollisionManager
  };
  Volumes volumes = Volumes::kLayeredBoxes;  ///< start with boxes
};

/// A box or a sphere of the tree, in the frame of the arrays. It contains the capsules below it,
/// each thickened by half the margin.
struct TreeVolume {
  FiberTreeOptions::Volumes kind = FiberTreeOptions::Volumes::kLayeredBoxes;  ///< box or sphere
  double center[3] = {0, 0, 0};                                               ///< x, y, z
  double half[3] = {0, 0, 0};  ///< half the edges of the box; the radius of the sphere, three times

  /// The capsules below, each named by the index of its first point. They are borrowed from the
  /// tree until it is built, updated or destroyed.
  const std::int32_t* segments = nullptr;
  std::size_t segment_count = 0;  ///< number of `segments`
};

/// The tree of the fiber managers for programs that keep no FCL object per segment. It gives the
/// same answers, but reads points instead of objects. This header needs neither FCL nor Eigen.
///
/// Queries are const and may run from several threads at once. No query may run during build or
/// update. These refuse invalid arrays with std::invalid_argument, which names the point, fiber or
/// radius, and the tree is then as it was. After a build or an update that ran out of memory
/// (std::bad_alloc), queries are refused until one of the two succeeds.
class FCL_FIBERS_TREE_EXPORT FiberTree {
 public:
  /// An empty tree. Throws std::invalid_argument if an option is out of range.
  explicit FiberTree(const FiberTreeOptions& options = {});
  ~FiberTree();

  /// A tree that was moved from may only be destroyed or assigned to.
  ///@{
  FiberTree(FiberTree&&) noexcept;
  FiberTree& operator=(FiberTree&&) noexcept;
  ///@}

  /// Replaces all fibers. Coordinates may be in any frame and unit.
  ///@{
  void build(const FiberArrays<float>& fibers);
  void build(const FiberArrays<double>& fibers);
  ///@}

  /// Reads points and radii that have changed. Every fiber has to have as many points as at the
  /// last build(). S may differ. Closed fibers and groups stay as at that build.
  ///@{
  void update(const FiberArrays<float>& fibers);
  void update(const FiberArrays<double>& fibers);
  ///@}

  /// Calls visit(SegmentPair) once for every pair that the options ask for, in an order that
  /// depends on the arrays and on those of the calls before alone. `visit` returns nothing, or a
  /// bool: true ends the query. Returns whether it was ended.
  template <class Visitor>
  bool visitPairs(Visitor&& visit) const {
    Bridge<Visitor> bridge(visit);
    return visitRuns(bridge);
  }

  /// The same for pairs of a capsule a of this tree and b of another one. Report and margin are
  /// this tree's, and no pair counts as neighbours or as one group. If `other` is this tree, it is
  /// the query above.
  ///
  /// Throws std::invalid_argument unless the other tree has the same volumes and topology, and
  /// Report::kCapsules if this one has it.
  template <class Visitor>
  bool visitPairs(const FiberTree& other, Visitor&& visit) const {
    Bridge<Visitor> bridge(visit);
    return visitRuns(other, bridge);
  }

  /// Replaces the content of `pairs` by all pairs. It keeps its memory from one call to the next.
  void findPairs(std::vector<SegmentPair>& pairs) const;

  /// The volumes `depth` levels below the root, which is at 0, and those of capsules that are less
  /// deep, for pictures and statistics. Every capsule is in one of them. Throws
  /// std::invalid_argument if depth is negative.
  std::vector<TreeVolume> volumes(int depth) const;

  /// The fiber of the capsule that starts at point `segment`, and its number along that fiber, both
  /// counted from 0. Throws std::invalid_argument if no capsule starts there.
  FiberSegment fiberSegment(std::int32_t segment) const;

  std::size_t fiberCount() const;           ///< including those without capsules
  std::size_t segmentCount() const;         ///< number of capsules
  const FiberTreeOptions& options() const;  ///< the options given at construction

  /// Bytes that the tree holds, including what a query on several threads keeps for the next one.
  std::size_t memoryUsage() const;

 private:
  class Runs {
   public:
    /// Returns true to end the query.
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
