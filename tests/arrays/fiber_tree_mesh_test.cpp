// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/array_fibers.h"
#include "arrays/meshes.h"
#include "support/exact_geometry.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

using Volumes = FiberTreeOptions::Volumes;

/// The library rounds towards touching, by a few ulp of the coordinates, which are below 4.
constexpr Real kRounding = 1e-13L;

/// The distance of a capsule's axis from the triangles of a mesh, less its radius.
template <typename S>
class Gaps {
 public:
  Gaps(const Assembly<S>& fibers, const Triangles<S>& mesh, const MeshPose& pose) {
    for (std::size_t t = 0; t < mesh.count(); ++t) triangles_.push_back(mesh.triangle(t, pose));
    fibers.visitCapsules([&](std::size_t fiber, std::size_t i) {
      const ExactCapsule capsule = roundedCapsule(fibers.capsule(i));
      std::vector<Real> gaps;
      for (const ExactTriangle& t : triangles_) {
        gaps.push_back(segmentTriangleDistance(capsule.a, capsule.b, t) - capsule.radius);
      }
      rows_.push_back({fiber, static_cast<std::int32_t>(i), std::move(gaps)});
    });
  }

  struct Row {
    std::size_t fiber;
    std::int32_t segment;
    std::vector<Real> gaps;  ///< by triangle
  };
  const std::vector<Row>& rows() const { return rows_; }

  /// Compares the pairs with those at most `margin` apart.
  void expect(const PairList& pairs, Real margin) const {
    std::size_t next = 0;
    for (const Row& row : rows_) {
      for (std::size_t t = 0; t < row.gaps.size(); ++t) {
        const std::pair pair(row.segment, static_cast<std::int32_t>(t));
        const bool found = next < pairs.size() && pairs[next] == pair;
        if (found) ++next;
        if (row.gaps[t] <= margin) {
          ASSERT_TRUE(found) << "misses segment " << pair.first << " and triangle " << pair.second;
        } else if (row.gaps[t] > margin + kRounding) {
          ASSERT_FALSE(found) << "segment " << pair.first << " is apart from " << pair.second;
        }
      }
    }
    EXPECT_EQ(next, pairs.size());
  }

 private:
  std::vector<ExactTriangle> triangles_;
  std::vector<Row> rows_;
};

PairList meshPairsOf(const FiberTree& tree, const TriangleMesh& mesh) {
  PairList pairs;
  tree.visit(Pairs{}, mesh,
             [&](TrianglePair pair) { pairs.emplace_back(pair.segment, pair.triangle); });
  std::sort(pairs.begin(), pairs.end());
  EXPECT_EQ(std::adjacent_find(pairs.begin(), pairs.end()), pairs.end()) << "a pair came twice";
  return pairs;
}

PairList nearestOf(const FiberTree& tree, const TriangleMesh& mesh, double distance) {
  std::vector<TrianglePair> found;
  tree.find(Nearest{distance}, mesh, found);
  PairList pairs;
  for (const TrianglePair& pair : found) pairs.emplace_back(pair.segment, pair.triangle);
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

template <typename S>
FiberTree treeOf(const FiberArrays<S>& fibers, const FiberTreeOptions& options = FiberOptions{
                                                   Topology::kBundle, Report::kCapsules}) {
  FiberTree tree(options);
  tree.build(fibers);
  return tree;
}

std::vector<MeshPose> poses() {
  MeshPose moved;
  moved.position = {0.1, -0.2, 0.05};
  return {MeshPose(), moved, randomPose(5, 0.1), randomPose(6, 0.1)};
}

template <typename S>
class FiberTreeMesh : public testing::Test {};
TYPED_TEST_SUITE(FiberTreeMesh, Scalars, ScalarName);

TYPED_TEST(FiberTreeMesh, VisitsEveryTriangleThatASegmentTouches) {
  using S = TypeParam;
  const auto fibers = curledFibers<S>(1, 20);
  for (const Triangles<S>& triangles : {soup<S>(2, 200, 0.4), ball<S>(0.35, 8, 12)}) {
    TriangleMesh mesh(triangles.view());
    for (const MeshPose& pose : poses()) {
      mesh.setPose(pose);
      const Gaps<S> gaps(fibers, triangles, pose);
      for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
        for (const double margin : {0.0, 0.02}) {
          options.margin = margin;
          options.threads = margin > 0 ? 3 : 1;
          const PairList pairs = meshPairsOf(treeOf(fibers.view(), options), mesh);
          EXPECT_GT(pairs.size(), 20u);
          gaps.expect(pairs, margin);
        }
      }
    }
  }
}

