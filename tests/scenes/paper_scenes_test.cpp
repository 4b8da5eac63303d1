// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/paper_scenes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include "scenes/cap.h"
#include "scenes/cosserat_rod.h"
#include "scenes/helix.h"

#include "scene_support.h"
#include "support/touch_oracle.h"

namespace fcl_fibers::scenes {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

FiberPolylines make(const HelixParameters& parameters) { return makeHelix(parameters); }
FiberPolylines make(const CapParameters& parameters) { return makeCap(parameters); }
FiberPolylines make(const PaperStaticParameters& parameters) { return makePaperStatic(parameters); }
FiberPolylines make(const PaperDynamicParameters& parameters) {
  return PaperDynamic(parameters).scene(60);
}
FiberPolylines make(const PaperHalfScalpParameters& parameters) {
  return makePaperHalfScalp(parameters);
}
FiberPolylines make(const PaperStrandParameters& parameters) { return makePaperStrand(parameters); }

const char* callOf(const HelixParameters&) { return "makeHelix: "; }
const char* callOf(const CapParameters&) { return "makeCap: "; }
const char* callOf(const PaperStaticParameters&) { return "makePaperStatic: "; }
const char* callOf(const PaperDynamicParameters&) { return "PaperDynamic: "; }
const char* callOf(const PaperHalfScalpParameters&) { return "makePaperHalfScalp: "; }
const char* callOf(const PaperStrandParameters&) { return "makePaperStrand: "; }

double fiberLength(const HelixParameters&) { return 30; }
double fiberLength(const PaperStaticParameters&) { return 15; }
double fiberLength(const PaperDynamicParameters&) { return 15; }
double fiberLength(const PaperHalfScalpParameters&) { return 15; }
double fiberLength(const PaperStrandParameters&) { return 30; }

double farthestMotion(const FiberPolylines& a, const FiberPolylines& b) {
  double farthest = 0;
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    farthest = std::max(farthest, distance(a.points[i], b.points[i]));
  }
  return farthest;
}

/// touchingPairs() by brute force, which shares nothing with the library.
std::size_t trulyTouchingPairs(const FiberPolylines& scene, std::size_t ignored) {
  std::vector<test::GivenCapsule> capsules;
  std::vector<std::pair<std::size_t, std::size_t>> places;  // fiber and segment
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i) {
      capsules.push_back({scene.points[i], scene.points[i + 1], scene.radiusAt(i)});
      places.emplace_back(f, i);
    }
  }
  std::size_t pairs = 0;
  test::TouchOracle(std::move(capsules)).visitNearPairs(0, [&](auto a, auto b, auto verdict) {
    const bool neighbors =
        places[a].first == places[b].first && places[b].second - places[a].second <= ignored;
    pairs += verdict.touching && !neighbors;
  });
  return pairs;
}

template <typename Parameters>
class EveryScene : public testing::Test {};
using AllScenes =
    testing::Types<HelixParameters, CapParameters, PaperStaticParameters, PaperDynamicParameters,
                   PaperHalfScalpParameters, PaperStrandParameters>;
TYPED_TEST_SUITE(EveryScene, AllScenes, );

/// A fiber's length does not depend on its number of segments.
template <typename Parameters>
class ScenesOfOneLength : public testing::Test {};
using AllOfOneLength =
    testing::Types<HelixParameters, PaperStaticParameters, PaperDynamicParameters,
                   PaperHalfScalpParameters, PaperStrandParameters>;
TYPED_TEST_SUITE(ScenesOfOneLength, AllOfOneLength, );

TYPED_TEST(EveryScene, HaveTheFibersAndSegmentsAskedFor) {
  // If this fails, a scene is not of the size it is named after. 7 and 300 segments are solved at
  // more points, 2,000 at fewer than they have.
  for (const int segments : {1, 7, 300, 2000}) {
    const FiberPolylines scene = make(parametersOf<TypeParam>(3, segments));
    const auto points = static_cast<std::size_t>(segments) + 1;
    EXPECT_EQ(scene.radius, 0.0035);
    EXPECT_EQ(scene.fiberCount(), 3U);
    EXPECT_EQ(scene.segmentCount(), 3 * (points - 1));
    EXPECT_THAT(scene.point_begin, testing::ElementsAre(0, points, 2 * points, 3 * points));
    EXPECT_EQ(scene.points.size(), 3 * points);
  }
}

