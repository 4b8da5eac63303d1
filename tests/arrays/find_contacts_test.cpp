// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/contact.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/array_fibers.h"
#include "arrays/meshes.h"
#include "support/exact_geometry.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

/// A few dozen roundings of coordinates below 4.
constexpr Real kContactRounding = 1e-14L;

test::Point toPoint(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

template <typename S>
FiberTree capsuleTree(const FiberArrays<S>& fibers, int threads = 1, double margin = 0) {
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = 0;
  options.threads = threads;
  options.margin = margin;
  FiberTree tree(options);
  tree.build(fibers);
  return tree;
}

/// The numbers of a contact with a mesh, to compare.
std::vector<double> numbersOf(const MeshContact& c) {
  std::vector<double> numbers = {static_cast<double>(c.place.fiber),
                                 static_cast<double>(c.place.number),
                                 static_cast<double>(c.triangle),
                                 c.s,
                                 c.distance,
                                 static_cast<double>(c.solid)};
  for (const auto& row : {c.weights, c.point_a, c.point_b, c.normal}) {
    numbers.insert(numbers.end(), row.begin(), row.end());
  }
  return numbers;
}

/// What contact.h says of points and normals, whatever the mesh is.
/// @return the distance of the two closest points
template <typename S>
Real expectPoints(const Assembly<S>& fibers, const ExactTriangle& t, const MeshContact& contact) {
  const ExactCapsule capsule = roundedCapsule(
      fibers.capsule(fibers.point_begin[contact.place.fiber] + contact.place.number));
  const test::Point x = capsule.a + Real(contact.s) * (capsule.b - capsule.a);
  const test::Point normal = toPoint(contact.normal);
  test::Point q = test::Point::Zero();
  Real sum = 0;
  const test::Point corners[] = {t.a, t.b, t.c};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_GE(contact.weights[k], 0);
    q += Real(contact.weights[k]) * corners[k];
    sum += Real(contact.weights[k]);
  }
  EXPECT_TRUE(contact.s >= 0 && contact.s <= 1) << contact.s;
  EXPECT_LE(std::fabs(sum - 1), kContactRounding);
  EXPECT_LE(std::fabs(normal.norm() - 1), kContactRounding);
  EXPECT_LE((q - toPoint(contact.point_b)).norm(), kContactRounding);
  EXPECT_LE((x + capsule.radius * normal - toPoint(contact.point_a)).norm(), kContactRounding);
  EXPECT_LE((q - x).norm(), segmentTriangleDistance(capsule.a, capsule.b, t) + kContactRounding);
  return (q - x).norm();
}

/// How far beyond the plane of the triangle, as `normal` points, the deeper end of the axis is.
Real depthOf(const ExactCapsule& capsule, const ExactTriangle& t, const test::Point& normal) {
  return std::max(normal.dot(capsule.a - t.a), normal.dot(capsule.b - t.a));
}

test::Point normalOf(const ExactTriangle& t) { return (t.b - t.a).cross(t.c - t.a).normalized(); }

/// Contacts with a surface.
template <typename S>
void expectRight(const Assembly<S>& fibers, const ExactTriangle& t, const MeshContact& contact) {
  EXPECT_FALSE(contact.solid);
  const Real apart = expectPoints(fibers, t, contact);
  const ExactCapsule capsule = roundedCapsule(
      fibers.capsule(fibers.point_begin[contact.place.fiber] + contact.place.number));
  const test::Point normal = toPoint(contact.normal);
  if (apart > 1e-10L) {
    EXPECT_LE(std::fabs(contact.distance - (apart - capsule.radius)), kContactRounding);
    const test::Point way =
        toPoint(contact.point_b) - (capsule.a + Real(contact.s) * (capsule.b - capsule.a));
    EXPECT_LE((way / apart - normal).norm(), kContactRounding / apart);
  } else if ((t.b - t.a).cross(t.c - t.a).norm() > 1e-6L) {
    // The axis crosses. Of both ways off the plane the contact has the shorter one.
    EXPECT_LE((normal.cross(normalOf(t))).norm(), 1e-8L);
    const Real depth = std::min(depthOf(capsule, t, normal), depthOf(capsule, t, -normal));
    EXPECT_LE(std::fabs(contact.distance + depth + capsule.radius), 1e-8L);
  }
}

