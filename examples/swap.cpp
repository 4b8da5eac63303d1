// SPDX-License-Identifier: BSD-3-Clause

// A program that FCL's dynamic tree served, and the same program with the one line changed that
// names its manager: the same answers, sooner.
#include <chrono>
#include <cstdio>
#include <memory>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/narrowphase/collision.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/scenes/strand.h>

namespace {

bool countTouching(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* cdata) {
  fcl::CollisionResultd result;
  if (fcl::collide(a, b, fcl::CollisionRequestd(), result) > 0) ++*static_cast<int*>(cdata);
  return false;
}

/// Touching pairs of a lock of 60 hairs at rest and after a motion.
template <class Manager>
std::vector<int> touchingPairs() {
  namespace scenes = fcl_fibers::scenes;
  scenes::StrandParameters parameters;
  parameters.fibers = 60;
  const auto hairs = scenes::makeObjects<double>(scenes::makeStrand(parameters));
  parameters.frame = 1;
  const auto poses = scenes::segmentPoses<double>(scenes::makeStrand(parameters));

  std::vector<fcl::CollisionObjectd*> objects;
  for (const auto& hair : hairs) objects.push_back(hair.get());

  Manager manager;  // the line
  manager.registerObjects(objects);
  manager.setup();
  std::vector<int> touching(2);
  manager.collide(&touching[0], countTouching);

  for (std::size_t i = 0; i < objects.size(); ++i) {
    objects[i]->setTransform(poses[i]);
    objects[i]->computeAABB();
  }
  manager.update();
  manager.collide(&touching[1], countTouching);
  return touching;
}

template <class Manager>
std::vector<int> timed(const char* name) {
  const auto start = std::chrono::steady_clock::now();
  const std::vector<int> touching = touchingPairs<Manager>();
  const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
  std::printf("%s: %d, then %d touching pairs, %.0f ms\n", name, touching[0], touching[1],
              time.count());
  return touching;
}

}  // namespace

int main() {
  const auto before = timed<fcl::DynamicAABBTreeCollisionManagerd>("FCL's dynamic AABB tree");
  const auto after = timed<fcl_fibers::LayeredAABBTreeCollisionManagerd>("layered AABB tree");
  return before == after ? 0 : 1;
}
