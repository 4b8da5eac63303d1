// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_registry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/sphere.h>

#include "support/random.h"

namespace fcl_fibers::broadphase {
namespace {

using test::Random;

using Registry = ObjectRegistry<double>;

using Kind = Registry::Kind;
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
std::vector<std::uint8_t> oneFiber(std::size_t count) {
  std::vector<std::uint8_t> starts(count, false);
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
  explicit Model(const Stock& stock, const fibers::NeighborRule& rule = {2})
      : stock_(stock), reach_(rule.reach), registry_(rule) {}

  Registry& registry() { return registry_; }
  const std::map<Object*, Record>& records() const { return records_; }

  std::optional<std::size_t> add(const Objects& added, const std::vector<std::uint8_t>& starts,
                                 bool declared, tree::Group group = tree::kNoGroup) {
    const auto duplicate = registry_.add(added, starts, {declared, false, group});
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
    const SegmentId id = registry_.find(object);
    const Objects before = registry_.objects();
    const bool stays = registry_.remove(object);
    records_.erase(object);
    // Whoever keeps ids goes by what remove() says of them.
    bool is_same = registry_.objects().size() == before.size();
    for (std::size_t i = 0; is_same && i < before.size(); ++i) {
      is_same = registry_.objects()[i] == before[i] || static_cast<SegmentId>(i) == id;
    }
    EXPECT_EQ(registry_.find(object), Registry::kNotFound);
    if (stays) {
      EXPECT_TRUE(is_same) << "ids have moved";
    }
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
        ASSERT_LT(id, registry_.idCount()) << i;
        ASSERT_EQ(registry_[id], stock_[i]) << i;
      }
    }
    expectFibers(expected);
    expectNeighbors(expected);
  }

 private:
  using Expected = std::vector<std::pair<Object*, Record>>;