void expectSame(const Contact& found, const Contact& expected) {
  ASSERT_EQ(std::tie(found.a.fiber, found.a.number, found.b.fiber, found.b.number),
            std::tie(expected.a.fiber, expected.a.number, expected.b.fiber, expected.b.number));
  ASSERT_EQ(std::tie(found.s, found.t, found.distance, found.point_a, found.point_b, found.normal),
            std::tie(expected.s, expected.t, expected.distance, expected.point_a, expected.point_b,
                     expected.normal));
}

template <typename S>
class FindContacts : public testing::Test {};
TYPED_TEST_SUITE(FindContacts, Scalars, ScalarName);

// A contact would be that of another pair, or depend on the threads.
TYPED_TEST(FindContacts, OfFibersAreThoseOfTheVisitedPairs) {
  const auto fibers = curledFibers<TypeParam>(31, 60);
  for (const int threads : {1, 3}) {
    const FiberTree tree = capsuleTree(fibers.view(), threads);
    std::vector<Contact> contacts(7);
    tree.find(Contacts{fibers.view()}, contacts);
    std::size_t next = 0;
    tree.visit(Pairs{}, [&](SegmentPair pair) {
      ASSERT_LT(next, contacts.size());
      expectSame(contacts[next++], capsuleContact(fibers.view(), pair));
    });
    EXPECT_EQ(next, contacts.size());

    // A program may keep some of the pairs.
    std::vector<SegmentPair> pairs;
    tree.find(Pairs{}, pairs);
    constexpr std::size_t kFirst = 5;
    ASSERT_GT(pairs.size(), kFirst);
    std::vector<Contact> some(pairs.size() - kFirst);
    tree.writeContacts(Contacts{fibers.view()}, tree, pairs.data() + kFirst, some.size(),
                       some.data());
    for (std::size_t i = 0; i < some.size(); ++i) expectSame(some[i], contacts[i + kFirst]);
    pairs.back().b = -1;
    EXPECT_THROW(tree.writeContacts(Contacts{fibers.view()}, tree, pairs.data(), pairs.size(),
                                    contacts.data()),
                 std::invalid_argument);
    EXPECT_GT(next, 1000u) << "enough for several ranges";
  }
}

// A contact would be that of a capsule of the wrong tree.
TYPED_TEST(FindContacts, OfTwoTreesAreThoseOfTheirPairs) {
  const auto mine = curledFibers<TypeParam>(36, 60), theirs = curledFibers<TypeParam>(37, 50);
  const FiberTree tree = capsuleTree(mine.view()), other = capsuleTree(theirs.view());
  const auto others = theirs.view();
  const Contacts question{mine.view(), &others};
  std::vector<Contact> contacts;
  tree.find(question, other, contacts);
  std::size_t next = 0;
  tree.visit(Pairs{}, other, [&](SegmentPair pair) {
    ASSERT_LT(next, contacts.size());
    expectSame(contacts[next++], capsuleContact(mine.view(), others, pair));
  });
  EXPECT_EQ(next, contacts.size());
  EXPECT_GT(next, 100u);

  std::size_t visited = 0;
  EXPECT_TRUE(tree.visit(question, other, [&](const Contact& contact) {
    EXPECT_EQ(contact.distance, contacts[visited].distance);
    return ++visited == 3;
  }));
  EXPECT_EQ(visited, 3u);

  const auto fewer = curledFibers<TypeParam>(37, 49);
  const auto few = fewer.view();
  const auto refusal = ThrowsMessage<std::invalid_argument>(HasSubstr("fibers"));
  EXPECT_THAT([&] { tree.find(Contacts{mine.view()}, other, contacts); }, refusal);
  EXPECT_THAT([&] { tree.find(Contacts{mine.view(), &few}, other, contacts); }, refusal);
  EXPECT_EQ(contacts.size(), next);
}

