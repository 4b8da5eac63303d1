// SPDX-License-Identifier: BSD-3-Clause
//
// What a manager keeps of meshes that change, come and go, or are asked about by distance.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl_fibers/contact.h>

#include "support/managed.h"
#include "support/mesh_models.h"
#include "support/text_of.h"

namespace fcl_fibers::test {
namespace {

MANAGER_SUITE(MeshReadings, FiberManagers);

FiberManagerOptions capsulesReported() {
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  return options;
}

template <typename S>
fcl::Transform3<S> placeAt(double x) {
  return makePose<S>(Eigen::Quaterniond::Identity(), {x, 0, 0});
}

template <typename S>
auto ballOf(double radius) {
  return makeModel<S>(fcl::BV_AABB, blob(radius, 0, 24, 16));
}

/// The least distance of the contacts.
template <class Manager, class Object>
double contactDistance(const Manager& manager, const Object& capsule, const Object& mesh) {
  std::vector<MeshContact> contacts;
  EXPECT_TRUE(manager.findMeshContacts(&capsule, &mesh, 0, contacts));
  double least = std::numeric_limits<double>::infinity();
  for (const MeshContact& contact : contacts) least = std::min(least, contact.distance);
  return least;
}

// A clone would take the contacts with its own meshes for those of the original's.
TYPED_TEST(MeshReadings, OfAClonesMeshesAreItsOwn) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  auto* small = scene.add(ballOf<S>(1), placeAt<S>(0));
  auto* capsule = scene.addCapsule(placeAt<S>(1), 0.1, 0.2);
  auto* large = scene.add(ballOf<S>(3), placeAt<S>(0));
  const Managed<TypeParam> manager({small, capsule}, capsulesReported());
  EXPECT_LT(contactDistance(*manager, *capsule, *small), 0);
  fcl::CollisionObject<S> copy(*capsule);
  const auto clone = cloneOf<S>(*manager, {large, &copy});
  EXPECT_NEAR(contactDistance(*clone, copy, *large), 1.9, 0.1);
  EXPECT_TRUE(selfPairs<S>(*clone).empty());
}

// The contacts would be those of a mesh that is gone.
TYPED_TEST(MeshReadings, AreForgottenWithTheModel) {
  using S = typename TypeParam::Scalar;
  using Model = fcl::BVHModel<fcl::AABB<S>>;
  alignas(Model) unsigned char place[sizeof(Model)];
  const auto makeAtOnePlace = [&](double radius, std::size_t around) {
    std::shared_ptr<Model> model(new (place) Model, [](Model* gone) { gone->~Model(); });
    const MeshShape shape = blob(radius, 0, around, 6);
    std::vector<fcl::Vector3<S>> points;
    for (const auto& p : shape.points) points.push_back(p.template cast<S>());
    std::vector<fcl::Triangle> triangles;
    for (const auto& t : shape.triangles) triangles.emplace_back(t[0], t[1], t[2]);
    model->beginModel();
    model->addSubModel(points, triangles);
    model->endModel();
    return model;
  };
  Scene<S> scene;
  auto* capsule = scene.addCapsule(placeAt<S>(1), 0.1, 0.2);
  const Managed<TypeParam> manager(scene, capsulesReported());
  {
    fcl::CollisionObject<S> mesh(makeAtOnePlace(1, 12));
    EXPECT_EQ((pairsWith<S>(*manager, mesh)).size(), 1u);
    EXPECT_LT(contactDistance(*manager, *capsule, mesh), 0);
  }
  const fcl::CollisionObject<S> mesh(makeAtOnePlace(3, 8));
  EXPECT_GT(contactDistance(*manager, *capsule, mesh), 1);
}

// A capsule within a hollow mesh would touch it, or what touches the mesh would be lost, in a scene
// of few objects or of many.
TYPED_TEST(MeshReadings, AreHollowBesideFewObjectsAndMany) {
  using S = typename TypeParam::Scalar;
  for (const int others : {0, 10, 70}) {
    for (const bool with_capsules : {false, true}) {
      Scene<S> scene;
      auto* mesh = scene.add(ballOf<S>(5), placeAt<S>(0));
      const auto box = std::make_shared<fcl::Box<S>>(S(0.1), S(0.1), S(0.1));
      std::vector<fcl::CollisionObject<S>*> touching = {scene.add(box, placeAt<S>(5))};
      auto* within = scene.add(box, placeAt<S>(0.5));
      if (with_capsules) {
        scene.addCapsule(placeAt<S>(-0.5), 0.1, 0.2);
        touching.push_back(scene.addCapsule(placeAt<S>(-5), 0.1, 0.2));
      }
      for (int i = 0; i < others; ++i) scene.add(box, placeAt<S>(20 + i));
      const Managed<TypeParam> manager(scene, capsulesReported());
      auto pairs = selfPairs<S>(*manager);
      for (auto* object : touching) {
        const auto found = std::find_if(pairs.begin(), pairs.end(), [&](const auto& pair) {
          return std::minmax(pair.first, pair.second) == std::minmax(mesh, object);
        });
        ASSERT_TRUE(found != pairs.end()) << others;
        pairs.erase(found);
      }
      // A box counts by the box of the mesh, or by those of its triangles.
      for (const auto& pair : pairs) {
        EXPECT_EQ(std::minmax(pair.first, pair.second), std::minmax(mesh, within)) << others;
      }
      EXPECT_LE(pairs.size(), 1u);
    }
  }
}

// A mesh would count as it was before the update, as it is now, or where it has gone since.
TYPED_TEST(MeshReadings, AreOfTheFirstQueryAfterAnUpdate) {
  using S = typename TypeParam::Scalar;
  for (const bool asks_another : {false, true}) {
    Scene<S> scene;
    const auto model = ballOf<S>(1);
    auto* mesh = scene.add(model, placeAt<S>(0));
    Scene<S> fibers;
    (asks_another ? fibers : scene).addCapsule(placeAt<S>(2), 0.1, 0.2);
    const Managed<TypeParam> manager(scene, capsulesReported()), other(fibers, capsulesReported());
    const auto count = [&] {
      return asks_another ? pairsWith<S>(*other, *manager).size() : selfPairs<S>(*manager).size();
    };
    const auto scale = [&](double factor) {
      movePoints<S>(*model,
                    [&](const Eigen::Vector3d& p) -> Eigen::Vector3d { return factor * p; });
      mesh->computeAABB();
    };
    EXPECT_EQ(count(), 0u);
    scale(2);
    manager->update();
    EXPECT_EQ(count(), 1u);
    scale(0.5);
    EXPECT_EQ(count(), 1u);
    EXPECT_TRUE(manager->movedSinceUpdate());
    manager->update();
    EXPECT_FALSE(manager->movedSinceUpdate());
    EXPECT_EQ(count(), 0u);
    scale(2);
    manager->update();
    mesh->setTransform(placeAt<S>(100));
    EXPECT_TRUE(manager->movedSinceUpdate());
    EXPECT_EQ(count(), 1u);
  }
}

// A program may write the points of a model and leave FCL's boxes as they were. FCL's own trees
// miss what it touches then.
TYPED_TEST(MeshReadings, OfPointsThatChangeInPlaceReachWhereTheyAre) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  const auto model = ballOf<S>(1);
  scene.add(model, placeAt<S>(0));
  scene.addCapsule(placeAt<S>(2), 0.1, 0.2);
  const Managed<TypeParam> manager(scene, capsulesReported());
  EXPECT_TRUE(selfPairs<S>(*manager).empty());
  const std::size_t count = blob(1, 0, 24, 16).points.size();
  for (std::size_t i = 0; i < count; ++i) arraysOf(*model).points[i] *= 2;
  EXPECT_TRUE(manager->movedSinceUpdate());
  manager->update();
  EXPECT_FALSE(manager->movedSinceUpdate());
  EXPECT_EQ(selfPairs<S>(*manager).size(), 1u);
}

