// SPDX-License-Identifier: BSD-3-Clause
#include "fibers/joint_graph.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "fibers/fiber_table.h"
#include "support/random.h"

namespace fcl_fibers::fibers {
namespace {

using test::Random;

/// Fibers as a table has them, and the distances of all their points by Floyd's algorithm.
class Network {
 public:
  explicit Network(SegmentId ids_behind) : ids_behind_(ids_behind) {}

  void addFiber(std::vector<double> lengths, bool closed) {
    fibers_.push_back({std::move(lengths), closed, true});
  }
  void join(const FiberPoint& p, const FiberPoint& q) { joints_.emplace_back(p, q); }

  std::size_t fiberCount() const { return fibers_.size(); }
  SegmentId pointCount(std::size_t f) const {
    return static_cast<SegmentId>(fibers_[f].lengths.size()) + 1;
  }
  void leave(std::size_t f) { fibers_[f].is_there = false; }

  FiberTable table(const NeighborRule& rule) const {
    FiberTable table(rule, ids_behind_);
    for (const Fiber& fiber : fibers_) {
      table.startFiber({true, fiber.closed, kNoGroup});
      for (const double length : fiber.lengths) table.addId(length);
      for (SegmentId i = 0; i < ids_behind_; ++i) table.addId(0);
    }
    for (const auto& [p, q] : joints_) table.join(p, q);
    return table;
  }

  /// Of all pairs of segments, each fiber after the other.
  std::vector<bool> neighbors(const NeighborRule& rule) const {
    const std::vector<double> by_number = distances([](double) { return 1.0; });
    const std::vector<double> by_length = distances([](double length) { return length; });
    std::vector<std::size_t> begins;
    for (std::size_t f = 0; f < fibers_.size(); ++f) {
      for (std::size_t i = 0; i < fibers_[f].lengths.size(); ++i) begins.push_back(nodeOf(f, i));
    }
    const std::size_t count = nodeCount();
    std::vector<bool> result;
    for (const std::size_t a : begins) {
      for (const std::size_t b : begins) {
        const auto least = [&](const std::vector<double>& all) {
          return std::min({all[a * count + b], all[a * count + b + 1], all[(a + 1) * count + b],
                           all[(a + 1) * count + b + 1]});
        };
        result.push_back(a == b || (rule.reach > 0 && least(by_number) + 1 <= rule.reach) ||
                         (rule.arc_length > 0 && least(by_length) <= rule.arc_length));
      }
    }
    return result;
  }
  std::vector<bool> neighborsIn(const FiberTable& table) const {
    std::vector<SegmentId> ids;
    SegmentId next = 0;
    for (const Fiber& fiber : fibers_) {
      for (std::size_t i = 0; i < fiber.lengths.size(); ++i) ids.push_back(next++);
      next += ids_behind_;
    }
    std::vector<bool> result;
    for (const SegmentId a : ids) {
      for (const SegmentId b : ids) result.push_back(a == b || table.areNeighbors(a, b));
    }
    return result;
  }
  /// Whether an id is of a fiber that has not left.
  bool isThere(SegmentId id) const {
    SegmentId end = 0;
    for (const Fiber& fiber : fibers_) {
      end += static_cast<SegmentId>(fiber.lengths.size()) + ids_behind_;
      if (id < end) return fiber.is_there;
    }
    return false;
  }
  /// Without the fibers that have left.
  Network rest() const {
    Network rest(ids_behind_);
    std::vector<std::uint32_t> place(fibers_.size());
    for (std::size_t f = 0; f < fibers_.size(); ++f) {
      place[f] = static_cast<std::uint32_t>(rest.fibers_.size());
      if (fibers_[f].is_there) rest.fibers_.push_back(fibers_[f]);
    }
    for (auto [p, q] : joints_) {
      if (!fibers_[p.fiber].is_there || !fibers_[q.fiber].is_there) continue;
      rest.join({place[p.fiber], p.number}, {place[q.fiber], q.number});
    }
    return rest;
  }

 private:
  struct Fiber {
    std::vector<double> lengths;
    bool closed, is_there;
  };

  std::size_t nodeOf(std::size_t f, std::size_t i) const {
    for (std::size_t g = 0; g < f; ++g) i += fibers_[g].lengths.size() + 1;
    return i;
  }
  std::size_t nodeCount() const { return nodeOf(fibers_.size(), 0); }

