// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_tree.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>

#include "arrays/array_fibers.h"
#include "arrays/meshes.h"
#include "support/exact_geometry.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

template <class Shape>
std::set<std::int32_t> segmentsAt(const FiberTree& tree, const Shape& shape) {
  std::set<std::int32_t> segments;
  tree.visit(Pairs{}, shape, [&](std::int32_t segment) {
    EXPECT_TRUE(segments.insert(segment).second) << "twice";
  });
  return segments;
}

/// Compares with the segments that are no further from the shape than `margin`.
template <typename S, class Distance>
void expectSegments(const Assembly<S>& fibers, const std::set<std::int32_t>& found, Real margin,
                    Distance&& distance) {
  constexpr Real kBand = 1e-13L;  // the library errs towards touching, by a few ulp
  fibers.visitCapsules([&](std::size_t, std::size_t i) {
    const ExactCapsule capsule = roundedCapsule(fibers.capsule(i));
    const Real gap = distance(capsule) - capsule.radius - margin;
    const bool is_found = found.count(static_cast<std::int32_t>(i)) > 0;
    EXPECT_TRUE(is_found || gap > 0) << "misses " << i;
    EXPECT_TRUE(!is_found || gap <= kBand) << i << " is apart by " << gap;
  });
}

test::Point pointAt(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
std::array<double, 3> numbersAt(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

template <typename S>
class Overlaps : public testing::Test {};
TYPED_TEST_SUITE(Overlaps, Scalars, ScalarName);

// A brush that grasps hair would miss some, or grasp what it does not touch.
TYPED_TEST(Overlaps, WithShapesAreTheSegmentsThatTouch) {
  const auto fibers = curledFibers<TypeParam>(51, 60);
  for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
    for (const double margin : {0.0, 0.05}) {
      options.margin = margin;
      FiberTree tree(options);
      tree.build(fibers.view());
      Random random(52);
      std::size_t all = 0;
      for (int i = 0; i < 30; ++i) {
        const Eigen::Vector3d from = random.inCube(1), to = i % 3 == 0 ? from : random.inCube(1);
        const CapsuleShape capsule{numbersAt(from), numbersAt(to), 0.2 * random.unit()};
        const auto at_capsule = segmentsAt(tree, capsule);
        expectSegments(fibers, at_capsule, margin, [&](const ExactCapsule& c) {
          return segmentDistance(c.a, c.b, pointAt(capsule.start), pointAt(capsule.end)) -
                 Real(capsule.radius);
        });
        BoxShape box{numbersAt(from.cwiseMin(to)), numbersAt(from.cwiseMax(to))};
        if (i % 4 == 1) box.high[1] = box.low[1];  // flat
        const auto in_box = segmentsAt(tree, box);
        expectSegments(fibers, in_box, margin, [&](const ExactCapsule& c) {
          return segmentBoxDistance(c.a, c.b, {pointAt(box.low), pointAt(box.high)});
        });
        all += at_capsule.size() + in_box.size();
      }
      EXPECT_GT(all, 500u);
    }
  }
}

// A tree that reports volumes would miss what touches, or report all.
TYPED_TEST(Overlaps, OfVolumesIncludeTheSegmentsThatTouch) {
  const auto fibers = curledFibers<TypeParam>(53, 60);
  const CapsuleShape capsule{{0.1, 0.2, 0.3}, {0.2, 0.3, 0.3}, 0.05};
  const BoxShape box{{0.1, -0.2, 0}, {0.3, 0.1, 0.2}};
  const auto includes = [](const auto& more, const auto& fewer) {
    return std::includes(more.begin(), more.end(), fewer.begin(), fewer.end());
  };
  for (FiberTreeOptions options : allKinds(Report::kVolumes)) {
    FiberTree volumes(options);
    volumes.build(fibers.view());
    options.report = Report::kCapsules;
    FiberTree capsules(options);
    capsules.build(fibers.view());
    EXPECT_TRUE(includes(segmentsAt(volumes, capsule), segmentsAt(capsules, capsule)));
    EXPECT_TRUE(includes(segmentsAt(volumes, box), segmentsAt(capsules, box)));
    EXPECT_LT(segmentsAt(volumes, capsule).size(), volumes.segmentCount() / 2);
    EXPECT_LT(segmentsAt(volumes, box).size(), volumes.segmentCount() / 2);
  }
}

// Searches for capsules would be done where there are none.
TEST(Overlaps, OfTreesWithoutCapsulesAreRefusedForMeshes) {
  const auto fibers = curledFibers<double>(56, 10);
  FiberTree tree(FiberOptions{Topology::kBundle, Report::kVolumes});
  tree.build(fibers.view());
  const TriangleMesh mesh(ball<double>(0.3, 6, 8).view());
  std::vector<std::int32_t> segments(3);
  std::vector<TrianglePair> pairs(4);
  std::vector<MeshContact> contacts(5);
  const auto refusal = ThrowsMessage<std::invalid_argument>(HasSubstr("keeps no capsules"));
  EXPECT_THAT([&] { tree.visit(Pairs{}, mesh, [](TrianglePair) {}); }, refusal);
  EXPECT_THAT([&] { tree.find(TouchingSegments{}, mesh, segments); }, refusal);
  EXPECT_THAT([&] { tree.find(Nearest{1}, mesh, pairs); }, refusal);
  EXPECT_THAT([&] { tree.find(Contacts{fibers.view()}, mesh, contacts); }, refusal);
  const FiberTree capsules(FiberOptions{Topology::kBundle, Report::kCapsules});
  for (const double bad : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THAT(
        [&] { capsules.find(Nearest{bad}, mesh, pairs); },
        ThrowsMessage<std::invalid_argument>(HasSubstr("FiberTree::find(Nearest): distance is")));
  }
  EXPECT_EQ(segments.size(), 3u);
  EXPECT_EQ(pairs.size(), 4u);
  EXPECT_EQ(contacts.size(), 5u);
}

// Hair would meet the scalp that it grows from, or the skin beside it not.
TYPED_TEST(Overlaps, RootsAreCountedByLength) {
  Assembly<TypeParam> fibers;
  fibers.addFiber({{0, 0, 0}, {1, 0, 0}, {1, 2, 0}, {1, 2, 0}, {1, 2, 3}}, 0.1);
  fibers.addFiber({{0, 0, 0}}, 0.1);
  fibers.endFiber();
  fibers.addFiber({{5, 0, 0}, {5, 4, 0}}, 0.1);
  const FiberArrays<TypeParam> arrays = fibers.view();
  using Counts = std::vector<std::int32_t>;
  EXPECT_EQ(rootSegments(arrays, 0), (Counts{0, 0, 0, 0}));
  EXPECT_EQ(rootSegments(arrays, 0.5), (Counts{1, 0, 0, 1}));
  EXPECT_EQ(rootSegments(arrays, 1), (Counts{1, 0, 0, 1})) << "one that begins there is no root";
  EXPECT_EQ(rootSegments(arrays, 1.5), (Counts{2, 0, 0, 1}));
  EXPECT_EQ(rootSegments(arrays, 3), (Counts{2, 0, 0, 1}));
  EXPECT_EQ(rootSegments(arrays, 3.5), (Counts{4, 0, 0, 1}));
  EXPECT_EQ(rootSegments(arrays, 1e300), (Counts{4, 0, 0, 1}));
  for (const double bad :
       {-1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THAT([&] { rootSegments(arrays, bad); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("rootSegments: length is")));
  }
  EXPECT_THAT([] { rootSegments(FiberArrays<TypeParam>(), 1); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("point_begin is null")));
}

// The first segments of another fiber would be left out.
TEST(Overlaps, RootsThatAreNegativeAreRefusedByABuild) {
  const auto fibers = curledFibers<double>(57, 10);
  FiberArrays<double> arrays = fibers.view();
  std::vector<std::int32_t> roots(arrays.fiber_count, 1);
  arrays.root_segments = roots.data();
  FiberTree tree;
  tree.build(arrays);
  const PairList before = pairsOf(tree);
  roots[6] = -2;
  EXPECT_THAT([&] { tree.build(arrays); },
              ThrowsMessage<std::invalid_argument>(
                  HasSubstr("FiberTree::build: root_segments of fiber 6 is -2; give 0 or more")));
  EXPECT_EQ(pairsOf(tree), before);
  EXPECT_NO_THROW(tree.update(arrays)) << "an update does not read them";
}

}  // namespace
}  // namespace fcl_fibers::test
