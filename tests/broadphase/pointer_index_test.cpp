// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_registry.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "support/random.h"

namespace fcl_fibers::broadphase {
namespace {

using test::Random;

TEST(PointerIndex, FindsWhatProbesPastOthers) {
  // If this fails, an object is not found, or another one is found in its place.
  // Tables of 16 slots with 10 entries each: many sets of things, so that they probe past each
  // other, around the end and past those that were removed.
  Random random(1);
  std::vector<int> pool(5120);
  for (int trial = 0; trial < 3000; ++trial) {
    std::vector<int*> all;
    for (std::size_t i = 0; i < 10; ++i) all.push_back(&pool[512 * i + random.below(512)]);
    std::vector<int*> pointers;
    PointerIndex<int> index(pointers);
    index.reserve(10);
    ASSERT_EQ(index.memoryUsage(), 16 * sizeof(std::int32_t));
    const std::size_t before = random.below(9), removed = random.below(10);
    pointers.assign(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(before));
    index.insertFrom(0);
    pointers = all;
    index.insertFrom(before);
    pointers[removed] = nullptr;
    for (std::size_t i = 0; i < 10; ++i) {
      ASSERT_EQ(index.find(all[i]),
                i != removed ? static_cast<std::int32_t>(i) : PointerIndex<int>::kNotFound)
          << trial;
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
    index.insertFrom(i);
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
  index.insertFrom(5);
  EXPECT_EQ(index.find(&things[5]), 5);
  index.clear();
  EXPECT_EQ(index.find(&things[5]), PointerIndex<int>::kNotFound);
}

}  // namespace
}  // namespace fcl_fibers::broadphase
