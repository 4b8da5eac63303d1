// SPDX-License-Identifier: BSD-3-Clause

// Swaps FCL's dynamic tree for the fiber managers, through FCL's interface, with fibers and a mesh.
// Exits with failure if one of them misses a pair that the others have, or a contact with the mesh.
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/geometric_shape_to_BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl_fibers/contact_collector.h>
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

  const auto mesh = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  const fcl::Transform3d middle(Eigen::Translation3d(1, 0, 5));
  fcl::generateBVHModel(*mesh, fcl::Sphered(0.9), middle, 32, 16);
  fcl::CollisionObjectd ball(mesh);

  fcl_fibers::FiberManagerOptions options;
  options.report = fcl_fibers::Report::kCapsules;
  fcl::DynamicAABBTreeCollisionManagerd fcl_tree;
  fcl_fibers::LayeredAABBTreeCollisionManagerd boxes(options);
  fcl_fibers::WrappedSphereTreeCollisionManagerd spheres;
  fcl_tree.registerObject(&ball);
  boxes.registerObstacle(&ball, {/*solid=*/true});
  spheres.registerObject(&ball);
  const std::size_t expected = touchingPairs(fcl_tree, objects);
  const std::size_t by_boxes = touchingPairs(boxes, objects);
  const std::size_t by_spheres = touchingPairs(spheres, objects);
  std::printf("touching pairs: FCL's tree %zu, boxes %zu, spheres %zu\n", expected, by_boxes,
              by_spheres);

  fcl_fibers::ContactCollector<double> collector(boxes);
  boxes.collide(&ball, &collector, collector.callback);
  std::size_t inside = 0;
  for (const auto& contact : collector.contacts()) inside += contact.triangle >= 0 && contact.solid;
  std::printf("contacts with the mesh: %zu, of the solid: %zu\n", collector.contacts().size(),
              inside);
  const bool has_contacts = inside > 0 && inside < collector.contacts().size();
  return expected > 0 && by_boxes == expected && by_spheres == expected && has_contacts ? 0 : 1;
}
