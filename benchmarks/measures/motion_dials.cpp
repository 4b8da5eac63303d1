// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "harness/runs.h"
#include "measures.h"
#include "scenes/step.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 5, kSlowRuns = 3;
constexpr int kPart = 10;                     // one out of so many fibers
constexpr double kSlow = 1;                   // seconds
constexpr std::size_t kMostPairs = 20000000;  // a query with more of them is ended

/// A part of the step, from its start to `time`.
FiberPolylines between(const scenes::Step& step, double time) {
  FiberPolylines result = step.start;
  for (std::size_t i = 0; i < result.points.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      result.points[i][axis] += time * (step.end.points[i][axis] - result.points[i][axis]);
    }
  }
  return result;
}

std::shared_ptr<FiberTree> treeAt(const scenes::Step& step, double margin = 0) {
  return makeTree(fiberArrays(step.start), {touchingOptions(1, 1, margin)});
}

/// A way to look for what touches during a step: reports pairs, returns the seconds that it took,
/// and whether it was ended.
struct Found {
  PairList pairs;
  double seconds = 0;
  bool is_ended = false;
};
using Way = std::function<void(Found&)>;

void query(const FiberTree& tree, Found& found) {
  found.seconds += seconds([&] {
    found.is_ended = tree.visit(Pairs{}, [&](SegmentPair pair) {
      found.pairs.emplace_back(pair.a, pair.b);
      return found.pairs.size() > kMostPairs;
    });
  });
}

/// Asks at so many instants, the last one at the end. Making the instants is not timed.
Way substeps(const std::shared_ptr<const scenes::Step>& step, int count) {
  const auto tree = treeAt(*step);
  return [=](Found& found) {
    for (int i = 1; i <= count; ++i) {
      const FiberPolylines instant =
          i == count ? step->end : between(*step, static_cast<double>(i) / count);
      found.seconds += seconds([&] { tree->update(fiberArrays(instant)); });
      query(*tree, found);
    }
  };
}

/// Asks at the start, with a margin.
Way withMargin(const std::shared_ptr<const scenes::Step>& step, double margin) {
  const auto tree = treeAt(*step, margin);
  return [=](Found& found) {
    tree->update(fiberArrays(step->end));
    found.seconds = seconds([&] { tree->update(fiberArrays(step->start)); });
    query(*tree, found);
  };
}

Way linearBounds(const std::shared_ptr<const scenes::Step>& step) {
  const auto tree = treeAt(*step);
  return [=](Found& found) {
    found.seconds = seconds([&] {
      tree->update(fiberArrays(step->start), fiberArrays(step->end));
      tree->visit(Impacts{}, [&](const Impact& impact) {
        found.pairs.emplace_back(impact.pair.a, impact.pair.b);
      });
    });
  };
}

void makeUnique(PairList& pairs) {
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
}

void registerWay(const std::string& name, const Way& way, const PairList& truth, double motion) {
  tools::progress("dials: check " + name);
  Found first;
  way(first);
  makeUnique(first.pairs);
  const Numbers counts = {{"impacts", static_cast<double>(truth.size())},
                          {"reported", static_cast<double>(first.pairs.size())},
                          {"missed", static_cast<double>(countWithout(truth, first.pairs))},
                          {"extra", static_cast<double>(countWithout(first.pairs, truth))},
                          {"ended", first.is_ended ? 1.0 : 0.0},
                          {"motion", motion}};
  if (first.is_ended) return registerNumbers("Dials/motion/" + name, counts);
  const int runs = first.seconds > kSlow ? kSlowRuns : kRuns;
  registerRuns("Dials/motion/" + name, runs, [=](Numbers& numbers) {
    numbers = counts;
    Found found;
    way(found);
    return found.seconds;
  });
}

bool measureMotionDials(const Request& request) {
  for (const int radii : {5, 50, 150, 480}) {
    const std::string before = std::to_string(radii) + "/";
    tools::progress("dials of motion: make the scene");
    scenes::CapParameters parameters;
    parameters.fibers = std::max(1, request.fibers / kPart);
    const auto step = std::make_shared<const scenes::Step>(scenes::makeCapStep(parameters, radii));
    const double motion = scenes::meanMotion(*step);
    const double in_radii = motion / parameters.radius;
    Found found;
    linearBounds(step)(found);
    PairList truth = std::move(found.pairs);
    makeUnique(truth);
    for (const int count : {1, 4, 16, 64}) {
      registerWay(before + "substeps/" + std::to_string(count), substeps(step, count), truth,
                  in_radii);
    }
    for (const int times : {1, 2}) {
      registerWay(before + "margin/" + std::to_string(times), withMargin(step, times * motion),
                  truth, in_radii);
    }
    registerWay(before + "linear/1", linearBounds(step), truth, in_radii);
  }
  return runRegistered();
}

const AddMeasure kMeasure("motion-dials", measureMotionDials);

}  // namespace

}  // namespace fcl_fibers::benchmarks