  template <class DistanceOf>
  std::vector<double> distances(DistanceOf&& distanceOf) const {
    const std::size_t count = nodeCount();
    std::vector<double> all(count * count, std::numeric_limits<double>::infinity());
    const auto lead = [&](std::size_t p, std::size_t q, double distance) {
      for (const std::size_t at : {p * count + q, q * count + p}) {
        all[at] = std::min(all[at], distance);
      }
    };
    for (std::size_t p = 0; p < count; ++p) lead(p, p, 0);
    for (std::size_t f = 0; f < fibers_.size(); ++f) {
      const std::vector<double>& lengths = fibers_[f].lengths;
      for (std::size_t i = 0; i < lengths.size(); ++i) {
        lead(nodeOf(f, i), nodeOf(f, i + 1), distanceOf(lengths[i]));
      }
      if (fibers_[f].closed) lead(nodeOf(f, 0), nodeOf(f, lengths.size()), 0);
    }
    for (const auto& [p, q] : joints_) {
      if (!fibers_[p.fiber].is_there || !fibers_[q.fiber].is_there) continue;
      lead(nodeOf(p.fiber, static_cast<std::size_t>(p.number)),
           nodeOf(q.fiber, static_cast<std::size_t>(q.number)), 0);
    }
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t p = 0; p < count; ++p) {
        for (std::size_t q = 0; q < count; ++q) {
          lead(p, q, all[p * count + k] + all[k * count + q]);
        }
      }
    }
    return all;
  }

  SegmentId ids_behind_;
  std::vector<Fiber> fibers_;
  std::vector<Joint> joints_;
};

/// Multiples of 1/4, whose sums are exact; some are 0.
std::vector<double> lengthsOf(Random& random, std::size_t count) {
  std::vector<double> lengths(count);
  for (double& length : lengths) length = static_cast<double>(random.below(5)) / 4;
  return lengths;
}

FiberPoint pointIn(Random& random, const Network& network, std::size_t f) {
  const auto points = static_cast<std::size_t>(network.pointCount(f));
  // Ends are what most fibers are joined by.
  const std::size_t place = random.below(4);
  return {static_cast<std::uint32_t>(f), place == 0 ? 0
                                         : place == 1
                                             ? static_cast<SegmentId>(points - 1)
                                             : static_cast<SegmentId>(random.below(points))};
}

/// A forest, in which some also end at others, so that there are loops.
Network networkOf(Random& random, SegmentId ids_behind, std::size_t most_segments,
                  bool has_closed) {
  Network network(ids_behind);
  const std::size_t fibers = 1 + random.below(9), loops = random.below(4);
  for (std::size_t f = 0; f < fibers; ++f) {
    // Without an id there is no fiber.
    const std::size_t least = ids_behind > 0 ? 0 : 1;
    network.addFiber(lengthsOf(random, least + random.below(most_segments)),
                     has_closed && random.below(4) == 0);
    if (f > 0 && random.below(5) > 0) {
      network.join({static_cast<std::uint32_t>(f), 0}, pointIn(random, network, random.below(f)));
    }
  }
  for (std::size_t i = 0; i < loops && random.below(2) == 0; ++i) {
    const std::size_t f = random.below(fibers);
    network.join({static_cast<std::uint32_t>(f), network.pointCount(f) - 1},
                 pointIn(random, network, random.below(fibers)));
  }
  return network;
}

std::vector<NeighborRule> rules() {
  std::vector<NeighborRule> rules;
  for (SegmentId reach = 0; reach <= 5; ++reach) {
    for (const double arc : {0.0, 0.25, 1.0, 2.5, 100.0}) rules.emplace_back(reach, arc);
  }
  return rules;
}

// Segments at a branching point would be reported, or ones left out that are far away in the tree.
TEST(JointGraph, NeighborsAreThoseOfTheShortestPath) {
  Random random(88);
  std::size_t joined = 0;
  for (int trial = 0; trial < 120; ++trial) {
    SCOPED_TRACE(trial);
    const Network network = networkOf(random, static_cast<SegmentId>(trial % 2),
                                      trial % 3 == 0 ? 2 : 7, trial % 5 == 0);
    for (const NeighborRule& rule : rules()) {
      FiberTable table = network.table(rule);
      table.settleJoints([](SegmentId, SegmentId) { return true; });
      const std::vector<bool> expected = network.neighbors(rule);
      ASSERT_EQ(network.neighborsIn(table), expected) << rule.reach << ' ' << rule.arc_length;
      // A table whose joints are not settled has none.
      joined += network.neighborsIn(network.table(rule)) != expected ? 1 : 0;
    }
  }
  EXPECT_GT(joined, 1000u) << "of 3600 rules and networks";
}

