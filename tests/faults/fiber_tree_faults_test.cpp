// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/live_pairs.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/live_calls.h"
#include "arrays/meshes.h"
#include "support/allocation_faults.h"
#include "support/assembly.h"
#include "support/random.h"

namespace fcl_fibers::test {
namespace {

/// Of radius 0.05.
Assembly<double> hair(int fibers, int points_each, std::uint64_t seed) {
  Random random(seed);
  Assembly<double> hair;
  for (int f = 0; f < fibers; ++f) {
    Eigen::Vector3d point = random.inCube(0.5);
    for (int i = 0; i < points_each; ++i) {
      hair.addPoint({point.x(), point.y(), point.z()}, 0.05);
      point += 0.2 * random.direction();
    }
    hair.endFiber();
  }
  hair.radii = {0.05};
  hair.radii_are = FiberArrays<double>::Radii::kOne;
  return hair;
}

/// What a test's visitor throws, so that nothing else is mistaken for it.
struct VisitorError : std::exception {};

/// What a visitor is called with, in order; what has no time has 0.
using Seen = std::vector<std::tuple<int, int, double>>;

struct Subject {
  FiberTree tree, other;
  Seen seen;
  std::size_t throw_at = 0;  ///< the call of a visitor that throws

  void see(int a, int b, double time = 0) {
    seen.emplace_back(a, b, time);
    if (seen.size() == throw_at) throw VisitorError();
  }
  void see(SegmentPair pair) { see(pair.a, pair.b); }
  void see(TrianglePair pair) { see(pair.segment, pair.triangle); }
  void see(const Impact& impact) { see(impact.pair.a, impact.pair.b, impact.time); }
  void see(const MeshImpact& impact) {
    see(impact.pair.segment, impact.pair.triangle, impact.time);
  }
  void see(std::int32_t segment) { see(segment, 0); }
  void see(const MeshContact& contact) { see(contact.triangle, 0, contact.distance); }

  template <class Question, class... Partner>
  void visit(const Question& question, const Partner&... partner) {
    tree.visit(question, partner..., [this](const auto& found) { this->see(found); });
  }
  template <class Found, class Question, class... Partner>
  void find(const Question& question, const Partner&... partner) {
    std::vector<Found> all;
    tree.find(question, partner..., all);
    for (const Found& found : all) see(found);
  }
};
using Act = std::function<void(Subject&)>;
using NamedActs = std::vector<std::pair<std::string, Act>>;

/// All that a tree answers about its step and its end; nothing where it refuses to answer.
using Answers = std::vector<std::optional<Seen>>;

Answers answersOf(Subject& of) {
  Answers answers;
  for (const Act& ask :
       {Act([](Subject& s) { s.visit(Pairs{}); }), Act([](Subject& s) { s.visit(Impacts{}); }),
        Act([](Subject& s) { s.visit(MovingPairs{}); }),
        Act([](Subject& s) { s.see(0, 0, s.tree.safeStep()); })}) {
    of.seen.clear();
    try {
      ask(of);
      answers.emplace_back(of.seen);
    } catch (const std::invalid_argument&) {
      answers.emplace_back();
    }
  }
  return answers;
}

class TreeFaults : public testing::TestWithParam<FiberTreeOptions> {
 protected:
  TreeFaults() {
    moved_.radii = {0.04};
    for (double& x : moved_.points) x *= 1.1;
    scattered_.radii = {0.03};
    for (std::size_t i = 0; i < scattered_.points.size(); ++i) {
      scattered_.points[i] *= 1 + static_cast<double>(i % 7);
    }
    end_of_mesh_.setPose({{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.2, 0, 0}});
  }

  static bool hasSteps() { return GetParam().volumes == FiberTreeOptions::Volumes::kLayeredBoxes; }

  Subject make(bool has_step) const {
    Subject subject{FiberTree(GetParam()), FiberTree(GetParam()), {}};
    subject.tree.build(hair_.view());
    subject.other.build(moved_.view());
    if (has_step) {
      subject.tree.update(hair_.view(), moved_.view());
      subject.other.update(moved_.view(), hair_.view());
    }
    subject.seen.reserve(100000);
    return subject;
  }

