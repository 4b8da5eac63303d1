// SPDX-License-Identifier: BSD-3-Clause

// One program twice: with FCL's dynamic tree, and with the one line changed that names the manager.
// Prints that the answers are the same, and how many times as fast they come.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/narrowphase/collision.h>
#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

namespace {

using Poses = std::vector<fcl::Transform3d>;

/// A lock of 60 curls of 100 segments, turned by an angle. Lengths are in centimetres.
fcl_fibers::FiberPolylines curls(double angle) {
  fcl_fibers::FiberPolylines lock;
  lock.radius = 0.0035;
  for (int curl = 0; curl < 60; ++curl) {
    for (int i = 0; i <= 100; ++i) {
      const double turn = 0.25 * i + 0.01 * curl + angle;
      lock.points.push_back(
          {std::cos(turn) + 0.05 * (curl % 8), std::sin(turn) + 0.05 * (curl / 8), 0.15 * i});
    }
    lock.point_begin.push_back(lock.points.size());
  }
  return lock;
}

struct Hairs {
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> owned;
  std::vector<fcl::CollisionObjectd*> objects;
  Poses at_rest, moved;

  Hairs() {
    owned = fcl_fibers::makeObjects<double>(curls(0));
    for (const auto& object : owned) objects.push_back(object.get());
    at_rest = fcl_fibers::segmentPoses<double>(curls(0));
    moved = fcl_fibers::segmentPoses<double>(curls(0.1));
  }

  void move(const Poses& poses) {
    for (std::size_t i = 0; i < objects.size(); ++i) {
      objects[i]->setTransform(poses[i]);
      objects[i]->computeAABB();
    }
  }
};

bool countTouching(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* cdata) {
  fcl::CollisionResultd result;
  if (fcl::collide(a, b, fcl::CollisionRequestd(), result) > 0) ++*static_cast<int*>(cdata);
  return false;
}

/// Touching pairs at rest and after a motion.
template <class Manager>
std::vector<int> touchingPairs(Hairs& hairs) {
  hairs.move(hairs.at_rest);
  Manager manager;  // the line
  manager.registerObjects(hairs.objects);
  manager.setup();
  std::vector<int> touching(2);
  manager.collide(&touching[0], countTouching);

  hairs.move(hairs.moved);
  manager.update();
  manager.collide(&touching[1], countTouching);
  return touching;
}

struct Run {
  std::vector<int> touching;
  double milliseconds = std::numeric_limits<double>::infinity();  ///< of the fastest of three
};

template <class Manager>
Run timed(const char* name, Hairs& hairs) {
  Run run;
  for (int i = 0; i < 3; ++i) {
    const auto start = std::chrono::steady_clock::now();
    run.touching = touchingPairs<Manager>(hairs);
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
    run.milliseconds = std::min(run.milliseconds, time.count());
  }
  std::printf("%s: %d, then %d touching pairs, %.0f ms\n", name, run.touching[0], run.touching[1],
              run.milliseconds);
  return run;
}

}  // namespace

int main() {
  Hairs hairs;
  const Run before = timed<fcl::DynamicAABBTreeCollisionManagerd>("FCL's dynamic AABB tree", hairs);
  const Run after = timed<fcl_fibers::LayeredAABBTreeCollisionManagerd>("layered AABB tree", hairs);
  if (before.touching != after.touching || before.touching[0] == 0 || before.touching[1] == 0) {
    std::printf("the answers differ, or there are none\n");
    return 1;
  }
  std::printf("the same answers, %.1f times as fast\n", before.milliseconds / after.milliseconds);
  return 0;
}
