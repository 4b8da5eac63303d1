// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_tree.h>

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <new>
#include <set>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/array_fibers.h"
#include "arrays/meshes.h"
#include "support/exact_geometry.h"
#include "support/other_locale.h"
#include "support/scalars.h"
#include "support/touch_oracle.h"

namespace fcl_fibers {
namespace {

using test::allKinds;
using test::Assembly;
using test::curledFibers;
using test::optionsOf;
using test::PairList;
using test::pairsOf;
using test::Random;
using test::touchingPairs;

template <typename S>
class ArrayTree : public ::testing::Test {};

TYPED_TEST_SUITE(ArrayTree, test::Scalars, test::ScalarName);

// Touching capsules would be missed, or others reported.
TYPED_TEST(ArrayTree, ReportsTheCapsulesThatTouch) {
  const auto fibers = curledFibers<TypeParam>(1);
  for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
    options.ignored_neighbors = 2;
    options.margin = 0.003;
    for (const int threads : {1, 3}) {
      options.threads = threads;
      FiberTree tree(options);
      tree.build(fibers.view());
      const PairList expected = touchingPairs(fibers, fibers, 2, 0.003);
      EXPECT_GT(expected.size(), 100u);
      EXPECT_EQ(pairsOf(tree), expected);
    }
  }
}

// Neighbours would be told by number where the rule is a length, or not across the seam.
TYPED_TEST(ArrayTree, IgnoresNeighborsByArcLengthAndAcrossTheSeam) {
  // Two squares of four sides of length 1, so thick that all touch all; the first is closed.
  Assembly<TypeParam> squares;
  for (const double z : {0.0, 0.5}) {
    squares.addFiber({{0, 0, z}, {1, 0, z}, {1, 1, z}, {0, 1, z}, {0, 0, z}}, 1);
  }
  const std::uint8_t closed[] = {1, 0};
  const std::size_t between = 16;
  for (const auto& [neighbors, length, within] : {std::tuple<int, double, std::size_t>{0, 0, 12},
                                                  {1, 0, 2 + 3},
                                                  {0, 0.5, 2 + 3},
                                                  {0, 1, 0 + 1},
                                                  {1, 1, 0 + 1},
                                                  {2, 0, 0 + 1},
                                                  {3, 0, 0}}) {
    FiberTreeOptions options = FiberOptions{Topology::kBundle, Report::kVolumes};
    options.ignored_neighbors = neighbors;
    options.ignored_arc_length = length;
    FiberTree tree(options);
    FiberArrays<TypeParam> fibers = squares.view();
    fibers.closed = closed;
    tree.build(fibers);
    EXPECT_EQ(pairsOf(tree).size(), between + within) << neighbors << ' ' << length;
    tree.update(fibers);
    EXPECT_EQ(pairsOf(tree).size(), between + within) << neighbors << ' ' << length;
  }
}

// The way across the seam would be as long as all fibers before it.
TYPED_TEST(ArrayTree, MeasuresArcsAlongOneFiber) {
  // Two hexagons far apart, so thick that all sides of one touch each other.
  Assembly<TypeParam> hexagons;
  for (const double z : {0.0, 10.0}) {
    std::vector<typename Assembly<TypeParam>::Point> points;
    for (int i = 0; i <= 6; ++i) {
      const double angle = i % 6 * 3.141592653589793 / 3;
      points.push_back({std::cos(angle), std::sin(angle), z});
    }
    hexagons.addFiber(points, 2);
  }
  const std::uint8_t closed[] = {1, 1};
  FiberTreeOptions options = FiberOptions{Topology::kBundle, Report::kVolumes};
  options.ignored_arc_length = 1.5;
  FiberTree tree(options);
  FiberArrays<TypeParam> fibers = hexagons.view();
  fibers.closed = closed;
  tree.build(fibers);
  EXPECT_EQ(pairsOf(tree), (PairList{{0, 3}, {1, 4}, {2, 5}, {7, 10}, {8, 11}, {9, 12}}));
}

// Fibers of one group would meet, or others not; after an update, or a new bundle, or in another
// tree's query.
TYPED_TEST(ArrayTree, LeavesOutPairsOfOneGroup) {
  // At first, after a small motion, and where they have flown apart.
  std::vector<Assembly<TypeParam>> stages(3, curledFibers<TypeParam>(21));
  const auto fiberOf = [&](std::int32_t point) {
    return stages[0].fiberOf(static_cast<std::size_t>(point));
  };
  for (std::size_t i = 0; i < stages[0].points.size(); i += 3) {
    const std::size_t place = 7 * stages[0].fiberOf(i / 3) % 30 / 6;
    stages[1].points[i] += static_cast<TypeParam>(0.02 * static_cast<double>(place));
    stages[2].points[i] += static_cast<TypeParam>(5 * static_cast<double>(place));
  }
  std::vector<std::int32_t> groups;
  for (std::size_t f = 0; f < 30; ++f) groups.push_back(static_cast<std::int32_t>(f % 4) - 1);
  std::vector<PairList> expected;
  for (const Assembly<TypeParam>& stage : stages) {
    const PairList touching = test::touchingPairs(stage, stage, 1, 0);
    expected.emplace_back();
    for (const auto& [a, b] : touching) {
      const auto p = groups[fiberOf(a)];
      const auto q = groups[fiberOf(b)];
      if (p == 0 || p != q) expected.back().emplace_back(a, b);
    }
    EXPECT_GT(expected.back().size(), 20u);
    EXPECT_LT(expected.back().size(), touching.size());
  }

  const auto other = curledFibers<TypeParam>(22);
  for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
    options.ignored_neighbors = 1;
    for (const int threads : {1, 3}) {
      options.threads = threads;
      FiberTree tree(options), plain(options), other_tree(options);
      FiberArrays<TypeParam> fibers = stages[0].view();
      fibers.groups = groups.data();
      tree.build(fibers);
      EXPECT_EQ(pairsOf(tree), expected[0]);
      // All that matters of the groups is what they were at the build.
      for (const std::size_t stage : {1u, 2u, 0u}) {
        tree.update(stages[stage].view());
        EXPECT_EQ(pairsOf(tree), expected[stage]) << stage;
      }

      plain.build(stages[0].view());
      other_tree.build(other.view());
      const PairList between = pairsOf(plain, other_tree);
      EXPECT_GT(between.size(), 20u);
      EXPECT_EQ(pairsOf(tree, other_tree), between);

      const std::vector<std::int32_t> none(groups.size(), 0);
      fibers.groups = none.data();
      tree.build(fibers);
      EXPECT_EQ(pairsOf(tree), pairsOf(plain)) << "none is in a group";
      if (threads == 1) {  // several keep what their last query has written pairs to
        EXPECT_EQ(tree.memoryUsage(), plain.memoryUsage());
      }
    }
  }
}

