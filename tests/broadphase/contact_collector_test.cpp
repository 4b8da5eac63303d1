// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/contact_collector.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/triangle_p.h>
#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/least_box.h"
#include "support/managed.h"
#include "support/mesh_models.h"
#include "support/scalars.h"
#include "support/scene.h"
#include "support/text_of.h"

namespace fcl_fibers {
namespace {

using test::Point;
using test::Random;
using test::Real;
using test::Scene;

Point toPoint(const std::array<double, 3>& v) { return Point(v[0], v[1], v[2]); }

/// That the contact is where these two touch; far from the origin too, where 1e-13 of the objects'
/// size is less than the rounding of a coordinate. The points are in world coordinates.
template <typename S>
void expectRight(const fcl::CollisionObject<S>& a, const fcl::CollisionObject<S>& b,
                 const Contact& contact, Real coordinates) {
  EXPECT_LE(std::fabs(contact.distance - test::exactGap(a, b)), 1e-13L);
  const test::ExactCapsule p = test::exactCapsule(a), q = test::exactCapsule(b);
  const Point normal = toPoint(contact.normal);
  const Real rounding = 1e-13L + 4e-16L * coordinates;
  EXPECT_LE(
      (p.a + Real(contact.s) * (p.b - p.a) + p.radius * normal - toPoint(contact.point_a)).norm(),
      rounding);
  EXPECT_LE(
      (q.a + Real(contact.t) * (q.b - q.a) - q.radius * normal - toPoint(contact.point_b)).norm(),
      rounding);
  const Point apart = toPoint(contact.point_b) - toPoint(contact.point_a);
  EXPECT_LE(std::fabs(apart.dot(normal) - contact.distance), 2 * rounding);
}

template <typename S>
class ObjectContacts : public testing::Test {};
TYPED_TEST_SUITE(ObjectContacts, test::Scalars, );

TYPED_TEST(ObjectContacts, AreWhereCapsulesAndSpheresTouch) {
  // If this fails, objects are read at another pose, or lose digits far from the origin.
  Random random(1);
  for (const double far : {0.0, 1e3, 1e6}) {
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector3d place(far, -far, far);
      Scene<TypeParam> scene;
      const auto add = [&](bool is_sphere) {
        const Eigen::Vector3d p = place + random.inCube(1), q = p + random.inCube(1);
        is_sphere ? scene.addSphere(p, 0.2) : scene.addCapsule(p, q, random.unit());
      };
      add(i % 3 == 0);
      add(i % 5 == 0);
      expectRight(*scene[0], *scene[1], capsuleContact(*scene[0], *scene[1]), 2 * far + 4);
      if (this->HasFailure()) FAIL() << "case " << i << " at " << far;
    }
  }
}

TYPED_TEST(ObjectContacts, RefuseOtherShapesAndBrokenPoses) {
  // If this fails, a box is taken for a capsule, or a NaN becomes a contact.
  Scene<TypeParam> scene;
  const auto* capsule = scene.addCapsule({0, 0, 0}, {1, 0, 0}, 0.1);
  auto* box = scene.addBox({0, 0, 0}, Eigen::Quaterniond::Identity(), {1, 1, 1});
  const auto* convex = scene.addConvex({0, 0, 0}, 1);
  auto* broken = scene.addSphere({0, 0, 0}, 0.1);
  EXPECT_TRUE(hasCapsuleContact(*capsule, *box) && hasCapsuleContact(*box, *capsule));
  EXPECT_FALSE(hasCapsuleContact(*box, *box) || hasCapsuleContact(*capsule, *convex));
  const auto refuse = [&](const auto& bad, const std::string& text) {
    test::expectRefusal([&] { capsuleContact(*capsule, bad); }, "object b: " + text);
    test::expectRefusal([&] { capsuleContact(bad, *capsule); }, "object a: " + text);
  };
  refuse(*convex, "it is neither a capsule nor a sphere; pass it to fcl::collide");
  test::expectRefusal([&] { capsuleContact(*box, *box); }, "object a: it is neither a capsule");
  for (auto* bad : {broken, box}) {
    bad->setTranslation({std::numeric_limits<TypeParam>::quiet_NaN(), 0, 0});
    refuse(*bad, "its pose is NaN or infinite");
  }
  auto* halfspace = scene.addHalfspace({0, 0, 1}, 0);
  const_cast<fcl::Halfspace<TypeParam>&>(
      static_cast<const fcl::Halfspace<TypeParam>&>(*halfspace->collisionGeometry()))
      .d = std::numeric_limits<TypeParam>::infinity();
  refuse(*halfspace, "a coordinate or size is NaN or beyond 2^1000");
}

/// A box, a plane, a half-space or a triangle near a place.
template <typename S>
fcl::CollisionObject<S>* addShape(Scene<S>& scene, Random& random, const Eigen::Vector3d& place,
                                  std::size_t kind) {
  const Eigen::Quaterniond turn = random.rotation();
  const Eigen::Vector3d at = place + random.inCube(0.5);
  const auto vector = [](const Eigen::Vector3d& v) { return fcl::Vector3<S>(v.cast<S>()); };
  std::shared_ptr<fcl::CollisionGeometry<S>> shape;
  if (kind == 0) {
    const Eigen::Vector3d sides = random.inCube(1).cwiseAbs();
    return scene.addBox(at, turn, sides);
  } else if (kind == 1) {
    shape = std::make_shared<fcl::Plane<S>>(vector(random.direction()), S(0.1));
  } else if (kind == 2) {
    shape = std::make_shared<fcl::Halfspace<S>>(vector(random.direction()), S(0.1));
  } else {
    const Eigen::Vector3d a = random.inCube(1), b = random.inCube(1), c = random.inCube(1);
    shape = std::make_shared<fcl::TriangleP<S>>(vector(a), vector(b), vector(c));
  }
  return scene.add(shape, test::makePose<S>(turn, at));
}

/// That the first, a capsule, touches the second where the contact says.
template <typename S>
void expectRightOnShape(const fcl::CollisionObject<S>& capsule,
                        const fcl::CollisionObject<S>& shape, const Contact& contact,
                        Real coordinates) {
  const test::ExactCapsule p = test::exactCapsule(capsule);
  const auto distanceOf = test::distanceFrom(shape);
  const Point normal = toPoint(contact.normal), a = toPoint(contact.point_a),
              b = toPoint(contact.point_b);
  // The objects have a size of a few units.
  const Real rounding = 1e-13L + 1e-15L * coordinates;
  EXPECT_LE(std::fabs(normal.norm() - 1), 1e-15L);
  EXPECT_LE((p.a + Real(contact.s) * (p.b - p.a) + p.radius * normal - a).norm(), rounding);
  EXPECT_LE(distanceOf(b, b), rounding);
  const Real axis = distanceOf(p.a, p.b);
  if (axis > rounding) {
    EXPECT_LE(std::fabs(contact.distance + p.radius - axis), rounding);
  } else {
    EXPECT_LE(contact.distance, -p.radius + rounding);
  }
  const bool crosses_triangle = axis <= rounding && shape.getNodeType() == fcl::GEOM_TRIANGLE;
  if (!crosses_triangle) {
    EXPECT_LE((b - a - Real(contact.distance) * normal).norm(), 2 * rounding);
  }
  // The way out leads to contact, or off the plane of a triangle.
  if (contact.distance >= 0) return;
  const Point out = Real(contact.distance) * normal;
  const Real after = distanceOf(p.a + out, p.b + out) - p.radius;
  EXPECT_GE(after, -4 * rounding);
  EXPECT_TRUE(after <= 4 * rounding || crosses_triangle) << after;
}

TYPED_TEST(ObjectContacts, AreWhereCapsulesTouchOtherShapes) {
  // If this fails, a shape is read at another pose, its depth is not that of the way out, or digits
  // are lost far from the origin.
  Random random(2);
  for (const double far : {0.0, 1e3, 1e6}) {
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector3d place(far, -far, far);
      Scene<TypeParam> scene;
      const Eigen::Vector3d p = place + random.inCube(1), q = p + random.inCube(1);
      const auto* capsule = i % 5 == 0 ? scene.addSphere(p, random.unit())
                                       : scene.addCapsule(p, q, 0.2 * random.unit());
      const auto* shape = addShape(scene, random, place, random.below(4));
      const Contact contact = capsuleContact(*capsule, *shape);
      expectRightOnShape(*capsule, *shape, contact, 2 * far + 4);
      EXPECT_EQ(contact.t, 0);
      EXPECT_EQ(contact.a.fiber, kNoFiber);
      const Contact turned = capsuleContact(*shape, *capsule);
      EXPECT_EQ(turned.s, 0);
      EXPECT_EQ(turned.t, contact.s);
      EXPECT_EQ(turned.distance, contact.distance);
      EXPECT_EQ(turned.point_a, contact.point_b);
      EXPECT_EQ(turned.point_b, contact.point_a);
      EXPECT_EQ(toPoint(turned.normal), -toPoint(contact.normal));
      if (this->HasFailure()) FAIL() << "case " << i << " at " << far;
    }
  }
}