// A pose may be skewed a little, which stretches margins differently along each axis.
TEST(FiberTreeMeshTest, FindsWhatIsWithinTheMarginOfASkewedMesh) {
  MeshPose pose;
  pose.rotation = {1.002, 0, 0, 0, 1, 0, 0, 0, 0.998};
  Triangles<double> sheet;
  for (int i = 0; i < 100; ++i) {
    const double x = 0.2 * (i % 10), y = 0.2 * (i / 10);
    const std::int32_t first = sheet.addPoint({x, y, 0});
    sheet.addPoint({x + 0.2, y, 0});
    sheet.addPoint({x, y + 0.2, 0});
    sheet.addTriangle(first, first + 1, first + 2);
  }
  TriangleMesh mesh(sheet.view());
  mesh.setPose(pose);
  Assembly<double> fibers;
  for (int i = 0; i < 100; ++i) {
    const double x = 0.2 * (i % 10) + 0.02, y = 0.2 * (i / 10) + 0.02;
    fibers.addFiber({{x, y, 0.9999}, {x + 0.1, y + 0.01, 0.9999}}, 0);
  }
  for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
    options.margin = 1;
    std::vector<std::int32_t> touching;
    treeOf(fibers.view(), options).find(TouchingSegments{}, mesh, touching);
    EXPECT_EQ(touching.size(), 100u);
  }
}

// A search with many tasks fits the tree of a turned mesh to the posed triangles.
TEST(FiberTreeMeshTest, FindsAllTrianglesOfALargeTurnedMesh) {
  const auto fibers = curledFibers<double>(31, 24);
  const auto triangles = ball<double>(0.35, 24, 36);
  const MeshPose pose = randomPose(32, 0.05);
  TriangleMesh mesh(triangles.view());
  mesh.setPose(pose);
  const Gaps<double> gaps(fibers, triangles, pose);
  for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
    options.threads = 2;
    gaps.expect(meshPairsOf(treeOf(fibers.view(), options), mesh), 0);
  }
}

TYPED_TEST(FiberTreeMesh, FindsEachTouchingSegmentOnce) {
  using S = TypeParam;
  const auto fibers = curledFibers<S>(3, 80);
  const auto triangles = ball<S>(0.3, 20, 30);
  TriangleMesh mesh(triangles.view());
  mesh.setPose(randomPose(4, 0.1));
  for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
    std::set<std::int32_t> touching;
    for (const auto& [segment, triangle] : meshPairsOf(treeOf(fibers.view(), options), mesh)) {
      touching.insert(segment);
    }
    std::vector<std::int32_t> found, found_by_three;
    treeOf(fibers.view(), options).find(TouchingSegments{}, mesh, found);
    options.threads = 3;
    treeOf(fibers.view(), options).find(TouchingSegments{}, mesh, found_by_three);
    EXPECT_EQ(found, found_by_three);
    EXPECT_THAT(found, testing::UnorderedElementsAreArray(touching));
  }
}