  void expectFibers(const Expected& expected) {
    for (const auto& [object, record] : expected) {
      const FiberSegment place = registry_.fibers().placeOf(registry_.find(object));
      ASSERT_EQ(place.fiber, static_cast<std::size_t>(record.fiber)) << "a fiber's number";
      ASSERT_EQ(place.number, static_cast<std::size_t>(record.segment)) << "a segment's number";
      ASSERT_EQ(registry_.fibers().groupOf(registry_.find(object)), record.group)
          << "a fiber's group";
    }

    // As a tree is given them, all and from where a fiber begins: in order, one after the other.
    ASSERT_EQ(registry_.fibers().idCount(), registry_.idCount());
    const std::size_t count = registry_.fibers().fiberCount();
    for (std::size_t from = 0; from <= count; from += 1 + count / 3) {
      const SegmentId begin = from < count ? registry_.fibers().beginOf(from) : registry_.idCount();
      const tree::Fibers fibers = registry_.fibersFrom(begin, [](SegmentId) { return true; });
      ASSERT_EQ(fibers.begin.front(), 0);
      ASSERT_EQ(fibers.begin.back(), static_cast<std::int32_t>(fibers.ids.size()));
      tree::SegmentIds ids;
      for (const auto& entry : expected) {
        const SegmentId id = registry_.find(entry.first);
        if (id >= begin) ids.push_back(id);
      }
      ASSERT_EQ(fibers.ids, ids);
      std::set<std::size_t> seen;
      for (std::size_t f = 0; f + 1 < fibers.begin.size(); ++f) {
        if (fibers.begin[f] == fibers.begin[f + 1]) continue;
        const auto idOf = [&](std::int32_t i) { return fibers.ids[static_cast<std::size_t>(i)]; };
        const std::size_t number = registry_.fibers().placeOf(idOf(fibers.begin[f])).fiber;
        ASSERT_TRUE(seen.insert(number).second) << "a fiber has come apart";
        for (std::int32_t i = fibers.begin[f]; i < fibers.begin[f + 1]; ++i) {
          ASSERT_EQ(registry_.fibers().placeOf(idOf(i)).fiber, number)
              << "two fibers have become one";
          ASSERT_EQ(fibers.groups.empty() ? tree::kNoGroup : fibers.groups[f],
                    registry_.fibers().groupOf(idOf(i)));
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
        const fibers::FiberTable& fibers = registry_.fibers();
        ASSERT_EQ(fibers.shareGroup(a, b), p.group != tree::kNoGroup && p.group == q.group);
        const bool neighbors =
            reach_ > 0 && p.fiber == q.fiber && p.is_declared && q.segment - p.segment <= reach_;
        ASSERT_EQ(fibers.areNeighbors(a, b), neighbors)
            << p.fiber << ' ' << p.segment << ' ' << q.segment;
        ASSERT_EQ(fibers.areNeighbors(b, a), neighbors)
            << p.fiber << ' ' << p.segment << ' ' << q.segment;
      }
    }
  }

  const Stock& stock_;
  SegmentId reach_;
  Registry registry_;
  std::map<Object*, Record> records_;
  int order_ = 0, fibers_ = 0;
};

TEST(ObjectRegistry, IsTheModelUnderRandomUse) {
  // If this fails, some sequence of registering and unregistering loses an object or its place,
  // ignores neighbours across the ends of fibers or in guessed ones, or outlives clear().
  const std::vector<SegmentId> reaches{0, 1, 2, 5};
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
    Random random(seed);
    const Stock stock(400);
    Model model(stock, reaches[seed - 1]);
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
        std::vector<std::uint8_t> starts = oneFiber(added.size());
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

TEST(ObjectRegistry, ADuplicateChangesNothing) {
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

TEST(ObjectRegistry, ACopyHasOtherObjectsInTheirPlaces) {
  // If this fails, a clone has lost numbers, neighbours, arcs or groups, or finds the original's
  // objects.
  const Stock stock(220), others(220);
  const fibers::NeighborRule rule(1, 7);
  Registry original(rule);
  const auto add = [&](std::size_t begin, std::size_t end, const Kind& kind) {
    ASSERT_FALSE(original.add(stock.range(begin, end), oneFiber(end - begin), kind,
                              std::vector<double>(end - begin, 2)));
  };
  for (std::size_t i = 0; i < 150; ++i) add(i, i + 1, {true, false, 0});
  add(150, 160, {true, true, 5});
  add(160, 190, {true, false, 5});
  add(190, 200, {});
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
  Registry copy(rule);
  ASSERT_FALSE(copy.copy(original, objects));
  ASSERT_EQ(copy.size(), original.size());
  ASSERT_EQ(copy.objects().size(), original.objects().size());
  std::size_t neighbors = 0;
  const auto expectAlike = [&](std::size_t added) {
    for (std::size_t i = 0; i < 200 + added; ++i) {
      const SegmentId id = original.find(stock[i]);
      ASSERT_EQ(copy.find(others[i]), id) << i;
      ASSERT_EQ(copy.find(stock[i]), Registry::kNotFound);
      if (id == Registry::kNotFound) continue;
      EXPECT_EQ(copy.objects()[static_cast<std::size_t>(id)], others[i]);
      const fibers::FiberTable &ours = copy.fibers(), &theirs = original.fibers();
      EXPECT_EQ(ours.placeOf(id).fiber, theirs.placeOf(id).fiber);
      EXPECT_EQ(ours.placeOf(id).number, theirs.placeOf(id).number);
      EXPECT_EQ(ours.groupOf(id), theirs.groupOf(id));
      for (std::size_t j = i; j < 200 + added; ++j) {
        const SegmentId other = original.find(stock[j]);
        if (other == Registry::kNotFound) continue;
        ASSERT_EQ(ours.areNeighbors(id, other), theirs.areNeighbors(id, other));
        ASSERT_EQ(ours.shareGroup(id, other), theirs.shareGroup(id, other));
        neighbors += ours.areNeighbors(id, other) && id != other;
      }
    }
  };
  expectAlike(0);
  EXPECT_GT(neighbors, 30u);
  // What comes after goes on alike.
  for (Registry* registry : {&original, &copy}) {
    const Stock& of = registry == &original ? stock : others;
    registry->add(of.range(200, 210), oneFiber(10), {true, false, 6}, std::vector<double>(10, 1));
    for (std::size_t i = 180; i < 190; ++i) registry->remove(of[i]);
  }
  expectAlike(10);

  objects.resize(39);
  objects[30] = objects[2];
  Registry twice(rule);
  Registry source(0);
  source.add(stock.range(0, 39), oneFiber(39), {true, false, 0});
  EXPECT_EQ(twice.copy(source, objects), std::optional<std::size_t>(30));
}

TEST(ObjectRegistry, ArcsAndClosedFibersSurviveRenumbering) {
  // If this fails, a fiber that moved up in the order is measured along another one.
  const Stock stock(400);
  // Reach, arc length, and which of the pairs below are neighbours then.
  struct Rule {
    fibers::NeighborRule rule;
    bool around_one, around_two, arc_of_four, arc_of_six;
  };
  for (const Rule& expected : {Rule{1, true, false, false, false},
                               {2, true, true, false, false},
                               {{0, 3.9}, true, true, false, false},
                               {{0, 4}, true, true, true, false},
                               {{0, 5.9}, true, true, true, false},
                               {{0, 6}, true, true, true, true},
                               {{5, 100}, true, true, true, true}}) {
    SCOPED_TRACE(testing::Message() << expected.rule.reach << ", " << expected.rule.arc_length);
    Registry registry(expected.rule);
    const auto add = [&](std::size_t begin, std::size_t end, const Kind& kind, double length) {
      ASSERT_FALSE(registry.add(stock.range(begin, end), oneFiber(end - begin), kind,
                                std::vector<double>(end - begin, length)));
    };
    for (std::size_t i = 0; i < 300; ++i) add(i, i + 1, {true, false, 0}, 7);
    add(300, 310, {true, true, 0}, 2);
    add(310, 320, {true, false, 0}, 3);
    const auto expectRules = [&] {
      const auto areNeighbors = [&](SegmentId a, SegmentId b) {
        EXPECT_EQ(registry.fibers().areNeighbors(a, b), registry.fibers().areNeighbors(b, a));
        return registry.fibers().areNeighbors(a, b);
      };
      const SegmentId ring = registry.find(stock[300]), open = registry.find(stock[310]);
      EXPECT_EQ(areNeighbors(ring, ring + 9), expected.around_one);
      EXPECT_EQ(areNeighbors(ring + 9, ring + 1), expected.around_two);
      EXPECT_EQ(areNeighbors(ring, ring + 8), expected.around_two);
      // Two segments of length 2 lie between ring + 8 and ring + 1.
      EXPECT_EQ(areNeighbors(ring + 8, ring + 1), expected.arc_of_four);
      EXPECT_EQ(areNeighbors(open + 2, open + 5), expected.arc_of_six);
      EXPECT_EQ(areNeighbors(open, open + 9), expected.rule.arc_length > 24);
      EXPECT_FALSE(areNeighbors(ring + 9, open)) << "the ends of two fibers";
    };
    expectRules();
    for (std::size_t i = 0; i < 300; ++i) registry.remove(stock[i]);
    ASSERT_LT(registry.find(stock[300]), 300) << "the ids have not moved, so nothing was tried";
    expectRules();
  }
}

TEST(ObjectRegistry, AddingOneByOneIsLinear) {
  // If this fails, each registration moves all objects that are there.
  const Stock stock(20000);
  for (const SegmentId reach : {0, 1}) {
    Registry registry(reach);
    std::set<std::size_t> sizes, capacities;
    for (std::size_t i = 0; i < stock.size(); ++i) {
      ASSERT_FALSE(registry.add({stock[i]}, {true}, {}));
      sizes.insert(registry.memoryUsage());
      capacities.insert(registry.objects().capacity());
    }
    // Powers of one and a half.
    EXPECT_LE(capacities.size(), 27u);
    EXPECT_LE(sizes.size(), 5 * 27u);
    EXPECT_EQ(registry.size(), stock.size());
  }
}

TEST(ObjectRegistry, RemovingOneByOneIsLinear) {
  // If this fails, each removal renumbers all objects. (A renumbering shows as fewer ids.)
  const Stock stock(20000);
  Registry registry(0);
  ASSERT_FALSE(registry.add(stock.range(0, stock.size()),
                            std::vector<std::uint8_t>(stock.size(), true), {}));
  int renumberings = 0;
  std::size_t ids = registry.objects().size();
  for (std::size_t i = 0; i < stock.size(); ++i) {
    const bool stays = registry.remove(stock[i]);
    if (registry.objects().size() < ids) {
      ++renumberings;
      EXPECT_FALSE(stays);
    }
    ids = registry.objects().size();
    ASSERT_LE(ids, 2 * registry.size() + 130);
  }
  EXPECT_LE(renumberings, 20);
  EXPECT_EQ(registry.size(), 0u);
}

TEST(ObjectRegistry, LooksUpAtAnyTime) {
  // If this fails, the first lookup of an object misses what was registered before it or later, a
  // scene that never looks up pays for it, or two threads that look up first disturb each other.
  const Stock stock(2000);
  for (const std::size_t asked_after : {0u, 1u, 700u, 2000u}) {
    Registry registry(fibers::NeighborRule{2});
    std::size_t count = 0;
    const auto addUpTo = [&](std::size_t end) {
      const std::size_t call = count % 3 + 1;
      while (count < end) {
        const std::size_t last = std::min(end, count + call);
        const Objects added = stock.range(count, last);
        ASSERT_FALSE(registry.add(added, oneFiber(added.size()), {}));
        count = last;
      }
    };
    addUpTo(asked_after);
    EXPECT_EQ(registry.find(stock[stock.size() - 1]), asked_after == stock.size()
                                                          ? static_cast<SegmentId>(stock.size() - 1)
                                                          : Registry::kNotFound);
    const std::size_t before = registry.memoryUsage();
    std::vector<std::thread> threads;
    for (int t = 0; t < 2; ++t) {
      threads.emplace_back([&] {
        for (std::size_t i = 0; i < stock.size(); ++i) {
          EXPECT_EQ(registry.find(stock[i]),
                    i < asked_after ? static_cast<SegmentId>(i) : Registry::kNotFound);
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    if (asked_after == 700) {
      EXPECT_GE(registry.memoryUsage(), before + asked_after * sizeof(SegmentId));
    }
    addUpTo(stock.size());
    for (std::size_t i = 0; i < stock.size(); ++i) {
      ASSERT_EQ(registry.find(stock[i]), static_cast<SegmentId>(i));
    }
    // A call that is refused changes nothing.
    registry.remove(stock[5]);
    const Objects refused = {stock[5], stock[6]};
    EXPECT_EQ(registry.add(refused, oneFiber(2), {}), std::optional<std::size_t>(1));
    EXPECT_EQ(registry.find(stock[5]), Registry::kNotFound);
    EXPECT_EQ(registry.find(stock[6]), 6);
  }
}

}  // namespace
}  // namespace fcl_fibers::broadphase