TYPED_TEST(ScenesOfOneLength, FibersKeepTheirLengthInSegmentsOfOneLength) {
  // If this fails, fibers are stretched, or their points are not of equal arc length.
  const auto parameters = parametersOf<TypeParam>(20, 2000);
  const FiberPolylines scene = make(parameters);
  const double length = fiberLength(parameters);
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    double sum = 0;
    for (std::size_t i = scene.point_begin[f] + 1; i < scene.point_begin[f + 1]; ++i) {
      const double segment = distance(scene.points[i - 1], scene.points[i]);
      ASSERT_NEAR(segment, length / 2000, 1e-5 * length / 2000);
      sum += segment;
    }
    // Chords are shorter than arcs by (curvature * step)^2 / 24, at most 5e-6 of the length.
    EXPECT_NEAR(sum, length, 1e-5 * length);
  }
}

TYPED_TEST(ScenesOfOneLength, SegmentsDoNotChangeTheFibers) {
  // If this fails, scenes of different resolution cannot be compared.
  const FiberPolylines coarse = make(parametersOf<TypeParam>(5, 100));
  const FiberPolylines fine = make(parametersOf<TypeParam>(5, 800));
  for (std::size_t f = 0; f < 5; ++f) {
    for (std::size_t i = 0; i <= 100; ++i) {
      EXPECT_LE(distance(coarse.points[f * 101 + i], fine.points[f * 801 + 8 * i]), 1e-4);
    }
  }
}

TYPED_TEST(EveryScene, SameSeedSameBytes) {
  // If this fails, no result about a scene can be repeated.
  auto parameters = parametersOf<TypeParam>(30, 50);
  parameters.seed = 42;
  const FiberPolylines scene = make(parameters);
  EXPECT_EQ(make(parameters).points, scene.points);
  parameters.seed = 43;
  const FiberPolylines other = make(parameters);
  for (std::size_t i = 0; i < scene.points.size(); ++i) EXPECT_NE(other.points[i], scene.points[i]);
}

TYPED_TEST(EveryScene, RefuseSizesAndRadiiThatAreNone) {
  // If this fails, a mistyped size gives an empty scene or a crash.
  const auto expectRefusal = [](const TypeParam& parameters, const std::string& text) {
    EXPECT_THAT([&] { make(parameters); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(callOf(parameters) + text)));
  };
  for (const int bad : {0, -1, std::numeric_limits<int>::min()}) {
    const std::string remedy = " is " + std::to_string(bad) + "; ask for";
    expectRefusal(parametersOf<TypeParam>(bad, 1), "fibers" + remedy);
    expectRefusal(parametersOf<TypeParam>(1, bad), "segments" + remedy);
  }
  auto parameters = parametersOf<TypeParam>(1, 1);
  for (const auto& [bad, text] :
       {std::pair(-0.1, "-0.1"), {std::nan(""), "nan"}, {HUGE_VAL, "inf"}}) {
    parameters.radius = bad;
    expectRefusal(parameters, std::string("radius is ") + text + "; give a finite");
  }
}

TYPED_TEST(EveryScene, TouchesAreCountedRight) {
  // If this fails, the numbers of touching pairs that are held below are not those of the scene.
  auto parameters = parametersOf<TypeParam>(40, 60);
  parameters.radius = 0.05;  // as few fibers of the strand's are too far from each other for hairs
  const FiberPolylines scene = make(parameters);
  const std::size_t truly = trulyTouchingPairs(scene, 1);
  EXPECT_GT(truly, 20U);
  EXPECT_EQ(touchingPairs(scene, 1), truly);
}

template <typename Parameters>
class MovingPaperScenes : public testing::Test {};
using MovingCases =
    testing::Types<PaperStaticParameters, PaperHalfScalpParameters, PaperStrandParameters>;
TYPED_TEST_SUITE(MovingPaperScenes, MovingCases, );

TYPED_TEST(MovingPaperScenes, FramesMoveALittle) {
  // If this fails, a frame is no small motion, or none: at most the diameter of a pencil, at least
  // that of a hair.
  auto parameters = parametersOf<TypeParam>(20, 50);
  for (const int frame : {-1, 0, 1000}) {
    parameters.frame = frame;
    const FiberPolylines still = make(parameters);
    ++parameters.frame;
    const FiberPolylines moved = make(parameters);
    EXPECT_LE(farthestMotion(still, moved), 0.7);
    EXPECT_GE(farthestMotion(still, moved), 0.007);
    for (std::size_t f = 0; f < still.fiberCount(); ++f) {
      EXPECT_EQ(still.points[still.point_begin[f]], moved.points[moved.point_begin[f]]);
    }
  }
}