// Fibers that have changed places would be searched by a tree made for where they were.
TYPED_TEST(ArrayTree, BundlesAnewWhenFibersHaveMovedApart) {
  const Assembly<TypeParam> at_one_place = curledFibers<TypeParam>(13, 200);
  // Side by side in an order of their own.
  const auto sideBySide = [&](std::size_t stride) {
    Assembly<TypeParam> fibers = at_one_place;
    for (std::size_t f = 0; f < 200; ++f) {
      for (std::size_t i = fibers.point_begin[f]; i < fibers.point_begin[f + 1]; ++i) {
        fibers.points[3 * i] += static_cast<TypeParam>(5 * (stride * f % 200));
      }
    }
    return fibers;
  };
  const auto places = [](const FiberTree& tree) {
    std::vector<std::vector<double>> numbers;
    for (const TreeVolume& volume : tree.volumes(2)) {
      numbers.push_back({volume.center[0], volume.half[0], volume.half[1], volume.half[2]});
    }
    return numbers;
  };
  const Assembly<TypeParam> moved = sideBySide(83);
  FiberTree tree, fresh;
  tree.build(sideBySide(1).view());
  tree.update(moved.view());
  fresh.build(moved.view());
  EXPECT_EQ(places(tree), places(fresh));
}

// Pairs would be left out because of their numbers, as if the other tree's fibers were one's own.
TYPED_TEST(ArrayTree, MeetsAnotherTree) {
  const auto a = curledFibers<TypeParam>(6), b = curledFibers<TypeParam>(7, 20);
  const PairList touching = test::touchingPairs(a, b, 0, 0);
  EXPECT_GT(touching.size(), 50u);
  const std::vector<std::int32_t> groups(a.fiberCount(), 1);
  for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
    for (const int ignored : {0, 1000}) {
      options.ignored_neighbors = ignored;
      options.ignored_arc_length = ignored;
      auto first_fibers = a.view(), second_fibers = b.view();
      if (ignored > 0) first_fibers.groups = second_fibers.groups = groups.data();
      FiberTree first(options), second(options);
      first.build(first_fibers);
      second.build(second_fibers);
      EXPECT_EQ(pairsOf(first, second), touching);
    }
  }
}

