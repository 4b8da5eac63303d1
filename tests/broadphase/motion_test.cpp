// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl_fibers/impact_collector.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "support/exact_geometry.h"
#include "support/least_box.h"
#include "support/pair_queries.h"
#include "support/random.h"
#include "support/scalars.h"

// A manager with FiberManagerOptions::motion against brute force, which follows each pair through
// the step.

namespace fcl_fibers::test {
namespace {

FiberManagerOptions movingOptions() {
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  options.motion = true;
  return options;
}

/// A capsule or sphere at one time.
struct Capsule {
  Point a, b;
  Real radius;
};

template <typename S>
Capsule capsuleOf(const fcl::CollisionObject<S>& object) {
  const fcl::Transform3<S>& pose = object.getTransform();
  const Point center = pose.translation().template cast<Real>();
  const auto* geometry = object.collisionGeometry().get();
  if (const auto* capsule = dynamic_cast<const fcl::Capsule<S>*>(geometry)) {
    const Point half = Real(capsule->lz) / 2 * pose.linear().col(2).template cast<Real>();
    return {center - half, center + half, Real(capsule->radius)};
  }
  return {center, center, Real(dynamic_cast<const fcl::Sphere<S>&>(*geometry).radius)};
}

struct Motion {
  Capsule start, end;

  Capsule at(Real time) const {
    return {start.a + time * (end.a - start.a), start.b + time * (end.b - start.b),
            start.radius + time * (end.radius - start.radius)};
  }
  /// How far any point of the capsule goes.
  Real way() const {
    return std::max((end.a - start.a).norm(), (end.b - start.b).norm()) +
           std::abs(end.radius - start.radius);
  }
};

/// How far the surfaces are apart beyond `margin` when they are nearest in the step, if that may be
/// negative, up to `resolution` of the way of both. The distance cannot shrink faster than both
/// move, so times at which they cannot touch are passed over.
Real leastGap(const Motion& p, const Motion& q, Real margin, Real resolution) {
  const Real way = p.way() + q.way();
  Real least = std::numeric_limits<Real>::infinity();
  for (Real time = 0;;) {
    const Capsule i = p.at(time), j = q.at(time);
    const Real gap = segmentDistance(i.a, i.b, j.a, j.b) - i.radius - j.radius - margin;
    least = std::min(least, gap);
    if (least < -1e-3 || time >= 1 || way == 0) return least;
    time = std::min(Real(1), time + std::max(resolution, gap / way));
  }
}

/// What a program does with a manager, and what the manager must answer.
template <typename S>
class Program {
 public:
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;
  using Manager = LayeredAABBTreeCollisionManager<S>;
  using Pairs = std::set<std::pair<const Object*, const Object*>>;

  struct Known {
    std::size_t fiber = 0, segment = 0;
    std::optional<Capsule> start;  ///< nothing until it has been read
  };

  Program(const FiberManagerOptions& options, std::uint64_t seed)
      : manager(options), random(seed) {}

  std::unique_ptr<Object> makeObject(double length) {
    std::shared_ptr<fcl::CollisionGeometry<S>> shape;
    const S radius = S(random.between(0.01, 0.05));
    if (length > 0) {
      shape = std::make_shared<fcl::Capsule<S>>(radius, S(length));
    } else {
      shape = std::make_shared<fcl::Sphere<S>>(radius);
    }
    auto object = std::make_unique<Object>(shape);
    place(*object, 1);
    return object;
  }
  /// Moves an object by about `distance`, and turns it.
  void place(Object& object, double distance) {
    fcl::Transform3<S> pose = object.getTransform();
    reach = std::max(reach, 2 + pose.translation().template cast<Real>().cwiseAbs().maxCoeff());
    for (int i = 0; i < 3; ++i) pose.translation()[i] += S(random.between(-distance, distance));
    const fcl::Vector3<S> axis(S(random.between(-1, 1)), S(random.between(-1, 1)), S(1.5));
    pose.linear() =
        pose.linear() * fcl::AngleAxis<S>(S(random.between(-1, 1) * distance), axis.normalized())
                            .toRotationMatrix();
    // The manager turns by the matrix as it is.
    pose.linear() = fcl::Quaternion<S>(pose.linear()).normalized().toRotationMatrix();
    object.setTransform(pose);
  }

