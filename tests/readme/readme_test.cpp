// SPDX-License-Identifier: BSD-3-Clause

// The C++ of some pages in docs (code_blocks.cmake), with what it takes for granted declared before
// it. Other pages show files of examples.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/geometric_shape_to_BVH_model.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl_fibers/fiber_objects.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/file_support.h"

// clang-format off
#include "contacts_0_includes.inc"
#include "contacts_1_includes.inc"
#include "contacts_2_includes.inc"
#include "contacts_3_includes.inc"
#include "contacts_4_includes.inc"
#include "contacts_5_includes.inc"
#include "files_0_includes.inc"
#include "files_1_includes.inc"
#include "live_pairs_0_includes.inc"
#include "live_pairs_5_includes.inc"
#include "options_0_includes.inc"
#include "options_1_includes.inc"
#include "options_2_includes.inc"
#include "options_3_includes.inc"
#include "options_4_includes.inc"
#include "options_5_includes.inc"
#include "options_6_includes.inc"
// clang-format on

namespace {

using Fiber = std::vector<fcl::CollisionObjectd*>;

/// Two fibers of three segments whose middle ones touch.
fcl_fibers::FiberPolylines crossing() {
  fcl_fibers::FiberPolylines scene;
  for (const double x : {-1.5, -0.5, 0.5, 1.5}) scene.points.push_back({x, 0, 0});
  for (const double y : {-1.5, -0.5, 0.5, 1.5}) scene.points.push_back({0, y, 0.15});
  scene.point_begin = {0, 4, 8};
  scene.radius = 0.1;
  return scene;
}

/// A square whose ends meet, and which touches itself there alone.
fcl_fibers::FiberPolylines square() {
  fcl_fibers::FiberPolylines scene;
  scene.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 0}};
  scene.point_begin = {0, 5};
  scene.radius = 0.1;
  return scene;
}

struct Objects {
  explicit Objects(const fcl_fibers::FiberPolylines& scene)
      : owned(fcl_fibers::makeObjects<double>(scene)) {
    for (auto& fiber : fcl_fibers::objectsByFiber(scene, owned)) {
      fibers.push_back(std::move(fiber.objects));
    }
  }
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> owned;
  std::vector<Fiber> fibers;
};

using PairList = std::vector<std::pair<fcl::CollisionObjectd*, fcl::CollisionObjectd*>>;

bool callback(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data) {
  static_cast<PairList*>(data)->push_back({a, b});
  return false;
}

// Code that a user copies would not compile, or report other pairs than it says.
TEST(Options, TreeOverArrays) {
  const fcl_fibers::FiberPolylines scene = crossing();
  std::vector<float> points;
  for (const fcl_fibers::Point& point : scene.points) {
    for (const double coordinate : point) points.push_back(static_cast<float>(coordinate));
  }
  const std::vector<std::size_t>& point_begin = scene.point_begin;
  const std::size_t point_count = scene.points.size(), fiber_count = scene.fiberCount();
  const float radius = 0.1F;
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
  const auto touched = [&](std::int32_t a, std::int32_t b) { pairs.push_back({a, b}); };
#include "options_6_code.inc"
  EXPECT_THAT(pairs, testing::ElementsAre(std::pair(1, 5)));
}

/// Names and defaults in the table of docs/options.md.
std::map<std::string, std::string> tableOfDefaults(std::size_t column) {
  std::ifstream page(FCL_FIBERS_SOURCE_DIR "/docs/options.md");
  std::map<std::string, std::string> defaults;
  bool has_begun = false;
  for (std::string line; std::getline(page, line);) {
    has_begun = has_begun || line.rfind("| option | what it does | trees | managers |", 0) == 0;
    if (has_begun && line.empty()) break;
    if (!has_begun || line.rfind("| `", 0) != 0) continue;
    std::vector<std::string> cells;
    std::istringstream rest(line);
    for (std::string cell; std::getline(rest, cell, '|');) {
      cell.erase(
          std::remove_if(cell.begin(), cell.end(), [](char c) { return c == ' ' || c == '`'; }),
          cell.end());
      cells.push_back(cell);
    }
    if (!cells.at(column).empty()) defaults[cells.at(1)] = cells.at(column);
  }
  return defaults;
}

