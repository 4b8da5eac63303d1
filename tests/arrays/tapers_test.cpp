// SPDX-License-Identifier: BSD-3-Clause
//
// Fibers with a radius at each point, in all layouts and beside fibers with other radii. Truth is
// brute force, with the distances of tests/support/cone_oracle.h.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <ostream>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/array_fibers.h"
#include "arrays/cones.h"
#include "arrays/meshes.h"
#include "arrays/queries.h"
#include "support/scalars.h"
#include "support/tree_kinds.h"

namespace fcl_fibers {
namespace {

using test::allKinds;
using test::GivenCone;
using test::PairList;
using test::pairsOf;
using test::Random;

/// What the arrays look like.
struct Layout {
  std::size_t gap;  ///< points of no fiber behind some fibers; if it is 0, there are none anywhere
  std::size_t numbers;  ///< of a point, of which the first three are read
  bool has_columns;     ///< whether all x come first, then all y
};
std::ostream& operator<<(std::ostream& out, const Layout& layout) {
  return out << layout.gap << " in gaps, " << layout.numbers << " numbers, "
             << (layout.has_columns ? "columns" : "rows");
}
constexpr std::array<Layout, 4> kLayouts{
    {{0, 3, false}, {2, 3, false}, {0, 4, false}, {3, 3, true}}};

/// Short fibers about one place, thin and thick ones. Some are closed or have a group, a point
/// twice, a tip or a ball that holds the next one.
template <typename S>
class Fibers {
 public:
  using Radii = typename FiberArrays<S>::Radii;

  explicit Fibers(std::uint64_t seed, const Layout& layout = kLayouts[0], int fibers = 20)
      : layout_(layout) {
    Random random(seed);
    std::vector<Eigen::Vector3d> points;
    const double nothing = std::numeric_limits<double>::quiet_NaN();
    for (int f = 0; f < fibers; ++f) {
      const std::size_t count = f % 7 == 3 ? static_cast<std::size_t>(f) / 7 : 2 + random.below(7);
      const bool is_closed = count > 4 && random.below(2) == 0;
      Eigen::Vector3d p = random.inCube(0.3);
      fiber_radii_.push_back(static_cast<S>(random.between(0, 0.04)));
      for (std::size_t i = 0; i < count; ++i) {
        points.push_back(is_closed && i + 1 == count ? points[begin_.back()] : p);
        const double usual[] = {0.01, 0.02, 0.05, 0, 0.2};
        radii.push_back(static_cast<S>(usual[random.below(random.below(3) + 3)]));
        if (random.below(9) != 0) p += random.inCube(0.15);
      }
      end_.push_back(points.size());
      for (std::size_t i = 0; f % 3 == 0 && i < layout.gap; ++i) {
        points.emplace_back(nothing, nothing, nothing);
        radii.push_back(static_cast<S>(nothing));
      }
      begin_.push_back(points.size());
      closed_.push_back(is_closed ? 1 : 0);
      groups_.push_back(f % 4 == 0 ? 1 : 0);
    }
    numbers_.assign(layout.numbers * points.size(), static_cast<S>(nothing));
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t place =
            layout.has_columns ? k * points.size() + i : layout.numbers * i + k;
        numbers_[place] = static_cast<S>(points[i][static_cast<Eigen::Index>(k)]);
      }
    }
  }

  FiberArrays<S> view() const {
    FiberArrays<S> view{numbers_.data(), begin_.back(), begin_.data(), end_.size(), radii.data()};
    view.radii_are = radii_are;
    if (radii_are == Radii::kOne || radii_are == Radii::kPerFiber) view.radii = fiber_radii_.data();
    view.closed = closed_.data();
    view.groups = groups_.data();
    const std::size_t step = layout_.has_columns ? 1 : layout_.numbers;
    if (step != 3) view.point_stride = static_cast<std::ptrdiff_t>(step * sizeof(S));
    if (layout_.has_columns)
      view.axis_stride = static_cast<std::ptrdiff_t>(begin_.back() * sizeof(S));
    if (layout_.gap > 0) view.point_end = end_.data();
    return view;
  }
  /// The last point of a fiber that has at least two.
  std::size_t lastPoint() const { return end_[0] - 1; }

  std::vector<S> radii;  ///< by point
  Radii radii_are = Radii::kPerPoint;

 private:
  Layout layout_;
  std::vector<S> numbers_, fiber_radii_;
  std::vector<std::size_t> begin_ = {0}, end_;
  std::vector<std::uint8_t> closed_;
  std::vector<std::int32_t> groups_;
};

/// All kinds of trees, with one thread or several.
std::vector<FiberTreeOptions> allTrees(int ignored, double margin) {
  std::vector<FiberTreeOptions> all;
  for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
    options.ignored_neighbors = ignored;
    options.margin = margin;
    for (const int threads : {1, 3}) {
      options.threads = threads;
      all.push_back(options);
    }
  }
  return all;
}

