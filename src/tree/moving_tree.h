// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "geometry/moving_box.h"
#include "tree/bvh.h"

namespace fcl_fibers::tree {

inline constexpr std::atomic<float> kWholeStep{1};

/// A view of two trees of one topology, fitted to the start of a step and to its end.
template <int Arity>
class MovingTree {
 public:
  static constexpr int kArity = Arity;
  using Boxes = LayeredBoxTree<Arity>;
  using Node = typename Boxes::Node;
  using Volume = geometry::MovingBox;
  using Pack = Volume::Pack<Arity>;

  /// @param until  borrowed: the last time that counts; it may become less during a search
  MovingTree(const Boxes& start, const Boxes& end, const std::atomic<float>& until = kWholeStep)
      : start_(start), end_(end), until_(until) {}

  bool empty() const { return end_.empty(); }
  const Node& node(std::int32_t i) const { return end_.node(i); }
  FCL_FIBERS_ALWAYS_INLINE Pack pack(std::int32_t i) const {
    return {start_.pack(i), end_.pack(i), until_.load(std::memory_order_relaxed)};
  }
  const parallel::UnwrittenVector<Group>& groups() const { return end_.groups(); }
  const parallel::UnwrittenVector<Categories>& meets() const { return end_.meets(); }
  FCL_FIBERS_ALWAYS_INLINE void prefetch(std::int32_t i) const {
    start_.prefetch(i);
    end_.prefetch(i);
  }

 private:
  const Boxes& start_;
  const Boxes& end_;
  const std::atomic<float>& until_;
};

}  // namespace fcl_fibers::tree