TYPED_TEST(FiberTreeMesh, ASolidCountsWhatIsInside) {
  using S = TypeParam;
  const auto fibers = curledFibers<S>(9, 28);
  const auto triangles = ball<S>(0.3, 8, 10);
  TriangleMesh solid(triangles.view(), TriangleMesh::Kind::kSolid);
  for (const MeshPose& pose : poses()) {
    const double margin = pose.position[0] < 0.05 ? 0 : 0.06;
    solid.setPose(pose);
    const Gaps<S> gaps(fibers, triangles, pose);
    // The bumpy ball is star-shaped: a point is inside if the segment to the middle meets no
    // triangle.
    const test::Point middle(pose.position[0], pose.position[1], pose.position[2]);
    std::set<std::int32_t> expected;
    std::size_t inside = 0;
    for (const auto& row : gaps.rows()) {
      const bool touches = *std::min_element(row.gaps.begin(), row.gaps.end()) <= margin;
      const auto& end = fibers.point(static_cast<std::size_t>(row.segment));
      const test::Point from(end[0], end[1], end[2]);
      bool is_inside = true;
      for (std::size_t t = 0; is_inside && t < triangles.count(); ++t) {
        is_inside = segmentTriangleDistance(from, middle, triangles.triangle(t, pose)) > 0;
      }
      if (!touches && is_inside) ++inside;
      if (touches || is_inside) expected.insert(row.segment);
    }
    EXPECT_GT(inside, 5u);
    for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
      options.margin = margin;
      std::vector<std::int32_t> found;
      const FiberTree tree = treeOf(fibers.view(), options);
      tree.find(TouchingSegments{}, solid, found);
      EXPECT_THAT(found, testing::UnorderedElementsAreArray(expected));
      // A segment that touches no triangle comes with its nearest.
      for (const auto& [segment, triangle] : meshPairsOf(tree, solid)) {
        const auto row = std::find_if(gaps.rows().begin(), gaps.rows().end(),
                                      [s = segment](const auto& r) { return r.segment == s; });
        const Real least = *std::min_element(row->gaps.begin(), row->gaps.end());
        const Real gap = row->gaps[static_cast<std::size_t>(triangle)];
        ASSERT_TRUE(gap <= margin + kRounding || gap <= least + kRounding) << segment;
      }
    }
  }
}

TYPED_TEST(FiberTreeMesh, FindsTheNearestTriangleOfEachSegment) {
  using S = TypeParam;
  const auto fibers = curledFibers<S>(10, 12);
  const auto triangles = ball<S>(0.2, 12, 16);
  TriangleMesh mesh(triangles.view());
  for (const MeshPose& pose : poses()) {
    mesh.setPose(pose);
    const Gaps<S> gaps(fibers, triangles, pose);
    for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
      options.threads = 2;
      options.margin = 0.5;  // it does not count
      const FiberTree tree = treeOf(fibers.view(), options);
      for (const double distance : {0.0, 0.1, std::numeric_limits<double>::infinity()}) {
        std::vector<TrianglePair> pairs;
        tree.find(Nearest{distance}, mesh, pairs);
        std::vector<std::int32_t> triangle_of(fibers.pointCount(), -1);
        for (const TrianglePair& pair : pairs) {
          auto& triangle = triangle_of[static_cast<std::size_t>(pair.segment)];
          EXPECT_EQ(triangle, -1) << "twice";
          triangle = pair.triangle;
        }
        for (const auto& row : gaps.rows()) {
          const Real least = *std::min_element(row.gaps.begin(), row.gaps.end());
          const std::int32_t found = triangle_of[static_cast<std::size_t>(row.segment)];
          if (least <= distance) {
            ASSERT_GE(found, 0) << row.segment;
          }
          if (least > distance + kRounding) {
            ASSERT_EQ(found, -1) << row.segment;
          }
          if (found >= 0) {
            ASSERT_LE(row.gaps[static_cast<std::size_t>(found)], least + kRounding);
          }
        }
      }
    }
  }
}

