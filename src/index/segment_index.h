// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <memory>
#include <mutex>
#include <type_traits>
#include <variant>
#include <vector>

#include <fcl_fibers/tree_export.h>

#include "geometry/frame.h"
#include "geometry/moving_segment.h"
#include "geometry/obstacle.h"
#include "index/hull_filter.h"
#include "index/kept_segments.h"
#include "index/mesh_index.h"
#include "index/nearest_filter.h"
#include "index/pair_query.h"
#include "index/pair_search.h"
#include "index/segment_source.h"
#include "parallel/executor.h"
#include "tree/bvh.h"
#include "tree/extent.h"
#include "tree/moving_tree.h"
#include "tree/topology.h"
#include "tree/volumes.h"

namespace fcl_fibers::index {

class PosedMesh;
class PosedTriangles;

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
/// During a step, from time 0 to time 1, it also has the segments as they were at the start, and
/// the volumes around them in the same topology. Each segment moves linearly. All else that is said
/// here of segments is about the end of the step.
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
  const geometry::Frame& frame() const { return now_.frame; }
  const Tree& tree() const { return fitted().tree; }
  SegmentId begin() const { return begin_; }
  SegmentId end() const { return end_; }

  /// In the unit of frame(), as are all lengths below that name no other unit.
  double margin() const { return options_.margin * frame().scale; }

  /// Copies the other index, except for its options, threads, step and the memory of
  /// searches.
  /// @pre the options differ at most in threads
  void copy(const SegmentIndex& other);
  void clear();

  /// Reads all segments and builds the tree.
  /// @param fibers  the segments, with ids in [begin, end)
  void build(const SegmentSource& source, const geometry::Frame& frame, SegmentId begin,
             SegmentId end, const tree::Fibers& fibers);
  /// Reads all segments and builds the tree in a frame that was made for other segments. If the
  /// frame cannot hold a segment, it returns false, and the index has to be built again.
  bool tryBuild(const SegmentSource& source, const geometry::Frame& frame, SegmentId begin,
                SegmentId end, const tree::Fibers& fibers);

  /// Reads all segments again and refits the Bvh. It keeps its frame as long as that suits the
  /// segments, so that volumes of segments that have not moved stay the same. Returns false if a
  /// build pays, because the fibers have moved so far apart that the bundle is loose. The index is
  /// up to date even then.
  bool refit(const SegmentSource& source);
  /// Reads all segments again in a given frame. The result is that of the other refit().
  bool refit(const SegmentSource& source, const geometry::Frame& frame);
  /// Reads all segments again in a frame that was made for other segments. Returns whether all of
  /// them can be read in it.
  bool tryRefit(const SegmentSource& source, const geometry::Frame& frame);

  /// Reads all segments again and leaves the volumes to the first search that needs them. Returns
  /// false if refit() has to be called, because the segments do not suit the frame any more or the
  /// tree has to be built again. Then it may have read some of them.
  /// @pre keepsSegments()
  bool reread(const SegmentSource& source);

  /// Fits the volumes for a search that also finds pairs beyond the margin.
  /// @param beyond  how far beyond it, in the world's unit; see Question::beyond
  /// @pre no search runs
  void fitBeyond(double beyond);

  /// Changes with every build, because each may order the leaves differently.
  std::size_t buildCount() const { return build_count_; }

  /// Calls visit(filter) with the test of pairs that a search for what touches makes. The volumes
  /// need not be fitted.
  /// @param other  the index of the second segments; null for this one
  template <class F>
  void withTouchTest(const SegmentIndex* other, F&& visit) const;
  /// Moves the pairs within this index that pass that test to the front in their order, and returns
  /// their number.
  std::size_t keepTouching(tree::Pair* pairs, std::size_t count) const;
  /// Calls visit(filter) as withTouchTest() above does, with the test of segments against the
  /// triangles of a mesh in frame().
  /// @param margin  of the search and the mesh together, in the world's unit
  template <class F>
  void withTouchTest(const PosedTriangles& triangles, double margin, F&& visit) const {
    visit(HullFilter(rangeOf(now_), TriangleHulls<PosedTriangles>{triangles},
                     meshReach(margin).margin, unit_));
  }

