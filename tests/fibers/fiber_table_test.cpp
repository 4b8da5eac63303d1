// SPDX-License-Identifier: BSD-3-Clause
#include "fibers/fiber_table.h"

#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "parallel/executor.h"
#include "support/allocation_faults.h"
#include "support/random.h"

namespace fcl_fibers::fibers {
namespace {

using test::AllocationFault;
using test::Random;

/// What a table has to know, fiber by fiber.
class Model {
 public:
  Model(const NeighborRule& rule, SegmentId ids_behind)
      : rule_(rule), ids_behind_(ids_behind), table_(rule, ids_behind) {}

  FiberTable& table() { return table_; }
  std::size_t fiberCount() const { return fibers_.size(); }

  /// @param lengths  of the segments; the ids behind them have none
  void add(std::vector<double> lengths, bool has_neighbors, bool closed, Group group) {
    table_.startFiber({has_neighbors, closed, group});
    lengths.resize(lengths.size() + static_cast<std::size_t>(ids_behind_));
    add_at_once_ = !add_at_once_;
    if (add_at_once_) {
      table_.addIds(static_cast<SegmentId>(lengths.size()));
      if (table_.hasArcLengths()) {
        table_.setLengths(table_.fiberCount() - 1, [&](std::size_t i) { return lengths[i]; });
      }
    } else {
      for (const double length : lengths) table_.addId(length);
    }
    fibers_.push_back({next_number_++, std::move(lengths), has_neighbors, closed, group});
  }
  /// Those of which the number is not in the set.
  void keepOnly(const std::set<std::size_t>& numbers) {
    std::vector<Fiber> kept;
    std::vector<std::pair<SegmentId, SegmentId>> expected, moves;
    std::vector<bool> keeps;
    SegmentId from = 0, to = 0;
    for (const Fiber& fiber : fibers_) {
      const bool keep = numbers.count(fiber.number) != 0;
      for (std::size_t i = 0; i < fiber.lengths.size(); ++i, ++from) {
        if (keep) expected.emplace_back(from, to++);
      }
      keeps.push_back(keep);
      if (keep) kept.push_back(fiber);
    }
    std::size_t asked = 0;
    table_.drop(
        [&](SegmentId begin, SegmentId end) {
          EXPECT_EQ(static_cast<std::size_t>(end - begin), fibers_[asked].lengths.size());
          return keeps[asked++];
        },
        [&](SegmentId old_id, SegmentId new_id) { moves.emplace_back(old_id, new_id); });
    EXPECT_EQ(asked, fibers_.size());
    EXPECT_EQ(moves, expected);
    fibers_ = kept;
  }
  void clear() {
    table_.clear();
    fibers_.clear();
    next_number_ = 0;
  }

  void expectEqual() const {
    ASSERT_EQ(table_.fiberCount(), fibers_.size());
    struct Id {
      std::size_t fiber;  // in fibers_
      std::size_t segment;
    };
    std::vector<Id> ids;
    std::vector<double> arc_end;
    for (std::size_t f = 0; f < fibers_.size(); ++f) {
      ASSERT_EQ(table_.beginOf(f), static_cast<SegmentId>(ids.size()));
      double arc = 0;
      for (std::size_t i = 0; i < fibers_[f].lengths.size(); ++i) {
        ids.push_back({f, i});
        arc_end.push_back(arc += fibers_[f].lengths[i]);
      }
    }
    const auto count = static_cast<SegmentId>(ids.size());
    ASSERT_EQ(table_.idCount(), count);
    for (SegmentId a = 0; a < count; ++a) {
      const Id& id = ids[static_cast<std::size_t>(a)];
      const Fiber& fiber = fibers_[id.fiber];
      ASSERT_EQ(table_.placeOf(a).fiber, fiber.number) << a;
      ASSERT_EQ(table_.placeOf(a).number, id.segment) << a;
      ASSERT_EQ(table_.groupOf(a), fiber.group) << a;
      ASSERT_EQ(table_.isBehind(a), isBehind(id.fiber, id.segment)) << a;
      if (table_.isBehind(a)) continue;
      for (SegmentId b = a; b < count; ++b) {
        const Id& other = ids[static_cast<std::size_t>(b)];
        if (isBehind(other.fiber, other.segment)) continue;
        ASSERT_EQ(table_.shareGroup(a, b),
                  fiber.group != kNoGroup && fibers_[other.fiber].group == fiber.group);
        const SegmentId begin = table_.beginOf(id.fiber);
        const FiberRange range{begin,
                               begin + static_cast<SegmentId>(fiber.lengths.size()) - ids_behind_,
                               fiber.closed};
        const bool neighbors = rule_.ignoresAny() && id.fiber == other.fiber &&
                               fiber.has_neighbors &&
                               areNeighbors(rule_, range, arc_end.data(), a, b);
        ASSERT_EQ(table_.areNeighbors(a, b), neighbors) << a << ' ' << b;
        ASSERT_EQ(table_.areNeighbors(b, a), neighbors) << b << ' ' << a;
      }
    }
    for (std::size_t from = 0; from <= fibers_.size(); ++from) expectSegmentsFrom(from);
  }

