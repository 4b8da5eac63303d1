// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <tuple>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/array_fibers.h"
#include "arrays/meshes.h"

namespace fcl_fibers::test {
namespace {

FiberTree treeOf(const Assembly<double>& fibers, int threads = 1) {
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = 1;
  options.threads = threads;
  FiberTree tree(options);
  tree.build(fibers.view());
  return tree;
}

std::tuple<std::int32_t, std::int32_t> numbersOf(const SegmentPair& p) { return {p.a, p.b}; }
std::tuple<std::int32_t, std::int32_t> numbersOf(const TrianglePair& p) {
  return {p.segment, p.triangle};
}
std::tuple<std::int32_t> numbersOf(std::int32_t segment) { return {segment}; }

/// Finds in the order of the search, sorts by the keys of the pairs, and compares.
template <class Partner, class KeyOf>
void expectOrder(const FiberTree& tree, const Partner& partner, Order order, const KeyOf& keyOf) {
  std::vector<FoundBy<Pairs, Partner>> expected, found(3);
  tree.find(Pairs{Order::kFound}, partner, expected);
  const auto comesBefore = [&](const auto& p, const auto& q) { return keyOf(p) < keyOf(q); };
  EXPECT_FALSE(std::is_sorted(expected.begin(), expected.end(), comesBefore));
  std::sort(expected.begin(), expected.end(), comesBefore);
  tree.find(Pairs{order}, partner, found);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    ASSERT_EQ(numbersOf(found[i]), numbersOf(expected[i])) << i;
  }
  std::size_t next = 0;
  EXPECT_TRUE(tree.visit(Pairs{order}, partner, [&](const auto& pair) {
    EXPECT_EQ(numbersOf(pair), numbersOf(expected[next]));
    return ++next == 10;
  }));
  EXPECT_EQ(next, 10u);
}

template <class Partner>
void expectBySegments(const FiberTree& tree, const Partner& partner, Order order) {
  expectOrder(tree, partner, order, [](const auto& found) { return numbersOf(found); });
}

void expectByFibers(const FiberTree& tree, const FiberTree& other) {
  expectOrder(tree, other, Order::kFibers, [&](const SegmentPair& pair) {
    return std::tuple(tree.fiberSegment(pair.a).fiber, other.fiberSegment(pair.b).fiber, pair.a,
                      pair.b);
  });
}

// A solver that relies on the order would depend on the tree.
TEST(PairOrder, IsThatOfSegmentsOrFibers) {
  for (const int fiber_count : {20, 200}) {  // few pairs and many, which are sorted by digits
    const auto fibers = curledFibers<double>(61, fiber_count);
    const auto theirs = curledFibers<double>(62, fiber_count + 7);
    const TriangleMesh mesh(soup<double>(63, 400, 0.5).view());
    for (const int threads : {1, 2}) {
      const FiberTree tree = treeOf(fibers, threads), other = treeOf(theirs, threads);
      expectBySegments(tree, tree, Order::kSegments);
      expectBySegments(tree, other, Order::kSegments);
      expectByFibers(tree, tree);
      expectByFibers(tree, other);
      for (const Order order : {Order::kSegments, Order::kFibers}) {
        expectBySegments(tree, mesh, order);
        expectBySegments(tree, CapsuleShape{{-1, 0, 0}, {1, 0, 0}, 0.2}, order);
        expectBySegments(tree, BoxShape{{-0.2, -0.2, -0.2}, {0.2, 0.2, 0.2}}, order);
      }
    }
  }
}

// Fibers and numbers of these need more than 64 bits.
TEST(PairOrder, OfManyFibersAndALongOne) {
  Assembly<double> fibers;
  for (int f = 0; f < 1 << 17; ++f) fibers.endFiber();
  std::vector<std::array<double, 3>> line;
  for (int i = 0; i <= 1 << 16; ++i) line.push_back({0.25 * i, 0, 0});
  fibers.addFiber(line, 0.01);
  for (int f = 0; f < 40; ++f) {
    const double x = 100 - 2 * f;
    fibers.addFiber({{x, -1, 0}, {x + 0.1, 1, 0}, {x + 1.1, -1, 0}}, 0.01);
  }
  const FiberTree tree = treeOf(fibers);
  std::vector<SegmentPair> pairs;
  tree.find(Pairs{}, pairs);
  ASSERT_GT(pairs.size(), 50u);
  expectByFibers(tree, tree);
  expectBySegments(tree, tree, Order::kSegments);
}

// Contacts would be in another order than their pairs, or bare ones would be others.
TEST(ContactOrder, IsThatOfPairs) {
  const auto fibers = curledFibers<double>(64, 100), theirs = curledFibers<double>(65, 80);
  const TriangleMesh mesh(soup<double>(66, 400, 0.5).view());
  const FiberTree tree = treeOf(fibers, 2), other = treeOf(theirs);
  const auto others = theirs.view();
  for (const Order order : {Order::kFound, Order::kSegments, Order::kFibers}) {
    for (const FiberTree* partner : std::vector<const FiberTree*>{&tree, &other}) {
      const Contacts question{fibers.view(), &others, order};
      std::vector<SegmentPair> pairs;
      std::vector<Contact> contacts;
      std::vector<BareContact> bare(2);
      tree.find(Pairs{order}, *partner, pairs);
      tree.find(question, *partner, contacts);
      tree.find(question, *partner, bare);
      ASSERT_EQ(contacts.size(), pairs.size());
      ASSERT_EQ(bare.size(), pairs.size());
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        const Contact& c = contacts[i];
        ASSERT_EQ(numbersOf(c.pair), numbersOf(pairs[i]));
        ASSERT_EQ(numbersOf(bare[i].pair), numbersOf(pairs[i]));
        ASSERT_EQ(c.layout, tree.layout(*partner));
        ASSERT_EQ(std::tie(bare[i].layout, bare[i].s, bare[i].t, bare[i].distance, bare[i].normal),
                  std::tie(c.layout, c.s, c.t, c.distance, c.normal));
      }
    }
    std::vector<TrianglePair> pairs;
    std::vector<MeshContact> contacts;
    tree.find(Pairs{order}, mesh, pairs);
    tree.find(Contacts{fibers.view(), nullptr, order}, mesh, contacts);
    ASSERT_EQ(contacts.size(), pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      ASSERT_EQ(std::tie(contacts[i].segment, contacts[i].triangle),
                std::tie(pairs[i].segment, pairs[i].triangle));
    }
  }
  EXPECT_NE(tree.layout(other), tree.layout());
  EXPECT_NE(tree.layout(other), other.layout(tree));
}

