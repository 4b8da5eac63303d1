// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/fiber_registry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/sphere.h>

#include "support/random.h"

namespace fcl_fibers::broadphase {
namespace {

using test::Random;

using Registry = FiberRegistry<double>;

Registry::Kind kindOf(bool declared) {
  return declared ? Registry::Kind::kOpen : Registry::Kind::kGuessed;
}
using Object = Registry::Object;
using Objects = std::vector<Object*>;

/// Objects to be registered; they are never looked at.
class Stock {
 public:
  explicit Stock(std::size_t count) {
    const auto shape = std::make_shared<fcl::Sphere<double>>(1);
    for (std::size_t i = 0; i < count; ++i) owned_.push_back(std::make_unique<Object>(shape));
  }
  std::size_t size() const { return owned_.size(); }
  Object* operator[](std::size_t i) const { return owned_[i].get(); }
  Objects range(std::size_t begin, std::size_t end) const {
    Objects objects;
    for (std::size_t i = begin; i < end; ++i) objects.push_back(owned_[i].get());
    return objects;
  }

 private:
  std::vector<std::unique_ptr<Object>> owned_;
};

/// One fiber.
std::vector<bool> oneFiber(std::size_t count) {
  std::vector<bool> starts(count, false);
  if (count > 0) starts[0] = true;
  return starts;
}

/// What a registry has to know, in the simplest form.
struct Record {
  int order;    // of registration
  int fiber;    // counted over all that ever were
  int segment;  // within the fiber, as it was registered
  bool is_declared;
  tree::Group group;
};

class Model {
 public:
  explicit Model(const Stock& stock) : stock_(stock) {}

  Registry& registry() { return registry_; }
  const std::map<Object*, Record>& records() const { return records_; }

  std::optional<std::size_t> add(const Objects& added, const std::vector<bool>& starts,
                                 bool declared, tree::Group group = tree::kNoGroup) {
    const auto duplicate = registry_.add(added, starts, kindOf(declared), {}, group);
    if (duplicate) return duplicate;
    int segment = 0;
    for (std::size_t i = 0; i < added.size(); ++i) {
      if (starts[i]) {
        ++fibers_;
        segment = 0;
      }
      records_[added[i]] = {order_++, fibers_ - 1, segment++, declared, group};
    }
    return duplicate;
  }
  void remove(Object* object) {
    registry_.remove(object);
    records_.erase(object);
  }

  void clear() {
    registry_.clear();
    records_.clear();
    fibers_ = 0;
    EXPECT_TRUE(registry_.objects().empty());
  }

  void expectEqual() {
    ASSERT_EQ(registry_.size(), records_.size());
    std::vector<std::pair<Object*, Record>> expected(records_.begin(), records_.end());
    std::sort(expected.begin(), expected.end(),
              [](const auto& p, const auto& q) { return p.second.order < q.second.order; });
    Objects managed;
    for (Object* object : registry_.objects()) {
      if (object != nullptr) managed.push_back(object);
    }
    ASSERT_EQ(managed.size(), expected.size());
    for (std::size_t i = 0; i < managed.size(); ++i) {
      ASSERT_EQ(managed[i], expected[i].first) << "ids are not in the order of registration";
    }
    for (std::size_t i = 0; i < stock_.size(); ++i) {
      const SegmentId id = registry_.find(stock_[i]);
      if (records_.count(stock_[i]) == 0) {
        ASSERT_EQ(id, Registry::kNotFound) << i;
      } else {
        ASSERT_GE(id, 0) << i;
        ASSERT_EQ(registry_.objects()[static_cast<std::size_t>(id)], stock_[i]) << i;
      }
    }
    expectFibers(expected);
    expectNeighbors(expected);
  }

 private:
  using Expected = std::vector<std::pair<Object*, Record>>;

