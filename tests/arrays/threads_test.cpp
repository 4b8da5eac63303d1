// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_tree.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/array_fibers.h"
#include "arrays/meshes.h"

namespace fcl_fibers {
namespace {

using test::Assembly;
using test::curledFibers;

/// What a query hands out, in its order.
class Record {
 public:
  void operator()(SegmentPair pair) { add(pair.a, pair.b); }
  template <typename A, typename B>
  void add(A a, B b) {
    rows_.emplace_back(static_cast<std::int64_t>(a), static_cast<std::int64_t>(b));
  }
  std::size_t size() const { return rows_.size(); }
  bool operator!=(const Record& other) const { return rows_ != other.rows_; }

 private:
  std::vector<std::pair<std::int64_t, std::int64_t>> rows_;
};
using Query = std::function<void(const FiberTree&, const FiberTree&, Record&)>;

/// One of every kind that a tree has.
std::vector<Query> allQueries() {
  using Tree = FiberTree;
  return {
      [](const Tree& tree, const Tree&, Record& record) { tree.visitPairs(record); },
      [](const Tree& tree, const Tree& other, Record& record) { tree.visitPairs(other, record); },
      [](const Tree& tree, const Tree& other, Record& record) { other.visitPairs(tree, record); },
      [](const Tree& tree, const Tree&, Record& record) {
        std::vector<SegmentPair> pairs;
        tree.findPairs(pairs);
        for (const SegmentPair& pair : pairs) record(pair);
      },
      [](const Tree& tree, const Tree&, Record& record) {
        for (const TreeVolume& volume : tree.volumes(5)) {
          const FiberSegment first = tree.fiberSegment(volume.segments[0]);
          record.add(first.fiber, first.segment);
        }
        record.add(tree.fiberCount(), tree.segmentCount());
        EXPECT_GT(tree.memoryUsage(), 0u);
      },
      [](const Tree& tree, const Tree&, Record& record) {
        const auto add = [&](std::int32_t segment) { record.add(segment, 0); };
        tree.visitOverlaps(CapsuleShape{{-0.2, 0, 0}, {0.2, 0.1, 0}, 0.1}, add);
        tree.visitOverlaps(BoxShape{{-0.2, 0, 0}, {0.2, 0.1, 0.1}}, add);
      },
  };
}

/// Those of trees that keep capsules. They share a mesh.
std::vector<Query> meshQueries() {
  using Tree = FiberTree;
  const TriangleMesh mesh(test::ball<double>(0.3, 16, 24).view(), TriangleMesh::Kind::kSolid);
  return {
      [mesh](const Tree& tree, const Tree&, Record& record) {
        tree.visitMesh(mesh, [&](TrianglePair pair) { record.add(pair.segment, pair.triangle); });
      },
      [mesh](const Tree& tree, const Tree&, Record& record) {
        std::vector<std::int32_t> segments;
        tree.findTouching(mesh, segments);
        for (const std::int32_t segment : segments) record.add(segment, 0);
      },
      [mesh](const Tree& tree, const Tree&, Record& record) {
        std::vector<TrianglePair> pairs;
        tree.findNearest(mesh, 0.1, pairs);
        for (const TrianglePair& pair : pairs) record.add(pair.segment, pair.triangle);
      },
  };
}

class ArrayTreeThreads : public ::testing::TestWithParam<FiberTreeOptions> {};

TEST_P(ArrayTreeThreads, MayAskAtOnce) {
  // If this fails, queries on several threads disturb each other, although they are const.
  const auto first = curledFibers<double>(61, 60), second = curledFibers<double>(62, 40);
  for (const int threads : {1, 2}) {  // of each query; several share what they keep for the next
    FiberTreeOptions options = GetParam();
    options.threads = threads;
    options.ignored_neighbors = 1;
    FiberTree tree(options), other(options);
    tree.build(first.view());
    other.build(second.view());
    std::vector<Query> queries = allQueries();
    if (options.report == Report::kCapsules) {
      for (const Query& query : meshQueries()) queries.push_back(query);
    }
    std::vector<Record> expected(queries.size());
    for (std::size_t i = 0; i < queries.size(); ++i) {
      queries[i](tree, other, expected[i]);
      ASSERT_GT(expected[i].size(), 10u) << i;
    }

    constexpr std::size_t kAskers = 4;
    std::atomic<std::size_t> ready{0};
    std::vector<int> differ(kAskers, 0);
    std::vector<std::thread> askers;
    for (std::size_t asker = 0; asker < kAskers; ++asker) {
      askers.emplace_back([&, asker] {
        for (++ready; ready < kAskers;) std::this_thread::yield();
        for (std::size_t i = 0; i < 2 * queries.size(); ++i) {
          const std::size_t which = (asker + i) % queries.size();
          Record record;
          queries[which](tree, other, record);
          differ[asker] += record != expected[which];
        }
      });
    }
    for (std::thread& asker : askers) asker.join();
    EXPECT_EQ(differ, std::vector<int>(kAskers, 0));
  }
}

INSTANTIATE_TEST_SUITE_P(Volumes, ArrayTreeThreads,
                         ::testing::ValuesIn(test::allKinds(Report::kVolumes)));
INSTANTIATE_TEST_SUITE_P(Capsules, ArrayTreeThreads,
                         ::testing::ValuesIn(test::allKinds(Report::kCapsules)));

}  // namespace
}  // namespace fcl_fibers