TYPED_TEST(ObjectContacts, OfACapsuleFlatInABoxAreOnBothSurfaces) {
  // If this fails, a rod on a table is pushed out too far or not enough, or at one end.
  Scene<TypeParam> scene;
  const auto* table = scene.addBox({0, 0, -0.5}, Eigen::Quaterniond::Identity(), {2, 2, 1});
  const auto* rod = scene.addCapsule({-0.25, 0, -0.0078125}, {0.25, 0, -0.0078125}, 0.015625);
  const Contact contact = capsuleContact(*rod, *table);
  EXPECT_EQ(contact.distance, -0.0234375);
  EXPECT_NEAR(contact.point_a[2], -0.0234375, 1e-9);
  EXPECT_NEAR(contact.point_b[2], 0, 1e-9);
  EXPECT_NEAR(contact.normal[2], -1, 1e-9);
  EXPECT_NEAR(contact.s, 0.5, 1e-9);
}

/// Curled fibers about one place, some as thick as they are apart, and loose spheres.
template <typename S>
Scene<S> fibersAndSpheres(std::uint64_t seed) {
  Random random(seed);
  Scene<S> scene;
  for (int f = 0; f < 20; ++f) {
    std::vector<Eigen::Vector3d> points{random.inCube(0.5)};
    for (int i = 0; i < 12; ++i) points.push_back(points.back() + random.inCube(0.2));
    scene.addFiber(points, 0.03 * random.unit());
  }
  for (int i = 0; i < 10; ++i) scene.addSphere(random.inCube(0.5), 0.1);
  return scene;
}

