// SPDX-License-Identifier: BSD-3-Clause

// A program that runs on FCL's dynamic tree, with the fiber manager beside it that it may swap to.
//
//     shadow [FILE]    also writes the record of the difference to the file
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/narrowphase/collision.h>
#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/shadow_manager.h>

namespace {

using Objects = std::vector<std::unique_ptr<fcl::CollisionObjectd>>;

/// A lock of 20 curls of 50 segments, turned by an angle. Lengths are in centimetres.
fcl_fibers::FiberPolylines curls(double angle) {
  fcl_fibers::FiberPolylines lock;
  lock.radius = 0.02;
  for (int curl = 0; curl < 20; ++curl) {
    for (int i = 0; i <= 50; ++i) {
      const double turn = 0.25 * i + 0.07 * curl + angle;
      lock.points.push_back(
          {std::cos(turn) + 0.3 * (curl % 5), std::sin(turn) + 0.3 * (curl / 5), 0.15 * i});
    }
    lock.point_begin.push_back(lock.points.size());
  }
  return lock;
}

bool countTouching(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* cdata) {
  fcl::CollisionResultd result;
  *static_cast<int*>(cdata) += fcl::collide(a, b, fcl::CollisionRequestd(), result) > 0 ? 1 : 0;
  return false;
}

/// The program, which knows FCL's interface only.
void simulate(fcl::BroadPhaseCollisionManagerd& manager, const Objects& objects) {
  for (const auto& object : objects) manager.registerObject(object.get());
  manager.setup();
  for (int step = 0; step < 3; ++step) {
    fcl_fibers::moveObjects(curls(0.1 * step), objects);
    manager.update();
    int touching = 0;
    manager.collide(&touching, countTouching);
    std::printf("step %d: %d pairs touch\n", step, touching);
  }
}

void print(const fcl_fibers::ShadowResult& result) {
  std::printf("%zu changes and %zu queries\n", result.changes, result.queries);
  std::printf("FCL's tree:  %zu pairs, %.0f ms\n", result.first.pairs, 1e3 * result.first.seconds);
  std::printf("fiber tree:  %zu pairs, %.0f ms\n", result.second.pairs,
              1e3 * result.second.seconds);
  const std::string difference = result.difference.substr(0, result.difference.find(';'));
  std::printf("difference:  %s\n", difference.empty() ? "none" : difference.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  const Objects objects = fcl_fibers::makeObjects<double>(curls(0));
  // [manager]
  fcl_fibers::ShadowOptions options;
  options.file = argc > 1 ? argv[1] : "";  // takes the record at the first difference
  // It was `fcl::DynamicAABBTreeCollisionManagerd manager;`.
  fcl_fibers::ShadowManagerd manager(std::make_unique<fcl::DynamicAABBTreeCollisionManagerd>(),
                                     fcl_fibers::FiberManagerOptions(), options);
  // [manager]
  simulate(manager, objects);
  print(manager.result());

  // What a fault of the program looks like: it moves an object and forgets computeAABB().
  objects[0]->setTranslation(objects[500]->getTranslation());
  manager.update(objects[0].get());
  int touching = 0;
  manager.collide(&touching, countTouching);
  print(manager.result());
  return 0;
}
