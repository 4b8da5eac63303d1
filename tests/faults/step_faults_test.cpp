// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstddef>
#include <functional>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/meshes.h"
#include "faults/hair.h"
#include "support/allocation_faults.h"

namespace fcl_fibers::test {
namespace {

/// What a visitor of a step is called with, in order; a pair without a time has 0.
using Seen = std::vector<std::tuple<int, int, double>>;

/// The answer of a tree, or nothing if it refuses to answer.
template <class Ask>
std::optional<Seen> answerOf(Ask&& ask) {
  Seen seen;
  try {
    ask(seen);
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
  return seen;
}

void visitImpacts(const FiberTree& tree, Seen& seen) {
  tree.visit(Impacts{}, [&](const Impact& impact) {
    seen.emplace_back(impact.pair.a, impact.pair.b, impact.time);
  });
}
void visitImpacts(const FiberTree& tree, const FiberTree& other, Seen& seen) {
  tree.visit(Impacts{}, other, [&](const Impact& impact) {
    seen.emplace_back(impact.pair.a, impact.pair.b, impact.time);
  });
}
void visitImpacts(const FiberTree& tree, const TriangleMesh& mesh, const TriangleMesh& end,
                  Seen& seen) {
  tree.visit(Impacts{}, MeshStep{mesh, end}, [&](const MeshImpact& impact) {
    seen.emplace_back(impact.pair.segment, impact.pair.triangle, impact.time);
  });
}
void visitMovingPairs(const FiberTree& tree, Seen& seen) {
  tree.visit(MovingPairs{}, [&](SegmentPair pair) { seen.emplace_back(pair.a, pair.b, 0.0); });
}

/// All that a tree answers about its step and its end.
using Answers = std::vector<std::optional<Seen>>;

Answers answersOf(const FiberTree& tree) {
  return {answerOf([&](Seen& seen) {
            tree.visit(Touching{},
                       [&](SegmentPair pair) { seen.emplace_back(pair.a, pair.b, 0.0); });
          }),
          answerOf([&](Seen& seen) { visitImpacts(tree, seen); }),
          answerOf([&](Seen& seen) { visitMovingPairs(tree, seen); }),
          answerOf([&](Seen& seen) { seen.emplace_back(0, 0, tree.safeStep()); })};
}

class StepFaults : public testing::TestWithParam<FiberTreeOptions> {
 protected:
  struct Subject {
    FiberTree tree, other;
    Seen seen;
  };

  StepFaults() {
    moved_.radii = {0.04};
    for (double& x : moved_.points) x *= 1.1;
    scattered_.radii = {0.03};
    for (std::size_t i = 0; i < scattered_.points.size(); ++i) {
      scattered_.points[i] *= 1 + static_cast<double>(i % 7);
    }
  }

  Subject make(bool has_step) const {
    Subject subject{FiberTree(GetParam()), FiberTree(GetParam()), {}};
    subject.tree.build(hair_.view());
    if (has_step) subject.tree.update(hair_.view(), moved_.view());
    subject.other.build(moved_.view());
    subject.other.update(moved_.view(), hair_.view());
    subject.seen.reserve(100000);
    return subject;
  }

  /// Where an allocation of a step fails, the tree answers all as before or refuses all.
  /// @param end  the fibers at the end of the step; a tree that has to be built again, because it
  ///             failed, has another order
  void expectAnswersWhereverStruck(const std::string& name, bool has_step,
                                   const Assembly<double>& end,
                                   const std::function<void(FiberTree&)>& act) const {
    const auto subject = [&] { return make(has_step); };
    const auto update = [&](Subject& of) { act(of.tree); };
    Subject plain = subject();
    const Answers before = answersOf(plain.tree), nothing(before.size());
    act(plain.tree);
    const Answers after = answersOf(plain.tree);
    FiberTree built(GetParam());
    built.build(end.view());
    act(built);
    const Answers after_build = answersOf(built);
    ASSERT_NE(before, after);
    strikeEverywhere(name, subject, update, [&](const Subject& struck, bool failed) {
      const Answers found = answersOf(struck.tree);
      if (failed) {
        EXPECT_TRUE(found == nothing || found == before);
      } else {
        EXPECT_TRUE(found == after || found == after_build);
      }
    });
  }

  const Assembly<double> hair_ = hair(6, 12, 196);
  Assembly<double> moved_ = hair_, scattered_ = hair_;
};

// Impacts would be those of fibers half of which are where they were a step ago.
TEST_P(StepFaults, UpdatingWithoutMemoryKeepsOrRefusesAnswers) {
  for (const bool has_step : {false, true}) {
    SCOPED_TRACE(has_step);
    expectAnswersWhereverStruck("step", has_step, scattered_, [&](FiberTree& tree) {
      tree.update(moved_.view(), scattered_.view());
    });
  }
  expectAnswersWhereverStruck("end of steps", true, scattered_,
                              [&](FiberTree& tree) { tree.update(scattered_.view()); });
}

// The start of the next step would have the tree of the fibers before the build.
TEST_P(StepFaults, ABuildWithoutMemoryEndsTheStep) {
  const auto step = [&](Subject& of) { of.tree.update(moved_.view(), scattered_.view()); };
  // If the build fails before it has changed the tree, the step has the order of the tree before.
  Subject kept = make(true), built = make(true);
  step(kept);
  built.tree.build(scattered_.view());
  step(built);
  const Answers of_kept = answersOf(kept.tree), of_built = answersOf(built.tree);
  bool struck = true;
  std::size_t number = 0;
  for (; struck && !HasFailure(); ++number) {
    SCOPED_TRACE(number);
    Subject subject = make(true);
    {
      const AllocationFault fault(number, AllocationFault::Lasts::kOnce);
      try {
        subject.tree.build(scattered_.view());
      } catch (const std::bad_alloc&) {
        // The step makes up for it.
      }
      struck = fault.struck();
    }
    step(subject);
    const Answers found = answersOf(subject.tree);
    EXPECT_TRUE(found == of_kept || found == of_built);
  }
  EXPECT_GT(number, 5u);
}

// A query would leave something behind, or an impact be lost.
TEST_P(StepFaults, AQueryWithoutMemoryChangesNothing) {
  const TriangleMesh mesh(ball<double>(0.4, 8, 10).view(), TriangleMesh::Kind::kSolid);
  TriangleMesh end = mesh;
  end.setPose({{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.2, 0, 0}});
  using Query = std::function<void(Subject&)>;
  const std::vector<std::pair<std::string, Query>> queries = {
      {"visit(Impacts)", [](Subject& of) { visitImpacts(of.tree, of.seen); }},
      {"visit(Impacts, other)", [](Subject& of) { visitImpacts(of.tree, of.other, of.seen); }},
      {"visit(Impacts, mesh)", [&](Subject& of) { visitImpacts(of.tree, mesh, end, of.seen); }},
      {"visit(MovingPairs)", [](Subject& of) { visitMovingPairs(of.tree, of.seen); }},
      {"find(Impacts)",
       [](Subject& of) {
         std::vector<Impact> impacts;
         of.tree.find(Impacts{}, impacts);
         of.seen.emplace_back(static_cast<int>(impacts.size()), 0, 0.0);
       }},
      {"safeStep", [](Subject& of) { of.seen.emplace_back(0, 0, of.tree.safeStep()); }},
      {"safeStep(mesh)", [&](Subject& of) {
         of.seen.emplace_back(0, 0, of.tree.safeStep(MeshStep{mesh, end}));
       }}};
  for (const auto& [name, query] : queries) {
    const auto act = [&query = query](Subject& of) {
      of.seen.clear();
      query(of);
    };
    Subject plain = make(true);
    const Answers before = answersOf(plain.tree);
    act(plain);
    ASSERT_FALSE(plain.seen.empty()) << name;
    strikeEverywhere(
        name, [&] { return make(true); }, act,
        [&](const Subject& struck, bool failed) {
          EXPECT_EQ(answersOf(struck.tree), before);
          if (!failed) {
            EXPECT_EQ(struck.seen, plain.seen);
          }
        });
  }
}

std::vector<FiberTreeOptions> optionsOfSteps() {
  std::vector<FiberTreeOptions> all(3);
  for (FiberTreeOptions& options : all) {
    options.report = Report::kCapsules;
    options.ignored_neighbors = 1;
  }
  all[1].topology = Topology::kSuperThread;
  all[2].threads = 2;
  return all;
}
INSTANTIATE_TEST_SUITE_P(, StepFaults, testing::ValuesIn(optionsOfSteps()));

}  // namespace
}  // namespace fcl_fibers::test