// An update looks at few points. Another one would count as it was, or where the object has gone.
TYPED_TEST(MeshReadings, OfAPointThatNoUpdateLooksAtAreThoseOfTheQuery) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  const auto model = ballOf<S>(1);
  auto* mesh = scene.add(model, placeAt<S>(0));
  fcl::Vector3<S>& spike = arraysOf(*model).points[1];
  const Eigen::Vector3d tip = 2 * spike.template cast<double>();
  scene.addCapsule(makePose<S>(Eigen::Quaterniond::Identity(), tip), 0.1, 0.2);
  const Managed<TypeParam> manager(scene, capsulesReported());
  EXPECT_TRUE(selfPairs<S>(*manager).empty());
  spike *= 2;
  model->computeLocalAABB();
  mesh->computeAABB();
  manager->update();
  mesh->setTransform(placeAt<S>(100));
  EXPECT_EQ(selfPairs<S>(*manager).size(), 1u);
  mesh->setTransform(placeAt<S>(0));
  spike /= 2;
  model->computeLocalAABB();
  mesh->computeAABB();
  manager->update();
  EXPECT_TRUE(selfPairs<S>(*manager).empty());
  EXPECT_FALSE(manager->movedSinceUpdate());
}

// An update of one object would change the triangles of others with its model, which it has not
// read.
TYPED_TEST(MeshReadings, OfOtherObjectsStayIfOneIsUpdated) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  const auto model = ballOf<S>(1);
  std::vector<fcl::CollisionObject<S>*> meshes;
  for (int i = 0; i < 6; ++i) {
    meshes.push_back(scene.add(model, placeAt<S>(10 * i)));
    scene.addCapsule(placeAt<S>(10 * i + 1), 0.1, 0.2);
  }
  const Managed<TypeParam> manager(scene, capsulesReported());
  manager->update();
  EXPECT_EQ(selfPairs<S>(*manager).size(), 6u);
  movePoints<S>(*model, [](const Eigen::Vector3d& p) -> Eigen::Vector3d { return 0.5 * p; });
  meshes[0]->computeAABB();
  manager->update(meshes[0]);
  EXPECT_EQ(selfPairs<S>(*manager).size(), 5u);
  for (auto* mesh : meshes) mesh->computeAABB();
  manager->update();
  EXPECT_TRUE(selfPairs<S>(*manager).empty());
}

