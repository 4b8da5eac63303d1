// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>

#include <fcl_fibers/fiber_tree.h>

#include "arrays/array_fibers.h"
#include "support/allocation_faults.h"
#include "support/managers_under_test.h"
#include "support/mesh_models.h"
#include "support/pair_queries.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

/// What is said of memory is what `operator new` gave since then, to a twentieth.
void expectBytes(std::size_t said, std::size_t live_before) {
  const auto live = static_cast<double>(liveBytes() - live_before);
  EXPECT_NEAR(static_cast<double>(said), live, 0.05 * live);
}

TEST(TreeMemory, IsWhatTheHeapGave) {
  // If this fails, a program that counts on memoryUsage() runs out of memory.
  constexpr int kFibers = 150, kPoints = 60;
  Random random(188);
  Assembly<double> fibers;
  for (int f = 0; f < kFibers; ++f) {
    Eigen::Vector3d point = random.inCube(2);
    for (int i = 0; i < kPoints; ++i) {
      fibers.addPoint({point.x(), point.y(), point.z()}, 0.02);
      point += 0.1 * random.direction();
    }
    fibers.endFiber();
  }
  const std::vector<std::uint8_t> closed(kFibers, 1);
  std::vector<std::int32_t> groups;
  for (int f = 0; f < kFibers; ++f) groups.push_back(f % 5);
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    for (FiberTreeOptions options : allKinds(report)) {
      for (const int threads : {1, 2}) {
        SCOPED_TRACE(threads);
        options.threads = threads;
        FiberArrays<double> arrays = fibers.view();
        if (threads == 2) {
          options.ignored_arc_length = 0.1;
          arrays.closed = closed.data();
          arrays.groups = groups.data();
        }
        std::size_t pairs = 0;
        const auto count = [&](SegmentPair) { ++pairs; };
        FiberTree(options).visit(Pairs{}, count);  // what threads need once is not the tree's
        const std::size_t live_before = liveBytes();
        FiberTree tree(options);
        tree.build(arrays);
        expectBytes(tree.memoryUsage(), live_before);
        tree.visit(Pairs{}, count);
        EXPECT_GT(pairs, 100u);
        expectBytes(tree.memoryUsage(), live_before);
        tree.update(arrays);
        tree.visit(Pairs{}, count);
        expectBytes(tree.memoryUsage(), live_before);
      }
    }
  }
}

TEST(TreeMemory, OfABuildIsLittleMoreThanTheTrees) {
  // If this fails, a scene whose tree has room on a machine cannot be built there.
  constexpr int kFibers = 1000, kPoints = 101;
  Random random(192);
  Assembly<float> fibers;
  for (int f = 0; f < kFibers; ++f) {
    const Eigen::Vector3d root = random.inCube(2);
    for (int i = 0; i < kPoints; ++i) {
      fibers.addPoint({root.x(), root.y(), root.z() + 0.1 * i}, 0.02);
    }
    fibers.endFiber();
  }
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberTree tree(FiberOptions{Topology::kBundle, report});
    const PeakMemory peak;
    tree.build(fibers.view());
    EXPECT_LE(peak.bytes(), tree.memoryUsage() + 16 * tree.segmentCount());
  }
}

MANAGER_SUITE(ManagerMemory, FiberManagers);

TYPED_TEST(ManagerMemory, OfADenseQueryIsBoundedAndGivenBack) {
  // If this fails, one frame in which much hair lies in one place takes hundreds of megabytes, and
  // keeps them.
  using S = typename TypeParam::Scalar;
  Scene<S> scene = soupScene<S>(20000, 0.01, 191);  // so that windows are large when it comes
  for (int i = 0; i < 6000; ++i) scene.addCapsule({2, 0, 0}, {2, 0, 1}, 0.1);
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberManagerOptions options;
    options.report = report;
    options.threads = 2;
    const auto manager = TypeParam::make(options);
    manager->registerObjects(scene.objects());
    manager->setup();
    struct Count {
      std::size_t calls = 0, most = 0;
    } count;
    const std::size_t live_before = liveBytes(), said_before = manager->memoryUsage();
    manager->collide(&count, [](fcl::CollisionObject<S>*, fcl::CollisionObject<S>*, void* data) {
      auto& seen = *static_cast<Count*>(data);
      if (++seen.calls % 4096 == 0) seen.most = std::max(seen.most, liveBytes());
      return false;
    });
    EXPECT_GT(count.calls, 17'000'000u);  // 144 megabytes
    EXPECT_LE(count.most, live_before + (std::size_t{64} << 20));
    // Less than before, if a thread that was called for an earlier task has come only now.
    const double kept = double(liveBytes()) - double(live_before);
    EXPECT_LE(kept, double(5 << 20));
    EXPECT_NEAR(double(manager->memoryUsage() - said_before), kept, 0.05 * std::abs(kept) + 4096);
  }
}