FiberManagerOptions optionsOf(Report report, double margin) {
  FiberManagerOptions options;
  options.report = report;
  options.margin = margin;
  options.ignored_neighbors = 1;
  return options;
}

/// That the contacts are those of the capsules that touch, and each is right.
template <typename Config, typename S>
void expectTouching(const test::Managed<Config>& manager, const test::QueryPartner<S>& partner,
                    const ContactCollector<S>& collector) {
  test::Calls<S> pairs;
  for (const auto& contact : collector.contacts()) {
    pairs.emplace_back(contact.object_a, contact.object_b);
    expectRight(*contact.object_a, *contact.object_b, contact, 4);
  }
  EXPECT_TRUE(manager.areTouching(pairs, partner, 50));
}

// Of floats, FCL's narrow phase is compiled here, for half a minute: where time allows.
#if defined(FCL_FIBERS_ALL_MANAGERS) || defined(FCL_FIBERS_OTHER_MANAGERS)
using ManagersWithContacts = test::FiberManagers;
#else
using ManagersWithContacts = testing::Types<test::LayeredAabb<double, Topology::kSuperThread>,
                                            test::WrappedSphere<double, Topology::kBundle>>;
#endif
MANAGER_SUITE(Contacts, ManagersWithContacts);

TYPED_TEST(Contacts, AreOfEachTouchingPair) {
  // If this fails, contacts are missing, come without touching, or name other segments.
  const auto scene = fibersAndSpheres<typename TypeParam::Scalar>(1);
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    for (const double margin : {0.0, 0.01}) {
      test::Managed<TypeParam> manager(optionsOf(report, margin));
      manager.registerFibers(scene);
      ContactCollector<typename TypeParam::Scalar> collector(*manager);
      manager->collide(&collector, collector.callback);
      expectTouching<TypeParam, typename TypeParam::Scalar>(manager, {}, collector);
      for (const auto& contact : collector.contacts()) {
        const FiberSegment a = manager->fiberSegment(contact.object_a);
        const FiberSegment b = manager->fiberSegment(contact.object_b);
        EXPECT_TRUE(contact.a.fiber == a.fiber && contact.a.number == a.number);
        EXPECT_TRUE(contact.b.fiber == b.fiber && contact.b.number == b.number);
      }
      collector.clear();
      EXPECT_TRUE(collector.contacts().empty());
    }
  }
}

