// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "numerics/extreme_rows.h"
#include "numerics/specimen.h"

namespace fcl_fibers::test {
namespace {

/// The number of a row.
class ExtremeTest : public testing::TestWithParam<std::size_t> {};

template <typename S>
void expectRight(const ExtremeRow<S>& row) {
  for (const Form form : {Form::kArrays, Form::kObjects}) {
    const Specimen<S> specimen(row.fibers, form);
    const std::vector<NumberPair> touching = touchingPairs(specimen.truth(), row.margin);
    for (const FiberTreeOptions& options : allKinds(row.margin)) {
      std::vector<NumberPair> pairs;
      {
        const ScopedFlushToZero flush(row.flush_to_zero);
        pairs = specimen.pairs(options);
      }
      EXPECT_TRUE(options.report == Report::kCapsules || !pairs.empty()) << "the row shows nothing";
      const Findings findings = examine(specimen.truth(), touching, options, pairs);
      EXPECT_EQ(findings.missed, 0u)
          << describe(form, options) << ": " << findings.first_wrong << " of " << touching.size();
      EXPECT_EQ(findings.repeated, 0u) << describe(form, options) << ": " << findings.first_wrong;
      // Scenes that vanish altogether have nothing to tell their parts by.
      if (row.flush_to_zero) continue;
      EXPECT_EQ(findings.unpromised, 0u)
          << describe(form, options) << ": " << findings.first_wrong << " of " << pairs.size();
    }
  }
}

// Touching capsules would be missed, or others reported that the report's promise rules out.
TEST_P(ExtremeTest, Float) { expectRight(extremeRows<float>()[GetParam()]); }
TEST_P(ExtremeTest, Double) { expectRight(extremeRows<double>()[GetParam()]); }

INSTANTIATE_TEST_SUITE_P(Rows, ExtremeTest,
                         testing::Range(std::size_t{0}, extremeRows<double>().size()),
                         [](const testing::TestParamInfo<std::size_t>& info) {
                           return extremeRows<double>()[info.param].name;
                         });

}  // namespace
}  // namespace fcl_fibers::test