std::map<std::string, std::string> defaultsOf(const fcl_fibers::FiberOptions& options) {
  using namespace fcl_fibers;
  std::ostringstream arc_length, margin;
  arc_length << options.ignored_arc_length;
  margin << options.margin;
  return {{"report", options.report == Report::kCapsules ? "kCapsules" : "kVolumes"},
          {"ignored_neighbors", std::to_string(options.ignored_neighbors)},
          {"ignored_arc_length", arc_length.str()},
          {"margin", margin.str()},
          {"threads", std::to_string(options.threads)},
          {"topology", options.topology == Topology::kBundle ? "kBundle" : "kSuperThread"}};
}

// The table would tell other defaults than those that a program gets.
TEST(Options, TheTableHasTheDefaults) {
  using namespace fcl_fibers;
  auto of_trees = defaultsOf(FiberTreeOptions());
  const bool has_boxes = FiberTreeOptions().volumes == FiberTreeOptions::Volumes::kLayeredBoxes;
  of_trees["volumes"] = has_boxes ? "kLayeredBoxes" : "kWrappedSpheres";
  EXPECT_EQ(tableOfDefaults(3), of_trees);
  auto of_managers = defaultsOf(FiberManagerOptions());
  const bool has_margins = FiberManagerOptions().bounds == Bounds::kShapesAndMargins;
  of_managers["bounds"] = has_margins ? "kShapesAndMargins" : "others";
  of_managers["motion"] = FiberManagerOptions().motion ? "on" : "off";
  of_managers["skin"] = FiberManagerOptions().skin == 0 ? "none" : "others";
  EXPECT_EQ(tableOfDefaults(4), of_managers);
}

