// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "support/managed.h"
#include "support/mesh_models.h"
#include "support/scene_generators.h"
#include "support/text_of.h"

namespace fcl_fibers::test {
namespace {

MANAGER_SUITE(Obstacles, FiberManagers);

FiberManagerOptions byCapsules(double margin = 0) {
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  options.margin = margin;
  return options;
}

/// A straight fiber from the origin along x, of segments of length 1.
template <typename S>
std::vector<fcl::CollisionObject<S>*> addStraight(Scene<S>& scene, std::size_t count, double z) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i <= count; ++i) points.emplace_back(static_cast<double>(i), 0.0, z);
  return scene.addFiber(points, 0.1);
}

/// The numbers of the segments of a fiber that are paired with an object.
template <typename S>
std::set<std::size_t> segmentsWith(const FiberCollisionManager<S>& manager, const Calls<S>& calls,
                                   const fcl::CollisionObject<S>* object) {
  std::set<std::size_t> segments;
  for (const auto& [a, b] : calls) {
    if (a != object && b != object) continue;
    const fcl::CollisionObject<S>* partner = a == object ? b : a;
    if (partner->getNodeType() != fcl::GEOM_CAPSULE) continue;
    segments.insert(manager.fiberSegment(partner).number);
  }
  return segments;
}

using Numbers = std::set<std::size_t>;

// A strand under the skin would count, or one inside a machine would not.
TYPED_TEST(Obstacles, AreSurfacesUnlessTheyAreSolid) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  const auto fiber = addStraight(scene, 12, 0.2);
  auto* head = scene.add(makeModel<S>(fcl::BV_OBBRSS, blob(3.5, 0, 16, 10)),
                         makePose<S>(Eigen::Quaterniond::Identity(), {5, 0, 0}));
  for (const bool is_solid : {false, true}) {
    auto manager = TypeParam::make(byCapsules());
    manager->registerObstacle(head, ObstacleOptions{is_solid});
    manager->registerFiber(fiber, FiberEnds::kOpen, FiberGroup{1});
    const Numbers expected = is_solid ? Numbers{1, 2, 3, 4, 5, 6, 7, 8} : Numbers{1, 8};
    EXPECT_EQ(segmentsWith<S>(*manager, selfPairs<S>(*manager), head), expected);
    EXPECT_EQ(segmentsWith<S>(*manager, pairsWith<S>(*manager, *head), head), expected);
    for (std::size_t i = 0; i < fiber.size(); ++i) {
      EXPECT_EQ(pairsWith<S>(*manager, *fiber[i]).size(), expected.count(i)) << i;
    }
    manager->update();
    EXPECT_EQ(segmentsWith<S>(*manager, selfPairs<S>(*manager), head), expected);
    Scene<S> its_scene;
    const auto its_fiber = addStraight(its_scene, 12, 0.2);
    for (const Report report : {Report::kVolumes, Report::kCapsules}) {
      FiberManagerOptions options;
      options.report = report;
      auto other = TypeParam::make(options);
      other->registerFiber(its_fiber);
      Numbers found;
      for (const auto& [a, b] : pairsWith<S>(*manager, *other)) {
        if (a == head) found.insert(other->fiberSegment(b).number);
      }
      EXPECT_EQ(found, expected);
      // A manager that counts volumes knows what is solid, too.
      auto owner = TypeParam::make(options);
      owner->registerObstacle(head, ObstacleOptions{is_solid});
      std::vector<MeshContact> contacts;
      ASSERT_TRUE(owner->findMeshContacts(fiber[5], head, 0, contacts));
      EXPECT_EQ(contacts.at(0).solid, is_solid);
      EXPECT_EQ(contacts.at(0).distance < -3, is_solid);
    }
  }
}

