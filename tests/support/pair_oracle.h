// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <functional>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>
#include <fcl_fibers/fiber_manager_options.h>

#include "support/exact_geometry.h"
#include "support/pair_queries.h"
#include "support/promise.h"
#include "support/touch_oracle.h"

namespace fcl_fibers::test {

struct PairRules {
  LeafVolume volume = LeafVolume::kBox;
  Report report = Report::kVolumes;
  double margin = 0;
  int ignored_neighbors = 0;
  double ignored_arc_length = 0;
};

/// Must the manager pass the pair to its callback, or must it not? Between the two lie pairs that
/// rounding decides.
enum class Verdict { kMust, kMay, kMustNot };

enum class ArgumentOrder { kAny, kPromised };

/// Brute force over all pairs, from the poses and shapes at the time of construction. Whether two
/// capsules touch is decided by TouchOracle, without error.
///
/// Two capsules (a sphere is one of length zero) must be reported if
///   kCapsules: distance <= ra + rb + margin;
///   kVolumes:  the gap of their leaf volumes, per axis for boxes and between the surfaces for
///              spheres, is <= margin.
/// They must not if isPromised() does not allow it.
/// Any other shape counts by leastBox(), and with kCapsules by distanceFrom() as well: a capsule
/// and a shape are a pair if both are within the margin. A mesh counts by its triangles alone. A
/// pair with one must be reported if that box is within the margin of the capsule or box; with
/// kVolumes and boxes, if the boxes are. It must not if neither the boxes nor the balls around them
/// are within the margin, volumeBand() and FCL's rounding. LeafVolume::kStock is exact: FCL
/// compares the boxes that it is given.
///
/// Whatever the rules, a pair that touches must be reported unless it is one of ignored neighbors
/// or of one group.
template <typename S>
class PairOracle {
 public:
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;

  /// `fibers` are those that the manager was given by registerFiber; `groups` and `ends` are of the
  /// first of them, the others are open and of no group. Where a segment has been unregistered,
  /// there is null or an object that is not among `objects`; with an arc length the latter, as it
  /// counts by its length.
  PairOracle(const Objects& objects, const PairRules& rules,
             const std::vector<Objects>& fibers = {}, const std::vector<int>& groups = {},
             const std::vector<FiberEnds>& ends = {});

  /// Whether `calls` answer a self-collision query of a manager that holds `managed`, in this order
  /// of registration. The failure names the first wrong pairs by index: each is missing, extra,
  /// ignored, repeated, turned (its arguments are in the other order), self or unasked.
  /// @param least  of the pairs that must be reported; with fewer the scene shows nothing, which
  ///               is a failure
  testing::AssertionResult answersSelf(const Calls<S>& calls, const Objects& managed,
                                       ArgumentOrder order = ArgumentOrder::kPromised,
                                       std::size_t least = 1) const;

  /// The same for the pairs of one group with another, `managed` being the manager's own. An object
  /// in both is not a partner of itself.
  testing::AssertionResult answersBetween(const Calls<S>& calls, const Objects& managed,
                                          const Objects& others,
                                          ArgumentOrder order = ArgumentOrder::kPromised,
                                          std::size_t least = 1) const;

  Verdict verdict(const Object* a, const Object* b) const;

  /// Distance of the exact shapes (for other shapes what counts of them), rounded to S. Capsules
  /// that overlap have a negative one.
  S distance(const Object* a, const Object* b) const;

  /// Smallest distance over all pairs that are not ignored, among `managed` or with others; max()
  /// if there is none.
  S smallestDistance(const Objects& managed, const Objects* others = nullptr) const;

  /// Number of pairs that are not ignored.
  std::size_t pairCount(const Objects& managed) const;

  /// Neighbours along a fiber, by number or by arc length, and objects of one group. Throws where
  /// rounding decides whether an arc is too long, as lengths are of the poses at registration.
  bool ignored(const Object* a, const Object* b) const;

  /// Whether the oracle was told of the object.
  bool knows(const Object* object) const { return index_.count(object) > 0; }

  /// Largest |coordinate| of bounded shapes, and the diagonal of the box around all of them.
  Real largestCoordinate() const { return largest_coordinate_; }
  Real extent() const { return extent_; }

 private:
  struct Shape {
    bool is_capsule = true;
    GivenCapsule given;
    ExactCapsule capsule;  // The same, its end points rounded to Real.
    ExactBox box;          // leastBox()
    std::function<Real(const Point&, const Point&)> distance;  // Of other shapes, distanceFrom().
    ExactSphere sphere;  // The segment's, or the ball around the box.
    ExactBox stock;
    std::vector<ExactTriangle> triangles;  // Of a mesh that counts by them.
    bool isMesh() const { return !triangles.empty(); }
    std::optional<std::size_t> fiber;
    std::size_t segment = 0;
    int group = 0;
  };
  struct Fiber {
    bool is_closed = false;
    std::size_t count = 0;
    std::vector<Real> lengths;  // Of its segments; empty unless there is an arc length.
    Real rounding = 0;          // Of an arc, at registration or now.
  };

  Shape shapeOf(const Object& object) const;
  std::size_t indexOf(const Object* object) const;
  bool ignored(const Shape& a, const Shape& b) const;
  bool areNeighbors(const Fiber& fiber, std::size_t from, std::size_t to) const;
  Verdict verdict(const Shape& a, const Shape& b) const;
  Real gap(const Shape& a, const Shape& b) const;
  static Real gapOfBoxes(const Shape& a, const Shape& b);
  bool touch(const Shape& a, const Shape& b) const;
  template <typename Visitor>
  void visitPairs(const Objects& managed, const Objects* others, Visitor visit) const;
  testing::AssertionResult answers(const Calls<S>& calls, const Objects& managed,
                                   const Objects* others, ArgumentOrder order,
                                   std::size_t least) const;

  PairRules rules_;
  std::vector<Shape> shapes_;
  std::vector<Fiber> fibers_;
  std::unordered_map<const Object*, std::size_t> index_;
  Real largest_coordinate_ = 0;
  Real extent_ = 0;
};

extern template class PairOracle<float>;
extern template class PairOracle<double>;

}  // namespace fcl_fibers::test
