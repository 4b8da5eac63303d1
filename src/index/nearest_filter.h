// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <utility>

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
/// segments.
template <class Find>
class RememberingFind {
 public:
  explicit RememberingFind(Find find) : find_(std::move(find)) { ids_.fill(-1); }

  const FoundSegment& operator()(tree::SegmentId id) {
    const std::size_t entry = static_cast<std::size_t>(id) % kEntries;
    if (ids_[entry] != id) {
      ids_[entry] = id;
      found_[entry] = find_(id);
    }
    return found_[entry];
  }

 private:
  static constexpr std::size_t kEntries = 256;
  Find find_;
  std::array<tree::SegmentId, kEntries> ids_;
  std::array<FoundSegment, kEntries> found_;  ///< set where an id is
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
