// SPDX-License-Identifier: BSD-3-Clause
#include "support/pair_oracle.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <unordered_set>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>

#include "support/least_box.h"

namespace fcl_fibers::test {
namespace {

// In eps(S) x (coordinates + lengths), how deep capsules may touch whose stock boxes do not, as FCL
// rounds these to nearest.
constexpr Real kStockBand = 64;

constexpr std::size_t kNamedPairs = 10;

template <typename S>
ExactBox exactBox(const fcl::AABB<S>& box) {
  return {box.min_.template cast<Real>(), box.max_.template cast<Real>()};
}

template <typename S>
GivenCapsule givenCapsule(const fcl::CollisionObject<S>& object, S radius, S length) {
  GivenCapsule capsule;
  for (int i = 0; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    capsule.a[axis] = capsule.b[axis] = static_cast<double>(object.getTransform().translation()[i]);
    capsule.axis[axis] = static_cast<double>(object.getTransform().linear()(i, 2));
  }
  capsule.radius = static_cast<double>(radius);
  capsule.length = static_cast<double>(length);
  return capsule;
}

// Sides of unbounded shapes are infinite or the largest number there is.
template <typename S>
bool isBounded(Real side) {
  return std::abs(side) < Real(std::numeric_limits<S>::max());
}

// Where the two are nearest, there is an edge of one of them.
Real triangleBoxDistance(const ExactTriangle& t, const ExactBox& box) {
  Real least = std::min({segmentBoxDistance(t.a, t.b, box), segmentBoxDistance(t.b, t.c, box),
                         segmentBoxDistance(t.c, t.a, box)});
  if (!(box.max - box.min).allFinite()) return least;
  for (int axis = 0; axis < 3; ++axis) {
    for (int corner = 0; corner < 4; ++corner) {
      Point from = box.min, to;
      from[(axis + 1) % 3] = (corner & 1) != 0 ? box.max[(axis + 1) % 3] : box.min[(axis + 1) % 3];
      from[(axis + 2) % 3] = (corner & 2) != 0 ? box.max[(axis + 2) % 3] : box.min[(axis + 2) % 3];
      to = from;
      to[axis] = box.max[axis];
      least = std::min(least, segmentTriangleDistance(from, to, t));
    }
  }
  return least;
}

}  // namespace

template <typename S>
PairOracle<S>::PairOracle(const Objects& objects, const PairRules& rules,
                          const std::vector<Objects>& fibers, const std::vector<int>& groups,
                          const std::vector<FiberEnds>& ends)
    : rules_(rules), fibers_(fibers.size()) {
  Point low = Point::Constant(std::numeric_limits<Real>::max());
  Point high = -low;
  for (const Object* object : objects) {
    index_.emplace(object, shapes_.size());
    shapes_.push_back(shapeOf(*object));
    const Shape& shape = shapes_.back();
    for (const Point& corner : {shape.box.min, shape.box.max}) {
      for (int i = 0; i < 3; ++i) {
        if (!isBounded<S>(corner[i])) continue;
        low[i] = std::min(low[i], corner[i]);
        high[i] = std::max(high[i], corner[i]);
        largest_coordinate_ = std::max(largest_coordinate_, std::abs(corner[i]));
      }
    }
  }
  extent_ = (high - low).cwiseMax(Point::Zero()).norm();
  for (std::size_t f = 0; f < fibers.size(); ++f) {
    Fiber& fiber = fibers_[f];
    fiber.is_closed = f < ends.size() && ends[f] == FiberEnds::kClosed;
    fiber.count = fibers[f].size();
    if (rules.ignored_arc_length > 0) {
      for (const Object* object : fibers[f]) {
        if (object == nullptr) throw std::logic_error("Nothing is left to measure the fiber by.");
        const ExactCapsule capsule = shapeOf(*object).capsule;
        fiber.lengths.push_back((capsule.b - capsule.a).norm());
        fiber.rounding += 8 * Real(std::numeric_limits<S>::epsilon()) * fiber.lengths.back();
      }
    }
    for (std::size_t i = 0; i < fibers[f].size(); ++i) {
      const auto found = index_.find(fibers[f][i]);
      if (found == index_.end()) continue;  // Unregistered since.
      shapes_[found->second].fiber = f;
      shapes_[found->second].segment = i;
      shapes_[found->second].group = f < groups.size() ? groups[f] : 0;
    }
  }
}

template <typename S>
typename PairOracle<S>::Shape PairOracle<S>::shapeOf(const Object& object) const {
  Shape shape;
  const fcl::CollisionGeometry<S>* geometry = object.collisionGeometry().get();
  if (const auto* capsule = dynamic_cast<const fcl::Capsule<S>*>(geometry)) {
    shape.given = givenCapsule(object, capsule->radius, capsule->lz);
  } else if (const auto* ball = dynamic_cast<const fcl::Sphere<S>*>(geometry)) {
    shape.given = givenCapsule(object, ball->radius, S(0));
  } else {
    shape.is_capsule = false;
  }
  shape.stock = exactBox(object.getAABB());
  if (shape.is_capsule) {
    shape.capsule = roundedCapsule(shape.given);
    shape.box = boxOf(shape.capsule);
    shape.sphere = sphereOf(shape.capsule);
  } else {
    shape.box = leastBox(object);
    if (rules_.report == Report::kCapsules && rules_.volume != LeafVolume::kStock) {
      shape.distance = distanceFrom(object);
      shape.triangles = trianglesOf(object);
    }
    shape.sphere = {(shape.box.min + shape.box.max) / 2,
                    (shape.box.max - shape.box.min).norm() / 2};
  }
  return shape;
}

template <typename S>
std::size_t PairOracle<S>::indexOf(const Object* object) const {
  const auto found = index_.find(object);
  if (found == index_.end()) throw std::logic_error("The oracle was not told of this object.");
  return found->second;
}

template <typename S>
bool PairOracle<S>::ignored(const Shape& a, const Shape& b) const {
  if (a.group != 0 && a.group == b.group) return true;
  if (!a.fiber || a.fiber != b.fiber) return false;
  const Fiber& fiber = fibers_[*a.fiber];
  return areNeighbors(fiber, a.segment, b.segment) || areNeighbors(fiber, b.segment, a.segment);
}

// By walking along the fiber from one segment to the other.
template <typename S>
bool PairOracle<S>::areNeighbors(const Fiber& fiber, std::size_t from, std::size_t to) const {
  Real between = 0;
  for (std::size_t steps = 1; steps <= fiber.count; ++steps) {
    if (++from == fiber.count) {
      if (!fiber.is_closed) return false;
      from = 0;
    }
    const bool is_near = steps <= static_cast<std::size_t>(rules_.ignored_neighbors);
    if (from == to && is_near) return true;
    const Real left = rules_.ignored_arc_length - between;
    if (!is_near && (rules_.ignored_arc_length <= 0 || left < -fiber.rounding)) return false;
    if (from == to) {
      if (between > 0 && left <= fiber.rounding) {
        throw std::logic_error("Rounding decides who is a neighbour.");
      }
      return true;
    }
    if (rules_.ignored_arc_length > 0) between += fiber.lengths[from];
  }
  return false;
}

template <typename S>
bool PairOracle<S>::ignored(const Object* a, const Object* b) const {
  return ignored(shapes_[indexOf(a)], shapes_[indexOf(b)]);
}

// Between the surfaces of the exact shapes.
template <typename S>
Real PairOracle<S>::gap(const Shape& a, const Shape& b) const {
  if (a.is_capsule && b.is_capsule) {
    return segmentDistance(a.capsule.a, a.capsule.b, b.capsule.a, b.capsule.b) -
           (a.capsule.radius + b.capsule.radius);
  }
  if (!a.is_capsule && !b.is_capsule) return gapOfBoxes(a, b);
  const ExactCapsule& capsule = a.is_capsule ? a.capsule : b.capsule;
  const Shape& other = a.is_capsule ? b : a;
  Real distance = other.distance ? other.distance(capsule.a, capsule.b) : 0;
  if (!other.isMesh()) {
    distance = std::max(distance, segmentBoxDistance(capsule.a, capsule.b, other.box));
  }
  return distance - capsule.radius;
}

// A mesh counts by its triangles, except among meshes.
template <typename S>
Real PairOracle<S>::gapOfBoxes(const Shape& a, const Shape& b) {
  if (a.isMesh() == b.isMesh()) return boxDistance(a.box, b.box);
  const Shape &mesh = a.isMesh() ? a : b, &other = a.isMesh() ? b : a;
  Real least = std::numeric_limits<Real>::infinity();
  for (const ExactTriangle& t : mesh.triangles) {
    least = std::min(least, triangleBoxDistance(t, other.box));
  }
  return least;
}

// Whether the exact shapes are within the margin.
template <typename S>
bool PairOracle<S>::touch(const Shape& a, const Shape& b) const {
  if (!a.is_capsule || !b.is_capsule) return gap(a, b) <= rules_.margin;
  return TouchOracle::judge(a.given, b.given, rules_.margin).touching;
}

template <typename S>
Verdict PairOracle<S>::verdict(const Shape& a, const Shape& b) const {
  if (ignored(a, b)) return Verdict::kMustNot;

  const Real margin = rules_.margin;
  const bool capsules = a.is_capsule && b.is_capsule;
  const bool reports_volumes = rules_.report == Report::kVolumes;
  const Real box_gap = boxGap(a.box, b.box);

  if (rules_.volume == LeafVolume::kStock) {
    if (boxGap(a.stock, b.stock) <= 0) return Verdict::kMust;
    if (!capsules || box_gap > 0) return Verdict::kMustNot;
    const Real lengths = (a.capsule.b - a.capsule.a).norm() + (b.capsule.b - b.capsule.a).norm() +
                         a.capsule.radius + b.capsule.radius;
    const Real band =
        kStockBand * Real(std::numeric_limits<S>::epsilon()) * (largest_coordinate_ + lengths);
    return gap(a, b) <= -band ? Verdict::kMust : Verdict::kMustNot;
  }

  const bool uses_boxes = rules_.volume == LeafVolume::kBox;
  // FCL rounds the ball around a mesh and the boxes of what is unbounded.
  const Real rounding =
      capsules ? 0 : 2 * Real(std::numeric_limits<S>::epsilon()) * largest_coordinate_;
  // No need for exact distances, as what is promised of capsules is less.
  const bool boxes_apart = box_gap > margin + volumeBand(extent_) + rounding;
  if (boxes_apart && (uses_boxes || !reports_volumes)) return Verdict::kMustNot;

  const Real volume_gap = uses_boxes ? box_gap : sphereGap(a.sphere, b.sphere);
  if (capsules) {
    if (!isPromised(a.given, b.given, rules_.report, rules_.volume, rules_.margin, extent_)) {
      return Verdict::kMustNot;
    }
    return touch(a, b) || (reports_volumes && volume_gap <= margin) ? Verdict::kMust
                                                                    : Verdict::kMay;
  }
  if (touch(a, b) || (reports_volumes && uses_boxes && box_gap <= margin)) return Verdict::kMust;
  // Shapes are turned by the matrix as it is.
  const Real turning = 64 * Real(std::numeric_limits<S>::epsilon()) * extent_;
  if (!reports_volumes && a.is_capsule != b.is_capsule) {
    const Shape &capsule = a.is_capsule ? a : b, &other = a.is_capsule ? b : a;
    const Real distance = other.distance(capsule.capsule.a, capsule.capsule.b);
    const Real rounded = margin + turning + 0x1p-40L * largest_coordinate_;
    if (distance - capsule.capsule.radius > rounded) return Verdict::kMustNot;
  }
  // NaN, as of spheres around what is unbounded, is near.
  const bool spheres_near =
      reports_volumes && !uses_boxes && !(volume_gap > margin + volumeBand(extent_) + 2 * rounding);
  return boxes_apart && !spheres_near ? Verdict::kMustNot : Verdict::kMay;
}

template <typename S>
Verdict PairOracle<S>::verdict(const Object* a, const Object* b) const {
  return verdict(shapes_[indexOf(a)], shapes_[indexOf(b)]);
}

template <typename S>
S PairOracle<S>::distance(const Object* a, const Object* b) const {
  return static_cast<S>(gap(shapes_[indexOf(a)], shapes_[indexOf(b)]));
}

// Each unordered pair of `managed`, or each pair of one of `managed` and one of `others`.
template <typename S>
template <typename Visitor>
void PairOracle<S>::visitPairs(const Objects& managed, const Objects* others, Visitor visit) const {
  std::vector<std::size_t> rows;
  for (const Object* object : managed) rows.push_back(indexOf(object));
  std::vector<std::size_t> columns = rows;
  if (others != nullptr) {
    columns.clear();
    for (const Object* object : *others) columns.push_back(indexOf(object));
  }
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t c = others != nullptr ? 0 : r + 1; c < columns.size(); ++c) {
      if (rows[r] != columns[c]) visit(rows[r], columns[c]);
    }
  }
}

