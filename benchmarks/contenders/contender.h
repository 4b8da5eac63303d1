// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>

#include "contenders/moving_fibers.h"
#include "tools/seconds.h"

namespace fcl_fibers::benchmarks {

using tools::seconds;

template <typename S>
using BasicManager = fcl::BroadPhaseCollisionManager<S>;
using Manager = BasicManager<double>;

/// One manager in one configuration.
template <typename S>
struct BasicContender {
  using Objects = std::vector<fcl::CollisionObject<S>*>;

  std::string manager;  ///< as in the benchmark's name
  std::string variant;  ///< likewise, `_` for a space
  bool ours;
  Boxes boxes;  ///< what it reads
  Reported reported;
  /// Constructs the manager for these objects, of which it registers none.
  MakeManager<S> make;
  /// Fibers are registered as fibers, and it reports no pair of adjacent segments.
  bool leaves_out_adjacent = false;
  /// It becomes slower with every update, so that it is timed anew before each.
  bool is_renewed = false;

  /// `LayeredAABBTree/boxes_2_threads`
  std::string name() const { return variant.empty() ? manager : manager + "/" + variant; }
  /// `LayeredAABBTree, boxes 2 threads`
  std::string title() const;

  /// Constructs the manager, registers the objects and calls setup().
  std::unique_ptr<BasicManager<S>> setUp(const Objects& objects) const;
  std::unique_ptr<BasicManager<S>> setUp(const BasicMovingFibers<S>& fibers) const;
};

extern template struct BasicContender<float>;
extern template struct BasicContender<double>;
using Contender = BasicContender<double>;

/// LayeredAABBTree/{boxes,capsules,super_thread}, the first two on 2 threads too, and
/// WrappedSphereTree/{spheres,capsules,super_thread}; objects are registered without their fibers.
std::vector<Contender> ourContenders();

/// The same trees on one thread, with fibers registered as fibers and adjacent segments left out,
/// as the paper does. `super_thread` is the paper's tree.
std::vector<Contender> paperTrees();

/// FCL's dynamic tree and its array form, built in each of the ways that `tree_init_level` names,
/// such as DynamicAABBTree/tight_level_0.
std::vector<Contender> fclTrees(Boxes boxes);

/// FCL's managers as FCL constructs them, such as SaP/tight, its trees among them.
template <typename S = double>
std::vector<BasicContender<S>> fclManagers(Boxes boxes);

/// FCL's managers but its trees.
std::vector<Contender> otherFclManagers(Boxes boxes);

/// Of the card: fclManagers() on both kinds of boxes, and ours on the published topology and on
/// bundles, such as LayeredAABBTree/published.
template <typename S>
std::vector<BasicContender<S>> cardContenders();

/// Embree's and Bullet's trees, those of them that this program was built with.
std::vector<Contender> foreignContenders();

/// Names of the libraries that it was built without, `Embree, Bullet`.
std::string missingLibraries();

/// Who is measured.
struct Against {
  std::vector<Contender> contenders;
  /// For these boxes FCL's trees are tried at every level, and the fastest of them join.
  std::vector<Boxes> fcl_trees;
  bool narrow_phase = false;  ///< the fastest of them also with fcl::collide on their pairs
  bool quick = false;         ///< nobody is hopeless, and two are checked at once

  /// The contenders, and all of FCL's trees that are tried.
  std::vector<Contender> all() const;
};

/// Reads `--against`: headline, full, all, paper, paper_all, or names of contenders, `NAME,NAME`,
/// or `paper:NAME,NAME`, where names of ours are those of paperTrees(). Throws
/// std::invalid_argument where there is no such contender.
Against readAgainst(const std::string& text);

/// Pairs that a query visits: those that it reports, and all that it meets before any filter.
struct PairCount {
  std::size_t pairs = 0;
  std::size_t visited = 0;
};

/// A manager of another library behind FCL's interface.
class ForeignManager {
 public:
  virtual ~ForeignManager() = default;
  /// At less cost than by a callback for each pair.
  virtual PairCount countPairs() const = 0;
  /// What the library keeps, if `allocated` is what malloc gave for the manager.
  virtual std::size_t libraryBytes(std::size_t allocated) const = 0;
};

/// The phases that are timed.
enum class Phase { kSetUp, kUpdate, kDetection };
constexpr std::size_t kPhases = 3;
/// `set_up`, `update`, `detection`
const char* phaseName(Phase phase);

/// After a motion: boxes as the manager reads them, and update().
template <typename S>
void update(const BasicContender<S>& contender, BasicMovingFibers<S>& fibers,
            BasicManager<S>& manager) {
  fibers.computeBoxes(contender.boxes);
  manager.update();
}

/// A callback that counts in the std::size_t that its data points to.
template <typename S>
bool countPair(fcl::CollisionObject<S>*, fcl::CollisionObject<S>*, void* count) {
  ++*static_cast<std::size_t*>(count);
  return false;
}

/// Self-collision with a callback that does nothing but count, or however the manager counts.
template <typename S>
PairCount countPairs(const BasicManager<S>& manager) {
  if (const auto* foreign = dynamic_cast<const ForeignManager*>(&manager)) {
    return foreign->countPairs();
  }
  std::size_t count = 0;
  manager.collide(&count, countPair<S>);
  return {count, count};
}

}  // namespace fcl_fibers::benchmarks
