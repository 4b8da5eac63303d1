// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <utility>

#include "geometry/touch.h"
#include "index/kept_segments.h"
#include "index/pair_query.h"

namespace fcl_fibers::index {

/// Receives the pairs whose volumes may be nearer than the limit, and hands on those whose capsules
/// may be nearer, too.
template <class SecondSegment>
class NearestFilter final : public tree::NearestVisitor {
 public:
  /// @param second  second(b, error) returns the second segment of a pair in the first one's frame,
  ///                and sets a bound on the error of its end points
  NearestFilter(SegmentRange first, SecondSegment second, NearestSink& sink)
      : first_(first), second_(std::move(second)), sink_(sink) {}

  tree::Visit visit(tree::SegmentId a, tree::SegmentId b, double& limit) override {
    // The limit may be infinite in this frame, if two indexes differ much in scale. Then the
    // distance may be NaN.
    if (limit < std::numeric_limits<double>::infinity()) {
      double error;
      const geometry::Segment p = first_[a];
      const geometry::Segment q = second_(b, error);
      if (!touch(p, q, limit, endPointError(p) + error)) return tree::Visit::kContinue;
    }
    return sink_.visit(a, b, limit);
  }

 private:
  const SegmentRange first_;
  const SecondSegment second_;
  NearestSink& sink_;
};

/// Returns the filter if capsules are tested, else the sink.
template <class Filter>
tree::NearestVisitor& filterOrSink(bool capsules, Filter& filter, NearestSink& sink) {
  if (capsules) return filter;
  return sink;
}

}  // namespace fcl_fibers::index
