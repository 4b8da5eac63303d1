// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

#include "contenders/narrow_solvers.h"
#include "harness/runs.h"
#include "measures.h"
#include "measures/pair_scenes.h"
#include "tools/messages.h"
#include "tools/seconds.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 25;  // short ones
constexpr double kEps = std::numeric_limits<double>::epsilon();

template <typename S>
PosedCapsule posedCapsule(const fcl::CollisionObject<S>& object) {
  const auto& capsule = static_cast<const fcl::Capsule<S>&>(*object.collisionGeometry());
  const fcl::Transform3<S>& pose = object.getTransform();
  return {pose.translation().template cast<double>(), pose.linear().col(2).template cast<double>(),
          static_cast<double>(capsule.lz), static_cast<double>(capsule.radius)};
}

/// Blocks, for the objects of pairs that follow each other are in the cache.
IndexPairs sampleOf(const IndexPairs& pairs) {
  constexpr std::size_t kBlock = 100, kBlocks = 20;
  const std::size_t stride = std::max<std::size_t>(1, pairs.size() / kBlock / kBlocks);
  IndexPairs sample;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (i / kBlock % stride == 0) sample.push_back(pairs[i]);
  }
  return sample;
}

struct Truth {
  IndexPairs pairs;
  std::vector<std::optional<std::uint32_t>> exact_of;  ///< by pair; none if it is clearly apart
  std::vector<ExactContact> exact;
  std::vector<double> radius;  ///< the mean of both, by exact contact
  double extent = 0;
  std::size_t touching = 0;
};

Truth truthOf(const std::vector<PosedCapsule>& capsules, IndexPairs pairs) {
  Truth truth;
  truth.pairs = std::move(pairs);
  Eigen::AlignedBox3d around;
  for (const PosedCapsule& c : capsules) around.extend(c.centre);
  truth.extent = around.sizes().maxCoeff();
  for (const auto& [a, b] : truth.pairs) {
    const auto exact = ExactContact::of(capsules[a], capsules[b]);
    truth.exact_of.emplace_back();
    if (!exact) continue;
    truth.exact_of.back() = static_cast<std::uint32_t>(truth.exact.size());
    truth.exact.push_back(*exact);
    truth.radius.push_back((capsules[a].radius + capsules[b].radius) / 2);
    truth.touching += exact->touching() ? 1 : 0;
  }
  return truth;
}

/// The median and the worst, NaN if there is none.
class Errors {
 public:
  void add(Exact error) {
    // NaN is no answer at all.
    errors_.push_back(error == error ? static_cast<double>(error)
                                     : std::numeric_limits<double>::infinity());
  }
  void write(const std::string& name, Numbers& numbers) {
    std::sort(errors_.begin(), errors_.end());
    const double none = std::numeric_limits<double>::quiet_NaN();
    numbers[name + "_median"] = errors_.empty() ? none : errors_[errors_.size() / 2];
    numbers[name + "_most"] = errors_.empty() ? none : errors_.back();
  }

 private:
  std::vector<double> errors_;
};

/// What docs/numerics.md promises of pairs that are reported, if capsules have thickness.
Exact promisedDistance(const Truth& truth, const ExactContact& exact) {
  return 16 * kEps * (truth.extent + exact.size());
}
/// What fcl_fibers::Contact promises of its distance.
Exact promisedDepth(const ExactContact& exact, double radius) {
  return 32 * kEps * (exact.size() + 2 * radius);
}

Numbers judge(const Truth& truth, const NarrowSolver& solver,
              const std::vector<NarrowAnswer>& answers) {
  double missed = 0, wrong = 0, beyond = 0, broken = 0;
  Errors depth, normal, point, way;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const NarrowAnswer& answer = answers[i];
    if (!truth.exact_of[i]) {
      wrong += answer.touching ? 1 : 0;
      beyond += answer.touching ? 1 : 0;
      continue;
    }
    const ExactContact& exact = truth.exact[*truth.exact_of[i]];
    const double radius = truth.radius[*truth.exact_of[i]];
    if (!answer.touching) {
      if (!exact.touching()) continue;
      missed += 1;
      // Who computes a distance and compares may err by its rounding. A manager never may.
      const bool is_rounding = -exact.distance() <= promisedDepth(exact, radius);
      broken += is_rounding && solver.name == "capsuleContact" ? 0 : 1;
      continue;
    }
    if (!exact.touching()) {
      wrong += 1;
      beyond += exact.distance() > promisedDistance(truth, exact) ? 1 : 0;
      continue;
    }
    if (!solver.with_contact) continue;
    const Exact error = std::fabs(answer.depth + exact.distance());
    broken += error <= promisedDepth(exact, radius) ? 0 : 1;
    depth.add(error / radius);
    point.add(exact.distanceTo(answer.point) / radius);
    way.add(exact.wayBeyond(answer.normal) / radius);
    // The line between axes that meet has no direction.
    if (exact.axisDistance() >= Exact(0.002) * radius) normal.add(exact.angleTo(answer.normal));
  }
  Numbers numbers = {{"pairs", static_cast<double>(answers.size())},
                     {"touching", static_cast<double>(truth.touching)},
                     {"missed", missed},
                     {"false", wrong},
                     {"beyond", beyond},
                     {"broken", broken + beyond}};  // of all that is promised of ours
  if (solver.with_contact) {
    depth.write("depth", numbers);
    normal.write("normal", numbers);
    point.write("point", numbers);
    way.write("way", numbers);
  }
  return numbers;
}