TEST(PaperScenes, TouchAsOftenAsTheirHeadersSay) {
  // If this fails, a scene is denser or sparser than the one it stands for, or whose times are
  // published: a strand has 23,000 in the papers. Of the half scalp only 5,000 fibers in the middle
  // of the area, as the whole takes seconds.
  expectTouches(makePaperStatic({}), 14752);
  expectTouches(makePaperHalfScalp(parametersOf<PaperHalfScalpParameters>(5000, 50)), 40299);
  expectTouches(makePaperStrand({}), 21602);
  // A second neighbour along the fiber must not be among the pairs.
  const FiberPolylines small = makePaperStrand(parametersOf<PaperStrandParameters>(100, 2000));
  EXPECT_GT(touchingPairs(small, 1), 100U);
  EXPECT_EQ(touchingPairs(small, 1), touchingPairs(small, 2));
}

// Left to the long run. The papers' half scalp has 550,000, twice the strand's fibers 80,000.
TEST(PaperScenes, DISABLED_LongTouchAsOftenAsThePapers) {
  expectTouches(makePaperHalfScalp({}), 550980);
  expectTouches(makePaperStrand(parametersOf<PaperStrandParameters>(2000, 2000)), 80721);
}

TEST(PaperScenes, RefuseMoreFibersThanTheyHaveRoomFor) {
  // If this fails, roots lie on the other half or deeper than the area asks for, or the search for
  // a free root never ends.
  EXPECT_THAT([] { makePaperHalfScalp(parametersOf<PaperHalfScalpParameters>(50001, 1)); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("fibers is 50001; ask for no more")));
  EXPECT_THAT([] { makePaperStrand(parametersOf<PaperStrandParameters>(6001, 1)); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("fibers is 6001; ask for no more")));
}

TEST(StaticAssembly, IsTurnedAboutTwoAxes) {
  // If this fails, the turned scene is not the other one turned.
  auto parameters = parametersOf<PaperStaticParameters>(10, 50);
  const FiberPolylines turned = makePaperStatic(parameters);
  parameters.turned = false;
  const FiberPolylines straight = makePaperStatic(parameters);
  expectTurnedAboutTwoAxes(turned, straight);
}

TEST(StaticAssembly, IsAllButParallelToAnAxisInStateOne) {
  // If this fails, the best case of boxes is none.
  auto parameters = parametersOf<PaperStaticParameters>(10, 50);
  parameters.turned = false;
  parameters.state = 1;
  const FiberPolylines scene = makePaperStatic(parameters);
  for (std::size_t f = 0; f < 10; ++f) {
    const Point& root = scene.points[f * 51];
    const Point& tip = scene.points[f * 51 + 50];
    EXPECT_LE(std::hypot(tip[0] - root[0], tip[1] - root[1]), 0.1 * (tip[2] - root[2]));
  }
  for (const int bad : {-1, 101}) {
    parameters.state = bad;
    EXPECT_THAT([&] { makePaperStatic(parameters); },
                ThrowsMessage<std::invalid_argument>(
                    HasSubstr("state is " + std::to_string(bad) + "; ask for one from 0 to 100")));
  }
}

TEST(StaticAssembly, MoreFibersSpreadTheSameFibers) {
  // If this fails, the random numbers of a fiber depend on the fibers after it.
  auto parameters = parametersOf<PaperStaticParameters>(5, 50);
  parameters.turned = false;
  const FiberPolylines few = makePaperStatic(parameters);
  parameters.fibers = 20;
  const FiberPolylines many = makePaperStatic(parameters);
  for (std::size_t i = 0; i < few.points.size(); ++i) {
    const std::size_t root = i / 51 * 51;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(many.points[i][k] - many.points[root][k], few.points[i][k] - few.points[root][k],
                  1e-12);
      // Four times the area, twice the axes.
      EXPECT_NEAR(many.points[root][k], 2 * few.points[root][k], 1e-12);
    }
  }
}

