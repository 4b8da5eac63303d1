// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>
#include <fcl_fibers/fiber_manager_options.h>

#include "moving_fibers.h"

namespace fcl_fibers::benchmarks {

using Manager = fcl::BroadPhaseCollisionManagerd;

/// Which pairs a manager is to report. It may report more where it says "at least".
enum class Reported {
  kTouchingAtLeast,  ///< every touching pair: what any broad phase must do
  kTightBoxes,       ///< pairs of overlapping tight boxes, up to the rounding of bounds
  kSpheres,          ///< pairs of overlapping spheres, the same for all that say so
  kTouching,         ///< touching pairs and no other
};

/// One manager in one configuration.
struct Contender {
  std::string manager;  ///< as in the benchmark's name
  std::string variant;  ///< likewise, `_` for a space
  bool ours;
  Boxes boxes;  ///< what it reads
  Reported reported;
  /// Constructs the manager, registers the objects and calls setup().
  std::function<std::unique_ptr<Manager>(const MovingFibers&)> set_up;

  /// As in the table.
  std::string title() const;
};

std::vector<Contender> allContenders();

/// Our box tree over bundles.
Contender boxTreeContender(const std::string& variant, Report report, int threads);

/// FCL's dynamic tree and its array form, built in each of the ways that `tree_init_level` names,
/// such as DynamicAABBTree/tight_level_0.
std::vector<Contender> fclTreeContenders(Boxes boxes);

/// What a manager has that counts its pairs at less cost than by a callback for each.
class CountsPairs {
 public:
  virtual ~CountsPairs() = default;
  virtual std::size_t countPairs() const = 0;
};

/// The phases that are timed.
enum class Phase { kSetUp, kUpdate, kSelfCollision, kFrame };
constexpr int kPhases = 4;
const char* phaseName(Phase phase);

/// After a motion: boxes as the manager reads them, and update().
inline void update(const Contender& contender, MovingFibers& fibers, Manager& manager) {
  fibers.computeBoxes(contender.boxes);
  manager.update();
}

/// Self-collision with a callback that does nothing but count, or however the manager counts.
std::size_t countPairs(const Manager& manager);

/// Wall-clock seconds that `work()` takes.
template <typename Work>
double seconds(Work&& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace fcl_fibers::benchmarks