TYPED_TEST(ManagerMemory, IsWhatTheHeapGave) {
  // If this fails, a program that counts on memoryUsage() runs out of memory.
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(60, 80, 189);
  const Scene<S> late = strandScene<S>(1, 40, 190);
  std::vector<FiberManagerOptions> all(3);
  all[1].report = Report::kCapsules;
  all[1].ignored_arc_length = 0.1;
  all[2].report = Report::kCapsules;
  all[2].threads = 2;
  for (const FiberManagerOptions& options : all) {
    SCOPED_TRACE(describe(options));
    selfPairs<S>(*TypeParam::make(options));  // what threads need once is not the manager's
    const std::size_t live_before = liveBytes();
    const auto manager = TypeParam::make(options);
    registerFibers<S>(*manager, scene, {1, 2, 1});
    expectBytes(manager->memoryUsage(), live_before);
    EXPECT_GT(selfPairs<S>(*manager).size(), 100u);
    expectBytes(manager->memoryUsage(), live_before);
    manager->update({scene[0], scene[77], scene[500]});
    EXPECT_GT(selfPairs<S>(*manager).size(), 100u);
    expectBytes(manager->memoryUsage(), live_before);
    manager->registerObjects(late.objects());  // few: kept beside the tree
    manager->unregisterObject(scene[3]);
    EXPECT_GT(selfPairs<S>(*manager).size(), 100u);
    expectBytes(manager->memoryUsage(), live_before);
  }
}

TYPED_TEST(ManagerMemory, OfMeshesThatAreGoneIsGivenBack) {
  // If this fails, a program whose obstacles come and go runs out of memory.
  using S = typename TypeParam::Scalar;
  using Object = fcl::CollisionObject<S>;
  enum How { kNoUpdate, kOneUpdates, kBothUpdate, kOfObject, kForContacts };
  const MeshShape shape{{{-1, -1, 0.5}, {1, -1, 0.5}, {0, 1, 0.5}}, {{0, 1, 2}}};
  FiberManagerOptions options, its_options;
  options.report = Report::kCapsules;
  for (const How how : {kNoUpdate, kOneUpdates, kBothUpdate, kOfObject, kForContacts}) {
    its_options.report = how == kForContacts ? Report::kVolumes : Report::kCapsules;
    SCOPED_TRACE(how);
    Scene<S> scene;
    auto* const own = scene.addCapsule({0, 0, 0}, {0, 0, 1}, 0.1);
    auto* const theirs = scene.addCapsule({0, 0, 0}, {0, 0, 1}, 0.1);
    const auto manager = TypeParam::make(options), other = TypeParam::make(its_options);
    manager->registerObject(own);
    other->registerObject(theirs);
    std::vector<MeshContact> contacts;
    const auto meet = [&] {
      Object mesh(makeModel<S>(fcl::BV_AABB, shape));
      EXPECT_EQ(pairsWith(*manager, mesh).size(), 1u);
      other->registerObject(&mesh);
      EXPECT_EQ(pairsWith(*manager, *other).size(), 2u);
      EXPECT_EQ(pairsWith(*other, *manager).size(), 2u);
      if (how == kOneUpdates) other->update();
      if (how == kBothUpdate) {
        manager->update();
        other->update();
      }
      if (how == kOfObject) {
        manager->update(own);
        other->update(&mesh);
        Object copy(*theirs), same(mesh);
        const auto clone = cloneOf<S>(*other, {&copy, &same});
        EXPECT_EQ(pairsWith(*manager, *clone).size(), 2u);
      }
      if (how == kForContacts) {
        EXPECT_EQ(manager->margin(&mesh), 0);
        EXPECT_EQ(other->margin(&mesh), 0);
        EXPECT_TRUE(manager->findMeshContacts(own, &mesh, 0, contacts));
        EXPECT_TRUE(other->findMeshContacts(theirs, &mesh, 0, contacts));
      }
      other->unregisterObject(&mesh);
    };
    // What is gone may stay until more has come.
    struct Most {
      std::size_t said, live;
    };
    const auto mostOf = [&](int rounds) {
      Most most{0, 0};
      for (int i = 0; i < rounds; ++i) {
        meet();
        most.said = std::max(most.said, manager->memoryUsage() + other->memoryUsage());
        most.live = std::max(most.live, liveBytes());
      }
      return most;
    };
    const Most first = mostOf(100);
    for (int i = 100; i < 1900; ++i) meet();
    const Most last = mostOf(100);
    // Trees of as many segments differ by some nodes. A byte for each round would be more.
    EXPECT_LE(last.said, first.said + 1024);
    EXPECT_LE(last.live, first.live + 1024);
  }
}