TEST(Options, HairWithItsHead) {
  // A hair from the middle of a tetrahedron through its face x + y + z = 2.
  const double points[] = {-1, -1, -1, 4, -1, -1, -1, 4, -1, -1, -1, 4};
  const std::int32_t corners[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  const fcl_fibers::MeshArrays<double> triangles = {points, 4, corners, 4};
  const fcl_fibers::MeshPose pose;
  const double line[] = {0, 0, 0, 0.3, 0.3, 0.3, 0.6, 0.6, 0.6, 0.9, 0.9, 0.9};
  const std::size_t begin[] = {0, 4};
  const double radius = 0.01;
  fcl_fibers::FiberArrays<double> hair = {line, 4, begin, 1, &radius};
#include "options_1_code.inc"
  // The root is left out; the last segment crosses the face, and the one before is inside.
  ASSERT_EQ(contacts.size(), 2U);
  EXPECT_EQ(contacts[0].place.number, 2U);
  EXPECT_EQ(contacts[1].place.number, 1U);
  for (const fcl_fibers::MeshContact& contact : contacts) {
    EXPECT_EQ(contact.triangle, 3);
    EXPECT_TRUE(contact.solid);
    EXPECT_NEAR(contact.normal[0], -std::sqrt(1 / 3.0), 1e-12);
  }
}

TEST(Options, HairWithItsHeadAsObjects) {
  // A hair from the middle of a ball.
  fcl_fibers::FiberPolylines scene;
  scene.points = {{0, 0, 0}, {0, 0, 0.3}, {0, 0, 0.6}, {0, 0, 0.9}, {0, 0, 1.5}, {0, 0, 1.8}};
  scene.point_begin = {0, 6};
  scene.radius = 0.01;
  const Objects objects(scene);
  const std::vector<Fiber>& hairs = objects.fibers;
  const auto mesh = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  const fcl::Transform3d pose(Eigen::Translation3d(0, 0, 0));
  fcl::generateBVHModel(*mesh, fcl::Sphered(1), pose, 16, 9);
  fcl::CollisionObjectd head(mesh);
#include "options_2_code.inc"
  // The root is left out, two segments are inside, one crosses, the last one is outside.
  std::set<std::size_t> segments;
  for (const auto& contact : collector.contacts()) {
    EXPECT_EQ(contact.object_b, &head);
    EXPECT_TRUE(contact.solid);
    segments.insert(contact.a.number);
  }
  EXPECT_THAT(segments, testing::ElementsAre(1, 2, 3));
}

/// Hair along x at rest, and hair across it that falls through.
TEST(Options, HairThatMoves) {
  const double before[] = {0, 0, 0, 1, 0, 0, 0.5, -0.5, 1, 0.5, 0.5, 1};
  const double after[] = {0, 0, 0, 1, 0, 0, 0.5, -0.5, -1, 0.5, 0.5, -1};
  const std::size_t begin[] = {0, 2, 4};
  const double radius = 0.01;
  const fcl_fibers::FiberArrays<double> start = {before, 4, begin, 2, &radius};
  const fcl_fibers::FiberArrays<double> end = {after, 4, begin, 2, &radius};
  const double points[] = {-1, -1, -0.5, 2, -1, -0.5, 0, 2, -0.5};
  const std::int32_t corners[] = {0, 1, 2};
  const fcl_fibers::TriangleMesh head_at_start(
      fcl_fibers::MeshArrays<double>{points, 3, corners, 1});
  const fcl_fibers::TriangleMesh& head_at_end = head_at_start;
  fcl_fibers::FiberTreeOptions options;
  options.report = fcl_fibers::Report::kCapsules;
  options.ignored_neighbors = 0;
  fcl_fibers::FiberTree tree(options);
  tree.build(start);
  std::vector<double> times;
  const auto solve = [&](double time, const auto& contact) {
    EXPECT_NEAR(contact.distance, 0, 1e-8);
    times.push_back(time);
  };
#include "options_3_code.inc"
  EXPECT_THAT(times, testing::ElementsAre(testing::DoubleNear(0.49, 1e-8),
                                          testing::DoubleNear(0.745, 1e-8)));
  EXPECT_NEAR(fraction, 0.49, 1e-8);
}

TEST(Options, ObjectsThatMove) {
  const fcl_fibers::FiberPolylines scene = crossing();
  const Objects objects(scene);
  const Fiber& fiber = objects.fibers[0];
  fcl::CollisionObjectd ball(std::make_shared<fcl::Sphered>(0.01), fcl::Matrix3d::Identity(),
                             fcl::Vector3d(1.5, 0, 5));
  const auto moveScene = [&] { ball.setTranslation(fcl::Vector3d(1.5, 0, -5)); };
  std::vector<double> times;
  const auto handle = [&](double time, const auto& impact) {
    if (impact.object_a == &ball || impact.object_b == &ball) times.push_back(time);
  };
#include "options_4_code.inc"
  EXPECT_THAT(times, testing::ElementsAre(testing::DoubleNear((5 - 0.11) / 10, 1e-8)));
}

TEST(Options, PairsThatLive) {
  const fcl_fibers::FiberPolylines scene = crossing();
  const Objects objects(scene);
  const Fiber& fiber = objects.fibers[0];
  fcl::CollisionObjectd ball(std::make_shared<fcl::Sphered>(0.01), fcl::Matrix3d::Identity(),
                             fcl::Vector3d(1.5, 0, 5));
  const auto moveScene = [&] { ball.setTranslation(fcl::Vector3d(1.5, 0, 0)); };
  int pushes = 0;
  const auto push = [&](const auto& /*a*/, const auto& b, double& kept) {
    EXPECT_EQ(kept, 0);
    if (&b == &ball) ++pushes;
  };
#include "options_5_code.inc"
  EXPECT_GT(pushes, 0);
}

TEST(Contacts, OfATreeAndOfAManager) {
  const fcl_fibers::FiberPolylines scene = crossing();
  const auto fibers = fiberArrays(scene);
  fcl_fibers::FiberTreeOptions options;
  options.report = fcl_fibers::Report::kCapsules;
  options.ignored_neighbors = 1;
  fcl_fibers::FiberTree tree(options);
  tree.build(fibers);
  const Objects objects(scene);
  fcl_fibers::FiberManagerOptions same;
  same.report = options.report;
  same.ignored_neighbors = options.ignored_neighbors;
  fcl_fibers::LayeredAABBTreeCollisionManagerd manager(same);
  for (const Fiber& fiber : objects.fibers) manager.registerFiber(fiber);
  std::vector<fcl_fibers::Contact> solved;
  const auto solve = [&](const fcl_fibers::Contact& contact) { solved.push_back(contact); };
#include "contacts_0_code.inc"
#include "contacts_4_code.inc"
  ASSERT_EQ(solved.size(), 2U);
  for (const fcl_fibers::Contact& contact : solved) {
    EXPECT_EQ(contact.b.fiber, 1U);
    EXPECT_NEAR(contact.distance, 0.15 - 2 * 0.1, 1e-12);
  }
}

TEST(Threads, AddUpForThemselves) {
  using fcl_fibers::FiberTree;
  const fcl_fibers::FiberPolylines scene = crossing();
  const auto fibers = fiberArrays(scene);
  fcl_fibers::FiberTreeOptions options;
  options.report = fcl_fibers::Report::kCapsules;
  options.ignored_neighbors = 1;
  options.threads = 2;
  FiberTree tree(options);
  tree.build(fibers);
  // clang-format off
#include "options_7_code.inc"
  // clang-format on
  EXPECT_NEAR(*std::min_element(deepest.begin(), deepest.end()), 0.15 - 2 * 0.1, 1e-12);
}

TEST(LivePairs, OfTheTutorial) {
  fcl_fibers::FiberPolylines scene = crossing();
  auto fibers = fiberArrays(scene);
  fcl_fibers::FiberTree other;
  const auto others = fibers;
  other.build(others);
  const double corners[] = {-1, -1, 0, 1, -1, 0, 0, 1, 0};
  const std::int32_t triangle[] = {0, 1, 2};
  fcl_fibers::TriangleMesh head(fcl_fibers::MeshArrays<double>{corners, 3, triangle, 1});
  const fcl_fibers::MeshPose pose = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, -0.05}};
  std::vector<double> safe(scene.points.size(), 1);
  int pushes = 0;
  const auto moveFibers = [&] { scene.points[5][2] = scene.points[6][2] = 0.125; };
  const auto push = [&](const fcl_fibers::Contact& contact, auto& slid) {
    EXPECT_NEAR(contact.distance, 0.125 - 2 * 0.1, 1e-12);
    EXPECT_EQ(slid.x, 0);
    ++pushes;
  };
  // clang-format off