  /// What these trees can be asked, during a step if they can have one.
  NamedActs queries() const {
    NamedActs all = {{"visit(Pairs)", [](Subject& of) { of.visit(Pairs{}); }},
                     {"visit(Pairs, other)", [](Subject& of) { of.visit(Pairs{}, of.other); }},
                     {"find(Pairs)", [](Subject& of) { of.find<SegmentPair>(Pairs{}); }}};
    if (GetParam().report == Report::kVolumes) return all;
    const NamedActs of_capsules = {
        {"find(Nearest, other)", [](Subject& of) { of.find<SegmentPair>(Nearest{0.1}, of.other); }},
        {"closest", [this](Subject& of) {
           const auto& fibers = hasSteps() ? moved_ : hair_;
           const Contact contact = of.tree.closest(Contacts{fibers.view()});
           of.see(contact.pair.a, contact.pair.b, contact.distance);
         }}};
    all.insert(all.end(), of_capsules.begin(), of_capsules.end());
    for (const TriangleMesh* mesh : {&surface_, &solid_}) {
      const NamedActs of_mesh = {
          {"visit(Pairs, mesh)", [mesh](Subject& of) { of.visit(Pairs{}, *mesh); }},
          {"find(TouchingSegments, mesh)",
           [mesh](Subject& of) { of.find<std::int32_t>(TouchingSegments{}, *mesh); }},
          {"find(Nearest, mesh)",
           [mesh](Subject& of) { of.find<TrianglePair>(Nearest{0.1}, *mesh); }},
          {"find(Contacts)", [this, mesh](Subject& of) {
             of.find<MeshContact>(Contacts{(hasSteps() ? moved_ : hair_).view()}, *mesh);
           }}};
      all.insert(all.end(), of_mesh.begin(), of_mesh.end());
    }
    if (!hasSteps()) return all;
    const MeshStep step{solid_, end_of_mesh_};
    const NamedActs of_step = {
        {"visit(Impacts)", [](Subject& of) { of.visit(Impacts{}); }},
        {"visit(Impacts, other)", [](Subject& of) { of.visit(Impacts{}, of.other); }},
        {"visit(Impacts, mesh)", [step](Subject& of) { of.visit(Impacts{}, step); }},
        {"visit(MovingPairs)", [](Subject& of) { of.visit(MovingPairs{}); }},
        {"find(Impacts)", [](Subject& of) { of.find<Impact>(Impacts{}); }},
        {"safeStep", [](Subject& of) { of.see(0, 0, of.tree.safeStep()); }},
        {"safeStep(mesh)", [step](Subject& of) { of.see(0, 0, of.tree.safeStep(step)); }}};
    all.insert(all.end(), of_step.begin(), of_step.end());
    return all;
  }

  /// Where an allocation of act() fails, the tree answers all as before or refuses all, and does
  /// all that it is asked to when there is memory again.
  /// @param end  the fibers after act(). A tree that has to be built again, because it failed, may
  ///             have another order.
  void expectAnswersWhereverStruck(const std::string& name, bool has_step,
                                   const Assembly<double>& end, const Act& act) const {
    Subject plain = make(has_step), built = make(has_step);
    const Answers before = answersOf(plain), nothing(before.size());
    act(plain);
    const Answers after = answersOf(plain);
    built.tree.build(end.view());
    act(built);
    const Answers after_build = answersOf(built);
    ASSERT_NE(before, after);
    strikeEverywhere(
        name, [&] { return make(has_step); }, act,
        [&](Subject& subject, bool failed) {
          const Answers found = answersOf(subject);
          EXPECT_TRUE(failed ? found == nothing || found == before
                             : found == after || found == after_build);
        });
  }

