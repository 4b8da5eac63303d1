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

TEST(PointerIndex, TakesBackWhatWasInsertedLast) {
  // If this fails, a registration that is refused leaves objects behind, or takes others with it.
  // Tables of 16 slots with 10 entries each: many sets of things, so that they probe past each
  // other and around the end.
  Random random(1);
  std::vector<int> pool(5120);
  for (int trial = 0; trial < 3000; ++trial) {
    std::vector<int*> pointers;
    for (std::size_t i = 0; i < 10; ++i) pointers.push_back(&pool[512 * i + random.below(512)]);
    PointerIndex<int> index(pointers);
    index.reserve(10);
    ASSERT_EQ(index.memoryUsage(), 16 * sizeof(std::int32_t));
    for (std::int32_t i = 0; i < 10; ++i) ASSERT_TRUE(index.insert(i));
    for (std::int32_t left = 10; left-- > 0;) {
      index.takeBack(left);
      for (std::int32_t i = 0; i < 10; ++i) {
        ASSERT_EQ(index.find(pointers[static_cast<std::size_t>(i)]),
                  i < left ? i : PointerIndex<int>::kNotFound)
            << trial;
      }
    }
    for (std::int32_t i = 0; i < 10; ++i) ASSERT_TRUE(index.insert(i)) << trial;
  }
}

TEST(PointerIndex, ReservesOnceForMany) {
  // If this fails, insert() allocates, and a registration that fails leaves half of it behind; or
  // the table is fuller than half, and probing is slow.
  std::vector<int> things(1000);
  std::vector<int*> pointers;
  PointerIndex<int> index(pointers);
  index.reserve(things.size());
  const std::size_t bytes = index.memoryUsage();
  EXPECT_GE(bytes, 2 * things.size() * sizeof(std::int32_t));
  EXPECT_LE(bytes, 4 * things.size() * sizeof(std::int32_t));
  for (std::size_t i = 0; i < things.size(); ++i) {
    pointers.push_back(&things[i]);
    EXPECT_TRUE(index.insert(static_cast<std::int32_t>(i)));
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
  EXPECT_TRUE(index.insert(5));
  EXPECT_EQ(index.find(&things[5]), 5);
  index.clear();
  EXPECT_EQ(index.find(&things[5]), PointerIndex<int>::kNotFound);
}

}  // namespace
}  // namespace fcl_fibers::broadphase
