// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>

#include <Eigen/Core>

#include "arrays/fiber_index.h"
#include "numerics/row_scenes.h"
#include "scenes/helix.h"
#include "support/volume_tests.h"

namespace fcl_fibers::test {
namespace {

/// What a query does, each per segment and pair that touches.
struct Work {
  double volume_tests, capsule_tests;
};

template <typename S>
Work workOf(const ExtremeRow<S>& row, const Assembly<S>& fibers) {
  const auto touching = static_cast<double>(countPairs(row, fibers));
  const ScopedFloatEnvironment scoped(row.environment);
  arrays::FiberIndex index(usualOptions(row.margin));
  index.build(fibers.view());
  const VolumeTests tests =
      std::visit([](const auto& tree) { return countVolumeTests(tree); }, index->tree());
  const double all = static_cast<double>(index.segments().size()) + touching;
  return {static_cast<double>(tests.tests) / all, static_cast<double>(tests.pairs) / all};
}

/// By how much the capsule tests of a row may exceed those of an ordinary scene of its size.
double mostCapsuleTests(const std::string& row) {
  // Boxes are around the thicker end of a cone, so where cones run obliquely few pairs touch.
  if (row == "TaperedParallel") return 10;
  // A part of these, or of one of their copies, is far smaller than its distance from the median
  // segment. To boxes, which are of float, it is one point, so all pairs of the part are tested.
  return row == "SubnormalBesideNormal" || row == "SizesFarApart" ? 25 : 8;
}

class RowCounts : public testing::TestWithParam<std::size_t> {
 protected:
  template <typename S>
  static void expectLittleWork() {
    constexpr std::size_t kWanted = 2000;
    const ExtremeRow<S>& row = extremeRows<S>()[GetParam()];
    if (!row.environment.isPossible()) {
      GTEST_SKIP() << "no SSE2, which flushes subnormals to zero";
    }
    const Assembly<S> fibers = repeated(row, kWanted);
    const Work work = workOf(row, fibers);
    const Work usual = workOf(extremeRows<S>().front(), ordinary<S>(fibers.capsules().size()));
    EXPECT_LT(work.volume_tests, 5 * usual.volume_tests);
    EXPECT_LT(work.capsule_tests, mostCapsuleTests(row.name) * usual.capsule_tests);
  }
};

// If these fail, a scene at an extreme takes far longer than others of its size, although its
// answer is right. The counts stand for the times in docs/numerics.md.
TEST_P(RowCounts, Float) { expectLittleWork<float>(); }
TEST_P(RowCounts, Double) { expectLittleWork<double>(); }

INSTANTIATE_TEST_SUITE_P(Rows, RowCounts,
                         testing::Range(std::size_t{0}, extremeRows<double>().size()),
                         [](const testing::TestParamInfo<std::size_t>& info) {
                           return extremeRows<double>()[info.param].name;
                         });

/// A strand of hair, 30 long and far less thick, and a ball that is registered before one of its
/// 1,000 fibers, if there is one.
Assembly<double> strandAndBall(std::size_t before, const Eigen::Vector3d& center) {
  const FiberPolylines scene = scenes::makeHelix({});
  Assembly<double> fibers;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    if (f == before) fibers.addBall({center.x(), center.y(), center.z()}, 1e-5);
    const auto begin = scene.points.begin();
    const auto from = static_cast<std::ptrdiff_t>(scene.point_begin[f]),
               to = static_cast<std::ptrdiff_t>(scene.point_begin[f + 1]);
    fibers.addFiber({begin + from, begin + to}, scene.radius);
  }
  return fibers;
}

TEST(RowCountsWithAStrayFiber, AreThoseWithoutIt) {
  // If this fails, an object far away, as a ball on the ground or a fiber that has exploded, makes
  // slabs of the blocks of all others, and a query takes up to a third longer.
  const ExtremeRow<double>& row = extremeRows<double>().front();
  const Work usual = workOf(row, strandAndBall(SIZE_MAX, Eigen::Vector3d::Zero()));
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-3, 2, 9)}) {
    for (const double away : {300.0, 3e4, 1e30}) {
      for (const std::size_t before : {0u, 437u, 999u}) {
        SCOPED_TRACE(std::to_string(away) + " away, before fiber " + std::to_string(before));
        const Work work = workOf(row, strandAndBall(before, away * direction));
        EXPECT_LT(work.volume_tests, 1.02 * usual.volume_tests);
        EXPECT_LT(work.capsule_tests, 1.02 * usual.capsule_tests);
      }
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::test
