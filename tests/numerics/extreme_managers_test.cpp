// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fcl_fibers/contact_collector.h>
#include <fcl_fibers/impact_collector.h>

#include "numerics/row_copies.h"
#include "numerics/row_judge.h"
#include "numerics/row_meshes.h"
#include "numerics/row_objects.h"
#include "support/mesh_models.h"

namespace fcl_fibers::test {
namespace {

/// The number of a row. What a tree is asked in other tests is asked of managers here.
class ExtremeManagers : public testing::TestWithParam<std::size_t> {};

auto isRefusal() {
  return testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("beyond 2^1000"));
}

// What a ContactCollector does with a pair, which would compile FCL's narrow phase as well.
template <typename S>
void expectContacts(const ObjectRow<S>& row, const Way& way) {
  std::vector<std::pair<NumberPair, Contact>> contacts;
  const auto collect = [&] {
    row.judge.ask([&] {
      for (const auto& [a, b] : Managers<S>(row, way).pairs()) {
        contacts.emplace_back(row.numbersOf(a, b), capsuleContact(*a, *b));
      }
    });
  };
  if (row.judge.isTooLarge()) {
    EXPECT_THAT(collect, isRefusal());
    return;
  }
  collect();
  std::vector<NumberPair> pairs;
  for (const auto& [pair, contact] : contacts) {
    pairs.push_back(pair);
    const auto i = static_cast<std::size_t>(pair.a), j = static_cast<std::size_t>(pair.b);
    // The poses have half as large an error again.
    ASSERT_NO_FATAL_FAILURE(expectContact(row.judge, i, j, contact, 1.5L));
  }
  row.judge.check(way.options, pairs, way.touching(row), "contacts");
}

/// Of pairs nearer than a limit, and of the nearest one.
template <typename S>
void expectDistances(const ObjectRow<S>& row, const Way& way) {
  struct Search {
    const ObjectRow<S>& row;
    bool lowers;
    S limit;
    std::vector<NumberPair> handed;
  };
  const Judge<S>& judge = row.judge;
  for (const bool lowers : {false, true}) {
    Search search{row, lowers, lowers ? std::numeric_limits<S>::max() : S(row.size), {}};
    judge.ask([&] {
      Managers<S>(row, way).distance(&search, [](auto* a, auto* b, void* data, S& distance) {
        auto& [asked, does_lower, limit, handed] = *static_cast<Search*>(data);
        const Real now = asked.judge.distance(asked.numberOf(a), asked.numberOf(b));
        if (does_lower) limit = std::min(limit, static_cast<S>(std::max(now, Real(0))));
        handed.push_back(asked.numbersOf(a, b));
        distance = limit;
        return false;
      });
    });
    std::set<std::pair<std::size_t, std::size_t>> found;
    const Real extent = 2 * judge.half.norm();
    for (const NumberPair& pair : search.handed) {
      const auto i = static_cast<std::size_t>(pair.a), j = static_cast<std::size_t>(pair.b);
      const bool is_first = found.empty();  // before the callback has told a limit
      EXPECT_TRUE(found.insert(std::minmax(i, j)).second) << "twice " << i << ", " << j;
      EXPECT_TRUE(way.isAsked(row, i, j) && i != j);
      const bool may_be_far = lowers || way.options.report == Report::kVolumes;
      if (is_first || may_be_far || judge.vanishes()) continue;
      const Real error = 256 * kEps * (extent + judge.sizeOf(i, j)) + judge.least;
      EXPECT_LE(judge.distance(i, j), search.limit + error) << i << ", " << j;
    }
    // At no distance a search ends.
    if (judge.isZero(search.limit)) continue;
    const Real rounding = std::numeric_limits<S>::epsilon() * Real(search.limit);
    for (std::size_t i = 0; i < row.objects.size(); ++i) {
      for (std::size_t j = i + 1; j < row.objects.size(); ++j) {
        const Real error = judge.errorOf(i, j) + rounding;
        if (!way.isAsked(row, i, j) || judge.distance(i, j) + error >= search.limit) continue;
        EXPECT_TRUE(found.count({i, j})) << "missed " << i << ", " << j;
      }
    }
  }
}

/// Every other fiber goes through the others, and then all rest.
template <typename S>
void expectImpacts(ObjectRow<S>& row, const Way& way) {
  const Judge<S>& judge = row.judge;
  row.move(4);
  const std::vector<GivenCapsule> start = row.specimen.capsules();
  Managers<S> managers = judge.ask([&] { return Managers<S>(row, way, true); });
  const auto impactsAt = [&](double times) {
    judge.ask([&] { managers.both([](auto& manager) { manager.beginStep(); }); });
    row.move(times);
    return judge.ask([&] {
      managers.both([](auto& manager) { manager.update(); });
      ImpactCollector<S> collector(*managers.first, managers.second.get());
      managers.collide(&collector, collector.callback);
      return collector.impacts();
    });
  };
  PairTimes times;
  for (const ObjectImpact<S>& impact : impactsAt(-4)) {
    const std::size_t i = row.numberOf(impact.object_a), j = row.numberOf(impact.object_b);
    EXPECT_TRUE(impact.time >= 0 && impact.time <= 1) << impact.time;
    const double time = impact.has_time ? impact.time : 2;
    EXPECT_TRUE(times.emplace(std::minmax(i, j), time).second) << "twice " << i << ", " << j;
  }
  expectTimes(judge, start, row.specimen.capsules(), times,
              [&](std::size_t i, std::size_t j) { return way.isAsked(row, i, j); });
  impactsAt(0);
  std::vector<NumberPair> at_rest;
  for (const ObjectImpact<S>& impact : impactsAt(0)) {
    EXPECT_EQ(impact.time, 0);
    at_rest.push_back(row.numbersOf(impact.object_a, impact.object_b));
  }
  expectAtRest(judge, way.options, at_rest, way.touching(row));
}

/// Every other fiber moves by less than the skin and by more, and back; also if it is chosen.
template <typename S>
void expectLivePairs(ObjectRow<S>& row, const Way& way) {
  const Judge<S>& judge = row.judge;
  for (const double skin : {-1.0, 2 * row.size}) {
    if (judge.isZero(skin)) continue;
    row.move(0);
    Managers<S> managers = judge.ask([&] { return Managers<S>(row, way, false, skin); });
    for (const double times : {0.0, 0.0, 0.7, 0.0, -3.0, 0.7, 0.0}) {
      const Judge<S>& now = row.moved(times);
      std::vector<LiveObjectPair<S>> live;
      Calls<S> calls;
      judge.ask([&] {
        managers.first->update();
        managers.first->findLivePairs(live);
        calls = managers.pairs();
      });
      std::vector<NumberPair> pairs, queried;
      for (const auto& pair : live) pairs.push_back(row.numbersOf(pair.a, pair.b));
      for (const auto& [a, b] : calls) queried.push_back(row.numbersOf(a, b));
      now.check(way.options, pairs, now.touching(), "live pairs");
      std::sort(pairs.begin(), pairs.end());
      std::sort(queried.begin(), queried.end());
      EXPECT_TRUE(pairs == queried);
    }
  }
}

/// Triangles and a solid among the objects; of two managers each has them for the other's objects.
template <typename S>
void expectMeshes(const ObjectRow<S>& row, const Way& way) {
  using Object = fcl::CollisionObject<S>;
  const MeshInRow<S> shapes[] = {trianglesIn(row.judge), tetrahedronIn(row.judge)};
  const auto triangles = makeModel<S>(fcl::BV_AABB, shapes[0].shape());
  const auto solid = makeModel<S>(fcl::BV_AABB, shapes[1].shape());
  Object in_first[] = {Object(triangles), Object(solid)};
  Object in_second[] = {Object(triangles), Object(solid)};
  std::set<std::pair<std::size_t, std::size_t>> found[2];
  const auto collect = [&] {
    row.judge.ask([&] {
      Managers<S> managers(row, way);
      managers.both([&](auto& manager) {
        Object* const meshes = &manager == managers.second.get() ? in_second : in_first;
        manager.registerObstacle(&meshes[0]);
        manager.registerObstacle(&meshes[1], ObstacleOptions{true});
      });
      std::vector<MeshContact> contacts;
      for (auto [a, b] : managers.pairs()) {
        if (isCapsule(*a) == isCapsule(*b)) continue;
        if (isCapsule(*b)) std::swap(a, b);
        const auto& its = managers.first->isRegistered(b) ? managers.first : managers.second;
        const bool is_solid = b->collisionGeometry() == solid;
        its->findMeshContacts(a, b, row.judge.row.margin, contacts);
        for (const MeshContact& contact : contacts) {
          const auto triangle = static_cast<std::size_t>(contact.triangle);
          EXPECT_TRUE(found[is_solid].emplace(row.numberOf(a), triangle).second) << "twice";
        }
      }
    });
  };
  if (row.judge.isTooLarge()) {
    EXPECT_THAT(collect, isRefusal());
    return;
  }
  collect();
  for (const bool is_solid : {false, true}) {
    SCOPED_TRACE(is_solid ? "solid" : "triangles");
    for (std::size_t i = 0; i < row.objects.size(); ++i) {
      expectTouching(row.judge, i, shapes[is_solid], is_solid, found[is_solid]);
    }
  }
}

/// Copies of the row: several threads find what one finds, in the same order.
template <typename S>
void expectThreads(const ExtremeRow<S>& row, FiberTreeOptions options) {
  const Copies<S> copies(row.fibers, row.margin, 2);
  // All would be one point, or some be out of range.
  if (row.name == "SubnormalFlushedToZero" || !copies.is_possible) return;
  const Specimen<S> specimen(copies.all, Form::kObjects);
  std::vector<NumberPair> pairs[2];
  for (const int k : {0, 1}) {
    options.threads = 1 + 2 * k;
    const ScopedFloatEnvironment scoped(row.environment);
    pairs[k] = specimen.pairs(options);
  }
  EXPECT_FALSE(pairs[0].empty() && row.name != "ContactPlus1Ulp");
  EXPECT_TRUE(pairs[0] == pairs[1]) << pairs[0].size() << ", " << pairs[1].size();
}

template <typename S>
void expectAll(std::size_t number) {
  const ExtremeRow<S>& extreme = extremeRows<S>()[number];
  if (!extreme.environment.isPossible()) {
    GTEST_SKIP() << "no SSE2, which flushes subnormals to zero";
  }
  ObjectRow<S> row(extreme);
  for (const FiberTreeOptions& options : allKinds(extreme.margin)) {
    // Of each volume one topology; the pairs of both are asked for elsewhere.
    if (isOfBoxes(options) != (options.topology == Topology::kBundle)) continue;
    for (const bool are_two : {false, true}) {
      const Way way{options, are_two};
      SCOPED_TRACE(describe(Form::kObjects, options) + (are_two ? ", two" : ""));
      row.move(0);
      expectContacts(row, way);
      expectDistances(row, way);
      if (options.report == Report::kVolumes) continue;
      expectMeshes(row, way);
      // Only boxes know motion and a skin.
      if (isOfBoxes(options)) expectImpacts(row, way);
      if (isOfBoxes(options) && !are_two) expectLivePairs(row, way);
    }
    if (options.report == Report::kCapsules) expectThreads(extreme, options);
  }
}

// Managers would answer at an extreme other than trees, or two of them by the wrong margin.
TEST_P(ExtremeManagers, Float) { expectAll<float>(GetParam()); }
TEST_P(ExtremeManagers, Double) { expectAll<double>(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Rows, ExtremeManagers, testing::Range(std::size_t{0}, rowsOfObjects()),
                         [](const testing::TestParamInfo<std::size_t>& info) {
                           return extremeRows<double>()[info.param].name;
                         });

}  // namespace
}  // namespace fcl_fibers::test