 private:
  struct Fiber {
    std::size_t number;
    std::vector<double> lengths;  // by id
    bool has_neighbors, closed;
    Group group;
  };

  bool isBehind(std::size_t fiber, std::size_t segment) const {
    return segment + static_cast<std::size_t>(ids_behind_) >= fibers_[fiber].lengths.size();
  }

  /// Of which a third is not there.
  void expectSegmentsFrom(std::size_t from) const {
    const auto isThere = [](SegmentId id) { return id % 3 != 1; };
    const SegmentId begin = from < fibers_.size() ? table_.beginOf(from) : table_.idCount();
    const tree::Fibers found = table_.segmentsFrom(begin, isThere);
    tree::Fibers expected;
    for (std::size_t f = from; f < fibers_.size(); ++f) {
      for (std::size_t i = 0; !isBehind(f, i); ++i) {
        const SegmentId id = table_.beginOf(f) + static_cast<SegmentId>(i);
        if (isThere(id)) expected.ids.push_back(id);
      }
      expected.endFiber();
    }
    ASSERT_EQ(found.ids, expected.ids);
    ASSERT_EQ(found.begin, expected.begin);
    if (!table_.hasGroups()) {
      ASSERT_TRUE(found.groups.empty());
      return;
    }
    ASSERT_EQ(found.groups.size(), fibers_.size() - from);
    for (std::size_t f = from; f < fibers_.size(); ++f) {
      ASSERT_EQ(found.groups[f - from], fibers_[f].group);
    }
  }