  void registerFiber(std::size_t count) {
    Objects fiber;
    for (std::size_t i = 0; i < count; ++i) {
      own.push_back(makeObject(0.4));
      fiber.push_back(own.back().get());
      known[fiber.back()] = {fibers, i, {}};
    }
    ++fibers;
    manager.registerFiber(fiber);
    order.insert(order.end(), fiber.begin(), fiber.end());
  }
  void registerBall() {
    own.push_back(makeObject(0));
    known[own.back().get()] = {fibers++, 0, {}};
    manager.registerObject(own.back().get());
    order.push_back(own.back().get());
  }
  void unregister() {
    if (order.empty()) return;
    const auto at = order.begin() + static_cast<std::ptrdiff_t>(random.below(order.size()));
    manager.unregisterObject(*at);
    known.erase(*at);
    order.erase(at);
  }
  void update(std::size_t count, double distance) {
    Objects moved;
    for (std::size_t i = 0; i < count && !order.empty(); ++i) {
      moved.push_back(order[random.below(order.size())]);
    }
    update(moved, distance);
  }
  void update(const Objects& moved, double distance) {
    beginStep();
    for (Object* object : moved) place(*object, distance);
    manager.update(moved);
    if (!moved.empty()) read();
  }
  void updateAll(double distance) {
    beginStep();
    for (Object* object : order) place(*object, distance);
    manager.update();
    read();
  }
  void clear() {
    manager.clear();
    known.clear();
    order.clear();
    is_seen = false;
  }

  void beginStep() {
    if (!is_seen) return;
    is_seen = false;
    for (auto& [object, known_object] : known) {
      if (known_object.start) known_object.start = capsuleOf(*object);
    }
  }
  /// What the next query sees has been read.
  void read() {
    for (auto& [object, known_object] : known) {
      if (!known_object.start) known_object.start = capsuleOf(*object);
    }
  }
  void see() {
    read();
    is_seen = true;
  }

  Motion motionOf(const Object* object) const {
    const auto found = known.find(object);
    const Capsule end = capsuleOf(*object);
    return {found == known.end() ? end : *found->second.start, end};
  }

  bool areNeighbors(const Object* a, const Object* b) const {
    const auto p = known.find(a), q = known.find(b);
    if (p == known.end() || q == known.end() || p->second.fiber != q->second.fiber) return false;
    const std::size_t i = p->second.segment, j = q->second.segment;
    return std::max(i, j) - std::min(i, j) <=
           static_cast<std::size_t>(manager.options().ignored_neighbors);
  }

  /// Whether these are the pairs that meet within the step, each once.
  void judge(const Calls<S>& calls, const Objects& others, const Program* other_program,
             const std::string& what) {
    SCOPED_TRACE(what);
    Pairs found;
    for (const auto& [a, b] : calls) {
      EXPECT_TRUE(found.emplace(a, b).second) << "a pair comes twice";
    }
    Pairs asked;
    for (std::size_t i = 0; i < order.size(); ++i) {
      const bool is_self = others.empty();
      for (std::size_t j = is_self ? i + 1 : 0; j < (is_self ? order.size() : others.size()); ++j) {
        const Object *a = order[i], *b = is_self ? order[j] : others[j];
        if (a == b || areNeighbors(a, b)) continue;
        const Motion p = motionOf(a), q = (other_program ? other_program : this)->motionOf(b);
        const Real margin = manager.options().margin, way = p.way() + q.way();
        const Real resolution = Real(1) / 1000;
        const Real least = leastGap(p, q, margin, resolution);
        const Real rounding = 1e-12 + 8 * Real(std::numeric_limits<S>::epsilon()) * reach;
        const bool is_found = found.count({a, b}) > 0;
        if (is_found) asked.emplace(a, b);
        if (least < -rounding) {
          EXPECT_TRUE(is_found) << "missing, " << double(least);
        } else if (least > resolution * way + rounding) {
          EXPECT_FALSE(is_found) << "extra, " << double(least);
        }
        if (!is_found || way == 0) continue;
        const Motion p_end{p.end, p.end}, q_end{q.end, q.end};
        missed_at_end += leastGap(p_end, q_end, margin, 1) > 0 ? 1 : 0;
      }
    }
    EXPECT_EQ(asked.size(), found.size()) << "a pair is ignored or unasked";
  }

