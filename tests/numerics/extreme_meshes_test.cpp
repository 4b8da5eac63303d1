// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cfenv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "numerics/row_copies.h"
#include "numerics/row_judge.h"

namespace fcl_fibers::test {
namespace {

/// A mesh about the middle of a row, by parts of half the row's extent. Its numbers are those of
/// the fibers, so that what is flushed to zero of the one is of the other.
template <typename S>
class MeshInRow {
 public:
  MeshInRow(const Judge<S>& judge, const std::vector<Point>& parts,
            std::vector<std::int32_t> triangles)
      : triangles_(std::move(triangles)) {
    for (const Point& part : parts) {
      const Point p = judge.middle + judge.half.maxCoeff() * part;
      for (int axis = 0; axis < 3; ++axis) {
        numbers_.push_back(static_cast<S>(p[axis]));
        largest_ = std::max(largest_, std::fabs(p[axis]));
      }
    }
  }

  std::size_t count() const { return triangles_.size() / 3; }
  TriangleMesh mesh(TriangleMesh::Kind kind) const {
    return TriangleMesh(
        MeshArrays<S>{numbers_.data(), numbers_.size() / 3, triangles_.data(), count()}, kind);
  }
  Point corner(std::size_t triangle, std::size_t k) const {
    const S* const p = &numbers_[3 * static_cast<std::size_t>(triangles_[3 * triangle + k])];
    return {p[0], p[1], p[2]};
  }
  ExactTriangle operator[](std::size_t i) const {
    return {corner(i, 0), corner(i, 1), corner(i, 2)};
  }
  /// By which a distance to a triangle may be beyond contact: 1e-14 of the sizes, 1e-11 at a
  /// needle, and the coordinates, which posing rounds.
  Real excess(std::size_t i, Real sizes, Real least) const {
    return (isNeedle(i) ? 1e-11L : 1e-14L) * (sizes + lengthsOf(i)) + 64 * kEps * largest_ + least;
  }
  /// The error of the judge, which has to be far less.
  Real judging(std::size_t i, Real sizes) const { return excess(i, sizes, 0) * 0x1p-12L; }

 private:
  Real lengthsOf(std::size_t i) const {
    return (corner(i, 1) - corner(i, 0)).norm() + (corner(i, 2) - corner(i, 0)).norm();
  }
  bool isNeedle(std::size_t i) const {
    return (corner(i, 2) - corner(i, 1)).norm() < 0x1p-10L * lengthsOf(i);
  }