/// What visitInParallel() hands out, ascending.
template <class Partner>
PairList pairsInParallel(const FiberTree& tree, const Partner& partner) {
  std::vector<PairList> of_workers(static_cast<std::size_t>(tree.workerCount()));
  tree.visitInParallel(Pairs{}, partner, [&](SegmentPair pair, int worker) {
    of_workers[static_cast<std::size_t>(worker)].emplace_back(pair.a, pair.b);
  });
  PairList all;
  for (const PairList& some : of_workers) all.insert(all.end(), some.begin(), some.end());
  std::sort(all.begin(), all.end());
  return all;
}

template <typename S>
class Tapers : public ::testing::Test {};
TYPED_TEST_SUITE(Tapers, test::Scalars, test::ScalarName);

// A cone would be taken for a capsule of one of its radii, or a radius of no fiber would be read.
TYPED_TEST(Tapers, PairsInAllLayouts) {
  std::uint64_t seed = 0;
  for (const Layout& layout : kLayouts) {
    for (const auto& [ignored, margin] : {std::pair{1, 0.0}, {0, 0.01}, {3, 0.03}}) {
      const Fibers<TypeParam> fibers(++seed, layout);
      const PairList expected = test::touchingCones(fibers.view(), ignored, margin);
      EXPECT_GT(expected.size(), 30u);
      for (const FiberTreeOptions& options : allTrees(ignored, margin)) {
        SCOPED_TRACE(testing::Message() << layout << ", margin " << margin);
        FiberTree tree(options);
        tree.build(fibers.view());
        EXPECT_EQ(pairsOf(tree), expected);
        EXPECT_EQ(pairsInParallel(tree, tree), expected);
      }
    }
  }
}

// The number at the second end of a capsule, which may be the radius of the next one, would be
// read because the partner's segments taper.
TYPED_TEST(Tapers, BesideOtherRadii) {
  using Radii = typename FiberArrays<TypeParam>::Radii;
  std::uint64_t seed = 20;
  for (const Radii kind :
       {Radii::kOne, Radii::kPerFiber, Radii::kPerFirstPoint, Radii::kPerPoint}) {
    for (const double margin : {0.0, 0.02}) {
      const Fibers<TypeParam> fibers(++seed);
      Fibers<TypeParam> others(seed + 100, kLayouts[margin > 0 ? 1 : 0]);
      others.radii_are = kind;
      const PairList expected = test::touchingCones(fibers.view(), others.view(), margin);
      PairList turned;
      for (const auto& [a, b] : expected) turned.emplace_back(b, a);
      std::sort(turned.begin(), turned.end());
      EXPECT_GT(expected.size(), 30u);
      for (const FiberTreeOptions& options : allTrees(1, margin)) {
        FiberTree tree(options), other(options);
        tree.build(fibers.view());
        other.build(others.view());
        EXPECT_EQ(pairsOf(tree, other), expected);
        EXPECT_EQ(pairsOf(other, tree), turned);
        EXPECT_EQ(pairsInParallel(tree, other), expected);
      }
    }
  }
}

// A tree would go on with the radii of before, or read those of capsules at both ends.
TYPED_TEST(Tapers, UpdatesChangeTheKindOfRadii) {
  using Radii = typename FiberArrays<TypeParam>::Radii;
  Fibers<TypeParam> fibers(41);
  std::map<Radii, PairList> expected;
  for (const FiberTreeOptions& options : allTrees(1, 0)) {
    FiberTree tree(options);
    tree.build(fibers.view());
    for (const Radii kind : {Radii::kPerFirstPoint, Radii::kPerPoint, Radii::kOne, Radii::kPerPoint,
                             Radii::kPerFiber, Radii::kPerPoint}) {
      fibers.radii_are = kind;
      tree.update(fibers.view());
      PairList& its = expected[kind];
      if (its.empty()) its = test::touchingCones(fibers.view(), 1, 0);
      EXPECT_EQ(pairsOf(tree), its);
    }
  }
}

/// Expects that a contact is where two segments touch by definition.
void expectContact(const BareContact& contact, const GivenCone& p, const GivenCone& q) {
  // 32 eps of lengths below 4, and as much for the sums below.
  constexpr double kError = 64 * 4 * std::numeric_limits<double>::epsilon();
  EXPECT_EQ(contact.pair.a, p.name);
  EXPECT_EQ(contact.pair.b, q.name);
  EXPECT_NEAR(contact.distance, static_cast<double>(test::coneDistance(p.cone, q.cone)), kError);
  const geometry::Vec3d apart =
      q.cone.a + contact.t * (q.cone.b - q.cone.a) - p.cone.a - contact.s * (p.cone.b - p.cone.a);
  EXPECT_NEAR(norm(apart) - p.cone.radiusAt(contact.s) - q.cone.radiusAt(contact.t),
              contact.distance, kError);
}