TEST(FiberTreeMesh, FindsWhatItTouchesAtDistanceZero) {
  // Fibers without thickness that cross triangles are not found otherwise: about the origin, far
  // from it, and all in one point.
  auto fibers = curledFibers<double>(15, 40);
  std::fill(fibers.radii.begin(), fibers.radii.end(), 0.0);
  auto triangles = ball<double>(0.3, 12, 16);
  for (const auto& [scale, offset] :
       {std::pair(1.0, 0.0), std::pair(1.0, 1e3), std::pair(0.0, 0.0)}) {
    for (double& x : fibers.points) x = scale * x + offset;
    for (double& x : triangles.points) x = scale * x + offset;
    const TriangleMesh mesh(triangles.view());
    for (const FiberTreeOptions& options : allKinds(Report::kCapsules)) {
      const FiberTree tree = treeOf(fibers.view(), options);
      std::vector<std::int32_t> touching;
      tree.find(TouchingSegments{}, mesh, touching);
      std::vector<TrianglePair> pairs;
      tree.find(Nearest{0}, mesh, pairs);
      std::set<std::int32_t> found;
      for (const TrianglePair& pair : pairs) found.insert(pair.segment);
      EXPECT_GT(touching.size(), 20u);
      for (const std::int32_t segment : touching) EXPECT_EQ(found.count(segment), 1u) << segment;
    }
  }
}

TEST(FiberTreeMesh, FindsTheNearestWhateverTheSizes) {
  // A row of triangles, the first of which is nearest to a fiber at the origin.
  Triangles<double> row;
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d p(5 + 3 * i, 0, 0.1 * i);
    const std::int32_t first = row.addPoint(p);
    row.addPoint(p + Eigen::Vector3d::UnitX());
    row.addPoint(p + Eigen::Vector3d::UnitY());
    row.addTriangle(first, first + 1, first + 2);
  }
  const auto times = [](std::vector<double> numbers, double size) {
    for (double& x : numbers) x *= size;
    return numbers;
  };
  const double sizes[] = {1e-140, 1e-70, 1, 1e70, 1e140};
  for (const double fiber_size : {1e-300, 1e-140, 1e-70, 1.0, 1e70, 1e140}) {
    auto fibers = curledFibers<double>(16, 5);
    fibers.points = times(fibers.points, fiber_size);
    fibers.radii = times(fibers.radii, fiber_size);
    for (const double mesh_size : sizes) {
      Triangles<double> triangles = row;
      triangles.points = times(row.points, mesh_size);
      TriangleMesh mesh(triangles.view());
      for (const MeshPose& pose : {MeshPose(), randomPose(17, 0)}) {
        mesh.setPose(pose);
        for (const FiberTreeOptions& options : allKinds(Report::kCapsules)) {
          std::vector<TrianglePair> pairs;
          const FiberTree tree = treeOf(fibers.view(), options);
          const auto search = [&] {
            tree.find(Nearest{std::numeric_limits<double>::infinity()}, mesh, pairs);
          };
          if (std::isinf(mesh_size / fiber_size)) {
            ASSERT_THROW(search(), std::invalid_argument);
            continue;
          }
          search();
          ASSERT_EQ(pairs.size(), tree.segmentCount()) << fiber_size << " " << mesh_size;
          // To a fiber that is far larger, all triangles are one point.
          if (fiber_size > mesh_size) continue;
          for (const TrianglePair& pair : pairs) ASSERT_EQ(pair.triangle, 0);
        }
      }
    }
  }
}