  Manager manager;
  Random random;
  std::vector<std::unique_ptr<Object>> own;
  Objects order;
  std::map<const Object*, Known> known;
  std::size_t fibers = 0;
  bool is_seen = false;
  Real reach = 1;                 ///< bounds the coordinates
  std::size_t missed_at_end = 0;  ///< pairs that a query about the end of the step would miss
};

template <typename S>
class ManagerMotion : public testing::Test {};
TYPED_TEST_SUITE(ManagerMotion, Scalars, ScalarName);

// Some sequence of calls would lose where objects were, and so what they met on their way.
TYPED_TEST(ManagerMotion, QueriesReportWhatTouchesWithinTheStep) {
  using S = TypeParam;
  std::size_t missed_at_end = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    FiberManagerOptions options = movingOptions();
    options.topology = seed % 4 == 3 ? Topology::kSuperThread : Topology::kBundle;
    options.ignored_neighbors = 1;
    options.margin = seed % 3 == 0 ? 0.02 : 0;
    options.threads = seed % 5 == 4 ? 2 : 1;
    Program<S> program(options, seed), other(options, 1000 + seed);
    for (int i = 0; i < 4; ++i) other.registerFiber(5);
    Random& random = program.random;
    std::vector<std::unique_ptr<fcl::CollisionObject<S>>> probes;
    for (int i = 0; i < 6; ++i) program.registerFiber(6);
    for (int call = 0; call < 60; ++call) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", call " + std::to_string(call));
      const double distance = std::pow(10, random.between(-3, 0));
      switch (random.below(14)) {
        case 0:
          program.registerFiber(1 + random.below(20));
          break;
        case 1:
          program.registerBall();
          break;
        case 2:
          for (std::size_t i = random.below(4); i > 0; --i) program.unregister();
          break;
        case 3:
          if (random.below(2) > 0) break;
          while (program.order.size() > 5) program.unregister();
          break;
        case 4:
          if (random.below(6) == 0) program.clear();
          break;
        case 5:
        case 6:
          program.updateAll(distance);
          break;
        case 7:
          // Far away, so that the frame changes, or back.
          program.updateAll(random.below(3) == 0 ? 30 : 0.3);
          break;
        case 8:
        case 9:
          program.update(random.below(6), distance);
          break;
        case 10:
          program.manager.setup();
          program.read();
          break;
        case 11: {
          probes.push_back(program.makeObject(0.4));
          fcl::CollisionObject<S>* probe = probes.back().get();
          if (random.below(2) == 0 && !program.order.empty()) {
            probe = program.order[random.below(program.order.size())];
          }
          program.see();
          program.judge(pairsWith(program.manager, *probe), {probe}, nullptr, "with an object");
          break;
        }
        case 12:
          if (random.below(2) == 0) other.updateAll(distance);
          program.see();
          other.see();
          program.judge(pairsWith(program.manager, other.manager), other.order, &other,
                        "with a manager");
          break;
        default:
          program.see();
          if (program.order.size() > 1) {
            program.judge(selfPairs(program.manager), {}, nullptr, "self");
          }
      }
      if (this->HasFailure()) return;
    }
    missed_at_end += program.missed_at_end;
  }
  EXPECT_GT(missed_at_end, 100u);
}

// A step would begin with the poses of objects that another index has by now, and that this one has
// no room for.
TYPED_TEST(ManagerMotion, AYoungIndexForgetsTheObjectsBeforeIt) {
  using S = TypeParam;
  Program<S> program(movingOptions(), 21);
  const auto registerBalls = [&](int count) {
    for (int i = 0; i < count; ++i) program.registerBall();
  };
  const auto judge = [&](const char* what) {
    program.see();
    program.judge(selfPairs(program.manager), {}, nullptr, what);
  };
  registerBalls(200);
  program.manager.setup();
  program.read();
  registerBalls(10);
  judge("ten are young");
  program.update({program.order[205]}, 0.5);
  registerBalls(15);
  judge("too many were young");
  registerBalls(8);
  auto* const young = program.order[225];
  program.update({young}, 0.5);
  program.update({young}, 0.5);
  judge("others are young");
  program.update({young, program.order[0]}, 0.5);
  judge("they have moved");
}

/// A fiber of one capsule along x, whose middle is at a place.
template <typename S>
struct OneCapsule {
  explicit OneCapsule(double length = 0.2, double radius = 0.01)
      : object(std::make_shared<fcl::Capsule<S>>(S(radius), S(length))) {
    place(0, 0, 0);
  }
  void place(double x, double y, double z) {
    fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
    pose.linear() =
        fcl::AngleAxis<S>(S(1.5707963267948966), fcl::Vector3<S>::UnitY()).toRotationMatrix();
    pose.translation() = fcl::Vector3<S>(S(x), S(y), S(z));
    object.setTransform(pose);
  }
  fcl::CollisionObject<S> object;
};

