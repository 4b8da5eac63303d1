// SPDX-License-Identifier: BSD-3-Clause
#include "contenders/narrow_solvers.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/contact_collector.h>

#include "contenders/closed_form.h"
#include "geometry/segment.h"
#include "index/hull_filter.h"
#include "index/kept_segments.h"

// FCL's library has its tables of functions, one for each two kinds of shapes, in double alone. In
// float they hold what is called here, because all of them would take a minute to compile. No other
// file of a program with this one may collide anything else in float.
namespace fcl::detail {

template <class Solver>
constexpr auto kCollideCapsules = ShapeShapeCollide<Capsule<float>, Capsule<float>, Solver>;
template <class Solver>
constexpr auto kCapsuleDistance = ShapeShapeDistance<Capsule<float>, Capsule<float>, Solver>;

template <>
CollisionFunctionMatrix<GJKSolver_libccd<float>>::CollisionFunctionMatrix() : collision_matrix() {
  collision_matrix[GEOM_CAPSULE][GEOM_CAPSULE] = kCollideCapsules<GJKSolver_libccd<float>>;
}
template <>
CollisionFunctionMatrix<GJKSolver_indep<float>>::CollisionFunctionMatrix() : collision_matrix() {
  collision_matrix[GEOM_CAPSULE][GEOM_CAPSULE] = kCollideCapsules<GJKSolver_indep<float>>;
}
template <>
DistanceFunctionMatrix<GJKSolver_libccd<float>>::DistanceFunctionMatrix() : distance_matrix() {
  distance_matrix[GEOM_CAPSULE][GEOM_CAPSULE] = kCapsuleDistance<GJKSolver_libccd<float>>;
}
template <>
DistanceFunctionMatrix<GJKSolver_indep<float>>::DistanceFunctionMatrix() : distance_matrix() {
  distance_matrix[GEOM_CAPSULE][GEOM_CAPSULE] = kCapsuleDistance<GJKSolver_indep<float>>;
}

}  // namespace fcl::detail

namespace fcl_fibers::benchmarks {
namespace {

template <typename S>
using ObjectOf = fcl::CollisionObject<S>;

fcl::Vector3d vector(const std::array<double, 3>& p) { return {p[0], p[1], p[2]}; }

/// fcl::collide.
template <typename S>
struct Collide {
  fcl::CollisionRequest<S> request;

  Collide(fcl::GJKSolverType solver, double tolerance, bool with_contact) {
    request.gjk_solver_type = solver;
    request.gjk_tolerance = static_cast<S>(tolerance);
    request.enable_contact = with_contact;
  }

  NarrowAnswer operator()(const ObjectOf<S>& a, const ObjectOf<S>& b) const {
    fcl::CollisionResult<S> result;
    fcl::collide(&a, &b, request, result);
    if (!result.isCollision()) return {};
    const fcl::Contact<S>& contact = result.getContact(0);
    if (!request.enable_contact) return {true};
    double depth = static_cast<double>(contact.penetration_depth);
    fcl::Vector3<S> normal = contact.normal;
    if (request.gjk_solver_type == fcl::GST_INDEP) {
      // FCL 0.7.0 leaves the depth negative and the normal in the frame of a. What is judged is how
      // good they are for a program that knows.
      depth = -depth;
      normal = a.getTransform().linear() * normal;
    }
    return {true, depth, normal.template cast<double>(), contact.pos.template cast<double>()};
  }
};

/// fcl::distance, which knows two capsules by a closed form.
template <typename S>
struct Distance {
  fcl::DistanceRequest<S> request;

  explicit Distance(bool with_contact) { request.enable_nearest_points = with_contact; }

  NarrowAnswer operator()(const ObjectOf<S>& a, const ObjectOf<S>& b) const {
    fcl::DistanceResult<S> result;
    const S distance = fcl::distance(&a, &b, request, result);
    if (distance > 0) return {};
    if (!request.enable_nearest_points) return {true};
    const fcl::Vector3<S>&p = result.nearest_points[0], &q = result.nearest_points[1];
    // The points lie deepest in the other capsule.
    return {true, -static_cast<double>(distance), (p - q).normalized().template cast<double>(),
            ((p + q) / S(2)).template cast<double>()};
  }
};

/// What a careful user writes.
template <typename S>
struct ClosedForm {
  bool with_contact;

