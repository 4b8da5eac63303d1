// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/step.h"

#include <algorithm>
#include <stdexcept>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scene_support.h"

namespace fcl_fibers::scenes {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

std::vector<double> motions(const Step& step) {
  std::vector<double> result;
  for (std::size_t i = 0; i < step.start.points.size(); ++i) {
    result.push_back(distance(step.start.points[i], step.end.points[i]));
  }
  return result;
}

TEST(Step, MovesAsFarAsAskedFor) {
  // If this fails, figures are of another motion than they say.
  const auto parameters = parametersOf<CapParameters>(200, 50);
  for (const double radii : {5.0, 50.0, 480.0}) {
    const Step step = makeCapStep(parameters, radii);
    EXPECT_EQ(step.start.points, makeCap(parameters).points);
    EXPECT_EQ(step.start.point_begin, step.end.point_begin);
    double sum = 0;
    for (const double motion : motions(step)) sum += motion;
    EXPECT_NEAR(sum / static_cast<double>(step.start.points.size()) / parameters.radius, radii,
                0.011 * radii);
  }
}

TEST(Step, MovesEveryPointByItself) {
  // If this fails, hair moves as one piece, which is too easy. Roots are scattered, and do not move
  // otherwise.
  const auto parameters = parametersOf<CapParameters>(50, 10);
  const Step step = makeCapStep(parameters, 2);
  for (std::size_t f = 0; f < step.start.fiberCount(); ++f) {
    const std::size_t root = step.start.point_begin[f];
    EXPECT_NEAR(distance(step.start.points[root], step.end.points[root]), parameters.radius, 1e-9);
  }
  std::vector<double> found = motions(step);
  std::sort(found.begin(), found.end());
  EXPECT_GT(found.back(), 1.5 * found.front());
}

TEST(Step, TheSameSeedMakesTheSameStep) {
  // If this fails, a number cannot be measured again.
  auto parameters = parametersOf<CapParameters>(50, 10);
  const Step step = makeCapStep(parameters, 5);
  EXPECT_EQ(step.end.points, makeCapStep(parameters, 5).end.points);
  parameters.seed += 1;
  EXPECT_NE(step.end.points, makeCapStep(parameters, 5).end.points);
}

TEST(Step, RefusesMotionsThatThereAreNot) {
  // If this fails, the search for the number of frames does not end.
  const auto parameters = parametersOf<CapParameters>(5, 1);
  for (const double bad : {-1.0, 1.0, 1001.0}) {
    EXPECT_THAT([&] { makeCapStep(parameters, bad); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("ask for a mean motion")));
  }
  EXPECT_THAT([&] { makeCapStep(parameters, 1000); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("too short")));
}

}  // namespace
}  // namespace fcl_fibers::scenes
