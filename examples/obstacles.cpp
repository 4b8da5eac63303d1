// SPDX-License-Identifier: BSD-3-Clause

// Grass against a ball, a box and a rock. Blades never meet each other. Lengths are in metres.
//
//     obstacles [FOLDER]    also writes what tutorials.py draws to the folder
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/geometric_shape_to_BVH_model.h>
#include <fcl_fibers/contact_collector.h>
#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/io/export_geometry.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

namespace {

using Manager = fcl_fibers::LayeredAABBTreeCollisionManagerd;
using Collector = fcl_fibers::ContactCollector<double>;

/// 30 x 30 blades, 3 cm apart, which bend in the wind.
fcl_fibers::FiberPolylines grass() {
  fcl_fibers::FiberPolylines blades;
  blades.radius = 0.003;
  for (int blade = 0; blade < 900; ++blade) {
    const double x = 0.03 * (blade % 30), y = 0.03 * (blade / 30);
    const double wind = 1 + 0.5 * std::sin(9 * x + 5 * y);
    for (int i = 0; i <= 8; ++i) {
      const double height = 0.025 * i;
      blades.points.push_back({x + wind * height * height, y, height});
    }
    blades.point_begin.push_back(blades.points.size());
  }
  return blades;
}

fcl::CollisionObjectd placed(std::shared_ptr<fcl::CollisionGeometryd> shape, double x, double y) {
  return {shape, fcl::Matrix3d::Identity(), fcl::Vector3d(x, y, 0.08)};
}

void print(const char* name, const fcl::CollisionObjectd& obstacle, const Collector& collector) {
  std::size_t count = 0;
  const fcl_fibers::Contact* deepest = nullptr;
  for (const auto& contact : collector.contacts()) {
    if (contact.object_b != &obstacle) continue;
    ++count;
    if (deepest == nullptr || contact.distance < deepest->distance) deepest = &contact;
  }
  if (deepest == nullptr) return;
  std::printf("  %s: %zu contacts, the deepest %.1f mm at blade %zu, segment %zu\n", name, count,
              -1000 * deepest->distance, deepest->a.fiber, deepest->a.number);
}

}  // namespace

int main(int argc, char** argv) {
  const fcl_fibers::FiberPolylines blades = grass();
  const auto objects = fcl_fibers::makeObjects<double>(blades);

  const auto mesh = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  fcl::generateBVHModel(*mesh, fcl::Ellipsoidd(0.12, 0.09, 0.08), fcl::Transform3d::Identity(), 16,
                        12);
  fcl::CollisionObjectd ball = placed(std::make_shared<fcl::Sphered>(0.08), 0.21, 0.21);
  fcl::CollisionObjectd box = placed(std::make_shared<fcl::Boxd>(0.2, 0.12, 0.1), 0.65, 0.23);
  fcl::CollisionObjectd rock = placed(mesh, 0.45, 0.65);
  fcl_fibers::FiberManagerOptions options;
  options.report = fcl_fibers::Report::kCapsules;

  // [two]
  Manager grass_manager(options), obstacle_manager(options);
  for (const auto& blade : fcl_fibers::objectsByFiber(blades, objects)) {
    grass_manager.registerFiber(blade.objects);
  }
  obstacle_manager.registerObjects({&ball, &box, &rock});

  Collector between(grass_manager, &obstacle_manager);
  grass_manager.collide(&obstacle_manager, &between, Collector::callback);
  std::printf("two managers: %zu contacts\n", between.contacts().size());
  print("ball", ball, between);
  print("box", box, between);
  print("rock", rock, between);
  // [two]

  // [one]
  Manager all(options);
  for (const auto& blade : fcl_fibers::objectsByFiber(blades, objects)) {
    all.registerFiber(blade.objects, blade.ends, fcl_fibers::FiberGroup{1});
  }
  all.registerObjects({&ball, &box, &rock});

  Collector within(all);
  all.collide(&within, Collector::callback);
  std::printf("one manager, all blades in one group: %zu contacts\n", within.contacts().size());
  // [one]

  if (argc > 1) {
    const std::string folder = argv[1];
    fcl_fibers::io::exportFibers(folder + "/obstacles_fibers.vtp", blades);
    fcl_fibers::io::exportContacts(folder + "/obstacles_contacts.vtp",
                                   {between.contacts().begin(), between.contacts().end()});
  }
  return 0;
}
