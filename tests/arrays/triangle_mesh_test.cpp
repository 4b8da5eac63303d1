// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/triangle_mesh.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>

#include "arrays/array_fibers.h"
#include "arrays/meshes.h"
#include "support/exact_geometry.h"

namespace fcl_fibers::test {
namespace {

using Kind = TriangleMesh::Kind;
using testing::HasSubstr;

/// The text of what a call throws.
template <class Call>
std::string refusal(Call&& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing was refused";
}

FiberTree treeOf(const FiberArrays<double>& fibers, FiberTreeOptions options = {}) {
  options.report = Report::kCapsules;
  FiberTree tree(options);
  tree.build(fibers);
  return tree;
}

TEST(TriangleMesh, RefusesBadArraysAndNamesThePlace) {
  Triangles<double> mesh = ball<double>(1, 6, 8);
  const auto make = [&](const MeshArrays<double>& arrays, Kind kind = Kind::kSurface) {
    return refusal([&] { TriangleMesh(arrays, kind); });
  };
  MeshArrays<double> arrays = mesh.view();
  arrays.points = nullptr;
  EXPECT_THAT(make(arrays), HasSubstr("points are null"));
  arrays = mesh.view();
  arrays.triangles = nullptr;
  EXPECT_THAT(make(arrays), HasSubstr("triangles are null"));
  arrays.triangle_count = std::size_t{1} << 28;
  EXPECT_THAT(make(arrays), HasSubstr("2^27"));

  mesh.indices[3 * 5 + 1] = 1000;
  EXPECT_THAT(make(mesh.view()), HasSubstr("triangle 5 has point 1000"));
  mesh.indices[3 * 5 + 1] = -1;
  EXPECT_THAT(make(mesh.view()), HasSubstr("triangle 5 has point -1"));
  mesh = ball<double>(1, 6, 8);
  mesh.points[3 * 7 + 2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(make(mesh.view()), HasSubstr("point 7 is NaN"));
  mesh.points[3 * 7 + 2] = 1e305;
  EXPECT_THAT(make(mesh.view()), HasSubstr("beyond 2^1000"));

  mesh = ball<double>(1, 6, 8);
  EXPECT_NO_THROW(TriangleMesh(mesh.view(), Kind::kSolid));
  std::swap(mesh.indices[3], mesh.indices[4]);  // turned inside out
  EXPECT_THAT(make(mesh.view(), Kind::kSolid), HasSubstr("not watertight"));
  mesh = ball<double>(1, 6, 8);
  mesh.indices.resize(mesh.indices.size() - 3);
  EXPECT_THAT(make(mesh.view(), Kind::kSolid), HasSubstr("not watertight"));
  EXPECT_NO_THROW(TriangleMesh(mesh.view()));
}

TEST(TriangleMesh, ARefusedChangeChangesNothing) {
  const auto fibers = curledFibers<double>(1, 30);
  const FiberTree tree = treeOf(fibers.view());
  auto triangles = ball<double>(0.3, 12, 16);
  TriangleMesh mesh(triangles.view());
  MeshPose pose = randomPose(2, 0.1);
  mesh.setPose(pose);
  std::vector<std::int32_t> before, after;
  tree.findTouching(mesh, before);
  EXPECT_GT(before.size(), 10u);

  MeshPose bad = pose;
  bad.rotation[4] += 0.1;
  EXPECT_THAT(refusal([&] { mesh.setPose(bad); }), HasSubstr("orthonormal"));
  bad = pose;
  for (double& x : bad.rotation) x = -x;
  EXPECT_THAT(refusal([&] { mesh.setPose(bad); }), HasSubstr("reflection"));
  bad = pose;
  bad.position[1] = std::numeric_limits<double>::infinity();
  EXPECT_THAT(refusal([&] { mesh.setPose(bad); }), HasSubstr("position"));
  auto moved = triangles;
  moved.points[0] = std::numeric_limits<double>::infinity();
  EXPECT_THAT(refusal([&] { mesh.update(moved.view()); }), HasSubstr("point 0"));
  moved = triangles;
  std::rotate(moved.indices.begin(), moved.indices.begin() + 1, moved.indices.begin() + 3);
  EXPECT_THAT(refusal([&] { mesh.update(moved.view()); }), HasSubstr("other triangles"));

  EXPECT_EQ(mesh.pose().position, pose.position);
  tree.findTouching(mesh, after);
  EXPECT_EQ(before, after);
}

TEST(TriangleMesh, AnEmptyMeshTouchesNothing) {
  const TriangleMesh empty(MeshArrays<float>{});
  const auto fibers = curledFibers<double>(3, 10);
  const FiberTree tree = treeOf(fibers.view());
  std::vector<std::int32_t> touching;
  std::vector<TrianglePair> nearest;
  std::vector<MeshContact> contacts;
  tree.findTouching(empty, touching);
  tree.findNearest(empty, 1e9, nearest);
  tree.findContacts(fibers.view(), empty, contacts);
  EXPECT_TRUE(touching.empty() && nearest.empty() && contacts.empty());
  EXPECT_EQ(empty.triangleCount(), 0u);
  treeOf(FiberArrays<double>{nullptr, 0, fibers.point_begin.data(), 0})
      .findTouching(TriangleMesh(ball<double>(1, 4, 5).view()), touching);
  EXPECT_TRUE(touching.empty());
}

TEST(TriangleMesh, CopiesShareTheirTriangles) {
  const auto triangles = ball<double>(0.3, 40, 60);
  TriangleMesh mesh(triangles.view());
  TriangleMesh copy = mesh;
  EXPECT_EQ(copy.triangleCount(), triangles.count());
  EXPECT_EQ(copy.pointCount(), triangles.pointCount());
  EXPECT_GT(mesh.memoryUsage(), triangles.count() * 36);
  copy.setPose(randomPose(4, 5));
  copy.setCategories(6);
  EXPECT_EQ(mesh.pose().position, MeshPose().position);
  EXPECT_EQ(mesh.categories(), ~std::uint32_t{0});
}

TEST(FiberTree, RefusesMeshQueriesThatItCannotAnswer) {
  const auto fibers = curledFibers<double>(5, 10);
  const auto triangles = ball<double>(0.3, 6, 8);
  const TriangleMesh mesh(triangles.view());
  FiberTree volumes;
  volumes.build(fibers.view());
  std::vector<std::int32_t> touching;
  std::vector<TrianglePair> nearest;
  EXPECT_THAT(refusal([&] { volumes.visitMesh(mesh, [](TrianglePair) {}); }),
              HasSubstr("kCapsules"));
  EXPECT_THAT(refusal([&] { volumes.findTouching(mesh, touching); }), HasSubstr("kCapsules"));
  const FiberTree tree = treeOf(fibers.view());
  EXPECT_THAT(refusal([&] { tree.findNearest(mesh, -1, nearest); }), HasSubstr("distance"));
  EXPECT_THAT(refusal([&] {
                meshContact(fibers.view(), mesh, {0, 100000});
              }),
              HasSubstr("triangle 100000"));
  EXPECT_THAT(refusal([&] { meshContact(fibers.view(), mesh, {-1, 0}); }), HasSubstr("point -1"));
  FiberArrays<double> rooted = fibers.view();
  std::vector<std::int32_t> roots(fibers.fiberCount(), 1);
  roots[4] = -2;
  rooted.root_segments = roots.data();
  EXPECT_THAT(refusal([&] { treeOf(rooted); }), HasSubstr("fiber 4"));
  EXPECT_THAT(refusal([&] { rootSegments(fibers.view(), -1); }), HasSubstr("length"));
}

TEST(FiberTree, CountsRootsByLength) {
  Assembly<double> fibers;
  fibers.addFiber({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}}, 0.1);
  fibers.addFiber({{0, 0, 0}}, 0.1);
  fibers.addFiber({{5, 0, 0}, {5, 0, 3}}, 0.1);
  using testing::ElementsAre;
  EXPECT_THAT(rootSegments(fibers.view(), 0), ElementsAre(0, 0, 0));
  EXPECT_THAT(rootSegments(fibers.view(), 1), ElementsAre(1, 0, 1));
  EXPECT_THAT(rootSegments(fibers.view(), 2.5), ElementsAre(3, 0, 1));
}

TEST(FiberTree, VisitsTheSegmentsThatOverlapABoxOrACapsule) {
  const auto fibers = curledFibers<double>(6, 60);
  Random random(7);
  for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
    options.margin = 0.01;
    const FiberTree tree = treeOf(fibers.view(), options);
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d a = random.inCube(0.5), b = random.inCube(0.5);
      BoxShape box;
      CapsuleShape capsule{{a.x(), a.y(), a.z()}, {b.x(), b.y(), b.z()}, 0.03};
      ExactBox exact;
      for (int k = 0; k < 3; ++k) {
        const auto axis = static_cast<std::size_t>(k);
        box.low[axis] = std::min(a[k], b[k]);
        box.high[axis] = std::max(a[k], b[k]);
        exact.min[k] = box.low[axis];
        exact.max[k] = box.high[axis];
      }
      std::vector<std::int32_t> at_box, at_capsule, expected_at_box, expected_at_capsule;
      tree.visitOverlaps(box, [&](std::int32_t segment) { at_box.push_back(segment); });
      tree.visitOverlaps(capsule, [&](std::int32_t segment) { at_capsule.push_back(segment); });
      fibers.visitCapsules([&](std::size_t, std::size_t point) {
        const ExactCapsule s = roundedCapsule(fibers.capsule(point));
        const Real reach = s.radius + 0.01L;
        const auto id = static_cast<std::int32_t>(point);
        if (segmentBoxDistance(s.a, s.b, exact) <= reach) expected_at_box.push_back(id);
        if (segmentDistance(s.a, s.b, {a.x(), a.y(), a.z()}, {b.x(), b.y(), b.z()}) <=
            reach + 0.03L) {
          expected_at_capsule.push_back(id);
        }
      });
      EXPECT_THAT(at_box, testing::UnorderedElementsAreArray(expected_at_box));
      EXPECT_THAT(at_capsule, testing::UnorderedElementsAreArray(expected_at_capsule));
    }
    EXPECT_THAT(refusal([&] {
                  tree.visitOverlaps(BoxShape{{0, 0, 0}, {1, -1, 1}}, [](std::int32_t) {});
                }),
                HasSubstr("low exceeds high"));
    EXPECT_THAT(refusal([&] {
                  tree.visitOverlaps(CapsuleShape{{0, 0, 0}, {1, 0, 0}, -1}, [](std::int32_t) {});
                }),
                HasSubstr("radius"));
  }
}

