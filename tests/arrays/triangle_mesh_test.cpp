// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/triangle_mesh.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>

#include "arrays/array_fibers.h"
#include "arrays/meshes.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

auto refusal(const std::string& text) {
  return ThrowsMessage<std::invalid_argument>(HasSubstr("TriangleMesh::" + text));
}

/// What a tree finds at a mesh, in its order.
class Probe {
 public:
  Probe() {
    tree_ = FiberTree(FiberOptions{Topology::kBundle, Report::kCapsules});
    tree_.build(curledFibers<double>(41, 40).view());
  }
  PairList operator()(const TriangleMesh& mesh) const {
    PairList pairs;
    tree_.visit(Pairs{}, mesh, [&](TrianglePair p) { pairs.emplace_back(p.segment, p.triangle); });
    return pairs;
  }

 private:
  FiberTree tree_;
};

template <typename S>
class Meshes : public testing::Test {};
TYPED_TEST_SUITE(Meshes, Scalars, ScalarName);

// A number out of range would be read, or a mesh be searched for what it is not.
TYPED_TEST(Meshes, RefuseArraysThatAreNoMesh) {
  using Kind = TriangleMesh::Kind;
  const Triangles<TypeParam> good = ball<TypeParam>(0.3, 6, 8);
  const auto refused = [](const MeshArrays<TypeParam>& bad, const std::string& text,
                          Kind kind = Kind::kSurface) {
    EXPECT_THAT([&] { TriangleMesh(bad, kind); }, refusal("TriangleMesh: " + text));
  };
  const TriangleMesh mesh(good.view(), Kind::kSolid);
  EXPECT_EQ(mesh.kind(), Kind::kSolid);
  EXPECT_EQ(mesh.pointCount(), good.pointCount());
  EXPECT_EQ(mesh.triangleCount(), good.count());

  MeshArrays<TypeParam> bad = good.view();
  bad.points = nullptr;
  refused(bad, "points are null");
  bad = good.view();
  bad.triangles = nullptr;
  refused(bad, "triangles are null");
  // Refused by their numbers before anything is read.
  bad = good.view();
  bad.point_count = (std::size_t{1} << 27) + 1;
  refused(bad, "134217729 points are more than 2^27");
  bad = good.view();
  bad.triangle_count = static_cast<std::size_t>(-1);
  refused(bad, "18446744073709551615 triangles are more than 2^27");

  Triangles<TypeParam> other = good;
  other.indices[3 * 5 + 1] = -1;
  refused(other.view(), "triangle 5 has point -1 of 42");
  other.indices[3 * 5 + 1] = 42;
  refused(other.view(), "triangle 5 has point 42 of 42");
  for (const double x : {kNan, kInfinity, -kInfinity}) {
    other = good;
    other.points[3 * 7 + 2] = static_cast<TypeParam>(x);
    refused(other.view(), "point 7 is NaN or infinite");
  }
}

TEST(Meshes, RefuseNumbersWhoseSumsWouldOverflow) {
  Triangles<double> mesh = ball<double>(0.3, 6, 8);
  mesh.points[4] = 0x1p1000;
  EXPECT_NO_THROW(TriangleMesh{mesh.view()});
  mesh.points[4] = -0x1.1p1000;
  EXPECT_THAT([&] { TriangleMesh{mesh.view()}; }, refusal("TriangleMesh: a coordinate is beyond"));
}

// A body with a hollow in it would be refused, or a hollow alone be taken for a body.
TEST(Meshes, ThatAreSolidMayHaveSeveralBodies) {
  const auto joined = [](double hollow) {
    Triangles<double> mesh = boxMesh({-1, -1, -1}, {1, 1, 1});
    const auto first = static_cast<std::int32_t>(mesh.pointCount());
    const Triangles<double> other = boxMesh({-hollow, 3, 3}, {hollow, 3 + hollow, 3 + hollow});
    mesh.points.insert(mesh.points.end(), other.points.begin(), other.points.end());
    for (std::size_t i = 0; i < other.indices.size(); i += 3) {  // inside out
      mesh.addTriangle(first + other.indices[i], first + other.indices[i + 2],
                       first + other.indices[i + 1]);
    }
    return mesh;
  };
  EXPECT_NO_THROW(TriangleMesh(joined(1.5).view(), TriangleMesh::Kind::kSolid));      // 8 - 6.75
  EXPECT_THAT([&] { TriangleMesh(joined(1.7).view(), TriangleMesh::Kind::kSolid); },  // 8 - 9.8
              refusal("TriangleMesh: the solid mesh is inside out"));
}