// A program that keeps points of another type for the frames than for the first would have to build
// anew.
TEST(ArrayTree, MayBeUpdatedWithTheOtherScalar) {
  const auto single = curledFibers<float>(16);
  Assembly<double> wide;
  wide.point_begin = single.point_begin;
  wide.points.assign(single.points.begin(), single.points.end());
  wide.radii.assign(single.radii.begin(), single.radii.end());
  for (double& x : wide.points) x *= 1.5;
  const PairList touching = test::touchingPairs(single, single, 0, 0);
  const PairList touching_wide = test::touchingPairs(wide, wide, 0, 0);
  EXPECT_NE(touching, touching_wide);
  for (const FiberTreeOptions& options : allKinds(Report::kCapsules)) {
    FiberTree tree(options), other(options);
    tree.build(wide.view());
    tree.update(single.view());
    EXPECT_EQ(pairsOf(tree), touching);
    tree.update(wide.view());
    EXPECT_EQ(pairsOf(tree), touching_wide);
    other.build(single.view());
    other.update(wide.view());
    EXPECT_EQ(pairsOf(other), touching_wide);
  }
}

TEST(ArrayTree, NamesFiberAndSegment) {
  const auto fibers = curledFibers<double>(8);
  FiberTree tree;
  tree.build(fibers.view());
  EXPECT_EQ(tree.fiberCount(), 30u);
  const std::vector<std::int32_t> segments = tree.segments();
  ASSERT_EQ(segments.size(), tree.segmentCount());
  std::size_t count = 0;
  for (std::size_t f = 0; f < 30; ++f) {
    for (std::size_t i = fibers.point_begin[f]; i < fibers.point_begin[f + 1]; ++i) {
      const auto id = static_cast<std::int32_t>(i);
      if (!fibers.startsCapsule(i)) {
        EXPECT_THROW(tree.fiberSegment(id), std::invalid_argument);
        continue;
      }
      EXPECT_EQ(segments.at(count), id);
      EXPECT_EQ(tree.fiberSegment(id).fiber, f);
      EXPECT_EQ(tree.fiberSegment(id).number, i - fibers.point_begin[f]);
      ++count;
    }
  }
  EXPECT_EQ(tree.segmentCount(), count);
}

template <typename S>
test::ExactCapsule exactCapsule(const Assembly<S>& fibers, std::size_t i) {
  const test::GivenCapsule given = fibers.capsule(i);
  return {test::Point(given.a[0], given.a[1], given.a[2]),
          test::Point(given.b[0], given.b[1], given.b[2]), given.radius};
}

/// How far the capsule that starts at point i reaches out of the volume; negative where it does
/// not.
template <typename S>
test::Real reachOutside(const Assembly<S>& fibers, std::size_t i, const TreeVolume& volume) {
  const test::Point center(volume.center[0], volume.center[1], volume.center[2]);
  test::Real reach = -1e30L;
  const test::ExactCapsule capsule = exactCapsule(fibers, i);
  for (const test::Point& end : {capsule.a, capsule.b}) {
    const test::Point d = (end - center).cwiseAbs();
    if (volume.kind == FiberTreeOptions::Volumes::kWrappedSpheres) {
      reach = std::max(reach, d.norm() + capsule.radius - volume.half[0]);
      continue;
    }
    for (int k = 0; k < 3; ++k) {
      reach = std::max(reach, d[k] + capsule.radius - volume.half[k]);
    }
  }
  return reach;
}

/// Half the edges of the least box around these capsules' own volumes.
template <typename S>
test::Point halfExtent(const Assembly<S>& fibers, const TreeVolume& volume) {
  test::Point low = test::Point::Constant(1e30L), high = -low;
  for (std::size_t n = 0; n < volume.segment_count; ++n) {
    const test::ExactCapsule capsule =
        exactCapsule(fibers, static_cast<std::size_t>(volume.segments[n]));
    test::ExactBox box = test::boxOf(capsule);
    if (volume.kind == FiberTreeOptions::Volumes::kWrappedSpheres) {
      const test::ExactSphere sphere = test::sphereOf(capsule);
      const test::Point radius = test::Point::Constant(sphere.radius);
      box = {sphere.center - radius, sphere.center + radius};
    }
    low = low.cwiseMin(box.min);
    high = high.cwiseMax(box.max);
  }
  return (high - low) / 2;
}

