// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

#include "harness/runs.h"
#include "measures.h"
#include "measures/boxed_object.h"
#include "measures/meshes.h"
#include "measures/nearest.h"
#include "scenes/random.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 9, kSlowRuns = 5, kTries = 3;
constexpr double kSlow = 1;  // seconds
constexpr int kLinks = 20, kSegments = 100;
constexpr double kLink = 0.1;                         // m, from one link to the next
constexpr Point kLinkRadii = {0.04, 0.04, 0.06};      // m
constexpr double kRadius = 0.004, kClearance = 0.06;  // m, of cables; from the arm's axis

/// A curve along which the arm lies: its pose at `length` from the base, with z along it. The arm
/// bends more and more, by `bend` rad per metre at first.
fcl::Transform3d along(double length, double bend) {
  constexpr int kSteps = 20;  // for each link
  fcl::Transform3d pose = fcl::Transform3d::Identity();
  const double step = kLink / kSteps;
  for (double at = 0; at < length; at += step) {
    const double way = std::min(step, length - at);
    pose.translate(fcl::Vector3d(0, 0, way));
    pose.rotate(fcl::AngleAxisd(way * bend * (1 + at), fcl::Vector3d(0.6, 0.8, 0)));
  }
  return pose;
}

std::vector<fcl::Transform3d> armPoses(double bend) {
  std::vector<fcl::Transform3d> poses;
  for (int i = 0; i < kLinks; ++i) poses.push_back(along((i + 0.5) * kLink, bend));
  return poses;
}

/// Cables that wind along the arm, each at a distance of its own from the axis.
FiberPolylines makeCables(int count, double bend) {
  std::vector<fcl::Transform3d> poses;
  for (int i = 0; i <= kSegments; ++i) poses.push_back(along(i * kLinks * kLink / kSegments, bend));
  FiberPolylines cables;
  cables.radius = kRadius;
  for (int f = 0; f < count; ++f) {
    scenes::Random random = scenes::fiberRandom(1, static_cast<std::size_t>(f));
    const double across = kClearance + 0.1 * random.uniform(), turn = 6.3 * random.uniform();
    const double winding = 0.04 * random.normal();
    for (int i = 0; i <= kSegments; ++i) {
      const double angle = turn + winding * i;
      const fcl::Vector3d p = poses[static_cast<std::size_t>(i)] *
                              fcl::Vector3d(across * std::cos(angle), across * std::sin(angle), 0);
      cables.points.push_back({p.x(), p.y(), p.z()});
    }
    cables.point_begin.push_back(cables.points.size());
  }
  return cables;
}

/// Cables that stand still, and an arm that comes from a pose nearby.
struct Scene {
  explicit Scene(const Request& request)
      : cables(makeCables(request.cables, kBend)),
        objects("cables", cables, cables),
        link(scenes::makeBall(kLinkRadii, request.triangles / kLinks)),
        meshes(kLinks, TriangleMesh(link.arrays())) {
    const auto model = modelOf<fcl::RSSd>(link);
    for (int i = 0; i < kLinks; ++i) {
      links.push_back(std::make_unique<BoxedObject>(model, rest[0]));
      arm.push_back(links.back().get());
    }
  }

  /// With FCL's boxes, which ours may find.
  void setPoses(const std::vector<fcl::Transform3d>& poses) {
    for (std::size_t i = 0; i < poses.size(); ++i) {
      meshes[i].setPose(toMeshPose(poses[i]));
      arm[i]->setTransform(poses[i]);
      arm[i]->computeAABB();
    }
  }

  /// The distance, by the judge: that of all segments and all triangles.
  double distance() const {
    double least = std::numeric_limits<double>::infinity();
    const std::vector<Capsule> capsules = objects.capsules();
    for (const fcl::Transform3d& pose : rest) {
      const std::vector<Corners> corners = cornersOf(link, pose);
      for (const Capsule& capsule : capsules) {
        const double limit = least + capsule.radius;
        least = std::min(least, meshDistance(capsule, corners, limit) - capsule.radius);
      }
    }
    return least;
  }

  static constexpr double kBend = 0.5;
  std::vector<fcl::Transform3d> rest = armPoses(kBend), before = armPoses(0.49);
  FiberPolylines cables;
  MovingFibers objects;
  scenes::Triangles link;
  std::vector<TriangleMesh> meshes;
  std::vector<std::unique_ptr<BoxedObject>> links;
  std::vector<Object*> arm;
};