// What is inside would depend on the hole that one looks through.
TEST(Meshes, ThatAreSolidAreWatertight) {
  const Triangles<double> closed = ball<double>(0.3, 6, 8);
  const auto refused = [](const Triangles<double>& bad, const std::string& edge,
                          const std::string& why =
                              " is not that of exactly one other triangle in the opposite "
                              "direction; close the mesh, or make it a surface") {
    EXPECT_NO_THROW(TriangleMesh{bad.view()}) << "a surface may have holes";
    EXPECT_THAT([&] { TriangleMesh(bad.view(), TriangleMesh::Kind::kSolid); },
                refusal("TriangleMesh: the solid mesh is not watertight: the edge " + edge + why));
  };
  const auto withTriangle = [&](std::int32_t a, std::int32_t b, std::int32_t c) {
    Triangles<double> mesh = closed;
    mesh.addTriangle(a, b, c);
    return mesh;
  };
  Triangles<double> bad = closed;
  for (std::size_t i = 0; i < bad.indices.size(); i += 3)
    std::swap(bad.indices[i], bad.indices[i + 1]);
  EXPECT_NO_THROW(TriangleMesh(bad.view()));
  EXPECT_THAT([&] { TriangleMesh(bad.view(), TriangleMesh::Kind::kSolid); },
              refusal("TriangleMesh: the solid mesh is inside out: its triangles are clockwise "
                      "seen from outside; exchange two points of each"));
  TriangleMesh solid(closed.view(), TriangleMesh::Kind::kSolid);
  bad = closed;
  for (std::size_t i = 0; i < bad.points.size(); i += 3) bad.points[i] *= -1;
  EXPECT_NO_THROW(TriangleMesh(closed.view()).update(bad.view()));
  EXPECT_THAT([&] { solid.update(bad.view()); }, refusal("update: the solid mesh is inside out"));
  bad = closed;
  bad.indices.resize(bad.indices.size() - 3);  // a hole
  EXPECT_THROW(TriangleMesh(bad.view(), TriangleMesh::Kind::kSolid), std::invalid_argument);
  bad = closed;
  std::swap(bad.indices[0], bad.indices[1]);  // one triangle turned over
  refused(bad, "from point 2 to point 0 of triangle 0");
  refused(withTriangle(10, 20, 30),  // one more, attached to nothing
          "from point 10 to point 20 of triangle " + std::to_string(closed.count()));
  refused(withTriangle(0, 2, 3), "from point 0 to point 2 of triangle 0");  // the first one, twice
  refused(withTriangle(3, 3, 4),  // an edge from a point to itself, and the third at another
          "from point 3 to point 4 of triangle 1");

  // Two points at one place are not one point.
  const std::string merge =
      " is shared with no other triangle, because points that lie at the same place are not one "
      "point; merge such points, or make it a surface";
  bad = closed;
  bad.indices[0] = bad.addPoint({0, 0, 0.3});
  const std::string added = std::to_string(bad.indices[0]);
  refused(bad, "from point " + added + " to point 2 of triangle 0", merge);
  bad = Triangles<double>();
  for (const std::int32_t i : closed.indices) {
    const double* const p = &closed.points[3 * static_cast<std::size_t>(i)];
    bad.indices.push_back(bad.addPoint({p[0], p[1], p[2]}));
  }
  refused(bad, "from point 0 to point 1 of triangle 0", merge);
  // To merge them leaves the hole, of which the next text tells.
  bad.indices.resize(bad.indices.size() - 3);
  refused(bad, "from point 0 to point 1 of triangle 0", merge);
  bad.indices.erase(bad.indices.begin(), bad.indices.begin() + 3);
  refused(bad, "from point 3 to point 4 of triangle 0");

  EXPECT_NO_THROW(TriangleMesh(MeshArrays<double>(), TriangleMesh::Kind::kSolid));
}