  /// Returns a frame for the segments as they are now, or the present one if they do not stay
  /// finite in the new one.
  geometry::Frame betterFrame(const SegmentSource& source) const;

  /// Refits these segments, given in frame(), and the nodes above them. Returns what refit()
  /// returns, but checks only now and then whether a build pays.
  bool refitSome(const std::vector<SegmentId>& ids, const std::vector<Segment>& moved);

  /// @name Steps
  /// A step needs layered boxes.
  ///@{

  /// Begins a step at the segments as they are now. It lasts over all builds and refits until the
  /// next one begins or endStep(). A segment that is read for the first time during the step starts
  /// where it is then. A call needs no memory; the next refit does.
  /// @pre keepsSegments(), and ends are not shared
  void beginStep() { step_ = Step::kBegins; }
  /// Begins a step at the segments of a source, which ends at the segments as they are now. The
  /// next refit or build ends the step. Returns whether all could be read in frame().
  bool fitStart(const SegmentSource& source);
  void endStep();
  /// Whether any segment may have moved.
  bool moves() const { return step_ == Step::kGiven || step_ == Step::kMoves; }
  /// @pre keepsSegments()
  geometry::MovingSegment moving(SegmentId id) const {
    return {start().segments[id], now_.segments[id]};
  }
  /// Takes the starts of the segments of another index, because a build has to come next that reads
  /// these segments, too. Both have to have a step or none. The other one becomes empty.
  void takeStarts(SegmentIndex& other);
  /// See KeptSegments.
  /// @pre takeStarts() was called
  template <class NewId>
  void renumberStarts(NewId&& newId) {
    if (step_ == Step::kMoves) start_->segments.renumber(newId);
  }
  ///@}

  /// The threads of a search; null for one.
  parallel::Executor* executor() const { return executor_.get(); }
  /// The numbers of threads in a PairRun are below this.
  int workerCount() const { return executor_ != nullptr ? executor_->threads() : 1; }

  /// Whether refit() would change nothing that a search can see.
  bool isFitted(const SegmentSource& source) const;

  // Searches return Visit::kStop if their sink did. A NearestSink is called on the calling thread.
  // It gets the pairs at the end of the step that may be nearer than its limit, roughly the nearest
  // first. There is one search for each kind of partner.

  /// Finds the pairs within this index, except those within one group.
  ///@{
  tree::Visit search(PairSink& sink, const Question& question = {}) const;
  tree::Visit search(NearestSink& sink) const;
  ///@}

  /// Finds the pairs of this index with one segment, except those within its group. Each pair has
  /// `second` as its b.
  /// @param error  bound on the error of the segment's end points
  ///@{
  tree::Visit search(const geometry::MovingSegment& segment, double error, tree::Group group,
                     SegmentId second, PairSink& sink, const Question& question = {}) const;
  tree::Visit search(const geometry::MovingSegment& segment, double error, tree::Group group,
                     SegmentId second, NearestSink& sink) const;
  ///@}

  /// Finds the pairs with another index, whatever their groups, with the margin of this one.
  /// @param source  the source of the other index, if that keeps no segments and the search needs
  ///                them. For a NearestSink null means its own source.
  ///@{
  tree::Visit search(const SegmentIndex& other, const SegmentSource* source, PairSink& sink,
                     const Question& question = {}) const;
  tree::Visit search(const SegmentIndex& other, const SegmentSource* source,
                     NearestSink& sink) const;
  ///@}

  /// Finds the segments and triangles of a mesh in frame() that touch. In each pair b is a
  /// triangle. A segment that is a box touches a triangle if the boxes of both overlap, and if it
  /// overlaps the triangle's box in the mesh's own axes, up to margins. Segments that may not meet
  /// the mesh, see tree::Fibers::meets, are left out. Behind these pairs comes each segment wholly
  /// inside a solid mesh with one triangle, its nearest; if one triangle of each segment is enough,
  /// with -1.
  ///
  /// If the mesh has a step, the whole step counts. Then a segment that is inside a solid at the
  /// start comes first and once, at time 0. It does not count for a first time, because on its way
  /// out it touches the surface.
  /// @param margin  of the search, in the world's unit, whatever the index's own; the mesh's margin
  ///                comes on top
  /// @pre keepsSegments()
  tree::Visit search(const PosedMesh& mesh, double margin, PairSink& sink,
                     const Question& question = {}) const;
  /// Hands on segments and triangles that may be nearer than the limit. What is inside a solid mesh
  /// comes before, with -1.
  /// @param margin  has no effect, and is there because Generations calls both searches alike; only
  ///        the mesh's own margin counts
  tree::Visit search(const PosedMesh& mesh, double margin, NearestSink& sink) const;

