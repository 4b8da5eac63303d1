// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/live_pairs.h>

#include "arrays/array_fibers.h"
#include "support/random.h"

namespace fcl_fibers::test {

/// The environment variable FCL_FIBERS_LIVE_SCENES asks for more random scenes than usual.
inline std::uint64_t sceneCount(std::uint64_t usual) {
  const char* const text = std::getenv("FCL_FIBERS_LIVE_SCENES");
  return text != nullptr ? std::strtoull(text, nullptr, 10) : usual;
}

/// Fibers whose points a test moves.
template <typename S>
class MovingFibers {
 public:
  std::vector<Eigen::Vector3d> points;
  std::vector<std::size_t> begin = {0};
  std::vector<double> radii;
  typename FiberArrays<S>::Radii radii_are = FiberArrays<S>::Radii::kOne;
  std::vector<std::int32_t> groups;
  std::vector<std::uint8_t> closed;

  void addPoint(const Eigen::Vector3d& p) { points.push_back(p); }
  void endFiber() { begin.push_back(points.size()); }
  std::size_t fiberCount() const { return begin.size() - 1; }

  /// @pre both have as many points
  void swapFibers(std::size_t f, std::size_t g) {
    std::swap_ranges(points.begin() + static_cast<std::ptrdiff_t>(begin[f]),
                     points.begin() + static_cast<std::ptrdiff_t>(begin[f + 1]),
                     points.begin() + static_cast<std::ptrdiff_t>(begin[g]));
  }

  /// The arrays live until the next call.
  FiberArrays<S> view() {
    numbers_.clear();
    for (const Eigen::Vector3d& p : points) {
      for (int k = 0; k < 3; ++k) numbers_.push_back(static_cast<S>(p[k]));
    }
    given_radii_.assign(radii.begin(), radii.end());
    FiberArrays<S> fibers{numbers_.data(), points.size(),       begin.data(),
                          fiberCount(),    given_radii_.data(), radii_are};
    if (!groups.empty()) fibers.groups = groups.data();
    if (!closed.empty()) fibers.closed = closed.data();
    return fibers;
  }

 private:
  std::vector<S> numbers_, given_radii_;
};

inline PairList sorted(const std::vector<SegmentPair>& pairs) {
  PairList list;
  for (const SegmentPair& pair : pairs) list.emplace_back(pair.a, pair.b);
  std::sort(list.begin(), list.end());
  return list;
}

/// Follows live pairs and checks what each update tells of them.
template <class Partner>
class LiveWatch {
 public:
  using Pair = std::pair<std::int32_t, std::int32_t>;
  using Slots = std::map<Pair, std::int32_t>;

  /// @param expected  finds the pairs without a list
  template <class Live>
  void check(const Live& live, const FiberTree& tree) {
    std::vector<SegmentPair> found;
    tree.find(Pairs{}, found);
    checkPairs(live, sorted(found), /*all_end=*/false);
  }
  template <class Live>
  void checkAfterBuild(const Live& live, const FiberTree& tree) {
    std::vector<SegmentPair> found;
    tree.find(Pairs{}, found);
    checkPairs(live, sorted(found), /*all_end=*/true);
  }