// An update would answer for triangles that it never saw.
TYPED_TEST(Meshes, RefuseUpdatesOfAnotherMeshAndStayAsTheyWere) {
  const Probe probe;
  const Triangles<TypeParam> good = ball<TypeParam>(0.3, 12, 16);
  TriangleMesh mesh(good.view());
  const PairList before = probe(mesh);
  ASSERT_FALSE(before.empty());
  const auto refused = [&](const MeshArrays<TypeParam>& bad, const std::string& text) {
    const TriangleMesh copy = mesh;
    EXPECT_THAT([&] { mesh.update(bad); }, refusal("update: " + text));
    EXPECT_EQ(probe(mesh), before);
  };
  Triangles<TypeParam> bad = good;
  std::swap(bad.indices[4], bad.indices[5]);
  refused(bad.view(), "the arrays have other triangles");
  bad = good;
  bad.indices.resize(bad.indices.size() - 3);
  refused(bad.view(), "the arrays have other triangles or another number of points");
  bad = good;
  bad.addPoint({0, 0, 0});
  refused(bad.view(), "the arrays have other triangles or another number of points");
  bad = good;
  bad.points.back() = static_cast<TypeParam>(kNan);
  refused(bad.view(), "point " + std::to_string(good.pointCount() - 1) + " is NaN or infinite");
  refused({good.points.data(), good.pointCount(), nullptr, good.count()}, "triangles are null");
}

// A head that has moved would be touched where it was, or its copy where it is not.
TYPED_TEST(Meshes, ThatAreCopiesMoveAlone) {
  const Probe probe;
  const Triangles<TypeParam> first = ball<TypeParam>(0.3, 12, 16);
  Triangles<double> second;
  second.indices = first.indices;
  for (const TypeParam x : first.points) second.points.push_back(0.75 * static_cast<double>(x));
  const TriangleMesh fresh(first.view()), fresh_second(second.view());
  ASSERT_NE(probe(fresh), probe(fresh_second));

  TriangleMesh mesh(first.view());
  mesh.update(second.view());  // alone, and of the other scalar
  EXPECT_EQ(probe(mesh), probe(fresh_second));
  const TriangleMesh copy = mesh;
  mesh.update(first.view());
  EXPECT_EQ(probe(mesh), probe(fresh));
  EXPECT_EQ(probe(copy), probe(fresh_second));

  mesh = copy;
  MeshPose pose;
  pose.position = {0.125, 0, 0};
  mesh.setPose(pose);
  mesh.setCategories(0);
  EXPECT_EQ(mesh.pose().position, pose.position);
  EXPECT_EQ(copy.pose().position, MeshPose().position);
  EXPECT_EQ(probe(copy), probe(fresh_second));
  EXPECT_EQ(mesh.categories(), 0u);
  EXPECT_EQ(copy.categories(), ~std::uint32_t{0});
}

// One thread would read points that another one is writing. ThreadSanitizer sees it.
TEST(Meshes, ThatAreCopiesMayBeChangedOnSeveralThreads) {
  const Probe probe;
  const Triangles<double> first = ball<double>(0.3, 8, 10);
  Triangles<double> second = first;
  for (double& x : second.points) x *= 0.75;
  const TriangleMesh fresh(first.view()), fresh_second(second.view());
  const PairList expected = probe(fresh), expected_second = probe(fresh_second);
  for (int round = 0; round < 20; ++round) {
    TriangleMesh mesh(first.view());
    std::thread reader([copy = mesh, &probe, &expected]() mutable {
      EXPECT_EQ(probe(copy), expected);
      copy = TriangleMesh(MeshArrays<double>());  // lets go of the triangles
    });
    mesh.update(second.view());
    EXPECT_EQ(probe(mesh), expected_second);
    mesh.update(first.view());
    EXPECT_EQ(probe(mesh), expected);
    reader.join();
  }
}