#include "live_pairs_0_code.inc"
#include "live_pairs_1_code.inc"
#include "live_pairs_2_code.inc"
#include "live_pairs_4_code.inc"
#include "live_pairs_5_code.inc"
#include "live_pairs_6_code.inc"
  // clang-format on
  EXPECT_EQ(pairs.size(), 1u);
  EXPECT_EQ(contacts.size(), 1u);
  EXPECT_EQ(pushes, 1);
  EXPECT_EQ(contacts_of_both.size(), of_both.count());
  EXPECT_GT(of_both.count(), 2u);
  EXPECT_GT(on_mesh.size(), 1u);
  EXPECT_EQ(*std::min_element(safe.begin(), safe.end()), 0);
}

TEST(Contacts, WithTheGround) {
  using namespace fcl_fibers;
  const double points[] = {0, 0, 0.02, 1, 0, 0.5}, its_radius = 0.05;
  const std::size_t begin[] = {0, 2};
  const FiberArrays<double> fibers = {points, 2, begin, 1, &its_radius};
  FiberTree tree;
  tree.build(fibers);
  std::vector<double> pushed;
  const auto push = [&](std::int32_t segment, double s, const Point& normal, double depth) {
    pushed = {static_cast<double>(segment), s, normal[2], depth};
  };
  // clang-format off
#include "contacts_1_code.inc"
  // clang-format on
  EXPECT_THAT(pushed, testing::ElementsAre(0, 0, -1, testing::DoubleNear(0.03, 1e-12)));
}

