// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "geometry/impact.h"
#include "index/segment_source.h"
#include "tree/search.h"

namespace fcl_fibers::index {

/// Pairs that a search has found, in their order.
struct PairRun {
  const tree::Pair* pairs;
  const geometry::Impact* impacts;  ///< that of each pair; null if none are searched for
  std::size_t count;
  int worker = 0;  ///< the number of the thread, below Executor::threads(); 0 is the caller's
};

/// Bytes that a call may keep of what it finds, however few segments there are.
inline constexpr std::size_t kMostKept = std::size_t{1} << 30;

/// Throws std::length_error if a call has more pairs than `most`, and more than 256 for each
/// element: then about everything touches everything.
/// @param elements  segments, or triangles of the partner if they are more
/// @param remedy    what else a caller may do, with a comma or semicolon before it
void requireFew(const char* call, std::size_t pairs, std::size_t most, std::size_t elements,
                const char* remedy = "");

/// Receives the pairs of a search.
class PairSink {
 public:
  enum class Delivery {
    kInOrder,  ///< take() is called on the calling thread, in the order of the search
    kPlaced,   ///< the same, or place() is called on all threads
    kAtOnce,   ///< take() is called on all threads, in any order
  };
  virtual Delivery delivery() const { return Delivery::kInOrder; }

  /// Moves the pairs that count to the front in their order, with their impacts, and returns their
  /// number. It is called on the thread that has found them, several at the same time.
  virtual std::size_t sift(tree::Pair* /*pairs*/, geometry::Impact* /*impacts*/,
                           std::size_t count) const {
    return count;
  }

  virtual tree::Visit take(const PairRun& run) = 0;

  /// If the delivery is kPlaced: throws if the sink does not keep so many pairs of one search. It
  /// is asked on the threads that find them, so that the search ends early.
  virtual void requireRoom(std::size_t /*count*/) const {}
  /// Makes room for so many more pairs. Then each has its place, from 0 on, behind those that came
  /// before.
  virtual void makeRoom(std::size_t /*count*/) {}
  virtual void place(std::size_t /*begin*/, const PairRun& /*run*/) const {}

 protected:
  ~PairSink() = default;
};

/// Decides which of the pairs whose volumes overlap are handed on. Several threads may ask it at
/// the same time.
class PairFilter {
 public:
  /// Moves the pairs that are handed on to the front in their order, and returns their number.
  /// @param impacts  empty; a filter that finds impacts adds that of each pair it keeps
  virtual std::size_t keep(tree::Pair* pairs, std::size_t count,
                           std::vector<geometry::Impact>& impacts) const = 0;

 protected:
  ~PairFilter() = default;
};

class FirstTime;

/// What a search for pairs asks about, beside the partners. By default it asks about the end of the
/// step, and IndexOptions::capsules tells whether capsules or volumes count.
struct Question {
  /// Whether pairs count that touch at any time of the step, each with its impact. Two volumes
  /// touch if they overlap at one common time, while each side moves linearly. What has no step
  /// rests.
  bool of_step = false;
  bool of_volumes = false;             ///< whether volumes count in any case
  bool once = false;                   ///< whether one pair with a mesh is enough for each segment
  const PairFilter* wanted = nullptr;  ///< keeps the pairs that count at all; null for all
  /// How much further apart than the margin what counts may be, in the world's unit. Of the pairs
  /// within one index only those are found for which SegmentIndex::fitBeyond() has been called.
  double beyond = 0;
  /// If it is not null, the search hands on no pair. This gets the first time of the step at which
  /// two segments touch that did not at the start, or come nearer than they were there.
  /// @pre no segment is a box
  FirstTime* first = nullptr;
  /// Whether a segment inside a solid mesh comes with its nearest triangle; otherwise with -1.
  bool names_nearest = true;

  static Question ofStep(const PairFilter* wanted = nullptr, FirstTime* first = nullptr) {
    return {/*of_step=*/true, false, false, wanted, 0, first};
  }
};

/// For a search that hands on no pair.
struct NoSink final : PairSink {
  tree::Visit take(const PairRun& /*run*/) override { return tree::Visit::kContinue; }
};

/// Receives the pairs that may be nearer than a limit. Each visit may lower the limit.
class NearestSink : public tree::NearestVisitor {
 public:
  /// The initial limit, in the frame of the index whose search() is called.
  virtual double limit() const = 0;

  /// The source of that index. Segments that the index does not keep are read as they are now.
  /// Null if it keeps them.
  virtual const SegmentSource* source() const { return nullptr; }

 protected:
  ~NearestSink() = default;
};

}  // namespace fcl_fibers::index
