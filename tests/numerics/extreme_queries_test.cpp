// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/live_pairs.h>

#include "numerics/row_judge.h"

namespace fcl_fibers::test {
namespace {

/// The number of a row. Every question but that for pairs is asked about each.
class ExtremeQueries : public testing::TestWithParam<std::size_t> {};

template <typename S>
void expectContact(const Judge<S>& judge, const Contact& contact) {
  expectContact(judge, judge.numberOf(contact.pair.a), judge.numberOf(contact.pair.b), contact);
}

template <typename S>
void expectContacts(const Judge<S>& judge) {
  Real most = kInfinity;
  for (std::size_t i = 0; i < judge.exact.size(); ++i) {
    for (std::size_t j = i + 1; j < judge.exact.size(); ++j) {
      most = std::min(most, judge.distance(i, j) + judge.errorOf(i, j));
    }
  }
  for (const FiberTreeOptions& options : capsuleKinds(judge.row.margin)) {
    SCOPED_TRACE(describe(Form::kArrays, options));
    if (judge.isTooLarge()) {
      const auto asked = [&] {
        treeOf(judge.fibers, options).closest(Contacts{judge.fibers.view()});
      };
      EXPECT_THAT(asked, testing::ThrowsMessage<std::invalid_argument>(
                             testing::HasSubstr("beyond 2^1000")));
      continue;
    }
    std::vector<SegmentPair> pairs;
    std::vector<Contact> contacts;
    Contact closest;
    judge.ask([&] {
      const FiberTree tree = treeOf(judge.fibers, options);
      tree.find(Pairs{}, pairs);
      tree.find(Contacts{judge.fibers.view()}, contacts);
      closest = tree.closest(Contacts{judge.fibers.view()});
    });
    judge.check(options, pairs, "pairs");
    ASSERT_EQ(contacts.size(), pairs.size());
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      ASSERT_TRUE(contacts[k].pair.a == pairs[k].a && contacts[k].pair.b == pairs[k].b);
      ASSERT_NO_FATAL_FAILURE(expectContact(judge, contacts[k]));
    }
    ASSERT_NO_FATAL_FAILURE(expectContact(judge, closest));
    const std::size_t i = judge.numberOf(closest.pair.a), j = judge.numberOf(closest.pair.b);
    EXPECT_LE(closest.distance, most + judge.errorOf(i, j));
  }
}

/// Of each segment the nearest other one, whatever its distance and if it overlaps.
template <typename S>
void expectNearest(const Judge<S>& judge) {
  const std::size_t count = judge.exact.size();
  const Real extent = 2 * judge.half.norm();
  std::vector<Real> least(count, kInfinity);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < count; ++k) {
      if (k != i) least[i] = std::min(least[i], judge.distance(i, k));
    }
  }
  for (const FiberTreeOptions& options : capsuleKinds(judge.row.margin)) {
    SCOPED_TRACE(describe(Form::kArrays, options));
    for (const double limit : {0.0, kInfinity}) {
      std::vector<SegmentPair> pairs;
      judge.ask([&] { treeOf(judge.fibers, options).find(Nearest{limit}, pairs); });
      std::vector<int> found(count);
      for (const SegmentPair& pair : pairs) {
        const std::size_t i = judge.numberOf(pair.a), j = judge.numberOf(pair.b);
        ASSERT_NE(i, j);
        EXPECT_EQ(++found[i], 1);
        const Real error = 0x1p-42L * judge.sizeOf(i, j) + 0x1p-45L * extent + judge.least;
        ASSERT_LE(judge.distance(i, j), limit + error);
        ASSERT_LE(judge.distance(i, j), least[i] + error) << i << ", " << j;
      }
      for (std::size_t i = 0; i < count; ++i) {
        ASSERT_TRUE(found[i] == 1 || least[i] > limit) << i;
      }
    }
  }
}

