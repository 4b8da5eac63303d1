// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <exception>
#include <functional>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/meshes.h"
#include "faults/hair.h"
#include "support/allocation_faults.h"
#include "support/assembly.h"

namespace fcl_fibers::test {
namespace {

using Pairs = std::vector<std::pair<int, int>>;

struct Subject {
  FiberTree tree, other;
  Pairs seen;
};
using Act = std::function<void(Subject&)>;

// A query that tells what it calls its visitor with.
using Note = std::function<void(int, int)>;
using Query = std::function<void(const Subject&, const Note&)>;

std::vector<std::pair<std::string, Query>> queries() {
  const auto visitor = [](const Note& note) {
    return [&note](SegmentPair pair) { note(pair.a, pair.b); };
  };
  return {
      {"visit(Touching)", [=](const Subject& subject,
                              const Note& note) { subject.tree.visit(Touching{}, visitor(note)); }},
      {"visit(Touching, other)",
       [=](const Subject& subject, const Note& note) {
         subject.tree.visit(Touching{}, subject.other, visitor(note));
       }},
  };
}

/// What a test's visitor throws, so that nothing else is mistaken for it.
struct VisitorError : std::exception {};

// Nothing, if the tree refuses to answer.
std::optional<Pairs> pairsOf(const FiberTree& tree) {
  Pairs pairs;
  try {
    tree.visit(Touching{}, [&](SegmentPair pair) { pairs.emplace_back(pair.a, pair.b); });
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
  return pairs;
}

class TreeFaults : public testing::TestWithParam<FiberTreeOptions> {
 protected:
  TreeFaults() {
    moved_.radii = {0.04};
    for (double& x : moved_.points) x *= 1.1;
    scattered_.radii = {0.04};
    for (std::size_t i = 0; i < scattered_.points.size(); ++i) {
      scattered_.points[i] *= 1 + static_cast<double>(i % 7);
    }
  }

  Subject make(const Assembly<double>& hair) const {
    Subject subject{FiberTree(GetParam()), FiberTree(GetParam()), {}};
    subject.tree.build(hair.view());
    subject.other.build(moved_.view());
    subject.seen.reserve(100000);
    return subject;
  }

  /// Where an allocation of act() fails, the tree answers as before or refuses to, and does all
  /// that it is asked to when there is memory again.
  void expectAnswersWhereverStruck(const std::string& name, const Act& act) const {
    Subject plain = make(hair_);
    const std::optional<Pairs> before = pairsOf(plain.tree);
    act(plain);
    const std::optional<Pairs> after = pairsOf(plain.tree);
    ASSERT_TRUE(before && after);
    strikeEverywhere(
        name, [&] { return make(hair_); }, act,
        [&](const Subject& subject, bool failed) {
          const std::optional<Pairs> found = pairsOf(subject.tree);
          EXPECT_TRUE(failed ? !found || found == before : found == after);
          if (!failed) {
            EXPECT_EQ(subject.seen, plain.seen);
          }
        });
  }

  const Assembly<double> hair_ = hair(6, 12, 191);
  const Assembly<double> longer_ = hair(9, 30, 192);
  Assembly<double> moved_ = hair_, scattered_ = hair_;
};

// A tree that was built half would be searched.
TEST_P(TreeFaults, BuildingWithoutMemoryIsMadeUpFor) {
  expectAnswersWhereverStruck("build",
                              [&](Subject& subject) { subject.tree.build(longer_.view()); });
}

// Pairs would be those of some fibers where they were and some where they are.
TEST_P(TreeFaults, UpdatingWithoutMemoryKeepsOrRefusesAnswers) {
  expectAnswersWhereverStruck("update",
                              [&](Subject& subject) { subject.tree.update(moved_.view()); });
  if (GetParam().volumes == FiberTreeOptions::Volumes::kLayeredBoxes) {
    expectAnswersWhereverStruck("update of a step", [&](Subject& subject) {
      subject.tree.update(hair_.view(), moved_.view());
    });
  }
  expectAnswersWhereverStruck("update of fibers that fly apart",
                              [&](Subject& subject) { subject.tree.update(scattered_.view()); });
}

// A query would leave something behind.
TEST_P(TreeFaults, AQueryWithoutMemoryChangesNothing) {
  for (const auto& [name, query] : queries()) {
    expectAnswersWhereverStruck(name, [&query = query](Subject& subject) {
      subject.seen.clear();
      query(subject, [&](int a, int b) { subject.seen.emplace_back(a, b); });
    });
  }
  expectAnswersWhereverStruck("find(Touching)", [](Subject& subject) {
    std::vector<SegmentPair> pairs;
    subject.tree.find(Touching{}, pairs);
  });
}

// An exception from a visitor, whichever call it is, would leave something behind or spoil what is
// asked next.
TEST_P(TreeFaults, EveryCallOfAVisitorMayThrow) {
  Subject subject = make(hair_);
  const std::optional<Pairs> before = pairsOf(subject.tree);
  for (const auto& [name, query] : queries()) {
    SCOPED_TRACE(name);
    const auto run = [&, &query = query](std::size_t throw_at) {
      subject.seen.clear();
      try {
        query(subject, [&](int a, int b) {
          subject.seen.emplace_back(a, b);
          if (subject.seen.size() == throw_at) throw VisitorError();
        });
      } catch (const VisitorError&) {
        return true;
      }
      return false;
    };
    ASSERT_FALSE(run(0));
    const Pairs calls = subject.seen;
    ASSERT_FALSE(calls.empty());
    for (std::size_t at = 1; at <= calls.size(); ++at) {
      const std::size_t live = liveAllocations();
      ASSERT_TRUE(run(at));
      ASSERT_EQ(subject.seen.size(), at);
      ASSERT_TRUE(std::equal(subject.seen.begin(), subject.seen.end(), calls.begin()));
      ASSERT_EQ(liveAllocations(), live);
    }
    ASSERT_FALSE(run(0));
    EXPECT_EQ(subject.seen, calls);
    EXPECT_EQ(pairsOf(subject.tree), before);
  }
  subject.tree.update(moved_.view());
  EXPECT_EQ(pairsOf(subject.tree), pairsOf(subject.other));
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
    tree.visit(Touching{}, [&](SegmentPair) { ++pairs; });
  };
  frame(1);
  bool struck = false;
  {
    const AllocationFault fault(0, AllocationFault::Lasts::kForever);
    EXPECT_NO_THROW(frame(1.001));
    struck = fault.struck();
  }
  EXPECT_FALSE(struck);
  EXPECT_GT(pairs, 0u);
}

// A query of a mesh would leave something behind, or contacts of another one be lost.
TEST_P(TreeFaults, AQueryOfAMeshWithoutMemoryChangesNothing) {
  if (GetParam().report == Report::kVolumes) GTEST_SKIP() << "of capsules only";
  for (const auto kind : {TriangleMesh::Kind::kSurface, TriangleMesh::Kind::kSolid}) {
    const TriangleMesh mesh(ball<double>(0.4, 8, 10).view(), kind);
    expectAnswersWhereverStruck("visit(Touching, mesh)", [&](Subject& subject) {
      subject.seen.clear();
      subject.tree.visit(Touching{}, mesh, [&](TrianglePair pair) {
        subject.seen.emplace_back(pair.segment, pair.triangle);
      });
    });
    expectAnswersWhereverStruck("find(TouchingSegments, mesh)", [&](Subject& subject) {
      std::vector<std::int32_t> segments;
      subject.tree.find(TouchingSegments{}, mesh, segments);
    });
    expectAnswersWhereverStruck("find(Nearest, mesh)", [&](Subject& subject) {
      std::vector<TrianglePair> pairs;
      subject.tree.find(Nearest{0.1}, mesh, pairs);
    });
    expectAnswersWhereverStruck("find(Contacts)", [&](Subject& subject) {
      std::vector<MeshContact> contacts;
      subject.tree.find(Contacts{hair_.view()}, mesh, contacts);
    });
  }
}

/// What the tree finds at a mesh.
Pairs pairsOf(const FiberTree& tree, const TriangleMesh& mesh) {
  Pairs pairs;
  tree.visit(Touching{}, mesh,
             [&](TrianglePair pair) { pairs.emplace_back(pair.segment, pair.triangle); });
  return pairs;
}

// A mesh would be half where it was and half where it is, or its copy be moved.
TEST(MeshFaults, UpdatingWithoutMemoryChangesNothing) {
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  FiberTree tree(options);
  tree.build(hair(20, 12, 194).view());
  const Triangles<double> first = ball<double>(0.4, 20, 30);
  Triangles<double> second = first;
  for (double& x : second.points) x *= 0.75;
  const TriangleMesh plain(first.view());
  const Pairs before = pairsOf(tree, plain);
  const Pairs after = pairsOf(tree, TriangleMesh(second.view()));
  ASSERT_NE(before, after);

  struct Meshes {
    TriangleMesh mesh, copy;
  };
  strikeEverywhere(
      "update of a mesh that is shared",
      [&] {
        return Meshes{plain, plain};
      },
      [&](Meshes& meshes) { meshes.mesh.update(second.view()); },
      [&](const Meshes& meshes, bool failed) {
        EXPECT_EQ(pairsOf(tree, meshes.mesh), failed ? before : after);
        EXPECT_EQ(pairsOf(tree, meshes.copy), before);
      });
  // It takes no memory, so it cannot end half-way.
  strikeEverywhere(
      "update of a mesh that is not shared", [&] { return TriangleMesh(first.view()); },
      [&](TriangleMesh& mesh) { mesh.update(second.view()); },
      [&](const TriangleMesh& mesh, bool failed) {
        EXPECT_FALSE(failed);
        EXPECT_EQ(pairsOf(tree, mesh), after);
      });
  strikeEverywhere(
      "construction",
      [&] {
        return Meshes{plain, plain};
      },
      [&](Meshes& meshes) {
        meshes.mesh = TriangleMesh(second.view(), TriangleMesh::Kind::kSolid);
      },
      [&](const Meshes& meshes, bool failed) {
        EXPECT_EQ(pairsOf(tree, meshes.mesh).size() == before.size(), failed);
      });
}

std::vector<FiberTreeOptions> optionsToStrike() {
  std::vector<FiberTreeOptions> all(4);
  all[0].ignored_neighbors = 1;
  all[1].report = Report::kCapsules;
  all[1].volumes = FiberTreeOptions::Volumes::kWrappedSpheres;
  all[2].topology = Topology::kSuperThread;
  all[2].report = Report::kCapsules;
  all[3].threads = 2;
  return all;
}
INSTANTIATE_TEST_SUITE_P(, TreeFaults, testing::ValuesIn(optionsToStrike()));

}  // namespace
}  // namespace fcl_fibers::test