// What a program has added to the boxes would be that of a box that it has written since, or lost.
TYPED_TEST(MeshReadings, HaveTheMarginsThatTheUpdateRead) {
  using S = typename TypeParam::Scalar;
  for (const auto& [is_even, is_broken] :
       {std::pair(true, false), {false, false}, {true, true}, {false, true}}) {
    Scene<S> scene;
    auto* mesh = scene.add(ballOf<S>(1), placeAt<S>(0));
    scene.addCapsule(placeAt<S>(1.15), 0.1, 0.2);
    const Managed<TypeParam> manager(scene, capsulesReported());
    EXPECT_TRUE(selfPairs<S>(*manager).empty());
    mesh->computeAABB();
    auto& box = const_cast<fcl::AABB<S>&>(mesh->getAABB());
    if (is_even) {
      box.expand(fcl::Vector3<S>::Constant(S(0.2)));
    } else {
      box.max_[0] += S(0.2);
    }
    manager->update();
    mesh->setTransform(placeAt<S>(is_broken ? std::numeric_limits<double>::quiet_NaN() : 100));
    mesh->computeAABB();
    EXPECT_EQ(selfPairs<S>(*manager).size(), 1u) << is_even << is_broken;
  }
}

// Of several threads that ask first after an update, two would read a mesh at once.
TYPED_TEST(MeshReadings, OfOneUpdateAreMadeOnceForAllThreads) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene, fibers;
  const auto model = ballOf<S>(1);
  for (int i = 0; i < 6; ++i) {
    scene.add(model, placeAt<S>(3 * i));
    scene.addCapsule(placeAt<S>(3 * i + 1), 0.1, 0.2);
    fibers.addCapsule(placeAt<S>(3 * i + 1.2), 0.1, 0.2);
  }
  const Managed<TypeParam> manager(scene, capsulesReported()), other(fibers, capsulesReported());
  const auto ask = [&] {
    return selfPairs<S>(*manager).size() + pairsWith<S>(*other, *manager).size();
  };
  for (const double factor : {1.2, 0.5, 2.0}) {
    movePoints<S>(*model, [&](const Eigen::Vector3d& p) -> Eigen::Vector3d { return factor * p; });
    manager->update();
    std::vector<std::size_t> found(4);
    std::vector<std::thread> threads;
    for (auto& count : found) threads.emplace_back([&] { count = ask(); });
    for (std::thread& thread : threads) thread.join();
    for (const std::size_t count : found) EXPECT_EQ(count, ask()) << factor;
  }
}