  /// Finds the pairs of this index with an obstacle in frame() that rests. In each pair b is 0.
  /// If the index keeps no segments, only their volumes count. A volume counts if it overlaps that
  /// of a capsule, or of the box along the axes around a turned box, or if it reaches a plane or
  /// half-space.
  tree::Visit search(const geometry::Obstacle& obstacle, PairSink& sink,
                     const Question& question = {}) const;

  /// Finds the first time of the step that Question::first asks for, with a partner of search().
  /// Returns 1 if there is none. Throws as requireFew() does.
  /// @param elements  as requireFew() has it
  template <class... Partner>
  double firstTime(std::size_t elements, const PairFilter* wanted,
                   const Partner&... partner) const {
    FirstTime first(elements);
    NoSink nothing;
    search(partner..., nothing, Question::ofStep(wanted, &first));
    return first.get();
  }

  /// Finds each segment that is at most `distance` from the mesh, and its nearest triangle, in the
  /// order of the tree.
  /// @param distance  of the surfaces, in the world's unit
  /// @pre keepsSegments()
  tree::Visit findNearest(const PosedMesh& mesh, double distance, PairSink& sink) const;

  /// Hands on what find(begin, end, out) adds to `out` for ranges of [0, count), in their order. It
  /// is called on the threads of this index.
  template <class Find>
  tree::Visit findInRanges(std::size_t count, std::size_t grain, PairSink& sink,
                           const Find& find) const {
    std::vector<std::vector<tree::Pair>> found((count + grain - 1) / grain);
    forRanges(found.size(), 1, [&](std::size_t from, std::size_t to) {
      for (std::size_t part = from; part < to; ++part) {
        find(part * grain, std::min((part + 1) * grain, count), found[part]);
      }
    });
    std::vector<PairRun> runs;
    runs.reserve(found.size());
    for (const auto& part : found) runs.push_back({part.data(), nullptr, part.size()});
    return handOn(runs, executor(), sink);
  }

  /// Hands on what one thread has found. The threads of this index share it, unless the sink takes
  /// all on the calling one.
  tree::Visit share(const PairRun& found, PairSink& sink) const;