template <typename S>
S PairOracle<S>::smallestDistance(const Objects& managed, const Objects* others) const {
  S smallest = std::numeric_limits<S>::max();
  visitPairs(managed, others, [&](std::size_t a, std::size_t b) {
    if (ignored(shapes_[a], shapes_[b])) return;
    smallest = std::min(smallest, static_cast<S>(gap(shapes_[a], shapes_[b])));
  });
  return smallest;
}

template <typename S>
std::size_t PairOracle<S>::pairCount(const Objects& managed) const {
  std::size_t count = 0;
  visitPairs(managed, nullptr, [&](std::size_t a, std::size_t b) {
    if (!ignored(shapes_[a], shapes_[b])) ++count;
  });
  return count;
}

template <typename S>
testing::AssertionResult PairOracle<S>::answers(const Calls<S>& calls, const Objects& managed,
                                                const Objects* others, ArgumentOrder order,
                                                std::size_t least) const {
  std::size_t problems = 0;
  std::ostringstream report;
  const auto complain = [&](const char* what, std::size_t a, std::size_t b) {
    if (++problems > kNamedPairs) return;
    report << "\n  " << what << " pair (" << a << ", " << b << "), "
           << static_cast<double>(gap(shapes_[a], shapes_[b])) << " apart, boxes "
           << static_cast<double>(boxGap(shapes_[a].box, shapes_[b].box)) << ", spheres "
           << static_cast<double>(sphereGap(shapes_[a].sphere, shapes_[b].sphere)) << ", margin "
           << rules_.margin;
  };

  std::unordered_map<const Object*, std::size_t> rank;
  for (std::size_t i = 0; i < managed.size(); ++i) rank.emplace(managed[i], i);
  std::unordered_set<const Object*> partners;
  if (others != nullptr) partners.insert(others->begin(), others->end());

  const auto key = [&](std::size_t a, std::size_t b) {
    return std::uint64_t{std::min(a, b)} * shapes_.size() + std::max(a, b);
  };
  std::unordered_set<std::uint64_t> seen;
  for (const auto& [first, second] : calls) {
    if (!knows(first) || !knows(second)) {
      return testing::AssertionFailure() << "the callback was given an object nobody registered";
    }
    const std::size_t a = indexOf(first);
    const std::size_t b = indexOf(second);
    if (a == b) {
      complain("self", a, b);
      continue;
    }
    const bool forward = others == nullptr ? rank.count(first) != 0 && rank.count(second) != 0
                                           : rank.count(first) != 0 && partners.count(second) != 0;
    const bool backward =
        others != nullptr && partners.count(first) != 0 && rank.count(second) != 0;
    if (!forward && !backward) {
      complain("unasked", a, b);
    } else if (order == ArgumentOrder::kPromised &&
               (others == nullptr ? rank.at(first) > rank.at(second) : !forward)) {
      complain("turned", a, b);
    }
    if (!seen.insert(key(a, b)).second) {
      complain("repeated", a, b);
    } else if (verdict(shapes_[a], shapes_[b]) == Verdict::kMustNot) {
      complain(ignored(shapes_[a], shapes_[b]) ? "ignored" : "extra", a, b);
    }
  }
  std::unordered_set<std::uint64_t> expected;
  visitPairs(managed, others, [&](std::size_t a, std::size_t b) {
    if (verdict(shapes_[a], shapes_[b]) != Verdict::kMust) return;
    if (expected.insert(key(a, b)).second && seen.count(key(a, b)) == 0) complain("missing", a, b);
  });

  if (problems == 0 && expected.size() < least) {
    return testing::AssertionFailure() << "the scene shows nothing: " << expected.size()
                                       << " pairs must be found, at least " << least << " expected";
  }
  if (problems == 0) return testing::AssertionSuccess();
  return testing::AssertionFailure()
         << problems << " wrong among " << calls.size() << " reported" << report.str();
}

template <typename S>
testing::AssertionResult PairOracle<S>::answersSelf(const Calls<S>& calls, const Objects& managed,
                                                    ArgumentOrder order, std::size_t least) const {
  return answers(calls, managed, nullptr, order, least);
}

template <typename S>
testing::AssertionResult PairOracle<S>::answersBetween(const Calls<S>& calls,
                                                       const Objects& managed,
                                                       const Objects& others, ArgumentOrder order,
                                                       std::size_t least) const {
  return answers(calls, managed, &others, order, least);
}

template class PairOracle<float>;
template class PairOracle<double>;

}  // namespace fcl_fibers::test