// A picture would show volumes that do not hold what is below them, or are larger than they are;
// or capsules would be missing from it.
TYPED_TEST(ArrayTree, ShowsTheVolumesOfALevel) {
  auto fibers = curledFibers<TypeParam>(12);
  for (TypeParam& coordinate : fibers.points) coordinate += 100;  // another frame than the tree's
  // The tree's floats are relative to the scene, of extent 3; float arrays round at 100.
  const test::Real rounding = std::is_same_v<TypeParam, float> ? 1e-4L : 1e-5L;
  for (const FiberTreeOptions& options : allKinds(Report::kVolumes)) {
    FiberTree tree(options);
    EXPECT_TRUE(tree.volumes(0).empty());
    tree.build(fibers.view());
    std::size_t count = 0;
    for (int depth = 0; count < tree.segmentCount(); ++depth) {
      const std::vector<TreeVolume> volumes = tree.volumes(depth);
      if (depth == 0) {
        ASSERT_EQ(volumes.size(), 1u);
      } else {
        ASSERT_GT(volumes.size(), count) << "depth " << depth;
      }
      count = volumes.size();
      std::set<std::int32_t> seen;
      for (const TreeVolume& volume : volumes) {
        EXPECT_EQ(volume.kind, options.volumes);
        for (std::size_t n = 0; n < volume.segment_count; ++n) {
          EXPECT_TRUE(seen.insert(volume.segments[n]).second) << "below two volumes";
          EXPECT_LE(reachOutside(fibers, static_cast<std::size_t>(volume.segments[n]), volume), 0);
        }
        const test::Point half = halfExtent(fibers, volume);
        if (volume.kind == FiberTreeOptions::Volumes::kWrappedSpheres) {
          EXPECT_EQ(volume.half[0], volume.half[2]);
          EXPECT_GE(volume.half[0], half.maxCoeff() - rounding);
          EXPECT_LE(volume.half[0], half.norm() + rounding);
        } else {
          for (int k = 0; k < 3; ++k) {
            EXPECT_NEAR(static_cast<double>(half[k]), volume.half[k],
                        static_cast<double>(rounding));
          }
        }
      }
      EXPECT_EQ(seen.size(), tree.segmentCount());
      for (const std::int32_t i : seen) {
        EXPECT_TRUE(fibers.startsCapsule(static_cast<std::size_t>(i)));
      }
    }
    EXPECT_EQ(tree.volumes(1000).size(), tree.segmentCount());
    EXPECT_THROW(tree.volumes(-1), std::invalid_argument);
  }
}

// What has no answer does not compile.
static_assert(kHasAnswer<Pairs, FiberTree> && kHasAnswer<Pairs, BoxShape>);
static_assert(!kHasAnswer<Pairs, MeshStep> && !kHasAnswer<Impacts, TriangleMesh>);
static_assert(!kHasAnswer<Nearest, BoxShape> && !kHasAnswer<TouchingSegments, BoxShape>);

/// An array that ends where memory does that may not be read.
template <typename T>
class AtTheEnd {
 public:
  explicit AtTheEnd(const std::vector<T>& values) {
    const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    const std::size_t bytes = values.size() * sizeof(T), kept = (bytes + page - 1) / page * page;
    size_ = kept + page;
    void* memory = mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    memory_ = static_cast<char*>(memory);
    data_ = reinterpret_cast<T*>(memory_ + kept - bytes);
    std::copy(values.begin(), values.end(), data_);
    mprotect(memory_ + kept, page, PROT_NONE);
  }
  ~AtTheEnd() { munmap(memory_, size_); }
  AtTheEnd(const AtTheEnd&) = delete;
  AtTheEnd& operator=(const AtTheEnd&) = delete;
  const T* data() const { return data_; }

 private:
  std::size_t size_;
  char* memory_;
  T* data_;
};

