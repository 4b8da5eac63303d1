// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "broadphase/shape_samples.h"
#include "support/pair_queries.h"
#include "support/polytope_oracle.h"
#include "support/scalars.h"

// Convex polytopes beside capsules that count, against brute force in long double.

namespace fcl_fibers::test {
namespace {

template <typename S>
class Polytopes : public testing::Test {};
TYPED_TEST_SUITE(Polytopes, Scalars, ScalarName);

template <typename S>
using Vertices = std::shared_ptr<std::vector<fcl::Vector3<S>>>;

/// One vertex to eight, anywhere, in a plane, on a line, or some of them twice.
template <typename S>
Vertices<S> randomVertices(Random& random) {
  const auto vertices = std::make_shared<std::vector<fcl::Vector3<S>>>();
  const std::size_t count = 1 + random.below(8), shape = random.below(6);
  const Eigen::Vector3d ways[] = {random.direction(), random.direction(), random.direction()};
  const Eigen::Vector3d middle = random.inCube(0.3);
  for (std::size_t i = 0; i < count; ++i) {
    Eigen::Vector3d p = middle;
    for (std::size_t k = 0; k < (shape == 0 ? 1 : shape == 1 ? 2 : 3); ++k) {
      p += random.between(-0.3, 0.3) * ways[k];
    }
    vertices->push_back(i > 0 && random.below(8) == 0 ? (*vertices)[0]
                                                      : fcl::Vector3<S>(p.template cast<S>()));
  }
  return vertices;
}

/// The faces of a tetrahedron, as what FCL makes of faces does not count.
template <typename S>
std::shared_ptr<fcl::Convex<S>> makeConvex(const Vertices<S>& vertices) {
  const bool has_faces = vertices->size() >= 4;
  const auto faces = std::make_shared<std::vector<int>>(
      has_faces ? std::vector<int>{3, 0, 1, 2, 3, 0, 3, 1, 3, 1, 3, 2, 3, 2, 3, 0}
                : std::vector<int>{});
  return std::make_shared<fcl::Convex<S>>(vertices, has_faces ? 4 : 0, faces);
}

/// Capsules and polytopes in a cube.
template <typename S>
struct Room {
  std::vector<std::unique_ptr<Object<S>>> objects;
  std::vector<Vertices<S>> vertices;  ///< of each object; null for a capsule

  Room(Random& random, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto pose = makePose<S>(i, random, 0.5);
      const bool is_polytope = i % 3 == 0;
      vertices.push_back(is_polytope ? randomVertices<S>(random) : nullptr);
      std::shared_ptr<fcl::CollisionGeometry<S>> shape;
      if (is_polytope) {
        shape = makeConvex<S>(vertices.back());
      } else {
        shape = std::make_shared<fcl::Capsule<S>>(S(random.between(0.005, 0.05)),
                                                  S(random.between(0, 0.5)));
      }
      objects.push_back(std::make_unique<Object<S>>(shape, pose));
      objects.back()->computeAABB();
    }
  }
  std::vector<fcl::CollisionObject<S>*> all() const {
    std::vector<fcl::CollisionObject<S>*> all;
    for (const auto& object : objects) all.push_back(object.get());
    return all;
  }
};

/// The corners of the capsule's axis less the vertices of the polytope, at present.
template <typename S>
std::vector<std::array<Real, 3>> differences(const Object<S>& capsule, const Object<S>& polytope,
                                             const Vertices<S>& vertices) {
  const auto at = [](const Object<S>& object, const Point& p) {
    const auto& pose = object.getTransform();
    return Point(pose.linear().template cast<Real>() * p +
                 pose.translation().template cast<Real>());
  };
  const auto& shape = static_cast<const fcl::Capsule<S>&>(*capsule.collisionGeometry());
  std::vector<std::array<Real, 3>> points;
  for (const int sign : {-1, 1}) {
    const Point end = at(capsule, Point(0, 0, Real(shape.lz) / 2 * sign));
    for (const auto& vertex : *vertices) {
      const Point p = end - at(polytope, vertex.template cast<Real>());
      points.push_back({p.x(), p.y(), p.z()});
    }
  }
  return points;
}
/// The distance if it is less than `most`; otherwise at least that.
Real distanceOf(const std::vector<std::array<Real, 3>>& points, Real most) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Real low = 1e9, high = -1e9;
    for (const auto& p : points) {
      low = std::min(low, p[axis]);
      high = std::max(high, p[axis]);
    }
    if (std::max(low, -high) > most) return std::max(low, -high);
  }
  const Quotient<Real> squared = squaredDistanceToHull(points);
  return std::sqrt(squared.above / squared.below);
}