// A pair of fibers would be reported twice, or with contacts of others.
TEST(FiberPairs, HoldAllContactsOfTwoFibers) {
  const auto fibers = curledFibers<double>(67, 100);
  const FiberTree tree = treeOf(fibers);
  std::vector<Contact> contacts;
  tree.find(Contacts{fibers.view(), nullptr, Order::kFibers}, contacts);
  const std::vector<FiberPair> pairs = fiberPairs(contacts);
  std::size_t begin = 0;
  for (const FiberPair& pair : pairs) {
    ASSERT_EQ(pair.begin, begin);
    ASSERT_LT(pair.begin, pair.end);
    begin = pair.end;
    const auto count = static_cast<std::size_t>(std::count_if(
        contacts.begin(), contacts.end(),
        [&](const Contact& c) { return c.a.fiber == pair.a && c.b.fiber == pair.b; }));
    EXPECT_EQ(pair.end - pair.begin, count);
    EXPECT_EQ(pair.count, count);
    for (std::size_t i = pair.begin; i < pair.end; ++i) {
      EXPECT_EQ(contacts[i].a.fiber, pair.a);
      EXPECT_EQ(contacts[i].b.fiber, pair.b);
      EXPECT_GE(contacts[i].distance, contacts[pair.deepest].distance);
      EXPECT_TRUE(i >= pair.deepest || contacts[i].distance > contacts[pair.deepest].distance);
    }
  }
  EXPECT_EQ(begin, contacts.size());
  EXPECT_GT(pairs.size(), 100u);
  EXPECT_LT(pairs.size(), contacts.size());

  EXPECT_TRUE(fiberPairs(std::vector<Contact>()).empty());
  const std::size_t last = pairs.back().begin;
  std::swap(contacts[0], contacts[last]);
  EXPECT_THAT([&] { fiberPairs(contacts); },
              testing::ThrowsMessage<std::invalid_argument>(
                  testing::HasSubstr("contact 1 is not in the order of the fibers")));
  tree.find(Contacts{fibers.view()}, contacts);
  EXPECT_THROW(fiberPairs(contacts), std::invalid_argument);
}

}  // namespace
}  // namespace fcl_fibers::test
