// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <type_traits>
#include <variant>
#include <vector>

#include <fcl_fibers/tree_export.h>

#include "geometry/frame.h"
#include "index/kept_segments.h"
#include "index/mesh_index.h"
#include "index/nearest_filter.h"
#include "index/pair_query.h"
#include "index/pair_search.h"
#include "index/segment_source.h"
#include "parallel/executor.h"
#include "tree/bvh.h"
#include "tree/extent.h"
#include "tree/near_visit.h"
#include "tree/topology.h"

namespace fcl_fibers::index {

struct PosedTriangles;

struct IndexOptions {
  bool wrapped_spheres = false;  ///< wrapped spheres; otherwise layered boxes
  bool super_thread = false;     ///< the super thread; otherwise the bundle
  bool capsules = false;         ///< searches report capsules that touch, not volumes that overlap
  double margin = 0;             ///< in the world's unit
  int threads = 1;
  bool share_ends = false;  ///< if there is a segment i + 1, it begins where segment i ends
};

/// Takes segments and finds their pairs. It is a Bvh over the segments begin(), ..., end() - 1 in a
/// frame of its own. It reads them from a SegmentSource and does not know where they come from.
///
/// Searches are const and may run at the same time. After a call has thrown, the index must be
/// built again.
class FCL_FIBERS_TREE_EXPORT SegmentIndex {
 public:
  using Segment = geometry::Segment;
  using Tree = std::variant<tree::LayeredBoxTree<8>, tree::LayeredBoxTree<2>,
                            tree::WrappedSphereTree<8>, tree::WrappedSphereTree<2>>;

  explicit SegmentIndex(const IndexOptions& options);

  const IndexOptions& options() const { return options_; }
  const geometry::Frame& frame() const { return frame_; }
  const Tree& tree() const { return tree_; }
  SegmentId begin() const { return begin_; }
  SegmentId end() const { return end_; }

  /// In the unit of frame(), as are all lengths below.
  double margin() const { return options_.margin * frame_.scale; }

  /// Copies the other index, except for its options, threads and scratch memory.
  /// @pre the options differ at most in threads
  void copy(const SegmentIndex& other);
  void clear();

  /// Reads all segments and builds the tree.
  /// @param fibers  the segments, with ids in [begin, end)
  void build(const SegmentSource& source, const geometry::Frame& frame, SegmentId begin,
             SegmentId end, const tree::Fibers& fibers);
  /// Does the same in a frame that was made for other segments. If the frame cannot hold a segment,
  /// it returns false, and the index has to be built again.
  bool tryBuild(const SegmentSource& source, const geometry::Frame& frame, SegmentId begin,
                SegmentId end, const tree::Fibers& fibers);

  /// Reads all segments again and refits the Bvh. It keeps its frame as long as that suits the
  /// segments, so that volumes of segments that have not moved stay the same. Returns false if a
  /// build pays, because the fibers have moved so far apart that the bundle is loose. The index is
  /// up to date even then.
  bool refit(const SegmentSource& source);
  /// Does the same in a given frame.
  bool refit(const SegmentSource& source, const geometry::Frame& frame);
  /// Does the same in a frame that was made for other segments. Returns whether all segments can be
  /// read in it.
  bool tryRefit(const SegmentSource& source, const geometry::Frame& frame);

  /// Returns a frame for the segments as they are now, or the present one if they do not stay
  /// finite in the new one.
  geometry::Frame betterFrame(const SegmentSource& source) const;

  /// Refits these segments, given in frame(), and the nodes above them. Returns what refit()
  /// returns, but checks only now and then whether a build pays.
  bool refitSome(const std::vector<SegmentId>& ids, const std::vector<Segment>& moved);

  /// The threads of a search; null for one.
  parallel::Executor* executor() const { return executor_.get(); }

  /// Whether refit() would change nothing that a search can see.
  bool isFitted(const SegmentSource& source) const;

  // Each search exists for a PairSink and for a NearestSink, which it calls on the calling thread.
  // It returns Visit::kStop if its sink did.

  /// Finds the pairs within this index, except those within one group.
  ///@{
  tree::Visit search(PairSink& sink) const;
  tree::Visit search(NearestSink& sink) const;
  ///@}

  /// Finds the pairs of this index with one segment, except those within its group. Each pair has
  /// `second` as its b.
  /// @param error  bound on the error of the segment's end points
  ///@{
  tree::Visit search(const Segment& segment, double error, tree::Group group, SegmentId second,
                     PairSink& sink) const;
  tree::Visit search(const Segment& segment, double error, tree::Group group, SegmentId second,
                     NearestSink& sink) const;
  ///@}

  /// Finds the pairs with another index, whatever their groups, with the margin of this one.
  /// @param source  the source of the other index, if that keeps no segments and the search needs
  ///                them. For a NearestSink null means its own source.
  ///@{
  tree::Visit search(const SegmentIndex& other, const SegmentSource* source, PairSink& sink) const;
  tree::Visit search(const SegmentIndex& other, const SegmentSource* source,
                     NearestSink& sink) const;
  ///@}

  /// Finds the segments that touch a mesh. In each pair b is a triangle. A segment that is a box
  /// touches a triangle if the boxes of both overlap, and if it overlaps the triangle's box in the
  /// mesh's own axes, up to margins. Segments that may not meet the mesh, see tree::Fibers::meets,
  /// are left out.
  /// @param margin  of the search, in the world's unit, whatever the index's own; the mesh's margin
  ///                comes on top
  /// @pre keepsSegments()
  ///@{
  /// Hands on every segment and triangle that touch, and each segment wholly inside a solid mesh
  /// with one triangle, its nearest.
  tree::Visit searchTriangles(const PosedMesh& mesh, double margin, PairSink& sink) const;
  /// Hands on each segment that touches the mesh once, with one of its triangles, or with -1 if it
  /// is wholly inside a solid mesh.
  tree::Visit searchMesh(const PosedMesh& mesh, double margin, PairSink& sink) const;
  /// Hands on segments and triangles that may be nearer than the limit, roughly the nearest first.
  /// What is inside a solid mesh comes before, with -1. There is no margin but the mesh's own.
  tree::Visit searchMesh(const PosedMesh& mesh, NearestSink& sink) const;
  ///@}