/// Whether the pairs of a capsule and a polytope are those that are within radius and margin.
/// @param tolerance  so near to that distance any answer is right
template <typename S>
void expectTouching(const Calls<S>& calls, const Room<S>& room, const Room<S>& others,
                    double margin, double tolerance) {
  const auto pairs = asSet<S>(calls);
  std::size_t touching = 0, apart = 0;
  for (std::size_t i = 0; i < room.objects.size(); ++i) {
    for (std::size_t j = 0; j < others.objects.size(); ++j) {
      const bool is_first = room.vertices[i] == nullptr;
      if (is_first == (others.vertices[j] == nullptr)) continue;
      if (&room == &others && i > j) continue;
      Object<S>&p = *room.objects[i], &q = *others.objects[j];
      const Object<S>&capsule = is_first ? p : q, &polytope = is_first ? q : p;
      const Real gap =
          distanceOf(
              differences(capsule, polytope, is_first ? others.vertices[j] : room.vertices[i]),
              0.2) -
          Real(static_cast<const fcl::Capsule<S>&>(*capsule.collisionGeometry()).radius) - margin;
      if (std::fabs(gap) <= tolerance) continue;
      const std::size_t found = pairs.count({&p, &q}) + pairs.count({&q, &p});
      EXPECT_EQ(found, gap < 0 ? 1u : 0u) << i << ", " << j << ": gap " << double(gap);
      ++(gap < 0 ? touching : apart);
    }
  }
  EXPECT_GT(touching, 5u);
  EXPECT_GT(apart, 50u);
}

/// @param added  by the program to the boxes
template <class Manager, typename S>
void expectAnswers(const Manager& manager, const Room<S>& room, const Manager& other,
                   const Room<S>& others, double margin, double added) {
  const double tolerance = added > 0 ? 1e-5 : 1e-12;
  expectTouching<S>(selfPairs<S>(manager), room, room, margin + 2 * added, tolerance);
  auto& its = const_cast<Manager&>(other);
  expectTouching<S>(pairsWith<S>(manager, its), room, others, margin + 2 * added, tolerance);
  Calls<S> one_by_one;
  for (const auto& object : others.objects) {
    const Calls<S> calls = pairsWith<S>(manager, static_cast<fcl::CollisionObject<S>&>(*object));
    one_by_one.insert(one_by_one.end(), calls.begin(), calls.end());
  }
  expectTouching<S>(one_by_one, room, others, margin + 2 * added, tolerance);
}

template <class Manager, typename S>
void runRounds(double margin, double added, std::uint64_t seed) {
  Random random(seed);
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  options.margin = margin;
  Room<S> room(random, 60), others(random, 45);
  Manager manager(options), other(options);
  const auto widen = [added](const Room<S>& its) {
    for (const auto& object : its.objects) {
      object->computeAABB();
      object->aabb.expand(fcl::Vector3<S>::Constant(S(added)));
    }
  };
  widen(room);
  widen(others);
  manager.registerObjects(room.all());
  other.registerObjects(others.all());
  for (int round = 0; round < 3; ++round) {
    SCOPED_TRACE("seed " + std::to_string(seed) + ", round " + std::to_string(round));
    expectAnswers(manager, room, other, others, margin, added);
    if (testing::Test::HasFailure()) return;
    for (std::size_t i = 0; i < room.objects.size(); ++i) {
      room.objects[i]->setTransform(makePose<S>(i + std::size_t(round), random, 0.5));
      // In place, as a program that deforms a body does it.
      if (room.vertices[i] != nullptr && round % 2 == 1) {
        for (auto& vertex : *room.vertices[i]) vertex *= S(random.between(0.5, 1.2));
        room.objects[i]->shape().computeLocalAABB();
      }
    }
    widen(room);
    manager.update();
  }
}

