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
  /// Pairs are listed if they touch or are at most this far from touching, in the unit of the
  /// fibers. Finite. If it is 0, there is no list, and each update searches. If it is negative, the
  /// library chooses a skin anew for each search, and may choose 0.
  ///
  /// A wide skin serves for many steps, but each step tests more pairs. The library chooses by how
  /// fast near segments come nearer to each other, and by what lists have cost in counts of work.
  /// So the choice depends only on the calls and arrays, not on time or threads.
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
  std::int64_t uncovered_pairs = 0;  ///< tests of pairs that were not on the list
  std::int64_t tested_pairs = 0;     ///< tests of listed pairs, added up over all updates
  std::int64_t touching_pairs = 0;   ///< those of these tests that found a touch
  std::int64_t longest_life = 0;     ///< the most updates that one list has served after its search
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
/// A pair lives while it touches at each of consecutive updates. It has a slot, a small number for
/// arrays of a program's own, such as friction or impulses. The slot is that of another pair only
/// after ended() has had the pair for one update. A pair that lives keeps its slot over every
/// FiberTree::update(). The first update() after a FiberTree::build() ends all pairs, because their
/// names may be those of other segments.
///
/// While LivePairs have a list, FiberTree::update() of their tree with one argument reads and
/// checks all points, but does not refit the tree. The first query that needs the tree refits it.
/// So a step without a search does not pay for a refit. After an update with a step, the pairs are
/// those at its end.
///
/// If the partner is a mesh, a pair that goes on touching also keeps its slot over
/// TriangleMesh::setPose() and update(). All pairs end if a mesh of another construction is
/// assigned to it. A segment wholly inside a solid is paired with its nearest triangle: if another
/// one becomes the nearest, one pair ends and another one begins.
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

  /// Brings the pairs to where the fibers are now. The call may fit the tree, so no query of the
  /// tree and no function of these pairs may run meanwhile. For another tree that is the partner,
  /// the call is a query. Throws std::invalid_argument as FiberTree::find() of Pairs does, and if a
  /// query of the tree runs. Throws std::length_error as find() does; here all pairs within the
  /// skin count. After it has thrown, the pairs and what began and ended are as they were.
  FCL_FIBERS_TREE_EXPORT void update();

  /// Returns how many pairs touch.
  FCL_FIBERS_TREE_EXPORT std::size_t count() const;
  /// All slots are from 0 to slotCount() - 1. It never falls. Each
  /// update has a sum: the pairs that touch, and those that it has ended. The largest of these sums
  /// is the most that slotCount() can be.
  FCL_FIBERS_TREE_EXPORT std::int32_t slotCount() const;

  /// Calls visit(pair, slot) for each pair that touches, in the order of the list. The pairs that
  /// the last search for all has listed come first, in the order of that search. Then come pairs
  /// that were listed later, then segments inside a solid. The order depends only on the calls and
  /// arrays since the construction. `visit` returns nothing or a bool; true ends the call, which
  /// then returns true.
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

  /// Replaces the content of `distances` by one number for each point of the tree: how far the
  /// point may move, in the unit of the fibers. If no point moves further than its own number, no
  /// two segments touch afterwards that do not touch now. The number is the lesser of two:
  /// * half the gap, beyond the margin, to the nearest segment that does not touch the point's
  ///   segments now, rounded down by up to a thirty-second;
  /// * half of what is left of the skin. This is at least about a quarter of the skin if distances
  ///   are asked for after each update, and if not very many pairs are near.
  ///
  /// Points of a pair that touches get 0. If `skips_touching` is true, such pairs do not count, for
  /// a program that parts them. Points of no segment get infinity. Neighbours and segments of one
  /// group never count as a pair, so they put no limit on each other.
  ///
  /// If the partner is another tree, its points may move at the same time, by up to their own
  /// distances. Only the second form writes these.
  ///
  /// If the partner is a mesh, no segment touches the mesh, or is inside a solid, afterwards that
  /// does not now. The mesh stays where it is, so a distance is the whole gap, and at most all that
  /// is left of the skin. Segments that the mesh does not meet do not count. If `skips_touching` is
  /// true, segments that touch it or are inside do not count either, so that they may slide to
  /// other triangles or come out. With several partners, the least distance from all LivePairs is
  /// safe.
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

  /// Return the pairs that began and those that ceased to touch in the last update. A pair that has
  /// ended may name segments that no longer exist.
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
