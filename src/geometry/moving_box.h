// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/box.h"

namespace fcl_fibers::geometry {

/// A box during a step. Each side moves linearly from the start to the end, so it stays around
/// whatever moves linearly and is in the box at both times. Ray tracers call this linear bounds.
struct MovingBox {
  Box start, end;

  template <int N>
  class Pack;

  FCL_FIBERS_ALWAYS_INLINE float size() const { return start.size() + end.size(); }
};

/// N boxes at both times, which are borrowed.
template <int N>
class MovingBox::Pack {
 public:
  /// @param until  the last time that counts
  Pack(const Box::Pack<N>& start, const Box::Pack<N>& end, float until)
      : start_(&start), end_(&end), until_(until) {}

  FCL_FIBERS_ALWAYS_INLINE MovingBox get(int lane) const {
    return {start_->get(lane), end_->get(lane)};
  }
  const Box::Pack<N>& start() const { return *start_; }
  const Box::Pack<N>& end() const { return *end_; }
  float until() const { return until_; }

 private:
  const Box::Pack<N>* start_;
  const Box::Pack<N>* end_;
  float until_;
};

}  // namespace fcl_fibers::geometry
