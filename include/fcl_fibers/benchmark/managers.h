// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>
#include <fcl/narrowphase/collision_object.h>
#include <fcl_fibers/benchmark/export.h>

/// @file
/// A benchmark of broad phases on scenes of fibers:
///
///     int main(int argc, char** argv) {
///       fcl_fibers::benchmarks::registerManager<MyManager>("mine");
///       fcl_fibers::benchmarks::registerPeers();
///       return fcl_fibers::benchmarks::run(argc, argv);
///     }
///
/// run() checks every manager first, each in a process of its own: whether it reports every pair of
/// touching capsules once, by touchingPairs(), before and after three updates of the scene, and
/// where fibers that were far apart meet. If a manager is wrong, crashes or takes too long, the
/// program says so and does not time it. Timed runs are in the program itself. If a manager throws
/// there, the program says so too; a crash ends the program. The number of an object is its user
/// data, which a manager has to leave alone.
namespace fcl_fibers::benchmarks {

/// What `CollisionObject::getAABB` returns when a manager reads it.
enum class Boxes {
  kNone,   ///< FCL's box of an earlier pose, for a manager that reads poses and shapes
  kStock,  ///< `computeAABB()`: the cube around the capsule's bounding sphere
  kTight,  ///< end points +- radius
};

/// Which pairs a manager is to report. With kTouchingAtLeast it may report more.
enum class Reported {
  kTouchingAtLeast,  ///< every touching pair: what any broad phase must do
  kTightBoxes,       ///< pairs of overlapping tight boxes, up to the rounding of bounds
  kSpheres,          ///< pairs whose spheres overlap, which are the least around each capsule
  kTouching,         ///< touching pairs and no other
};

/// Constructs a manager for these objects, and registers none of them. Their boxes are written
/// before the call.
template <typename S>
using MakeManager = std::function<std::unique_ptr<fcl::BroadPhaseCollisionManager<S>>(
    const std::vector<fcl::CollisionObject<S>*>& objects)>;

/// Adds a manager for float or double to those that run() checks and times. `name` stands in its
/// rows of the table. run() makes the boxes of the objects as `boxes` tells before it registers
/// them, and before each update(), whose time includes that. `reported` tells by which rule its
/// pairs are checked. The manager lives through all updates of a run. Throws std::invalid_argument
/// if the name is empty or taken.
template <typename S>
FCL_FIBERS_BENCHMARK_EXPORT void registerManager(const std::string& name, MakeManager<S> make,
                                                 Boxes boxes = Boxes::kStock,
                                                 Reported reported = Reported::kTouchingAtLeast);

/// @cond explicit instantiations
extern template FCL_FIBERS_BENCHMARK_EXPORT void registerManager(const std::string&,
                                                                 MakeManager<float>, Boxes,
                                                                 Reported);
extern template FCL_FIBERS_BENCHMARK_EXPORT void registerManager(const std::string&,
                                                                 MakeManager<double>, Boxes,
                                                                 Reported);
/// @endcond

/// Adds a manager that is constructed without arguments. Throws as above.
template <typename Manager, typename = std::enable_if_t<std::is_class_v<Manager>>>
void registerManager(const std::string& name, Boxes boxes = Boxes::kStock,
                     Reported reported = Reported::kTouchingAtLeast) {
  constexpr bool kIsFloat = std::is_base_of_v<fcl::BroadPhaseCollisionManager<float>, Manager>;
  static_assert(
      kIsFloat || std::is_base_of_v<fcl::BroadPhaseCollisionManager<double>, Manager>,
      "registerManager: the type has to be an fcl::BroadPhaseCollisionManager of float or double");
  using S = std::conditional_t<kIsFloat, float, double>;
  const MakeManager<S> make = [](const auto&) { return std::make_unique<Manager>(); };
  registerManager<S>(name, make, boxes, reported);
}

/// Adds managers for double. They are FCL's dynamic tree on tight boxes and on stock ones, both
/// trees of this library with their default options, and its tree of boxes with Report::kCapsules.
/// FCL's trees become slower with every update, so they are set up anew before each, which is not
/// timed. Throws std::invalid_argument if one of their names is taken.
FCL_FIBERS_BENCHMARK_EXPORT void registerPeers();

/// The main function: reads the command line, makes the scenes, checks and times the managers, and
/// prints a table. `--help` lists the options and the scenes. Options of Google Benchmark are
/// taken, too; with `--benchmark_format` Google Benchmark prints in place of the table. For each
/// scene and manager there are the entries SCENE/MANAGER/construction, update, detection, and
/// touching: detection with the exact test of two capsules in the callback. The command line may
/// name scenes, as namedScene() takes them; otherwise the given ones are used.
/// @return 0; or 1, with the reason on stderr, if the command line is wrong, if no manager was
/// registered, or if a manager other than FCL's is wrong, crashes or throws
FCL_FIBERS_BENCHMARK_EXPORT int run(int argc, char** argv,
                                    const std::vector<std::string>& scenes = {
                                        "paper-static:fibers=200"});

}  // namespace fcl_fibers::benchmarks
