// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_registry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "parallel/executor.h"
#include "support/random.h"

namespace fcl_fibers::broadphase {
namespace {

using test::Random;

TEST(PointerIndex, TakesBackAllOfACallOfWhichOneIsKnown) {
  // If this fails, a registration that is refused leaves objects behind, or takes others with it.
  // Tables of 16 slots with 10 entries each: many sets of things, so that they probe past each
  // other and around the end.
  Random random(1);
  std::vector<int> pool(5120);
  for (int trial = 0; trial < 3000; ++trial) {
    std::vector<int*> all;
    for (std::size_t i = 0; i < 10; ++i) all.push_back(&pool[512 * i + random.below(512)]);
    std::vector<int*> pointers;
    PointerIndex<int> index(pointers);
    index.reserve(10);
    ASSERT_EQ(index.memoryUsage(), 16 * sizeof(std::int32_t));
    const std::size_t before = random.below(9), known = before + 1 + random.below(9 - before);
    pointers.assign(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(before));
    ASSERT_FALSE(index.insertFrom(0)) << trial;
    pointers = all;
    pointers[known] = all[random.below(known)];
    ASSERT_EQ(index.insertFrom(static_cast<std::int32_t>(before)),
              std::optional(static_cast<std::int32_t>(known)))
        << trial;
    pointers.resize(before);
    for (std::size_t i = 0; i < 10; ++i) {
      ASSERT_EQ(index.find(all[i]),
                i < before ? static_cast<std::int32_t>(i) : PointerIndex<int>::kNotFound)
          << trial;
    }
    pointers = all;
    ASSERT_FALSE(index.insertFrom(static_cast<std::int32_t>(before))) << trial;
    for (std::size_t i = 0; i < 10; ++i) {
      ASSERT_EQ(index.find(all[i]), static_cast<std::int32_t>(i)) << trial;
    }
  }
}

/// Runs the last task first, as threads may.
struct Backwards final : parallel::Executor {
  int threads() const override { return 1; }
  void parallelForWithForeground(parallel::FunctionRef<> foreground, int count,
                                 parallel::FunctionRef<int> task) override {
    foreground();
    while (count > 0) task(--count);
  }
};

TEST(PointerIndex, SeveralThreadsInsertAtOnce) {
  // If this fails, threads overwrite each other's slots: an object is not found, or one that is
  // passed twice is managed twice or named by another place.
  struct Thing {
    char as_large_as_an_object[160];
  };
  std::vector<Thing> pool(20000);
  for (const int threads : {1, 2, 3, 8, 0}) {
    const std::unique_ptr<parallel::Executor> executor =
        threads == 0 ? std::unique_ptr<parallel::Executor>(new Backwards)
                     : parallel::makeExecutor(threads);
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      SCOPED_TRACE(testing::Message() << threads << " threads, seed " << seed);
      Random random(seed);
      std::vector<Thing*> pointers;
      for (Thing& thing : pool) pointers.push_back(&thing);
      PointerIndex<Thing> index(pointers);
      index.reserve(pointers.size());
      std::size_t least = pointers.size();
      std::vector<Thing*> some = pointers;
      // Of three at one place the second is the first that repeats one.
      for (std::size_t i = random.below(4); i > 0; --i) {
        std::size_t places[] = {random.below(some.size()), random.below(some.size()),
                                random.below(some.size())};
        std::sort(std::begin(places), std::end(places));
        if (places[0] == places[1] || pointers[places[0]] != some[places[0]]) continue;
        pointers[places[1]] = pointers[places[2]] = some[places[0]];
      }
      std::set<Thing*> known;
      for (std::size_t i = 0; i < pointers.size(); ++i) {
        if (!known.insert(pointers[i]).second) least = std::min(least, i);
      }
      const auto refused = index.insertFrom(0, executor.get());
      ASSERT_EQ(refused ? static_cast<std::size_t>(*refused) : pointers.size(), least);
      if (refused) {
        for (Thing& thing : pool) ASSERT_EQ(index.find(&thing), PointerIndex<Thing>::kNotFound);
        pointers = some;
        ASSERT_FALSE(index.insertFrom(0, executor.get()));
      }
      for (std::size_t i = 0; i < some.size(); ++i) {
        ASSERT_EQ(index.find(some[i]), static_cast<std::int32_t>(i));
      }
    }
  }
}

TEST(PointerIndex, ReservesOnceForMany) {
  // If this fails, insertFrom() allocates, and a registration that fails leaves half of it behind;
  // or the table is fuller than half, and probing is slow.
  std::vector<int> things(1000);
  std::vector<int*> pointers;
  PointerIndex<int> index(pointers);
  index.reserve(things.size());
  const std::size_t bytes = index.memoryUsage();
  EXPECT_GE(bytes, 2 * things.size() * sizeof(std::int32_t));
  EXPECT_LE(bytes, 4 * things.size() * sizeof(std::int32_t));
  for (std::size_t i = 0; i < things.size(); ++i) {
    pointers.push_back(&things[i]);
    EXPECT_FALSE(index.insertFrom(static_cast<std::int32_t>(i)));
  }
  EXPECT_EQ(index.memoryUsage(), bytes);
  index.reserve(10);
  EXPECT_EQ(index.memoryUsage(), bytes);
  EXPECT_EQ(index.find(&things[999]), 999);
  // Growing keeps what is there.
  index.reserve(10000);
  for (std::size_t i = 0; i < things.size(); ++i)
    ASSERT_EQ(index.find(&things[i]), static_cast<std::int32_t>(i));
  // Forgetting keeps the room, clearing does not.
  const std::size_t large = index.memoryUsage();
  index.forgetAll();
  for (int& thing : things) ASSERT_EQ(index.find(&thing), PointerIndex<int>::kNotFound);
  EXPECT_EQ(index.memoryUsage(), large);
  EXPECT_FALSE(index.insertFrom(5));
  EXPECT_EQ(index.find(&things[5]), 5);
  index.clear();
  EXPECT_EQ(index.find(&things[5]), PointerIndex<int>::kNotFound);
}

}  // namespace
}  // namespace fcl_fibers::broadphase
