// SPDX-License-Identifier: BSD-3-Clause

// A robot's arm leans back against a harness of cables. The arm is of triangle meshes. In each
// step: what touches, and how deep, or how near is the arm? Lengths are in metres.
//
//     harness [FOLDER]    also writes what tutorials.py draws to the folder
#include <algorithm>
#include <cstdint>
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
using Contact = fcl_fibers::ObjectContact<double>;
using Object = fcl::CollisionObjectd;
using Model = fcl::BVHModel<fcl::OBBRSSd>;
using Vector = fcl::Vector3d;

/// Ten cables in two layers, from the foot of the arm to a rail behind it: cubic curves.
fcl_fibers::FiberPolylines cables() {
  fcl_fibers::FiberPolylines harness;
  harness.radius = 0.006;
  for (int cable = 0; cable < 10; ++cable) {
    // Off the middle of the arm, so that no two of its triangles are equally deep.
    const double y = 0.02 * (cable % 5 - 2) + 0.003, behind = -0.02 * (cable / 5);
    const Vector begin(-0.1, y, 0.08 + behind), end(-0.25 + behind, y, 1.15);
    const Vector near_begin = begin + Vector(-0.3, 0, 0), near_end = end + Vector(0, 0, -0.7);
    for (int i = 0; i <= 60; ++i) {
      const double t = i / 60.0, u = 1 - t;
      const Vector p = u * u * u * begin + 3 * u * u * t * near_begin + 3 * u * t * t * near_end +
                       t * t * t * end;
      harness.points.push_back({p.x(), p.y(), p.z()});
    }
    harness.point_begin.push_back(harness.points.size());
  }
  return harness;
}

constexpr const char* kNames[] = {"foot", "upper arm", "elbow", "forearm", "hand"};

/// A link along z, in the frame of its joint.
template <class Shape>
Object link(const Shape& shape, double middle) {
  const auto mesh = std::make_shared<Model>();
  const fcl::Transform3d pose(Eigen::Translation3d(0, 0, middle));
  fcl::generateBVHModel(*mesh, shape, pose, 32, 16);
  return Object(mesh);
}

std::vector<Object> makeLinks() {
  return {link(fcl::Cylinderd(0.12, 0.2), 0.1), link(fcl::Cylinderd(0.05, 0.45), 0.225),
          link(fcl::Sphered(0.07), 0), link(fcl::Cylinderd(0.04, 0.35), 0.175),
          link(fcl::Ellipsoidd(0.04, 0.06, 0.08), 0)};
}

/// The poses of the links when the arm leans back.
std::vector<fcl::Transform3d> poses(double degrees) {
  constexpr double kDegree = 3.14159265358979323846 / 180;
  const Eigen::AngleAxisd back(-degrees * kDegree, Vector::UnitY()),
      forward(15 * kDegree, Vector::UnitY());
  const fcl::Transform3d foot = fcl::Transform3d::Identity(),
                         upper = foot * Eigen::Translation3d(0, 0, 0.2) * back,
                         elbow = upper * Eigen::Translation3d(0, 0, 0.45),
                         forearm = elbow * forward;
  return {foot, upper, elbow, forearm, forearm * Eigen::Translation3d(0, 0, 0.35)};
}

// [nearest]
struct Nearest {
  const Manager& arm;
  const Object *segment = nullptr, *link = nullptr;
  fcl_fibers::MeshContact contact = {};
  std::vector<fcl_fibers::MeshContact> found = {};
};

bool keepNearest(Object* segment, Object* link, void* cdata, double& least) {
  auto& nearest = *static_cast<Nearest*>(cdata);
  nearest.arm.findMeshContacts(segment, link, 0, nearest.found);
  const fcl_fibers::MeshContact& contact = nearest.found.front();  // the only one if none touches
  if (contact.distance >= least) return false;
  least = contact.distance;  // from here on the manager skips pairs that are not nearer
  nearest.segment = segment;
  nearest.link = link;
  nearest.contact = contact;
  return false;
}
// [nearest]

/// Whether p is the better way out of a convex link than q. If the axis of the cable is in the
/// link, the shortest way out counts, else the nearest triangle.
bool isBetter(const Contact& p, const Contact& q) {
  if (p.solid != q.solid) return p.solid;
  return p.solid ? p.distance > q.distance : p.distance < q.distance;
}

