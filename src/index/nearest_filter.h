// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "geometry/touch.h"
#include "geometry/triangle_distance.h"
#include "index/pair_query.h"

namespace fcl_fibers::index {

/// A segment or triangle of a pair in the frame of the first one, if it can be read now, and a
/// bound on the error of its points.
template <class Hull>
struct Found {
  Hull hull;
  double error;
  bool is_found;
};
using FoundSegment = Found<geometry::Segment>;

/// Remembers what find(id) has found, because pairs that follow soon after each other share
/// segments. To read an object again takes longer than to test a pair.
template <class Find>
class RememberingFind {
 public:
  /// @param count  of the segments that there are
  RememberingFind(std::size_t count, Find find) : find_(std::move(find)) {
    std::size_t size = 1;
    while (size < count && size < kMost) size *= 2;
    entries_.resize(size);
  }

  const FoundSegment& operator()(tree::SegmentId id) {
    Entry& entry = entries_[static_cast<std::size_t>(id) & (entries_.size() - 1)];
    if (entry.id != id) {
      entry.found = find_(id);
      entry.id = id;
    }
    return entry.found;
  }

 private:
  struct Entry {
    tree::SegmentId id = -1;
    FoundSegment found = {};
  };
  static constexpr std::size_t kMost = 4096;
  Find find_;
  std::vector<Entry> entries_;  ///< a power of two of them, by the last bits of the id
};

/// Receives the pairs whose volumes may be nearer than the limit, and hands on those whose capsules
/// may be nearer, too. first(a) and second(b) return a Found or a reference to one. If one of a
/// pair is not found, the pair is handed on.
template <class First, class Second>
class NearestFilter final : public tree::NearestVisitor {
 public:
  /// @param tests_all  whether every pair is tested. If not, most pairs are handed on untested
  ///                   while nearly all pass, as pairs of adjacent segments do.
  /// @param margin     how much nearer than its second one a pair is
  NearestFilter(First& first, Second& second, bool tests_all, NearestSink& sink, double margin = 0)
      : first_(first),
        second_(second),
        tests_all_(tests_all),
        sink_(sink),
        margin_(margin),
        first_limit_(sink.limit()) {}

  tree::Visit visit(tree::SegmentId a, tree::SegmentId b, double& limit) override {
    return isWorthTesting(limit) && !passes(a, b, limit) ? tree::Visit::kContinue
                                                         : sink_.visit(a, b, limit);
  }

 private:
  /// A test costs about as much as a callback that measures the distance of two capsules, and more
  /// than a callback that does little. So it pays if a third of the pairs fail.
  static constexpr int kFirst = 4, kGain = 2, kMost = 16, kSeldom = 16;

  bool isWorthTesting(double limit) {
    // The limit may be infinite in this frame, if two indexes differ much in scale. Then the
    // distance may be NaN.
    if (!(limit < std::numeric_limits<double>::infinity())) return false;
    if (tests_all_) return true;
    // Nothing is farther than the limit that a query starts with.
    return limit < first_limit_ && (credit_ > 0 || ++untested_ % kSeldom == 0);
  }

  bool passes(tree::SegmentId a, tree::SegmentId b, double limit) {
    const auto& p = first_(a);
    const auto& q = second_(b);
    const bool may_be_nearer =
        !p.is_found || !q.is_found || touch(p.hull, q.hull, limit + margin_, p.error + q.error);
    credit_ = may_be_nearer ? std::max(credit_ - 1, 0) : std::min(credit_ + kGain, kMost);
    return may_be_nearer;
  }

  First& first_;
  Second& second_;
  const bool tests_all_;
  NearestSink& sink_;
  const double margin_, first_limit_;
  int credit_ = kFirst;
  unsigned untested_ = 0;
};

}  // namespace fcl_fibers::index