  const Assembly<double> hair_ = hair(6, 12, 191);
  const Assembly<double> longer_ = hair(9, 30, 192);
  Assembly<double> moved_ = hair_, scattered_ = hair_;
  const TriangleMesh surface_{ball<double>(0.4, 8, 10).view(), TriangleMesh::Kind::kSurface};
  const TriangleMesh solid_{ball<double>(0.4, 8, 10).view(), TriangleMesh::Kind::kSolid};
  TriangleMesh end_of_mesh_ = solid_;
};

// A tree that was built half would be searched. Pairs would be those of some fibers where they were
// and some where they are, and impacts those of fibers half of which are where they were a step
// ago.
TEST_P(TreeFaults, ChangesWithoutMemoryKeepOrRefuseAnswers) {
  expectAnswersWhereverStruck("build", false, longer_,
                              [&](Subject& of) { of.tree.build(longer_.view()); });
  for (const bool has_step : {false, true}) {
    if (has_step && !hasSteps()) continue;
    SCOPED_TRACE(has_step);
    expectAnswersWhereverStruck("update", has_step, scattered_,
                                [&](Subject& of) { of.tree.update(scattered_.view()); });
    if (!hasSteps()) continue;
    expectAnswersWhereverStruck("step", has_step, scattered_, [&](Subject& of) {
      of.tree.update(moved_.view(), scattered_.view());
    });
  }
  expectAnswersWhereverStruck("update of a little", false, moved_,
                              [&](Subject& of) { of.tree.update(moved_.view()); });
}

// The start of the next step would have the tree of the fibers before the build.
TEST_P(TreeFaults, ABuildWithoutMemoryEndsTheStep) {
  if (!hasSteps()) GTEST_SKIP() << "of trees that have steps";
  const auto step = [&](Subject& of) { of.tree.update(moved_.view(), scattered_.view()); };
  // If the build fails before it has changed the tree, the step has the order of the tree before.
  Subject kept = make(true), built = make(true);
  step(kept);
  built.tree.build(scattered_.view());
  step(built);
  const Answers of_kept = answersOf(kept), of_built = answersOf(built);
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
    const Answers found = answersOf(subject);
    EXPECT_TRUE(found == of_kept || found == of_built);
  }
  EXPECT_GT(number, 5u);
}

// A query would leave something behind, or an impact or a contact be lost.
TEST_P(TreeFaults, AQueryWithoutMemoryChangesNothing) {
  Subject plain = make(hasSteps());
  const Answers before = answersOf(plain);
  for (const auto& [name, query] : queries()) {
    const auto act = [&query = query](Subject& of) {
      of.seen.clear();
      query(of);
    };
    act(plain);
    const Seen seen = plain.seen;
    ASSERT_FALSE(seen.empty()) << name;
    strikeEverywhere(
        name, [&] { return make(hasSteps()); }, act,
        [&](Subject& subject, bool failed) {
          EXPECT_TRUE(failed || subject.seen == seen);
          EXPECT_EQ(answersOf(subject), before);
        });
  }
}

// An exception from a visitor, whichever call it is, would leave something behind or spoil what is
// asked next.
TEST_P(TreeFaults, EveryCallOfAVisitorMayThrow) {
  Subject subject = make(hasSteps());
  const Answers before = answersOf(subject);
  for (const auto& [name, query] : queries()) {
    SCOPED_TRACE(name);
    const auto throws = [&, &query = query](std::size_t at) {
      subject.seen.clear();
      subject.throw_at = at;
      try {
        query(subject);
      } catch (const VisitorError&) {
        return true;
      }
      return false;
    };
    ASSERT_FALSE(throws(0));
    const Seen calls = subject.seen;
    for (std::size_t at = 1; at <= calls.size(); ++at) {
      const std::size_t live = liveAllocations();
      ASSERT_TRUE(throws(at));
      ASSERT_EQ(subject.seen.size(), at);
      ASSERT_TRUE(std::equal(subject.seen.begin(), subject.seen.end(), calls.begin()));
      ASSERT_EQ(liveAllocations(), live);
    }
    ASSERT_FALSE(throws(0));
    EXPECT_EQ(subject.seen, calls);
    EXPECT_EQ(answersOf(subject), before);
  }
}

// A frame that allocates is slow now and then. What starts threads is not ours to count.
TEST_P(TreeFaults, NothingIsAllocatedAfterTheFirstFrame) {
  if (GetParam().threads > 1) GTEST_SKIP() << "of one thread only";
  Assembly<double> fibers = hair(30, 40, 187);
  FiberTree tree(GetParam());
  tree.build(fibers.view());
  std::size_t pairs = 0;
  const auto frame = [&](double scale) {
    for (double& coordinate : fibers.points) coordinate *= scale;
    tree.update(fibers.view());
    pairs = 0;
    tree.visit(Pairs{}, [&](SegmentPair) { ++pairs; });
  };
  frame(1);
  EXPECT_FALSE(allocates([&] { frame(1.001); }));
  EXPECT_GT(pairs, 0u);
}

// A mesh would be half where it was and half where it is, or its copy be moved.
TEST(MeshFaults, UpdatingWithoutMemoryChangesNothing) {
  const FiberTreeOptions options = FiberOptions{Topology::kBundle, Report::kCapsules};
  Subject subject{FiberTree(options), FiberTree(options), {}};
  subject.tree.build(hair(20, 12, 194).view());
  const auto seenAt = [&](const TriangleMesh& mesh) {
    subject.seen.clear();
    subject.visit(Pairs{}, mesh);
    return subject.seen;
  };
  const Triangles<double> first = ball<double>(0.4, 20, 30);
  Triangles<double> second = first;
  for (double& x : second.points) x *= 0.75;
  const TriangleMesh plain(first.view());
  const Seen before = seenAt(plain), after = seenAt(TriangleMesh(second.view()));
  ASSERT_NE(before, after);
  using Meshes = std::pair<TriangleMesh, TriangleMesh>;  // the second is a copy
  const auto make = [&] { return Meshes{plain, plain}; };
  strikeEverywhere(
      "update of a mesh that is shared", make,
      [&](Meshes& meshes) { meshes.first.update(second.view()); },
      [&](const Meshes& meshes, bool failed) {
        EXPECT_EQ(seenAt(meshes.first), failed ? before : after);
        EXPECT_EQ(seenAt(meshes.second), before);
      });
  // It takes no memory, so it cannot end half-way.
  strikeEverywhere(
      "update of a mesh that is not shared", [&] { return TriangleMesh(first.view()); },
      [&](TriangleMesh& mesh) { mesh.update(second.view()); },
      [&](const TriangleMesh& mesh, bool failed) {
        EXPECT_FALSE(failed);
        EXPECT_EQ(seenAt(mesh), after);
      });
  strikeEverywhere(
      "construction", make,
      [&](Meshes& meshes) {
        meshes.first = TriangleMesh(second.view(), TriangleMesh::Kind::kSolid);
      },
      [&](const Meshes& meshes, bool failed) {
        EXPECT_EQ(seenAt(meshes.first).size() == before.size(), failed);
      });
}

/// Pairs that live, of a tree, of two, and of a tree and a mesh, and what a program knows of them.
struct LivePairsSubject {
  static constexpr int kKinds = 3;