// A contact with a surface would not be where the two touch.
TYPED_TEST(FindContacts, OfASurfaceAreWhereTheyTouch) {
  const auto fibers = curledFibers<TypeParam>(32, 120);
  for (const Triangles<TypeParam>& triangles :
       {soup<TypeParam>(33, 400, 0.5), ball<TypeParam>(0.3, 16, 24)}) {
    TriangleMesh mesh(triangles.view());
    for (const MeshPose& pose : {MeshPose(), randomPose(34, 0.1)}) {
      mesh.setPose(pose);
      std::vector<std::vector<double>> by_one_thread;
      for (const int threads : {1, 3}) {
        const FiberTree tree = capsuleTree(fibers.view(), threads, 0.01);
        std::vector<MeshContact> contacts(3);
        tree.find(Contacts{fibers.view()}, mesh, contacts);
        std::vector<TrianglePair> pairs;
        tree.visit(Pairs{}, mesh, [&](TrianglePair pair) { pairs.push_back(pair); });
        std::vector<MeshContact> same(pairs.size());
        tree.writeContacts(Contacts{fibers.view()}, mesh, pairs.data(), pairs.size(), same.data());
        ASSERT_EQ(same.size(), contacts.size());
        for (std::size_t i = 0; i < same.size(); ++i) {
          ASSERT_EQ(std::tie(same[i].triangle, same[i].distance, same[i].point_b),
                    std::tie(contacts[i].triangle, contacts[i].distance, contacts[i].point_b));
        }
        std::vector<std::vector<double>> rows;
        std::size_t next = 0;
        tree.visit(Pairs{}, mesh, [&](TrianglePair pair) {
          ASSERT_LT(next, contacts.size());
          const MeshContact& contact = contacts[next++];
          ASSERT_EQ(fibers.point_begin[contact.place.fiber] + contact.place.number,
                    static_cast<std::size_t>(pair.segment));
          ASSERT_EQ(contact.triangle, pair.triangle);
          ASSERT_LE(contact.distance, 0.01 + static_cast<double>(kContactRounding));
          expectRight(fibers, triangles.triangle(static_cast<std::size_t>(pair.triangle), pose),
                      contact);
          ASSERT_EQ(numbersOf(meshContact(fibers.view(), mesh, pair)), numbersOf(contact));
          rows.push_back(numbersOf(contact));
        });
        EXPECT_EQ(next, contacts.size());
        EXPECT_GT(next, 600u) << "enough for several ranges";
        if (threads == 1) by_one_thread = rows;
        EXPECT_EQ(rows, by_one_thread);
      }
    }
  }
}

// A hair in a head would be pushed further in, or one beside it be taken for one inside.
TYPED_TEST(FindContacts, OfASolidLeadOut) {
  const auto fibers = curledFibers<TypeParam>(35, 60);
  const auto triangles = ball<TypeParam>(0.3, 8, 12);
  TriangleMesh solid(triangles.view(), TriangleMesh::Kind::kSolid);
  for (const MeshPose& pose : {MeshPose(), randomPose(36, 0.1)}) {
    solid.setPose(pose);
    const test::Point middle = toPoint(pose.position);
    const FiberTree tree = capsuleTree(fibers.view());
    std::vector<MeshContact> contacts;
    tree.find(Contacts{fibers.view()}, solid, contacts);
    int crossing = 0, inside = 0, outside = 0;
    for (const MeshContact& contact : contacts) {
      const ExactTriangle t = triangles.triangle(static_cast<std::size_t>(contact.triangle), pose);
      const ExactCapsule capsule = roundedCapsule(
          fibers.capsule(fibers.point_begin[contact.place.fiber] + contact.place.number));
      const test::Point x = capsule.a + Real(contact.s) * (capsule.b - capsule.a);
      const Real apart = expectPoints(fibers, t, contact);
      bool is_inside = apart < 1e-10L;
      if (!is_inside) {
        // The ball is star-shaped: the way from its middle to a point inside meets no triangle.
        is_inside = true;
        for (std::size_t i = 0; is_inside && i < triangles.count(); ++i) {
          is_inside = segmentTriangleDistance(middle, x, triangles.triangle(i, pose)) > 0;
        }
        ++(is_inside ? inside : outside);
      } else {
        ++crossing;
      }
      ASSERT_EQ(contact.solid, is_inside);
      const test::Point normal = toPoint(contact.normal);
      if (is_inside) {
        EXPECT_LE((normal + normalOf(t)).norm(), 1e-12L);
        const Real depth = std::max(Real(0), depthOf(capsule, t, normal));
        EXPECT_LE(std::fabs(contact.distance + depth + capsule.radius), kContactRounding);
      } else {
        EXPECT_LE(std::fabs(contact.distance - (apart - capsule.radius)), kContactRounding);
      }
    }
    EXPECT_GT(std::min({crossing, inside, outside}), 50);
  }
}

