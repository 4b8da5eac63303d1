// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_questions.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/tree_export.h>
#include <fcl_fibers/triangle_mesh.h>

namespace fcl_fibers {

/// Options of LivePairs.
struct LivePairsOptions {
  /// How far beyond what touches pairs are listed, in the unit of the fibers: finite, or negative
  /// if it is chosen. A wide skin serves for many steps, and each step tests more pairs. What is
  /// chosen depends on how fast segments part and on what lists have cost, in counts. So it depends
  /// only on the calls and arrays, not on time or threads. It may be 0. At 0 there is no list, and
  /// each update searches.
  double skin = -1;
};

/// A pair that touches, and the slot that it has as long as it does.
template <class Pair>
struct LivePair {
  Pair pair;          ///< what touches
  std::int32_t slot;  ///< below LivePairs::slotCount()
};

/// What LivePairs have done so far, since they were constructed.
struct LivePairsCounters {
  std::int64_t updates = 0;          ///< calls of update() that have not thrown
  std::int64_t listings = 0;         ///< searches for all pairs, or for all within the skin
  std::int64_t uncovered_pairs = 0;  ///< tested though the last search had not listed them
  std::int64_t tested_pairs = 0;     ///< pairs that were tested, of all lists
  std::int64_t touching_pairs = 0;   ///< those of them that touched; the others were in vain
  std::int64_t longest_life = 0;     ///< the most updates that one listing of all pairs has served
};

/// Keeps the pairs that touch while fibers move little from step to step, as they do in the steps
/// and iterations of a solver. An update tests only the pairs that were near, and searches only
/// where others may have come near. The pairs are those that FiberTree::find() of Pairs finds, at
/// every update.
///
///     LivePairs live(tree);  // of the tree itself; or of (tree, other_tree), or (tree, mesh)
///     for (;;) {
///       tree.update(fibers);
///       live.update();
///       live.visit([&](SegmentPair pair, std::int32_t slot) { push(pair, friction[slot]); });
///     }
///
/// A pair lives while it touches at each of consecutive updates. It has a slot, a small number
/// for arrays of a program's own, such as friction or impulses. The slot is that of another pair
/// only after ended() has had the pair for one update. Slots outlast all that a tree does in
/// FiberTree::update(); FiberTree::build() ends all pairs, because it may give their names to other
/// segments.
///
/// While LivePairs have a list, FiberTree::update() of their tree with one argument reads and
/// checks all points, and leaves it to the first query that needs the tree to refit that. So a step
/// without a search does not pay for one. After an update with a step, the pairs are those at its
/// end.
///
/// With a mesh, pairs outlast all that it does in TriangleMesh::setPose() and update(). All end if
/// a mesh of another construction is assigned to it. A segment wholly inside a solid is paired with
/// its nearest triangle: if another one becomes the nearest, one pair ends and another one begins.
///
/// The tree and the partner are borrowed and must stay where they are. All functions other than
/// update() are const; several threads may call them at once.
///
/// @tparam Partner  FiberTree: another one, or the tree itself; or TriangleMesh
template <class Partner = FiberTree>
class LivePairs {
 public:
  using Pair = FoundBy<Pairs, Partner>;  ///< a pair of the tree and the partner

  /// Begins without pairs. Throws std::invalid_argument if the skin is NaN or infinite, or if a
  /// tree has wrapped spheres or Report::kVolumes.
  ///@{
  template <class Own = Partner, std::enable_if_t<std::is_same_v<Own, FiberTree>, int> = 0>
  explicit LivePairs(FiberTree& tree, const LivePairsOptions& options = {})
      : LivePairs(tree, tree, options) {}
  FCL_FIBERS_TREE_EXPORT LivePairs(FiberTree& tree, const Partner& partner,
                                   const LivePairsOptions& options = {});
  ///@}
  FCL_FIBERS_TREE_EXPORT ~LivePairs();
  /// Takes over the pairs of the other one, which then may only be assigned to or destroyed.
  ///@{
  FCL_FIBERS_TREE_EXPORT LivePairs(LivePairs&&) noexcept;
  FCL_FIBERS_TREE_EXPORT LivePairs& operator=(LivePairs&&) noexcept;
  ///@}

  /// Brings the pairs to where the fibers are now. It may fit the tree, so no query of the tree may
  /// run meanwhile, and no function of these pairs; of another tree as the partner it is a query.
  /// Throws std::invalid_argument as FiberTree::find() of Pairs does, and if a query of the tree
  /// runs, and std::length_error as find() does, where the pairs within the skin count. After it
  /// has thrown, the pairs and what began and ended are as they were.
  FCL_FIBERS_TREE_EXPORT void update();