  void expectFibers(const Expected& expected) {
    for (const auto& [object, record] : expected) {
      const FiberSegment place = registry_.fiberSegment(registry_.find(object));
      ASSERT_EQ(place.fiber, static_cast<std::size_t>(record.fiber)) << "a fiber's number";
      ASSERT_EQ(place.segment, static_cast<std::size_t>(record.segment)) << "a segment's number";
      ASSERT_EQ(registry_.groupOf(registry_.find(object)), record.group) << "a fiber's group";
    }

    // As the tree is given them, whole and in part: in order, one fiber after the other.
    for (const int modulus : {1, 3}) {
      const auto admit = [&](SegmentId id) { return id % modulus == 0; };
      const tree::Fibers fibers = registry_.fibers(admit);
      ASSERT_EQ(fibers.begin.front(), 0);
      ASSERT_EQ(fibers.begin.back(), static_cast<std::int32_t>(fibers.ids.size()));
      std::vector<SegmentId> admitted;
      for (const auto& entry : expected) {
        const SegmentId id = registry_.find(entry.first);
        if (admit(id)) admitted.push_back(id);
      }
      ASSERT_EQ(fibers.ids, admitted);
      std::set<std::size_t> seen;
      for (std::size_t f = 0; f + 1 < fibers.begin.size(); ++f) {
        if (fibers.begin[f] == fibers.begin[f + 1]) continue;
        const auto numberOf = [&](std::int32_t i) {
          return registry_.fiberSegment(fibers.ids[static_cast<std::size_t>(i)]).fiber;
        };
        const std::size_t number = numberOf(fibers.begin[f]);
        ASSERT_TRUE(seen.insert(number).second) << "a fiber has come apart";
        for (std::int32_t i = fibers.begin[f]; i < fibers.begin[f + 1]; ++i) {
          ASSERT_EQ(numberOf(i), number) << "two fibers have become one";
          const SegmentId id = fibers.ids[static_cast<std::size_t>(i)];
          ASSERT_EQ(fibers.groups.empty() ? tree::kNoGroup : fibers.groups[f],
                    registry_.groupOf(id));
        }
      }
    }
  }

  void expectNeighbors(const Expected& expected) {
    // Pairs near each other in the order of registration; the others cannot be neighbours.
    for (std::size_t i = 0; i < expected.size(); ++i) {
      for (std::size_t j = i; j < std::min(i + 6, expected.size()); ++j) {
        const Record &p = expected[i].second, &q = expected[j].second;
        const SegmentId a = registry_.find(expected[i].first),
                        b = registry_.find(expected[j].first);
        ASSERT_EQ(registry_.areOfOneGroup(a, b), p.group != tree::kNoGroup && p.group == q.group);
        for (const SegmentId reach : {0, 1, 2, 5}) {
          const bool neighbors =
              i == j || (p.fiber == q.fiber && p.is_declared && q.segment - p.segment <= reach);
          ASSERT_EQ(registry_.areNeighbors(a, b, reach), neighbors)
              << p.fiber << ' ' << p.segment << ' ' << q.segment;
          ASSERT_EQ(registry_.areNeighbors(b, a, reach), neighbors)
              << p.fiber << ' ' << p.segment << ' ' << q.segment;
        }
      }
    }
  }