TYPED_TEST(Contacts, NumberTheOtherManagersSegmentsByThatManager) {
  // If this fails, a query of two managers looks up an object in the wrong one, and throws.
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = fibersAndSpheres<S>(1), others = fibersAndSpheres<S>(2);
  test::Managed<TypeParam> manager, other;
  manager.registerFibers(scene);
  other.registerFibers(others);
  ContactCollector<S> collector(*manager, &*other);
  manager->collide(&*other, &collector, collector.callback);
  expectTouching<TypeParam, S>(manager, other, collector);
  for (const auto& contact : collector.contacts()) {
    const FiberSegment b = other->fiberSegment(contact.object_b);
    EXPECT_TRUE(contact.b.fiber == b.fiber && contact.b.number == b.number);
  }
}

TYPED_TEST(Contacts, LookForTheSecondObjectInBothManagers) {
  // If this fails, what has a fiber is said to have none, or has the numbers of another manager.
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = fibersAndSpheres<S>(1), others = fibersAndSpheres<S>(2);
  test::Managed<TypeParam> manager, other;
  manager.registerFibers(scene);
  other.registerFibers(others);
  // One of both.
  auto* const shared = others[30];
  manager->registerObject(shared);
  for (const auto* partner : {&other, static_cast<decltype(&other)>(nullptr)}) {
    const FiberCollisionManager<S>* const second = partner == nullptr ? nullptr : &**partner;
    ContactCollector<S> self(*manager, second), all(*manager, second);
    manager->collide(&self, self.callback);
    ASSERT_FALSE(self.contacts().empty());
    for (const auto& contact : self.contacts()) {
      const bool is_others = second != nullptr && contact.object_b == shared;
      const FiberSegment b = (is_others ? *other : *manager).fiberSegment(contact.object_b);
      EXPECT_TRUE(contact.b.fiber == b.fiber && contact.b.number == b.number);
    }
    for (auto* object : others.objects()) manager->collide(object, &all, all.callback);
    ASSERT_GT(all.contacts().size(), 50u);
    for (const auto& contact : all.contacts()) {
      const bool is_here = second == nullptr && contact.object_b == shared;
      const FiberSegment b = second != nullptr ? other->fiberSegment(contact.object_b)
                             : is_here         ? manager->fiberSegment(shared)
                                               : FiberSegment();
      EXPECT_TRUE(contact.b.fiber == b.fiber && contact.b.number == b.number);
    }
  }
}

TYPED_TEST(Contacts, AreCollectedFromEveryQueryOfTheManager) {
  // If this fails, a collector ends the query of one object, or of FCL's manager, by an exception.
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = fibersAndSpheres<S>(1), others = fibersAndSpheres<S>(2);
  test::Managed<TypeParam> manager, other;
  manager.registerFibers(scene);
  other.registerFibers(others);
  test::ForeignManager<S> foreign(others.objects());
  ContactCollector<S> collector(*manager);
  manager->collide(&*other, &collector, collector.callback);
  const std::size_t count = collector.contacts().size();
  EXPECT_GT(count, 50u);
  manager->collide(&foreign, &collector, collector.callback);
  EXPECT_EQ(collector.contacts().size(), 2 * count);
  for (auto* object : others.objects()) manager->collide(object, &collector, collector.callback);
  EXPECT_EQ(collector.contacts().size(), 3 * count);
  for (const auto& contact : collector.contacts()) {
    EXPECT_EQ(contact.a.fiber, manager->fiberSegment(contact.object_a).fiber);
    EXPECT_EQ(contact.b.fiber, kNoFiber);
  }
  collector.clear();
  manager->collide(scene[30], &collector, collector.callback);
  ASSERT_FALSE(collector.contacts().empty());
  EXPECT_EQ(collector.contacts()[0].b.fiber, manager->fiberSegment(scene[30]).fiber);
  EXPECT_EQ(collector.contacts()[0].b.number, manager->fiberSegment(scene[30]).number);
  test::expectRefusal([&] { other->collide(&collector, collector.callback); },
                      "construct the collector with");
}