  NarrowAnswer operator()(const ObjectOf<S>& a, const ObjectOf<S>& b) const {
    return (*this)(axisOf(a), axisOf(b));
  }
  NarrowAnswer operator()(const CapsuleAxis<S>& p, const CapsuleAxis<S>& q) const {
    if (!with_contact) return {capsulesTouch(p, q)};
    const AxisPoints<S> nearest = nearestPoints(p, q);
    const fcl::Vector3<S> apart = nearest.q - nearest.p;
    const S squared = apart.squaredNorm(), reach = p.radius + q.radius;
    if (squared > reach * reach) return {};
    const S distance = std::sqrt(squared);
    fcl::Vector3<S> normal = apart / distance;
    if (!(distance > 0)) normal = p.half.cross(q.half).normalized();
    if (!(normal.squaredNorm() > 0)) normal = p.half.unitOrthogonal();
    const fcl::Vector3<S> on_a = nearest.p + p.radius * normal;
    const fcl::Vector3<S> on_b = nearest.q - q.radius * normal;
    return {true, static_cast<double>(reach - distance), normal.template cast<double>(),
            ((on_a + on_b) / 2).template cast<double>()};
  }
};

template <typename S>
NarrowAnswer answerOfContact(const ObjectOf<S>& a, const ObjectOf<S>& b) {
  const Contact contact = capsuleContact(a, b);
  return {contact.distance <= 0, -contact.distance, vector(contact.normal),
          (vector(contact.point_a) + vector(contact.point_b)) / 2};
}

/// @param capsule  capsule(i) is the i-th, as the solver takes it
template <class Capsule, class Solve>
NarrowSolver solverOfCapsules(const std::string& name, bool with_contact, const Capsule& capsule,
                              const Solve& solve, bool ours = false) {
  const auto answer = [=](const IndexPairs& pairs, std::vector<NarrowAnswer>& answers) {
    answers.clear();
    for (const auto& [a, b] : pairs) answers.push_back(solve(capsule(a), capsule(b)));
  };
  const auto work = [=](const IndexPairs& pairs) {
    for (const auto& [a, b] : pairs) {
      NarrowAnswer found = solve(capsule(a), capsule(b));
      benchmark::DoNotOptimize(found);
    }
  };
  return {name, with_contact, ours, answer, work};
}

template <typename S, class Solve>
NarrowSolver solverOf(const std::string& name, bool with_contact, const CapsuleObjects<S>& objects,
                      const Solve& solve, bool ours = false) {
  const auto object = [&objects](std::uint32_t i) -> const ObjectOf<S>& { return *objects[i]; };
  return solverOfCapsules(name, with_contact, object, solve, ours);
}

/// What a manager with Report::kCapsules does with its pairs.
class Filter {
 public:
  template <typename S>
  explicit Filter(const CapsuleObjects<S>& objects) {
    tree::SegmentIds ids;
    for (std::size_t i = 0; i < objects.size(); ++i) ids.push_back(static_cast<int>(i));
    kept_.reset(0, static_cast<tree::SegmentId>(ids.size()), ids);
    // Near the origin of the frame that a manager chooses.
    const fcl::Vector3d origin =
        objects[objects.size() / 2]->getTransform().translation().template cast<double>();
    double largest = 0;
    for (const tree::SegmentId id : ids) {
      const ObjectOf<S>& object = *objects[static_cast<std::size_t>(id)];
      const auto& capsule = static_cast<const fcl::Capsule<S>&>(*object.collisionGeometry());
      const fcl::Vector3d centre =
          object.getTransform().translation().template cast<double>() - origin;
      const fcl::Vector3d half = static_cast<double>(capsule.lz) / 2 *
                                 object.getTransform().linear().col(2).template cast<double>();
      const fcl::Vector3d a = centre - half, b = centre + half;
      kept_.set(
          id, {{a.x(), a.y(), a.z()}, {b.x(), b.y(), b.z()}, static_cast<double>(capsule.radius)});
      largest = std::max({largest, a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff()});
    }
    range_ = kept_.range();
    range_.setMostError(geometry::endPointError(largest));
  }

