// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>

#include "contenders/moving_fibers.h"
#include "tools/seconds.h"

namespace fcl_fibers::benchmarks {

using tools::seconds;

template <typename S>
using BasicManager = fcl::BroadPhaseCollisionManager<S>;
using Manager = BasicManager<double>;

/// Contenders that are asked for together.
enum class Group {
  kOurs,             ///< ours with their defaults
  kPublished,        ///< ours on the published topology and on bundles, of the card
  kFclTrees,         ///< FCL's dynamic tree and its array form, as FCL constructs them
  kFclOthers,        ///< its other managers
  kFclTuned,         ///< its two trees at each tree_init_level; they are tried
  kFclNeverRebuilt,  ///< these with kNeverRebuilt, on tight boxes; of the group kFclTuned
  kForeign,          ///< trees of other libraries, and a grid
  kForeignTuned,     ///< those that are tried as FCL's are
};

/// The max_tree_nonbalanced_level of a dynamic tree that updates only refit and balance. With
/// FCL's and coal's default of 10 an update also rebuilds a tree that a higher tree_init_level has
/// made deep.
constexpr int kNeverRebuilt = 1000;

/// One manager in one configuration.
template <typename S>
struct BasicContender {
  using Objects = std::vector<fcl::CollisionObject<S>*>;

  Group group;
  std::string manager;  ///< as in the benchmark's name
  std::string variant;  ///< in that name, with `_` for a space
  bool ours;            ///< what is wrong with it fails the program
  Boxes boxes;          ///< of FCL's objects, which it reads
  Reported reported;
  /// Constructs the manager for these objects, of which it registers none.
  MakeManager<S> make;
  /// It becomes slower with every update, so that it is timed anew before each.
  bool is_renewed = false;
  /// Fibers are registered as fibers, and it reports no pair of adjacent segments.
  bool leaves_out_adjacent = false;
  /// Moves objects of its own to where FCL's are, which takes time of nobody. Empty if it has none.
  std::function<void(const Objects&)> follow = {};

  /// `LayeredAABBTree/boxes_2_threads`
  std::string name() const { return variant.empty() ? manager : manager + "/" + variant; }
  /// `LayeredAABBTree, boxes 2 threads`
  std::string title() const;

  /// See BasicMovingFibers, whose objects its own follow.
  ///@{
  void setPoses(BasicMovingFibers<S>& fibers, int frame) const;
  void bringTo(BasicMovingFibers<S>& fibers, int frame) const;
  ///@}

  /// Constructs the manager, registers the objects and calls setup().
  std::unique_ptr<BasicManager<S>> setUp(const Objects& objects) const;
  std::unique_ptr<BasicManager<S>> setUp(const BasicMovingFibers<S>& fibers) const;
};

extern template struct BasicContender<float>;
extern template struct BasicContender<double>;
using Contender = BasicContender<double>;

/// All of these groups. Those of FCL are on tight boxes and on stock ones, such as
/// DynamicAABBTree/tight_level_0, unless one kind of boxes is asked for.
template <typename S = double>
std::vector<BasicContender<S>> allOf(std::initializer_list<Group> groups,
                                     std::optional<Boxes> boxes = {});

/// One of ours, `LayeredAABBTree/boxes`. Throws std::out_of_range if there is none.
Contender ourContender(const std::string& name);

/// The trees of Group::kOurs on one thread, with fibers registered as fibers and adjacent segments
/// left out, as the paper does. `super_thread` is the paper's tree.
template <typename S = double>
std::vector<BasicContender<S>> paperTrees();

/// Those of Group::kForeign and kForeignTuned, to which files beside this one add before main().
std::vector<Contender>& foreignContenders();

/// Libraries beside which it runs, `FCL 0.7.0, Embree 3.13.5`, and names of those that it was built
/// without, `coal, Bullet`.
///@{
std::string versionsOfLibraries();
std::string missingLibraries();
///@}

/// What a frame does with the pairs that a manager reports.
enum class PairWork {
  kCount,    ///< nothing else
  kTest,     ///< the closed-form test of two capsules, in the manager's callback
  kCollide,  ///< fcl::collide on them, or on a sample of them; coal::collide on those of coal
};

/// Who is measured.
template <typename S>
struct BasicAgainst {
  std::vector<BasicContender<S>> contenders;
  /// The fastest of each library, on each kind of boxes, join.
  std::vector<BasicContender<S>> tried;
  std::vector<PairWork> pair_work;  ///< that the fastest of these do as well
  bool quick = false;               ///< nobody is hopeless, and two are checked at once

  /// The contenders, and all that are tried.
  std::vector<BasicContender<S>> all() const;
};
using Against = BasicAgainst<double>;

/// Reads `--against`: headline, full, fcl, embree, paper, paper_all, or names of contenders,
/// `NAME,NAME`, or `paper:NAME,NAME`, where names of ours are those of paperTrees(). Throws
/// std::invalid_argument where there is no such contender.
template <typename S = double>
BasicAgainst<S> readAgainst(const std::string& text);

/// Pairs that a query visits: those that it reports, and all that it meets before any filter.
struct PairCount {
  std::size_t pairs = 0;
  std::size_t visited = 0;
};

/// What fcl::collide, or its like, has found, and how long it took.
struct NarrowPhase {
  double seconds = 0;
  double touching = 0;
};

/// A manager of another library behind FCL's interface.
class ForeignManager {
 public:
  virtual ~ForeignManager() = default;
  /// At less cost than by a callback for each pair.
  virtual PairCount countPairs() const = 0;
  /// By capsulesTouch() or its like.
  virtual std::size_t countTouching() const = 0;
  /// By the library's own narrow phase, on some of the pairs that it reports.
  virtual NarrowPhase collideSome(const std::vector<std::pair<Object*, Object*>>& pairs) const = 0;
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