MeshContact deepest(const Assembly<double>& fibers, const TriangleMesh& mesh) {
  std::vector<MeshContact> contacts;
  capsuleTree(fibers.view()).find(Contacts{fibers.view()}, mesh, contacts);
  EXPECT_FALSE(contacts.empty());
  return *std::min_element(contacts.begin(), contacts.end(),
                           [](const auto& p, const auto& q) { return p.distance < q.distance; });
}

// The numbers of contact.h by hand.
TEST(FindContacts, DepthsInASolidAreThoseByHand) {
  const TriangleMesh cube(boxMesh({0, 0, 0}, {4, 4, 4}).view(), TriangleMesh::Kind::kSolid);
  Assembly<double> level, sunk, upright;
  level.addCapsule({1.5, 1.25, 3.75}, {2.5, 1.25, 3.75}, 0.125);  // inside, along the top
  sunk.addCapsule({1.5, 1.25, 3.75}, {1.75, 1.25, 3.25}, 0.125);  // inside, its far end deeper
  upright.addCapsule({1.5, 1.25, 3.0}, {1.5, 1.25, 4.5}, 0.125);  // through the top
  for (const auto& [fibers, depth] : {std::pair(level, 0.25), {sunk, 0.75}, {upright, 1.0}}) {
    const MeshContact contact = deepest(fibers, cube);
    EXPECT_TRUE(contact.solid);
    EXPECT_EQ(contact.distance, -depth - 0.125);
    EXPECT_EQ(contact.normal, (std::array<double, 3>{0, 0, -1}));
  }
  // The same capsules at the surface alone.
  const TriangleMesh surface(boxMesh({0, 0, 0}, {4, 4, 4}).view());
  std::vector<MeshContact> contacts;
  capsuleTree(level.view()).find(Contacts{level.view()}, surface, contacts);
  EXPECT_TRUE(contacts.empty());
  const MeshContact crossing = deepest(upright, surface);
  EXPECT_FALSE(crossing.solid);
  EXPECT_EQ(crossing.distance, -0.5 - 0.125) << "the shorter way is down";
  EXPECT_EQ(crossing.normal, (std::array<double, 3>{0, 0, 1}));
}