// Each hair would touch its head at the root.
TYPED_TEST(Obstacles, RootsMeetNone) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  const auto fiber = addStraight(scene, 6, 0);
  auto* mesh = scene.add(makeModel<S>(fcl::BV_AABB, blob(20, 0, 6, 5)),
                         makePose<S>(Eigen::Quaterniond::Identity(), {0, 0, -16.5}));
  auto* box = scene.addBox({3, 0, 0}, Eigen::Quaterniond::Identity(), {9, 1, 1});
  auto* sphere = scene.addSphere({3, 0, 0}, 5);
  // All of it lies under the surface of the mesh.
  struct Case {
    FiberObstacles obstacles;
    Numbers expected;
  };
  const Case cases[] = {{{}, {0, 1, 2, 3, 4, 5}},   {{~0u, 2, 0}, {2, 3, 4, 5}},
                        {{~0u, 0, 2.5}, {3, 4, 5}}, {{~0u, 1, 2}, {2, 3, 4, 5}},
                        {{~0u, 9, 0}, {}},          {{0u, 0, 0}, {}}};
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    for (const Case& one : cases) {
      FiberManagerOptions options = byCapsules();
      options.report = report;
      options.ignored_neighbors = 1;
      Managed<TypeParam> manager(options);
      manager->registerFiber(fiber, FiberEnds::kOpen, {}, one.obstacles);
      manager->registerObstacle(mesh, ObstacleOptions{true});
      manager->registerObject(box);
      for (int round = 0; round < 3; ++round) {
        if (round == 1) manager->update();
        if (round == 2) manager->registerObject(sphere);
        for (auto* object : {mesh, box, sphere}) {
          if (object == sphere && round < 2) continue;
          EXPECT_EQ(segmentsWith<S>(*manager, selfPairs<S>(*manager), object), one.expected);
        }
        for (auto* object : {mesh, box, sphere}) {
          // An object of nobody is an obstacle, too.
          EXPECT_EQ(segmentsWith<S>(*manager, pairsWith<S>(*manager, *object), object),
                    one.expected);
        }
      }
    }
  }
}

// An arm would be searched for cables that it may touch.
TYPED_TEST(Obstacles, AreMetByCategory) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  const auto first = addStraight(scene, 3, 0), second = addStraight(scene, 3, 1);
  std::vector<fcl::CollisionObject<S>*> obstacles;
  const auto plate = makeModel<S>(fcl::BV_AABB, blob(2, 0, 8, 5));
  for (int i = 0; i < 3; ++i) {
    obstacles.push_back(scene.add(plate, makePose<S>(Eigen::Quaterniond::Identity(), {0, 0, 0.5})));
    obstacles.push_back(scene.addBox({1.5, 0, 0.5}, Eigen::Quaterniond::Identity(), {3, 1, 2}));
  }
  const std::uint32_t categories[] = {1, 2, 6};
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberManagerOptions options = byCapsules();
    options.report = report;
    auto manager = TypeParam::make(options), other = TypeParam::make(options);
    manager->registerFiber(first, FiberEnds::kOpen, FiberGroup{1}, FiberObstacles{1});
    manager->registerFiber(second, FiberEnds::kOpen, FiberGroup{1}, FiberObstacles{4});
    for (std::size_t i = 0; i < obstacles.size(); ++i) {
      for (auto* its : {manager.get(), other.get()}) {
        its->registerObstacle(obstacles[i], ObstacleOptions{false, categories[i / 2]});
      }
    }
    const auto expect = [&](const Calls<S>& calls) {
      std::set<std::pair<std::size_t, std::size_t>> met;
      for (const auto& [a, b] : calls) {
        for (std::size_t i = 0; i < obstacles.size(); ++i) {
          for (const auto& [p, q] : {std::pair(a, b), std::pair(b, a)}) {
            const bool is_fiber = p->getNodeType() == fcl::GEOM_CAPSULE;
            if (q == obstacles[i] && is_fiber) met.insert({manager->fiberSegment(p).fiber, i});
          }
        }
      }
      EXPECT_EQ(met,
                (std::set<std::pair<std::size_t, std::size_t>>{{0, 0}, {0, 1}, {1, 4}, {1, 5}}));
    };
    expect(selfPairs<S>(*manager));
    expect(pairsWith<S>(*manager, *other));
    Calls<S> one_by_one;
    for (auto* object : obstacles) {
      for (const auto& call : pairsWith<S>(*manager, *object)) one_by_one.push_back(call);
    }
    expect(one_by_one);
  }
}