  std::vector<S> numbers_;
  std::vector<std::int32_t> triangles_;
  Real largest_ = 0;
};

/// Which pairs touch, and which are too near to contact to tell.
template <typename S>
void expectMesh(const Judge<S>& judge, const MeshInRow<S>& shape, TriangleMesh::Kind kind) {
  const bool is_solid = kind == TriangleMesh::Kind::kSolid;
  const auto isInside = [&](const Point& p) {
    for (std::size_t t = 0; is_solid && t < shape.count(); ++t) {
      const ExactTriangle triangle = shape[t];
      const Point normal = (triangle.b - triangle.a).cross(triangle.c - triangle.a);
      if (normal.dot(p - triangle.a) > 0) return false;
    }
    return is_solid;
  };
  for (const FiberTreeOptions& options : capsuleKinds(judge.row.margin)) {
    SCOPED_TRACE(describe(Form::kArrays, options) + (is_solid ? ", solid" : ""));
    std::vector<TrianglePair> pairs;
    std::vector<std::int32_t> segments;
    judge.ask([&] {
      const FiberTree tree = treeOf(judge.fibers, options);
      const TriangleMesh mesh = shape.mesh(kind);
      tree.find(Pairs{}, mesh, pairs);
      tree.find(TouchingSegments{}, mesh, segments);
    });
    std::set<std::pair<std::size_t, std::size_t>> found;
    std::set<std::int32_t> of_pairs;
    for (const TrianglePair& pair : pairs) {
      const auto triangle = static_cast<std::size_t>(pair.triangle);
      EXPECT_TRUE(found.emplace(judge.numberOf(pair.segment), triangle).second) << "twice";
      of_pairs.insert(pair.segment);
    }
    EXPECT_EQ(of_pairs.size(), segments.size());
    EXPECT_EQ(of_pairs, std::set<std::int32_t>(segments.begin(), segments.end()));
    for (std::size_t i = 0; i < judge.exact.size(); ++i) {
      const ExactCapsule& capsule = judge.exact[i];
      const Real reach = capsule.radius + judge.row.margin;
      const bool is_inside = isInside(capsule.a);
      for (std::size_t t = 0; t < shape.count(); ++t) {
        const Real distance = segmentTriangleDistance(capsule.a, capsule.b, shape[t]);
        const Real sizes = distance + judge.lengthOf(i);
        const bool is_found = found.count({i, t}) != 0;
        if (distance + shape.judging(t, sizes) <= reach || distance == 0) {
          EXPECT_TRUE(is_found) << "missed " << i << ", " << t;
        }
        // What is inside is found with the nearest triangle, wherever that is.
        if (is_found && !is_inside && !judge.vanishes()) {
          EXPECT_LE(distance, reach + shape.excess(t, sizes, judge.least)) << i << ", " << t;
        }
      }
      if (is_inside) {
        EXPECT_EQ(of_pairs.count(judge.points[i]), 1u) << "missed inside " << i;
      }
    }
  }
}

template <typename S>
void expectMeshes(const Judge<S>& judge) {
  // The last one is a needle.
  const MeshInRow<S> triangles(judge,
                               {{-1, -0.5L, 0.1L},
                                {1, -0.4L, -0.1L},
                                {0.1L, 0.9L, 0.2L},
                                {-0.3L, 0, -1},
                                {0.2L, -0.1L, 1},
                                {0, 0.5L, 0.1L},
                                {-1, -1, -1},
                                {1, 1, 1},
                                {1 + 0x1p-20L, 1 - 0x1p-20L, 1}},
                               {0, 1, 2, 3, 4, 5, 6, 7, 8});
  const MeshInRow<S> tetrahedron(
      judge, {{0.5L, 0.5L, 0.5L}, {-0.5L, -0.5L, 0.5L}, {-0.5L, 0.5L, -0.5L}, {0.5L, -0.5L, -0.5L}},
      {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3});
  if (judge.isTooLarge()) {
    EXPECT_THAT([&] { triangles.mesh(TriangleMesh::Kind::kSurface); },
                testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("2^1000")));
    return;
  }
  expectMesh(judge, triangles, TriangleMesh::Kind::kSurface);
  expectMesh(judge, tetrahedron, TriangleMesh::Kind::kSolid);
}

template <typename S>
void expectThreads(const ExtremeRow<S>& row) {
  constexpr int kSide = 3;
  const Copies<S> copies(row.fibers, row.margin, kSide);
  // Copies would be beyond the range of double, or within a margin of half that range.
  const bool is_impossible =
      (std::is_same_v<S, double> && row.name == "NearOverflow") || row.name == "MarginNearOverflow";
  ASSERT_EQ(copies.is_possible, !is_impossible);
  if (is_impossible) return;
  // All 3,888 segments would be one point, and all their pairs be reported.
  if (row.name == "SubnormalFlushedToZero") return;
  const Judge<S> judge(row, copies.one);
  const TouchOracle truth(copies.all.capsules());
  const auto segments = static_cast<std::int32_t>(judge.truth.size());
  std::vector<NumberPair> touching;
  for (std::int32_t copy = 0; copy < kSide * kSide * kSide; ++copy) {
    for (const NumberPair& pair : judge.touching()) {
      touching.push_back({copy * segments + pair.a, copy * segments + pair.b});
    }
  }
  for (FiberTreeOptions options : capsuleKinds(row.margin)) {
    // What bounds the nodes of the one topology does not matter to how the work is split.
    if (isOfBoxes(options) != (options.topology == Topology::kBundle)) continue;
    SCOPED_TRACE(describe(Form::kArrays, options));
    std::vector<std::int32_t> names;
    // Asked on one thread, and on several; and on several after others have done all else, which
    // round to nearest, as threads round as the one that first needed them.
    const std::size_t runs = row.environment.rounding == FE_TONEAREST ? 2 : 3;
    std::vector<NumberPair> pairs[3];
    std::vector<SegmentPair> found;
    for (std::size_t k = 0; k < runs; ++k) {
      options.threads = k == 0 ? 1 : 3;
      FloatEnvironment before = row.environment;
      if (k == 2) before.rounding = FE_TONEAREST;
      const ScopedFloatEnvironment outer(before);
      const FiberTree tree = treeOf(copies.all, options);
      names = tree.segments();
      if (k == 2) tree.find(Pairs{}, found);
      const ScopedFloatEnvironment inner(row.environment);
      tree.visit(Pairs{}, [&](SegmentPair pair) { pairs[k].push_back({pair.a, pair.b}); });
    }
    EXPECT_TRUE(pairs[0] == pairs[1]) << pairs[0].size() << ", " << pairs[1].size();
    for (std::size_t k = 1; k < runs; ++k) {
      for (NumberPair& pair : pairs[k]) {
        for (std::int32_t* one : {&pair.a, &pair.b}) {
          *one = static_cast<std::int32_t>(std::lower_bound(names.begin(), names.end(), *one) -
                                           names.begin());
        }
      }
      const Findings findings = examine(truth, touching, options, std::move(pairs[k]));
      EXPECT_EQ(findings.missed + findings.repeated, 0u) << findings.first_wrong;
      if (!judge.vanishes()) {
        EXPECT_EQ(findings.unpromised, 0u) << findings.first_wrong;
      }
    }
  }
}

template <typename S>
void expectAll(std::size_t number) {
  const ExtremeRow<S>& row = extremeRows<S>()[number];
  if (!row.environment.isPossible()) {
    GTEST_SKIP() << "no SSE2, which flushes subnormals to zero";
  }
  expectMeshes(Judge<S>(row));
  expectThreads(row);
}

class ExtremePartners : public testing::TestWithParam<std::size_t> {};

// Triangles in a row would be missed, or found from afar; or pairs be lost between threads.
TEST_P(ExtremePartners, Float) { expectAll<float>(GetParam()); }
TEST_P(ExtremePartners, Double) { expectAll<double>(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Rows, ExtremePartners,
                         testing::Range(std::size_t{0}, extremeRows<double>().size()),
                         [](const testing::TestParamInfo<std::size_t>& info) {
                           return extremeRows<double>()[info.param].name;
                         });

}  // namespace
}  // namespace fcl_fibers::test