// A capsule would start at the last point, or a fiber behind the last one, and the program crash
// now and then.
TYPED_TEST(ArrayTree, ReadsNothingBehindTheArrays) {
  using Radii = typename FiberArrays<TypeParam>::Radii;
  const auto some = curledFibers<TypeParam>(14);
  const std::size_t fiber_count = some.point_begin.size() - 1;
  const AtTheEnd<TypeParam> points(some.points), radii(some.radii);
  const AtTheEnd<TypeParam> fiber_radii(std::vector<TypeParam>(fiber_count, TypeParam(0.01)));
  const AtTheEnd<std::size_t> point_begin(some.point_begin);
  const AtTheEnd<std::uint8_t> closed(std::vector<std::uint8_t>(fiber_count, 1));
  std::vector<std::int32_t> group_of(fiber_count, 2);
  for (std::size_t f = 0; f < fiber_count; f += 2) group_of[f] = 0;
  const AtTheEnd<std::int32_t> groups(group_of);
  const AtTheEnd<std::uint32_t> meets(std::vector<std::uint32_t>(fiber_count, 1));
  const AtTheEnd<std::int32_t> roots(std::vector<std::int32_t>(fiber_count, 1));
  const TriangleMesh mesh(test::ball<double>(0.3, 8, 12).view());
  FiberArrays<TypeParam> fibers = some.view();
  fibers.points = points.data();
  fibers.point_begin = point_begin.data();
  fibers.closed = closed.data();
  fibers.groups = groups.data();
  fibers.meets = meets.data();
  fibers.root_segments = roots.data();
  EXPECT_EQ(rootSegments(fibers, 0.1).size(), fiber_count);
  for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
    options.ignored_arc_length = 0.01;
    for (const Radii radii_are : {Radii::kPerFirstPoint, Radii::kPerFiber}) {
      fibers.radii_are = radii_are;
      fibers.radii = radii_are == Radii::kPerFiber ? fiber_radii.data() : radii.data();
      FiberTree tree(options);
      tree.build(fibers);
      tree.update(fibers);
      if (options.volumes == FiberTreeOptions::Volumes::kLayeredBoxes) tree.update(fibers, fibers);
      std::vector<Contact> contacts;
      tree.find(Contacts{fibers}, contacts);
      EXPECT_GT(contacts.size(), 10u);
      std::vector<MeshContact> mesh_contacts;
      tree.find(Contacts{fibers}, mesh, mesh_contacts);
      EXPECT_GT(mesh_contacts.size(), 10u);
    }
  }
}

// A capsule would have the radius of a fiber that was read before its own.
TYPED_TEST(ArrayTree, OneRadiusAndRadiiByFiberAreThoseByCapsule) {
  using Radii = typename FiberArrays<TypeParam>::Radii;
  Assembly<TypeParam> by_segment = curledFibers<TypeParam>(60), fewer = by_segment;
  const std::size_t fiber_count = fewer.fiberCount();
  for (const Radii radii_are : {Radii::kOne, Radii::kPerFiber}) {
    fewer.radii_are = radii_are;
    fewer.radii.assign(radii_are == Radii::kOne ? 1 : fiber_count, TypeParam(0.04));
    for (std::size_t f = 0; f < fiber_count; ++f) {
      if (f % 3 != 0 && radii_are == Radii::kPerFiber) {
        fewer.radii[f] = static_cast<TypeParam>(0.001 * static_cast<double>(f));
      }
      for (std::size_t i = by_segment.point_begin[f]; i < by_segment.point_begin[f + 1]; ++i) {
        by_segment.radii[i] = fewer.radii[std::min(f, fewer.radii.size() - 1)];
      }
    }
    for (const Report report : {Report::kVolumes, Report::kCapsules}) {
      for (const FiberTreeOptions& options : allKinds(report)) {
        FiberTree tree(options), other(options);
        tree.build(by_segment.view());
        other.build(fewer.view());
        EXPECT_FALSE(pairsOf(tree).empty());
        EXPECT_EQ(pairsOf(other), pairsOf(tree));
        tree.update(by_segment.view());
        other.update(fewer.view());
        EXPECT_EQ(pairsOf(other), pairsOf(tree));
      }
    }
  }
}

TEST(ArrayTree, AnswersWhenEmpty) {
  FiberTree tree;
  EXPECT_TRUE(pairsOf(tree).empty());
  tree.build(curledFibers<double>(10).view());
  const Assembly<double> none;
  tree.build(none.view());
  EXPECT_TRUE(pairsOf(tree).empty());
  EXPECT_EQ(tree.segmentCount(), 0u);
  EXPECT_FALSE(tree.visit(Pairs{}, BoxShape{{-1, -1, -1}, {1, 1, 1}}, [](auto) { return true; }));
}

