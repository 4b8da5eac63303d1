// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "index/segment_index.h"
#include "scenes/cap.h"
#include "scenes/helix.h"
#include "scenes/paper_scenes.h"
#include "support/job_counts.h"
#include "support/volume_tests.h"

namespace fcl_fibers::index {
namespace {

using geometry::Frame;
using geometry::Segment;
using tree::Group;
using tree::Pair;
using tree::Visit;

/// What a build, a refit and a self-collision do: the same on every machine, where times differ.
struct Counts {
  std::size_t nodes, volume_tests, capsule_tests, touching;
  std::size_t cages_recomputed;  ///< by the refit; 0 for boxes
};

class CountPairs : public PairSink {
 public:
  Visit take(const PairRun& run) override {
    count_ += run.count;
    return Visit::kContinue;
  }
  std::size_t count() const { return count_; }

 private:
  std::size_t count_ = 0;
};

/// A segment's id is that of its first point.
class SceneSource final : public SegmentSource {
 public:
  explicit SceneSource(const FiberPolylines& fibers) : fibers_(fibers) {}

  bool read(const SegmentId* ids, int count, int, const Frame&, SegmentBlock& out,
            BlockMask& present) const override {
    for (int i = 0; i < count; ++i) {
      const auto first = static_cast<std::size_t>(ids[i]);
      const Point &p = fibers_.points[first], &q = fibers_.points[first + 1];
      out.set(i, {{p[0], p[1], p[2]}, {q[0], q[1], q[2]}, fibers_.radius});
    }
    present = geometry::firstOfBlock(count);
    return true;
  }
  bool staysFiniteIn(const geometry::Frame&) const override { return true; }
  bool isFasterInOrder() const override { return false; }
  [[noreturn]] void refuse(SegmentId, const Frame&) const override {
    throw std::invalid_argument("all can be read");
  }

 private:
  const FiberPolylines& fibers_;
};

void build(SegmentIndex& index, const FiberPolylines& scene,
           const std::vector<Group>& groups = {}) {
  tree::Fibers fibers;
  fibers.groups = groups;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i) {
      fibers.ids.push_back(static_cast<SegmentId>(i));
    }
    fibers.endFiber();
  }
  index.build(SceneSource(scene), Frame{}, 0, static_cast<SegmentId>(scene.points.size()), fibers);
}

/// Builds at the first frame, refits to the second one and searches that.
Counts countsOf(const FiberPolylines& first, const FiberPolylines& second, bool wrapped_spheres,
                const std::vector<Group>& groups = {}) {
  IndexOptions options;
  options.wrapped_spheres = wrapped_spheres;
  options.capsules = true;
  SegmentIndex index(options);
  build(index, first, groups);
  EXPECT_TRUE(index.refit(SceneSource(second), Frame{}));

  CountPairs touching;
  index.search(touching);
  Counts counts{0, 0, 0, touching.count(), 0};
  std::visit(
      [&](const auto& tree) {
        counts.nodes = tree.nodes().size();
        const test::VolumeTests volumes = test::countVolumeTests(tree);
        counts.volume_tests = volumes.tests;
        counts.capsule_tests = volumes.pairs;
        using Volume = typename std::decay_t<decltype(tree)>::Volume;
        if constexpr (std::is_same_v<Volume, geometry::Sphere>) {
          counts.cages_recomputed = tree.hierarchy().cagesRecomputed();
        }
      },
      index.tree());
  return counts;
}

struct Pinned {
  std::string name;
  FiberPolylines first, second;
  Counts boxes, spheres;
};

std::vector<Pinned> pinnedScenes() {
  scenes::HelixParameters helix;
  scenes::CapParameters cap;
  cap.fibers = 5000;
  const FiberPolylines helix_before = makeHelix(helix), cap_before = makeCap(cap);
  helix.frame = 1;
  cap.frame = 1;
  const scenes::PaperDynamic dynamic({});
  return {{"helix",
           helix_before,
           makeHelix(helix),
           {14331, 16333392, 976366, 124213, 0},
           {14331, 46327571, 5636018, 124213, 400}},
          {"cap",
           cap_before,
           makeCap(cap),
           {37526, 19107827, 780697, 256237, 0},
           {37526, 56404225, 5339207, 256237, 3079}},
          {"paper-dynamic",
           dynamic.scene(49),
           dynamic.scene(50),
           {2297, 715085, 62852, 16141, 0},
           {2297, 1744493, 291019, 16141, 230}}};
}

TEST(Counts, AreWhatTheyWere) {
  // If this fails, the library does more work than it did, or less: whoever meant to change that
  // writes down the new numbers. Two parts in a hundred are for mathematical functions that round
  // otherwise and for other choices of equal worth, not for slower code.
  for (const Pinned& scene : pinnedScenes()) {
    for (const bool wrapped_spheres : {false, true}) {
      SCOPED_TRACE(scene.name + (wrapped_spheres ? ", spheres" : ", boxes"));
      const Counts counts = countsOf(scene.first, scene.second, wrapped_spheres);
      const Counts& pinned = wrapped_spheres ? scene.spheres : scene.boxes;
      const auto expectPinned = [](std::size_t now, std::size_t then, const char* what) {
        EXPECT_NEAR(static_cast<double>(now), static_cast<double>(then),
                    0.02 * static_cast<double>(then))
            << what;
      };
      expectPinned(counts.nodes, pinned.nodes, "nodes");
      expectPinned(counts.volume_tests, pinned.volume_tests, "volume tests");
      expectPinned(counts.capsule_tests, pinned.capsule_tests, "capsule tests");
      expectPinned(counts.touching, pinned.touching, "touching pairs, neighbours among them");
      expectPinned(counts.cages_recomputed, pinned.cages_recomputed, "cages recomputed");
    }
  }
}

TEST(Counts, JobsAreWorthTheirLocksAndManyEnough) {
  // If this fails, threads wait for each other at every turn, or for one that has most of the work.
  scenes::CapParameters cap;
  cap.fibers = 5000;
  const auto expect = [](const FiberPolylines& scene, double least_median) {
    SegmentIndex index(IndexOptions{});
    build(index, scene);
    const auto& tree = std::get<tree::LayeredBoxTree<8>>(index.tree());
    const test::JobCounts counts = test::countJobs(tree);
    EXPECT_GE(counts.median, least_median);
    EXPECT_GT(counts.jobs, 256u);
    EXPECT_LE(counts.most, counts.tests / 100) << "one pair of nodes takes half as much";
    const auto all = static_cast<double>(test::countVolumeTests(tree).tests);
    EXPECT_LE(counts.tests, all);
    EXPECT_GE(counts.tests, 0.99 * all) << "splitting makes the others";
    EXPECT_EQ(counts.barriers, 1u);
  };
  expect(makeHelix(scenes::HelixParameters{}), 10000);
  expect(makeCap(cap), 5000);
}

TEST(Counts, OfAGroupAmongItselfAreNone) {
  // If this fails, one large group is searched through and through for nothing.
  scenes::HelixParameters helix;
  helix.fibers = 60;
  helix.segments = 40;
  const FiberPolylines hair = makeHelix(helix);
  for (const bool wrapped_spheres : {false, true}) {
    const auto tests = [&](const std::vector<Group>& groups) {
      return countsOf(hair, hair, wrapped_spheres, groups).volume_tests;
    };
    std::vector<Group> groups(60, 4);
    EXPECT_EQ(tests(groups), 0u);
    groups[11] = 5;
    EXPECT_GT(tests(groups), 0u);
    EXPECT_LT(tests(groups), tests({}) / 8);
  }
}

}  // namespace
}  // namespace fcl_fibers::index