// Capsules beside a hull would be missed, or pairs be handed over that do not touch.
TYPED_TEST(Polytopes, MeetTheCapsulesThatTouchThem) {
  using S = TypeParam;
  std::uint64_t seed = 1120;
  for (const double margin : {0.0, 0.03}) {
    for (const double added : {0.0, 0.02}) {
      SCOPED_TRACE(std::to_string(margin) + ", " + std::to_string(added));
      runRounds<LayeredAABBTreeCollisionManager<S>, S>(margin, added, seed++);
      runRounds<WrappedSphereTreeCollisionManager<S>, S>(margin, added, seed++);
    }
  }
}

// A query would look at vertices that no update has read, in a pose that they do not belong to.
TYPED_TEST(Polytopes, CountAsTheyWereReadUntilTheUpdate) {
  using S = TypeParam;
  Random random(1130);
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  Room<S> room(random, 40);
  LayeredAABBTreeCollisionManager<S> manager(options);
  manager.registerObjects(room.all());
  const auto before = asSet<S>(selfPairs<S>(manager));
  EXPECT_GT(before.size(), 5u);
  for (const Vertices<S>& vertices : room.vertices) {
    if (vertices == nullptr) continue;
    for (auto& vertex : *vertices) vertex += fcl::Vector3<S>(100, 0, 0);
  }
  EXPECT_EQ(asSet<S>(selfPairs<S>(manager)), before);
  for (const auto& object : room.objects) {
    object->shape().computeLocalAABB();
    object->computeAABB();
  }
  manager.update();
  for (const auto& [a, b] : selfPairs<S>(manager)) {
    EXPECT_EQ(a->getNodeType() == fcl::GEOM_CONVEX, b->getNodeType() == fcl::GEOM_CONVEX);
  }
}

// A query would look for a polytope where it has gone since the update, and miss what it touched.
TYPED_TEST(Polytopes, CountWhereTheUpdateReadThem) {
  using S = TypeParam;
  Random random(1135);
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  Room<S> room(random, 40);
  LayeredAABBTreeCollisionManager<S> manager(options);
  manager.registerObjects(room.all());
  const auto before = asSet<S>(selfPairs<S>(manager));
  manager.update();
  for (std::size_t i = 0; i < room.objects.size(); ++i) {
    if (room.vertices[i] == nullptr) continue;
    const fcl::Vector3<S> at = room.objects[i]->getTranslation();
    room.objects[i]->setTranslation(at + fcl::Vector3<S>(100, 0, 0));
  }
  EXPECT_TRUE(manager.movedSinceUpdate());
  const auto after = asSet<S>(selfPairs<S>(manager));
  EXPECT_TRUE(std::includes(after.begin(), after.end(), before.begin(), before.end()));
}

// The box of a polytope that came later would be read anew with the next one, but not its vertices.
TYPED_TEST(Polytopes, ThatComeLaterAreReadWithTheirBoxes) {
  using S = TypeParam;
  Random random(1136);
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  Room<S> room(random, 120);
  LayeredAABBTreeCollisionManager<S> manager(options);
  auto all = room.all();
  const std::vector<fcl::CollisionObject<S>*> first(all.begin(), all.end() - 6);
  manager.registerObjects(first);
  manager.setup();
  for (std::size_t i = all.size() - 6; i < all.size(); ++i) manager.registerObject(all[i]);
  (void)selfPairs<S>(manager);
  for (std::size_t i = all.size() - 6; i < all.size(); ++i) {
    all[i]->setTransform(makePose<S>(i, random, 0.5));
    all[i]->computeAABB();
  }
  fcl::CollisionObject<S> far(std::make_shared<fcl::Capsule<S>>(S(0.1), S(0.1)));
  far.setTranslation(fcl::Vector3<S>(50, 0, 0));
  manager.registerObject(&far);
  const auto found = asSet<S>(selfPairs<S>(manager));
  LayeredAABBTreeCollisionManager<S> anew(options);
  all.push_back(&far);
  anew.registerObjects(all);
  EXPECT_EQ(found, asSet<S>(selfPairs<S>(anew)));
}