/// Whether a manager hands on what touches, once, and nothing else, neighbours in a fiber aside.
/// @param paired  there may be other pairs than those of the truth
template <typename S>
void requireOfManager(const Truth& truth, const CapsuleObjects<S>& objects, bool paired,
                      const std::string& scene) {
  LayeredAABBTreeCollisionManager<S> manager(FiberManagerOptions{touchingOptions()});
  std::vector<fcl::CollisionObject<S>*> pointers;
  for (const auto& object : objects) pointers.push_back(object.get());
  for (std::size_t i = 0; i < objects.size(); ++i) {
    pointers[i]->setUserData(reinterpret_cast<void*>(i));
  }
  manager.registerObjects(pointers);
  manager.setup();
  IndexPairs found;
  manager.collide(&found, [](auto* a, auto* b, void* data) {
    const auto number = [](auto* object) {
      return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(object->getUserData()));
    };
    static_cast<IndexPairs*>(data)->push_back(std::minmax(number(a), number(b)));
    return false;
  });
  std::sort(found.begin(), found.end());
  std::size_t missed = 0, beyond = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const bool is_known = std::binary_search(truth.pairs.begin(), truth.pairs.end(), found[i]) ||
                          found[i].second == found[i].first + 1;
    const bool is_again = i > 0 && found[i] == found[i - 1];
    beyond += is_again || (!paired && !is_known) ? 1 : 0;
  }
  for (std::size_t i = 0; i < truth.pairs.size(); ++i) {
    const bool is_found = std::binary_search(found.begin(), found.end(), truth.pairs[i]);
    const ExactContact* const exact =
        truth.exact_of[i] ? &truth.exact[*truth.exact_of[i]] : nullptr;
    const bool is_near = exact != nullptr && exact->distance() <= promisedDistance(truth, *exact);
    missed += exact != nullptr && exact->touching() && !is_found ? 1 : 0;
    beyond += is_found && !is_near ? 1 : 0;
  }
  if (missed + beyond > 0) {
    throw std::runtime_error("narrow: " + scene + ": the manager misses " + std::to_string(missed) +
                             " contacts, and reports " + std::to_string(beyond) +
                             " pairs that are none, or once more");
  }
}

template <typename S>
void registerScene(const PairScene& scene) {
  const std::string name = scene.name + (std::is_same_v<S, float> ? "/float" : "/double");
  tools::progress("narrow: " + name);
  const auto objects = std::make_shared<CapsuleObjects<S>>(makeObjects<S>(scene.fibers));
  std::vector<PosedCapsule> capsules;
  for (const auto& object : *objects) capsules.push_back(posedCapsule(*object));
  const Truth truth = truthOf(capsules, pairsOf(scene, capsules));
  requireOfManager<S>(truth, *objects, scene.paired, name);
  const auto sample = std::make_shared<IndexPairs>(sampleOf(truth.pairs));
  std::vector<NarrowAnswer> answers;
  for (const NarrowSolver& solver : narrowSolvers(*objects)) {
    tools::progress("narrow: " + name + ": " + solver.name);
    solver.answer(truth.pairs, answers);
    const Numbers judged = judge(truth, solver, answers);
    const std::string full =
        "Narrow/" + name + "/" + solver.name + (solver.with_contact ? "/contact" : "/touch");
    if (solver.ours && judged.at("broken") > 0) {
      const auto broken = static_cast<std::size_t>(judged.at("broken"));
      throw std::runtime_error(full + ": " + std::to_string(broken) +
                               " answers are not as promised");
    }
    // The solver borrows the objects.
    const auto run = [solver, judged, sample, objects](Numbers& numbers) {
      numbers = judged;
      const double taken = secondsOfCall([&] { solver.work(*sample); });
      return taken / static_cast<double>(sample->size());
    };
    registerRuns(full, runsOf(solver.ours, kRuns), run, solver.ours);
  }
}

bool measureNarrow(const Request& request) {
  tools::progress("narrow: make the scene");
  const FiberPolylines scene = openScene(request.scene.text, request.scene.radius).scene();
  // The unit is the centimetre.
  for (const auto& [name, scale, offset] :
       {std::tuple("cm", 1.0, 0.0), std::tuple("m", 0.01, 0.0), std::tuple("um", 1e4, 0.0),
        std::tuple("m, 100 m away", 0.01, 100.0)}) {
    const PairScene hair{name, scaled(scene, scale, offset), /*paired=*/false};
    registerScene<double>(hair);
    registerScene<float>(hair);
  }
  constexpr int kPairs = 2000;
  for (const char* const kind : {"crossing", "parallel", "near-parallel", "axes that meet", "joint",
                                 "end to end", "nested", "grazing", "balls", "thick"}) {
    const PairScene pairs = extreme(kind, kPairs);
    registerScene<double>(pairs);
    registerScene<float>(pairs);
  }
  for (const auto& [name, scale] : {std::pair("tiny", 1e-12), std::pair("huge", 1e12)}) {
    PairScene pairs = extreme("crossing", kPairs);
    pairs = {name, scaled(std::move(pairs.fibers), scale, 0), /*paired=*/true};
    registerScene<double>(pairs);
    registerScene<float>(pairs);
  }
  return runRegistered();
}

const AddMeasure kMeasure("narrow", measureNarrow);

}  // namespace

}  // namespace fcl_fibers::benchmarks
