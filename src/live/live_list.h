// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <fcl_fibers/tree_export.h>

#include "index/pair_query.h"
#include "live/anchors.h"
#include "live/coverage.h"
#include "live/inside.h"
#include "live/mesh_anchors.h"
#include "live/skin.h"
#include "parallel/executor.h"

namespace fcl_fibers::live {

/// What a LiveList is of: the pairs within one set of segments, or those of two, or those of
/// segments and the triangles of a mesh.
class Pairing {
 public:
  /// @param i  0 or, if there are two sides of segments, 1
  virtual const SegmentsNow& side(int i) const = 0;
  virtual int sideCount() const = 0;
  /// Of the mesh, in the frame of the segments; null if there is none.
  virtual const TrianglesNow* triangles() const { return nullptr; }

  /// The margin within which segments touch, and all lengths below, are in the frame of the first
  /// side.
  virtual double margin() const = 0;

  /// Finds every pair that is at most `beyond` further apart than the margin allows. Behind these
  /// comes each segment wholly inside a solid, with -1.
  /// @param seen  is shown the pairs of segments whose volumes overlap, and keeps all
  virtual tree::Visit search(double beyond, const index::PairFilter& seen,
                             index::PairSink& sink) = 0;

  /// Moves the pairs that touch to the front in their order, and returns their number. It is called
  /// on several threads.
  virtual std::size_t keepTouching(tree::Pair* pairs, std::size_t count) const = 0;

  /// Writes lower bounds of how far apart pairs are, beyond the margin. Only safe distances need
  /// them. It is called on several threads.
  virtual void findGaps(const tree::Pair* /*pairs*/, std::size_t count, double* gaps) const {
    std::fill_n(gaps, count, 0.0);
  }

  /// Moves the pairs that count at all to the front in their order, each as search() would find it,
  /// and returns their number. It is called on several threads.
  virtual std::size_t sift(tree::Pair* pairs, std::size_t count) const = 0;

  /// The name now of a segment of the last update. If it is gone, a negative name of its own.
  virtual tree::SegmentId nameNow(tree::SegmentId last) const { return last; }

  /// The usual distance of the axes of two segments that touch, as a unit for lengths; not 0.
  virtual double usualReach() const = 0;

  virtual parallel::Executor* executor() const = 0;

  /// @name A solid
  /// What is asked only if the triangles are those of a solid, on several threads.
  ///@{
  virtual bool isSolid() const { return false; }
  /// Whether a segment may meet the solid, or another mesh.
  virtual bool mayMeet(tree::SegmentId /*segment*/) const { return true; }
  /// Whether a segment that touches no triangle is inside.
  virtual bool isInside(tree::SegmentId /*segment*/) const { return false; }
  virtual index::TriangleId nearest(tree::SegmentId /*segment*/) const { return -1; }
  ///@}

 protected:
  ~Pairing() = default;
};

/// The pairs that touch now, as a search would find them, without a search. It lists pairs within a
/// skin beyond what touches, and tests these alone. As long as no pair that is not listed can have
/// come near enough, which the displacements of nodes tell, the list is complete. Pairs of which
/// they do not tell it are tested one by one, until it costs less to list all anew; see
/// docs/numerics.md for the proof.
///
/// After an update() has thrown, what touches is as it was before, and the next one lists anew.
class FCL_FIBERS_TREE_EXPORT LiveList {
 public:
  /// A listed pair.
  struct Entry {
    tree::Pair pair;
    std::int32_t slot;  ///< negative unless it touches
  };

  /// What was done so far.
  struct Counts {
    std::int64_t updates = 0;
    std::int64_t listings = 0;         ///< of all pairs
    std::int64_t uncovered_pairs = 0;  ///< tested though the search had not listed them
    std::int64_t tested_pairs = 0;
    std::int64_t touching_pairs = 0;  ///< of the tested ones
    std::int64_t longest_life = 0;    ///< updates that a listing of all pairs has served
  };

  /// @param skin  in the world's unit; negative if it is chosen
  explicit LiveList(double skin);

  /// What the segments of the last update are to those of the next.
  enum class Last {
    kSame,         ///< the same, in the same frame and order of leaves
    kOtherLeaves,  ///< the same, in another frame or order, with other names, or tapered since or
                   ///< no more; some may be gone
    kOtherNames,   ///< others, so all pairs end
  };

