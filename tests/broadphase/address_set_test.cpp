// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/address_set.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <set>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include "support/random.h"

namespace fcl_fibers::broadphase {
namespace {

using test::Random;

/// As large as an object.
struct Thing {
  char bytes[sizeof(fcl::CollisionObject<double>)];
};

TEST(AddressSet, KnowsWhatIsInIt) {
  // If this fails, an object is refused that is not registered, or is registered twice.
  Random random(1);
  // Things side by side, and things of which each is in a window of its own.
  std::vector<Thing> dense(500), sparse(50000);
  std::vector<const Thing*> all;
  for (const Thing& thing : dense) all.push_back(&thing);
  for (std::size_t i = 0; i < sparse.size(); i += 100) all.push_back(&sparse[i]);
  AddressSet<Thing> addresses;
  std::set<const Thing*> known;
  for (int step = 0; step < 200000; ++step) {
    const Thing* thing = all[random.below(all.size())];
    // It fills and empties in turn, so that windows are dropped.
    const bool grows = step / 20000 % 2 == 0;
    if (known.count(thing) == 0 ? random.below(4) < (grows ? 3u : 1u) : false) {
      ASSERT_TRUE(addresses.insert(thing)) << step;
      known.insert(thing);
    } else if (known.count(thing) != 0 && random.below(4) < (grows ? 1u : 3u)) {
      ASSERT_FALSE(addresses.insert(thing)) << step;
      addresses.erase(thing);
      known.erase(thing);
    }
    ASSERT_EQ(addresses.contains(thing), known.count(thing) != 0) << step;
    if (step % 1000 != 0) continue;
    for (const Thing* each : all) {
      ASSERT_EQ(addresses.contains(each), known.count(each) != 0) << step;
    }
  }
  addresses.clear();
  for (const Thing* each : all) ASSERT_FALSE(addresses.contains(each));
}

TEST(AddressSet, IsSmall) {
  // If this fails, a scene pays bytes for each segment that it does not need, or a program whose
  // objects come and go at ever new addresses takes ever more memory.
  std::vector<Thing> things(100000);
  AddressSet<Thing> addresses;
  for (const Thing& thing : things) addresses.insert(&thing);
  EXPECT_LE(addresses.memoryUsage(), 2 * things.size());
  AddressSet<Thing> passing;
  for (std::size_t i = 0; i < things.size(); ++i) {
    ASSERT_TRUE(passing.insert(&things[i]));
    if (i >= 100) passing.erase(&things[i - 100]);
  }
  EXPECT_LE(passing.memoryUsage(), 1024u);
}

}  // namespace
}  // namespace fcl_fibers::broadphase