TEST(PaperDynamic, StartsStraightAndEndsInALoop) {
  // If this fails, the scene is not the one of the paper's figure 3.
  const PaperDynamic assembly(parametersOf<PaperDynamicParameters>(20, 100));
  ASSERT_EQ(assembly.steps(), 101);
  const FiberPolylines first = assembly.scene(0);
  const FiberPolylines last = assembly.scene(100);
  for (std::size_t f = 0; f < 20; ++f) {
    const Point& root = first.points[f * 101];
    for (std::size_t i = 0; i <= 100; ++i) {
      const Point expected = {root[0], root[1], 0.15 * static_cast<double>(i)};
      EXPECT_LE(distance(first.points[f * 101 + i], expected), 1e-12);
    }
    EXPECT_LE(distance(last.points[f * 101 + 100], root), 2);
    EXPECT_NEAR(distance(last.points[f * 101 + 50], root), 15 / 3.14159, 0.8);
  }
}

TEST(PaperDynamic, MovesSteadily) {
  // If this fails, fibers jump from one state to the next.
  const PaperDynamic assembly(parametersOf<PaperDynamicParameters>(20, 100));
  FiberPolylines last = assembly.scene(0);
  for (int step = 1; step < assembly.steps(); ++step) {
    FiberPolylines scene = assembly.scene(step);
    EXPECT_LE(farthestMotion(last, scene), 1.2) << step;
    EXPECT_GE(farthestMotion(last, scene), 0.007) << step;
    last = std::move(scene);
  }
}

TEST(PaperDynamic, StatesDoNotDependOnTheirOrder) {
  // If this fails, a state asked for again is another one.
  const auto parameters = parametersOf<PaperDynamicParameters>(10, 60);
  const PaperDynamic assembly(parameters);
  const FiberPolylines sixty = assembly.scene(60);
  const FiberPolylines hundred = assembly.scene(100);
  EXPECT_EQ(assembly.scene(60).points, sixty.points);
  EXPECT_EQ(PaperDynamic(parameters).scene(100).points, hundred.points);
}

TEST(PaperDynamic, RefusesStatesThatAreNone) {
  // If this fails, memory beyond the trajectory is read.
  const PaperDynamic assembly(parametersOf<PaperDynamicParameters>(2, 20));
  for (const int bad : {-1, 101}) {
    EXPECT_THAT([&] { assembly.scene(bad); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("PaperDynamic::scene: step is " +
                                                               std::to_string(bad) + "; ask for")));
  }
}

TEST(HalfScalp, FibersStayOutsideTheHead) {
  // If this fails, fibers grow into the head, or roots float above it.
  for (const int frame : {0, 30}) {
    auto parameters = parametersOf<PaperHalfScalpParameters>(5000, 50);
    parameters.frame = frame;
    const FiberPolylines scene = makePaperHalfScalp(parameters);
    const auto level = [](const Point& p) {
      return std::hypot(p[0] / 7.75, p[1] / 9.5, p[2] / 7.75);
    };
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      const Point& root = scene.points[scene.point_begin[f]];
      EXPECT_NEAR(level(root), 1, 1e-12);
      EXPECT_GT(root[0], 0);
      for (std::size_t i = scene.point_begin[f] + 1; i < scene.point_begin[f + 1]; ++i) {
        ASSERT_GE(level(scene.points[i]), 1) << f;
      }
    }
  }
}

TEST(PaperStrand, MoreFibersFillTheSameArea) {
  // If this fails, more fibers do not make the strand denser.
  const FiberPolylines few = makePaperStrand(parametersOf<PaperStrandParameters>(50, 30));
  const FiberPolylines many = makePaperStrand(parametersOf<PaperStrandParameters>(100, 30));
  for (std::size_t i = 0; i < few.points.size(); ++i) EXPECT_EQ(many.points[i], few.points[i]);
  const double minor = std::sqrt(2000 / 325.0 / (1.5 * 3.141592653589793));
  for (std::size_t f = 0; f < 100; ++f) {
    const Point& root = many.points[many.point_begin[f]];
    EXPECT_LE(std::hypot(root[0] / (1.5 * minor), root[1] / minor), 1 + 1e-12);
    for (std::size_t g = 0; g < f; ++g) {
      EXPECT_GE(distance(root, many.points[many.point_begin[g]]), 0.01);
    }
  }
}

TEST(PaperStrand, HangsInTurns) {
  // If this fails, the strand is no helix, or does not hang. Four turns about a vertical axis; its
  // weight pulls a helix of 16.4 cm longer.
  const FiberPolylines scene = makePaperStrand(parametersOf<PaperStrandParameters>(1, 2000));
  EXPECT_NEAR(turnsOf(scene), 4, 0.5);
  EXPECT_LT(scene.points.back()[2], -16.4);
  EXPECT_GT(scene.points.back()[2], -25);
}

}  // namespace
}  // namespace fcl_fibers::scenes
