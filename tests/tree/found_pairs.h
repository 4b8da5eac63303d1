// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include <gtest/gtest.h>

#include "tree/search.h"
#include "tree/search_scenes.h"

// What searches find, in the order in which they find it.
namespace fcl_fibers::tree {

/// Takes everything, or as many as wanted, eight pairs at a time.
class SmallBuffer final : public PairBuffer {
 public:
  explicit SmallBuffer(std::size_t wanted = SIZE_MAX) : wanted_(wanted) { restart(); }
  Visit full() override {
    for (const Pair* pair = pairs_; pair != next_ && found.size() < wanted_; ++pair) {
      found.emplace_back(pair->a, pair->b);
    }
    restart();
    return found.size() < wanted_ ? Visit::kContinue : Visit::kStop;
  }
  PairList found;

 private:
  void restart() {
    next_ = pairs_;
    end_ = pairs_ + 1;
  }
  std::size_t wanted_;
  Pair pairs_[1 + kRoom];
};

/// Does the work piece by piece.
template <class Tree, class Trees>
PairList pairsFound(const Trees& trees) {
  class Serial final : public TaskSink {
   public:
    explicit Serial(const Trees& trees) : trees_(trees) {}
    Visit take(const TraversalTask& work) override { return visitOverlaps(trees_, work, out); }
    SmallBuffer out;

   private:
    const Trees& trees_;
  } serial(trees);
  EXPECT_EQ(splitIntoTasks(trees, kAllPairs, kLeastGrain, serial), Visit::kContinue);
  serial.out.full();
  return serial.out.found;
}

template <class Tree>
PairList pairsWith(const Tree& tree, const typename Tree::Volume& volume, SegmentId second,
                   Group group) {
  SmallBuffer out;
  EXPECT_EQ(visitOverlaps(tree, volume, second, group, out), Visit::kContinue);
  out.full();
  return out.found;
}

}  // namespace fcl_fibers::tree