// By the rule of docs/contacts.md, a fiber would be left in a convex part of a machine.
TEST(FindContacts, OneOfThoseOfAConvexSolidLeadsOut) {
  const auto fibers = curledFibers<double>(37, 60);
  const Eigen::Vector3d high(0.3, 0.2, 0.1);
  const Triangles<double> box = boxMesh(-high, high);
  const TriangleMesh solid(box.view(), TriangleMesh::Kind::kSolid);
  std::vector<MeshContact> contacts;
  capsuleTree(fibers.view()).find(Contacts{fibers.view()}, solid, contacts);
  std::map<std::size_t, MeshContact> ways;  // by segment
  for (const MeshContact& contact : contacts) {
    const auto [way, is_new] =
        ways.insert({fibers.point_begin[contact.place.fiber] + contact.place.number, contact});
    MeshContact& best = way->second;
    if (contact.solid != best.solid ? contact.solid
                                    : contact.solid == (contact.distance > best.distance)) {
      best = contact;
    }
  }
  EXPECT_GT(ways.size(), 100u);
  for (const auto& [segment, way] : ways) {
    const ExactCapsule capsule = roundedCapsule(fibers.capsule(segment));
    const test::Point motion = Real(way.distance) * toPoint(way.normal), a = capsule.a + motion;
    EXPECT_GT((a.cwiseAbs() - high.cast<Real>()).maxCoeff(), -kContactRounding) << "is inside";
    for (std::size_t i = 0; i < box.count(); ++i) {
      EXPECT_GE(segmentTriangleDistance(a, capsule.b + motion, box.triangle(i, {})),
                capsule.radius - kContactRounding);
    }
  }
}

// A fiber outside of a thin plate would be told to be inside, because it is behind the far side.
TEST(FindContacts, OutsideOfAThinSolidIsOutside) {
  const TriangleMesh plate(boxMesh({0, 0, 0}, {4, 4, 0.0625}).view(), TriangleMesh::Kind::kSolid);
  Assembly<double> above;
  above.addCapsule({1.5, 1.25, 0.125}, {2.5, 1.25, 0.125}, 0.25);
  std::vector<MeshContact> contacts;
  capsuleTree(above.view()).find(Contacts{above.view()}, plate, contacts);
  bool has_far_side = false;
  for (const MeshContact& contact : contacts) {
    EXPECT_FALSE(contact.solid);
    EXPECT_LT(contact.normal[2], 0);
    has_far_side |= contact.point_b[2] == 0;
  }
  EXPECT_TRUE(has_far_side);
}

// Digits would be lost where mesh and fibers are far from the origin together.
TEST(FindContacts, AreRelativeToTheMesh) {
  const auto triangles = ball<double>(0.3, 16, 24);
  TriangleMesh mesh(triangles.view());
  MeshPose pose;
  pose.position = {0x1p30, -0x1p31, 0x1p30};
  auto fibers = curledFibers<double>(37, 40);
  for (std::size_t i = 0; i < fibers.points.size(); ++i) {
    fibers.points[i] += pose.position[i % 3];  // a multiple of 2^-22
  }
  auto near_fibers = fibers;
  for (std::size_t i = 0; i < fibers.points.size(); ++i) {
    near_fibers.points[i] -= pose.position[i % 3];  // exactly
  }
  const FiberTree tree = capsuleTree(near_fibers.view());
  std::vector<MeshContact> near;
  tree.find(Contacts{near_fibers.view()}, mesh, near);
  EXPECT_GT(near.size(), 50u);
  mesh.setPose(pose);
  for (const MeshContact& contact : near) {
    const auto segment = static_cast<std::int32_t>(near_fibers.point_begin[contact.place.fiber] +
                                                   contact.place.number);
    const MeshContact far = meshContact(fibers.view(), mesh, {segment, contact.triangle});
    EXPECT_EQ(far.weights, contact.weights);
    EXPECT_EQ(far.s, contact.s);
    if (contact.distance > -fibers.radii[0] / 2) {
      EXPECT_EQ(far.distance, contact.distance);
    }
  }
}