// Children would start at a fiber that has gone, or at another one that has its number now.
TEST(JointGraph, AFiberThatLeavesLeavesItsJoints) {
  Random random(89);
  for (int trial = 0; trial < 200; ++trial) {
    SCOPED_TRACE(trial);
    Network network = networkOf(random, 0, 5, trial % 2 == 0);
    const NeighborRule rule(1 + static_cast<SegmentId>(random.below(3)),
                            trial % 3 == 0 ? 1.5 : 0.0);
    FiberTable table = network.table(rule);
    const auto isThere = [&](SegmentId begin, SegmentId) { return network.isThere(begin); };
    table.settleJoints(isThere);
    ASSERT_EQ(network.neighborsIn(table), network.neighbors(rule));
    for (int i = 0; i < 2; ++i) {
      const std::size_t fiber = random.below(network.fiberCount());
      const SegmentId id = table.beginOf(fiber);
      if (network.isThere(id)) {
        table.unsettleJoints(id, isThere);
        EXPECT_FALSE(table.hasUnsettledJoints() && i == 0) << "the fiber has not left";
      }
      network.leave(fiber);
      table.unsettleJoints(id, isThere);
    }
    table.settleJoints(isThere);
    ASSERT_EQ(network.neighborsIn(table), network.neighbors(rule));

    table.drop(isThere, [](SegmentId, SegmentId) {});
    const Network rest = network.rest();
    table.settleJoints([](SegmentId, SegmentId) { return true; });
    ASSERT_EQ(rest.neighborsIn(table), rest.neighbors(rule));
  }
}

// A thousand fibers at one point, or all of a long chain within reach, would fill the memory.
TEST(JointGraph, TakesMemoryByFibersAndNotByPairs) {
  constexpr std::uint32_t kFibers = 4000;
  for (const bool is_star : {true, false}) {
    for (const NeighborRule& rule : {NeighborRule(5), NeighborRule(1, 1e6)}) {
      FiberTable table(rule, 1);
      for (std::uint32_t f = 0; f < kFibers; ++f) {
        table.startFiber({});
        for (int i = 0; i < 3; ++i) table.addId(i < 2 ? 1 : 0);
        // In the star each has a joint at its own tip as well.
        if (f > 0 && is_star) table.join({f, 0}, {f % 2 == 0 ? 0 : f - 1, f % 2 == 0 ? 0 : 2});
        if (f > 0 && !is_star) table.join({f, 0}, {f - 1, 2});
      }
      table.settleJoints([](SegmentId, SegmentId) { return true; });
      EXPECT_LT(table.memoryUsage(), kFibers * 1000) << is_star << ' ' << rule.reach;
      EXPECT_TRUE(table.areNeighbors(1, 3)) << "the end of fiber 0, and the start of fiber 1";
    }
  }
}

// A table without joints would be larger, or slower.
TEST(JointGraph, NothingIsKeptWithoutJoints) {
  FiberTable without(NeighborRule(2, 1.0), 1), with(NeighborRule(0, 0.0), 1);
  for (FiberTable* table : {&without, &with}) {
    for (int f = 0; f < 2; ++f) {
      table->startFiber({});
      for (int i = 0; i < 3; ++i) table->addId(i < 2 ? 1 : 0);
    }
  }
  const std::size_t bytes = without.memoryUsage(), bytes_of_no_rule = with.memoryUsage();
  without.settleJoints([](SegmentId, SegmentId) { return true; });
  EXPECT_EQ(without.memoryUsage(), bytes);
  with.join({1, 0}, {0, 2});
  with.settleJoints([](SegmentId, SegmentId) { return true; });
  EXPECT_EQ(with.memoryUsage(), bytes_of_no_rule) << "no segments are neighbours";
}

}  // namespace
}  // namespace fcl_fibers::fibers
