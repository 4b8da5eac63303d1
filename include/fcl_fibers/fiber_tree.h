// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl_fibers/export.h>
#include <fcl_fibers/fiber_options.h>

namespace fcl_fibers {

/// Fibers as plain arrays, borrowed for the length of a call. Fiber f owns the points
/// [point_begin[f], point_begin[f + 1]), in their order along it, and a capsule between each two of
/// them that follow each other; a fiber of fewer than two points has none. S is float or double.
template <typename S>
struct FiberArrays {
  /// What `radii` holds.
  enum class Radii {
    kOne,         ///< radii[0] for all
    kPerFiber,    ///< radii[f]
    kPerSegment,  ///< radii[i] for the capsule that starts at point i
  };

  const S* points = nullptr;    ///< x, y, z of one point after the other: 3 point_count numbers
  std::size_t point_count = 0;  ///< at most 2^27
  /// fiber_count + 1 numbers that do not descend, from 0 to point_count.
  const std::size_t* point_begin = nullptr;
  std::size_t fiber_count = 0;    ///< those without capsules included; at most 2^27
  const S* radii = nullptr;       ///< in the unit of the points; finite, not negative
  Radii radii_are = Radii::kOne;  ///< how many there are, and whose
  /// fiber_count answers, 1 or 0, or null: none is closed. The last point of a closed fiber repeats
  /// its first one, so that its last capsule is a neighbour of its first.
  const std::uint8_t* closed = nullptr;
  /// fiber_count numbers, see FiberGroup, 0 for a fiber of no group, or null: none has one.
  const std::int32_t* groups = nullptr;
};

/// Two capsules, each named by the index of its first point; a < b within one tree.
struct SegmentPair {
  std::int32_t a;  ///< one capsule
  std::int32_t b;  ///< the other one
};

/// What a FiberTree is told once, at construction.
struct FiberTreeOptions : FiberOptions {
  /// What bounds the nodes of the tree.
  enum class Volumes {
    kLayeredBoxes,    ///< as LayeredAABBTreeCollisionManager
    kWrappedSpheres,  ///< as WrappedSphereTreeCollisionManager
  };
  Volumes volumes = Volumes::kLayeredBoxes;  ///< boxes are the ones to start with
};

/// A box or a sphere of the tree, in the frame of the arrays: it contains the capsules below it,
/// each thickened by half the margin.
struct TreeVolume {
  FiberTreeOptions::Volumes kind = FiberTreeOptions::Volumes::kLayeredBoxes;  ///< box or sphere
  double center[3] = {0, 0, 0};                                               ///< x, y, z
  double half[3] = {0, 0, 0};  ///< half the edges of the box; the radius of the sphere, three times

  /// The capsules below, each named by the index of its first point. Borrowed from the tree until
  /// it is built, updated or gone.
  const std::int32_t* segments = nullptr;
  std::size_t segment_count = 0;  ///< of `segments`
};

/// The tree of the fiber managers for programs that keep no FCL object per segment. Same answers,
/// same promises; what is read is a point, where a manager reads an object, its pose and its shape.
/// This header needs neither FCL nor Eigen.
///
/// Queries are const and may run from several threads at once; build and update must not run
/// beside them. Arrays that cannot be answered for are refused with std::invalid_argument, which
/// says which point, fiber or radius it is; the tree is then as it was. After a build or an update
/// that ran out of memory (std::bad_alloc), queries refuse until one of the two succeeds.
class FCL_FIBERS_EXPORT FiberTree {
 public:
  /// An empty tree. Throws std::invalid_argument if an option is out of range.
  explicit FiberTree(const FiberTreeOptions& options = {});
  ~FiberTree();

  /// What was moved from may be destroyed or assigned to, and nothing else.
  ///@{
  FiberTree(FiberTree&&) noexcept;
  FiberTree& operator=(FiberTree&&) noexcept;
  ///@}

  /// Replaces all fibers. At most 2^27 points. Coordinates are finite, in any one frame and unit.
  ///@{
  void build(const FiberArrays<float>& fibers);
  void build(const FiberArrays<double>& fibers);
  ///@}

  /// After points or radii have changed, but not the number of points of any fiber. S need not be
  /// what it was; which fibers are closed and of which group is what it was.
  ///@{
  void update(const FiberArrays<float>& fibers);
  void update(const FiberArrays<double>& fibers);
  ///@}

  /// Calls visit(SegmentPair) for every pair that Report, margin and what is ignored ask for,
  /// once, in an order that depends on the arrays alone. `visit` returns nothing, or a bool: true
  /// ends the query. Returns whether it was ended.
  template <class Visitor>
  bool visitPairs(Visitor&& visit) const {
    Bridge<Visitor> bridge(visit);
    return visitRuns(bridge);
  }

  /// The same for pairs of a capsule a of this tree and b of another one, which needs the same
  /// volumes and topology, and Report::kCapsules if this one has it; else throws
  /// std::invalid_argument. Report and margin are this tree's, and no pair counts as neighbours or
  /// of one group. Of the tree itself it is the query above.
  template <class Visitor>
  bool visitPairs(const FiberTree& other, Visitor&& visit) const {
    Bridge<Visitor> bridge(visit);
    return visitRuns(other, bridge);
  }

  /// All pairs; `pairs` keeps its memory from one call to the next.
  void findPairs(std::vector<SegmentPair>& pairs) const;

  /// For pictures and statistics: the volumes `depth` levels below the root, which is at 0, with
  /// those capsules that have no node so deep. Every capsule is below one of them. Throws
  /// std::invalid_argument if depth is negative.
  std::vector<TreeVolume> volumes(int depth) const;

  /// Fiber of the capsule that starts at point `segment`, and its number along it, both counted
  /// from 0. Throws std::invalid_argument if none starts there.
  FiberSegment fiberSegment(std::int32_t segment) const;

  std::size_t fiberCount() const;           ///< those without capsules included
  std::size_t segmentCount() const;         ///< number of capsules
  const FiberTreeOptions& options() const;  ///< as at construction

  /// Bytes that the tree holds, with what a query on several threads keeps for the next one.
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

  class FCL_FIBERS_NO_EXPORT Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fcl_fibers