TEST(Contacts, OfASolver) {
  using namespace fcl_fibers;
  const FiberPolylines scene = crossing();
  const auto fibers = fiberArrays(scene);
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = 1;
  FiberTree tree(options);
  tree.build(fibers);
  const double stiffness = 10;
  // clang-format off
#include "contacts_2_code.inc"
  // clang-format on
  ASSERT_EQ(contacts.size(), 1U);
  const ContactNodes<4> nodes = contacts[0].nodes();
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& force = forces[static_cast<std::size_t>(nodes.points[k])];
    const double along = (k < 2 ? -1 : 1) * nodes.weights[k] * 10 * 0.05;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(force[axis], along * contacts[0].normal[axis], 1e-12);
    }
  }
  std::vector<double> printed;
  const auto print = [&](auto a, auto b, auto count, double distance) {
    printed = {static_cast<double>(a), static_cast<double>(b), static_cast<double>(count),
               distance};
  };
  // clang-format off
#include "contacts_3_code.inc"
  // clang-format on
  EXPECT_THAT(printed, testing::ElementsAre(0, 1, 1, testing::DoubleNear(0.15 - 2 * 0.1, 1e-12)));
}

TEST(Contacts, PointsAreFibersWithoutLength) {
  using namespace fcl_fibers;
  struct Point {
    double x, y, z;
  };
  const std::vector<Point> points = {{0.05, 0, 0.5}, {0.7, 0, 0.5}, {5, 0, 0.5}};
  const double axis[] = {0, 0, 0, 0, 0, 1}, its_radius = 0.1;
  const std::size_t its_begin[] = {0, 2};
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  FiberTree tree(options), cloud(options);
  tree.build(FiberArrays<double>{axis, 2, its_begin, 1, &its_radius});
  std::vector<SegmentPair> pairs, near;
  // clang-format off
#include "contacts_5_code.inc"
  // clang-format on
  cloud.find(Nearest{1.0}, tree, near);
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].a / 2, 0);
  EXPECT_EQ(near.size(), 2U);
}

TEST(Files, FibersFromAFile) {
  fcl_fibers::io::FileBytes bytes;
  bytes.zeros(160).setLittle(0, 4.0F).setLittle(4, 2U).setLittle(8, 4U).setLittle(12, 160U);
  for (const fcl_fibers::Point& point : crossing().points) {
    for (const double coordinate : point) bytes.little(static_cast<float>(coordinate));
    bytes.little(0.0F);
  }
  std::ofstream("ponytail.tfx", std::ios::binary) << bytes.bytes();
  fcl_fibers::FiberTree tree;
  fcl_fibers::LayeredAABBTreeCollisionManagerd manager;
#include "files_0_code.inc"
  EXPECT_EQ(tree.segmentCount(), 6U);
  EXPECT_EQ(manager.size(), 6U);
  EXPECT_EQ(manager.fiberSegment(objects.back().get()).fiber, 1U);
  EXPECT_EQ(file.fibers.radius, 0.05);
  std::filesystem::remove("ponytail.tfx");
}

TEST(Files, AMeshFromAFile) {
  std::ofstream("head.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                               "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
  using namespace fcl_fibers;
#include "files_1_code.inc"
  EXPECT_EQ(head.triangleCount(), 4U);
  EXPECT_EQ(head.kind(), TriangleMesh::Kind::kSolid);
  std::filesystem::remove("head.obj");
}

TEST(Options, AClosedCableAndAHead) {
  const fcl_fibers::FiberPolylines scene = square();
  const Objects objects(scene);
  const Fiber& cable = objects.fibers[0];
  const double radius = scene.radius;
  fcl::CollisionObjectd head(std::make_shared<fcl::Sphered>(0.2), fcl::Matrix3d::Identity(),
                             fcl::Vector3d(0.5, 0.2, 0));
  PairList data;
#include "options_0_code.inc"
  EXPECT_THAT(data, testing::ElementsAre(std::pair(cable[0], &head)));
}

}  // namespace
