// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/shapes.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl_fibers/contact_collector.h>
#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <gtest/gtest.h>

#include "support/random.h"
#include "support/scene.h"

namespace fcl_fibers::test {
namespace {

using Object = fcl::CollisionObjectd;
using Vector = Eigen::Vector3d;

std::array<double, 3> arrayOf(const Vector& v) { return {v.x(), v.y(), v.z()}; }
Vector vectorOf(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// One thing as a partner of arrays and as an object of a manager.
struct Obstacle {
  Shape shape;
  std::shared_ptr<Object> object;
};

/// A shape of each type, turned and not, among the fibers.
std::vector<Obstacle> randomObstacles(Random& random) {
  const auto objectOf = [](auto* geometry, const fcl::Transform3d& pose) {
    return std::make_shared<Object>(std::shared_ptr<fcl::CollisionGeometryd>(geometry), pose);
  };
  const auto translation = [](const Vector& to) {
    return fcl::Transform3d(Eigen::Translation3d(to));
  };
  const Vector p = random.inCube(0.5), q = p + random.inCube(0.5), n = random.direction();
  const double radius = random.between(0.05, 0.2), height = random.between(-0.3, 0.3);
  std::vector<Obstacle> obstacles;
  fcl::Transform3d along = translation((p + q) / 2);
  along.linear() = Eigen::Quaterniond::FromTwoVectors(Vector::UnitZ(), q - p).toRotationMatrix();
  obstacles.push_back({CapsuleShape{arrayOf(p), arrayOf(q), radius},
                       objectOf(new fcl::Capsuled(radius, (q - p).norm()), along)});
  obstacles.push_back(
      {SphereShape{arrayOf(p), radius}, objectOf(new fcl::Sphered(radius), translation(p))});
  const Vector half = random.inCube(0.4).cwiseAbs();
  BoxShape box{arrayOf(-half), arrayOf(half)};
  for (const bool is_turned : {false, true}) {
    const fcl::Transform3d pose =
        makePose<double>(is_turned ? random.rotation() : Eigen::Quaterniond::Identity(), q);
    for (Eigen::Index k = 0; k < 9; ++k) {
      box.pose.rotation[static_cast<std::size_t>(k)] = pose.linear()(k / 3, k % 3);
    }
    box.pose.position = arrayOf(q);
    obstacles.push_back({box, objectOf(new fcl::Boxd(2 * half), pose)});
  }
  // A pose of these that turns and moves them to where the shapes are.
  const Eigen::Quaterniond turn = random.rotation();
  const fcl::Transform3d pose = makePose<double>(turn, p);
  const Vector local = turn.inverse() * n;
  obstacles.push_back({HalfSpaceShape{arrayOf(2 * n), 2 * (height + n.dot(p))},
                       objectOf(new fcl::Halfspaced(local, height), pose)});
  obstacles.push_back(
      {PlaneShape{arrayOf(n), height + n.dot(p)}, objectOf(new fcl::Planed(local, height), pose)});
  return obstacles;
}

// A program that changes from objects to arrays would get other contacts with its ground.
TEST(ShapesOfArrays, TouchWhatTheirObjectsTouch) {
  // The lengths that the error of a distance is relative to are at most 6 here, and each side errs.
  constexpr double kError = 2 * 32 * std::numeric_limits<double>::epsilon() * 6;
  Random random(971);
  FiberPolylines fibers;
  for (int f = 0; f < 40; ++f) {
    Vector point = random.inCube(0.8);
    for (int i = 0; i < 8; ++i, point += random.inCube(0.15)) {
      fibers.points.push_back(arrayOf(point));
      fibers.radii.push_back(0.03 * random.unit());
    }
    fibers.point_begin.push_back(fibers.points.size());
  }
  const auto arrays = fiberArrays(fibers);
  const auto objects = makeObjects<double>(fibers);
  std::map<const Object*, std::int32_t> segments;  // by their objects
  for (std::size_t f = 0, k = 0; f < fibers.fiberCount(); ++f) {
    for (std::size_t i = fibers.point_begin[f]; i + 1 < fibers.point_begin[f + 1]; ++i) {
      segments[objects[k++].get()] = static_cast<std::int32_t>(i);
    }
  }

  std::array<std::size_t, std::variant_size_v<Shape>> apart{}, overlapping{};
  for (int round = 0; round < 100; ++round) {
    SCOPED_TRACE(round);
    FiberManagerOptions options;
    options.report = Report::kCapsules;
    options.ignored_neighbors = 1;
    options.margin = round % 2 == 0 ? 0 : 0.05;
    FiberTree tree(options);
    tree.build(arrays);
    const std::vector<Obstacle> obstacles = randomObstacles(random);
    LayeredAABBTreeCollisionManagerd manager(options);
    for (const auto& fiber : objectsByFiber(fibers, objects)) {
      manager.registerFiber(fiber.objects, fiber.ends, {1});
    }
    for (const Obstacle& obstacle : obstacles) manager.registerObstacle(obstacle.object.get());

    // Of a segment and an obstacle, as seen from the segment.
    std::map<std::pair<std::int32_t, const Object*>, Contact> of_objects;
    ContactCollector<double> collector(manager);
    manager.collide(&collector, collector.callback);
    for (const auto& contact : collector.contacts()) {
      const auto a = segments.find(contact.object_a), b = segments.find(contact.object_b);
      const bool is_first = a != segments.end();
      if (is_first == (b != segments.end())) continue;
      Contact seen = contact;
      if (!is_first) {
        seen.s = contact.t;
        seen.point_a = contact.point_b;
        seen.point_b = contact.point_a;
        seen.normal = arrayOf(-vectorOf(contact.normal));
      }
      const std::pair pair((is_first ? a : b)->second,
                           is_first ? contact.object_b : contact.object_a);
      EXPECT_TRUE(of_objects.emplace(pair, seen).second) << "twice";
    }

    std::size_t count = 0;
    for (const Obstacle& obstacle : obstacles) {
      const std::size_t kind = obstacle.shape.index();
      SCOPED_TRACE(kind);
      std::vector<std::int32_t> pairs;
      tree.find(Pairs{}, obstacle.shape, pairs);
      std::vector<ShapeContact> contacts;
      tree.find(Contacts{arrays}, obstacle.shape, contacts);
      ASSERT_EQ(contacts.size(), pairs.size());
      count += pairs.size();
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        const ShapeContact& contact = contacts[i];
        EXPECT_EQ(contact.segment, pairs[i]);
        const auto found = of_objects.find({pairs[i], obstacle.object.get()});
        ASSERT_NE(found, of_objects.end()) << pairs[i] << " at " << contact.distance;
        const Contact& other = found->second;
        EXPECT_NEAR(contact.distance, other.distance, kError);
        // A direction errs as the way that it is of, from the axis; that out of a shape is a
        // normal of its surface, or across an edge and an axis.
        const double radius = fibers.radii[static_cast<std::size_t>(pairs[i])];
        const double way = contact.distance + radius;
        const Vector normal = vectorOf(contact.normal);
        EXPECT_LE((normal - vectorOf(other.normal)).norm() * std::max(std::abs(way), 1e-3), kError);
        // Along a face many places are as good, so what counts is the height over it.
        for (const auto& [p, q] : {std::pair(contact.point_a, other.point_a),
                                   std::pair(contact.point_b, other.point_b)}) {
          EXPECT_LE(std::abs(normal.dot(vectorOf(p) - vectorOf(q))), 2 * kError);
        }
        ++(contact.distance < 0 ? overlapping : apart)[kind];
      }
    }
    EXPECT_EQ(count, of_objects.size());
  }
  for (std::size_t kind = 0; kind < apart.size(); ++kind) {
    EXPECT_GT(apart[kind], 20u) << kind;
    EXPECT_GT(overlapping[kind], 100u) << kind;
  }
}

}  // namespace
}  // namespace fcl_fibers::test
