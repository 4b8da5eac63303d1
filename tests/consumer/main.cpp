// SPDX-License-Identifier: BSD-3-Clause

// Swaps FCL's dynamic tree for the fiber managers, through FCL's interface, and exits with failure
// if one of them misses a pair that the others have.
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/narrowphase/collision.h>
#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

namespace {

bool countTouching(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* cdata) {
  fcl::CollisionResultd result;
  *static_cast<std::size_t*>(cdata) += fcl::collide(a, b, fcl::CollisionRequestd(), result) > 0;
  return false;
}

std::size_t touchingPairs(fcl::BroadPhaseCollisionManagerd& manager,
                          const std::vector<fcl::CollisionObjectd*>& objects) {
  manager.registerObjects(objects);
  manager.setup();
  std::size_t touching = 0;
  manager.collide(&touching, countTouching);
  return touching;
}

}  // namespace

int main() {
  fcl_fibers::FiberPolylines helices;
  helices.radius = 0.05;
  for (int fiber = 0; fiber < 20; ++fiber) {
    for (int i = 0; i <= 50; ++i) {
      const double turn = 0.5 * i + fiber;
      helices.points.push_back({std::cos(turn) + 0.1 * fiber, std::sin(turn), 0.2 * i});
    }
    helices.point_begin.push_back(helices.points.size());
  }
  const auto owned = fcl_fibers::makeObjects<double>(helices);
  std::vector<fcl::CollisionObjectd*> objects;
  for (const auto& object : owned) objects.push_back(object.get());

  fcl::DynamicAABBTreeCollisionManagerd fcl_tree;
  fcl_fibers::LayeredAABBTreeCollisionManagerd boxes;
  fcl_fibers::WrappedSphereTreeCollisionManagerd spheres;
  const std::size_t expected = touchingPairs(fcl_tree, objects);
  const std::size_t by_boxes = touchingPairs(boxes, objects);
  const std::size_t by_spheres = touchingPairs(spheres, objects);
  std::printf("touching pairs: FCL's tree %zu, boxes %zu, spheres %zu\n", expected, by_boxes,
              by_spheres);
  return expected > 0 && by_boxes == expected && by_spheres == expected ? 0 : 1;
}