// An answer would depend on managers that do not take part in the query, or a manager that does
// would not be asked for its rules.
TYPED_TEST(Obstacles, OfAnotherManagerHaveItsRulesOnlyIfItTakesPart) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  const auto fiber = addStraight(scene, 2, 0), its_fiber = addStraight(scene, 2, 0.1);
  auto* const head = scene.add(makeModel<S>(fcl::BV_OBBRSS, blob(8, 0, 16, 10)),
                               makePose<S>(Eigen::Quaterniond::Identity(), {1, 0, 0}));
  auto* const box = scene.addBox({1, 0, 0}, Eigen::Quaterniond::Identity(), {2, 1, 1});
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberManagerOptions options = byCapsules();
    options.report = report;
    const auto manager = TypeParam::make(options), other = TypeParam::make(options);
    manager->registerFiber(fiber, FiberEnds::kOpen, {}, FiberObstacles{~2u, 1, 0});
    other->registerFiber(its_fiber);
    other->registerObstacle(box, ObstacleOptions{false, 2});
    other->registerObstacle(head, ObstacleOptions{true, 1});

    const Calls<S> calls = pairsWith<S>(*manager, *other);
    const auto with = [&](auto* object) { return segmentsWith<S>(*manager, calls, object); };
    const auto withAlone = [&](auto* object) {
      return segmentsWith<S>(*manager, pairsWith<S>(*manager, *object), object);
    };
    // The manager knows that this is a fiber, which roots meet; alone it is an obstacle.
    EXPECT_EQ(with(its_fiber[0]), (Numbers{0, 1}));
    EXPECT_EQ(withAlone(its_fiber[0]), Numbers{1});
    // Its categories exclude this box; alone it has all.
    EXPECT_EQ(with(box), Numbers{});
    EXPECT_EQ(withAlone(box), Numbers{1});
    // The fiber is inside a solid; alone the mesh is a surface. Under kVolumes its box counts.
    const bool by_box = report == Report::kVolumes;
    EXPECT_EQ(with(head), Numbers{1});
    EXPECT_EQ(withAlone(head), by_box ? Numbers{1} : Numbers{});
  }
}

// A mesh that no fiber meets would not meet other obstacles, either.
TYPED_TEST(Obstacles, WithoutCategoriesMeetEachOther) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  auto* mesh = scene.add(makeModel<S>(fcl::BV_AABB, blob(1, 0, 8, 6)),
                         makePose<S>(Eigen::Quaterniond::Identity(), {0, 0, 0}));
  auto* sphere = scene.addSphere({1, 0, 0}, 0.3);
  auto* segment = scene.addCapsule(Eigen::Vector3d(0, 0.9, 0), Eigen::Vector3d(0, 1.1, 0), 0.1);
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberManagerOptions options;
    options.report = report;
    auto manager = TypeParam::make(options), spheres = TypeParam::make(options),
         meshes = TypeParam::make(options);
    for (auto* its : {manager.get(), spheres.get()}) its->registerObstacle(sphere, {false, 0});
    for (auto* its : {manager.get(), meshes.get()}) its->registerObstacle(mesh, {false, 0});
    for (auto* its : {manager.get(), spheres.get()}) its->registerFiber({segment});
    const auto hasThePair = [&](const Calls<S>& calls) {
      return calls.size() == 1 &&
             std::minmax(calls[0].first, calls[0].second) == std::minmax(mesh, sphere);
    };
    EXPECT_TRUE(hasThePair(selfPairs<S>(*manager)));
    EXPECT_TRUE(hasThePair(pairsWith<S>(*manager, *mesh)));
    EXPECT_TRUE(hasThePair(pairsWith<S>(*manager, *sphere)));
    EXPECT_TRUE(hasThePair(pairsWith<S>(*spheres, *meshes)));
    EXPECT_TRUE(hasThePair(pairsWith<S>(*meshes, *spheres)));
  }
}