/// Refused with a text that says so, and nothing has changed.
void expectRefused(FiberTree& tree, const FiberArrays<double>& bad, const std::string& text) {
  const PairList before = pairsOf(tree);
  ASSERT_FALSE(before.empty());
  for (const bool build : {true, false}) {
    try {
      build ? tree.build(bad) : tree.update(bad);
      ADD_FAILURE() << "not refused: " << text;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(text));
    }
    EXPECT_EQ(pairsOf(tree), before);
  }
}

/// How far apart the boxes of two capsules are, on the axis that parts them most.
double boxGap(const test::GivenCapsule& p, const test::GivenCapsule& q) {
  double gap = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    gap = std::max({gap, std::min(q.a[k], q.b[k]) - std::max(p.a[k], p.b[k]),
                    std::min(p.a[k], p.b[k]) - std::max(q.a[k], q.b[k])});
  }
  return gap - p.radius - q.radius;
}

// An update would be refused, or all pairs be reported, because one fiber lies far outside.
TEST(ArrayTree, FollowsTheFibersWhereTheOutermostWouldOverflow) {
  auto fibers = curledFibers<double>(10, 200);
  const std::size_t last = fibers.points.size() - 3;
  for (std::size_t k = last - 3; k < last + 3; ++k) fibers.points[k] = 1e290;
  // To the capsule that ends there, all others are one place.
  const auto outermost = static_cast<std::int32_t>(fibers.pointCount() - 3);
  const auto others = [&](PairList pairs) {
    const auto is_out = [&](const auto& pair) { return pair.second >= outermost; };
    pairs.erase(std::remove_if(pairs.begin(), pairs.end(), is_out), pairs.end());
    return pairs;
  };
  FiberTree volumes(FiberOptions{Topology::kBundle, Report::kVolumes});
  FiberTree capsules(FiberOptions{Topology::kBundle, Report::kCapsules});
  volumes.build(fibers.view());
  capsules.build(fibers.view());
  // A power of two, so that what touches does not change.
  const double scale = std::ldexp(1.0, -80);
  for (std::size_t k = 0; k < last - 3; ++k) fibers.points[k] *= scale;
  for (double& radius : fibers.radii) radius *= scale;
  const PairList touching = others(test::touchingPairs(fibers, fibers, 0, 0));
  ASSERT_GT(touching.size(), 100u);
  for (int i = 0; i < 2; ++i) {
    volumes.update(fibers.view());
    capsules.update(fibers.view());
    EXPECT_EQ(others(pairsOf(capsules)), touching);
    const PairList found = others(pairsOf(volumes));
    EXPECT_TRUE(std::includes(found.begin(), found.end(), touching.begin(), touching.end()));
    for (const auto& [a, b] : found) {
      ASSERT_LE(boxGap(fibers.capsule(static_cast<std::size_t>(a)),
                       fibers.capsule(static_cast<std::size_t>(b))),
                std::ldexp(scale, -20))
          << a << ", " << b;
    }
  }
}

// What docs/numerics.md promises would be refused.
TEST(ArrayTree, TakesCoordinatesUpToAPromisedSize) {
  constexpr double kMost = 5e306;
  const auto near = curledFibers<double>(17, 20);
  // All at one end of the range, and half of them at each.
  for (const bool both : {false, true}) {
    Assembly<double> fibers = near;
    for (std::size_t i = 0; i < fibers.points.size(); ++i) {
      const bool is_low = both && fibers.fiberOf(i / 3) % 2 == 0;
      fibers.points[i] = (is_low ? -1 : 1) * (kMost - 0x1p-4 * kMost * (1 - near.points[i] / 4));
      ASSERT_LE(std::abs(fibers.points[i]), kMost);
    }
    for (double& radius : fibers.radii) radius *= 0x1p-6 * kMost;
    const PairList touching = test::touchingPairs(fibers, fibers, 0, 0);
    EXPECT_GT(touching.size(), 100u);
    for (const FiberTreeOptions& options : allKinds(Report::kCapsules)) {
      FiberTree tree(options);
      tree.build(fibers.view());
      EXPECT_EQ(pairsOf(tree), touching);
      tree.update(fibers.view());
      EXPECT_EQ(pairsOf(tree), touching);
    }
  }
}