// An update would read each mesh that only moves, or keep the triangles of a model that is gone.
TYPED_TEST(MeshReadings, OfRigidMeshesAreMadeOnceForEachModel) {
  using S = typename TypeParam::Scalar;
  for (const bool is_rigid : {false, true}) {
    Scene<S> scene;
    const auto model = ballOf<S>(1);
    auto* mesh = scene.add(model, placeAt<S>(0));
    auto* capsule = scene.addCapsule(placeAt<S>(1), 0.1, 0.2);
    const Managed<TypeParam> manager({capsule}, capsulesReported());
    ObstacleOptions options;
    options.rigid = is_rigid;
    manager->registerObstacle(mesh, options);
    EXPECT_EQ(selfPairs<S>(*manager).size(), 1u);
    movePoints<S>(*model, [](const Eigen::Vector3d& p) -> Eigen::Vector3d { return 3 * p; });
    EXPECT_TRUE(manager->movedSinceUpdate());
    if (!is_rigid) mesh->computeAABB();
    manager->update();
    EXPECT_EQ(selfPairs<S>(*manager).size(), is_rigid ? 1u : 0u);
    mesh->setTransform(placeAt<S>(1.5));
    if (!is_rigid) mesh->computeAABB();
    manager->update();
    EXPECT_TRUE(selfPairs<S>(*manager).empty());
    *mesh = fcl::CollisionObject<S>(ballOf<S>(0.5), placeAt<S>(1.5));
    manager->update();
    EXPECT_EQ(selfPairs<S>(*manager).size(), 1u) << "of the model before";
  }
}

// All objects of one model would keep its first points, or all but the first of them would.
TYPED_TEST(MeshReadings, OfOneModelAreReadAgainForAllObjects) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  const auto model = ballOf<S>(1);
  for (const double x : {0, 10, 20}) {
    scene.add(model, placeAt<S>(x));
    scene.addCapsule(placeAt<S>(x + 2), 0.1, 0.2);
  }
  const Managed<TypeParam> manager(scene, capsulesReported());
  for (const std::size_t touching : {3u, 0u, 3u}) {
    const double factor = touching == 3 ? 2 : 0.5;
    movePoints<S>(*model, [&](const Eigen::Vector3d& p) -> Eigen::Vector3d { return factor * p; });
    manager->update();
    EXPECT_EQ(selfPairs<S>(*manager).size(), touching);
  }
}

