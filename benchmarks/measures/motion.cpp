// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "contenders/swept_tree.h"
#include "harness/runs.h"
#include "judge/impact_judge.h"
#include "measures.h"
#include "measures/meshes.h"
#include "scenes/step.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 7, kSlowRuns = 5;
constexpr double kSlow = 5;         // seconds
constexpr double kMostSwept = 150;  // radii, of boxes around both positions; more take minutes
constexpr int kJudgedPart = 10;     // one out of so many fibers

scenes::Step makeStep(const Request& request, int fibers) {
  tools::progress("cap in motion: make the scene");
  scenes::CapParameters parameters;
  parameters.fibers = std::max(1, fibers);
  return scenes::makeCapStep(parameters, request.radii);
}

/// At the start of a step.
std::shared_ptr<FiberTree> treeAt(const scenes::Step& step, int threads = 1) {
  return makeTree(fiberArrays(step.start), {touchingOptions(1, threads)});
}

scenes::Step reversed(const scenes::Step& step) { return {step.end, step.start}; }

void update(FiberTree& tree, const scenes::Step& step) {
  tree.update(fiberArrays(step.start), fiberArrays(step.end));
}

/// Counts impacts, and notes their pairs if it is told where.
class ImpactSink final : public index::PairSink {
 public:
  explicit ImpactSink(PairList* pairs = nullptr) : pairs_(pairs) {}
  tree::Visit take(const index::PairRun& run) override {
    count_ += run.count;
    for (std::size_t i = 0; pairs_ != nullptr && i < run.count; ++i) {
      pairs_->push_back(std::minmax(run.pairs[i].a, run.pairs[i].b));
    }
    return tree::Visit::kContinue;
  }
  std::size_t count() const { return count_; }

 private:
  PairList* pairs_;
  std::size_t count_ = 0;
};

/// Judges each pair whose boxes around both positions overlap.
class Judge final : public index::PairSink {
 public:
  Judge(const scenes::Step& step, const std::vector<Impact>& found)
      : step_(step), found_(found.size()) {
    for (const Impact& impact : found) {
      times_.emplace(std::pair(impact.pair.a, impact.pair.b), impact.time);
    }
  }

  tree::Visit take(const index::PairRun& run) override {
    for (std::size_t i = 0; i < run.count; ++i) {
      const auto [a, b] = run.pairs[i];
      if (std::abs(a - b) > 1) judge(std::minmax(a, b));
    }
    return tree::Visit::kContinue;
  }

  /// Impacts that were found outside of all candidates count as extra.
  Numbers numbers() const {
    return {{"touching", static_cast<double>(touching_)},
            {"missed", static_cast<double>(missed_)},
            {"extra", static_cast<double>(extra_ + found_ - seen_)},
            {"undecided", static_cast<double>(undecided_)},
            {"late", static_cast<double>(late_)},
            {"widest_gap", widest_gap_ / step_.start.radius}};
  }
  bool isRight() const { return missed_ + extra_ + late_ == 0 && seen_ == found_; }

 private:
  Capsule capsule(const FiberPolylines& scene, std::int32_t segment) const {
    const auto i = static_cast<std::size_t>(segment);
    return {toVector(scene.points[i]), toVector(scene.points[i + 1]), scene.radiusAt(i)};
  }
  MovingCapsule moving(std::int32_t segment) const {
    return {capsule(step_.start, segment), capsule(step_.end, segment)};
  }

  void judge(const std::pair<std::int32_t, std::int32_t>& pair) {
    const MovingCapsule a = moving(pair.first), b = moving(pair.second);
    const JudgedImpact judged = judgeImpact(a, b);
    const auto at = times_.find(pair);
    const bool is_found = at != times_.end();
    seen_ += is_found ? 1 : 0;
    touching_ += judged.contact == Contact::kTouching ? 1 : 0;
    undecided_ += judged.contact == Contact::kBoundary ? 1 : 0;
    missed_ += judged.contact == Contact::kTouching && !is_found ? 1 : 0;
    if (!is_found) return;
    const double time = at->second;
    const Capsule p = a.at(time), q = b.at(time);
    const double gap = segmentDistance(p.from, p.to, q.from, q.to) - (p.radius + q.radius);
    widest_gap_ = std::max(widest_gap_, gap);
    extra_ += judged.contact == Contact::kApart ? 1 : 0;
    late_ += judged.contact == Contact::kTouching && time > judged.to ? 1 : 0;
  }

  const scenes::Step& step_;
  std::map<std::pair<std::int32_t, std::int32_t>, double> times_;  ///< of what was found
  std::size_t found_;
  std::size_t touching_ = 0, missed_ = 0, extra_ = 0, undecided_ = 0, late_ = 0, seen_ = 0;
  double widest_gap_ = 0;  ///< of two capsules at the time of their impact
};

/// Checks a part of the scene by the judge.
bool registerJudged(const Request& request) {
  const scenes::Step step = makeStep(request, request.fibers / kJudgedPart);
  tools::progress("motion: judge the impacts");
  const auto tree = treeAt(step);
  update(*tree, step);
  std::vector<Impact> impacts;
  tree->find(Impacts{}, impacts);
  Judge judge(step, impacts);
  const auto swept = ourSweptTree();
  swept->update(step);
  swept->searchCandidates(judge);
  Numbers numbers = judge.numbers();
  registerNumbers("Judged/impacts", numbers);
  if (judge.isRight()) return true;
  const auto count = [&](const char* what) {
    return std::to_string(static_cast<int>(numbers[what]));
  };
  return tellWrong("motion: ours misses " + count("missed") + " impacts, has " + count("extra") +
                   " too many and " + count("late") + " too late");
}

