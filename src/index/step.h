// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <type_traits>
#include <variant>
#include <vector>

#include <fcl_fibers/tree_export.h>

#include "geometry/moving_segment.h"
#include "index/impact_filter.h"
#include "index/pair_filter.h"
#include "index/segment_index.h"
#include "tree/moving_tree.h"

namespace fcl_fibers::index {

class MovingMesh;
class SegmentMarks;

/// A step of the segments of an index, from time 0 to time 1: one index is fitted to the start and
/// one to the end. Both may be the same index, whose segments then rest. Searches are const and may
/// run at the same time.
///
/// A search takes the threads, the margin and the order of pairs of the index at the end. Moving
/// pairs are those whose boxes overlap at one common time, if each side moves linearly. `wanted`
/// tells which pairs count at all, such as those that are no neighbours; null means all.
class FCL_FIBERS_TREE_EXPORT Step {
 public:
  /// @param start, end  borrowed; one topology, one frame, layered boxes
  Step(const SegmentIndex& start, const SegmentIndex& end) : start_(start), end_(end) {}

  /// Finds the moving pairs within the step, except those within one group.
  tree::Visit searchMoving(const PairFilter* wanted, PairSink& sink) const;
  /// Finds the moving pairs with another step of the same topology, whatever their groups.
  tree::Visit searchMoving(const Step& other, const PairFilter* wanted, PairSink& sink) const;
  /// Finds the moving pairs with one segment, as SegmentIndex::search() does.
  tree::Visit searchMoving(const geometry::MovingSegment& segment, double error, tree::Group group,
                           SegmentId second, const PairFilter* wanted, PairSink& sink) const;

  /// Does the same for the pairs whose capsules touch at some time, each with its impact.
  /// @pre all indexes keep their segments
  ///@{
  tree::Visit searchImpacts(const PairFilter* wanted, PairSink& sink) const;
  tree::Visit searchImpacts(const Step& other, const PairFilter* wanted, PairSink& sink) const;
  tree::Visit searchImpacts(const geometry::MovingSegment& segment, double error, tree::Group group,
                            SegmentId second, const PairFilter* wanted, PairSink& sink) const;
  ///@}

  /// Finds the segments that touch a triangle of a mesh at some time, each pair with its impact; b
  /// is the triangle. A segment that is wholly inside a solid mesh at the start comes first and
  /// once, at time 0 with its nearest triangle.
  /// @param margin  see SegmentIndex::searchMesh()
  /// @pre the indexes keep their segments; the mesh has their frame
  tree::Visit searchImpacts(const MovingMesh& mesh, double margin, PairSink& sink) const;

  /// Finds the first time at which two segments touch that did not at the start, or come nearer
  /// than they were there. Returns 1 if there is none.
  /// @pre the indexes keep their segments, and no segment is a box
  double safeTime(const PairFilter* wanted) const;
  /// Does the same for pairs with another step of the same topology, whatever their groups.
  double safeTime(const Step& other) const;
  /// Does the same for segments and triangles of a mesh. Segments that are wholly inside a solid
  /// mesh at the start do not count, because on their way out they touch its surface.
  double safeTime(const MovingMesh& mesh) const;

 private:
  MovingRange segments() const;
  std::vector<tree::Pair> findInside(const MovingMesh& mesh, double margin,
                                     SegmentMarks& inside) const;
  template <class F>
  tree::Visit visitMesh(const MovingMesh& mesh, double margin, const SegmentMarks& inside,
                        const std::atomic<float>& until, F&& visit) const;
  template <class F>
  tree::Visit visitTree(F&& visit, const std::atomic<float>& until = tree::kWholeStep) const;
  template <class F>
  tree::Visit visitTrees(const Step& other, F&& visit,
                         const std::atomic<float>& until = tree::kWholeStep) const;

  const SegmentIndex& start_;
  const SegmentIndex& end_;
};

/// Calls visit(tree) with the tree that moves.
template <class F>
tree::Visit Step::visitTree(F&& visit, const std::atomic<float>& until) const {
  return std::visit(
      [&](const auto& start, const auto& end) {
        using Tree = std::decay_t<decltype(end)>;
        if constexpr (std::is_same_v<decltype(start), decltype(end)> &&
                      std::is_same_v<Tree, tree::LayeredBoxTree<Tree::kArity>>) {
          return visit(tree::MovingTree<Tree::kArity>(start, end, until));
        } else {
          return tree::Visit::kContinue;
        }
      },
      start_.tree_, end_.tree_);
}

}  // namespace fcl_fibers::index
