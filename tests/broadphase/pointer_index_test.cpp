// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_registry.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "support/random.h"

namespace fcl_fibers::broadphase {
namespace {

using test::Random;

/// A table beside a vector of pointers, and the same as a map.
class Model {
 public:
  explicit Model(std::size_t things) : things_(things), index_(pointers_) {}

  std::size_t things() const { return things_.size(); }
  int* thing(std::size_t i) { return &things_[i]; }
  std::size_t size() const { return map_.size(); }
  PointerIndex<int>& index() { return index_; }
  std::vector<int*>& pointers() { return pointers_; }

  /// Enters a thing at the end of the vector, known already or not.
  void insert(std::size_t i) {
    const auto position = static_cast<std::int32_t>(pointers_.size());
    index_.reserve(pointers_.size() + 1);
    pointers_.push_back(thing(i));
    const bool is_new = index_.insert(position);
    ASSERT_EQ(is_new, map_.count(thing(i)) == 0) << i;
    if (is_new) {
      map_[thing(i)] = position;
    } else {
      pointers_.pop_back();
    }
  }
  void erase(std::size_t i) {
    pointers_[static_cast<std::size_t>(map_[thing(i)])] = nullptr;
    map_.erase(thing(i));
  }
  bool contains(std::size_t i) { return map_.count(thing(i)) != 0; }

  void expectEqual() {
    ASSERT_EQ(index_.find(nullptr), PointerIndex<int>::kNotFound);
    for (std::size_t i = 0; i < things_.size(); ++i) {
      const auto expected = map_.find(thing(i));
      ASSERT_EQ(index_.find(thing(i)),
                expected == map_.end() ? PointerIndex<int>::kNotFound : expected->second)
          << i;
    }
  }

 private:
  std::vector<int> things_;
  std::vector<int*> pointers_;
  PointerIndex<int> index_;
  std::unordered_map<int*, std::int32_t> map_;
};

TEST(PointerIndex, IsAMapUnderRandomUse) {
  // If this fails, an object is lost when another is unregistered, or is found again.
  for (const std::size_t things : {1u, 3u, 8u, 9u, 16u, 17u, 100u, 1000u}) {
    Random random(things);
    Model model(things);
    EXPECT_EQ(model.index().memoryUsage(), 0u);
    model.expectEqual();
    for (int i = 0; i < 4000; ++i) {
      const std::size_t k = random.below(things);
      // By turns mostly filling and mostly emptying.
      if (random.unit() < (i / 500 % 2 == 0 ? 0.8 : 0.2)) {
        model.insert(k);
      } else if (model.contains(k)) {
        model.erase(k);
      }
      if (i % 37 == 0) model.expectEqual();
      if (testing::Test::HasFatalFailure()) FAIL() << things << " things, step " << i;
    }
    model.expectEqual();
  }
}

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