TYPED_TEST(MeshReadings, OfBrokenArgumentsAreRefused) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  auto* mesh = scene.add(ballOf<S>(1), placeAt<S>(0));
  auto* capsule = scene.addCapsule(placeAt<S>(1), 0.1, 0.2);
  const Managed<TypeParam> manager(scene, capsulesReported());
  std::vector<MeshContact> contacts(7);
  for (const double margin : {-0.5, std::nan("")}) {
    expectRefusal([&] { manager->findMeshContacts(capsule, mesh, margin, contacts); },
                  "give 0 or more");
  }
  auto* box = scene.addBox({0, 0, 0}, Eigen::Quaterniond::Identity(), {1, 1, 1});
  const auto refused = [&](const auto* a, const auto* b, const char* text) {
    expectRefusal([&] { manager->findMeshContacts(a, b, 0, contacts); }, text);
  };
  const fcl::CollisionObject<S>* const none = nullptr;
  refused(none, mesh, "an object is null");
  refused(capsule, none, "an object is null");
  refused(box, mesh, "the capsule: it is neither a capsule nor a sphere");
  refused(mesh, mesh, "the capsule: it is neither a capsule nor a sphere");
  refused(capsule, box, "the second object is no mesh");
  refused(capsule, capsule, "the second object is no mesh");
  expectRefusal([&] { manager->margin(none); }, "null");
  mesh->setTransform(placeAt<S>(std::nan("")));
  expectRefusal([&] { manager->findMeshContacts(capsule, mesh, 0, contacts); },
                "the mesh: its pose is NaN");
  EXPECT_EQ(contacts.size(), 7u) << "a refused call has changed them";
}

// A program that stops at the first contact behind some triangle would miss others.
TYPED_TEST(MeshReadings, OfOneMeshAreInTheOrderOfItsTriangles) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  auto* mesh = scene.add(ballOf<S>(1), placeAt<S>(0));
  auto* capsule = scene.addCapsule(placeAt<S>(1), 0.3, 0.9);
  const Managed<TypeParam> manager(scene, capsulesReported());
  std::vector<MeshContact> contacts;
  EXPECT_TRUE(manager->findMeshContacts(capsule, mesh, 0.1, contacts));
  EXPECT_GT(contacts.size(), 20u);
  const auto ascends = [](const MeshContact& a, const MeshContact& b) {
    return a.triangle < b.triangle;
  };
  EXPECT_TRUE(std::is_sorted(contacts.begin(), contacts.end(), ascends));
}

// A cloud of points would have contacts of triangles that it does not have.
TEST(MeshReadingsOfClouds, AreNone) {
  using Config = FiberManagerConfig<LeafVolume::kBox, double, Topology::kBundle>;
  Scene<double> scene;
  auto* cloud = scene.add(makeCloud(blob(1, 0, 24, 16)), placeAt<double>(0));
  auto* capsule = scene.addCapsule(placeAt<double>(1), 0.3, 0.9);
  const Managed<Config> manager(scene, capsulesReported());
  std::vector<MeshContact> contacts(3);
  EXPECT_FALSE(manager->findMeshContacts(capsule, cloud, 1, contacts));
  EXPECT_TRUE(contacts.empty());
}

// An object would be read as a mesh that it is no more, or be lost.
TYPED_TEST(MeshReadings, AreRefusedIfAnObjectBecomesAMeshOrCeasesToBeOne) {
  using S = typename TypeParam::Scalar;
  using Object = fcl::CollisionObject<S>;
  Scene<S> scene;
  auto* object = scene.addSphere({1, 0, 0}, 0.5);
  for (int i = 0; i < 9; ++i) scene.addCapsule(placeAt<S>(1 + i), 0.1, 0.2);
  const Object sphere(*object), mesh(ballOf<S>(1), placeAt<S>(0));
  for (const bool becomes_mesh : {true, false}) {
    const Object &before = becomes_mesh ? sphere : mesh, &after = becomes_mesh ? mesh : sphere;
    *object = before;
    Managed<TypeParam> manager(scene, capsulesReported());
    EXPECT_TRUE(manager.answersSelf());
    *object = after;
    EXPECT_TRUE(manager->movedSinceUpdate());
    const char* text = becomes_mesh ? "has become a mesh" : "is no mesh any more";
    expectRefusal([&] { manager->update(object); }, text);
    expectRefusal([&] { manager->update(); }, text);
    manager.unregister(0);
    manager.registerObject(object);
    manager->update();
    EXPECT_TRUE(manager.answersSelf());
  }
}