TYPED_TEST(Contacts, AreWithinTheMarginsThatAProgramHasAddedToBoxes) {
  // If this fails, a program that looks ahead gets pairs and no contacts, or contacts with all.
  using S = typename TypeParam::Scalar;
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    for (const double added : {0.04, 0.06}) {
      FiberManagerOptions options;
      options.report = report;
      // Slanted, so that their boxes meet at any margin, and 0.11 apart.
      Scene<S> scene, other;
      const Eigen::Vector3d along(1, 1, 1), across = Eigen::Vector3d(1, -1, 0).normalized();
      scene.addCapsule({0, 0, 0}, along, 0.1);
      other.addCapsule(0.31 * across, along + 0.31 * across, 0.1);
      for (auto* object : {scene[0], other[0]}) {
        test::widenShape(*object, added);
      }
      const std::size_t expected = added < 0.05 ? 0 : 1;
      const auto both = TypeParam::make(options), first = TypeParam::make(options),
                 second = TypeParam::make(options);
      both->registerObjects({scene[0], other[0]});
      first->registerObject(scene[0]);
      second->registerObject(other[0]);
      ContactCollector<S> self(*both), one(*first), two(*first, second.get());
      both->collide(&self, self.callback);
      first->collide(other[0], &one, one.callback);
      first->collide(second.get(), &two, two.callback);
      for (const auto* collector : {&self, &one, &two}) {
        ASSERT_EQ(collector->contacts().size(), expected);
        if (expected == 1) {
          EXPECT_NEAR(collector->contacts()[0].distance, 0.11, 1e-6);
        }
      }
    }
  }
}

