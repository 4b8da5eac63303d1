// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cfenv>
#include <cstddef>
#include <cstdint>
#include <set>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "numerics/row_copies.h"
#include "numerics/row_judge.h"
#include "numerics/row_meshes.h"

namespace fcl_fibers::test {
namespace {

template <typename S>
void expectMesh(const Judge<S>& judge, const MeshInRow<S>& shape, TriangleMesh::Kind kind) {
  const bool is_solid = kind == TriangleMesh::Kind::kSolid;
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
      expectTouching(judge, i, shape, is_solid, found);
    }
  }
}

template <typename S>
void expectMeshes(const Judge<S>& judge) {
  const MeshInRow<S> triangles = trianglesIn(judge), tetrahedron = tetrahedronIn(judge);
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
  const bool is_impossible = (std::is_same_v<S, double> &&
                              (row.name == "NearOverflow" || row.name == "TaperedNearOverflow")) ||
                             row.name == "MarginNearOverflow";
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
