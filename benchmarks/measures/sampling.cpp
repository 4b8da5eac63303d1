// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/io/sampling.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "harness/runs.h"
#include "measures.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kFinest = 2000, kRuns = 5;
constexpr double kLength = 30;  // cm, of makeHelix()

FiberPolylines helixOf(int segments) {
  return openScene("helix:fibers=1000,segments=" + std::to_string(segments), {}).scene();
}

/// Two fibers, and the segment of the one that touches a segment of the other.
using Touch = std::array<std::size_t, 4>;

class Sampled {
 public:
  Sampled(int segments, double margin)
      : scene_(helixOf(segments)),
        tree_(makeTree(fiberArrays(scene_), {touchingOptions(1, 1, margin)})) {}

  double frame() {
    std::size_t pairs = 0;
    return seconds([&] {
      tree_->update(fiberArrays(scene_));
      tree_->visit(Pairs{}, [&](SegmentPair) { ++pairs; });
    });
  }

  std::set<Touch> touches() const {
    std::set<Touch> found;
    tree_->visit(Pairs{}, [&](SegmentPair pair) {
      FiberSegment a = tree_->fiberSegment(pair.a), b = tree_->fiberSegment(pair.b);
      if (a.fiber == b.fiber) return;
      if (b.fiber < a.fiber) std::swap(a, b);
      found.insert({a.fiber, b.fiber, a.number, b.number});
    });
    return found;
  }

 private:
  FiberPolylines scene_;
  std::shared_ptr<FiberTree> tree_;
};

/// How many of `some`, cut into `from` segments a fiber, have none of `others`, cut into `to`,
/// where they are or a segment beside.
std::size_t countWithout(const std::set<Touch>& some, int from, const std::set<Touch>& others,
                         int to) {
  const auto range = [&](std::size_t segment) {
    const auto f = static_cast<std::size_t>(from), t = static_cast<std::size_t>(to);
    const std::size_t first = segment * t / f, last = ((segment + 1) * t - 1) / f;
    return std::pair(first == 0 ? first : first - 1, last + 1);
  };
  std::size_t count = 0;
  for (const auto& [fiber_a, fiber_b, a, b] : some) {
    const auto [a_first, a_last] = range(a);
    const auto [b_first, b_last] = range(b);
    bool found = false;
    const auto end = others.lower_bound({fiber_a, fiber_b, a_last + 1, 0});
    for (auto it = others.lower_bound({fiber_a, fiber_b, a_first, 0}); !found && it != end; ++it) {
      found = b_first <= (*it)[3] && (*it)[3] <= b_last;
    }
    count += found ? 0 : 1;
  }
  return count;
}

bool measureSampling(const Request&) {
  tools::progress("helix: the finest sampling");
  const Sampled finest(kFinest, 0);
  const std::set<Touch> truth = finest.touches();
  const double curvature = io::largestCurvature(helixOf(kFinest));
  for (const bool with_margin : {false, true}) {
    for (const int segments : {25, 50, 100, 200, 400, 1000, 2000}) {
      const double error = io::chordError(curvature, kLength / segments);
      const double both = error + io::chordError(curvature, kLength / kFinest);
      const auto sampled = std::make_shared<Sampled>(segments, with_margin ? 2 * both : 0);
      const std::set<Touch> touches = sampled->touches();
      const std::size_t missed = countWithout(truth, kFinest, touches, segments);
      const std::size_t extra = countWithout(touches, segments, truth, kFinest);
      registerRuns("Sampling/" + std::to_string(segments) + (with_margin ? "/margin" : "/plain"),
                   kRuns, [=, count = truth.size(), reported = touches.size()](Numbers& numbers) {
                     numbers["chord_error"] = error;
                     numbers["contacts"] = static_cast<double>(count);
                     numbers["reported"] = static_cast<double>(reported);
                     numbers["missed"] = static_cast<double>(missed);
                     numbers["extra"] = static_cast<double>(extra);
                     return sampled->frame();
                   });
    }
  }
  return runRegistered();
}

const AddMeasure kMeasure("sampling", measureSampling);

}  // namespace

}  // namespace fcl_fibers::benchmarks