TEST(FiberTreeMesh, RootsAndCategoriesLeaveSegmentsOut) {
  const auto fibers = curledFibers<double>(11, 60);
  const auto triangles = ball<double>(0.3, 16, 24);
  TriangleMesh mesh(triangles.view());
  mesh.setPose(randomPose(12, 0.05));
  mesh.setCategories(0b0110);
  mesh.setMeets(0b0011);
  FiberArrays<double> arrays = fibers.view();
  std::vector<std::uint32_t> meets, categories;
  std::vector<std::int32_t> roots = rootSegments(arrays, 0.2);
  for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
    meets.push_back(f % 3 == 0 ? 0b1001 : f % 3 == 1 ? 0b0100 : ~0u);
    categories.push_back(f % 4 == 0 ? 0b0100 : f % 4 == 1 ? 0b0110 : ~0u);
  }
  const auto isAllowed = [&](std::int32_t segment) {
    const auto point = static_cast<std::size_t>(segment);
    const std::size_t fiber = fibers.fiberOf(point);
    const auto number = static_cast<std::int32_t>(point - fibers.point_begin[fiber]);
    return number >= roots[fiber] && (meets[fiber] & 0b0110) != 0 &&
           (categories[fiber] & 0b0011) != 0;
  };
  for (const FiberTreeOptions& options : allKinds(Report::kCapsules)) {
    const FiberTree all = treeOf(arrays, options);
    const auto allowed = [&](PairList pairs) {
      const std::size_t before = pairs.size();
      pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                                 [&](const auto& pair) { return !isAllowed(pair.first); }),
                  pairs.end());
      EXPECT_GT(pairs.size(), 10u);
      EXPECT_LT(pairs.size(), before);
      return pairs;
    };
    FiberArrays<double> ruled = arrays;
    ruled.meets = meets.data();
    ruled.categories = categories.data();
    ruled.root_segments = roots.data();
    const FiberTree tree = treeOf(ruled, options);
    EXPECT_EQ(meshPairsOf(tree, mesh), allowed(meshPairsOf(all, mesh)));
    EXPECT_EQ(nearestOf(tree, mesh, 10), allowed(nearestOf(all, mesh, 10)));
    // Shapes meet them all.
    const auto inBox = [](const FiberTree& asked) {
      return pairsFrom([&](auto&& visit) {
        asked.visit(Pairs{}, BoxShape{{-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}},
                    [&](std::int32_t segment) {
                      visit(SegmentPair{segment, 0});
                    });
      });
    };
    EXPECT_EQ(inBox(tree), inBox(all));
  }
}

TEST(FiberTreeMesh, MeshesOfAnySizeAndPlaceAreRight) {
  const auto near = curledFibers<double>(14, 10);
  for (const double scale : {1e-150, 1.0, 1e150}) {
    for (const double offset : {0.0, 1e6}) {
      auto fibers = near;
      auto triangles = ball<double>(0.3, 12, 16);
      for (double& x : fibers.points) x = scale * (x + offset);
      for (double& r : fibers.radii) r *= scale;
      for (double& x : triangles.points) x = scale * (x + offset);
      const TriangleMesh mesh(triangles.view());
      const PairList pairs = meshPairsOf(treeOf(fibers.view()), mesh);
      EXPECT_FALSE(pairs.empty()) << scale << " " << offset;
      std::size_t touching = 0;
      fibers.visitCapsules([&](std::size_t, std::size_t i) {
        const ExactCapsule capsule = roundedCapsule(fibers.capsule(i));
        for (std::size_t t = 0; t < triangles.count(); ++t) {
          const Real gap = segmentTriangleDistance(capsule.a / scale, capsule.b / scale,
                                                   {triangles.triangle(t, {}).a / scale,
                                                    triangles.triangle(t, {}).b / scale,
                                                    triangles.triangle(t, {}).c / scale}) -
                           capsule.radius / scale;
          const bool found = std::binary_search(
              pairs.begin(), pairs.end(),
              std::pair(static_cast<std::int32_t>(i), static_cast<std::int32_t>(t)));
          if (gap <= 0) {
            ASSERT_TRUE(found);
          }
          // Far from the origin an ulp of the coordinates is 1e-10 of the scene.
          if (gap > (offset > 0 ? 1e-8L : kRounding)) {
            ASSERT_FALSE(found);
          }
          touching += found ? 1 : 0;
        }
      });
      EXPECT_EQ(touching, pairs.size());
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::test
