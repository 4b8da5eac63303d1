// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/sphere.h>
#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/live_pairs.h>
#include <tbb/global_control.h>

#include "support/allocation_faults.h"
#include "support/assembly.h"
#include "support/mesh_models.h"
#include "support/random.h"

namespace fcl_fibers::test {
namespace {

/// Fibers of one segment in a cube, each so thick that it touches all others.
Assembly<float> hopelessScene(int count) {
  Random random(412);
  Assembly<float> fibers;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d a = random.inCube(1), b = a + 0.01 * random.direction();
    fibers.addCapsule({a.x(), a.y(), a.z()}, {b.x(), b.y(), b.z()}, 10);
  }
  return fibers;
}

TEST(HopelessScene, LetsAVisitorEndTheQuerySoon) {
  // If this fails, a radius in the wrong unit costs a program all its memory, although it meant to
  // stop after few pairs of five billion.
  const tbb::global_control most_threads(tbb::global_control::max_allowed_parallelism, 8);
  const Assembly<float> fibers = hopelessScene(100'000);
  for (const int threads : {1, 3}) {
    FiberTreeOptions options;
    options.threads = threads;
    FiberTree tree(options);
    tree.build(fibers.view());
    tree.update(fibers.view(), fibers.view());
    const std::size_t before = tree.memoryUsage();
    // Several threads keep some two million pairs and impacts for the visitor.
    const std::size_t most = std::size_t{1} << (threads == 1 ? 20 : 27);
    const auto expectEnds = [&](const char* name, std::size_t others, auto&& ask) {
      for (const std::size_t wanted : {1u, 100'000u}) {
        SCOPED_TRACE(std::string(name) + ", threads " + std::to_string(threads));
        const PeakMemory peak;
        std::atomic<std::size_t> calls{0};
        EXPECT_TRUE(ask([&](const auto&...) {
          const std::size_t call = ++calls;
          if (call > wanted + 63 * others) throw std::logic_error("the query goes on");
          // Others have the time to find far more than they may keep.
          if (call == 1 && threads > 1) std::this_thread::sleep_for(std::chrono::milliseconds(300));
          return call >= wanted;
        }));
        EXPECT_GE(calls, wanted);
        EXPECT_LE(peak.bytes(), most);
        EXPECT_LE(tree.memoryUsage(), before + most);
      }
    };
    const auto expectVisitEnds = [&](const char* name, const auto& question) {
      expectEnds(name, 0, [&](auto&& visit) { return tree.visit(question, visit); });
    };
    const auto expectVisitInParallelEnds = [&](const char* name, const auto& question) {
      expectEnds(name, static_cast<std::size_t>(tree.workerCount()) - 1,
                 [&](auto&& visit) { return tree.visitInParallel(question, visit); });
    };
    expectVisitEnds("Pairs", Pairs{});
    expectVisitEnds("Impacts", Impacts{});
    expectVisitEnds("MovingPairs", MovingPairs{});
    expectVisitInParallelEnds("Pairs in parallel", Pairs{});
    expectVisitInParallelEnds("Impacts in parallel", Impacts{});
    expectVisitInParallelEnds("MovingPairs in parallel", MovingPairs{});
    expectVisitInParallelEnds("Contacts in parallel", Contacts{fibers.view()});
  }
}

TriangleMesh solidOf(const MeshShape& shape) {
  std::vector<std::int32_t> corners;
  for (const auto& triangle : shape.triangles) {
    for (const std::size_t corner : triangle) corners.push_back(static_cast<std::int32_t>(corner));
  }
  const MeshArrays<double> arrays{shape.points.front().data(), shape.points.size(), corners.data(),
                                  shape.triangles.size()};
  return TriangleMesh(arrays, TriangleMesh::Kind::kSolid);
}

std::vector<std::pair<std::int32_t, std::int32_t>> sorted(const std::vector<SegmentPair>& pairs) {
  std::vector<std::pair<std::int32_t, std::int32_t>> all;
  for (const SegmentPair& pair : pairs) all.emplace_back(pair.a, pair.b);
  std::sort(all.begin(), all.end());
  return all;
}

/// Expects that a call ends with an error that tells what to look at, before it has found all of
/// the five billion pairs, which take 40 GB.
/// @param most  bytes that it may take; a vector that grows has up to three times the limit
void expectRefuses(const char* call, const std::function<void()>& ask,
                   std::size_t most = std::size_t{4} << 30) {
  SCOPED_TRACE(call);
  const PeakMemory peak;
  try {
    ask();
    FAIL() << "it found all pairs";
  } catch (const std::length_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(std::string("fcl_fibers: ") + call));
    EXPECT_THAT(error.what(), testing::HasSubstr("unit of the points"));
  }
  EXPECT_LE(peak.bytes(), most);
}

TEST(HopelessScene, EndsWhatKeepsAllPairs) {
  // If this fails, the operating system ends a program whose radii are in the wrong unit, or it
  // waits for a memory that is full.
  const tbb::global_control most_threads(tbb::global_control::max_allowed_parallelism, 8);
  const Assembly<float> fibers = hopelessScene(100'000);
  const Contacts contacts{fibers.view()};
  std::vector<SegmentPair> pairs;
  std::vector<Contact> found;
  {
    FiberTree tree;
    tree.build(fibers.view());
    expectRefuses("FiberTree::find(Pairs)", [&] { tree.find(Pairs{}, pairs); });
    expectRefuses("FiberTree::visit(Pairs)",
                  [&] { tree.visit(Pairs{Order::kSegments}, [](SegmentPair) { FAIL(); }); });
  }
  FiberTreeOptions options;
  options.threads = 3;
  FiberTree tree(options);
  tree.build(fibers.view());
  tree.update(fibers.view(), fibers.view());
  std::vector<Impact> impacts;
  expectRefuses("FiberTree::find(Impacts)", [&] { tree.find(Impacts{}, impacts); });
  expectRefuses("FiberTree::find(Contacts)", [&] { tree.find(contacts, found); });
  expectRefuses("FiberTree::closest", [&] { tree.closest(contacts); });
  const Assembly<float> few = hopelessScene(3'000);
  FiberTree other(options);
  other.build(few.view());
  expectRefuses("FiberTree::find(Pairs)", [&] { other.find(Pairs{}, tree, pairs); });
  const TriangleMesh solid = solidOf(blob(0.5, 0, 40, 25));
  std::vector<TrianglePair> with_mesh;
  // Its two hundred million pairs would take half as much again.
  constexpr std::size_t kLittleMore = (std::size_t{1} << 30) + (std::size_t{1} << 28);
  expectRefuses(
      "FiberTree::find(Pairs)", [&] { tree.find(Pairs{}, solid, with_mesh); }, kLittleMore);
  expectRefuses("FiberTree::safeStep", [&] { tree.safeStep(); });
  LivePairs live(tree);
  expectRefuses("live pairs", [&] { live.update(); });
  // They are asked again where there is hope.
  Assembly<float> thin = fibers;
  std::fill(thin.radii.begin(), thin.radii.end(), 0.003f);
  tree.update(thin.view());
  live.update();
  std::vector<SegmentPair> alive;
  live.find(alive);
  tree.find(Pairs{}, pairs);
  EXPECT_GT(pairs.size(), 10u);
  EXPECT_EQ(sorted(alive), sorted(pairs));
}

TEST(HopelessScene, EndsTheUpdateOfAManagerWithASkin) {
  const Assembly<float> fibers = hopelessScene(17'000);
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> owned;
  std::vector<fcl::CollisionObjectd*> objects;
  const auto ball = std::make_shared<fcl::Sphered>(10);
  for (std::size_t i = 0; i < fibers.fiberCount(); ++i) {
    owned.push_back(std::make_unique<fcl::CollisionObjectd>(ball));
    owned.back()->setTranslation({fibers.points[6 * i], fibers.points[6 * i + 1], 0});
    objects.push_back(owned.back().get());
  }
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  options.skin = 0.1;
  LayeredAABBTreeCollisionManagerd manager(options);
  manager.registerObjects(objects);
  expectRefuses("live pairs", [&] { manager.update(); });
  // As after any update that throws, queries are refused until one succeeds.
  const auto ask = [&] {
    return manager.collide(nullptr, [](auto*, auto*, void*) { return true; });
  };
  EXPECT_THROW(ask(), std::invalid_argument);
  for (std::size_t i = 10; i < objects.size(); ++i) manager.unregisterObject(objects[i]);
  manager.update();
  ask();
}

TEST(HopelessScene, IsNoneWithAsManyPairsAsAnyoneNeeds) {
  // 5,000 segments that all touch have 12 million pairs, which fill no memory. Their contacts do.
  const Assembly<float> fibers = hopelessScene(5'000);
  FiberTree tree;
  tree.build(fibers.view());
  std::vector<SegmentPair> pairs;
  tree.find(Pairs{}, pairs);
  EXPECT_EQ(pairs.size(), 5'000u * 4'999u / 2);
  std::vector<Contact> contacts;
  expectRefuses("FiberTree::find(Contacts)", [&] { tree.find(Contacts{fibers.view()}, contacts); });
  EXPECT_LT(tree.closest(Contacts{fibers.view()}).distance, -19);
}

}  // namespace
}  // namespace fcl_fibers::test
