// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/neuron.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <stdexcept>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scene_support.h"

namespace fcl_fibers::scenes {
namespace {

NeuronParameters withSeed(std::uint64_t seed, int frame = 0) {
  NeuronParameters parameters;
  parameters.seed = seed;
  parameters.frame = frame;
  return parameters;
}

// Branches would begin in the air, so that neighbours at a branching point count as contacts.
TEST(Neuron, IsOneTree) {
  for (const int frame : {0, 30}) {
    const FiberPolylines neuron = makeNeuron(withSeed(1, frame));
    ASSERT_EQ(neuron.starts_at.size(), neuron.fiberCount());
    EXPECT_EQ(neuron.starts_at[0], -1);
    std::size_t most = 0;
    std::map<std::size_t, std::size_t> branchings;  // by the last point of a fiber
    for (std::size_t f = 1; f < neuron.fiberCount(); ++f) {
      const auto at = static_cast<std::size_t>(neuron.starts_at[f]);
      ASSERT_LT(at, neuron.point_begin[f]);
      EXPECT_EQ(neuron.points[at], neuron.points[neuron.point_begin[f]]);
      const std::size_t count = at < 3 ? 0 : branchings.at(at) + 1;
      branchings[neuron.point_begin[f + 1] - 1] = count;
      most = std::max(most, count);
    }
    EXPECT_EQ(most, 6u);
  }
}

// The scene would not be what its description says.
TEST(Neuron, KeepsRallsRuleAndBecomesThinner) {
  const FiberPolylines neuron = makeNeuron(withSeed(2));
  ASSERT_TRUE(neuron.hasRadiiOfPoints());
  std::map<std::int32_t, double> power;  // of what starts at a point
  for (std::size_t f = 1; f < neuron.fiberCount(); ++f) {
    power[neuron.starts_at[f]] += std::pow(neuron.radii[neuron.point_begin[f]], 1.5);
    for (std::size_t i = neuron.point_begin[f] + 1; i < neuron.point_begin[f + 1]; ++i) {
      EXPECT_LT(neuron.radii[i], neuron.radii[i - 1]);
    }
  }
  std::size_t branchings = 0;
  for (const auto& [at, sum] : power) {
    if (at < 3) continue;
    EXPECT_NEAR(sum, std::pow(neuron.radii[static_cast<std::size_t>(at)], 1.5), 1e-12);
    ++branchings;
  }
  EXPECT_GT(branchings, 50u);
}

TEST(Neuron, DependsOnTheSeedAlone) {
  EXPECT_EQ(makeNeuron(withSeed(1)).points, makeNeuron(withSeed(1)).points);
  EXPECT_NE(makeNeuron(withSeed(1)).points, makeNeuron(withSeed(2)).points);
  EXPECT_NE(makeNeuron(withSeed(1)).points, makeNeuron(withSeed(1, 1)).points);
}

TEST(Neuron, RefusesParametersOutOfRange) {
  for (const auto& [fibers, segments] : {std::pair(0, 5), {5, 0}}) {
    EXPECT_THROW(makeNeuron(parametersOf<NeuronParameters>(fibers, segments)),
                 std::invalid_argument);
  }
}

}  // namespace
}  // namespace fcl_fibers::scenes