/// The row, every other fiber moved along an axis.
template <typename S>
Assembly<S> displaced(const Judge<S>& judge, double times) {
  const double size = usualSize(judge);
  Assembly<S> fibers = judge.fibers;
  for (std::size_t f = 0; f < fibers.fiberCount(); f += 2) {
    for (std::size_t i = fibers.point_begin[f]; i < fibers.point_begin[f + 1]; ++i) {
      S& y = fibers.points[3 * i + 1];
      y = static_cast<S>(y + times * size);
    }
  }
  return fibers;
}

template <typename S>
void expectImpacts(const Judge<S>& judge) {
  const Assembly<S> away = displaced(judge, 2);
  for (const FiberTreeOptions& options : capsuleKinds(judge.row.margin)) {
    if (!isOfBoxes(options)) continue;
    SCOPED_TRACE(describe(Form::kArrays, options));
    std::vector<Impact> impacts, at_rest;
    judge.ask([&] {
      FiberTree tree = treeOf(judge.fibers, options);
      tree.update(away.view(), judge.fibers.view());
      tree.find(Impacts{}, impacts);
      tree.update(judge.fibers.view(), judge.fibers.view());
      tree.find(Impacts{}, at_rest);
    });
    std::vector<NumberPair> pairs;
    for (const Impact& impact : impacts) {
      EXPECT_TRUE(impact.time >= 0 && impact.time <= 1) << impact.time;
      pairs.push_back({static_cast<std::int32_t>(judge.numberOf(impact.pair.a)),
                       static_cast<std::int32_t>(judge.numberOf(impact.pair.b))});
    }
    const Findings findings = examine(judge.truth, judge.touching(), options, std::move(pairs));
    EXPECT_EQ(findings.missed + findings.repeated, 0u) << findings.first_wrong;
    pairs.clear();
    for (const Impact& impact : at_rest) {
      EXPECT_EQ(impact.time, 0);
      pairs.push_back({static_cast<std::int32_t>(judge.numberOf(impact.pair.a)),
                       static_cast<std::int32_t>(judge.numberOf(impact.pair.b))});
    }
    expectAtRest(judge, options, pairs, judge.touching());
  }
}

/// Every other fiber goes through the others along one axis, and is in its place at half the time.
template <typename S>
void expectImpactsOnTheWay(const Judge<S>& judge) {
  const Assembly<S> start = displaced(judge, 4), end = displaced(judge, -4);
  for (const FiberTreeOptions& options : capsuleKinds(judge.row.margin)) {
    if (!isOfBoxes(options)) continue;
    SCOPED_TRACE(describe(Form::kArrays, options));
    std::vector<Impact> impacts;
    judge.ask([&] {
      FiberTree tree = treeOf(judge.fibers, options);
      tree.update(start.view(), end.view());
      tree.find(Impacts{}, impacts);
    });
    PairTimes times;
    for (const Impact& impact : impacts) {
      const std::size_t i = judge.numberOf(impact.pair.a), j = judge.numberOf(impact.pair.b);
      EXPECT_TRUE(times.emplace(std::minmax(i, j), impact.time).second) << "twice";
    }
    expectTimes(judge, start.capsules(), end.capsules(), times,
                [](std::size_t, std::size_t) { return true; });
  }
}

/// Away by less than the skin and by more, and back; and with the skin that is chosen.
template <typename S>
void expectLivePairs(const Judge<S>& judge) {
  const Assembly<S> near = displaced(judge, 0.7), far = displaced(judge, -3);
  const Judge<S> of_near(judge.row, near), of_far(judge.row, far);
  for (const FiberTreeOptions& options : capsuleKinds(judge.row.margin)) {
    if (!isOfBoxes(options)) continue;
    SCOPED_TRACE(describe(Form::kArrays, options));
    for (const double skin : {-1.0, 2 * usualSize(judge)}) {
      FiberTree tree = judge.ask([&] { return treeOf(judge.fibers, options); });
      LivePairs live(tree, LivePairsOptions{skin});
      for (const Judge<S>* now : {&judge, &judge, &of_near, &judge, &of_far, &of_near, &judge}) {
        std::vector<SegmentPair> pairs;
        judge.ask([&] {
          tree.update(now->fibers.view());
          live.update();
          live.find(pairs);
        });
        now->check(options, pairs, "live pairs");
      }
    }
  }
}

