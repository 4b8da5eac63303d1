// SPDX-License-Identifier: BSD-3-Clause

// One long cable wound about a head: where it touches itself, and where it touches the head, a mesh
// in the same manager. Lengths in metres.
#include <cmath>
#include <cstdio>
#include <memory>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/geometric_shape_to_BVH_model.h>
#include <fcl_fibers/contact_collector.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/scenes/fiber_scene.h>

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kHead = 0.1;    // radius of the head
constexpr double kCable = 0.01;  // radius of the cable
constexpr double kStep = 0.01;   // length of a segment

/// Winds from 40 degrees off one pole to 40 off the other, a twentieth too close for the cable's
/// thickness, pressed 2 mm into the head.
fcl_fibers::scenes::FiberScene wound() {
  fcl_fibers::scenes::FiberScene scene;
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

/// How many contacts of one kind, and where they are deepest.
class Summary {
 public:
  explicit Summary(const char* name) : name_(name) {}

  void add(const fcl_fibers::Contact& contact) {
    ++count_;
    if (count_ == 1 || contact.distance < deepest_.distance) deepest_ = contact;
  }

  /// Returns whether there is a contact.
  bool print() const {
    std::printf("%s: %zu contacts", name_, count_);
    if (count_ > 0) {
      const fcl_fibers::Contact& c = deepest_;
      std::printf(
          ", the deepest at %.2f of segment %zu by %.2f mm, from (%.4f, %.4f, %.4f) along (%.3f, "
          "%.3f, %.3f)",
          c.s, c.a.segment, -1000 * c.distance, c.point_a[0], c.point_a[1], c.point_a[2],
          c.normal[0], c.normal[1], c.normal[2]);
    }
    std::printf("\n");
    return count_ > 0;
  }

 private:
  const char* name_;
  std::size_t count_ = 0;
  fcl_fibers::Contact deepest_;
};

}  // namespace

int main() {
  const fcl_fibers::scenes::FiberScene scene = wound();
  const auto cable = fcl_fibers::scenes::makeObjects<double>(scene);

  const auto mesh = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  fcl::generateBVHModel(*mesh, fcl::Sphered(kHead), fcl::Transform3d::Identity(), 32, 32);
  fcl::CollisionObjectd head(mesh);

  // Bent back as tightly as its thickness lets it, the cable meets itself after half a circle of
  // its own radius; nearer along it, segments overlap only because they are thick.
  fcl_fibers::FiberManagerOptions options;
  options.report = fcl_fibers::Report::kCapsules;
  options.ignored_arc_length = kPi * kCable;

  fcl_fibers::LayeredAABBTreeCollisionManagerd manager(options);
  for (const auto& fiber : fcl_fibers::scenes::objectsByFiber(scene, cable)) {
    manager.registerFiber(fiber.objects, fiber.ends);
  }
  manager.registerObject(&head);

  using Collector = fcl_fibers::ContactCollector<double>;
  Collector collector(manager);
  manager.collide(&collector, Collector::callback);

  Summary with_itself("with itself"), with_head("with the head");
  for (const auto& contact : collector.contacts()) {
    (contact.object_b == &head ? with_head : with_itself).add(contact);
  }
  std::printf("%zu segments of cable\n", cable.size());
  return with_itself.print() && with_head.print() ? 0 : 1;
}
