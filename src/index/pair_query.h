// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "geometry/impact.h"
#include "index/segment_source.h"
#include "tree/search.h"

namespace fcl_fibers::index {

/// Receives the pairs of a search in runs.
class PairSink {
 public:
  virtual tree::Visit take(const tree::Pair* pairs, std::size_t count) = 0;
  /// Receives the pairs of a search for impacts.
  /// @param impacts  that of each pair
  virtual tree::Visit takeImpacts(const tree::Pair* pairs, const geometry::Impact* /*impacts*/,
                                  std::size_t count) {
    return take(pairs, count);
  }

 protected:
  ~PairSink() = default;
};

/// For a search whose filter keeps no pair.
struct NoSink final : PairSink {
  tree::Visit take(const tree::Pair* /*pairs*/, std::size_t /*count*/) override {
    return tree::Visit::kContinue;
  }
};

/// Receives the pairs that may be nearer than a limit. Each visit may lower the limit.
class NearestSink : public tree::NearestVisitor {
 public:
  /// The initial limit, in the frame of the index whose search() is called.
  virtual double limit() const = 0;

  /// The source of that index. Segments that the index does not keep are read as they are now.
  virtual const SegmentSource& source() const = 0;

 protected:
  ~NearestSink() = default;
};

}  // namespace fcl_fibers::index
