// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "harness/progress.h"
#include "harness/runs.h"
#include "measures.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 9;

struct Answer {
  double pairs = 0;       ///< resolved
  double pieces = 0;      ///< unresolved
  double unresolved = 0;  ///< pairs that the pieces stand for
};

Answer answerOf(const FiberTree& tree, const SearchBound& bound) {
  Answer answer;
  tree.visitPairs(
      bound, [&](SegmentPair) { ++answer.pairs; },
      [&](const UnresolvedPair& piece) {
        const auto a = static_cast<double>(piece.a_count), b = static_cast<double>(piece.b_count);
        ++answer.pieces;
        answer.unresolved += piece.a == piece.b ? a * (a - 1) / 2 : a * b;
      });
  return answer;
}

}  // namespace

bool measureBounds(const Request& request) {
  showProgress(request.scene.text + ": make the scene");
  const tools::SceneSource source = tools::openScene(request.scene.text, request.scene.radius);
  const scenes::FiberScene scene = source.scene();
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = 1;
  const auto tree = std::make_shared<FiberTree>(options);
  tree->build(scenes::fiberArrays(scene));

  const auto add = [&](const std::string& name, auto&& answer) {
    registerRuns("Bound/" + name + "/" + source.name, kRuns, [=](Numbers& numbers) {
      Answer got;
      const double time = seconds([&] { got = answer(); });
      numbers = {{"pairs", got.pairs}, {"pieces", got.pieces}, {"unresolved", got.unresolved}};
      return time;
    });
  };
  add("none", [tree] {
    Answer answer;
    tree->visitPairs([&](SegmentPair) { ++answer.pairs; });
    return answer;
  });
  add("all", [tree] { return answerOf(*tree, {}); });
  for (std::size_t tests = 1000; tests <= 100'000'000; tests *= 10) {
    add("tests:" + std::to_string(tests), [tree, tests] { return answerOf(*tree, {0, tests}); });
  }
  const double radius = scene.radiusAt(0);
  for (const int radii : {1000, 300, 100, 30, 10}) {
    SearchBound bound;
    bound.resolution = radii * radius;
    add("radii:" + std::to_string(radii), [tree, bound] { return answerOf(*tree, bound); });
  }
  return runRegistered();
}

}  // namespace fcl_fibers::benchmarks