// A capsule would pass through a polytope between two updates, or be handed over far from it.
TYPED_TEST(Polytopes, MeetTheCapsulesThatTouchThemWithinAStep) {
  using S = TypeParam;
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  options.motion = true;
  for (std::uint64_t seed = 1140; seed < 1146; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    options.margin = seed % 2 == 0 ? 0 : 0.02;
    Room<S> room(random, 45);
    LayeredAABBTreeCollisionManager<S> manager(options);
    manager.registerObjects(room.all());
    (void)selfPairs<S>(manager);
    manager.beginStep();
    std::vector<fcl::Transform3<S>> starts, ends;
    for (std::size_t i = 0; i < room.objects.size(); ++i) {
      Object<S>& object = *room.objects[i];
      fcl::Transform3<S> pose = object.getTransform();
      starts.push_back(pose);
      const Eigen::Vector3d by = random.inCube(0.4);
      if (room.vertices[i] == nullptr) pose.linear() = makePose<S>(4, random, 1).linear();
      pose.translation() += by.template cast<S>();
      ends.push_back(pose);
      object.setTransform(pose);
      object.computeAABB();
    }
    manager.update();
    const auto pairs = asSet<S>(selfPairs<S>(manager));
    std::size_t touching = 0, apart = 0;
    for (std::size_t i = 0; i < room.objects.size(); ++i) {
      for (std::size_t j = 0; j < room.objects.size(); ++j) {
        if (room.vertices[i] != nullptr || room.vertices[j] == nullptr) continue;
        // The ends of an axis and all vertices move along lines.
        const auto at = [&](const std::vector<fcl::Transform3<S>>& poses) {
          Object<S>&p = *room.objects[i], &q = *room.objects[j];
          p.setTransform(poses[i]);
          q.setTransform(poses[j]);
          const auto points = differences(p, q, room.vertices[j]);
          p.setTransform(ends[i]);
          q.setTransform(ends[j]);
          return points;
        };
        const auto from = at(starts), to = at(ends);
        Real speed = 0, least = 1e9;
        for (std::size_t k = 0; k < from.size(); ++k) {
          const Point way(to[k][0] - from[k][0], to[k][1] - from[k][1], to[k][2] - from[k][2]);
          speed = std::max(speed, way.norm());
        }
        constexpr int kParts = 16;
        for (int part = 0; part <= kParts; ++part) {
          auto points = from;
          for (std::size_t k = 0; k < from.size(); ++k) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
              points[k][axis] += Real(part) / kParts * (to[k][axis] - from[k][axis]);
            }
          }
          least = std::min(least, distanceOf(points, 0.3));
        }
        const auto& shape =
            static_cast<const fcl::Capsule<S>&>(*room.objects[i]->collisionGeometry());
        const Real gap = least - Real(shape.radius) - options.margin;
        fcl::CollisionObject<S>*p = room.objects[i].get(), *q = room.objects[j].get();
        const std::size_t found = pairs.count({p, q}) + pairs.count({q, p});
        if (gap < -1e-12) {
          EXPECT_EQ(found, 1u) << i << ", " << j;
          ++touching;
        } else if (gap > speed / (2 * kParts) + 1e-9) {
          EXPECT_EQ(found, 0u) << i << ", " << j << ": gap " << double(gap);
          ++apart;
        }
      }
    }
    EXPECT_GT(touching, 5u);
    EXPECT_GT(apart, 100u);
  }
}

}  // namespace
}  // namespace fcl_fibers::test
