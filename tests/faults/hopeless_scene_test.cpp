// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <thread>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <tbb/global_control.h>

#include "support/allocation_faults.h"
#include "support/assembly.h"
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

}  // namespace
}  // namespace fcl_fibers::test