  LivePairsSubject(double skin, const Assembly<double>& fibers, const Assembly<double>& others)
      : options{skin} {
    tree.build(fibers.view());
    other.build(others.view());
  }
  void update(int kind) { kind == 0 ? own.update() : kind == 1 ? both.update() : of_mesh.update(); }
  /// That they are what a search finds.
  void check(int kind, bool all_end = false) {
    if (kind == 0) own_watch.checkPairs(own, pairsOf(tree), all_end);
    if (kind == 1) both_watch.checkPairs(both, pairsOf(tree, other), all_end);
    if (kind == 2) mesh_watch.checkPairs(of_mesh, pairsOfMesh(tree, mesh), all_end);
  }
  std::vector<double> told(int kind) const {
    return kind == 0 ? recordOf(own) : kind == 1 ? recordOf(both) : recordOf(of_mesh);
  }

  LivePairsOptions options;
  FiberTree tree, other;
  TriangleMesh mesh{ball<double>(0.4, 8, 10).view(), TriangleMesh::Kind::kSolid};
  LivePairs<FiberTree> own{tree, options}, both{tree, other, options};
  LivePairs<TriangleMesh> of_mesh{tree, mesh, options};
  LiveWatch<FiberTree> own_watch, both_watch;
  LiveWatch<TriangleMesh> mesh_watch;
};

// After memory has run out in an update, pairs would be half of the step before, begin twice, or
// share a slot.
TEST(LivePairsFaults, AnUpdateWithoutMemoryTellsNothing) {
  const Assembly<double> fibers = hair(6, 12, 195), others = hair(4, 12, 196);
  struct Motion {
    double of_all, of_one;
  };
  std::size_t changes = 0;
  for (const Motion motion : {Motion{0, 0}, {0.002, 0}, {0.002, 0.7}, {0.3, 0}}) {
    Random random(197);
    Assembly<double> moved = fibers;
    for (double& x : moved.points) x += random.between(-motion.of_all, motion.of_all);
    for (std::size_t i = 0; i < 12; ++i) moved.points[3 * i] += motion.of_one;
    for (const double skin : {-1.0, 0.0, 0.08}) {
      for (int kind = 0; kind < LivePairsSubject::kKinds; ++kind) {
        const auto make = [&] {
          auto subject = std::make_unique<LivePairsSubject>(skin, fibers, others);
          for (int i = 0; i < 2; ++i) {  // the first of which measures
            subject->update(kind);
            subject->check(kind);
            subject->tree.update(fibers.view());
          }
          subject->tree.update(moved.view());
          subject->mesh.setPose({{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.5 * motion.of_one, 0, 0}});
          return subject;
        };
        const std::vector<double> before = make()->told(kind);
        strikeEverywhere(
            "skin " + std::to_string(skin) + ", kind " + std::to_string(kind), make,
            [&](const auto& subject) { subject->update(kind); },
            [&](const auto& subject, bool failed) {
              if (failed) {
                EXPECT_EQ(subject->told(kind), before);
              } else {
                subject->check(kind);
                changes += subject->told(kind) != before ? 1 : 0;
              }
            });
      }
    }
  }
  EXPECT_GT(changes, 500u);
}

// If memory runs out in a build that has given the names to other segments, an update makes up for
// it. The pairs of before would live on as pairs of segments that never met.
TEST(LivePairsFaults, ABuildWithoutMemoryMayEndAllPairs) {
  const Assembly<double> fibers = hair(6, 12, 195);
  Assembly<double> others = fibers;  // most pairs of names touch in both
  others.point_begin = {0, 24, 48, 72};
  bool struck = true;
  std::size_t ended = 0;
  for (std::size_t number = 0; struck && !HasFailure(); ++number) {
    SCOPED_TRACE(number);
    LivePairsSubject subject(0.08, fibers, others);
    for (const int kind : {0, 1, 2}) {
      subject.update(kind);
      subject.check(kind);
    }
    bool failed = false;
    {
      const AllocationFault fault(number, AllocationFault::Lasts::kOnce);
      try {
        subject.tree.build(others.view());
      } catch (const std::bad_alloc&) {
        failed = true;
      }
      struck = fault.struck();
    }
    bool all_end = true;
    try {
      subject.tree.update(others.view());
      ended += failed ? 1 : 0;
    } catch (const std::invalid_argument&) {
      subject.tree.update(fibers.view());
      all_end = false;
    }
    for (const int kind : {0, 1, 2}) {
      subject.update(kind);
      subject.check(kind, all_end);
    }
  }
  EXPECT_GT(ended, 3u);
}

std::vector<FiberTreeOptions> optionsToStrike() {
  std::vector<FiberTreeOptions> all(5);
  for (FiberTreeOptions& options : all) {
    options.report = Report::kCapsules;
    options.ignored_neighbors = 1;
  }
  all[1].report = Report::kVolumes;
  all[2].volumes = FiberTreeOptions::Volumes::kWrappedSpheres;
  all[3].topology = Topology::kSuperThread;
  all[4].threads = 2;
  return all;
}

INSTANTIATE_TEST_SUITE_P(, TreeFaults, testing::ValuesIn(optionsToStrike()));

}  // namespace
}  // namespace fcl_fibers::test