TYPED_TEST(Contacts, WithShapesAreOfEachPairWithinTheMargins) {
  // If this fails, a pair with a table or a floor is reported without a contact, or has one that is
  // beyond the margin, the wrong way round or of another place.
  using S = typename TypeParam::Scalar;
  enum class Way { kRegisteredFirst, kRegisteredLast, kForeign, kOther };
  // FCL knows nothing of two shapes if one is a triangle, and says so.
  const auto ofBoth = [](auto* a, auto* b, void* collector) {
    return isCapsule(*a) != isCapsule(*b) && ContactCollector<S>::callback(a, b, collector);
  };
  Random random(952);
  std::size_t within_margin = 0, overlapping = 0;
  for (int round = 0; round < 64; ++round) {
    SCOPED_TRACE(round);
    const auto way = static_cast<Way>(round % 4);
    const Report report = round / 4 % 2 == 0 ? Report::kVolumes : Report::kCapsules;
    const auto options = optionsOf(report, round / 8 % 2 == 0 ? 0 : 0.05);
    Scene<S> scene, shapes;
    for (int i = 0; i < 30; ++i) {
      const Eigen::Vector3d from = random.inCube(0.8);
      i % 6 == 0 ? scene.addSphere(from, 0.1 * random.unit())
                 : scene.addCapsule(from, from + random.inCube(0.3), 0.05);
    }
    for (std::size_t i = 0; i < 6; ++i) addShape(shapes, random, {0, 0, 0}, i % 4);
    if (round % 3 == 0) {
      for (const std::size_t i : {1u, 7u, 12u}) test::widenShape(*scene[i], 0.03);
      test::widenShape(*shapes[0], 0.04);
    }
    const auto manager = TypeParam::make(options), other = TypeParam::make(optionsOf(report, 0));
    other->registerObjects(shapes.objects());
    if (way == Way::kRegisteredFirst) manager->registerObjects(shapes.objects());
    for (auto* object : scene.objects()) {
      object->getNodeType() == fcl::GEOM_CAPSULE
          ? manager->registerFiber({object}, FiberEnds::kOpen, {1})
          : manager->registerObject(object);
    }
    if (way == Way::kRegisteredLast) manager->registerObjects(shapes.objects());
    ContactCollector<S> collector(*manager, way == Way::kOther ? other.get() : nullptr);
    if (way == Way::kForeign) {
      for (auto* shape : shapes.objects()) manager->collide(shape, &collector, ofBoth);
    } else if (way == Way::kOther) {
      manager->collide(other.get(), &collector, ofBoth);
    } else {
      manager->collide(&collector, ofBoth);
    }

    std::map<std::pair<fcl::CollisionObject<S>*, fcl::CollisionObject<S>*>, Contact> found;
    const bool is_first = way == Way::kRegisteredFirst;
    for (const auto& contact : collector.contacts()) {
      auto *capsule = contact.object_a, *shape = contact.object_b;
      Contact seen = contact;
      if (is_first) {
        std::swap(capsule, shape);
        std::swap(seen.s, seen.t);
        std::swap(seen.point_a, seen.point_b);
        for (double& x : seen.normal) x = -x;
      }
      ASSERT_TRUE(hasCapsuleContact(*capsule, *shape) && isCapsule(*capsule));
      EXPECT_EQ((is_first ? contact.b : contact.a).fiber, manager->fiberSegment(capsule).fiber);
      EXPECT_TRUE(found.emplace(std::pair(capsule, shape), seen).second);
      expectRightOnShape(*capsule, *shape, seen, 4);
    }
    for (auto* shape : shapes.objects()) {
      const auto distanceOf = test::distanceFrom(*shape);
      const double its = (way == Way::kOther ? other : manager)->margin(shape);
      for (auto* capsule : scene.objects()) {
        const test::ExactCapsule c = test::exactCapsule(*capsule);
        const Real reach = Real(options.margin) + Real(manager->margin(capsule)) + Real(its);
        const Real distance = distanceOf(c.a, c.b) - c.radius;
        if (std::fabs(distance - reach) < 1e-9L) continue;
        EXPECT_EQ(found.count({capsule, shape}), distance < reach ? 1u : 0u) << distance;
        overlapping += distance < 0 ? 1 : 0;
        within_margin += distance >= 0 && distance < reach ? 1 : 0;
      }
    }
    if (this->HasFailure()) return;
  }
  EXPECT_GT(overlapping, 1000u);
  EXPECT_GT(within_margin, 100u);
}

TYPED_TEST(Contacts, WithOtherShapesAreFclsWithTheNormalFromAToB) {
  // If this fails, contacts with a head or a table push the wrong way, or are lost: FCL exchanges a
  // shape and a mesh.
  using S = typename TypeParam::Scalar;
  struct Row {
    const char* name;
    bool is_mesh;
    bool is_first;  // the other shape, in the pair
  };
  for (const Row& row :
       {Row{"cylinder, capsule", false, true}, Row{"capsule, cylinder", false, false},
        Row{"mesh, capsule", true, true}, Row{"capsule, mesh", true, false}}) {
    if (row.is_mesh && std::is_same_v<S, float>) continue;  // there are none, see Scene::addMesh
    SCOPED_TRACE(row.name);
    Scene<S> scene;
    // Below the face z = 0 of a cylinder, or a face x + y + z = 1 of an octahedron.
    const Eigen::Vector3d outward =
        row.is_mesh ? Eigen::Vector3d(1, 1, 1).normalized() : Eigen::Vector3d(0, 0, 1);
    const Eigen::Vector3d face =
        row.is_mesh ? Eigen::Vector3d(1, 1, 1) / 3 : Eigen::Vector3d(0, 0, 0);
    auto* shape = row.is_mesh ? scene.addMesh({0, 0, 0}, 1)
                              : scene.add(std::make_shared<fcl::Cylinder<S>>(S(1), S(2)),
                                          test::makePose<S>(Eigen::Quaterniond::Identity(),
                                                            Eigen::Vector3d(0, 0, -1)));
    // Stands on the face, its lower end's surface 0.02 deep.
    auto* capsule = scene.addCapsule(face + 0.08 * outward, face + 0.58 * outward, 0.1);
    auto* away = scene.addCapsule({3, 3, 3}, {3, 3, 4}, 0.1);

    const auto manager = TypeParam::make();
    if (row.is_first) manager->registerObject(shape);
    manager->registerFiber({capsule});
    if (!row.is_first) manager->registerObject(shape);
    manager->registerFiber({away});
    ContactCollector<S> collector(*manager);
    manager->collide(&collector, collector.callback);

    ASSERT_FALSE(collector.contacts().empty());
    for (const auto& contact : collector.contacts()) {
      EXPECT_EQ(contact.object_a, row.is_first ? shape : capsule);
      EXPECT_EQ(contact.object_b, row.is_first ? capsule : shape);
      const Point from_shape = (row.is_first ? 1 : -1) * toPoint(contact.normal);
      EXPECT_GT(from_shape.dot(outward.cast<Real>()), 0.99L);
      // FCL finds depths by iteration, to 1e-6 by default.
      EXPECT_NEAR(contact.distance, -0.02, 1e-4);
      EXPECT_NEAR(row.is_first ? contact.t : contact.s, 0, 1e-3);
      EXPECT_EQ(row.is_first ? contact.s : contact.t, 0);
      const Point apart = toPoint(contact.point_b) - toPoint(contact.point_a);
      EXPECT_LE(std::fabs(apart.dot(toPoint(contact.normal)) - contact.distance),
                64 * std::numeric_limits<S>::epsilon());
      EXPECT_EQ(contact.a.fiber, 0u);
      EXPECT_EQ(contact.b.fiber, 1u);
    }
  }
}

