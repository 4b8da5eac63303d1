// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl_fibers/impact_collector.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "support/impact_oracle.h"
#include "support/least_box.h"
#include "support/mesh_models.h"
#include "support/pair_queries.h"
#include "support/random.h"
#include "support/scalars.h"
#include "support/scene.h"
#include "support/small_stack.h"

// Meshes that move in a manager with FiberManagerOptions::motion against an oracle that follows
// each capsule and triangle through the step without error.

namespace fcl_fibers::test {
namespace {

FiberManagerOptions movingOptions(int threads = 1, double margin = 0) {
  FiberManagerOptions options;
  options.margin = margin;
  options.report = Report::kCapsules;
  options.motion = true;
  options.threads = threads;
  return options;
}

std::array<double, 3> toArray(const Point& p) {
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

template <typename S>
using Object = fcl::CollisionObject<S>;

/// Makes the box of a shape larger on all sides, as a program does that wants a margin.
template <typename S>
void widen(Object<S>& object, double margin) {
  auto& shape = const_cast<fcl::CollisionGeometry<S>&>(*object.collisionGeometry());
  shape.aabb_local.min_.array() -= static_cast<S>(margin);
  shape.aabb_local.max_.array() += static_cast<S>(margin);
  shape.aabb_radius = (shape.aabb_local.max_ - shape.aabb_center).norm();
  object.computeAABB();
}

/// Capsules and meshes where they were and where they are.
template <typename S>
class MovingMeshes {
 public:
  struct Capsule {
    std::unique_ptr<Object<S>> object;
    std::array<std::array<double, 3>, 2> start, end;
    double margin = 0;
  };
  struct Mesh {
    std::unique_ptr<Object<S>> object;
    std::vector<ExactTriangle> start, end;
    double margin = 0;
  };

  /// @param have_margins  whether some objects have margins of their own
  explicit MovingMeshes(std::uint64_t seed, bool have_margins, std::size_t capsule_count = 30)
      : random(seed) {
    for (std::size_t i = 0; i < capsule_count; ++i) {
      auto shape = std::make_shared<fcl::Capsule<S>>(kRadius, S(0.2));
      capsules.push_back({std::make_unique<Object<S>>(shape, anyPose(0.8)), {}, {}});
      if (have_margins) capsules.back().margin = static_cast<double>(i % 3) / 128;
    }
    const auto types = modelTypes<S>();
    for (std::size_t i = 0; i < 2; ++i) {
      auto model = makeModel<S>(types[i], blob(0.15, 0.2, 6, 4));
      meshes.push_back({std::make_unique<Object<S>>(model, anyPose(0.5)), {}, {}});
      if (have_margins) meshes.back().margin = static_cast<double>(i + 1) / 64;
    }
    for (Capsule& c : capsules) widen(*c.object, c.margin);
    for (Mesh& m : meshes) widen(*m.object, m.margin);
    beginStep();
  }

  fcl::Transform3<S> anyPose(double half_side) {
    const Eigen::Quaterniond rotation = random.rotation();
    return makePose<S>(rotation, random.inCube(half_side));
  }

  void beginStep() {
    for (Capsule& c : capsules) c.start = c.end = axisOf(*c.object);
    for (Mesh& m : meshes) m.start = m.end = trianglesOf(*m.object);
  }
  /// The first mesh turns, the points of the second move against each other.
  void move() {
    for (Capsule& c : capsules) {
      fcl::Transform3<S> pose = c.object->getTransform();
      pose.translation() += random.inCube(0.3).template cast<S>();
      c.object->setTransform(pose);
    }
    meshes[0].object->setTransform(anyPose(0.5));
    auto* model =
        const_cast<fcl::CollisionGeometry<S>*>(meshes[1].object->collisionGeometry().get());
    const Eigen::Vector3d shift = random.inCube(0.2);
    movePoints<S>(*model,
                  [&](const Eigen::Vector3d& p) -> Eigen::Vector3d { return 1.1 * p + shift; });
    widen(*meshes[1].object, meshes[1].margin);  // its local box is computed anew
    for (Capsule& c : capsules) c.end = axisOf(*c.object);
    for (Mesh& m : meshes) m.end = trianglesOf(*m.object);
  }

  /// @param margin  in addition to those of the objects
  static GivenMotion motionOf(const Capsule& c, const Mesh& m, std::size_t triangle,
                              double margin) {
    margin += c.margin + m.margin;
    const auto instant = [&](const auto& axis, const ExactTriangle& t) {
      return GivenInstant{axis, {toArray(t.a), toArray(t.b), toArray(t.c)}, {kRadius, 0}};
    };
    return {instant(c.start, m.start[triangle]), instant(c.end, m.end[triangle]), 3, margin};
  }

  Random random;
  std::vector<Capsule> capsules;
  std::vector<Mesh> meshes;
  static constexpr S kRadius = S(0.0078125);

 private:
  static std::array<std::array<double, 3>, 2> axisOf(const Object<S>& object) {
    const auto& pose = object.getTransform();
    const Point center = pose.translation().template cast<Real>();
    const Point half = Real(S(0.2)) / 2 * pose.linear().col(2).template cast<Real>();
    return {toArray(center - half), toArray(center + half)};
  }
};

/// What becomes of a capsule and a mesh in a step, as far as rounding leaves it certain.
struct Fate {
  bool meets = false, is_apart = true, meets_at_end = false;

  template <typename S>
  static Fate of(const typename MovingMeshes<S>::Capsule& c,
                 const typename MovingMeshes<S>::Mesh& m, double margin, double rounding) {
    Fate fate;
    for (std::size_t t = 0; t < m.start.size(); ++t) {
      const auto near = MovingMeshes<S>::motionOf(c, m, t, margin - rounding);
      const auto far = MovingMeshes<S>::motionOf(c, m, t, margin + rounding);
      fate.meets |= !ImpactOracle::apartDuring(near, 0, 1).certain;
      fate.is_apart &= ImpactOracle::apartDuring(far, 0, 1).certain;
      fate.meets_at_end |= ImpactOracle::withinAt(far, 1).certain;
    }
    return fate;
  }
};

/// Expects that a capsule and a mesh touch at the time of their impact and not before.
template <typename S>
void expectFirstTouch(const TimedContact& contact, const typename MovingMeshes<S>::Capsule& c,
                      const typename MovingMeshes<S>::Mesh& m, double margin, double rounding) {
  EXPECT_TRUE(contact.is_exact);
  ASSERT_GE(contact.triangle, 0);
  // The capsule's own margin is part of its radius there.
  const double reach = margin + m.margin, tolerance = 4 * 0x1p-36 + rounding;
  EXPECT_LE(contact.distance, reach + tolerance);
  if (contact.time == 0) return;
  EXPECT_GE(contact.distance, reach - tolerance);
  for (std::size_t t = 0; t < m.start.size(); ++t) {
    const auto near = MovingMeshes<S>::motionOf(c, m, t, margin - rounding);
    EXPECT_TRUE(ImpactOracle::apartDuring(near, 0, contact.time).certain) << "too late";
  }
}

template <typename S>
class ManagerMotionMeshes : public testing::Test {};
TYPED_TEST_SUITE(ManagerMotionMeshes, Scalars, ScalarName);

// A capsule would pass through a mesh, or a pair would come for each triangle.
TYPED_TEST(ManagerMotionMeshes, AreMetDuringTheWholeStep) {
  using S = TypeParam;
  using Pair = std::pair<const Object<S>*, const Object<S>*>;
  const double rounding = 64 * static_cast<double>(std::numeric_limits<S>::epsilon());
  std::size_t passed = 0, only_one_way = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    // Some objects have margins of their own, and two managers may have different ones.
    MovingMeshes<S> scene(seed, seed % 2 == 1);
    const double margin = seed % 3 == 1 ? 0x1p-6 : seed % 3 == 2 ? 0x1p-7 : 0;
    const double other_margin = seed % 3 == 1 ? 0 : seed % 3 == 2 ? 0x1p-5 : 0;
    std::vector<Calls<S>> all;
    std::vector<std::unique_ptr<LayeredAABBTreeCollisionManager<S>>> managers;
    LayeredAABBTreeCollisionManager<S> fibers(movingOptions(1, margin)),
        obstacles(movingOptions(1, other_margin));
    for (const int threads : {1, 2}) {
      managers.push_back(
          std::make_unique<LayeredAABBTreeCollisionManager<S>>(movingOptions(threads, margin)));
      for (auto& c : scene.capsules) managers.back()->registerFiber({c.object.get()});
      for (auto& m : scene.meshes) managers.back()->registerObject(m.object.get());
      managers.back()->setup();
    }
    for (auto& c : scene.capsules) fibers.registerFiber({c.object.get()});
    for (auto& m : scene.meshes) obstacles.registerObject(m.object.get());
    fibers.setup();
    obstacles.setup();
    for (int step = 0; step < 2; ++step) {
      for (auto& manager : managers) manager->beginStep();
      fibers.beginStep();
      obstacles.beginStep();
      scene.beginStep();
      scene.move();
      for (auto& manager : managers) manager->update();
      fibers.update();
      obstacles.update();
      const Calls<S> calls = selfPairs(*managers[0]);
      EXPECT_EQ(calls, selfPairs(*managers[1])) << "threads show";
      std::set<Pair> found(calls.begin(), calls.end());
      EXPECT_EQ(found.size(), calls.size()) << "a pair comes twice";
      const Calls<S> with = pairsWith(fibers, obstacles), back = pairsWith(obstacles, fibers);
      const std::set<Pair> found_with(with.begin(), with.end()),
          found_back(back.begin(), back.end());
      EXPECT_EQ(found_with.size(), with.size());
      EXPECT_EQ(found_back.size(), back.size());
      for (const auto& c : scene.capsules) {
        const Calls<S> of_one = pairsWith(*managers[0], *c.object);
        const std::set<Pair> found_one(of_one.begin(), of_one.end());
        for (const auto& m : scene.meshes) {
          const Pair pair{c.object.get(), m.object.get()}, other{pair.second, pair.first};
          const Fate fate = Fate::of<S>(c, m, margin, rounding);
          const Fate back_fate =
              margin == other_margin ? fate : Fate::of<S>(c, m, other_margin, rounding);
          TimedContact contact, its;
          if (fate.meets) {
            EXPECT_TRUE(found.count(pair)) << "missing";
            EXPECT_TRUE(found_with.count(pair)) << "missing with another manager";
            EXPECT_TRUE(found_one.count(other)) << "missing with one object";
            passed += fate.meets_at_end ? 0 : 1;
            ASSERT_TRUE(managers[0]->findImpact(pair.first, pair.second, nullptr, contact));
            expectFirstTouch<S>(contact, c, m, margin, rounding);
          } else if (fate.is_apart) {
            EXPECT_FALSE(found.count(pair)) << "extra";
            EXPECT_FALSE(found_with.count(pair)) << "extra with another manager";
            EXPECT_FALSE(found_one.count(other)) << "extra with one object";
          }
          if (back_fate.meets) {
            EXPECT_TRUE(found_back.count(other)) << "missing for another manager";
            ASSERT_TRUE(obstacles.findImpact(other.first, other.second, &fibers, its));
            expectFirstTouch<S>(its, c, m, other_margin, rounding);
          } else if (back_fate.is_apart) {
            EXPECT_FALSE(found_back.count(other)) << "extra for another manager";
          }
          only_one_way += fate.meets != back_fate.meets ? 1 : 0;
          if (margin == other_margin && fate.meets) {
            EXPECT_NEAR(its.time, contact.time, 1e-3);
            for (std::size_t k = 0; k < 3; ++k) {
              EXPECT_NEAR(its.normal[k], -contact.normal[k], 1e-2);
            }
          }
        }
      }
    }
  }
  EXPECT_GT(passed, 15u);
  EXPECT_GT(only_one_way, 3u);
}

/// A small capsule at a place.
template <typename S>
std::unique_ptr<Object<S>> capsuleAt(const Eigen::Vector3d& place) {
  return std::make_unique<Object<S>>(std::make_shared<fcl::Capsule<S>>(S(0.01), S(0.02)),
                                     makePose<S>(Eigen::Quaterniond::Identity(), place));
}

// What is inside a solid would be lost, or come twice when it leaves, or a new surface would sweep.
TYPED_TEST(ManagerMotionMeshes, MayBeSolidRestOrChangeTheirTriangles) {
  using S = TypeParam;
  const auto type = modelTypes<S>().front();
  LayeredAABBTreeCollisionManager<S> manager(movingOptions());
  Object<S> head(makeModel<S>(type, blob(1, 0, 12, 9)));
  const auto inside = capsuleAt<S>({0.1, 0, 0}), passing = capsuleAt<S>({3, 0.1, 0.1});
  manager.registerFiber({inside.get()});
  manager.registerFiber({passing.get()});
  manager.registerObstacle(&head, ObstacleOptions{/*solid=*/true});
  const Calls<S> with_inside{{inside.get(), &head}};
  const Calls<S> with_both{{inside.get(), &head}, {passing.get(), &head}};
  const auto place = [](Object<S>& object, double x) {
    object.setTransform(makePose<S>(Eigen::Quaterniond::Identity(), {x, 0.1, 0.1}));
  };
  EXPECT_EQ(selfPairs(manager), with_inside);

  // All rest, one leaves the solid, and one passes through it.
  manager.beginStep();
  manager.update();
  EXPECT_EQ(selfPairs(manager), with_inside);
  place(*inside, 0.1);
  place(*passing, -3);
  manager.update();
  EXPECT_EQ(selfPairs(manager), with_both);
  ImpactCollector<S> collector(manager);
  manager.collide(&collector, &ImpactCollector<S>::callback);
  ASSERT_EQ(collector.impacts().size(), 2u);
  for (const auto& impact : collector.impacts()) {
    EXPECT_TRUE(impact.has_time);
    EXPECT_TRUE(impact.is_exact);
    EXPECT_GE(impact.triangle, 0);
  }
  EXPECT_EQ(collector.impacts()[0].time, 0);
  EXPECT_LT(collector.impacts()[0].distance, -0.3) << "it is not moved out of the solid";
  EXPECT_NEAR(collector.impacts()[1].time, 2.0 / 6, 0.02);
  EXPECT_NEAR(collector.impacts()[1].normal[0], -1, 0.2);
  manager.beginStep();
  place(*inside, 2);
  manager.update(inside.get());
  EXPECT_EQ(selfPairs(manager), with_inside);
  manager.beginStep();
  manager.update(inside.get());
  EXPECT_TRUE(selfPairs(manager).empty());

  // The mesh moves over a capsule that rests, and so it does if named alone.
  head.setTranslation(fcl::Vector3<S>(S(5), 0, 0));
  manager.update(&head);
  EXPECT_EQ(selfPairs(manager), with_inside);
  manager.beginStep();
  EXPECT_TRUE(selfPairs(manager).empty()) << "it has arrived";

  // With other triangles it has no way from where it was.
  head.setTranslation(fcl::Vector3<S>(S(-1), 0, 0));
  std::swap(trianglesOf<S>(const_cast<fcl::CollisionGeometry<S>&>(*head.collisionGeometry()))[0],
            trianglesOf<S>(const_cast<fcl::CollisionGeometry<S>&>(*head.collisionGeometry()))[1]);
  manager.update();
  EXPECT_TRUE(selfPairs(manager).empty());

  manager.beginStep();

  // An object that has moved since the update is where it was read, in each query.
  place(*inside, -1);
  EXPECT_TRUE(pairsWith(manager, *inside).empty());
  TimedContact contact;
  EXPECT_FALSE(manager.findImpact(inside.get(), &head, nullptr, contact));
  manager.update();
  ASSERT_EQ(pairsWith(manager, *inside).size(), 1u);
  EXPECT_TRUE(manager.findImpact(&head, inside.get(), nullptr, contact));
}

// A strand well within a head would be lost where its distance from the surface lies between the
// margins of the two managers.
TYPED_TEST(ManagerMotionMeshes, AreSolidForManagersOfOtherMargins) {
  using S = TypeParam;
  // A cube from -1 to 1 and capsules within the inner half of its sides, so that a capsule is as
  // far from the surface as from the nearest face.
  MeshShape cube;
  for (int i = 0; i < 8; ++i) {
    cube.points.emplace_back(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
  }
  cube.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  constexpr double kRadius = 0.0625;
  const auto type = modelTypes<S>().front();
  const double margins[][2] = {{0, 0.5}, {0.5, 0}, {0.125, 0.25}, {0.25, 0.125}, {0.25, 0.25}};
  Random random(931);
  std::size_t inside = 0, outside = 0;
  for (const Topology topology : {Topology::kBundle, Topology::kSuperThread}) {
    for (const auto& [margin, its_margin] : margins) {
      for (const bool moves : {false, true}) {
        SCOPED_TRACE("margins " + std::to_string(margin) + ", " + std::to_string(its_margin) +
                     (moves ? ", moving" : ", resting"));
        FiberManagerOptions options = movingOptions(1, margin),
                            its_options = movingOptions(1, its_margin);
        options.topology = its_options.topology = topology;
        LayeredAABBTreeCollisionManager<S> heads(options), hair(its_options);
        const Eigen::Quaterniond turn = random.rotation();
        const Eigen::Vector3d place = random.inCube(2);
        Object<S> head(makeModel<S>(type, cube), makePose<S>(turn, place));
        heads.registerObstacle(&head, ObstacleOptions{/*solid=*/true});
        struct Strand {
          std::unique_ptr<Object<S>> object;
          double depth;  ///< of the whole capsule in the cube, below 0 outside
        };
        std::vector<Strand> strands;
        for (double depth = 0.03125; depth <= 1 - 2 * kRadius; depth += 0.0546875) {
          for (const bool is_inside : {true, false}) {
            const double x = is_inside ? 1 - depth - kRadius : 1 + depth + kRadius;
            const Eigen::Vector3d from(x, random.between(-0.1, 0.1), random.between(-0.1, 0.1));
            // It lies along a face. That is the nearest one while it is near enough to the middle.
            const Eigen::Quaterniond along(
                Eigen::AngleAxisd(random.between(0, 3), Eigen::Vector3d::UnitX()));
            const auto shape = std::make_shared<fcl::Capsule<S>>(S(kRadius), S(0.0625));
            strands.push_back(
                {std::make_unique<Object<S>>(shape, makePose<S>(turn * along, turn * from + place)),
                 is_inside ? depth : -depth});
            hair.registerFiber({strands.back().object.get()});
          }
        }
        heads.beginStep();
        hair.beginStep();
        heads.update();
        hair.update();
        if (moves) {
          // They go together, so that what is inside stays there, and what is outside, too.
          const Eigen::Vector3d shift = random.inCube(0.7);
          head.setTransform(makePose<S>(turn, place + shift));
          for (const Strand& strand : strands) {
            strand.object->setTranslation(strand.object->getTranslation() + shift.cast<S>().eval());
          }
          heads.update();
          hair.update();
        }
        const Calls<S> with = pairsWith(heads, hair), back = pairsWith(hair, heads);
        // The motion and the poses are rounded.
        const double rounding = 64 * static_cast<double>(std::numeric_limits<S>::epsilon());
        const auto expectPair = [&](const Calls<S>& calls, const auto& pair, double depth,
                                    double reach) {
          const auto count = std::count(calls.begin(), calls.end(), pair);
          if (depth > 0 || -depth < reach - rounding) {
            EXPECT_EQ(count, 1) << depth;
          } else if (-depth > reach + rounding) {
            EXPECT_EQ(count, 0) << depth;
          }
        };
        for (const auto& [object, depth] : strands) {
          expectPair(with, std::pair(&head, object.get()), depth, margin);
          expectPair(back, std::pair(object.get(), &head), depth, its_margin);
          if (depth < 0) {
            ++outside;
            continue;
          }
          ++inside;
          TimedContact contact;
          ASSERT_TRUE(heads.findImpact(&head, object.get(), &hair, contact)) << depth;
          EXPECT_EQ(contact.time, 0) << depth;
          ASSERT_TRUE(hair.findImpact(object.get(), &head, &heads, contact)) << depth;
          EXPECT_EQ(contact.time, 0) << depth;
        }
      }
    }
  }
  EXPECT_GT(inside, 200u);
  EXPECT_EQ(outside, inside);
}

// A hair that starts in the head would be pushed out on its far side.
TYPED_TEST(ManagerMotionMeshes, WhatCrossesASolidTouchesTheTriangleThatItCrosses) {
  using S = TypeParam;
  LayeredAABBTreeCollisionManager<S> manager(movingOptions());
  Object<S> head(makeModel<S>(modelTypes<S>().front(), blob(1, 0, 12, 9)));
  manager.registerObstacle(&head, ObstacleOptions{/*solid=*/true});
  // From x = -0.5 to 1.5, and the same with its ends exchanged.
  std::vector<std::unique_ptr<Object<S>>> hairs;
  for (const double angle : {0.5, -0.5}) {
    const Eigen::Quaterniond turn(
        Eigen::AngleAxisd(angle * 3.141592653589793, Eigen::Vector3d::UnitY()));
    hairs.push_back(std::make_unique<Object<S>>(std::make_shared<fcl::Capsule<S>>(S(0.01), S(2)),
                                                makePose<S>(turn, {0.5, 0.1, 0.1})));
    manager.registerFiber({hairs.back().get()});
  }
  manager.setup();
  for (const auto& hair : hairs) {
    TimedContact contact;
    ASSERT_TRUE(manager.findImpact(hair.get(), &head, nullptr, contact));
    EXPECT_EQ(contact.time, 0);
    EXPECT_LT(contact.normal[0], -0.8) << "it is moved in";
    std::vector<MeshContact> contacts;
    ASSERT_TRUE(manager.findMeshContacts(hair.get(), &head, 0, contacts));
    ASSERT_FALSE(contacts.empty());
    EXPECT_EQ(contact.triangle, contacts[0].triangle);
    EXPECT_EQ(contact.distance, contacts[0].distance);
  }
}

// A query that is not `collide` would fix the end of a step that goes on.
TYPED_TEST(ManagerMotionMeshes, MoveOnInOneStepAfterAQuestion) {
  using S = TypeParam;
  const auto capsule = capsuleAt<S>({0, 0, 0});
  Object<S> head(makeModel<S>(modelTypes<S>().front(), blob(0.3, 0, 8, 6)));
  LayeredAABBTreeCollisionManager<S> manager(movingOptions());
  manager.registerFiber({capsule.get()});
  manager.registerObject(&head);
  const auto moveTo = [&](double x) {
    head.setTranslation(fcl::Vector3<S>(static_cast<S>(x), 0, 0));
    manager.update();
  };
  moveTo(2);
  manager.beginStep();
  TimedContact contact;
  moveTo(1);
  EXPECT_FALSE(manager.findImpact(&head, capsule.get(), nullptr, contact));
  moveTo(-2);
  EXPECT_EQ(selfPairs(manager).size(), 1u);
  ASSERT_TRUE(manager.findImpact(&head, capsule.get(), nullptr, contact));
  EXPECT_NEAR(contact.time, (2 - 0.3) / 4, 0.02);
}

// Queries in two frames take turns with the trees of a mesh, and one would use what another gave
// Programs whose threads have little stack would crash.
TYPED_TEST(ManagerMotionMeshes, NeedLittleStack) {
  using S = TypeParam;
  Random random(961);
  Scene<S> scene;
  for (int f = 0; f < 50; ++f) {
    std::vector<Eigen::Vector3d> points{random.inCube(0.7)};
    for (int i = 0; i < 40; ++i) points.push_back(points.back() + random.inCube(0.05));
    scene.addFiber(points, 0.002);
  }
  auto* head = scene.add(makeModel<S>(modelTypes<S>().front(), blob(0.5, 0.1, 80, 60)),
                         makePose<S>(Eigen::Quaterniond::Identity(), {0, 0, 0}));
  for (const int threads : {1, 2}) {
    runOnSmallStack([&] {
      LayeredAABBTreeCollisionManager<S> manager(movingOptions(threads));
      for (const auto& fiber : scene.fibers()) manager.registerFiber(fiber);
      manager.registerObstacle(head, ObstacleOptions{/*solid=*/true});
      manager.beginStep();
      EXPECT_GT(selfPairs<S>(manager).size(), 500u);
      jolt(scene.objects(), random, 0.02, 0.02);
      manager.update();
      ImpactCollector<S> impacts(manager);
      manager.collide(&impacts, impacts.callback);
      EXPECT_GT(impacts.impacts().size(), 500u);
      manager.update(scene[0]);
      EXPECT_GT(pairsWith<S>(manager, *head).size(), 100u);
      std::vector<MeshContact> contacts;
      for (auto* object : scene.fibers()[0]) manager.findMeshContacts(object, head, 0, contacts);
      struct Least {
        static bool visit(Object<S>*, Object<S>*, void*, S& dist) {
          dist = std::min(dist, S(0.001));
          return false;
        }
      };
      manager.distance(nullptr, &Least::visit);
      manager.distance(head, nullptr, &Least::visit);
    });
  }
}

// up.
TYPED_TEST(ManagerMotionMeshes, ThreadsShareAMesh) {
  using S = TypeParam;
  MovingMeshes<S> scene(3, /*have_margins=*/false);
  LayeredAABBTreeCollisionManager<S> fibers(movingOptions()), obstacles(movingOptions());
  for (auto& c : scene.capsules) fibers.registerFiber({c.object.get()});
  for (auto& m : scene.meshes) obstacles.registerObject(m.object.get());
  const auto ask = [&](int which) {
    const auto& asked = which % 2 == 0 ? fibers : obstacles;
    auto& other = which % 2 == 0 ? obstacles : fibers;
    ImpactCollector<S> collector(asked, &other);
    asked.collide(&other, &collector, &ImpactCollector<S>::callback);
    std::vector<double> times;
    for (const auto& impact : collector.impacts()) times.push_back(impact.time);
    return times;
  };
  fibers.beginStep();
  obstacles.beginStep();
  scene.move();
  fibers.update();
  obstacles.update();
  std::array<std::vector<double>, 4> found;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&, i] {
      for (int k = 0; k < 10; ++k) found[static_cast<std::size_t>(i)] = ask(i);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_FALSE(found[0].empty());
  for (int i = 0; i < 4; ++i) EXPECT_EQ(found[static_cast<std::size_t>(i)], ask(i));
}

// A mesh would pass through the objects of a manager whose tree has no motion.
TYPED_TEST(ManagerMotionMeshes, PassOverManagersWithoutMotion) {
  using S = TypeParam;
  FiberManagerOptions resting;
  resting.report = Report::kCapsules;
  WrappedSphereTreeCollisionManager<S> spheres(resting);
  LayeredAABBTreeCollisionManager<S> boxes(resting), obstacles(movingOptions());
  resting.report = Report::kVolumes;
  LayeredAABBTreeCollisionManager<S> volumes(resting);
  const auto capsule = capsuleAt<S>({0, 0, 0});
  Object<S> head(makeModel<S>(modelTypes<S>().front(), blob(0.3, 0, 8, 6)));
  head.setTranslation(fcl::Vector3<S>(S(2), 0, 0));
  obstacles.registerObject(&head);
  obstacles.setup();
  for (LayeredAABBTreeCollisionManager<S>* manager : {&boxes, &volumes}) {
    manager->registerFiber({capsule.get()});
  }
  spheres.registerFiber({capsule.get()});
  obstacles.beginStep();
  head.setTranslation(fcl::Vector3<S>(S(-2), 0, 0));
  obstacles.update();
  EXPECT_EQ(pairsWith(obstacles, boxes).size(), 1u);
  EXPECT_EQ(pairsWith(obstacles, spheres).size(), 1u);
  EXPECT_EQ(pairsWith(obstacles, volumes).size(), 1u);
  EXPECT_EQ(pairsWith(obstacles, *capsule).size(), 1u);
  TimedContact contact;
  ASSERT_TRUE(obstacles.findImpact(&head, capsule.get(), &spheres, contact));
  EXPECT_NEAR(contact.time, (2 - 0.3) / 4, 0.02);
  EXPECT_TRUE(pairsWith(boxes, obstacles).empty()) << "it asks about the end";
}

}  // namespace
}  // namespace fcl_fibers::test