/// Every number that a tree answers with, in its order.
template <typename S>
std::vector<double> answersOf(const Judge<S>& judge, const Assembly<S>& fibers,
                              const FiberTreeOptions& options) {
  std::vector<double> numbers;
  const auto keep = [&](const auto&... all) { (numbers.push_back(static_cast<double>(all)), ...); };
  Assembly<S> start = fibers;
  for (std::size_t i = 1; i < start.points.size(); i += 3) start.points[i] /= 2;
  std::vector<Contact> contacts;
  std::vector<SegmentPair> pairs, nearest;
  std::vector<Impact> impacts;
  judge.ask([&] {
    FiberTree tree = treeOf(fibers, options);
    tree.find(Pairs{}, pairs);
    tree.find(Nearest{}, nearest);
    if (!judge.isTooLarge()) tree.find(Contacts{fibers.view()}, contacts);
    if (!isOfBoxes(options)) return;
    tree.update(start.view(), fibers.view());
    tree.find(Impacts{}, impacts);
  });
  for (const SegmentPair& pair : pairs) keep(pair.a, pair.b);
  for (const SegmentPair& pair : nearest) keep(pair.a, pair.b);
  for (const Contact& contact : contacts) {
    keep(contact.pair.a, contact.pair.b, contact.distance, contact.s, contact.t);
    for (std::size_t k = 0; k < 3; ++k) {
      keep(contact.point_a[k], contact.point_b[k], contact.normal[k]);
    }
  }
  for (const Impact& impact : impacts) keep(impact.pair.a, impact.pair.b, impact.time);
  return numbers;
}

/// That radii of points which are the same at both ends of each segment change no bit.
template <typename S>
void expectEqualRadiiToBeOne(const Judge<S>& judge) {
  using Radii = typename Assembly<S>::Radii;
  Assembly<S> alone, alone_by_point;
  for (const GivenCapsule& c : judge.fibers.capsules()) alone.addCapsule(c.a, c.b, c.radius);
  alone_by_point = alone;
  alone_by_point.radii_are = Radii::kPerPoint;
  for (const FiberTreeOptions& options : capsuleKinds(judge.row.margin)) {
    SCOPED_TRACE(describe(Form::kArrays, options));
    EXPECT_TRUE(answersOf(judge, alone, options) == answersOf(judge, alone_by_point, options));
  }
}

template <typename S>
void expectAll(std::size_t number) {
  const ExtremeRow<S>& row = extremeRows<S>()[number];
  if (!row.environment.isPossible()) {
    GTEST_SKIP() << "no SSE2, which flushes subnormals to zero";
  }
  Judge<S> judge(row);
  judge.measureAll();
  expectContacts(judge);
  expectNearest(judge);
  expectImpacts(judge);
  expectImpactsOnTheWay(judge);
  expectLivePairs(judge);
  expectEqualRadiiToBeOne(judge);
}

// Contacts, nearest segments, impacts or live pairs would be wrong where pairs are right.
TEST_P(ExtremeQueries, Float) { expectAll<float>(GetParam()); }
TEST_P(ExtremeQueries, Double) { expectAll<double>(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Rows, ExtremeQueries,
                         testing::Range(std::size_t{0}, extremeRows<double>().size()),
                         [](const testing::TestParamInfo<std::size_t>& info) {
                           return extremeRows<double>()[info.param].name;
                         });

}  // namespace
}  // namespace fcl_fibers::test
