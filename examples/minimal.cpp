// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <memory>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl_fibers/contact_collector.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

int main() {
  // Two fibers of three segments that cross in the middle.
  const auto capsule = std::make_shared<fcl::Capsuled>(/*radius=*/0.1, /*lz=*/1.0);
  std::vector<fcl::CollisionObjectd> upright(3, fcl::CollisionObjectd(capsule)), lying = upright;
  fcl::Matrix3d from_z_to_x;
  from_z_to_x << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  double middle = -1;
  for (auto& segment : upright) segment.setTranslation({0, 0, middle++});
  middle = -1;
  for (auto& segment : lying) segment.setTransform(from_z_to_x, {middle++, 0.15, 0});

  fcl_fibers::FiberManagerOptions options;
  options.report = fcl_fibers::Report::kCapsules;  // capsules that touch, not boxes that overlap
  options.ignored_neighbors = 1;  // neighbors along a fiber share a point, so they always touch
  fcl_fibers::LayeredAABBTreeCollisionManagerd manager(options);
  manager.registerFiber({&upright[0], &upright[1], &upright[2]});
  manager.registerFiber({&lying[0], &lying[1], &lying[2]});

  fcl_fibers::ContactCollector<double> collector(manager);
  manager.collide(&collector, collector.callback);  // or your own FCL callback
  for (const auto& contact : collector.contacts()) {
    std::printf("fiber %zu segment %zu touches fiber %zu segment %zu, %.2f deep\n", contact.a.fiber,
                contact.a.segment, contact.b.fiber, contact.b.segment, -contact.distance);
  }
}