// Bad input would change something or be read beyond its end.
TEST(FindContacts, RefuseBadInputAndKeepTheContacts) {
  const auto fibers = curledFibers<double>(38, 40);
  const TriangleMesh mesh(ball<double>(0.3, 12, 18).view());
  const FiberTree tree = capsuleTree(fibers.view());
  std::vector<Contact> contacts(3);
  std::vector<MeshContact> mesh_contacts(4);
  const auto refused = [&](const FiberArrays<double>& bad, const std::string& text) {
    const auto refusalBy = [&](const std::string& call) {
      return ThrowsMessage<std::invalid_argument>(HasSubstr("FiberTree::" + call + ": " + text));
    };
    const auto find = refusalBy("find(Contacts)"), write = refusalBy("writeContacts");
    EXPECT_THAT([&] { tree.find(Contacts{bad}, contacts); }, find);
    EXPECT_THAT(
        [&] {
          tree.writeContacts(Contacts{bad}, tree, nullptr, 0, static_cast<Contact*>(nullptr));
        },
        write);
    EXPECT_THAT(
        [&] {
          tree.writeContacts(Contacts{bad}, mesh, nullptr, 0, static_cast<MeshContact*>(nullptr));
        },
        write);
    EXPECT_THAT([&] { tree.find(Contacts{bad}, mesh, mesh_contacts); }, find);
    EXPECT_EQ(contacts.size(), 3u);
    EXPECT_EQ(mesh_contacts.size(), 4u);
  };
  refused({}, "point_begin is null");
  refused(curledFibers<double>(39, 40).view(), "the fibers have other numbers of points");
  auto bad = fibers;
  bad.points[7] = std::nan("");
  refused(bad.view(), "point 2 is NaN");
  bad.points[7] = 0x1p1001;
  refused(bad.view(), "a coordinate or the radius is NaN or beyond 2^1000");
  bad = fibers;
  bad.radii[1] = -1;
  refused(bad.view(), "radius 1 is negative");

  for (const std::int32_t triangle : {-1, static_cast<std::int32_t>(mesh.triangleCount())}) {
    EXPECT_THAT(
        [&] {
          meshContact(fibers.view(), mesh, {0, triangle});
        },
        ThrowsMessage<std::invalid_argument>(
            HasSubstr("there is no triangle " + std::to_string(triangle))));
    const TrianglePair wrong = {0, triangle};
    EXPECT_THROW(tree.writeContacts(Contacts{fibers.view()}, mesh, &wrong, 1, mesh_contacts.data()),
                 std::invalid_argument);
  }
  // Pairs that are far enough behind the first are looked at before they are checked.
  std::vector<TrianglePair> pairs(20, {0, 0});
  std::vector<MeshContact> written(pairs.size());
  for (const std::int32_t segment : {-1, 2000000000, std::numeric_limits<std::int32_t>::max(),
                                     std::numeric_limits<std::int32_t>::min()}) {
    pairs[17].segment = segment;
    EXPECT_THAT(
        [&] {
          tree.writeContacts(Contacts{fibers.view()}, mesh, pairs.data(), pairs.size(),
                             written.data());
        },
        ThrowsMessage<std::invalid_argument>(HasSubstr(
            "FiberTree::writeContacts: no capsule starts at point " + std::to_string(segment))));
  }
  EXPECT_THAT(
      [&] {
        meshContact(fibers.view(), mesh, {-1, 0});
      },
      ThrowsMessage<std::invalid_argument>(
          HasSubstr("meshContact: no capsule starts at point -1")));
}

// There would be a contact with nothing, or one of another query be left over.
TEST(FindContacts, OfNothingAreNone) {
  const auto fibers = curledFibers<double>(40, 10);
  const TriangleMesh empty(MeshArrays<double>{});
  std::vector<MeshContact> contacts(4);
  std::vector<std::int32_t> segments(4);
  std::vector<TrianglePair> nearest(4);
  const FiberTree tree = capsuleTree(fibers.view());
  tree.find(Contacts{fibers.view()}, empty, contacts);
  tree.find(TouchingSegments{}, empty, segments);
  tree.find(Nearest{1e9}, empty, nearest);
  EXPECT_TRUE(contacts.empty() && segments.empty() && nearest.empty());
  const std::size_t begin[] = {0};
  FiberArrays<double> none;
  none.point_begin = begin;
  contacts.resize(4);
  std::vector<Contact> pairs(4);
  capsuleTree(none).find(Contacts{none}, TriangleMesh(ball<double>(1, 4, 4).view()), contacts);
  capsuleTree(none).find(Contacts{none}, pairs);
  EXPECT_TRUE(contacts.empty());
  EXPECT_TRUE(pairs.empty());
}

}  // namespace
}  // namespace fcl_fibers::test