TEST(FiberTree, FindsTheContactsOfAllPairs) {
  const auto fibers = curledFibers<double>(8, 60);
  const auto triangles = ball<double>(0.3, 12, 16);
  TriangleMesh mesh(triangles.view());
  mesh.setPose(randomPose(9, 0.1));
  for (const int threads : {1, 3}) {
    FiberTreeOptions options;
    options.threads = threads;
    options.ignored_neighbors = 1;
    const FiberTree tree = treeOf(fibers.view(), options);
    std::vector<SegmentPair> pairs;
    std::vector<Contact> contacts;
    tree.findPairs(pairs);
    tree.findContacts(fibers.view(), contacts);
    ASSERT_EQ(contacts.size(), pairs.size());
    EXPECT_GT(pairs.size(), 20u);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      EXPECT_EQ(contacts[i].distance, capsuleContact(fibers.view(), pairs[i]).distance);
    }
    std::size_t next = 0;
    std::vector<MeshContact> at_mesh;
    tree.findContacts(fibers.view(), mesh, at_mesh);
    tree.visitMesh(mesh, [&](TrianglePair pair) {
      ASSERT_LT(next, at_mesh.size());
      const MeshContact& contact = at_mesh[next++];
      EXPECT_EQ(contact.triangle, pair.triangle);
      EXPECT_EQ(contact.distance, meshContact(fibers.view(), mesh, pair).distance);
      EXPECT_EQ(contact.a.segment, tree.fiberSegment(pair.segment).segment);
      EXPECT_LE(contact.distance, 1e-14);
    });
    EXPECT_EQ(next, at_mesh.size());
    EXPECT_GT(next, 20u);
  }
}