  template <class Live>
  void checkPairs(const Live& live, const PairList& expected, bool all_end) {
    std::vector<LivePair<typename Live::Pair>> pairs;
    live.find(pairs);
    std::vector<typename Live::Pair> bare;
    live.find(bare);
    ASSERT_EQ(bare.size(), pairs.size());
    ASSERT_EQ(live.count(), pairs.size());
    std::size_t visited = 0;
    live.visit([&](const auto& pair, std::int32_t slot) {
      ASSERT_LT(visited, pairs.size());
      EXPECT_EQ(keyOf(pair), keyOf(pairs[visited].pair));
      EXPECT_EQ(keyOf(pair), keyOf(bare[visited]));
      EXPECT_EQ(slot, pairs[visited++].slot);
    });
    ASSERT_EQ(visited, pairs.size());

    Slots now;
    std::set<std::int32_t> used;
    PairList list;
    for (const auto& one : pairs) {
      EXPECT_TRUE(now.emplace(keyOf(one.pair), one.slot).second) << "a pair came twice";
      EXPECT_TRUE(used.insert(one.slot).second) << "two pairs share a slot";
      EXPECT_GE(one.slot, 0);
      EXPECT_LT(one.slot, live.slotCount());
      list.push_back(keyOf(one.pair));
    }
    std::sort(list.begin(), list.end());
    ASSERT_EQ(list, expected);

    Slots begun, ended;
    for (const auto& one : live.begun()) {
      EXPECT_TRUE(begun.emplace(keyOf(one.pair), one.slot).second) << "it began twice";
    }
    for (const auto& one : live.ended()) {
      EXPECT_TRUE(ended.emplace(keyOf(one.pair), one.slot).second) << "it ended twice";
    }
    for (const auto& [pair, slot] : now) {
      const auto before = last_.find(pair);
      if (before == last_.end() || all_end) {
        ASSERT_EQ(begun.count(pair), 1u) << "it began in silence";
        EXPECT_EQ(begun[pair], slot);
        for (const auto& [other, its_slot] : ended) {
          EXPECT_NE(its_slot, slot) << "the slot was reused before its end was told";
        }
      } else {
        EXPECT_EQ(before->second, slot) << "the slot has changed";
        EXPECT_EQ(begun.count(pair), 0u);
      }
    }
    for (const auto& [pair, slot] : last_) {
      if (now.count(pair) != 0 && !all_end) continue;
      ASSERT_EQ(ended.count(pair), 1u) << "it ended in silence";
      EXPECT_EQ(ended[pair], slot);
    }
    if (!all_end) {
      EXPECT_EQ(now.size(), last_.size() + begun.size() - ended.size());
    }
    most_ = std::max(most_, now.size() + ended.size());
    EXPECT_LE(static_cast<std::size_t>(live.slotCount()), most_);
    last_ = std::move(now);
  }

 private:
  static Pair keyOf(const SegmentPair& pair) { return {pair.a, pair.b}; }
  static Pair keyOf(const TrianglePair& pair) { return {pair.segment, pair.triangle}; }

  Slots last_;
  std::size_t most_ = 0;
};

/// Random fibers, options and calls. After each step the pairs of trees that live are compared with
/// those of trees that have just been built.
template <typename S>
class LiveCalls {
 public:
  explicit LiveCalls(Random& random) {
    for (MovingFibers<S>* fibers : {&first_, &second_}) makeFibers(random, *fibers);
    options_.threads = random.below(4) == 0 ? 3 : 1;
    options_.margin = random.below(3) == 0 ? radius_ * random.between(0, 2) : 0;
    options_.ignored_neighbors = static_cast<int>(random.below(4));
    if (random.below(8) == 0) options_.ignored_arc_length = radius_ * 20;
    if (random.below(8) == 0) options_.topology = Topology::kSuperThread;
    for (auto* tree : {&tree_, &other_, &plain_}) *tree = std::make_unique<FiberTree>(options_);
    tree_->build(first_.view());
    plain_->build(first_.view());
    other_->build(second_.view());
    const double skins[] = {-1, 0, 0.2, 1, 5, 40};
    own_.emplace(*tree_, LivePairsOptions{skins[random.below(6)] * radius_});
    both_.emplace(*tree_, *other_, LivePairsOptions{skins[random.below(6)] * radius_});
  }

  void step(Random& random) {
    move(random, first_);
    move(random, second_);
    bool is_built = false;
    switch (random.below(12)) {
      case 0:
        is_built = true;
        tree_->build(first_.view());
        plain_->build(first_.view());
        other_->update(second_.view());
        break;
      case 1: {  // a step with motion: its end counts
        MovingFibers<S> start = first_;
        tree_->update(start.view(), first_.view());
        other_->update(second_.view());
        break;
      }
      case 2:  // twice
        tree_->update(first_.view());
        tree_->update(first_.view());
        other_->update(second_.view());
        break;
      default:
        tree_->update(first_.view());
        other_->update(second_.view());
    }
    if (random.below(4) == 0) pairsOf(*tree_);
    if (random.below(4) == 0) pairsOf(*tree_, *other_);
    if (random.below(6) != 0) {
      own_->update();
      checkOwn(is_built || own_missed_build_);
      own_missed_build_ = false;
    } else {
      own_missed_build_ = own_missed_build_ || is_built;
    }
    both_->update();
    checkBoth(is_built);
    if (random.below(4) == 0)
      own_->update(), checkOwn(own_missed_build_), own_missed_build_ = false;
  }