// A post would have the categories of another one whose end it shares.
TYPED_TEST(Obstacles, ThatShareEndsHaveTheirOwnCategories) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  const auto posts = addStraight(scene, 4, 0);
  const auto fiber = addStraight(scene, 4, 0.1);
  auto manager = TypeParam::make(byCapsules());
  manager->registerObject(posts[0]);
  manager->registerObstacle(posts[1], {false, 1});
  manager->registerObstacle(posts[2], {false, 2});
  manager->registerObject(posts[3]);
  manager->registerFiber(fiber, FiberEnds::kOpen, FiberGroup{1}, FiberObstacles{2});
  const auto calls = selfPairs<S>(*manager);
  for (std::size_t i = 0; i < posts.size(); ++i) {
    const bool meets = std::any_of(calls.begin(), calls.end(), [&](const auto& call) {
      return call.first == posts[i] && call.second == fiber[i];
    });
    EXPECT_EQ(meets, i != 1) << i;
  }
}

// A fiber and an obstacle would meet although one of them does not meet the other.
TYPED_TEST(Obstacles, MeetByFiltersOfBothSides) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  auto* mesh = scene.add(makeModel<S>(fcl::BV_AABB, blob(1, 0, 8, 6)),
                         makePose<S>(Eigen::Quaterniond::Identity(), {0, 0, 0}));
  auto* sphere = scene.addSphere({0, 1, 0}, 0.3);
  auto* post = scene.addCapsule(Eigen::Vector3d(0, 0.9, 0), Eigen::Vector3d(0.1, 1.2, 0), 0.2);
  auto* segment = scene.addCapsule(Eigen::Vector3d(0, 0.8, 0), Eigen::Vector3d(0, 1.2, 0), 0.1);
  for (const std::uint32_t bits : {0u, 1u, 2u, 3u}) {
    for (const std::uint32_t its_bits : {0u, 1u, 2u, 3u}) {
      for (const bool by_fiber : {false, true}) {
        SCOPED_TRACE(testing::Message() << bits << ' ' << its_bits << ' ' << by_fiber);
        FiberObstacles fiber;
        ObstacleOptions obstacle;
        (by_fiber ? fiber.meets : fiber.categories) = bits;
        (by_fiber ? obstacle.categories : obstacle.meets) = its_bits;
        auto manager = TypeParam::make(byCapsules()), fibers = TypeParam::make(byCapsules()),
             obstacles = TypeParam::make(byCapsules());
        for (auto* its : {manager.get(), fibers.get()}) {
          its->registerFiber({segment}, FiberEnds::kOpen, {}, fiber);
        }
        for (auto* its : {manager.get(), obstacles.get()}) {
          for (auto* object : {mesh, sphere, post}) its->registerObstacle(object, obstacle);
        }
        const auto meeting = [&](const Calls<S>& calls) {
          return std::count_if(calls.begin(), calls.end(), [&](const auto& call) {
            return call.first == segment || call.second == segment;
          });
        };
        const int expected = (bits & its_bits) != 0 ? 3 : 0;
        EXPECT_EQ(meeting(selfPairs<S>(*manager)), expected);
        EXPECT_EQ(meeting(pairsWith<S>(*manager, *segment)), expected);
        EXPECT_EQ(meeting(pairsWith<S>(*fibers, *obstacles)), expected);
        EXPECT_EQ(meeting(pairsWith<S>(*obstacles, *fibers)), expected);
        // Obstacles meet each other in any case.
        EXPECT_EQ(selfPairs<S>(*obstacles).size(), 3u);
      }
    }
  }
}

// A query for obstacles alone would report hair against hair.
TYPED_TEST(Obstacles, AreAllThatAGroupMeets) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(10, 10, 921);
  auto* head = scene.add(makeModel<S>(fcl::BV_AABB, blob(0.6, 0.2, 9, 6)),
                         makePose<S>(Eigen::Quaterniond::Identity(), {0, 0, 0}));
  Managed<TypeParam> manager(byCapsules());
  for (const auto& fiber : scene.fibers()) {
    manager.registerFiber(fiber, FiberEnds::kOpen, FiberGroup{1});
  }
  manager.registerObject(head);
  EXPECT_TRUE(manager.answersSelf(10));
  for (const auto& [a, b] : selfPairs<S>(*manager)) EXPECT_EQ(b, head);
}