/// Our trees, which live through all runs: one at rest at the start of the step, one in motion.
void registerOurs(const std::shared_ptr<const scenes::Step>& step, int threads) {
  const auto still = treeAt(*step, threads), moving = treeAt(*step, threads);
  const std::string name = threads == 1 ? "ours" : "ours_" + std::to_string(threads) + "_threads";
  registerRuns("Motion/" + name, runsOf(true, kSlowRuns), [=](Numbers& numbers) {
    // All come from the other end of the step.
    still->update(fiberArrays(step->end));
    moving->update(fiberArrays(step->end), fiberArrays(step->start));
    numbers["static_update"] = seconds([&] { still->update(fiberArrays(step->start)); });
    numbers["update"] = seconds([&] { update(*moving, *step); });
    numbers["static_query"] = secondsOfCount(*still, Pairs{}, numbers["touching"]);
    numbers["moving_pairs_query"] = secondsOfCount(*moving, MovingPairs{}, numbers["candidates"]);
    numbers["query"] = secondsOfCount(*moving, Impacts{}, numbers["impacts"]);
    numbers["segments"] = static_cast<double>(step->start.segmentCount());
    numbers["motion"] = scenes::meanMotion(*step) / step->start.radius;
    numbers["bytes"] = static_cast<double>(moving->memoryUsage());
    return numbers["update"] + numbers["query"];
  });
}

/// A tree over boxes around both positions. It has to find what ours finds before it is timed. It
/// lives only while it runs, because an Embree of one thread allows no other to oneTBB.
bool registerSwept(const std::shared_ptr<const scenes::Step>& step, const std::string& name,
                   const std::function<std::unique_ptr<SweptTree>()>& makeTree,
                   const PairList& truth) {
  tools::progress("motion: check " + name);
  PairList pairs;
  ImpactSink all(&pairs);
  double taken = 0;
  {
    const auto tree = makeTree();
    tree->update(*step);
    taken = seconds([&] { tree->searchImpacts(all); });
  }
  std::sort(pairs.begin(), pairs.end());
  if (pairs != truth) {
    return tellWrong("motion: " + name + " finds " + std::to_string(pairs.size()) +
                     " impacts, and ours " + std::to_string(truth.size()));
  }
  registerRuns("Motion/" + name, taken > kSlow ? kSlowRuns : kRuns,
               [=, count = truth.size()](Numbers& numbers) {
                 const auto tree = makeTree();
                 tree->update(reversed(*step));
                 numbers["update"] = seconds([&] { tree->update(*step); });
                 ImpactSink impacts;
                 std::size_t candidates = 0;
                 numbers["query"] = seconds([&] { candidates = tree->searchImpacts(impacts); });
                 if (impacts.count() != count) throw std::runtime_error("finds other impacts");
                 numbers["candidates"] = static_cast<double>(candidates);
                 return numbers["update"] + numbers["query"];
               });
  return true;
}

PairList impactPairs(const scenes::Step& step) {
  const auto tree = treeAt(step);
  update(*tree, step);
  PairList pairs;
  tree->visit(Impacts{},
              [&](const Impact& impact) { pairs.emplace_back(impact.pair.a, impact.pair.b); });
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// The safe step of segments none of which touch at the start: their radii are halved until then.
bool registerSafeStep(const Request& request) {
  scenes::Step made = makeStep(request, request.fibers * 2 / 5);
  tools::progress("motion: reduce the radii");
  const double radius = made.start.radius;
  const auto tree = treeAt(made);
  while (tree->visit(Pairs{}, [](SegmentPair) { return true; })) {
    made.start.radius /= 2;
    made.end.radius = made.start.radius;
    tree->update(fiberArrays(made.start));
  }
  update(*tree, made);
  double least = 1;
  tree->visit(Impacts{}, [&](const Impact& impact) { least = std::min(least, impact.time); });
  const double fraction = tree->safeStep();
  // Both are certified as distances. The first pairs to touch are fast for their size, so that such
  // a tolerance is a very small part of the step.
  constexpr double kTolerance = 1e-9;
  if (!(std::abs(fraction - least) <= kTolerance)) {
    return tellWrong("motion: the safe step is " + std::to_string(1e9 * (fraction - least)) +
                     " billionths later than the first impact");
  }
  const auto step = std::make_shared<const scenes::Step>(std::move(made));
  registerRuns("Safe/step", kRuns, [=](Numbers& numbers) {
    numbers["query"] = secondsOfCount(*tree, Impacts{}, numbers["impacts"]);
    numbers["radius"] = step->start.radius / radius;
    double found = 0;
    const double taken = seconds([&] { found = tree->safeStep(); });
    numbers["fraction"] = found;
    return taken;
  });
  return true;
}

bool measureMotion(const Request& request) {
  bool right = registerJudged(request);
  right = registerSafeStep(request) && right;
  const auto step = std::make_shared<const scenes::Step>(makeStep(request, request.fibers));
  for (const int threads : {1, 2}) registerOurs(step, threads);
  if (request.radii <= kMostSwept) {
    const PairList truth = impactPairs(*step);
    right = registerSwept(step, "swept_boxes", ourSweptTree, truth) && right;
#ifdef FCL_FIBERS_WITH_EMBREE
    for (const bool morton : {false, true}) {
      right = registerSwept(
                  step, morton ? "Embree_morton" : "Embree_rebuild",
                  [morton] { return embreeSweptTree(morton); }, truth) &&
              right;
    }
#endif
  }
  return runRegistered() && right;
}

const AddMeasure kMeasure("motion", measureMotion);

}  // namespace

}  // namespace fcl_fibers::benchmarks
