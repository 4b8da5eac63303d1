// SPDX-License-Identifier: BSD-3-Clause

// A harness of three cables on a robot's arm: how near do the cables come to the arm while the
// elbow bends? Lengths are in metres.
//
//     harness [FOLDER]    also writes what tutorials.py draws to the folder
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/geometric_shape_to_BVH_model.h>
#include <fcl/narrowphase/distance.h>
#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/io/export_geometry.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

namespace {

using Manager = fcl_fibers::LayeredAABBTreeCollisionManagerd;
using Vector = fcl::Vector3d;

constexpr std::size_t kSegments = 40;  // of a cable
constexpr double kCable = 0.006;       // radius of a cable
constexpr double kArm = 0.05;          // half the width of a link
constexpr double kDegree = 3.14159265358979323846 / 180;

/// The pose of the forearm. Its joint is the origin, and the upper arm is along -x.
fcl::Transform3d bentBy(double degrees) {
  return fcl::Transform3d(Eigen::AngleAxisd(degrees * kDegree, Vector::UnitY()));
}

// [cables]
/// Three cables over the elbow, from clips on the upper arm to clips on the forearm: cubic curves.
fcl_fibers::FiberPolylines cables(double degrees) {
  fcl_fibers::FiberPolylines harness;
  harness.radius = kCable;
  for (int cable = 0; cable < 3; ++cable) {
    const double y = 0.02 * (cable - 1), rise = 0.1 + 0.005 * cable;
    const Vector begin(-0.2, y, kArm + kCable), end(0.23, y, kArm + kCable);
    const Vector near_begin = begin + Vector(0.1, 0, rise), near_end = end + Vector(-0.1, 0, rise);
    const fcl::Transform3d forearm = bentBy(degrees);
    for (std::size_t i = 0; i <= kSegments; ++i) {
      const double t = static_cast<double>(i) / kSegments, u = 1 - t;
      const Vector p = u * u * u * begin + 3 * u * u * t * near_begin +
                       3 * u * t * t * (forearm * near_end) + t * t * t * (forearm * end);
      harness.points.push_back({p.x(), p.y(), p.z()});
    }
    harness.point_begin.push_back(harness.points.size());
  }
  return harness;
}
// [cables]

std::shared_ptr<fcl::CollisionGeometryd> linkMesh(double middle) {
  auto mesh = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  const fcl::Transform3d pose(Eigen::Translation3d(middle, 0, 0));
  fcl::generateBVHModel(*mesh, fcl::Boxd(0.3, 2 * kArm, 2 * kArm), pose);
  return mesh;
}

// [nearest]
struct Nearest {
  const Manager& cables;
  const fcl::CollisionObjectd &upper, &forearm;
  const fcl::CollisionObjectd* link = nullptr;
  fcl_fibers::Contact contact = {};  // of the nearest pair so far
};

/// A cable may touch the link that it is clipped to, with a quarter of its length.
bool mayTouch(const Nearest& nearest, fcl_fibers::FiberSegment place,
              const fcl::CollisionObjectd* link) {
  return (link == &nearest.upper && place.segment < kSegments / 4) ||
         (link == &nearest.forearm && place.segment >= kSegments - kSegments / 4);
}

bool keepNearest(fcl::CollisionObjectd* segment, fcl::CollisionObjectd* link, void* cdata,
                 double& least) {
  auto& nearest = *static_cast<Nearest*>(cdata);
  const fcl_fibers::FiberSegment place = nearest.cables.fiberSegment(segment);
  if (mayTouch(nearest, place, link)) return false;

  fcl::DistanceRequestd request;
  request.enable_nearest_points = true;
  fcl::DistanceResultd result;
  // The mesh comes first. Otherwise FCL exchanges the two, and their nearest points with them.
  const double distance = fcl::distance(link, segment, request, result);
  if (distance >= least) return false;
  least = distance;  // from here on the manager skips pairs that are not nearer
  nearest.link = link;
  nearest.contact.a = place;
  nearest.contact.distance = distance;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    nearest.contact.point_a[i] = result.nearest_points[1][axis];
    nearest.contact.point_b[i] = result.nearest_points[0][axis];
  }
  return false;
}
// [nearest]

}  // namespace

int main(int argc, char** argv) {
  // [managers]
  fcl::CollisionObjectd upper(linkMesh(-0.15)), forearm(linkMesh(0.15));
  fcl::CollisionObjectd elbow(std::make_shared<fcl::Boxd>(0.12, 0.12, 0.12));
  fcl::DynamicAABBTreeCollisionManagerd arm;  // one of FCL's, as robots have
  arm.registerObjects({&upper, &forearm, &elbow});
  arm.setup();

  const auto objects = fcl_fibers::makeObjects<double>(cables(0));
  Manager harness;
  for (const auto& cable : fcl_fibers::objectsByFiber(cables(0), objects)) {
    // One group: the cables are tied together, so that they are not paired with each other.
    harness.registerFiber(cable.objects, cable.ends, fcl_fibers::FiberGroup{1});
  }
  // [managers]

  // [motion]
  for (int degrees = 0; degrees <= 40; degrees += 10) {
    forearm.setTransform(bentBy(degrees));
    elbow.setTransform(bentBy(degrees / 2.0));
    for (fcl::CollisionObjectd* link : {&forearm, &elbow}) link->computeAABB();  // for FCL's
    arm.update();
    fcl_fibers::moveObjects(cables(degrees), objects);
    harness.update();

    Nearest nearest = {harness, upper, forearm};
    harness.distance(&arm, &nearest, keepNearest);  // and not arm.distance(&harness, ...)
    const auto& [x, y, z] = nearest.contact.point_a;
    std::printf(
        "bent by %2d: %4.1f mm from cable %zu, segment %zu, to the %s, at (%.3f, %.3f, %.3f)\n",
        degrees, 1000 * nearest.contact.distance, nearest.contact.a.fiber,
        nearest.contact.a.segment,
        nearest.link == &elbow   ? "elbow"
        : nearest.link == &upper ? "upper arm"
                                 : "forearm",
        x, y, z);
    if (argc < 2) continue;
    const std::string name = std::string(argv[1]) + "/harness_" + std::to_string(degrees);
    fcl_fibers::io::exportFibers(name + "_fibers.vtp", cables(degrees));
    fcl_fibers::io::exportContacts(name + "_contacts.vtp", {nearest.contact});
  }
  // [motion]
  return 0;
}