// A solver would push at a wrong place, or by the depth of the capsule around the cone.
TYPED_TEST(Tapers, Contacts) {
  std::size_t count = 0;
  for (const Layout& layout : kLayouts) {
    const Fibers<TypeParam> fibers(51, layout), others(52, layout);
    std::map<std::int32_t, GivenCone> of_fibers, of_others;
    for (const GivenCone& cone : test::conesOf(fibers.view())) of_fibers.emplace(cone.name, cone);
    for (const GivenCone& cone : test::conesOf(others.view())) of_others.emplace(cone.name, cone);
    const PairList expected = test::touchingCones(fibers.view(), 1, 0.01);
    std::map<PairList::value_type, double> distances;  // that have been checked
    for (const FiberTreeOptions& options : allTrees(1, 0.01)) {
      FiberTree tree(options), other(options);
      tree.build(fibers.view());
      other.build(others.view());
      const fcl_fibers::Contacts question{fibers.view()};
      const FiberArrays<TypeParam> second = others.view();
      const fcl_fibers::Contacts with_other{fibers.view(), &second};
      std::vector<Contact> contacts, of_both;
      tree.find(question, contacts);
      tree.find(with_other, other, of_both);
      const bool are_first = distances.empty();
      PairList found;
      double least = std::numeric_limits<double>::infinity();
      for (const Contact& contact : contacts) {
        found.emplace_back(contact.pair.a, contact.pair.b);
        const auto [known, is_new] = distances.emplace(found.back(), contact.distance);
        EXPECT_EQ(contact.distance, known->second) << "it depends on the tree";
        if (is_new)
          expectContact(contact, of_fibers.at(contact.pair.a), of_fibers.at(contact.pair.b));
        least = std::min(least, contact.distance);
      }
      std::sort(found.begin(), found.end());
      EXPECT_EQ(found, expected);
      EXPECT_EQ(tree.closest(question).distance, least);
      if (are_first) {
        for (const Contact& contact : of_both) {
          expectContact(contact, of_fibers.at(contact.pair.a), of_others.at(contact.pair.b));
        }
      }
      count += contacts.size() + of_both.size();

      // The weights of the two points are those of the closest place.
      std::vector<std::array<double, 3>> sums(fibers.view().point_count), by_hand = sums;
      const std::vector<double> pushes(contacts.size(), 1.5);
      tree.accumulate({contacts, pushes}, sums);
      for (const Contact& contact : contacts) {
        const ContactNodes<4> nodes = contact.nodes();
        for (std::size_t i = 0; i < 4; ++i) {
          const double push = (i < 2 ? -1.5 : 1.5) * nodes.weights[i];
          for (std::size_t k = 0; k < 3; ++k)
            by_hand[static_cast<std::size_t>(nodes.points[i])][k] += push * contact.normal[k];
        }
      }
      for (std::size_t i = 0; i < sums.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(sums[i][k], by_hand[i][k], 1e-12);
      }
    }
  }
  EXPECT_GT(count, 1000u);
}

// The nearest segment would be that of the nearest axis, or of the largest ball.
TYPED_TEST(Tapers, Nearest) {
  const Fibers<TypeParam> fibers(61), others(62, kLayouts[3]);
  const std::vector<GivenCone> first = test::conesOf(fibers.view());
  const std::vector<GivenCone> second = test::conesOf(others.view());
  // 32 eps of lengths below 4, for each of the two.
  constexpr double kError = 64 * 4 * std::numeric_limits<double>::epsilon();
  constexpr double kFar = 0.05;
  std::map<PairList::value_type, double> distances;
  std::map<std::int32_t, double> least;
  double of_all = std::numeric_limits<double>::infinity();
  for (const GivenCone& p : first) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const GivenCone& q : second) {
      const double distance = test::distanceUpTo(p.cone, q.cone, nearest + kError);
      distances[{p.name, q.name}] = distance;
      nearest = std::min(nearest, distance);
    }
    ASSERT_GT(std::fabs(nearest - kFar), kError);
    if (nearest <= kFar) least[p.name] = nearest;
    of_all = std::min(of_all, nearest);
  }
  EXPECT_GT(least.size(), 20u);
  EXPECT_LT(least.size(), first.size());
  for (const FiberTreeOptions& options : allTrees(1, 0)) {
    FiberTree tree(options), other(options);
    tree.build(fibers.view());
    other.build(others.view());
    std::vector<SegmentPair> pairs;
    tree.find(fcl_fibers::Nearest{kFar}, other, pairs);
    EXPECT_EQ(pairs.size(), least.size());
    for (const auto& [a, b] : pairs) {
      ASSERT_EQ(least.count(a), 1u);
      EXPECT_NEAR((distances[{a, b}]), least[a], kError);
    }
    const FiberArrays<TypeParam> with = others.view();
    const Contact closest = tree.closest(fcl_fibers::Contacts{fibers.view(), &with}, other);
    EXPECT_NEAR(closest.distance, of_all, kError);
  }
}