// A silent wrong answer, or a crash.
TEST(ArrayTree, RefusesWhatItCannotAnswerFor) {
  const auto good = curledFibers<double>(11, 200);  // of which the frame samples some
  FiberTree tree(FiberOptions{Topology::kBundle, Report::kVolumes});
  tree.build(good.view());
  const double infinity = std::numeric_limits<double>::infinity();

  auto bad = good;
  bad.points[3 * 12 + 1] = std::nan("");
  expectRefused(tree, bad.view(), "point 12 is NaN or infinite");
  bad.points[3 * 12 + 1] = -infinity;
  expectRefused(tree, bad.view(), "point 12 is NaN or infinite");
  bad.points[3 * 12 + 1] = 1e308;
  expectRefused(tree, bad.view(), "overflow");
  bad = good;
  bad.radii[5] = -1;
  expectRefused(tree, bad.view(), "radius 5 is negative");
  FiberArrays<double> longer = good.view();
  longer.point_count += 1;
  expectRefused(tree, longer, "point_begin runs from 0 to");
  bad = good;
  bad.point_begin[2] = bad.point_begin.back() + 7;
  expectRefused(tree, bad.view(), "point_begin descends at fiber 2");

  bad = good;
  bad.point_begin[1] -= 1;
  EXPECT_THROW(tree.update(bad.view()), std::invalid_argument) << "another number of points";

  FiberTreeOptions options;
  options.threads = 0;
  EXPECT_THROW(FiberTree{options}, std::invalid_argument);
  options = {};
  options.margin = -1;
  EXPECT_THROW(FiberTree{options}, std::invalid_argument);
  options = {};
  options.ignored_neighbors = -1;
  EXPECT_THROW(FiberTree{options}, std::invalid_argument);
  options = {};
  options.ignored_arc_length = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(FiberTree{options}, std::invalid_argument);

  // Refused by its number of points before one of them is read.
  FiberArrays<double> huge = good.view();
  huge.point_count = (std::size_t{1} << 27) + 1;
  std::vector<std::size_t> huge_begin = good.point_begin;
  huge_begin.back() = huge.point_count;
  huge.point_begin = huge_begin.data();
  expectRefused(tree, huge, "points are more than 2^27");
  huge = good.view();
  huge.fiber_count = static_cast<std::size_t>(-1);
  expectRefused(tree, huge, "fibers are more than 2^27");
}

TEST(ArrayTree, TextsAreTheSameInAnyLocale) {
  // If this fails, a number in an error is another one where the host writes 1.234,5.
  const test::OtherLocale locale;
  FiberTreeOptions options;
  options.margin = -1234.5;
  EXPECT_THAT([&] { FiberTree tree(options); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(" is -1234.5;")));
}

// A null pointer would be read, also where there are fibers, but no points.
TEST(ArrayTree, RefusesNullArrays) {
  using Radii = FiberArrays<double>::Radii;
  auto good = curledFibers<double>(11);
  for (const Radii radii_are : {Radii::kOne, Radii::kPerFiber, Radii::kPerFirstPoint}) {
    good.radii_are = radii_are;
    FiberTree tree;
    tree.build(good.view());
    for (const auto& [array, text] :
         {std::pair(&FiberArrays<double>::points, "points are null; give"),
          {&FiberArrays<double>::radii, "radii are null; give"}}) {
      FiberArrays<double> bad = good.view();
      bad.*array = nullptr;
      expectRefused(tree, bad, text);
    }
    FiberArrays<double> bad = good.view();
    bad.point_begin = nullptr;
    expectRefused(tree, bad, "point_begin is null");
    expectRefused(tree, {}, "point_begin is null");

    const std::size_t nowhere[] = {0, 0};
    const FiberArrays<double> pointless{nullptr, 0, nowhere, 1, nullptr, radii_are};
    if (radii_are == Radii::kPerFiber) {
      expectRefused(tree, pointless, "radii are null; give 1");
    } else {
      tree.build(pointless);
      tree.update(pointless);
      EXPECT_EQ(tree.fiberCount(), 1u);
      EXPECT_TRUE(pairsOf(tree).empty());
    }
  }
}