// A pose that is none would shear the mesh, turn it inside out or lose it.
TEST(Meshes, RefusePosesThatAreNone) {
  TriangleMesh mesh(ball<double>(0.3, 6, 8).view());
  const MeshPose good = randomPose(42, 1);
  mesh.setPose(good);
  const auto refused = [&](const std::function<void(MeshPose&)>& spoil, const std::string& text) {
    MeshPose bad = good;
    spoil(bad);
    EXPECT_THAT([&] { mesh.setPose(bad); }, refusal("setPose: " + text));
    EXPECT_EQ(mesh.pose().rotation, good.rotation);
    EXPECT_EQ(mesh.pose().position, good.position);
  };
  for (const double x : {kNan, kInfinity, -0x1.1p1000}) {
    refused([&](MeshPose& pose) { pose.position[1] = x; }, "the position is NaN or beyond");
    refused([&](MeshPose& pose) { pose.rotation[5] = x; }, "the rotation is not orthonormal");
  }
  refused([](MeshPose& pose) { pose.rotation = {1, 0, 0, 0, 1, 0, 0, 0, -1}; }, "the rotation");
  refused([](MeshPose& pose) { pose.rotation = {1, 0.01, 0, 0, 1, 0, 0, 0, 1}; }, "the rotation");
  refused([](MeshPose& pose) { pose.rotation = {1.01, 0, 0, 0, 1, 0, 0, 0, 1}; }, "the rotation");
  refused([](MeshPose& pose) { pose.rotation = {}; }, "the rotation");
  MeshPose drifted;
  drifted.rotation = {1, 0.004, 0, 0, 1.002, 0, 0, 0, 1};
  EXPECT_NO_THROW(mesh.setPose(drifted));
}

// A program could not skip what it has not loaded, or a far head be taken for a near one.
TYPED_TEST(Meshes, ThatAreEmptyOrFarTouchNothing) {
  const Probe probe;
  const std::vector<TypeParam> points(30, TypeParam(0));
  EXPECT_TRUE(probe(TriangleMesh(MeshArrays<TypeParam>())).empty());
  EXPECT_TRUE(probe(TriangleMesh(MeshArrays<TypeParam>{points.data(), 10, nullptr, 0})).empty());
  const Triangles<TypeParam> triangles = ball<TypeParam>(0.3, 12, 16);
  for (const auto kind : {TriangleMesh::Kind::kSurface, TriangleMesh::Kind::kSolid}) {
    TriangleMesh mesh(triangles.view(), kind);
    for (const double away : {2.0, 1e10, 1e100, 1e280}) {
      MeshPose pose;
      pose.position = {away, -away, away};
      mesh.setPose(pose);
      EXPECT_TRUE(probe(mesh).empty()) << away;
    }
    MeshPose pose;
    pose.position = {0, 0x1p1000, 0};
    mesh.setPose(pose);
    EXPECT_THAT([&] { probe(mesh); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("overflow in the unit")));
  }
}

// A call with a mesh that was moved from would crash, or that mesh touch something.
TEST(Meshes, HaveNoTrianglesAfterAMove) {
  const Triangles<double> given = ball<double>(0.3, 12, 16);
  const Probe probe;
  TriangleMesh from(given.view(), TriangleMesh::Kind::kSolid);
  from.setCategories(3);
  const PairList pairs = probe(from);
  ASSERT_FALSE(pairs.empty());
  const TriangleMesh to = std::move(from);
  EXPECT_EQ(probe(to), pairs);
  const TriangleMesh fresh(MeshArrays<double>(), TriangleMesh::Kind::kSolid), copy = from;
  for (const TriangleMesh* mesh : {&copy, static_cast<const TriangleMesh*>(&from)}) {
    EXPECT_TRUE(probe(*mesh).empty());
    EXPECT_EQ(mesh->pointCount(), 0u);
    EXPECT_EQ(mesh->triangleCount(), 0u);
    EXPECT_EQ(mesh->memoryUsage(), fresh.memoryUsage());
    EXPECT_EQ(mesh->kind(), TriangleMesh::Kind::kSolid);
    EXPECT_EQ(mesh->categories(), 3u);
  }
  EXPECT_THAT([&] { from.update(given.view()); }, refusal("update"));
  from.update(MeshArrays<float>());
  from.setPose({});
  EXPECT_TRUE(probe(from).empty());
  from = to;
  from.update(given.view());
  EXPECT_EQ(probe(from), pairs);
}

// A program that counts on it would run out of memory.
TEST(Meshes, TellTheirMemory) {
  const Triangles<double> few = ball<double>(0.3, 6, 8), many = ball<double>(0.3, 60, 80);
  const TriangleMesh small(few.view()), large(many.view());
  EXPECT_GT(small.memoryUsage(), few.indices.size() * sizeof(std::int32_t));
  EXPECT_GT(large.memoryUsage(), 50 * small.memoryUsage());
}

}  // namespace
}  // namespace fcl_fibers::test