  /// Replaces the content of `pairs` by each segment that is at most `distance` from the mesh, and
  /// its nearest triangle, in the order of the tree.
  /// @pre keepsSegments()
  void findNearest(const PosedMesh& mesh, double distance, std::vector<tree::Pair>& pairs) const;

  /// Calls visit(id) for the segments below the volumes for which near(box) is true, in the order
  /// of the tree, until it returns Visit::kStop. The box, in this index's frame, is around a padded
  /// volume at the start and at the end of a step.
  /// @param start  this index, or one with the same topology and frame
  template <class Near, class F>
  tree::Visit visitNear(const SegmentIndex& start, const Near& near, F&& visit) const {
    return std::visit(
        [&](const auto& tree) {
          const auto& tree_at_start = std::get<std::decay_t<decltype(tree)>>(start.tree_);
          return tree.empty() ? tree::Visit::kContinue
                              : tree::visitNear(tree_at_start, tree, 0, near, visit);
        },
        tree_);
  }

  /// Runs visit(begin, end) for ranges of [0, count), on the threads of this index.
  void forRanges(std::size_t count, std::size_t grain,
                 parallel::FunctionRef<std::size_t, std::size_t> visit) const;

  /// Whether both trees have one type. If not, search() takes the other index segment by segment.
  bool matches(const SegmentIndex& other) const {
    return options_.wrapped_spheres == other.options_.wrapped_spheres &&
           options_.super_thread == other.options_.super_thread;
  }
  /// Whether the other tree's padding is so large that its rounding would show within the margin of
  /// this index. Its segments have to be read one by one then.
  bool isSwampedBy(const SegmentIndex& other) const;
  /// Whether the index keeps its segments beside their volumes, for the test of capsules.
  bool keepsSegments() const { return options_.capsules; }
  /// @pre keepsSegments()
  Segment segment(SegmentId id) const { return segments_[id]; }
  bool isBox(SegmentId id) const { return geometry::isBox(segments_.range().capsule(id)); }
  /// Whether a segment may be a box.
  /// @pre keepsSegments()
  bool hasBoxes() const { return segments_.hasBoxes(); }
  /// All segments, in the order of the tree.
  const std::vector<SegmentId>& leaves() const;

  std::size_t memoryUsage() const;

 private:
  friend class Step;

  double padding() const { return margin() / 2; }
  /// How near a mesh counts.
  struct MeshReach {
    double margin;  ///< of the search and the mesh together
    double growth;  ///< by how much a padded volume of the tree has to grow for that
  };
  MeshReach meshReach(double mesh_margin, double margin) const;
  bool tryBuild(const SegmentSource& source, const geometry::Frame& frame, SegmentId begin,
                SegmentId end, const tree::Fibers& fibers, bool in_range);
  void makeTree(const tree::Fibers& fibers, std::vector<tree::Middle> middles);
  template <class IdsOf, class Take>
  bool readRanges(const SegmentSource& source, const geometry::Frame& frame, std::size_t count,
                  IdsOf&& idsOf, Take&& take);
  template <class Take>
  bool readInOrder(const SegmentSource& source, const geometry::Frame& frame, Take&& take);
  void setSegments(const SegmentId* ids, int count, BlockMask present, const SegmentBlock& block);
  template <class Read>
  void fit(const geometry::Frame& frame, const Read& read);
  bool fitFrom(const SegmentSource& source, const geometry::Frame& frame);
  bool fitFromSegments(const geometry::Frame& frame);
  bool placeFrom(const SegmentSource& source, const geometry::Frame& frame);
  template <class F>
  void forChunks(std::size_t count, F&& visit);
  void useNewFrame();
  tree::Extent extent() const;
  SegmentRange keptRange() const;
  void limitScratch();
  double looseness() const;
  bool hasDecayed(double loose) const;

  FoundSegment find(const SegmentSource& source, SegmentId id) const;
  template <class Sink>
  FCL_FIBERS_TREE_NO_EXPORT tree::Visit searchOneByOne(const SegmentIndex& other,
                                                       const SegmentSource* source,
                                                       Sink& sink) const;
  tree::Visit searchSurfaceAndInside(const PosedMesh& mesh, double margin, bool once,
                                     PairSink& sink) const;
  void addNearest(const PosedTriangles& triangles, std::vector<tree::Pair>& pairs) const;
  template <class F>
  tree::Visit visitTrees(const SegmentIndex& other, F&& visit) const;
  KeptSegments readSegments(const SegmentSource& source) const;

  IndexOptions options_;
  std::unique_ptr<parallel::Executor> executor_;  ///< null for one thread
  std::unique_ptr<ScratchPool> scratch_;
  geometry::Frame frame_;
  SegmentId begin_ = 0, end_ = 0;
  KeptSegments segments_;  ///< empty unless capsules are tested
  Tree tree_;
  double looseness_when_built_ = 0;
  tree::Extent in_new_frame_;  ///< the extent when frame_ was chosen
  bool frame_lasts_ = false;   ///< whether frame_ is kept until it is no longer good
  std::size_t fitted_ = 0;     ///< leaves fitted by refitSome() since it last checked the looseness
  double unit_ = 1;            ///< see CapsulePairs
};

}  // namespace fcl_fibers::index