  const Stock& stock_;
  Registry registry_{Registry::Keep::kLinks};
  std::map<Object*, Record> records_;
  int order_ = 0, fibers_ = 0;
};

TEST(FiberRegistry, RemovingLeavesTheOthersNumbersAsTheyAre) {
  // If this fails, unregistering a segment joins its two neighbours, or moves the fiber's numbers.
  const Stock stock(300);
  Model model(stock);
  model.add(stock.range(0, 100), oneFiber(100), true);
  model.add(stock.range(100, 200), oneFiber(100), false);
  model.add(stock.range(200, 300), oneFiber(100), true);
  // Beyond the number at which ids are renumbered.
  for (std::size_t i = 0; i < 300; ++i) {
    if (i % 8 == 3) continue;
    model.remove(stock[i]);
    if (i % 11 == 0) model.expectEqual();
    if (testing::Test::HasFatalFailure()) FAIL() << i;
  }
  model.expectEqual();
  // The first segment of a fiber is gone, and the second starts no other fiber.
  EXPECT_EQ(model.registry().fiberSegment(model.registry().find(stock[3])).segment, 3u);
  EXPECT_EQ(model.registry().fiberSegment(model.registry().find(stock[203])).segment, 3u);
}

TEST(FiberRegistry, IsTheModelUnderRandomUse) {
  // If this fails, some sequence of registering and unregistering loses an object or its place,
  // ignores neighbours across the ends of fibers or in guessed ones, or outlives clear().
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
    Random random(seed);
    const Stock stock(400);
    Model model(stock);
    for (int step = 0; step < 600; ++step) {
      const bool is_filling = step / 60 % 2 == 0;
      if (random.unit() < (is_filling ? 0.6 : 0.1)) {
        // A few objects that are not managed, in one fiber or several.
        Objects added;
        for (std::size_t i = random.below(30); i > 0; --i) {
          Object* object = stock[random.below(stock.size())];
          if (model.records().count(object) == 0 &&
              std::count(added.begin(), added.end(), object) == 0) {
            added.push_back(object);
          }
        }
        std::vector<bool> starts = oneFiber(added.size());
        const bool declared = random.below(2) == 0;
        for (std::size_t i = 1; i < added.size() && !declared; ++i)
          starts[i] = random.below(3) == 0;
        // The first group comes when there are fibers already.
        const auto group = static_cast<tree::Group>(step < 20 || !declared ? 0 : random.below(4));
        ASSERT_FALSE(model.add(added, starts, declared, group));
      } else if (!model.records().empty()) {
        for (std::size_t i = random.below(15); i > 0 && !model.records().empty(); --i) {
          auto victim = model.records().begin();
          std::advance(victim, static_cast<std::ptrdiff_t>(random.below(model.records().size())));
          model.remove(victim->first);
        }
      }
      if (step == 400) model.clear();
      if (step % 3 == 0 || step == 400) model.expectEqual();
      if (testing::Test::HasFatalFailure()) FAIL() << "seed " << seed << ", step " << step;
    }
  }
}

TEST(FiberRegistry, ADuplicateChangesNothing) {
  // If this fails, a registration that is refused leaves some of its objects behind.
  const Stock stock(60);
  Model model(stock);
  model.add(stock.range(0, 10), oneFiber(10), true);
  model.add(stock.range(10, 20), oneFiber(10), false);
  model.remove(stock[4]);
  model.expectEqual();
  const auto expectRefused = [&](Objects added, std::size_t position) {
    for (const bool declared : {false, true}) {
      const auto duplicate = model.add(added, oneFiber(added.size()), declared);
      ASSERT_TRUE(duplicate);
      EXPECT_EQ(*duplicate, position);
      model.expectEqual();
    }
  };
  expectRefused({stock[0]}, 0);
  expectRefused({stock[30], stock[31], stock[30], stock[32]}, 2);
  expectRefused({stock[30], stock[31], stock[32], stock[19]}, 3);
  expectRefused({stock[4], stock[4]}, 1);
  Objects many = stock.range(20, 60);
  many.push_back(stock[20]);
  expectRefused(many, 40);
  // And what was refused is welcome after all.
  EXPECT_FALSE(model.add({stock[4], stock[30], stock[31]}, oneFiber(3), true));
  model.expectEqual();
}

TEST(FiberRegistry, ACopyHasOtherObjectsInTheirPlaces) {
  // If this fails, a clone has lost numbers, neighbours, arcs or groups, or finds the original's
  // objects.
  const Stock stock(220), others(220);
  Registry original(Registry::Keep::kLinksAndArcs);
  const auto add = [&](std::size_t begin, std::size_t end, Registry::Kind kind, tree::Group group) {
    ASSERT_FALSE(original.add(stock.range(begin, end), oneFiber(end - begin), kind,
                              std::vector<double>(end - begin, 2), group));
  };
  for (std::size_t i = 0; i < 150; ++i) add(i, i + 1, Registry::Kind::kOpen, 0);
  add(150, 160, Registry::Kind::kClosed, 5);
  add(160, 190, Registry::Kind::kOpen, 5);
  add(190, 200, Registry::Kind::kGuessed, 0);
  // So many that ids have moved, and then some more.
  for (std::size_t i = 0; i < 170; ++i) {
    if (i < 150 || i >= 160) original.remove(stock[i]);
  }
  original.remove(stock[155]);
  ASSERT_LT(original.find(stock[159]), 159);

  Objects objects;
  for (const std::size_t i : {150u, 151u, 152u, 153u, 154u, 156u, 157u, 158u, 159u})
    objects.push_back(others[i]);
  for (std::size_t i = 170; i < 200; ++i) objects.push_back(others[i]);
  Registry copy(Registry::Keep::kLinksAndArcs);
  ASSERT_FALSE(copy.copy(original, objects));
  ASSERT_EQ(copy.size(), original.size());
  ASSERT_EQ(copy.objects().size(), original.objects().size());
  const auto expectAlike = [&](std::size_t added) {
    for (std::size_t i = 0; i < 200 + added; ++i) {
      const SegmentId id = original.find(stock[i]);
      ASSERT_EQ(copy.find(others[i]), id) << i;
      ASSERT_EQ(copy.find(stock[i]), Registry::kNotFound);
      if (id == Registry::kNotFound) continue;
      EXPECT_EQ(copy.objects()[static_cast<std::size_t>(id)], others[i]);
      EXPECT_EQ(copy.fiberSegment(id).fiber, original.fiberSegment(id).fiber);
      EXPECT_EQ(copy.fiberSegment(id).segment, original.fiberSegment(id).segment);
      EXPECT_EQ(copy.groupOf(id), original.groupOf(id));
      for (std::size_t j = i; j < 200 + added; ++j) {
        const SegmentId other = original.find(stock[j]);
        if (other == Registry::kNotFound) continue;
        for (const double arc : {2.0, 7.0}) {
          ASSERT_EQ(copy.areNeighbors(id, other, {1, arc}),
                    original.areNeighbors(id, other, {1, arc}));
        }
      }
    }
  };
  expectAlike(0);
  // What comes after goes on alike.
  for (Registry* registry : {&original, &copy}) {
    const Stock& of = registry == &original ? stock : others;
    registry->add(of.range(200, 210), oneFiber(10), Registry::Kind::kOpen,
                  std::vector<double>(10, 1), 6);
    for (std::size_t i = 180; i < 190; ++i) registry->remove(of[i]);
  }
  expectAlike(10);

  objects.resize(39);
  objects[30] = objects[2];
  Registry twice(Registry::Keep::kLinksAndArcs);
  Registry source(Registry::Keep::kNothing);
  source.add(stock.range(0, 39), oneFiber(39), Registry::Kind::kOpen);
  EXPECT_EQ(twice.copy(source, objects), std::optional<std::size_t>(30));
}

TEST(FiberRegistry, ArcsAndClosedFibersSurviveRenumbering) {
  // If this fails, a fiber that moved up in the order is measured along another one.
  const Stock stock(400);
  Registry registry(Registry::Keep::kLinksAndArcs);
  const auto add = [&](std::size_t begin, std::size_t end, Registry::Kind kind, double length) {
    ASSERT_FALSE(registry.add(stock.range(begin, end), oneFiber(end - begin), kind,
                              std::vector<double>(end - begin, length)));
  };
  for (std::size_t i = 0; i < 300; ++i) add(i, i + 1, Registry::Kind::kOpen, 7);
  add(300, 310, Registry::Kind::kClosed, 2);
  add(310, 320, Registry::Kind::kOpen, 3);
  const auto expectRules = [&] {
    const SegmentId ring = registry.find(stock[300]), open = registry.find(stock[310]);
    EXPECT_TRUE(registry.areNeighbors(ring, ring + 9, 1));
    EXPECT_FALSE(registry.areNeighbors(ring, ring + 8, 1));
    EXPECT_TRUE(registry.areNeighbors(ring + 9, ring + 1, 2));
    EXPECT_FALSE(registry.areNeighbors(open, open + 9, 1));
    EXPECT_FALSE(registry.areNeighbors(ring + 9, open, {5, 100})) << "the ends of two fibers";
    // Two segments of length 2 lie between ring + 8 and ring + 1.
    EXPECT_TRUE(registry.areNeighbors(ring + 8, ring + 1, {0, 4}));
    EXPECT_FALSE(registry.areNeighbors(ring + 8, ring + 1, {0, 3.9}));
    EXPECT_TRUE(registry.areNeighbors(open + 2, open + 5, {0, 6}));
    EXPECT_FALSE(registry.areNeighbors(open + 2, open + 5, {0, 5.9}));
  };
  expectRules();
  for (std::size_t i = 0; i < 300; ++i) registry.remove(stock[i]);
  ASSERT_LT(registry.find(stock[300]), 300) << "the ids have not moved, so nothing was tried";
  expectRules();
}

TEST(FiberRegistry, AddingOneByOneIsLinear) {
  // If this fails, each registration moves all objects that are there.
  const Stock stock(20000);
  for (const auto keep : {Registry::Keep::kNothing, Registry::Keep::kLinks}) {
    Registry registry(keep);
    std::set<std::size_t> sizes, capacities;
    for (std::size_t i = 0; i < stock.size(); ++i) {
      ASSERT_FALSE(registry.add({stock[i]}, {true}, Registry::Kind::kGuessed));
      sizes.insert(registry.memoryUsage());
      capacities.insert(registry.objects().capacity());
    }
    // Powers of one and a half.
    EXPECT_LE(capacities.size(), 27u);
    EXPECT_LE(sizes.size(), 5 * 27u);
    EXPECT_EQ(registry.size(), stock.size());
  }
}

TEST(FiberRegistry, EmptyIdsDoNotPileUp) {
  // If this fails, objects that come and go one by one make the manager grow for ever.
  const Stock stock(2000);
  Registry registry(Registry::Keep::kLinks);
  for (std::size_t i = 0; i < stock.size(); ++i) {
    ASSERT_FALSE(registry.add({stock[i]}, {true}, kindOf(i % 2 == 0)));
    if (i >= 10) registry.remove(stock[i - 10]);
    ASSERT_LE(registry.objects().size(), 2 * registry.size() + 130) << i;
  }
  EXPECT_EQ(registry.size(), 10u);
}

TEST(FiberRegistry, RemovingOneByOneIsLinear) {
  // If this fails, each removal renumbers all objects. (A renumbering shows as fewer ids.)
  const Stock stock(20000);
  Registry registry(Registry::Keep::kNothing);
  ASSERT_FALSE(registry.add(stock.range(0, stock.size()), std::vector<bool>(stock.size(), true),
                            Registry::Kind::kGuessed));
  int renumberings = 0;
  std::size_t ids = registry.objects().size();
  for (std::size_t i = 0; i < stock.size(); ++i) {
    registry.remove(stock[i]);
    if (registry.objects().size() < ids) ++renumberings;
    ids = registry.objects().size();
    ASSERT_LE(ids, 2 * registry.size() + 130);
  }
  EXPECT_LE(renumberings, 20);
  EXPECT_EQ(registry.size(), 0u);
}

}  // namespace
}  // namespace fcl_fibers::broadphase
