// SPDX-License-Identifier: BSD-3-Clause

// One program twice: with FCL's dynamic tree, and with the one line changed that names the manager.
//
//     swap [FOLDER]    also writes what tutorials.py draws to the folder
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/narrowphase/collision.h>
#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/io/export_geometry.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

namespace {

using Objects = std::vector<std::unique_ptr<fcl::CollisionObjectd>>;

/// A lock of 60 curls of 100 segments, turned by an angle. Lengths are in centimetres.
fcl_fibers::FiberPolylines curls(double angle) {
  fcl_fibers::FiberPolylines lock;
  lock.radius = 0.02;
  for (int curl = 0; curl < 60; ++curl) {
    for (int i = 0; i <= 100; ++i) {
      const double turn = 0.25 * i + 0.07 * curl + angle;
      lock.points.push_back(
          {std::cos(turn) + 0.3 * (curl % 8), std::sin(turn) + 0.3 * (curl / 8), 0.15 * i});
    }
    lock.point_begin.push_back(lock.points.size());
  }
  return lock;
}

// [callback]
struct Pairs {
  std::size_t tested = 0, touching = 0;
};

bool countTouching(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* cdata) {
  auto& pairs = *static_cast<Pairs*>(cdata);
  fcl::CollisionResultd result;
  ++pairs.tested;
  if (fcl::collide(a, b, fcl::CollisionRequestd(), result) > 0) ++pairs.touching;
  return false;
}
// [callback]

// [program]
/// Counts pairs at rest and after a motion.
template <class Manager>
void run(const char* name, const Objects& objects) {
  const auto start = std::chrono::steady_clock::now();
  fcl_fibers::moveObjects(curls(0), objects);
  Manager manager;  // the line that changes
  for (const auto& object : objects) manager.registerObject(object.get());
  manager.setup();
  Pairs before, after;
  manager.collide(&before, countTouching);

  fcl_fibers::moveObjects(curls(0.5), objects);
  manager.update();
  manager.collide(&after, countTouching);
  const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
  std::printf("%s: %zu of %zu pairs touch, then %zu of %zu; %.0f ms\n", name, before.touching,
              before.tested, after.touching, after.tested, time.count());
}
// [program]

void write(const std::string& folder) {
  const fcl_fibers::FiberPolylines lock = curls(0);
  const auto arrays = fcl_fibers::fiberArrays(lock);
  fcl_fibers::FiberTree tree;
  tree.build(arrays);
  std::vector<fcl_fibers::Contact> contacts;
  tree.visit(fcl_fibers::Pairs{}, [&](fcl_fibers::SegmentPair pair) {
    contacts.push_back(fcl_fibers::capsuleContact(arrays, pair));
  });
  fcl_fibers::io::exportFibers(folder + "/swap_fibers.vtp", lock);
  fcl_fibers::io::exportContacts(folder + "/swap_contacts.vtp", contacts);
}

}  // namespace

int main(int argc, char** argv) {
  const Objects objects = fcl_fibers::makeObjects<double>(curls(0));
  run<fcl::DynamicAABBTreeCollisionManagerd>("FCL's dynamic AABB tree", objects);
  run<fcl_fibers::LayeredAABBTreeCollisionManagerd>("layered AABB tree", objects);
  if (argc > 1) write(argv[1]);
  return 0;
}
