// SPDX-License-Identifier: BSD-3-Clause

// Two fibers of three segments that cross in their middle, and one callback.
#include <cstdio>
#include <memory>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

using Manager = fcl_fibers::LayeredAABBTreeCollisionManagerd;
using Object = fcl::CollisionObjectd;

namespace {

bool printPair(Object* a, Object* b, void* cdata) {
  const auto& manager = *static_cast<const Manager*>(cdata);
  const auto p = manager.fiberSegment(a), q = manager.fiberSegment(b);
  std::printf("fiber %zu segment %zu touches fiber %zu segment %zu\n", p.fiber, p.segment, q.fiber,
              q.segment);
  return false;  // true would end the query
}

}  // namespace

int main() {
  const auto capsule = std::make_shared<fcl::Capsuled>(/*radius=*/0.1, /*lz=*/1.0);  // along z
  fcl::Quaterniond along_x;
  along_x.setFromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX());
  std::vector<std::unique_ptr<Object>> objects;
  for (const double middle : {-1.0, 0.0, 1.0}) {
    objects.push_back(std::make_unique<Object>(capsule));
    objects.back()->setTranslation({0, 0, middle});
  }
  for (const double middle : {-1.0, 0.0, 1.0}) {
    objects.push_back(std::make_unique<Object>(capsule));
    objects.back()->setTransform(along_x, {middle, 0.15, 0});
  }

  fcl_fibers::FiberManagerOptions options;
  options.report = fcl_fibers::Report::kCapsules;  // capsules that touch, not boxes that overlap
  options.ignored_neighbors = 1;                   // adjacent segments always do

  Manager manager(options);
  manager.registerFiber({objects[0].get(), objects[1].get(), objects[2].get()});
  manager.registerFiber({objects[3].get(), objects[4].get(), objects[5].get()});
  manager.collide(&manager, printPair);

  objects[4]->setTranslation({0, 0.3, 0});  // moved out of reach; no computeAABB() for capsules
  manager.update();
  manager.collide(&manager, printPair);
  return 0;
}
