// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/obstacles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <memory>
#include <vector>

#include "support/random.h"

namespace fcl_fibers::broadphase {
namespace {

struct Entry {
  const int* object = nullptr;
  std::shared_ptr<int> held;  ///< so that it shows whether an entry has gone
};

/// What is in it, in a plain map, and the objects themselves, whose values are their numbers.
class Known {
 public:
  ById<Entry> entries;
  std::map<SegmentId, int> truth;

  void add(SegmentId id) {
    objects_.push_back(std::make_unique<int>(static_cast<int>(objects_.size())));
    const int number = *objects_.back();
    held_.push_back(std::make_shared<int>(number));
    entries.reserve(1);
    entries.add(id, {objects_.back().get(), held_.back()});
    truth[id] = number;
  }
  void remove(SegmentId id) {
    const std::size_t place = entries.find(id);
    ASSERT_LT(place, entries.size());
    entries.remove(place);
    held_[static_cast<std::size_t>(truth.at(id))].reset();
    truth.erase(id);
  }

  void expectAll(SegmentId last) const {
    for (SegmentId id = -1; id <= last + 1; ++id) {
      const auto known = truth.find(id);
      const std::size_t place = entries.find(id);
      const Entry* entry = entries.get(id);
      if (known == truth.end()) {
        EXPECT_EQ(place, entries.size()) << id;
        EXPECT_EQ(entry, nullptr) << id;
        continue;
      }
      ASSERT_LT(place, entries.size()) << id;
      EXPECT_EQ(entries.ids()[place], id);
      ASSERT_EQ(entry, &entries[place]);
      EXPECT_EQ(*entry->object, known->second) << id;
      EXPECT_EQ(*entry->held, known->second) << id;
      EXPECT_EQ(entry->held.use_count(), 2) << id;
    }
    EXPECT_EQ(entries.size() - entries.removedCount(), truth.size());
    EXPECT_EQ(entries.ids().size(), entries.size());
    EXPECT_TRUE(std::is_sorted(entries.ids().begin(), entries.ids().end()));
    const auto removed = std::count_if(entries.begin(), entries.end(),
                                       [](const Entry& e) { return e.object == nullptr; });
    EXPECT_EQ(static_cast<std::size_t>(removed), entries.removedCount());
  }

  std::vector<std::unique_ptr<int>> objects_;
  std::vector<std::shared_ptr<int>> held_;
};

// One that has gone would be found, or another be lost or keep what it held.
TEST(ById, FindsWhatAMapDoes) {
  test::Random random(951);
  Known known;
  known.expectAll(3);
  SegmentId next = 0;
  for (int round = 0; round < 400; ++round) {
    const std::size_t what = random.below(20);
    if (what < 10 || known.truth.empty()) {
      next += 1 + static_cast<SegmentId>(random.below(3));  // capsules have ids, too
      known.add(next);
    } else if (what < 17) {
      const auto gone = std::next(known.truth.begin(),
                                  static_cast<std::ptrdiff_t>(random.below(known.truth.size())));
      known.remove(gone->first);
    } else {
      known.entries.compact();
      EXPECT_EQ(known.entries.size(), known.truth.size());
      EXPECT_EQ(known.entries.removedCount(), 0u);
      if (what == 19) {
        // Ids of the same objects become the first ones, as when those of removed objects are dealt
        // anew.
        std::map<SegmentId, int> renumbered;
        std::map<int, SegmentId> id_of;
        SegmentId id = 0;
        for (const auto& [old_id, number] : known.truth) {
          id += static_cast<SegmentId>(random.below(2));
          id_of[number] = id;
          renumbered[id++] = number;
        }
        known.truth = renumbered;
        known.entries.renumber([&](const Entry& entry) { return id_of.at(*entry.object); });
        next = id;
      }
    }
    known.expectAll(next);
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(known.truth.size(), 20u);
  known.entries.clear();
  known.truth.clear();
  known.expectAll(next);
  known.add(5);
  known.expectAll(next);
}

// Adding could run out of memory half way.
TEST(ById, WhatIsReservedNeedsNoMemory) {
  ById<Entry> entries;
  const int object = 0;
  SegmentId id = 0;
  for (const std::size_t more : {1u, 3u, 100u, 1u, 1u}) {
    entries.reserve(more);
    const std::size_t bytes = entries.memoryUsage();
    EXPECT_GE(bytes, (entries.size() + more) * (sizeof(Entry) + sizeof(SegmentId)));
    for (std::size_t i = 0; i < more; ++i) entries.add(id++, {&object, nullptr});
    EXPECT_EQ(entries.memoryUsage(), bytes);
  }
  // One at a time, memory grows by a factor.
  int growths = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::size_t bytes = entries.memoryUsage();
    entries.reserve(1);
    entries.add(id++, {&object, nullptr});
    growths += entries.memoryUsage() != bytes ? 1 : 0;
  }
  EXPECT_LE(growths, 5);
}

// The first one that comes back after many were registered together would move all.
TEST(ById, AfterManyThereIsRoomForAFew) {
  ById<Entry> entries;
  const int object = 0;
  entries.reserve(1000);
  for (SegmentId id = 0; id < 1000; ++id) entries.add(id, {&object, nullptr});
  const Entry* const first = &entries[0];
  for (SegmentId id = 1000; id < 1125; ++id) {
    entries.reserve(1);
    entries.add(id, {&object, nullptr});
  }
  EXPECT_EQ(&entries[0], first);
}

// The first of many to go would move all the others.
TEST(ById, RemovedEntriesKeepTheirPlacesUntilItIsCompact) {
  ById<Entry> entries;
  const int objects[4] = {};
  entries.reserve(4);
  for (int i = 0; i < 4; ++i) entries.add(2 * i, {&objects[i], nullptr});
  entries.remove(0);
  entries.remove(2);
  EXPECT_EQ(entries.size(), 4u);
  EXPECT_EQ(entries.removedCount(), 2u);
  EXPECT_EQ(entries.find(2), 1u);
  EXPECT_EQ(entries.find(6), 3u);
  entries.compact();
  EXPECT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries.find(2), 0u);
  EXPECT_EQ(entries.find(6), 1u);
  EXPECT_EQ(entries[1].object, &objects[3]);
}

}  // namespace
}  // namespace fcl_fibers::broadphase