// A segment would be named twice, or not at all.
TYPED_TEST(Tapers, TouchingSegmentsAreThoseOfPairs) {
  const Fibers<TypeParam> fibers(71, kLayouts[1]);
  const auto soup = test::soup<TypeParam>(72, 60, 0.5);
  const TriangleMesh mesh(soup.view());
  for (const FiberTreeOptions& options : allTrees(1, 0.01)) {
    FiberTree tree(options);
    tree.build(fibers.view());
    std::set<std::int32_t> expected;
    tree.visit(Pairs{}, mesh, [&](const TrianglePair& pair) { expected.insert(pair.segment); });
    std::vector<std::int32_t> segments;
    tree.find(TouchingSegments{}, mesh, segments);
    std::sort(segments.begin(), segments.end());
    EXPECT_EQ(segments, std::vector<std::int32_t>(expected.begin(), expected.end()));
    EXPECT_GT(segments.size(), 10u);
  }
}

// Users who give each point the same radius would get other pairs, contacts or times.
TEST(TapersOfOneRadius, AreCapsulesBitForBit) {
  for (const FiberTreeOptions& options : allTrees(1, 0.01)) {
    test::Motion<double> motion = test::Motion<double>::random(81, 20, 0.2);
    motion.closeAndGroup();
    for (auto* fibers : {&motion.start, &motion.end}) {
      fibers->radii.assign(fibers->radii.size(), fibers == &motion.start ? 0.01 : 0.013);
    }
    const auto recordOf = [&](FiberArrays<double>::Radii kind) {
      motion.start.radii_are = motion.end.radii_are = kind;
      const FiberTree tree = test::steppedTree(motion, options),
                      other = test::steppedTree(motion, options);
      test::Record record;
      for (const test::TreeQuery& query : test::allQueries(options)) {
        query.ask({tree, other, motion.viewOf(motion.end)}, record);
      }
      return record;
    };
    using Radii = FiberArrays<double>::Radii;
    const test::Record of_one = recordOf(Radii::kOne);
    EXPECT_GT(of_one.size(), 1000u);
    EXPECT_TRUE(of_one == recordOf(Radii::kPerPoint));
  }
}

// Programs would look for a bad number that is not there, or get a tree with none.
TYPED_TEST(Tapers, BadRadiiAreNamed) {
  for (const Layout& layout : {kLayouts[0], kLayouts[1]}) {
    Fibers<TypeParam> fibers(91, layout);
    FiberTree tree;
    tree.build(fibers.view());
    const PairList before = pairsOf(tree);
    const std::size_t last = fibers.lastPoint();
    const TypeParam radius = fibers.radii[last];
    for (const TypeParam bad :
         {std::numeric_limits<TypeParam>::quiet_NaN(), std::numeric_limits<TypeParam>::infinity(),
          -std::numeric_limits<TypeParam>::denorm_min(), TypeParam(-1)}) {
      fibers.radii[last] = bad;
      for (const bool builds : {true, false}) {
        try {
          builds ? tree.build(fibers.view()) : tree.update(fibers.view());
          ADD_FAILURE() << "a radius of " << bad << " was taken";
        } catch (const std::invalid_argument& error) {
          EXPECT_THAT(error.what(), ::testing::HasSubstr("radius " + std::to_string(last) +
                                                         " is negative, NaN or infinite"));
        }
        EXPECT_EQ(pairsOf(tree), before);
      }
      // Of capsules no radius is there.
      fibers.radii_are = FiberArrays<TypeParam>::Radii::kPerFirstPoint;
      EXPECT_NO_THROW(FiberTree().build(fibers.view()));
      fibers.radii_are = FiberArrays<TypeParam>::Radii::kPerPoint;
    }
    fibers.radii[last] = radius;
    EXPECT_NO_THROW(tree.update(fibers.view()));
  }
}

// Users would pay for the second radius with memory.
TYPED_TEST(Tapers, TakeNoMemory) {
  using Radii = typename FiberArrays<TypeParam>::Radii;
  for (const FiberTreeOptions& options : allTrees(1, 0)) {
    const auto bytesWith = [&](Radii kind) {
      Fibers<TypeParam> fibers(95, kLayouts[0], 300);
      fibers.radii_are = kind;
      FiberTree tree(options);
      tree.build(fibers.view());
      tree.update(fibers.view());
      return tree.memoryUsage();
    };
    EXPECT_LE(bytesWith(Radii::kPerPoint), bytesWith(Radii::kPerFirstPoint));
  }
}

}  // namespace
}  // namespace fcl_fibers