/// The best way out for each segment and link that touch.
std::vector<Contact> waysOut(const std::vector<Contact>& contacts) {
  std::vector<Contact> ways;
  for (const Contact& contact : contacts) {  // those of one pair follow each other
    if (ways.empty() || ways.back().object_a != contact.object_a ||
        ways.back().object_b != contact.object_b) {
      ways.push_back(contact);
    } else if (isBetter(contact, ways.back())) {
      ways.back() = contact;
    }
  }
  return ways;
}

/// Writes the corners of each link and the shortest line as lines, and contacts as points.
void write(const std::string& path, const std::vector<Object>& links, const Nearest& nearest,
           const std::vector<Contact>& contacts) {
  fcl_fibers::FiberPolylines lines;
  for (const Object& link : links) {
    const auto& mesh = static_cast<const Model&>(*link.collisionGeometry());
    for (int i = 0; i < mesh.num_vertices; ++i) {
      const Vector p = link.getTransform() * mesh.vertices[i];
      lines.points.push_back({p.x(), p.y(), p.z()});
    }
    lines.point_begin.push_back(lines.points.size());
  }
  lines.points.insert(lines.points.end(), {nearest.contact.point_a, nearest.contact.point_b});
  lines.point_begin.push_back(lines.points.size());
  fcl_fibers::io::exportFibers(path + "_fibers.vtp", cables());
  fcl_fibers::io::exportFibers(path + "_links.vtp", lines);
  fcl_fibers::io::exportContacts(path + "_contacts.vtp", {contacts.begin(), contacts.end()});
}

}  // namespace

int main(int argc, char** argv) {
  // [managers]
  fcl_fibers::FiberManagerOptions options;
  options.report = fcl_fibers::Report::kCapsules;

  constexpr std::uint32_t kFoot = 1, kMoving = 2;  // categories
  Manager arm(options);
  std::vector<Object> links = makeLinks();
  for (Object& link : links) {
    // Solid: a cable that is wholly inside a link touches it, too.
    arm.registerObstacle(&link, {/*solid=*/true, &link == &links[0] ? kFoot : kMoving});
  }

  Manager harness(options);
  const auto objects = fcl_fibers::makeObjects<double>(cables());
  fcl_fibers::FiberObstacles obstacles;
  obstacles.meets = kMoving;  // the cables are plugged into the foot
  for (const auto& cable : fcl_fibers::objectsByFiber(cables(), objects)) {
    harness.registerFiber(cable.objects, cable.ends, {}, obstacles);
  }
  // [managers]

  Collector touching(harness, &arm);
  for (int degrees = 12; degrees <= 24; degrees += 2) {
    // [move]
    const std::vector<fcl::Transform3d> now = poses(degrees);
    for (std::size_t i = 0; i < links.size(); ++i) links[i].setTransform(now[i]);
    arm.update();  // reads the poses; the trees of the meshes stay
    // [move]

    // [ask]
    touching.clear();
    harness.collide(&arm, &touching, Collector::callback);
    const std::vector<Contact> ways = waysOut(touching.contacts());

    Nearest nearest = {arm};
    if (ways.empty()) harness.distance(&arm, &nearest, keepNearest);
    // [ask]

    if (ways.empty()) {
      const fcl_fibers::FiberSegment place = harness.fiberSegment(nearest.segment);
      const auto& [x, y, z] = nearest.contact.point_b;
      std::printf(
          "%d degrees: %.1f mm between cable %zu, segment %zu, and the %s at (%.3f, %.3f, %.3f)\n",
          degrees, 1000 * nearest.contact.distance, place.fiber, place.number,
          kNames[arm.fiberSegment(nearest.link).fiber], x, y, z);
    } else {
      const Contact& deepest = *std::min_element(
          ways.begin(), ways.end(),
          [](const Contact& p, const Contact& q) { return p.distance < q.distance; });
      const auto& [x, y, z] = deepest.normal;  // from the cable into the link
      std::printf(
          "%d degrees: %zu contacts, %zu segments touch a link; the deepest is %.1f mm in the %s: "
          "cable %zu, segment %zu, normal (%.2f, %.2f, %.2f)\n",
          degrees, touching.contacts().size(), ways.size(), -1000 * deepest.distance,
          kNames[deepest.b.fiber], deepest.a.fiber, deepest.a.number, x, y, z);
    }
    if (argc < 2) continue;
    const std::string path = std::string(argv[1]) + "/harness_" + std::to_string(degrees);
    write(path, links, nearest, touching.contacts());
  }
  return 0;
}