// A program that asks for contacts before they happen would get them late.
TYPED_TEST(Obstacles, MayBeWidened) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  scene.add(makeModel<S>(fcl::BV_OBBRSS, blob(1, 0, 12, 9)),
            makePose<S>(Eigen::Quaterniond(0.8, 0, 0.6, 0), {0, 0, 0}));
  auto* capsule =
      scene.addCapsule(Eigen::Vector3d(1.3, -0.1, 0), Eigen::Vector3d(1.3, 0.1, 0), 0.1);
  for (const int way : {0, 1, 2}) {
    SCOPED_TRACE(way);
    auto manager = TypeParam::make(byCapsules());
    fcl::AABB<S>& box = aabbOf(*scene[0]);
    scene[0]->computeAABB();
    if (way == 1) grow(box, 0.25);
    if (way == 2) box.max_[0] += S(0.5);
    manager->registerObjects(scene.objects());
    if (way == 1) {
      EXPECT_NEAR(manager->margin(scene[0]), 0.25, 1e-5);
    }
    const std::size_t expected = way == 0 ? 0 : 1;
    EXPECT_EQ(selfPairs<S>(*manager).size(), expected);
    EXPECT_EQ((pairsWith<S>(*manager, *scene[0])).size(), expected);
    EXPECT_EQ((pairsWith<S>(*manager, *capsule)).size(), expected);
  }
}

// A capsule in the air within the box of a turned shape would count.
TYPED_TEST(Obstacles, OfOtherShapesTurn) {
  using S = typename TypeParam::Scalar;
  for (const FiberManagerOptions& options : {byCapsules(), byCapsules(0.03)}) {
    Scene<S> scene = strandScene<S>(20, 10, 922);
    Random random(923);
    addShapes(scene, 24, 0.4, 924);
    for (auto* object : scene.loose()) {
      const Eigen::Quaterniond rotation = random.rotation();
      moveTo(*object, makePose<S>(rotation, random.inCube(0.8)));
    }
    Managed<TypeParam> manager(options);
    manager.registerFibers(scene);
    EXPECT_TRUE(manager.answersSelf(20));
    manager.expectAnswersWith(manager.objects());
    manager.expectNearest();
    Managed<TypeParam> strands(options), other(options), by_volumes;
    for (const auto& fiber : scene.fibers()) strands.registerFiber(fiber);
    other.registerObjects(scene.loose());
    by_volumes.registerObjects(scene.loose());
    EXPECT_TRUE(strands.answersWith(other));
    EXPECT_TRUE(other.answersWith(strands));
    EXPECT_TRUE(strands.answersWith(by_volumes));
    EXPECT_TRUE(by_volumes.answersWith(strands));
    jolt(scene.objects(), random, 0.1, 1);
    EXPECT_TRUE(manager->movedSinceUpdate());
    manager->update();
    EXPECT_TRUE(manager.answersSelf(20));
  }
}

// A broken mesh would be read beyond its end.
TEST(ObstaclesBadInput, BrokenMeshesAreRefused) {
  using Manager = FiberManagerConfig<LeafVolume::kBox, double, Topology::kBundle>;
  const MeshShape shape = blob(1, 0, 6, 5);
  Scene<double> scene;
  auto* good = scene.addSphere({0, 0, 0}, 1);
  struct Case {
    std::shared_ptr<fcl::CollisionGeometry<double>> model;
    const char* text;
  };
  const auto bad_index = makeModel<double>(fcl::BV_AABB, shape);
  arraysOf(*bad_index).triangles[3].set(0, shape.points.size(), 1);
  const auto bad_point = makeModel<double>(fcl::BV_OBBRSS, shape);
  arraysOf(*bad_point).points[2][1] = std::nan("");
  const Case cases[] = {{bad_index, "triangle 3 of its mesh has the point"},
                        {bad_point, "point 2 of its mesh is NaN"},
                        {makeUnfinishedModel(shape), "unfinished"}};
  for (const Case& one : cases) {
    fcl::CollisionObject<double> object(one.model);
    const auto manager = Manager::make(byCapsules());
    manager->registerObject(good);
    expectRefusal([&] { manager->registerObject(&object); }, one.text);
    expectRefusal([&] { manager->registerObstacle(&object); }, one.text);
    EXPECT_EQ(manager->size(), 1u);
    PairCollector<double> collector;
    expectRefusal([&] { manager->collide(&object, &collector, &PairCollector<double>::collide); },
                  one.text);
    EXPECT_TRUE(selfPairs<double>(*manager).empty());
  }
  // A cloud of points counts by its box.
  fcl::CollisionObject<double> cloud(makeCloud(shape));
  const auto manager = Manager::make(byCapsules());
  manager->registerObjects({good, &cloud});
  EXPECT_EQ(selfPairs<double>(*manager).size(), 1u);
  EXPECT_EQ((pairsWith<double>(*manager, cloud)).size(), 1u);

  // It may break later, and be repaired.
  const auto model = makeModel<double>(fcl::BV_AABB, shape);
  fcl::CollisionObject<double> object(model);
  manager->registerObject(&object);
  const auto pairs = selfPairs<double>(*manager);
  // An update looks at the first point and a few more, and a query at all.
  for (const std::size_t broken : {0u, 1u}) {
    double& number = arraysOf(*model).points[broken][0];
    const double kept = number;
    number = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(manager->movedSinceUpdate());
    const std::string text =
        "object 2 in order of registration: point " + std::to_string(broken) + " of its mesh";
    if (broken == 0) {
      expectRefusal([&] { manager->update(); }, text);
      expectRefusal([&] { selfPairs<double>(*manager); }, "the last update failed");
    } else {
      manager->update();
      expectRefusal([&] { selfPairs<double>(*manager); }, text);
      expectRefusal([&] { selfPairs<double>(*manager); }, text);
    }
    number = kept;
    if (broken == 0) manager->update();
    EXPECT_EQ(selfPairs<double>(*manager), pairs);
  }
}