  /// `take` gets the pairs that touch.
  template <class Take>
  void keep(const IndexPairs& pairs, const Take& take) const {
    // As many at a time as a search hands on.
    constexpr std::size_t kBuffer = 1024;
    const index::HullFilter filter(range_, index::SegmentHulls<tree::SegmentRange>{range_}, 0,
                                   kept_.usualUnit());
    std::vector<tree::Pair> buffer;
    buffer.reserve(kBuffer);
    std::vector<geometry::Impact> none;
    const auto flush = [&] {
      const std::size_t count = filter.keep(buffer.data(), buffer.size(), none);
      for (std::size_t i = 0; i < count; ++i) take(buffer[i]);
      buffer.clear();
    };
    for (const auto& [a, b] : pairs) {
      buffer.push_back({static_cast<tree::SegmentId>(a), static_cast<tree::SegmentId>(b)});
      if (buffer.size() == kBuffer) flush();
    }
    flush();
  }

 private:
  index::KeptSegments kept_{/*share_ends=*/false};
  tree::SegmentRange range_;
};

/// A manager with Report::kCapsules, and the ContactCollector that it hands its pairs to.
template <typename S>
NarrowSolver ours(const CapsuleObjects<S>& objects, const std::shared_ptr<Filter>& filter,
                  bool with_contact) {
  const auto answerOf = [&objects, with_contact](const tree::Pair& pair) -> NarrowAnswer {
    if (!with_contact) return {true};
    NarrowAnswer answer = answerOfContact(*objects[static_cast<std::size_t>(pair.a)],
                                          *objects[static_cast<std::size_t>(pair.b)]);
    answer.touching = true;
    return answer;
  };
  const auto answer = [=](const IndexPairs& pairs, std::vector<NarrowAnswer>& answers) {
    answers.assign(pairs.size(), {});
    std::size_t next = 0;
    filter->keep(pairs, [&](const tree::Pair& pair) {  // in their order
      const std::pair wanted(static_cast<std::uint32_t>(pair.a),
                             static_cast<std::uint32_t>(pair.b));
      while (pairs[next] != wanted) ++next;
      answers[next++] = answerOf(pair);
    });
  };
  const auto work = [=](const IndexPairs& pairs) {
    filter->keep(pairs, [&](const tree::Pair& pair) {
      NarrowAnswer found = answerOf(pair);
      benchmark::DoNotOptimize(found);
    });
  };
  return {"ours", with_contact, /*ours=*/true, answer, work};
}

template <typename S>
std::vector<NarrowSolver> solvers(const CapsuleObjects<S>& objects) {
  std::vector<NarrowSolver> found;
  const auto filter = std::make_shared<Filter>(objects);
  const auto axes = std::make_shared<std::vector<CapsuleAxis<S>>>();
  for (const auto& object : objects) axes->push_back(axisOf(*object));
  const auto axis = [axes](std::uint32_t i) -> const CapsuleAxis<S>& { return (*axes)[i]; };
  // The default is 1e-6. A solver that a program makes itself has eps to the power of 7/8.
  const std::vector<std::string> tolerances =
      std::is_same_v<S, float> ? std::vector<std::string>{"1e-3", "1e-6"}
                               : std::vector<std::string>{"1e-3", "1e-6", "1e-9", "1e-12"};
  for (const bool with_contact : {false, true}) {
    for (const std::string& tolerance : tolerances) {
      const double number = std::stod(tolerance);
      found.push_back(solverOf<S>("libccd_" + tolerance, with_contact, objects,
                                  Collide<S>(fcl::GST_LIBCCD, number, with_contact)));
      found.push_back(solverOf<S>("gjk_" + tolerance, with_contact, objects,
                                  Collide<S>(fcl::GST_INDEP, number, with_contact)));
    }
    found.push_back(solverOf<S>("distance", with_contact, objects, Distance<S>(with_contact)));
    found.push_back(solverOf<S>("closed_form", with_contact, objects, ClosedForm<S>{with_contact}));
    found.push_back(
        solverOfCapsules("closed_form_of_axes", with_contact, axis, ClosedForm<S>{with_contact}));
    found.push_back(solverOf<S>("capsuleContact", with_contact, objects, answerOfContact<S>,
                                /*ours=*/true));
    found.push_back(ours(objects, filter, with_contact));
  }
  return found;
}

}  // namespace

std::vector<NarrowSolver> narrowSolvers(const CapsuleObjects<float>& objects) {
  return solvers(objects);
}
std::vector<NarrowSolver> narrowSolvers(const CapsuleObjects<double>& objects) {
  return solvers(objects);
}

}  // namespace fcl_fibers::benchmarks