// A program would take the time or the place of an impact from another pair, manager or unit.
TYPED_TEST(ManagerMotion, ImpactsTellWhenAndWhere) {
  using S = TypeParam;
  LayeredAABBTreeCollisionManager<S> manager(movingOptions()), other(movingOptions());
  OneCapsule<S> resting, falling, its;
  falling.place(0.05, 0, 1);
  its.place(0, 3, 0);
  manager.registerFiber({&resting.object});
  manager.registerFiber({&falling.object});
  other.registerFiber({&its.object});
  EXPECT_TRUE(selfPairs(manager).empty());
  EXPECT_TRUE(pairsWith(manager, other).empty());
  falling.place(0.05, 0, -1);
  manager.update();
  its.place(0, -5, 0);
  other.update();

  ImpactCollector<S> collector(manager, &other);
  manager.collide(&collector, &ImpactCollector<S>::callback);
  ASSERT_EQ(collector.impacts().size(), 1u);
  const ObjectImpact<S> impact = collector.impacts()[0];
  EXPECT_EQ(impact.object_a, &resting.object);
  EXPECT_EQ(impact.object_b, &falling.object);
  EXPECT_EQ(impact.a.fiber, 0);
  EXPECT_EQ(impact.b.fiber, 1);
  EXPECT_TRUE(impact.is_exact);
  EXPECT_NEAR(impact.time, 0.49, 1e-6);
  EXPECT_NEAR(impact.distance, 0, 1e-6);
  EXPECT_NEAR(impact.normal[2], 1, 1e-6);
  EXPECT_NEAR(impact.point_a[2], 0.01, 1e-6);

  collector.clear();
  manager.collide(&other, &collector, &ImpactCollector<S>::callback);
  ASSERT_EQ(collector.impacts().size(), 1u);
  EXPECT_EQ(collector.impacts()[0].object_b, &its.object);
  EXPECT_EQ(collector.impacts()[0].b.fiber, 0);
  EXPECT_NEAR(collector.impacts()[0].time, (3 - 0.02) / 8, 1e-6);

  // What is not managed rests.
  OneCapsule<S> probe;
  probe.place(0.05, 0, -0.5);
  collector.clear();
  manager.collide(&probe.object, &collector, &ImpactCollector<S>::callback);
  ASSERT_EQ(collector.impacts().size(), 1u);
  EXPECT_EQ(collector.impacts()[0].object_a, &falling.object);
  EXPECT_NEAR(collector.impacts()[0].time, 0.74, 1e-6);

  TimedContact contact;
  EXPECT_FALSE(manager.findImpact(&resting.object, &probe.object, nullptr, contact));
  EXPECT_THROW(manager.findImpact(nullptr, &probe.object, nullptr, contact), std::invalid_argument);
  EXPECT_THROW(manager.findImpact(&probe.object, &resting.object, nullptr, contact),
               std::invalid_argument);
  EXPECT_THROW(manager.findImpact(&resting.object, nullptr, nullptr, contact),
               std::invalid_argument);
  LayeredAABBTreeCollisionManager<S> without;
  without.registerObject(&resting.object);
  EXPECT_THROW(without.findImpact(&resting.object, &falling.object, nullptr, contact),
               std::invalid_argument);
}

// Motion would be ignored in silence.
TYPED_TEST(ManagerMotion, OptionsThatHaveNoMotionAreRefused) {
  using S = TypeParam;
  FiberManagerOptions options = movingOptions();
  EXPECT_THROW(WrappedSphereTreeCollisionManager<S>{options}, std::invalid_argument);
  options.report = Report::kVolumes;
  EXPECT_THROW(LayeredAABBTreeCollisionManager<S>{options}, std::invalid_argument);
}