TEST(ArrayTree, RefusesATreeOfAnotherKind) {
  // If this fails, two trees that do not match are searched, or found to have no pair.
  using Volumes = FiberTreeOptions::Volumes;
  const auto fibers = curledFibers<double>(11);
  const auto treeOf = [&](Volumes volumes, Topology topology, Report report) {
    FiberTree tree(optionsOf(volumes, topology, report));
    tree.build(fibers.view());
    return tree;
  };
  const FiberTree tree = treeOf(Volumes::kLayeredBoxes, Topology::kBundle, Report::kCapsules);
  const FiberTree volumes = treeOf(Volumes::kLayeredBoxes, Topology::kBundle, Report::kVolumes);
  const auto expectRefusal = [](const FiberTree& first, const FiberTree& other,
                                const std::string& text) {
    const auto none = [](auto&&) { ADD_FAILURE() << "a pair of two trees that do not match"; };
    const auto refusal =
        ::testing::ThrowsMessage<std::invalid_argument>(::testing::HasSubstr(text));
    EXPECT_THAT([&] { first.visit(Pairs{}, other, none); }, refusal);
  };
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    expectRefusal(tree, treeOf(Volumes::kWrappedSpheres, Topology::kBundle, report),
                  "different volumes or topologies");
    expectRefusal(tree, treeOf(Volumes::kLayeredBoxes, Topology::kSuperThread, report),
                  "different volumes or topologies");
  }
  expectRefusal(tree, volumes, "keeps no capsules");
  EXPECT_FALSE(pairsOf(volumes, tree).empty()) << "the other way round it needs none";
}

TEST(ArrayTree, IsWhatWasMovedToIt) {
  // If this fails, a tree that was moved answers for other fibers, or has other options.
  const auto first = curledFibers<double>(14), second = curledFibers<double>(15);
  FiberTree from(optionsOf({}, Topology::kSuperThread, Report::kCapsules));
  FiberTree to(FiberOptions{Topology::kBundle, Report::kVolumes});
  from.build(first.view());
  to.build(second.view());
  const PairList pairs = pairsOf(from);
  EXPECT_NE(pairs, pairsOf(to));
  to = std::move(from);
  EXPECT_EQ(pairsOf(to), pairs);
  EXPECT_EQ(to.options().topology, Topology::kSuperThread);
  from = FiberTree();
  EXPECT_TRUE(pairsOf(from).empty());
  from.build(first.view());
  EXPECT_FALSE(pairsOf(from).empty());
  const FiberTree constructed(std::move(to));
  EXPECT_EQ(pairsOf(constructed), pairs);
}

TEST(ArrayTree, IsAsConstructedAfterAMove) {
  // If this fails, a call of a tree that was moved from crashes, or it has fibers or other options.
  const auto fibers = curledFibers<double>(14);
  const FiberTreeOptions options = optionsOf({}, Topology::kSuperThread, Report::kCapsules);
  FiberTree from(options), fresh(options);
  from.build(fibers.view());
  const FiberTree to = std::move(from);
  EXPECT_EQ(from.options().topology, options.topology);
  EXPECT_EQ(from.fiberCount(), 0u);
  EXPECT_EQ(from.segmentCount(), 0u);
  EXPECT_EQ(from.memoryUsage(), fresh.memoryUsage());
  EXPECT_EQ(from.volumes(0).size(), fresh.volumes(0).size());
  EXPECT_THROW(from.fiberSegment(0), std::invalid_argument);
  EXPECT_TRUE(pairsOf(from).empty());
  EXPECT_TRUE(pairsOf(from, to).empty());
  EXPECT_TRUE(pairsOf(to, from).empty());
  const TriangleMesh mesh{MeshArrays<double>()};
  std::vector<TrianglePair> touching;
  from.find(Pairs(), mesh, touching);
  EXPECT_TRUE(touching.empty());

  const test::Assembly<double> none;
  std::vector<Contact> contacts, of_fresh;
  const FiberArrays<double> view_of_none = none.view();
  const Contacts<double> question{view_of_none};
  from.find(question, contacts);
  fresh.find(question, of_fresh);
  EXPECT_EQ(from.closest(question).distance, std::numeric_limits<double>::infinity());
  EXPECT_EQ(to.closest(Contacts<double>{fibers.view(), &view_of_none}, from).distance,
            std::numeric_limits<double>::infinity());
  EXPECT_TRUE(contacts.empty());
  for (FiberTree* tree : {&from, &fresh}) {
    EXPECT_THAT([&] { tree->find(Contacts<double>{fibers.view()}, contacts); },
                testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("other numbers")));
    EXPECT_THROW(tree->safeStep(), std::invalid_argument);
    EXPECT_THROW(tree->update(fibers.view()), std::invalid_argument);
    tree->build(fibers.view());
    EXPECT_EQ(pairsOf(*tree), pairsOf(to));
  }
}

}  // namespace
}  // namespace fcl_fibers