 private:
  void makeFibers(Random& random, MovingFibers<S>& fibers) {
    const double scale = std::pow(10.0, random.between(-3, 3));
    if (radius_ == 0) {
      radius_ = scale;
      const bool is_far = random.below(5) == 0;
      if (is_far) place_ = 1000 * scale * random.inCube(1);
    }
    const std::size_t count = 1 + random.below(random.below(4) == 0 ? 120 : 25);
    const double size = radius_ * random.between(5, 40);
    const double length = radius_ * random.between(0.1, 6);
    const double clump = random.between(0, 1);
    for (std::size_t f = 0; f < count; ++f) {
      Eigen::Vector3d p = place_ + size * random.inCube(1);
      Eigen::Vector3d along = random.inCube(length);
      for (std::size_t i = random.below(14); i > 0; --i) {
        fibers.addPoint(p);
        p += clump * along + (1 - clump) * random.inCube(length);
      }
      fibers.endFiber();
    }
    using Radii = typename FiberArrays<S>::Radii;
    fibers.radii_are =
        std::vector<Radii>{Radii::kOne, Radii::kPerFiber, Radii::kPerFirstPoint}[random.below(3)];
    const std::size_t radii = fibers.radii_are == Radii::kOne        ? 1
                              : fibers.radii_are == Radii::kPerFiber ? count
                                                                     : fibers.points.size();
    for (std::size_t i = 0; i < std::max<std::size_t>(radii, 1); ++i) {
      fibers.radii.push_back(radius_ * (random.below(6) == 0 ? 0 : random.between(0.3, 1.5)));
    }
    if (random.below(3) == 0) {
      for (std::size_t f = 0; f < count; ++f) {
        fibers.groups.push_back(static_cast<std::int32_t>(random.below(4)));
      }
    }
  }

  void move(Random& random, MovingFibers<S>& fibers) {
    const double step = radius_ * std::pow(10.0, random.between(-3, 0.5));
    const std::size_t kind = random.below(9);
    if (kind == 0) return;  // it rests
    if (kind <= 2) {        // a rigid motion
      const Eigen::Matrix3d turn =
          Eigen::AngleAxisd(random.between(-0.3, 0.3), random.inCube(1).normalized())
              .toRotationMatrix();
      const Eigen::Vector3d shift = 10 * random.inCube(radius_);
      for (auto& p : fibers.points) p = place_ + turn * (p - place_) + shift;
    }
    if (kind == 3) {  // some whip
      for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
        if (random.below(6) != 0) continue;
        const Eigen::Vector3d jump = random.inCube(30 * radius_);
        for (std::size_t i = fibers.begin[f]; i < fibers.begin[f + 1]; ++i) {
          fibers.points[i] += jump + random.inCube(step);
        }
      }
    }
    if (kind == 4) {  // radii grow or shrink
      for (double& radius : fibers.radii) radius *= random.between(0.7, 1.5);
    }
    if (kind == 5) {  // single points
      for (std::size_t i = 0; i < fibers.points.size(); i += 1 + random.below(40)) {
        fibers.points[i] += random.inCube(5 * radius_);
      }
    }
    if (kind == 6) {  // all shear
      for (auto& p : fibers.points) p.x() += 0.05 * (p - place_).y();
    }
    if (kind == 7 && fibers.fiberCount() > 3 && random.below(3) == 0) {  // all fly
      for (auto& p : fibers.points) p += random.inCube(20 * radius_);
    }
    for (auto& p : fibers.points) p += random.inCube(step);
  }

  void checkOwn(bool all_end) {
    FiberTree fresh(options_);
    fresh.build(first_.view());
    plain_->update(first_.view());
    // Lengths along a fiber are those of the last build.
    const FiberTree& tree = options_.ignored_arc_length > 0 ? *plain_ : fresh;
    std::vector<SegmentPair> pairs;
    tree.find(Pairs{}, pairs);
    own_watch_.checkPairs(*own_, sorted(pairs), all_end);
  }
  void checkBoth(bool all_end) {
    FiberTree fresh(options_), other(options_);
    fresh.build(first_.view());
    other.build(second_.view());
    std::vector<SegmentPair> pairs;
    fresh.find(Pairs{}, other, pairs);
    both_watch_.checkPairs(*both_, sorted(pairs), all_end);
  }

  double radius_ = 0;
  Eigen::Vector3d place_ = Eigen::Vector3d::Zero();
  MovingFibers<S> first_, second_;
  FiberTreeOptions options_;
  std::unique_ptr<FiberTree> tree_, other_;
  std::unique_ptr<FiberTree> plain_;  ///< as tree_, without live pairs
  std::optional<LivePairs<FiberTree>> own_, both_;
  LiveWatch<FiberTree> own_watch_, both_watch_;
  bool own_missed_build_ = false;
};

}  // namespace fcl_fibers::test
