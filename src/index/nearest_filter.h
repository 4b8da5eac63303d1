// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include "geometry/touch.h"
#include "geometry/triangle_distance.h"
#include "index/pair_query.h"
#include "parallel/unwritten.h"

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
  /// @param count  of the segments that there are; 0 to remember only the last one, if find() is
  ///               fast
  RememberingFind(std::size_t count, Find find) : find_(std::move(find)) {
    while (size_ < count && size_ < kMost) size_ *= 2;
  }

  const FoundSegment& operator()(tree::SegmentId id) {
    // Many queries ask for nothing.
    if (ids_.empty()) {
      ids_.resize(size_, -1);
      found_.resize(size_);
    }
    const std::size_t entry = static_cast<std::size_t>(id) & (size_ - 1);
    if (ids_[entry] != id) {
      found_[entry] = find_(id);
      ids_[entry] = id;
    }
    return found_[entry];
  }

 private:
  static constexpr std::size_t kMost = 4096;
  Find find_;
  std::size_t size_ = 1;  ///< a power of two
  // An entry for each id with the same last bits.
  std::vector<tree::SegmentId> ids_;
  parallel::UnwrittenVector<FoundSegment> found_;
};

/// Receives the pairs whose volumes may be nearer than the limit, and hands on those whose capsules
/// may be nearer, too. first(a) and second(b) return a Found or a reference to one; they may be one
/// RememberingFind. If one of a pair is not found, the pair is handed on.
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
  static constexpr int kFirst = 2, kGain = 2, kMost = 16, kSeldom = 16;

  bool isWorthTesting(double limit) {
    // The limit may be infinite in this frame, if two indexes differ much in scale. Then the
    // distance may be NaN.
    if (!(limit < std::numeric_limits<double>::infinity())) return false;
    if (tests_all_) return true;
    // Nothing is farther than the limit that a query starts with.
    return limit < first_limit_ && (credit_ > 0 || ++untested_ % kSeldom == 0);
  }

  bool passes(tree::SegmentId a, tree::SegmentId b, double limit) {
    const bool may_be_nearer = mayBeNearer(a, b, limit + margin_);
    credit_ = may_be_nearer ? std::max(credit_ - 1, 0) : std::min(credit_ + kGain, kMost);
    return may_be_nearer;
  }

  bool mayBeNearer(tree::SegmentId a, tree::SegmentId b, double limit) {
    const auto& p = first_(a);
    const auto& q = second_(b);
    if constexpr (std::is_same_v<First, Second>) {
      // One that remembers both may have an entry for only one of them.
      if (&p == &q) {
        const FoundSegment second = q;
        return mayTouch(first_(a), second, limit);
      }
    }
    return mayTouch(p, q, limit);
  }
  template <class P, class Q>
  static bool mayTouch(const P& p, const Q& q, double limit) {
    return !p.is_found || !q.is_found || touch(p.hull, q.hull, limit, p.error + q.error);
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
