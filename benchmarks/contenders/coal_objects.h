// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include <Eigen/Core>

/// @file
/// The library coal behind an interface that names neither it nor FCL. What implements it is a
/// shared object of its own, which is loaded so that nothing in it meets FCL's libraries: coal's
/// wheel and Debian's FCL come with different versions of OctoMap, which free each other's global
/// objects at the end of a program that is linked with both.
namespace fcl_fibers::benchmarks {

/// A capsule along the z axis of its pose.
struct PlacedCapsule {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d center;
  double length, radius;
};

/// A manager of all CoalObjects.
class CoalManager {
 public:
  /// Two objects, by their numbers.
  using NumberPair = std::pair<std::uint32_t, std::uint32_t>;

  virtual ~CoalManager() = default;
  virtual void setup() = 0;
  virtual void update() = 0;
  virtual void visitPairs(const std::function<void(NumberPair)>& visit) const = 0;
  virtual std::size_t countPairs() const = 0;
  /// By capsulesTouch().
  virtual std::size_t countTouching() const = 0;
  /// By coal::collide.
  virtual std::size_t countColliding(const std::vector<NumberPair>& pairs) const = 0;
};

struct CoalWay {
  bool array;             ///< the array form of the dynamic tree
  int level;              ///< the tree_init_level
  int nonbalanced_level;  ///< the max_tree_nonbalanced_level; 0 for coal's default
  bool tight;  ///< set-up and update write boxes of end points +- radius; else computeAABB()
};

class CoalObjects {
 public:
  virtual ~CoalObjects() = default;
  /// Makes them at the first call, of lengths and radii that stay.
  virtual void move(const std::vector<PlacedCapsule>& capsules) = 0;
  virtual std::unique_ptr<CoalManager> makeManager(const CoalWay& way) = 0;
};

/// The one function of the shared object.
using MakeCoalObjects = CoalObjects* (*)();
constexpr const char* kMakeCoalObjects = "fcl_fibers_make_coal_objects";

}  // namespace fcl_fibers::benchmarks