  NeighborRule rule_;
  SegmentId ids_behind_;
  FiberTable table_;
  std::vector<Fiber> fibers_;
  std::size_t next_number_ = 0;
  bool add_at_once_ = false;  // or one by one
};

// Threads that list the segments of a scene would leave some out or take what is none.
TEST(FiberTable, SegmentsAreThoseFromTheFirstOn) {
  Random random(72);
  for (const bool has_rules : {false, true}) {
    for (const SegmentId ids_behind : {0, 1}) {
      FiberTable table(NeighborRule(1), ids_behind);
      if (ids_behind == 1) table.addGap(5);
      for (int f = 0; f < 3000; ++f) {
        FiberTable::Kind kind;
        kind.group = static_cast<Group>(f % 4);
        if (has_rules) kind.roots = static_cast<SegmentId>(random.below(5));
        if (has_rules && f % 3 == 0) kind.categories = {2, 4};
        table.startFiber(kind);
        table.addIds(static_cast<SegmentId>(f == 1000 ? 40000 : random.below(30)));
        if (f % 10 == 0) table.addGap(static_cast<SegmentId>(random.below(3)));
      }
      const tree::Fibers expected = table.segmentsFrom(0, [](SegmentId) { return true; });
      ASSERT_EQ(expected.meets.empty(), !has_rules);
      for (const int threads : {1, 2, 3}) {
        const auto executor = parallel::makeExecutor(threads);
        const tree::Fibers found = table.segments(executor.get());
        EXPECT_EQ(found.ids, expected.ids);
        EXPECT_EQ(found.begin, expected.begin);
        EXPECT_EQ(found.groups, expected.groups);
        EXPECT_EQ(found.meets, expected.meets);
      }
    }
  }
  EXPECT_TRUE(FiberTable(NeighborRule(1)).segments(nullptr).ids.empty());
}

/// Multiples of 1/4, whose sums are exact.
std::vector<double> lengthsOf(Random& random, std::size_t count) {
  std::vector<double> lengths(count);
  for (double& length : lengths) length = static_cast<double>(random.below(5)) / 4;
  return lengths;
}

std::vector<NeighborRule> rules() { return {{0}, {1}, {3}, {0, 1.5}, {1, 0.75}}; }

// A segment would have another fiber's number, group or neighbours.
TEST(FiberTable, IsTheModelUnderRandomUse) {
  Random random(71);
  for (const NeighborRule& rule : rules()) {
    for (const SegmentId ids_behind : {0, 1, 2}) {
      SCOPED_TRACE(testing::Message() << "reach " << rule.reach << ", arc " << rule.arc_length
                                      << ", behind " << ids_behind);
      Model model(rule, ids_behind);
      for (int step = 0; step < 60; ++step) {
        for (std::size_t i = random.below(4); i > 0; --i) {
          // Groups and closed fibers come when there are others already.
          const auto group = static_cast<Group>(step < 20 ? 0 : random.below(4));
          model.add(lengthsOf(random, 1 + random.below(step % 7 == 0 ? 12 : 3)),
                    random.below(4) != 0, step > 10 && random.below(3) == 0, group);
        }
        if (step % 9 == 8) {
          std::set<std::size_t> kept;
          for (std::size_t number = 0; number < 200; ++number) {
            if (random.below(3) != 0) kept.insert(number);
          }
          model.keepOnly(kept);
        }
        if (step == 45) model.clear();
        model.expectEqual();
        if (testing::Test::HasFailure()) FAIL() << "step " << step;
      }
    }
  }
}

// A manager would give a new fiber the number of one that has gone.
TEST(FiberTable, NumbersGoOnAfterADrop) {
  Model model(1, 0);
  for (int f = 0; f < 5; ++f) model.add({1, 1}, true, false, kNoGroup);
  model.keepOnly({1, 4});
  EXPECT_EQ(model.table().placeOf(0).fiber, 1u);
  EXPECT_EQ(model.table().placeOf(3).fiber, 4u);
  model.add({1}, true, false, kNoGroup);
  EXPECT_EQ(model.table().placeOf(4).fiber, 5u);
  model.keepOnly({});
  EXPECT_EQ(model.table().idCount(), 0);
  model.add({1}, true, false, kNoGroup);
  EXPECT_EQ(model.table().placeOf(0).fiber, 6u);
  model.expectEqual();
  model.clear();
  model.add({1}, true, false, kNoGroup);
  EXPECT_EQ(model.table().placeOf(0).fiber, 0u) << "all is new";
}

// The first group that comes would be that of fibers that have none.
TEST(FiberTable, GroupsMayStartLate) {
  Model model(0, 0);
  for (int f = 0; f < 4; ++f) model.add({1, 1, 1}, true, false, kNoGroup);
  EXPECT_FALSE(model.table().hasGroups());
  const std::size_t before = model.table().memoryUsage();
  model.add({1, 1}, true, false, 7);
  EXPECT_TRUE(model.table().hasGroups());
  EXPECT_GT(model.table().memoryUsage(), before);
  model.add({1}, true, false, kNoGroup);
  model.add({1}, true, false, 7);
  EXPECT_TRUE(model.table().shareGroup(12, 15));
  EXPECT_FALSE(model.table().shareGroup(0, 14)) << "none is no group";
  model.expectEqual();
}

// A closed fiber given as points would lead from its last segment to what is no segment.
TEST(FiberTable, IdsBehindAFiberAreNoWayAround) {
  for (const NeighborRule& rule : {NeighborRule(1), NeighborRule(0, 0.5)}) {
    Model model(rule, 1);
    model.add({1, 1, 1, 1}, true, true, kNoGroup);
    model.add({1, 1, 1, 1}, true, false, kNoGroup);
    FiberTable& table = model.table();
    EXPECT_TRUE(table.isBehind(4));
    EXPECT_FALSE(table.isBehind(3));
    EXPECT_TRUE(table.areNeighbors(0, 3));
    EXPECT_FALSE(table.areNeighbors(0, 2));
    EXPECT_FALSE(table.areNeighbors(5, 8));
    EXPECT_FALSE(table.areNeighbors(3, 5));
    model.expectEqual();
  }
}

// A registration that runs out of memory half-way would leave objects that are in no fiber.
TEST(FiberTable, WhatHasRoomDoesNotAllocate) {
  for (const NeighborRule& rule : rules()) {
    for (const bool drops_before : {false, true}) {
      for (const bool drops_all : {false, true}) {
        for (const bool groups_before : {false, true}) {
          for (const bool groups : {false, true}) {
            SCOPED_TRACE(testing::Message()
                         << "reach " << rule.reach << ", arc " << rule.arc_length << ", drops "
                         << drops_before << drops_all << ", groups " << groups_before << groups);
            FiberTable table(rule);
            for (int f = 0; f < 10; ++f) {
              table.startFiber({true, false, groups_before ? f % 2 : kNoGroup});
              for (int i = 0; i < 5; ++i) table.addId(1);
            }
            if (drops_before) {
              table.drop([&](SegmentId begin, SegmentId) { return !drops_all && begin > 10; },
                         [](SegmentId, SegmentId) {});
            }
            table.reserve(300, 2000, {true, groups, false, true});
            const std::size_t bytes = table.memoryUsage();
            bool struck;
            {
              const AllocationFault fault(0, AllocationFault::Lasts::kForever);
              for (int f = 0; f < 300; ++f) {
                table.startFiber({f % 2 == 0, f % 3 == 0, groups ? f % 5 : kNoGroup});
                for (int i = 0; i < 6; ++i) table.addId(0.5);
              }
              for (int i = 0; i < 200; ++i) table.addId(0.5);
              struck = fault.struck();
            }
            EXPECT_FALSE(struck);
            EXPECT_EQ(table.memoryUsage(), bytes);
          }
        }
      }
    }
  }
}

// Each of many objects that are registered one by one would copy all before it.
TEST(FiberTable, GrowingOneByOneIsLinear) {
  FiberTable table(NeighborRule(1, 1.0));
  std::set<std::size_t> sizes;
  for (int f = 0; f < 20000; ++f) {
    table.reserve(1, 1, {false, true, false});
    table.startFiber({true, false, 1});
    table.addId(1);
    sizes.insert(table.memoryUsage());
  }
  // Powers of one and a half, of four vectors.
  EXPECT_LE(sizes.size(), 4 * 27u);
}

}  // namespace
}  // namespace fcl_fibers::fibers