TEST(MeshContact, OfASolidMovesTheCapsuleOut) {
  // A cube of side 2 about the origin, by its corners' signs.
  Triangles<double> cube;
  for (int i = 0; i < 8; ++i) {
    cube.addPoint({i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0});
  }
  const std::int32_t quads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                    {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& q : quads) {
    cube.addTriangle(q[0], q[1], q[2]);
    cube.addTriangle(q[0], q[2], q[3]);
  }
  TriangleMesh solid(cube.view(), Kind::kSolid);
  solid.setPose({{1, 0, 0, 0, 1, 0, 0, 0, 1}, {10, 0, 0}});
  Assembly<double> fibers;
  fibers.addCapsule({10, 0.1, 0.9}, {10.2, 0.1, 0.8}, 0.05);       // inside, below the face z = 1
  fibers.addCapsule({10.1, 0.2, 0.7}, {10.1, 0.2, 1.5}, 0.05);     // through the face
  fibers.addCapsule({10.1, -0.2, 1.02}, {10.1, -0.2, 1.5}, 0.05);  // on it
  fibers.addCapsule({10.1, -0.2, 1.2}, {10.1, -0.2, 1.5}, 0.05);   // above
  std::vector<MeshContact> contacts;
  treeOf(fibers.view()).findContacts(fibers.view(), solid, contacts);
  ASSERT_EQ(contacts.size(), 3u);
  std::sort(contacts.begin(), contacts.end(),
            [](const MeshContact& p, const MeshContact& q) { return p.a.fiber < q.a.fiber; });
  const double depths[] = {0.2 + 0.05, 0.3 + 0.05, 0.03};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(contacts[i].a.fiber, i);
    EXPECT_EQ(contacts[i].solid, i < 2);
    EXPECT_NEAR(contacts[i].distance, -depths[i], 1e-12);
    EXPECT_NEAR(contacts[i].normal[2], -1, 1e-12);
    EXPECT_NEAR(contacts[i].point_b[2], 1, 1e-12);
  }
  TriangleMesh surface(cube.view());
  surface.setPose(solid.pose());
  treeOf(fibers.view()).findContacts(fibers.view(), surface, contacts);
  EXPECT_EQ(contacts.size(), 2u) << "the capsule inside does not touch the surface";
}

}  // namespace
}  // namespace fcl_fibers::test