// An error, a distance query or a clone would lose or invent a step.
TYPED_TEST(ManagerMotion, AStepBeginsWhereTheLastCollisionQueryLooked) {
  using S = TypeParam;
  LayeredAABBTreeCollisionManager<S> manager(movingOptions());
  OneCapsule<S> resting, falling;
  falling.place(0, 0, 1);
  manager.registerFiber({&resting.object});
  manager.registerFiber({&falling.object});
  EXPECT_TRUE(selfPairs(manager).empty());
  OneCapsule<S> other_resting, other_falling;
  other_falling.place(0, 0, -1);
  const auto clone = manager.clone({&other_resting.object, &other_falling.object});
  EXPECT_TRUE(selfPairs(*clone).empty()) << "a clone does not start where the original is";
  // Neither these updates nor the distance begin a step of their own.
  falling.place(0, 1, 0.5);
  manager.update();
  const auto stop = [](fcl::CollisionObject<S>*, fcl::CollisionObject<S>*, void*, S&) {
    return true;
  };
  manager.distance(nullptr, stop);
  falling.place(0, 0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_THROW(manager.update(), std::invalid_argument);
  EXPECT_THROW(selfPairs(manager), std::invalid_argument);
  falling.place(0, 0, -1);
  manager.update(&falling.object);
  EXPECT_EQ(selfPairs(manager).size(), 1u);
  EXPECT_EQ(selfPairs(manager).size(), 1u) << "the same step";
  manager.update(std::vector<fcl::CollisionObject<S>*>());
  EXPECT_TRUE(selfPairs(manager).empty()) << "a new step, in which all rest";

  // A build that fails in a query must not lose what the query before saw.
  std::vector<std::unique_ptr<OneCapsule<S>>> more;
  for (int i = 0; i < 60; ++i) {
    more.push_back(std::make_unique<OneCapsule<S>>());
    more.back()->place(i, 5, 0);
    manager.registerObject(&more.back()->object);
  }
  falling.place(0, 0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_THROW(selfPairs(manager), std::invalid_argument);
  falling.place(0, 0, 1);
  manager.update();
  EXPECT_EQ(selfPairs(manager).size(), 1u);
  manager.unregisterObject(&falling.object);
  manager.registerFiber({&falling.object});
  EXPECT_TRUE(selfPairs(manager).empty()) << "it has come anew";
}

template <typename S>
using Shape = std::shared_ptr<fcl::CollisionGeometry<S>>;

// A capsule would pass through a floor or a box, or meet everything in the box around a tilted one.
TYPED_TEST(ManagerMotion, CapsulesMeetShapesOnTheirWay) {
  using S = TypeParam;
  using V = fcl::Vector3<S>;
  const Shape<S> shapes[] = {
      std::make_shared<fcl::Box<S>>(S(1), S(0.6), S(0.02)),
      std::make_shared<fcl::Halfspace<S>>(V(S(0.6), S(0), S(0.8)), S(-0.3)),
      std::make_shared<fcl::Plane<S>>(V(S(0.6), S(0), S(0.8)), S(0.1)),
      std::make_shared<fcl::Cylinder<S>>(S(0.05), S(0.8)),
  };
  std::size_t judged = 0, passed = 0;
  Random random(7);
  for (int round = 0; round < 200; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    Program<S> program(movingOptions(), 100 + static_cast<std::uint64_t>(round));
    fcl::CollisionObject<S> shape(shapes[round % 4]);
    program.place(shape, 0.5);
    program.manager.registerObject(&shape);
    for (int i = 0; i < 12; ++i) program.registerFiber(1);
    (void)selfPairs(program.manager);
    program.see();
    const fcl::Transform3<S> start = shape.getTransform();
    enum { kRests, kMoves, kTurns } way = static_cast<decltype(way)>(random.below(3));
    fcl::Transform3<S> end = start;
    if (way != kRests) end.translation() += V(S(0.3), S(-0.2), S(random.between(-0.5, 0.5)));
    if (way == kTurns) end.linear() = end.linear() * fcl::AngleAxis<S>(S(0.3), V::UnitX());
    shape.setTransform(end);
    program.updateAll(0.7);
    const auto calls = selfPairs(program.manager);
    const auto from_end = distanceFrom(shape);
    shape.setTransform(start);
    const auto from_start = distanceFrom(shape);
    shape.setTransform(end);
    const Point shift = (end.translation() - start.translation()).template cast<Real>();
    for (auto* object : program.order) {
      const Motion motion = program.motionOf(object);
      const bool is_found = std::count(calls.begin(), calls.end(), std::pair(&shape, object)) > 0;
      const Real at_start = from_start(motion.start.a, motion.start.b) - motion.start.radius;
      const Real at_end = from_end(motion.end.a, motion.end.b) - motion.end.radius;
      Real least = std::min(at_start, at_end);
      if (way != kTurns) {
        for (int k = 0; k <= 500; ++k) {
          const Capsule now = motion.at(Real(k) / 500);
          const Point back = (1 - Real(k) / 500) * shift;
          least = std::min(least, from_end(now.a + back, now.b + back) - now.radius);
        }
      }
      const Real rounding = 1e-12 + 16 * Real(std::numeric_limits<S>::epsilon());
      const Real tolerance = (motion.way() + shift.norm()) / 200;
      const bool is_exact = way != kTurns && shapes[round % 4]->getNodeType() != fcl::GEOM_CYLINDER;
      if (least < -rounding) {
        EXPECT_TRUE(is_found) << "missing, " << double(least);
      }
      if (is_exact && least > tolerance) {
        EXPECT_FALSE(is_found) << "extra, " << double(least);
      }
      ++judged;
      passed += least < -rounding && std::min(at_start, at_end) > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(passed, 8u) << "of " << judged;
}

}  // namespace
}  // namespace fcl_fibers::test