TEST(ObstaclesBadInput, OptionsAreChecked) {
  using Manager = FiberManagerConfig<LeafVolume::kBox, double, Topology::kBundle>;
  MeshShape open = blob(1, 0, 6, 5);
  open.triangles.pop_back();
  Scene<double> scene;
  auto* leaking = scene.add(makeModel<double>(fcl::BV_AABB, open),
                            makePose<double>(Eigen::Quaterniond::Identity(), {0, 0, 0}));
  MeshShape apart;  // each triangle has points of its own, as in many files
  const MeshShape closed = blob(1, 0, 6, 5);
  for (const auto& t : closed.triangles) {
    const std::size_t first = apart.points.size();
    for (const std::size_t i : t) apart.points.push_back(closed.points[i]);
    apart.triangles.push_back({first, first + 1, first + 2});
  }
  auto* unmerged = scene.add(makeModel<double>(fcl::BV_AABB, apart),
                             makePose<double>(Eigen::Quaterniond::Identity(), {0, 0, 0}));
  MeshShape inside_out = blob(1, 0, 6, 5);
  for (auto& t : inside_out.triangles) std::swap(t[0], t[1]);
  auto* clockwise = scene.add(makeModel<double>(fcl::BV_AABB, inside_out),
                              makePose<double>(Eigen::Quaterniond::Identity(), {0, 0, 0}));
  const auto fiber = addStraight(scene, 4, 0);
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberManagerOptions options;
    options.report = report;
    const auto manager = Manager::make(options);
    expectRefusal([&] { manager->registerObstacle(leaking, ObstacleOptions{true}); },
                  "in the opposite direction; close the mesh, or register it without");
    expectRefusal(
        [&] { manager->registerObstacle(unmerged, ObstacleOptions{true}); },
        "object 0: its mesh is not watertight: the edge from point 0 to point 1 of triangle 0 is "
        "shared with no other triangle, because points that lie at the same place are not one "
        "point; merge such points, or register it without");
    EXPECT_THROW(manager->registerObstacle(clockwise, ObstacleOptions{true}),
                 std::invalid_argument);
    EXPECT_THROW(manager->registerObstacle(nullptr), std::invalid_argument);
    for (const double length : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
      EXPECT_THROW(manager->registerFiber(fiber, FiberEnds::kOpen, {}, {~0u, 0, length}),
                   std::invalid_argument);
    }
    EXPECT_THROW(manager->registerFiber(fiber, FiberEnds::kOpen, {}, {~0u, -1, 0}),
                 std::invalid_argument);
    EXPECT_TRUE(manager->empty());
    manager->registerObstacle(leaking);
    EXPECT_EQ(manager->size(), 1u);
  }
}

}  // namespace
}  // namespace fcl_fibers::test