  /// Returns how many pairs touch.
  FCL_FIBERS_TREE_EXPORT std::size_t count() const;
  /// All slots are from 0 to slotCount() - 1. It never falls, and is at most the largest sum of
  /// pairs that touched at an update and those that had ended at the same.
  FCL_FIBERS_TREE_EXPORT std::int32_t slotCount() const;

  /// Calls visit(pair, slot) for each pair that touches, in the order of the list: that of the
  /// search which has listed them, then what was listed later, then what is inside a solid. It
  /// depends only on the calls and arrays since the construction. `visit` returns nothing or a
  /// bool; true ends the call, which then returns true.
  template <class Visitor>
  bool visit(Visitor&& visit) const {
    return visitRuns([&visit](const LivePair<Pair>* run, std::size_t count) {
      for (const LivePair<Pair>* one = run; one != run + count; ++one) {
        if constexpr (std::is_void_v<decltype(visit(one->pair, one->slot))>) {
          visit(one->pair, one->slot);
        } else if (visit(one->pair, one->slot)) {
          return true;
        }
      }
      return false;
    });
  }

  /// Replaces the content of `pairs` by the pairs that touch, in the order of visit().
  ///@{
  FCL_FIBERS_TREE_EXPORT void find(std::vector<Pair>& pairs) const;
  FCL_FIBERS_TREE_EXPORT void find(std::vector<LivePair<Pair>>& pairs) const;
  ///@}
  /// Replaces the content of `contacts` by the contacts of these pairs, where the fibers are now.
  /// Throws as FiberTree::writeContacts() does.
  template <typename S, class Found>
  void find(const Contacts<S>& question, std::vector<Found>& contacts) const {
    std::vector<Pair> pairs;
    find(pairs);
    contacts.resize(pairs.size());
    tree().writeContacts(question, partner(), pairs.data(), pairs.size(), contacts.data());
  }

  /// Writes for each point how far it may move, in the unit of the fibers, so that no two segments
  /// touch then that do not touch now: none do if no point moves further than its own distance. It
  /// is half of the gap to the nearest segment that it is not to touch, less up to a thirty-second
  /// of that, and at most half of what is left of the skin: about a quarter of the skin at least,
  /// if it is asked for after each update and not very many pairs are near. Points of a pair that
  /// touches get 0, unless such pairs are skipped because a program parts them. Points of no
  /// segment get infinity. Neighbours and groups that are left out of the pairs do not count, and
  /// the margin does. The second form writes the distances of the partner's points, too, which then
  /// may move at the same time; in the first one the partner's points may as well.
  ///
  /// With a mesh, they are such that no segment touches the mesh then, or is inside a solid, that
  /// does not now. The mesh stays where it is, so they are the whole gap, and at most all that is
  /// left of the skin. Segments that the mesh does not meet do not count. Those that touch it, or
  /// are inside, do not either if `skips_touching` is true, so that they may slide to other
  /// triangles or come out. Of several partners, the least distance of all LivePairs is safe.
  ///
  /// Throws std::invalid_argument if the trees or the mesh have changed since update(), if the
  /// second form is asked with a mesh, or if there is no list: if skin() is 0, or update() has
  /// thrown. To have one always, give LivePairsOptions::skin.
  ///@{
  FCL_FIBERS_TREE_EXPORT void safeDistances(std::vector<double>& distances,
                                            bool skips_touching = false) const;
  FCL_FIBERS_TREE_EXPORT void safeDistances(std::vector<double>& distances,
                                            std::vector<double>& partner_distances,
                                            bool skips_touching = false) const;
  ///@}

  /// What began and what ended to touch in the last update. A pair that has ended may be of
  /// segments that are no more.
  ///@{
  FCL_FIBERS_TREE_EXPORT std::vector<LivePair<Pair>> begun() const;
  FCL_FIBERS_TREE_EXPORT std::vector<LivePair<Pair>> ended() const;
  ///@}

  /// Returns the skin at present, in the unit of the fibers; 0 if each update searches.
  FCL_FIBERS_TREE_EXPORT double skin() const;
  FCL_FIBERS_TREE_EXPORT LivePairsCounters counters() const;  ///< see LivePairsCounters
  /// Returns the bytes that the pairs hold, without those of the trees.
  FCL_FIBERS_TREE_EXPORT std::size_t memoryUsage() const;

  FCL_FIBERS_TREE_EXPORT const FiberTree& tree() const;   ///< as given at construction
  FCL_FIBERS_TREE_EXPORT const Partner& partner() const;  ///< as given, or the tree

 private:
  FCL_FIBERS_TREE_EXPORT bool visitRuns(
      const std::function<bool(const LivePair<Pair>* run, std::size_t count)>& take) const;

  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// The pairs within a tree.
///@{
LivePairs(FiberTree&)->LivePairs<FiberTree>;
LivePairs(FiberTree&, const LivePairsOptions&)->LivePairs<FiberTree>;
///@}

}  // namespace fcl_fibers