  /// Calls visit(id) for the segments below the volumes for which near(box) is true, in the order
  /// of the tree, until it returns Visit::kStop. The box, in this index's frame, is around a padded
  /// volume.
  /// @param of_step  whether the box is around the volume at the start, too
  template <class Near, class F>
  tree::Visit visitNear(bool of_step, const Near& near, F&& visit) const {
    return std::visit(
        [&](const auto& tree) {
          const auto& tree_at_start =
              std::get<std::decay_t<decltype(tree)>>((of_step ? start() : fitted()).tree);
          return tree.empty() ? tree::Visit::kContinue
                              : tree::visitNear(tree_at_start, tree, 0, near, visit);
        },
        fitted().tree);
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
  Segment segment(SegmentId id) const { return now_.segments[id]; }
  bool isBox(SegmentId id) const { return geometry::isBox(now_.segments.range().capsule(id)); }
  /// Whether a segment may be a box.
  /// @pre keepsSegments()
  bool hasBoxes() const { return now_.segments.hasBoxes(); }
  /// Whether a segment may be a capsule or a box around one.
  /// @pre keepsSegments()
  bool hasCapsules() const { return now_.segments.hasCapsules(); }
  /// All segments, in the order of the tree.
  const tree::SegmentIds& leaves() const;
  const KeptSegments& segments() const { return now_.segments; }
  /// Bounds the coordinates of all segments. The volumes need not be fitted.
  double reach() const { return reachOf(now_); }
  /// The distance of the axes of two usual segments that touch, or a small share of their length if
  /// that is 0; never 0. It is estimated from a sample.
  double usualReach() const;
  /// The unit for blocks of pairs; see CapsulePairs.
  double pairUnit() const { return unit_; }

  std::size_t memoryUsage() const;

  /// The cages of a tree of spheres, and those of them that the last fit made anew.
  struct Cages {
    std::size_t all = 0, recomputed = 0;
  };
  /// None of a tree of boxes.
  Cages cages() const;

 private:
  /// The segments at one end of a step, and the volumes around them.
  struct End {
    geometry::Frame frame;
    KeptSegments segments{/*share_ends=*/false};  ///< empty unless capsules are tested
    Tree tree;
    double reach = -1;  ///< bounds the coordinates; negative if the volumes tell
  };
  enum class Step {
    kNone,    ///< all rest
    kGiven,   ///< start_ was given for the segments as they are
    kBegins,  ///< the step has begun, and nothing has moved since
    kMoves,   ///< start_ is where the segments were
  };

  /// Fits the volumes if reread() or fitBeyond() has left that to a search.
  const End& fitted() const {
    if (!fit_->is_due.load(std::memory_order_acquire)) return now_;
    return fittedNow();
  }
  const End& fittedNow() const;
  const End& start() const { return moves() ? *start_ : fitted(); }
  double padding() const { return margin() / 2; }
  /// How near a mesh counts, in frame().
  struct MeshReach {
    double margin;  ///< of the search and the mesh together
    double growth;  ///< by how much a padded volume of the tree has to grow for that
  };
  MeshReach meshReach(double margin) const;

  // Reading.

  using Middles = parallel::UnwrittenVector<tree::Middle>;

  bool tryBuild(const SegmentSource& source, const geometry::Frame& frame, SegmentId begin,
                SegmentId end, const tree::Fibers& fibers, bool in_range);
  void makeTree(const tree::Fibers& fibers, Middles middles);
  template <class IdsOf, class Take>
  bool readRanges(const SegmentSource& source, const geometry::Frame& frame, std::size_t count,
                  IdsOf&& idsOf, Take&& take);
  template <class Take>
  bool readInOrder(const KeptSegments& segments, const SegmentSource& source,
                   const geometry::Frame& frame, Take&& take);
  double readKept(KeptSegments& segments, const SegmentSource& source,
                  const geometry::Frame& frame);
  bool read(End& end, const SegmentSource& source, const geometry::Frame& frame);
  template <class Read>
  void fit(End& end, double padding, const Read& read) const;
  bool fitFrom(End& end, const SegmentSource& source);
  void fitFromSegments(End& end, double padding) const;
  bool placeFrom(End& end, const SegmentSource& source);
  template <class F>
  void forChunks(std::size_t count, F&& visit) const;
  void useNewFrame();
  tree::Extent extent() const;
  tree::Extent sampledExtent(double reach) const;
  void limitBlocks();
  double looseness() const;
  bool hasDecayed(double loose) const;

  // The start of a step.

  void leaveStart(const std::vector<SegmentId>* moving);
  void keepStarts();
  void bringStart(const SegmentSource& source);

  // Searching.

  static double reachOf(const End& end);
  static SegmentRange rangeOf(const End& end);
  SegmentRange keptRange(const Question& question = {}) const {
    return rangeOf(question.beyond > 0 ? now_ : fitted());
  }
  MovingRange movingRange(const Question& question = {}) const {
    const SegmentRange end = keptRange(question);
    return {moves() ? rangeOf(start()) : end, end};
  }
  FoundSegment find(const SegmentSource* source, SegmentId id) const;
  tree::Visit searchAround(const geometry::MovingSegment& segment, double error, tree::Group group,
                           SegmentId second, const PairFilter* filter, PairSink& sink,
                           const Question& question, bool moves) const;
  template <class Sink, class... Asked>
  FCL_FIBERS_TREE_NO_EXPORT tree::Visit searchOneByOne(const SegmentIndex& other,
                                                       const SegmentSource* source, Sink& sink,
                                                       const Asked&... asked) const;
  template <class F>
  tree::Visit visitTree(const Question& question, bool moves, F&& visit) const;
  template <class ATree>
  FCL_FIBERS_TREE_NO_EXPORT tree::TreePair<ATree> pairOf(const ATree& own, const ATree& its,
                                                         const SegmentIndex& other,
                                                         double beyond) const;
  template <class F>
  tree::Visit visitTrees(const SegmentIndex& other, const Question& question, bool moves,
                         F&& visit) const;
  template <class RangeOfB, class F>
  tree::Visit withFilter(const Question& question, bool moves, RangeOfB&& rangeOfB,
                         const geometry::FrameChange* b_to_a, double error, F&& visit) const;
  tree::Visit find(const PairSearch& search, const PairFilter* filter, PairSink& sink) const {
    return findPairs(search, filter, executor_.get(), *blocks_, sink);
  }
  KeptSegments readSegments(const SegmentSource& source) const;
  tree::Visit searchAt(const End& end, const PosedTriangles& triangles, double margin,
                       const Question& question, PairSink& sink) const;
  void addNearest(const End& at, const PosedTriangles& triangles,
                  std::vector<tree::Pair>& pairs) const;

  IndexOptions options_;
  std::unique_ptr<parallel::Executor> executor_;  ///< null for one thread
  std::unique_ptr<BlockPool> blocks_;
  SegmentId begin_ = 0, end_ = 0;
  /// Whether the volumes of now_ have yet to be fitted.
  struct Fit {
    std::atomic<bool> is_due{false};
    std::mutex mutex;
  };
  std::unique_ptr<Fit> fit_ = std::make_unique<Fit>();
  mutable End now_;                ///< a search may fit the volumes
  mutable bool is_loose_ = false;  ///< whether that has shown that a build pays
  std::size_t build_count_ = 0;
  double looseness_when_built_ = 0;
  tree::Extent in_new_frame_;          ///< the extent when the frame was chosen
  double reach_in_new_frame_ = 0;      ///< of all of it, when the frame was chosen
  std::size_t unseen_ = 0;             ///< segments read since the extent was last found
  tree::Extent sampled_in_new_frame_;  ///< the same by sampledExtent(); if segments are kept
  bool frame_lasts_ = false;           ///< whether the frame is kept until it is no longer good
  std::size_t fitted_ = 0;  ///< leaves fitted by refitSome() since it last checked the looseness
  double unit_ = 1;         ///< see CapsulePairs

  Step step_ = Step::kNone;
  /// Of use if moves(). Otherwise it has memory and, if a step begins, where the segments were in
  /// the step before. Its tree is empty if it has another topology.
  std::unique_ptr<End> start_;
  bool moved_all_ = true;         ///< whether any segment may have moved in the last step
  std::vector<SegmentId> moved_;  ///< those that have, unless all may have
};

/// Calls visit(tree) with the tree or, if it moves, with that at both ends of the step.
template <class F>
tree::Visit SegmentIndex::visitTree(const Question& question, bool moves, F&& visit) const {
  return std::visit(
      [&](const auto& tree) {
        using ATree = std::decay_t<decltype(tree)>;
        if (!moves) return visit(tree);
        if constexpr (std::is_same_v<ATree, tree::LayeredBoxTree<ATree::kArity>>) {
          return visit(tree::MovingTree<ATree::kArity>(std::get<ATree>(start().tree), tree,
                                                       lastTime(question)));
        } else {
          return tree::Visit::kContinue;  // spheres have no steps
        }
      },
      fitted().tree);
}

template <class F>
void SegmentIndex::withTouchTest(const SegmentIndex* other, F&& visit) const {
  const SegmentRange own = rangeOf(now_);
  if (other == nullptr) {
    visit(HullFilter(own, SegmentHulls<SegmentRange>{own, nullptr, 0}, margin(), unit_));
  } else {
    const geometry::FrameChange to_this(other->frame(), frame());
    const SegmentHulls<SegmentRange> hulls{rangeOf(other->now_), &to_this, 0};
    visit(HullFilter(own, hulls, margin(), unit_));
  }
}

}  // namespace fcl_fibers::index