TYPED_TEST(ManagerMemory, OfMeshesThatAreAskedAboutAgainStays) {
  // If this fails, each query reads all triangles of each mesh that another manager has.
  using S = typename TypeParam::Scalar;
  FiberManagerOptions options, by_volumes;
  options.report = Report::kCapsules;
  const MeshShape shape = blob(1, 0, 12, 9);
  constexpr std::size_t kCount = 12;
  Scene<S> scene, shapes;
  auto* const own = scene.addCapsule({0, 0, 0}, {0, 0, 1.5}, 0.1);
  for (std::size_t i = 0; i < kCount; ++i) {
    shapes.add(makeModel<S>(fcl::BV_AABB, shape), fcl::Transform3<S>::Identity());
  }
  const auto makeWith = [](const FiberManagerOptions& its, const auto& objects) {
    auto made = TypeParam::make(its);
    made->registerObjects(objects);
    made->setup();
    return made;
  };
  const auto manager = makeWith(options, scene.objects()),
             other = makeWith(options, shapes.objects()),
             counting_volumes = makeWith(by_volumes, shapes.objects());
  const auto alone = makeWith(options, std::vector<fcl::CollisionObject<S>*>{shapes[0]});
  const std::size_t mesh = alone->memoryUsage();
  EXPECT_GT(mesh, shape.triangles.size() * 3 * sizeof(std::int32_t));

  // The other manager's readings are this one's, too.
  std::size_t live = liveBytes();
  EXPECT_EQ(pairsWith(*manager, *other).size(), kCount);
  EXPECT_LT(liveBytes(), live + mesh);
  // A manager that counts volumes has none.
  live = liveBytes();
  const auto reading = makeWith(options, scene.objects());
  EXPECT_EQ(pairsWith(*reading, *counting_volumes).size(), kCount);
  EXPECT_GT(liveBytes(), live + kCount / 2 * mesh);
  std::vector<MeshContact> contacts;
  const auto askAll = [&] {
    pairsWith(*manager, *other);
    pairsWith(*reading, *counting_volumes);
    for (auto* object : shapes.objects()) {
      pairsWith(*manager, *object);
      reading->findMeshContacts(own, object, 0, contacts);
    }
  };
  askAll();
  const std::size_t said = manager->memoryUsage(), said_by_reading = reading->memoryUsage();
  for (int round = 0; round < 4; ++round) {
    SCOPED_TRACE(round);
    const PeakMemory peak;
    askAll();
    EXPECT_LT(peak.bytes(), mesh);
    EXPECT_EQ(manager->memoryUsage(), said);
    EXPECT_EQ(reading->memoryUsage(), said_by_reading);
    if (round % 2 == 0) {
      manager->update();
      reading->update();
    } else {
      other->update(shapes[3]);
      counting_volumes->update();
    }
  }

  // Two objects share what they have in common.
  auto* const twin =
      shapes.add(std::const_pointer_cast<fcl::CollisionGeometry<S>>(shapes[0]->collisionGeometry()),
                 fcl::Transform3<S>::Identity());
  alone->registerObject(twin);
  EXPECT_EQ(selfPairs(*alone).size(), 1u);
  EXPECT_LT(alone->memoryUsage(), mesh + mesh / 2);
}

TYPED_TEST(ManagerMemory, OfCylindersAndBoxesIsThatOfTheirBoxes) {
  // If this fails, a million of them take half a gigabyte.
  using S = typename TypeParam::Scalar;
  const std::shared_ptr<fcl::CollisionGeometry<S>> shapes[] = {
      std::make_shared<fcl::Cylinder<S>>(S(0.1), S(1)),
      std::make_shared<fcl::Box<S>>(S(0.2), S(0.1), S(1))};
  for (const auto& shape : shapes) {
    constexpr std::size_t kCount = 10000;
    Scene<S> scene;
    for (std::size_t i = 0; i < kCount; ++i) {
      const double x = 2.0 * static_cast<double>(i % 100), y = 2.0 * static_cast<double>(i / 100);
      scene.add(shape, makePose<S>(Eigen::Quaterniond::Identity(), {x, y, 0}));
    }
    const auto bytesOf = [&](Report report) {
      FiberManagerOptions options;
      options.report = report;
      const auto manager = TypeParam::make(options);
      const auto& all = scene.objects();
      for (auto from = all.begin(); from != all.end(); from += 100) {
        manager->registerFiber({from, from + 100});
      }
      EXPECT_TRUE(selfPairs<S>(*manager).empty());
      const std::size_t bytes = manager->memoryUsage();
      manager->update();
      EXPECT_TRUE(selfPairs<S>(*manager).empty());
      EXPECT_LE(manager->memoryUsage(), bytes + kCount);
      return bytes;
    };
    const std::size_t bytes = bytesOf(Report::kCapsules);
    // Two ends of four doubles.
    EXPECT_LE(bytes, bytesOf(Report::kVolumes) + (64 + 8) * kCount);
    if (TypeParam::make()->options().topology == Topology::kBundle) {
      EXPECT_LE(bytes, 160 * kCount);
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::test