// A mesh whose coordinates overflow would touch all fibers.
TEST(MeshReadingsOfAnySize, AreRefusedIfTheyOverflow) {
  using Config = FiberManagerConfig<LeafVolume::kBox, double, Topology::kBundle>;
  for (const double size : {1e200, 1e300}) {
    Scene<double> scene;
    scene.addCapsule(placeAt<double>(1), 0.1, 0.2);
    auto* mesh = scene.add(ballOf<double>(size), placeAt<double>(0));
    Managed<Config> manager(capsulesReported());
    manager.registerObject(scene[0]);
    if (size < 1e250) {
      manager.registerObject(mesh);
      EXPECT_TRUE(manager.answersSelf(0));
      continue;
    }
    expectRefusal([&] { pairsWith<double>(*manager, *mesh); }, "its coordinates overflow");
    manager->registerObject(mesh);
    expectRefusal([&] { selfPairs<double>(*manager); }, "object 1 in order of registration: its");
    manager->unregisterObject(mesh);
    EXPECT_TRUE(manager.answersSelf(0));
  }
}

// A distance query would pass over what is inside a solid, or what is within a mesh's own margin.
TYPED_TEST(MeshReadings, AreNearWhereTheyCount) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  auto* head = scene.add(ballOf<S>(3), placeAt<S>(0));
  auto* inside = scene.addCapsule(placeAt<S>(0), 0.1, 0.2);
  auto* near = scene.addCapsule(placeAt<S>(4), 0.1, 0.2);
  auto* far = scene.addCapsule(placeAt<S>(9), 0.1, 0.2);
  head->computeAABB();
  grow(aabbOf(*head), 0.8);
  // What the callback gets once the distance is this.
  struct Record {
    Calls<S> calls;
    S least;
    static bool visit(fcl::CollisionObject<S>* a, fcl::CollisionObject<S>* b, void* data, S& dist) {
      auto& self = *static_cast<Record*>(data);
      self.calls.emplace_back(a, b);
      dist = self.least;
      return false;
    }
    bool has(const fcl::CollisionObject<S>* object) const {
      return std::any_of(calls.begin(), calls.end(), [&](const auto& call) {
        return call.first == object || call.second == object;
      });
    }
  };
  auto manager = TypeParam::make(capsulesReported()), heads = TypeParam::make(capsulesReported()),
       hair = TypeParam::make(capsulesReported());
  for (auto* its : {manager.get(), heads.get()}) its->registerObstacle(head, {/*solid=*/true});
  for (auto* its : {manager.get(), hair.get()}) {
    its->registerFiber({far, near, inside}, FiberEnds::kOpen, FiberGroup{1});
  }
  const auto expect = [&](auto&& run) {
    Record record{{}, S(0.4)};
    run(record);
    EXPECT_TRUE(record.has(inside));
    EXPECT_TRUE(record.has(near));
    EXPECT_LE(record.calls.size(), 3u);
  };
  expect([&](Record& record) { manager->distance(&record, &Record::visit); });
  expect([&](Record& record) { manager->distance(head, &record, &Record::visit); });
  expect([&](Record& record) { heads->distance(hair.get(), &record, &Record::visit); });
  expect([&](Record& record) { hair->distance(heads.get(), &record, &Record::visit); });
  for (auto* object : {inside, near}) {
    Record record{{}, S(0.4)};
    heads->distance(object, &record, &Record::visit);
    EXPECT_EQ(record.calls.size(), 1u);
  }
  Record none{{}, S(0)};
  manager->distance(&none, &Record::visit);
  EXPECT_EQ(none.calls.size(), 1u);
}

}  // namespace
}  // namespace fcl_fibers::test