/// The poses of the arm, and the least of the distances to its links.
double byArrays(Scene& scene, const FiberTree& tree, double& distance) {
  const Contacts<double> question{fiberArrays(scene.cables)};
  return seconds([&] {
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
      scene.meshes[i].setPose(toMeshPose(scene.rest[i]));
    }
    distance = std::numeric_limits<double>::infinity();
    for (const TriangleMesh& mesh : scene.meshes) {
      distance = std::min(distance, tree.closest(question, mesh).distance);
    }
  });
}

/// The poses of the arm, its manager's update, and the distance of the two managers.
double byManagers(Scene& scene, const Contender& contender, const Manager& cables, Manager& arm,
                  double& distance) {
  for (const auto& link : scene.links) link->computeBox(contender);
  arm.update();
  return seconds([&] {
    for (std::size_t i = 0; i < scene.links.size(); ++i) {
      scene.links[i]->setTransform(scene.rest[i]);
      scene.links[i]->computeBox(contender);
    }
    arm.update();
    Nearest nearest;
    cables.distance(&arm, &nearest, Nearest::callback);
    distance = nearest.distance();
  });
}

using Run = std::function<double(double& distance)>;

/// One who answers as the judge does.
struct Checked {
  std::string name;
  std::function<double(Numbers&)> run;
  double seconds;
};

/// Throws std::runtime_error if the answer is another one.
Checked check(Scene& scene, const std::string& name, const Run& run, double truth) {
  tools::progress("cables: check " + name);
  const auto checked = [run, truth, &scene](Numbers& numbers) {
    scene.setPoses(scene.before);
    double& distance = numbers["distance"];
    const double taken = run(distance);
    // FCL iterates to 1e-6, in the unit of the scene.
    if (std::abs(distance - truth) > 1e-5) {
      throw std::runtime_error("finds " + std::to_string(distance) + " instead of " +
                               std::to_string(truth));
    }
    return taken;
  };
  Numbers numbers;
  double least = checked(numbers);
  for (int tries = 1; tries < kTries; ++tries) least = std::min(least, checked(numbers));
  return {name, checked, least};
}

void registerChecked(const Checked& checked, bool ours) {
  const int runs = runsOf(ours, checked.seconds > kSlow ? kSlowRuns : kRuns);
  registerRuns("Distance/" + checked.name, runs, checked.run, ours);
}

bool measureCables(const Request& request) {
  tools::progress("cables: make the scene");
  Scene scene(request);
  scene.objects.bringTo(0, Boxes::kTight);
  scene.setPoses(scene.rest);
  const double truth = scene.distance();
  registerNumbers("Judged/cables",
                  {{"distance", truth},
                   {"segments", static_cast<double>(scene.cables.segmentCount())},
                   {"fibers", static_cast<double>(scene.cables.fiberCount())},
                   {"triangles", static_cast<double>(scene.meshes[0].triangleCount())},
                   {"meshes", kLinks}});

  std::vector<Checked> trees;
  for (const Contender& contender :
       allOf({Group::kFclTuned, Group::kFclNeverRebuilt}, Boxes::kTight)) {
    const std::shared_ptr<Manager> cables = contender.setUp(scene.objects.objects());
    const std::shared_ptr<Manager> arm = contender.setUp(scene.arm);
    trees.push_back(check(
        scene, contender.name(),
        [=, &scene](double& distance) {
          return byManagers(scene, contender, *cables, *arm, distance);
        },
        truth));
  }
  registerChecked(
      *std::min_element(trees.begin(), trees.end(),
                        [](const Checked& a, const Checked& b) { return a.seconds < b.seconds; }),
      false);

  // Ours would take the tight boxes for what a program has made of FCL's.
  scene.objects.bringTo(0, Boxes::kNone);
  const auto tree = makeTree(fiberArrays(scene.cables), {touchingOptions()});
  const auto with_arrays = [=, &scene](double& distance) {
    return byArrays(scene, *tree, distance);
  };
  registerChecked(check(scene, "arrays", with_arrays, truth), true);
  Contender ours = ourContender("LayeredAABBTree/capsules");
  ours.leaves_out_adjacent = true;  // registers fibers as fibers; by its options it leaves none out
  const std::shared_ptr<Manager> cables = ours.setUp(scene.objects), arm = ours.setUp(scene.arm);
  const auto with_managers = [=, &scene](double& distance) {
    return byManagers(scene, ours, *cables, *arm, distance);
  };
  registerChecked(check(scene, "manager", with_managers, truth), true);
  return runRegistered();
}

const AddMeasure kMeasure("cables", measureCables);

}  // namespace

}  // namespace fcl_fibers::benchmarks