  /// Brings the list to where the segments are now.
  /// @param scale  the length in the frame of the pairing of a unit of the world
  void update(Pairing& pairing, double scale, Last last);

  /// The pairs that touch are those whose slot is not negative,
  const parallel::UnwrittenVector<Entry>& entries() const { return entries_; }
  /// and the segments inside a solid that touch no triangle, each with its nearest. They ascend.
  const std::vector<Entry>& inside() const { return inside_; }
  std::size_t touchingCount() const { return touching_count_; }
  /// Hands on the pairs that touch, as a search would.
  tree::Visit handOn(index::PairSink& sink) const;
  /// All slots are below.
  std::int32_t slotCount() const { return slot_count_; }
  /// Bounds how far each end may move so that no pair touches then that does not touch now, in the
  /// frame of the first side; infinite for an end of no segment. A mesh does not move.
  /// @param pairing         that of the last update, since which nothing has changed
  /// @param skips_touching  whether pairs that touch do not count, or any of what touches a mesh;
  ///                        else their ends may not move
  /// @param distances       one for each side, by the ends of KeptSegments
  /// @pre isListed()
  void findSafeDistances(const Pairing& pairing, bool skips_touching,
                         std::vector<std::atomic<double>>* distances) const;
  bool isListed() const { return state_ == State::kListed; }

  /// What began and what ended to touch in the last update.
  ///@{
  const std::vector<Entry>& begun() const { return begun_; }
  const std::vector<Entry>& ended() const { return ended_; }
  ///@}

  /// In the world's unit; 0 if each update searches.
  double skin() const { return used_skin_; }
  const Counts& counts() const { return counts_; }
  std::size_t memoryUsage() const;

 private:
  using Entries = parallel::UnwrittenVector<Entry>;

  Sides sidesOf(const Pairing& pairing) const;
  static SegmentsNow sampleOf(const SegmentsNow& side, tree::SegmentIds& order);
  void measure(const Pairing& pairing, bool samples);
  std::optional<tree::Pair> unlisted(const Pairing& pairing, Leaf k, Leaf l) const;
  bool complete(const Pairing& pairing, bool told_distances);
  std::vector<tree::Pair> withoutListed(const Pairing& pairing,
                                        std::vector<tree::Pair> pairs) const;
  void list(Pairing& pairing, double skin, Last last, Entries& listed, std::vector<Entry>& gone);
  void anchor(const Pairing& pairing, bool samples);
  SegmentFlags freeOfMesh(const Pairing& pairing, bool skips_touching) const;
  static std::vector<std::size_t> allNew(const Entries& entries);
  std::vector<std::size_t> test(const Pairing& pairing, const Entries& entries);
  std::vector<Entry> findInside(const Pairing& pairing, const Entries& entries,
                                const std::vector<std::size_t>& changed) const;
  void take(Entries& entries, const std::vector<std::size_t>& changed, std::vector<Entry>& inside,
            std::vector<Entry>& gone, bool may_go_on);

  /// What the anchors serve for.
  enum class State {
    kNone,
    kAnchored,  ///< to measure how fast a sample of the segments moves
    kListed,    ///< to tell how long the list is complete
  };

  double fixed_;
  Skin skin_;
  double used_skin_ = 0;  ///< in the world's unit
  Counts counts_;
  Entries entries_;
  std::vector<Entry> inside_;
  std::vector<Entry> begun_, ended_;
  std::vector<std::int32_t> free_;  ///< slots below slot_count_ that no pair has or has just had
  std::int32_t slot_count_ = 0;
  std::size_t touching_count_ = 0;

  State state_ = State::kNone;
  double listed_ = 0;   ///< how much further apart than the margin what is listed is, in the frame
  double covered_ = 0;  ///< how much nearer what is not listed may come; less because of rounding
  std::int64_t age_ = 0;  ///< updates since all segments were anchored
  Anchors anchors_[2];
  MeshAnchors mesh_;
  Inside sides_;
  mutable std::atomic<bool> told_distances_{false};  ///< since the last update
};

}  // namespace fcl_fibers::live