TYPED_TEST(Contacts, AreAsManyAsTheRequestAdmits) {
  // If this fails, a program gets more contacts of a box than it has room for, or fewer of hair.
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  const auto upright = Eigen::Quaterniond::Identity();
  auto* table = scene.addBox({0, 0, -1}, upright, {2, 2, 2});
  scene.addBox({0, 0, 0.49}, upright, {1, 1, 1});
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  Scene<S> hair;
  auto* head = hair.add(test::makeModel<S>(fcl::BV_OBBRSS, test::blob(0.6, 0.2, 12, 9)),
                        test::makePose<S>(upright, {0, 0, 0}));
  hair.addCapsule({-1, 0, 0.5}, {1, 0, 0.5}, 0.1);
  const auto boxes = TypeParam::make(options), at_head = TypeParam::make(options);
  boxes->registerObjects(scene.objects());
  at_head->registerObjects(hair.objects());
  std::size_t of_triangles = 0;
  for (const std::size_t most : {std::size_t{16}, std::size_t{1}, std::size_t{3}}) {
    ContactCollector<S> collector(*boxes), of_head(*at_head);
    EXPECT_EQ(collector.request.num_max_contacts, 16u);
    EXPECT_TRUE(collector.request.enable_contact);
    collector.request.num_max_contacts = of_head.request.num_max_contacts = most;
    boxes->collide(&collector, collector.callback);
    EXPECT_EQ(collector.contacts().size(), most == 16 ? 4 : most);  // the corners of a face
    for (const auto& contact : collector.contacts()) EXPECT_EQ(contact.object_a, table);
    at_head->collide(&of_head, of_head.callback);
    if (most == 16) of_triangles = of_head.contacts().size();
    EXPECT_EQ(of_head.contacts().size(), of_triangles);
    for (const auto& contact : of_head.contacts()) EXPECT_EQ(contact.object_a, head);
  }
  EXPECT_GT(of_triangles, 3u);
}

