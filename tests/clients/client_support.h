// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>
#include <fcl/narrowphase/collision_object.h>
#include <Eigen/Core>

#include "support/least_box.h"
#include "support/managers_under_test.h"
#include "support/pair_oracle.h"
#include "support/pair_queries.h"
#include "support/random.h"
#include "support/scene.h"

// Models of programs that use FCL's managers, each by the sequence of its calls: with the type of
// the manager changed and nothing else, they must find what they found. Every model runs on FCL's
// dynamic tree as well, which shows that the model asks for nothing that FCL does not serve.
namespace fcl_fibers::test {

// All of these programs have doubles.
using Object = fcl::CollisionObjectd;
using Objects = std::vector<Object*>;
using Manager = fcl::BroadPhaseCollisionManagerd;
using Geometry = std::shared_ptr<fcl::CollisionGeometryd>;

/// FCL's tree with one of ours beside it. A difference of the two is a failure.
std::unique_ptr<Manager> makeShadowed(Report report);

template <Report kReport>
struct Shadowed : FclTree<double> {
  static auto make(const FiberManagerOptions& = {}) { return makeShadowed(kReport); }
  static std::string name() {
    return kReport == Report::kVolumes ? "ShadowedVolumes" : "ShadowedCapsules";
  }
};

using ClientManagers = testing::Types<FclTree<double>, LayeredAabb<double, Topology::kBundle>,
                                      LayeredAabb<double, Topology::kSuperThread>,
                                      WrappedSphere<double, Topology::kBundle>,
                                      WrappedSphere<double, Topology::kSuperThread>,
                                      Shadowed<Report::kVolumes>, Shadowed<Report::kCapsules>>;

/// The one thing that a program changes: what makes its managers.
struct Swap {
  std::function<std::unique_ptr<Manager>()> make;
  PairRules rules;      ///< of what it makes
  ArgumentOrder order;  ///< likewise
};

/// Runs a program with managers of this configuration, with each Report, over several scenes.
template <typename Config>
void runClient(void (*program)(const Swap&, Random&), std::uint64_t seed) {
  for (const FiberManagerOptions& options : optionsToTest<Config>(0)) {
    for (const std::uint64_t scene_seed : {seed, seed + 1}) {
      SCOPED_TRACE(describe(options) + ", seed " + std::to_string(scene_seed));
      Random random(scene_seed);
      program({[&] { return Config::make(options); }, rulesOf<Config>(options), kOrder<Config>},
              random);
    }
  }
}

/// Spheres, boxes, cylinders, cones, ellipsoids, convex solids and meshes in turn, turned at random
/// and all over a cube of this half side.
void addAllShapes(Scene<double>& scene, std::size_t count, double size, double half_side,
                  Random& random);

/// The points of a chain of segments of one length that stays about in a cube of this half side.
std::vector<Eigen::Vector3d> wanderingChain(std::size_t segments, double length, double half_side,
                                            Random& random);

/// The pose of a capsule from one point to another.
fcl::Transform3d posedAlong(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// What is there to be found: FCL's narrow phase over all pairs. It shares nothing with any
/// manager, and looks at shapes and poses, not at boxes.
class Truth {
 public:
  Truth() = default;
  /// Objects as they are now, each of which a program wants to hear of from this far away, so that
  /// of a pair the sum counts.
  explicit Truth(const Objects& objects, double margin = 0) { read(objects, margin); }
  /// More of them, or the same ones again.
  void read(const Objects& objects, double margin = 0);

  /// Programs pass over the pairs of consecutive links in their callbacks.
  void ignoreNeighbors(const Objects& chain);

  /// 0 where they overlap; infinity where they are ignored. With a half-space only 0 or infinity,
  /// as FCL has no distance to one.
  double distance(const Object* a, const Object* b) const;

  /// That a collision query hands over every pair that is near enough, once, and none that was not
  /// asked for or is far apart.
  /// @param least  of the pairs that are near enough; with fewer the scene shows nothing
  void expectAll(const Manager& manager, std::size_t least = 1) const;
  void expectAll(const Manager& manager, Object& object) const;
  void expectAll(const Manager& manager, Manager& other, std::size_t least = 1) const;

  /// That a callback that asks for distances and stops at a contact gets down to the least one.
  void expectNearest(const Manager& manager) const;
  void expectNearest(const Manager& manager, Object& object) const;
  void expectNearest(const Manager& manager, Manager& other) const;

 private:
  struct Body {
    std::shared_ptr<const Object> object;
    Eigen::Vector3d center;  // Of a ball around it.
    double radius = 0;
    ExactBox box;
    double margin = 0;
    const Object* ignored = nullptr;  // The link before it.
  };

  using Partners = std::optional<Objects>;  // None in a query of a manager itself.

  double distance(const Body& a, const Body& b) const;
  double apart(const FiberCollisionManager<double>& manager, const Body& p, const Body& q) const;
  template <typename Visitor>
  void visitPairs(const Objects& managed, const Partners& partners, Visitor visit) const;
  testing::AssertionResult areAll(const Manager& manager, const Calls<double>& calls,
                                  const Partners& partners, std::size_t least) const;
  template <typename... Partner>
  void nearest(const Manager& manager, const Partners& partners, Partner*... partner) const;

  std::unordered_map<const Object*, Body> bodies_;
};

}  // namespace fcl_fibers::test
