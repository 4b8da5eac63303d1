// SPDX-License-Identifier: BSD-3-Clause

// One long cable is wound about a head, which is a mesh in the same manager. Prints where the cable
// touches itself and where it touches the head. Lengths are in metres.
#include <cmath>
#include <cstdio>
#include <memory>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/geometric_shape_to_BVH_model.h>
#include <fcl_fibers/contact_collector.h>
#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kHead = 0.1;    // radius of the head
constexpr double kCable = 0.01;  // radius of the cable
constexpr double kStep = 0.01;   // length of a segment

/// Winds from 40 degrees off one pole to 40 off the other, a twentieth too close for the cable's
/// thickness, pressed 2 mm into the head.
fcl_fibers::FiberPolylines wound() {
  fcl_fibers::FiberPolylines scene;
  const double distance = kHead + kCable - 0.002;
  const double winding = 0.95 * 2 * kCable / distance;  // from one turn to the next, in radians
  for (double polar = 40 * kPi / 180; polar < 140 * kPi / 180;) {
    const double turn = 2 * kPi * polar / winding;
    scene.points.push_back({distance * std::sin(polar) * std::cos(turn),
                            distance * std::sin(polar) * std::sin(turn),
                            distance * std::cos(polar)});
    polar += winding * kStep / (2 * kPi * distance * std::sin(polar));
  }
  scene.point_begin.push_back(scene.points.size());
  scene.radius = kCable;
  return scene;
}

}  // namespace

int main() {
  const fcl_fibers::FiberPolylines scene = wound();
  const auto cable = fcl_fibers::makeObjects<double>(scene);

  const auto mesh = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  fcl::generateBVHModel(*mesh, fcl::Sphered(kHead), fcl::Transform3d::Identity(), 32, 32);
  fcl::CollisionObjectd head(mesh);

  // Bent back as tightly as its thickness lets it, the cable meets itself after half a circle of
  // its own radius; nearer along it, segments overlap only because they are thick.
  fcl_fibers::FiberManagerOptions options;
  options.report = fcl_fibers::Report::kCapsules;
  options.ignored_arc_length = kPi * kCable;

  fcl_fibers::LayeredAABBTreeCollisionManagerd manager(options);
  for (const auto& fiber : fcl_fibers::objectsByFiber(scene, cable)) {
    manager.registerFiber(fiber.objects, fiber.ends);
  }
  manager.registerObject(&head);

  using Collector = fcl_fibers::ContactCollector<double>;
  Collector collector(manager);
  manager.collide(&collector, Collector::callback);

  std::size_t with_head = 0;
  const fcl_fibers::Contact *deepest = nullptr, *at_head = nullptr;
  for (const auto& contact : collector.contacts()) {
    if (contact.object_b == &head) {
      ++with_head;
      if (at_head == nullptr) at_head = &contact;
    } else if (deepest == nullptr || contact.distance < deepest->distance) {
      deepest = &contact;
    }
  }
  std::printf("%zu segments, %zu contacts of the cable with itself, %zu with the head\n",
              cable.size(), collector.contacts().size() - with_head, with_head);
  if (deepest == nullptr || at_head == nullptr) return 1;
  std::printf(
      "deepest: segment %zu at %.2f and segment %zu at %.2f, by %.2f mm from (%.4f, %.4f, "
      "%.4f) along (%.3f, %.3f, %.3f)\n",
      deepest->a.segment, deepest->s, deepest->b.segment, deepest->t, -1000 * deepest->distance,
      deepest->point_a[0], deepest->point_a[1], deepest->point_a[2], deepest->normal[0],
      deepest->normal[1], deepest->normal[2]);
  // FCL finds contacts of a mesh triangle by triangle; their depth is not the depth in the head.
  std::printf("head: segment %zu at %.2f, at (%.4f, %.4f, %.4f)\n", at_head->a.segment, at_head->s,
              (at_head->point_a[0] + at_head->point_b[0]) / 2,
              (at_head->point_a[1] + at_head->point_b[1]) / 2,
              (at_head->point_a[2] + at_head->point_b[2]) / 2);
  return 0;
}