TYPED_TEST(Contacts, WithAMeshAreThoseOfItsTriangles) {
  // If this fails, hair sinks into its head, or is pushed to the wrong side.
  using S = typename TypeParam::Scalar;
  Scene<S> scene, heads;
  Random random(951);
  for (int i = 0; i < 150; ++i) {
    const Eigen::Vector3d from = random.inCube(0.8);
    scene.addCapsule(from, from + random.inCube(0.3), 0.04);
  }
  const auto model = test::makeModel<S>(fcl::BV_OBBRSS, test::blob(0.6, 0.2, 12, 9));
  auto* head = heads.add(model, test::makePose<S>(random.rotation(), Eigen::Vector3d(0.1, 0.2, 0)));
  const std::vector<test::ExactTriangle> triangles = test::trianglesOf(*head);
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  options.margin = 0.02;
  std::size_t expected = 0;
  for (auto* object : scene.objects()) {
    const test::ExactCapsule c = test::exactCapsule(*object);
    for (const auto& t : triangles) {
      expected += test::segmentTriangleDistance(c.a, c.b, t) <= c.radius + 0.02L ? 1 : 0;
    }
  }
  EXPECT_GT(expected, 100u);
  enum class Way { kRegisteredFirst, kRegisteredLast, kForeign, kOther, kOtherByVolumes };
  for (const Way way : {Way::kRegisteredFirst, Way::kRegisteredLast, Way::kForeign, Way::kOther,
                        Way::kOtherByVolumes}) {
    SCOPED_TRACE(static_cast<int>(way));
    const auto manager = TypeParam::make(options);
    FiberManagerOptions its_options;
    its_options.report = way == Way::kOther ? Report::kCapsules : Report::kVolumes;
    const auto other = TypeParam::make(its_options);
    other->registerObject(head);
    if (way == Way::kRegisteredFirst) manager->registerObject(head);
    for (auto* object : scene.objects()) manager->registerFiber({object}, FiberEnds::kOpen, {1});
    if (way == Way::kRegisteredLast) manager->registerObject(head);
    ContactCollector<S> collector(*manager, other.get());
    if (way == Way::kForeign) {
      manager->collide(head, &collector, collector.callback);
    } else if (way == Way::kOther || way == Way::kOtherByVolumes) {
      manager->collide(other.get(), &collector, collector.callback);
    } else {
      manager->collide(&collector, collector.callback);
    }
    EXPECT_EQ(collector.contacts().size(), expected);
    for (const auto& contact : collector.contacts()) {
      const bool is_first = way == Way::kRegisteredFirst;
      EXPECT_EQ(is_first ? contact.object_a : contact.object_b, head);
      const auto* capsule = is_first ? contact.object_b : contact.object_a;
      const test::ExactCapsule c = test::exactCapsule(*capsule);
      ASSERT_LT(static_cast<std::size_t>(contact.triangle), triangles.size());
      const test::ExactTriangle& t = triangles[static_cast<std::size_t>(contact.triangle)];
      const Point on_mesh = Real(contact.weights[0]) * t.a + Real(contact.weights[1]) * t.b +
                            Real(contact.weights[2]) * t.c;
      const Point on_axis = c.a + Real(is_first ? contact.t : contact.s) * (c.b - c.a);
      const Point to_mesh = (is_first ? -1 : 1) * toPoint(contact.normal);
      const Real distance = test::segmentTriangleDistance(c.a, c.b, t);
      constexpr Real kRounding = 1e-13L;
      EXPECT_LE((toPoint(is_first ? contact.point_a : contact.point_b) - on_mesh).norm(),
                kRounding);
      EXPECT_LE(
          (toPoint(is_first ? contact.point_b : contact.point_a) - (on_axis + c.radius * to_mesh))
              .norm(),
          kRounding);
      EXPECT_LE(std::fabs((on_mesh - on_axis).norm() - distance), kRounding);
      if (distance > kRounding) {
        EXPECT_LE(std::fabs(contact.distance + c.radius - distance), kRounding);
      }
      EXPECT_FALSE(contact.solid);
    }
  }

  // Within a solid, the way out.
  const auto ball = test::makeModel<S>(fcl::BV_AABB, test::blob(1, 0, 30, 20));
  auto* solid =
      heads.add(ball, test::makePose<S>(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 0)));
  Scene<S> inside;
  inside.addCapsule(Eigen::Vector3d(0.6, -0.1, 0.01), Eigen::Vector3d(0.6, 0.1, 0.01), 0.05);
  const auto manager = TypeParam::make(options);
  manager->registerFiber({inside[0]});
  manager->registerObstacle(solid, ObstacleOptions{true});
  ContactCollector<S> collector(*manager);
  manager->collide(&collector, collector.callback);
  ASSERT_EQ(collector.contacts().size(), 1u);
  const auto& contact = collector.contacts()[0];
  EXPECT_TRUE(contact.solid);
  EXPECT_NEAR(contact.distance, -0.45, 0.03);  // the ball is a polyhedron
  EXPECT_LT(contact.normal[0], -0.95);
}

}  // namespace
}  // namespace fcl_fibers
